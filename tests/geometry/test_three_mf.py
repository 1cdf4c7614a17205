"""3MF: what a package builds, its properties, names by slicers; and packages that are hostile."""

from pathlib import Path

import numpy as np
import pytest
from gltf_models import BOX, BOX_TRIANGLES
from three_mf_packages import CORE, mesh, model, package, placed

from upholster.apps.studio.folder import file_kind
from upholster.base.errors import FormatError, InputError
from upholster.geometry.model_files.model_file import ModelFile
from upholster.geometry.model_files.model_reader import read_model


def read(folder: Path, data: str | bytes, **files: str) -> ModelFile:
    path = folder / "thing.3mf"
    path.write_bytes(package(data, **files) if isinstance(data, str) else data)
    return read_model(path)


def boxes(found: ModelFile) -> list[list[list[float]]]:
    """The bounding box of each part."""
    mesh = found.mesh
    each = [mesh.positions[np.unique(mesh.triangles[mesh.part == n])] for n in range(len(found.parts))]
    return [[points.min(axis=0).tolist(), points.max(axis=0).tolist()] for points in each]


def volume(found: ModelFile) -> float:
    a, b, c = found.mesh.corners.transpose(1, 0, 2)
    return float((a * np.cross(b, c)).sum() / 6)


def test_placed_objects_are_where_their_transforms_put_them(tmp_path: Path) -> None:
    inner = placed(
        'id="2" name="Wheels"',
        'objectid="1" transform="2 0 0 0 2 0 0 0 2 10 0 0"',
        'objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"',
    )
    text = model(
        mesh() + inner,
        'objectid="2" transform="0 1 0 -1 0 0 0 0 1 0 0 5"',
        'objectid="1" partnumber="Box"',
        attributes='unit="inch"',
    )
    found = read(tmp_path, text)
    assert found.up == "z"
    assert found.mesh.metres == 0.0254
    assert [part.name for part in found.parts] == ["Wheels", "Wheels 2", "Box"]
    assert boxes(found) == [[[-2, 10, 5], [0, 12, 7]], [[-1, -1, 5], [0, 0, 6]], [[0, 0, 0], [1, 1, 1]]]
    assert volume(found) == pytest.approx(10)


def test_objects_in_other_files_are_found_by_path(tmp_path: Path) -> None:
    text = model(placed('id="7"', 'objectid="1" p:path="/3D/Objects/a.model"'), 'objectid="7"')
    found = read(tmp_path, text, **{"3d__objects__A.model": model(mesh('id="1" name="Lid"'))})
    assert [part.name for part in found.parts] == ["Lid"]
    with pytest.raises(FormatError, match=r"a\.model: the package has no such file"):
        read(tmp_path, text)


def test_the_root_is_what_the_relations_name(tmp_path: Path) -> None:
    relations = (
        '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship '
        'Target="/x.model" Id="a" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
        "</Relationships>"
    )
    files = {"_rels__.rels": relations, "x.model": model(mesh(), 'objectid="1"')}
    assert len(read(tmp_path, "not a model", **files).mesh.triangles) == 12


PROPERTIES = (
    '<basematerials id="10"><base name="Oak" displaycolor="#FF0000"/><base name="Ash"/></basematerials>'
    '<m:colorgroup id="11"><m:color color="#000000"/><m:color color="#00FF0080"/></m:colorgroup>'
    '<m:texture2d id="12" path="/3D/Textures/brick.png" contenttype="image/png"/>'
    '<m:texture2dgroup id="13" texid="12"><m:tex2coord u="0.25" v="0.75"/><m:tex2coord u="1" v="0"/>'
    "</m:texture2dgroup>"
    '<basematerials id="14"><base name="A" displaycolor="#000000"/><base name="B" displaycolor="#0000FF"/>'
    "</basematerials>"
    '<m:compositematerials id="15" matid="14" matindices="0 1"><m:composite values="0.25 0.75"/>'
    "</m:compositematerials>"
    '<m:multiproperties id="16" pids="10 13 11"><m:multi pindices="1 1 1"/></m:multiproperties>'
)


def test_materials_colors_and_coordinates_are_read(tmp_path: Path) -> None:
    own = ("", 'pid="11" p1="0" p2="1" p3="0"', 'pid="13" p1="0" p2="1" p3="7"', 'pid="15" p1="0"')
    more = (*own, 'pid="16" p1="0"', 'p1="1"', 'pid="99" p1="0"')
    found = read(tmp_path, model(PROPERTIES + mesh('id="1" pid="10" pindex="0"', more=more), 'objectid="1"'))
    assert {part.material for part in found.parts} == {"", "Oak", "Ash", "brick", "B"}
    corner = {part.material: found.mesh.part == n for n, part in enumerate(found.parts)}
    assert found.colors is not None
    assert found.uv is not None
    colors = {name: found.colors[mine] for name, mine in corner.items()}
    np.testing.assert_array_equal(colors["Oak"], np.full((6, 3, 3), (1, 0, 0)))
    np.testing.assert_array_equal(colors[""][0], [(0, 0, 0), (0, 1, 0), (0, 0, 0)])
    assert np.isnan(colors[""][1]).all()
    np.testing.assert_allclose(colors["B"], np.full((1, 3, 3), (0, 0, 0.75)))
    np.testing.assert_array_equal(colors["Ash"][0], [(0, 1, 0)] * 3)
    np.testing.assert_array_equal(found.uv[corner["brick"]][0], [(0.25, 0.25), (1, 1), (np.nan, np.nan)])
    np.testing.assert_array_equal(found.uv[corner["Ash"]][0], [(1, 1)] * 3)
    assert np.isnan(colors["Ash"][1]).all()
    assert found.mesh.uv is None


def test_the_corners_of_a_mirrored_object_keep_their_properties(tmp_path: Path) -> None:
    own = ('pid="11" p1="0" p2="1" p3="0"',)
    found = read(
        tmp_path,
        model(PROPERTIES + mesh(more=own), 'objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"'),
    )
    assert found.colors is not None
    green = np.argwhere(found.colors[..., 1] == 1)
    (place,) = found.mesh.positions[found.mesh.triangles[tuple(green.T)]]
    np.testing.assert_array_equal(place, BOX[BOX_TRIANGLES[0, 1]] * (-1, 1, 1))


def test_volumes_of_a_slicer_are_parts_and_its_modifiers_are_left_out(tmp_path: Path) -> None:
    settings = (
        '<config><object id="1"><metadata type="object" key="name" value="Vase"/>'
        '<volume firstid="0" lastid="3"><metadata key="name" value="Foot"/>'
        '<metadata key="volume_type" value="ModelPart"/></volume>'
        '<volume firstid="4" lastid="9"><metadata key="name" value="Body"/></volume>'
        '<volume firstid="10" lastid="11"><metadata key="name" value="Blocker"/>'
        '<metadata key="volume_type" value="SupportBlocker"/></volume></object></config>'
    )
    found = read(tmp_path, model(mesh(), 'objectid="1"'), **{"Metadata__Slic3r_PE_model.config": settings})
    assert [part.name for part in found.parts] == ["Foot", "Body"]
    assert [part.fits("vase") for part in found.parts] == [True, True]
    assert np.bincount(found.mesh.part).tolist() == [4, 6]
    assert any("Blocker" in note for note in found.notes)


def test_names_of_components_by_a_slicer(tmp_path: Path) -> None:
    settings = (
        '<config><object id="3"><metadata key="name" value="Gnome"/>'
        '<part id="1" subtype="normal_part"><metadata key="name" value="Hat"/></part>'
        '<part id="2" subtype="negative_part"><metadata key="name" value="Hole"/></part></object>'
        '<plate><metadata key="plater_name" value="X"/></plate></config>'
    )
    parts = [f'objectid="{n}" p:path="/3D/Objects/o.model"' for n in (1, 2)]
    found = read(
        tmp_path,
        model(placed('id="3"', *parts), 'objectid="3"'),
        **{
            "3D__Objects__o.model": model(mesh() + mesh('id="2"')),
            "Metadata__model_settings.config": settings,
        },
    )
    assert [(part.name, part.names) for part in found.parts] == [("Hat", ("Hat", "Gnome"))]
    assert any("Hole" in note for note in found.notes)


def test_supports_are_left_out_and_beams_are_named(tmp_path: Path) -> None:
    beams = '<b:beamlattice xmlns:b="http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"/>'
    text = model(mesh() + mesh('id="2" type="support"') + beams, 'objectid="1"', 'objectid="2"')
    found = read(tmp_path, text)
    assert len(found.parts) == 1
    assert len(found.notes) == 2


def doubling(count: int) -> str:
    rows = [mesh()] + [placed(f'id="{n}"', *[f'objectid="{n - 1}"'] * 2) for n in range(2, count + 1)]
    return model("".join(rows), f'objectid="{count}"')


ENTITIES = '<!DOCTYPE m [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]>'


@pytest.mark.parametrize(
    ("text", "match"),
    [
        (doubling(31), "placed more than 65536 times"),
        (model(placed('id="1"', 'objectid="1"'), 'objectid="1"'), "not in a circle"),
        (model(mesh(), 'objectid="4"'), "object 4 is placed but does not exist"),
        (model(mesh() + mesh(), 'objectid="1"'), "two objects have id 1"),
        (model(mesh()), "it shows no triangles"),
        (ENTITIES + f"<model {CORE}>&b;</model>", "line 1: it has a document type"),
        (model("<a>" * 300 + "</a>" * 300), "deep"),
        (model(f'<a xmlns="{"n" * 2000}"/>'), "a namespace has 2000 characters"),
        (model(f'<a b="{np.random.default_rng(0).bytes(1 << 20).hex()}"/>'), "a tag has more than"),
        (model(mesh().replace("\n", "") + '\n<object id="x"/>'), "line 2: id of object is 'x'"),
        (model(mesh().replace('x="0.0"', 'x="0,5"')), "x of vertex is '0,5'; allowed: a number"),
        (model(mesh().replace('x="0.0"', 'x="nan"'), 'objectid="1"'), "vertex 0 is not finite"),
        (model(mesh().replace('v2="1"', 'v2="8"'), 'objectid="1"'), "names vertex 8; there are 8"),
        (model(mesh().replace('v2="1"', 'v2="-1"'), 'objectid="1"'), "names vertex -1"),
        (model(mesh().replace('v1="0"', ""), 'objectid="1"'), "triangle has no v1"),
        (model("", 'objectid="1" transform="1 0 0"'), "allowed: 12 finite numbers"),
        (model("", attributes='unit="mile"'), "unit is 'mile'"),
        (
            model("", attributes='requiredextensions="v" xmlns:v="http://a/volumetric/1"'),
            "needs the extension 'http://a/volumetric/1'",
        ),
        ("<model/>", "it has no model"),
        ("<model", "its XML is damaged at line 1"),
        (model(f'{PROPERTIES}<m:colorgroup id="20"><m:color color="red"/></m:colorgroup>'), "is 'red'"),
    ],
)
def test_hostile_and_damaged_packages_end_in_one_line(tmp_path: Path, text: str, match: str) -> None:
    with pytest.raises((FormatError, InputError), match=match) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    text = model(mesh() + " " * (9 << 20), 'objectid="1"')
    with pytest.raises(InputError, match=r"it takes 9 MiB; allowed: \d MiB unpacked"):
        read(tmp_path, text)


def test_groups_that_name_each_other_have_no_properties(tmp_path: Path) -> None:
    circle = (
        '<m:multiproperties id="20" pids="21"><m:multi pindices="0"/></m:multiproperties>'
        '<m:multiproperties id="21" pids="20"><m:multi pindices="0"/></m:multiproperties>'
    )
    found = read(tmp_path, model(circle + mesh('id="1" pid="20" pindex="0"'), 'objectid="1"'))
    assert found.colors is None
    assert found.uv is None


def test_damaged_text_ends_in_one_line(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    more = ('pid="11" p1="0" p2="1" p3="0"', 'pid="13" p1="0"', 'pid="15" p1="0"', 'pid="16" p1="0"')
    text = model(PROPERTIES + mesh(more=more) + placed('id="2"', 'objectid="1"'), 'objectid="2"')
    refused = []
    for _ in range(100):
        wrong = list(text)
        for at in rng.integers(0, len(text), 3):
            wrong[at] = str(rng.choice(list('0129-. en"')))
        try:
            read(tmp_path, "".join(wrong))
        except (FormatError, InputError) as error:
            refused.append(str(error))
    assert 20 < len(refused) < 100
    assert not [said for said in refused if "\n" in said]


def test_the_studio_takes_it_as_a_model() -> None:
    assert file_kind("Benchy.3MF") == "model"
