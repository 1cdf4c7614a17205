"""STEP assemblies whose parts are in other files: which files are opened, and what their parts are called."""

import pytest
from cad_models import write_step

from upholster.geometry.model_files.model_reader import read_model

OCP = pytest.importorskip("OCP")


@pytest.fixture
def folder(tmp_path):
    """An assembly in a folder, its parts in files: a box twice, and a ball."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere

    folder = tmp_path / "model"
    folder.mkdir()
    write_step(
        folder / "all.step",
        [
            ("box", (1, 0, 0), BRepPrimAPI_MakeBox(4, 2, 1).Shape(), [(0, 0, 0), (0, 0, 3)]),
            ("ball", (0, 0, 1), BRepPrimAPI_MakeSphere(2).Shape(), [(9, 0, 0)]),
        ],
        files=True,
    )
    assert {file.name for file in folder.iterdir()} == {"all.step", "box.stp", "ball.stp"}
    return folder


def rename(file, to, name="ball.stp"):
    """Let an assembly name another file for a part."""
    file.write_text(file.read_text().replace(f"'{name}'", f"'{to}'"))


def read(path):
    """Return names of parts, notes and files."""
    from OCP.TopAbs import TopAbs_SOLID
    from OCP.TopExp import TopExp_Explorer

    from upholster.geometry.occt.shape_reader import read_shapes

    record, leaves = read_shapes(path, None)
    solid = [leaf.name for leaf in leaves if TopExp_Explorer(leaf.shape, TopAbs_SOLID).More()]
    return solid, record.notes, record.files


def test_parts_are_read_from_files_beside_the_assembly(folder, monkeypatch):
    monkeypatch.chdir(folder.parent)
    model = read_model("model/all.step")
    assert [part.name for part in model.parts] == ["box", "ball"]
    assert len(model.parts[0].names) == 1  # the writer numbered the places: numbers are not names
    assert [part.instances for part in model.parts] == [2, 1]
    assert set(model.inputs[1:]) == {folder / "box.stp", folder / "ball.stp"}


@pytest.mark.parametrize(
    "name",
    ["../ball.stp", "{outside}", r"x\\..\\..\\ball.stp", "C:/../../ball.stp", "link.stp", "gone.stp"],
)
def test_no_file_outside_the_folder_is_opened(folder, name):
    outside = folder.parent / "ball.stp"
    (folder / "ball.stp").rename(outside)
    (folder / "link.stp").symlink_to(outside)
    (folder / "C:").mkdir()
    rename(folder / "all.step", name.format(outside=outside))
    names, notes, files = read(folder / "all.step")
    assert str(outside) not in files
    assert names == ["box", "box"]
    (note,) = notes
    assert note.startswith(
        "parts are missing, because their files are not STEP files in the model's folder: "
    )


def test_a_document_of_a_part_that_has_a_shape_is_not_missed(folder):
    """Design programs name drawings, and files of their own, for parts whose shapes are in the assembly."""
    text = (folder / "box.stp").read_text()
    head, rest = text.split("PRODUCT_DEFINITION('design','',", 1)
    numbers, rest = rest.split(")", 1)
    data, end = rest.split("ENDSEC;\nEND-ISO", 1)
    (folder / "drawn.step").write_text(
        f"{head}PRODUCT_DEFINITION_WITH_ASSOCIATED_DOCUMENTS('design','',{numbers},(#9001)){data}"
        f"#9001 = DOCUMENT('1','../ball.stp','',#9002);\n#9002 = DOCUMENT_TYPE('');\nENDSEC;\nEND-ISO{end}"
    )
    assert read(folder / "drawn.step") == (["box"], [], [])


def test_parts_of_parts_are_read_and_checked(folder):
    from upholster.geometry.occt.shape_reader import UnreadableError

    top = folder / "top.step"
    top.write_text((folder / "all.step").read_text())
    rename(top, "all.step")
    names, notes, files = read(top)
    assert [names.count(name) for name in ("box", "ball")] == [4, 1]
    assert len(files) == 3
    assert not notes
    rename(folder / "all.step", "../ball.stp")
    with pytest.raises(UnreadableError, match=r"refers to '../ball.stp'; allowed: files in the folder"):
        read(top)
    rename(folder / "all.step", "top.step", "../ball.stp")
    with pytest.raises(UnreadableError, match=r"names itself by way of 'top\.step'"):
        read(top)


def test_generated_names_give_way_to_the_part_above(folder):
    """Exporters number the placements and leave solids without names."""
    for made_up in ("=>[0:1:1:2]", "SOLID", "*DIT33", "NAUO12", "7"):
        rename(folder / "ball.stp", made_up, "ball")
        names, *_ = read(folder / "all.step")
        assert names.count("ball") == 1, made_up
        rename(folder / "ball.stp", "ball", made_up)
