"""Further files of a GLB with smaller textures, and streams painted more finely or coarsely."""

import json
import struct
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

import upholster
from upholster.base.errors import InputError
from upholster.base.limits import Limits
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import PixelArray
from upholster.image.files.material import Material
from upholster.image.files.read import read_image
from upholster.output.outputs import parse_output, parse_outputs
from upholster.pipeline import cover, refine, write

ASKED = {"texels": 60_000, "sample_size": 1.0}
OPTIONS = WriteOptions(lods=3, texture="png", quads=400)


def sample() -> PixelArray:
    """Smooth colours, 64² pixels."""
    rows, columns = np.mgrid[:64, :64]
    waves = np.sin(rows / 5) + np.cos(columns / 7 + rows / 11)
    return np.repeat(np.uint8(128 + 50 * waves)[:, :, None], 3, axis=2)


def textures(path: Path, folder: Path) -> tuple[Any, list[PixelArray]]:
    """The JSON of a GLB, and its images."""
    data = path.read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    document, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    images = []
    for image in document["images"]:
        view = document["bufferViews"][image["bufferView"]]
        place = folder / "image.png"
        place.write_bytes(binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
        images.append(read_image(place))
    return document, images


def test_names_of_lods() -> None:
    wanted = parse_outputs(["a/x.glb", "y.obj", "z.png"], OPTIONS)
    assert [(str(each.path), each.lod) for each in wanted] == [
        (str(Path("a/x.glb")), 0), (str(Path("a/x_lod1.glb")), 1), (str(Path("a/x_lod2.glb")), 2),
        ("y.obj", 0), ("z.png", 0),
    ]  # fmt: skip
    assert parse_outputs(["y.obj"], WriteOptions()) == [parse_output("y.obj")]
    with pytest.raises(InputError, match=r"lods is for \.glb, and y\.obj is none; allowed: with one"):
        parse_outputs(["y.obj"], OPTIONS)
    for lods in (0, 9):
        with pytest.raises(InputError, match=f"lods is {lods}; allowed: 1 to 8"):
            WriteOptions(lods=lods)


@pytest.mark.slow(reason="covers several models, or one several times")
@pytest.mark.parametrize("maps", [1, 2])
def test_textures_are_halved_and_look_alike(tmp_path: Path, maps: int) -> None:
    exemplar: Any = sample()
    if maps == 2:
        exemplar = Material({"albedo": exemplar, "roughness": exemplar[:, :, :1].copy()})
    done = cover(exemplar, "torus", tmp_path / "x.glb", synthesis=ASKED, options=OPTIONS)
    names = ["x.glb", "x_lod1.glb", "x_lod2.glb"]
    assert [Path(name).name for name in done.written] == names
    documents, images = zip(*(textures(tmp_path / name, tmp_path) for name in names), strict=True)
    assert len({json.dumps(each["meshes"]) for each in documents}) == 1  # one mesh
    for fine, coarse in pairwise(images):
        assert len(fine) == len(coarse) == maps
        for one, other in zip(fine, coarse, strict=True):
            assert other.size < 0.35 * one.size
            assert abs(float(one.mean()) - float(other.mean())) < 3


def test_textures_are_reported_as_what_they_are(tmp_path: Path) -> None:
    material = Material({"albedo": sample(), "roughness": sample()[:, :, :1].copy()})
    cover(material, "torus", tmp_path / "x.glb", synthesis=ASKED, options=WriteOptions(quads=400))
    document, _ = textures(tmp_path / "x.glb", tmp_path)
    assert [image["mimeType"] for image in document["images"]] == ["image/jpeg", "image/png"]


def test_several_materials_have_lods_as_well(tmp_path: Path) -> None:
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], float)
    lines = ["v {} {} {}".format(*corner) for corner in corners]
    (tmp_path / "m.obj").write_text("\n".join([*lines, "o a", "f 1 2 3", "o b", "f 2 4 3", ""]))
    upholster.image.files.write.write_image(tmp_path / "s.png", sample())
    materials = {"a": tmp_path / "s.png", "b": tmp_path / "s.png"}
    cover(
        None,
        tmp_path / "m.obj",
        tmp_path / "x.glb",
        materials=materials,
        synthesis={"texels": 20_000, "sample_size": 0.5},
        options=OPTIONS,
    )
    sizes = [
        sum(image.size for image in textures(tmp_path / name, tmp_path)[1])
        for name in ("x.glb", "x_lod1.glb", "x_lod2.glb")
    ]
    assert sizes[0] > sizes[1] > sizes[2]


def test_texels_alone_have_no_lods(tmp_path: Path) -> None:
    surface = upholster.torus(3, 1)
    quilt = upholster.synthesize(sample(), surface, texels=20_000, sample_size=1.0)
    texels = upholster.paint(quilt, sample())
    write(tmp_path / "x.glb", surface, texels, options=WriteOptions(lods=2))
    assert {file.name for file in tmp_path.iterdir()} == {"x.glb", "x_lod1.glb"}
    bare = upholster.Texels(texels.charts, texels.arrays)
    with pytest.raises(InputError, match="lods need a quilt and its sample, not only texels"):
        write(tmp_path / "y.glb", surface, bare, options=WriteOptions(lods=2))
    assert not (tmp_path / "y.glb").exists()


def test_texels_of_any_density_are_written(tmp_path: Path) -> None:
    surface = upholster.torus(3, 1)
    quilt = upholster.synthesize(sample(), surface, texels=20_000, sample_size=1.0)
    texels = upholster.paint(quilt, sample(), density=1.7)
    write(tmp_path / "x.npz", surface, texels)
    write(tmp_path / "x.uph", surface, texels)
    with np.load(tmp_path / "x.npz") as found:
        assert sum(array.shape[0] * array.shape[1] for array in found.values() if array.ndim == 3) == (
            texels.count
        )
    assert abs(texels.count / quilt.steps / 1.7**2 - 1) < 0.05


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stream")
    cover(sample(), "torus", [folder / "x.uph", folder / "x.npz"], synthesis=ASKED)
    return folder


@pytest.mark.slow(reason="covers several models, or one several times")
@pytest.mark.parametrize("texels", [6_000, 500_000])
def test_a_stream_is_painted_at_any_number_of_texels(folder: Path, tmp_path: Path, texels: int) -> None:
    done = refine(folder / "x.uph", [tmp_path / "y.glb", tmp_path / "y.uph"], texels=texels)
    assert done.model is not None
    assert done.model.texels.count == pytest.approx(texels, rel=0.04)
    assert (tmp_path / "y.uph").read_bytes() == (folder / "x.uph").read_bytes()
    plain = refine(folder / "x.uph", [tmp_path / "z.glb"])
    assert plain.model is not None
    means = [np.mean([array.mean() for array in each.model.texels.arrays]) for each in (done, plain)]
    assert abs(means[0] - means[1]) < 3


def test_tiles_have_as_many_texels(folder: Path, tmp_path: Path) -> None:
    options = WriteOptions(atlas_size=1024, padding=8)
    for name, others in (("alone", ()), ("whole", ("x.npz",))):
        (tmp_path / name).mkdir()
        targets = [tmp_path / name / file for file in ("x.<UDIM>.png", *others)]
        reported = refine(folder / "x.uph", targets, texels=200_000, options=options)
        assert (reported.model is None) == (not others)
    alone, whole = (
        {file.name: file.read_bytes() for file in (tmp_path / name).glob("*.png")}
        for name in ("alone", "whole")
    )
    assert alone
    assert alone == whole


def test_lods_of_a_stream_go_on_from_the_texels_asked_for(folder: Path, tmp_path: Path) -> None:
    options = replace(OPTIONS, padding=0)
    plain = refine(folder / "x.uph", [tmp_path / "z.glb"], options=replace(options, lods=1))
    assert plain.model is not None
    # Twice as fine each way, and halved: as it is.
    texels = 4 * plain.model.texels.count
    done = refine(folder / "x.uph", [tmp_path / "y.glb"], texels=texels, options=options)
    assert [Path(name).name for name in done.written] == ["y.glb", "y_lod1.glb", "y_lod2.glb"]
    (fine,), (asked,) = (textures(tmp_path / name, tmp_path)[1] for name in ("y_lod1.glb", "z.glb"))
    np.testing.assert_array_equal(fine, asked)


def test_what_can_not_be_painted_is_one_line(folder: Path, tmp_path: Path) -> None:
    for texels, said in (
        (63, "texels is 63; allowed: 64 to"),
        (2**31, r"texels is 2147483648; allowed of this"),
    ):
        with pytest.raises(InputError, match=said):
            refine(folder / "x.uph", [tmp_path / "y.glb"], texels=texels)
    with pytest.raises(InputError, match=r"charts would have .* texels; allowed here: 100000"):
        refine(folder / "x.uph", [tmp_path / "y.glb"], texels=200_000, limits=Limits(texels=100_000))
    done = run_cli("refine", folder / "x.uph", "-o", tmp_path / "y.glb", "--texels", "many")
    assert_one_line(done, "texels is 'many'; allowed: a number such as 500k or 4M")
    assert not list(tmp_path.iterdir())
