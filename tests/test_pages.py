"""An atlas of several pages in every output: the same texels, found by every vertex; names that are free."""

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_models import rigged

import upholster
from upholster.base.errors import InputError
from upholster.base.files import outputs
from upholster.base.options.write_options import WriteOptions
from upholster.charts.layout import uniform_layout
from upholster.charts.mesh_layout import mesh_charts
from upholster.charts.unwrap.flat_islands import unwrap
from upholster.covering import request
from upholster.geometry.model_files.model_reader import read_model
from upholster.image.files.material import Material
from upholster.image.files.read import read_image
from upholster.image.files.write import write_image
from upholster.model.textured_model import TexturedModel
from upholster.output.outputs import parse_outputs, write_output
from upholster.pipeline import cover, refine, write
from upholster.quilt.model import Texels

OPTIONS = WriteOptions(atlas_size=256, padding=8, quads=600, size=(64, 48), texture="png")


def sample() -> Any:
    return np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ring of two maps in every kind of file, in pages of 256 texels; and its picture from other pages."""
    folder = tmp_path_factory.mktemp("pages")
    wall = Material({"albedo": sample(), "roughness": sample()[:, :, :1], "normal": sample()})
    names = ("r.glb", "r.obj", "r.ply", "atlas:a.png", "t.<UDIM>.png", "r.uph", "r.png")
    targets = [name.replace(":", f":{folder}/") if ":" in name else f"{folder}/{name}" for name in names]
    asked = {"texels": 100_000, "sample_size": 1.0}
    done = cover(wall, "torus", targets, synthesis=asked, options=OPTIONS)
    assert set(done.written) == {str(path) for path in folder.iterdir()}
    cover(
        wall,
        "torus",
        [f"{folder}/whole.png"],
        synthesis=asked,
        # The same charts, for pages of the same size, arranged otherwise.
        options=WriteOptions(atlas_size=256, padding=8, pot=True, quads=600, size=(64, 48)),
    )
    return folder


def glb(path: Path) -> tuple[Any, bytes]:
    data = path.read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def numbers(document: Any, binary: bytes, index: int) -> Any:
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    dtype = {5126: "<f4", 5123: "<u2"}[accessor["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
    part = binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
    return np.frombuffer(part, dtype).reshape(-1, width)


def image_of(document: Any, binary: bytes, texture: Any, folder: Path) -> Any:
    view = document["bufferViews"][
        document["images"][document["textures"][texture["index"]]["source"]]["bufferView"]
    ]
    path = folder / "image.png"
    path.write_bytes(binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
    return read_image(path)


@pytest.mark.slow(reason="covers several models, or one several times")
def test_pages_are_the_same_in_all_files(folder: Path, tmp_path: Path) -> None:
    document, binary = glb(folder / "r.glb")
    count = len(document["materials"])
    assert count > 2
    for number, material in enumerate(document["materials"]):
        for role, texture in {
            "": material["pbrMetallicRoughness"]["baseColorTexture"], "_normal": material["normalTexture"],
        }.items():  # fmt: skip
            expected = read_image(folder / f"a{role}_{number + 1}.png")
            assert expected.shape == (256, 256, 3)
            np.testing.assert_array_equal(expected, read_image(folder / f"t{role}.{1001 + number}.png"))
            np.testing.assert_array_equal(expected, read_image(folder / f"r_texture{role}_{number + 1}.png"))
            np.testing.assert_array_equal(expected, image_of(document, binary, texture, tmp_path))
    assert not (folder / "a.png").exists()
    assert not (folder / f"a_{count + 1}.png").exists()


def test_each_triangle_has_its_page(folder: Path) -> None:
    """GLB and OBJ agree on the place of every corner of the model; in the OBJ it lies in the page's tile."""
    document, binary = glb(folder / "r.glb")
    primitives = document["meshes"][0]["primitives"]
    assert [primitive["material"] for primitive in primitives] == list(range(len(document["materials"])))
    corners: dict[str, list[Any]] = {"v": [], "vt": []}
    by_page: list[set[tuple[float, ...]]] = [set() for _ in primitives]
    for line in (folder / "r.obj").read_text().splitlines():
        key, _, rest = line.partition(" ")
        if key in corners:
            corners[key].append([float(word) for word in rest.split()])
        elif key == "usemtl":
            assert rest == "r"
        elif key == "f":
            places = [corners["vt"][int(corner.split("/")[1]) - 1] for corner in rest.split()]
            (page,) = {int(u) + 10 * int(v) for u, v in places}  # a face is in one tile
            for u, v in places:
                by_page[page].add((round(u - page % 10, 4), round(1 - (v - page // 10), 4)))
    used = 0
    for primitive, own in zip(primitives, by_page, strict=True):
        indices = np.unique(numbers(document, binary, primitive["indices"]))
        uv = numbers(document, binary, primitive["attributes"]["TEXCOORD_0"])[indices]
        assert 8 / 256 - 1e-6 <= uv.min() < uv.max() <= 1 - 8 / 256 + 1e-6  # a chart's, not its gutters'
        assert len({(round(float(u), 4), round(float(v), 4)) for u, v in uv} - own) <= 0.02 * len(uv)
        used += len(indices)
    assert used == len(corners["vt"])


def test_tiles_go_on_in_rows_of_ten(tmp_path: Path) -> None:
    """Sixteen charts, each on a page of its own: the last six lie in the second row of tiles."""
    surface = upholster.torus()
    charts = uniform_layout(surface, chart=200)
    texels = Texels(charts, (np.zeros((200, 200, 3), np.uint8),) * len(charts))
    model = TexturedModel(surface, texels, WriteOptions(atlas_size=256, quads=16))
    output, _ = parse_outputs([f"{tmp_path}/r.obj", f"{tmp_path}/t.<UDIM>.png"], WriteOptions())
    with outputs(output.files((), 16)) as files:
        write_output(output, model, files)
    lines = (tmp_path / "r.obj").read_text().splitlines()
    uv = np.array([[float(word) for word in line.split()[1:]] for line in lines if line[:3] == "vt "])
    page = [cell.page for cell in model.atlas.cells]
    assert sorted(page) == list(range(16))
    tiles = np.stack([np.arange(16) % 10, np.arange(16) // 10], axis=1)
    np.testing.assert_array_equal(np.floor(uv), tiles[page][model.mesh.chart])


def test_a_chart_may_be_larger_than_a_tile(tmp_path: Path) -> None:
    """Its island is cut in the atlas: charts, and with them all that is painted, stay as they are."""
    model = read_model(rigged(tmp_path))
    surface, _ = unwrap(model.mesh)
    charts = mesh_charts(surface, 300.0)
    places = [np.stack([*np.indices((chart.height, chart.width)) // 8] * 2, -1)[:, :, :3] for chart in charts]
    texels = Texels(charts, tuple(each.astype(np.uint8) for each in places))
    textured = TexturedModel(surface, texels, replace(OPTIONS, texture="png"), file=model)
    assert max(chart.height for chart in charts) > 256
    wanted = parse_outputs(
        [f"{tmp_path}/{name}" for name in ("t.<UDIM>.png", "t.obj", "t.glb")], WriteOptions()
    )
    with outputs([file for each in wanted for file in each.files((), len(textured.layout.pages))]) as files:
        for output in wanted:
            write_output(output, textured, files)
    tiles = sorted(tmp_path.glob("t.1*.png"))
    assert len(tiles) > 6
    assert {read_image(tile).shape[:2] for tile in tiles} == {(256, 256)}
    lines = [line.split() for line in (tmp_path / "t.obj").read_text().splitlines()]
    places = np.array([line[1:] for line in lines if line[0] == "vt"], float)
    faces = [[int(corner.split("/")[1]) - 1 for corner in line[1:]] for line in lines if line[0] == "f"]
    inside = np.floor(places[np.array(faces)])
    assert (inside == inside[:, :1]).all()  # each face is on one tile
    kept = read_model(tmp_path / "t.glb").mesh
    assert len(kept.triangles) == len(model.mesh.triangles)
    assert len(faces) > len(kept.triangles)
    assert any("larger than a page of 256 texels and stays whole in glTF" in note for note in textured.notes)


def test_pictures_do_not_depend_on_pages(folder: Path) -> None:
    assert (folder / "r.png").read_bytes() == (folder / "whole.png").read_bytes()


def test_a_stream_gives_pages_as_well(folder: Path, tmp_path: Path) -> None:
    done = refine(folder / "r.uph", [f"{tmp_path}/t.<UDIM>.png"], options=OPTIONS)
    assert set(done.written) == {str(path) for path in tmp_path.iterdir()}
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in folder.glob("t*.png")}


@pytest.mark.slow(reason="covers several models, or one several times")
def test_obj_and_ply_of_one_name_share_their_textures(folder: Path, tmp_path: Path) -> None:
    done = refine(folder / "r.uph", [f"{tmp_path}/x.ply", f"{tmp_path}/x.obj"], options=OPTIONS)
    assert set(done.written) == {str(path) for path in tmp_path.iterdir()}
    alone = tmp_path / "alone"
    alone.mkdir()
    refine(folder / "r.uph", [f"{alone}/x.ply"], options=OPTIONS)
    refine(folder / "r.uph", [f"{alone}/y.obj"], options=OPTIONS)
    textures = sorted(path.name for path in tmp_path.glob("x_texture*"))
    assert len(textures) > 1
    for name in textures:
        assert (tmp_path / name).read_bytes() == (alone / name).read_bytes()
        assert (alone / name).read_bytes() == (alone / name.replace("x", "y", 1)).read_bytes()
    assert (tmp_path / "x.ply").read_bytes() == (alone / "x.ply").read_bytes()
    for twice in (["x.ply", "x.ply"], ["x.ply", "x.obj", "atlas:x_texture.png"]):
        with pytest.raises(InputError, match="is given twice"):
            refine(
                folder / "r.uph", [f"atlas:{alone / t[6:]}" if ":" in t else f"{alone}/{t}" for t in twice]
            )


def test_one_texture_in_one_tile(tmp_path: Path) -> None:
    surface = upholster.plane()
    quilt = upholster.synthesize(sample(), surface, texels=5000, sample_size=1.0)
    texels = upholster.paint(quilt, sample())
    write(tmp_path / "t.<UDIM>.png", surface, texels)
    write(f"atlas:{tmp_path / 'a.png'}", surface, texels)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "t.1001.png"]
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "t.1001.png").read_bytes()


@pytest.mark.parametrize(
    ("targets", "said"),
    [
        (["atlas:x.png"], r"output 'x_2\.png' is the same file as input"),
        (
            ["new.png", "atlas:new_2.png", "y.<UDIM>.png", "y.1003.png"],
            r"output 'y\.1003\.png' is given twice",
        ),
        (["x.obj"], r"output 'x_texture_2\.png' is the same file as input"),
    ],
)
def test_names_of_pages_are_checked_before_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, targets: list[str], said: str
) -> None:
    def work(*_: object, **__: object) -> None:
        raise AssertionError("work began")

    monkeypatch.setattr(request, "execute", work)
    monkeypatch.chdir(tmp_path)
    write_image("x_2.png", sample())
    Path("x_texture_2.png").symlink_to("x_2.png")
    before = sorted(tmp_path.iterdir())
    asked = {"texels": 100_000, "sample_size": 1.0}
    with pytest.raises(InputError, match=said):
        cover("x_2.png", "torus", targets, synthesis=asked, options=OPTIONS)
    assert sorted(tmp_path.iterdir()) == before


def _file(folder: Path) -> Path:
    write_image(folder / "sample.png", sample())
    return folder / "sample.png"
