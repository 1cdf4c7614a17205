"""What an output consists of, and which image goes where."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import upholster
from upholster import cover
from upholster.base.errors import InputError
from upholster.base.formats import OUTPUTS, OutputKind, kind_of, outputs_in_words, split_name
from upholster.base.options.write_options import WriteOptions
from upholster.charts.chart_seams import find_seams
from upholster.charts.unwrap._raster_kernels import coverage
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.sphere import sphere
from upholster.image.files.read import read_image
from upholster.model.atlas import build_atlas
from upholster.model.normal_atlas import build_normal_atlas
from upholster.model.packing import pack_charts
from upholster.model.textured_model import TexturedModel
from upholster.output.export.map_files import write_map
from upholster.output.export.pages import udim_tile
from upholster.output.output_writer import files_of
from upholster.output.outputs import parse_output, parse_outputs
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels

EXAMPLES = Path(__file__).parent.parent / "examples"
README = (EXAMPLES.parent / "README.md").read_text(encoding="utf-8")
ROLES = ("normal", "ao")


def files(text: str, *roles: str, flat: bool = False) -> list[str]:
    return [path.name for path in parse_output(text, flat=flat).files(roles)]


def test_maps_lie_beside_images_by_role() -> None:
    assert files("wall.png") == files("wall.png", *ROLES) == ["wall.png"]
    assert files("atlas:wall.png") == files("wall.png", flat=True) == ["wall.png"]
    beside = ["wall.png", "wall_normal.png", "wall_ao.png"]
    assert files("atlas:wall.png", *ROLES) == files("wall.png", *ROLES, flat=True) == beside
    assert files("a/ring.obj") == ["ring.obj", "ring.mtl", "ring_texture.png"]
    assert files("a/ring.ply") == ["ring.ply", "ring_texture.png"]
    assert files("a/ring.obj", *ROLES)[3:] == ["ring_texture_normal.png", "ring_texture_ao.png"]
    for name in ("a.glb", "a.npz", "a.uph"):
        assert files(name, *ROLES) == [name]
    assert parse_output("atlas:x.exr", flat=True).kind.name == "atlas"


def test_pages_are_numbered() -> None:
    def files(text: str, flat: bool = False) -> list[str]:
        return [path.name for path in parse_output(text, flat=flat).files(("ao",), 2)]

    assert files("atlas:a/wall.png") == ["wall_1.png", "wall_2.png", "wall_ao_1.png", "wall_ao_2.png"]
    assert files("ring.obj") == [
        "ring.obj", "ring.mtl", "ring_texture_1.png", "ring_texture_2.png",
        "ring_texture_ao_1.png", "ring_texture_ao_2.png",
    ]  # fmt: skip
    assert files("wall.png", flat=True) == ["wall.png", "wall_ao.png"]
    assert files("x.glb") == ["x.glb"]
    tiles = ["wall.1001.png", "wall.1002.png", "wall_ao.1001.png", "wall_ao.1002.png"]
    assert (
        files("wall.<UDIM>.png") == files("atlas:wall.<UDIM>.png") == files("wall.<UDIM>.png", True) == tiles
    )
    assert parse_output("w_<UDIM>.png").files(("ao",)) == (Path("w_1001.png"), Path("w_ao_1001.png"))
    output = parse_output("wall.<UDIM>.png")
    assert output.kind.name == "atlas"
    layout = pack_charts([Chart(0, 200, 200)] * 2, size=256)
    assert len(layout.pages) == 2
    assert files_of([output], ("ao",), layout) == [*map(Path, tiles)]
    assert [udim_tile(np.array(page)).tolist() for page in (0, 9, 10, 23)] == [[0, 0], [9, 0], [0, 1], [3, 2]]


@pytest.mark.slow(reason="covers several models, or one several times")
@pytest.mark.parametrize("kind", OUTPUTS, ids=lambda kind: f"{kind.only} {kind.prefix}x{kind.suffixes[0]}")
def test_every_kind_is_meant_by_its_names_and_writes_just_its_files(kind: OutputKind, tmp_path: Path) -> None:
    if ".usdz" in kind.suffixes:
        pytest.importorskip("pxr")  # of the extra "usd"
    """Texels on one chart: all kinds hold them but directions, which are a mesh's alone."""
    texels = np.random.default_rng(0).integers(0, 256, (32, 32, 3), dtype=np.uint8)
    placements = upholster.synthesize(texels, plane(), texels=1000, sample_size=0.5)
    painted = upholster.paint(placements, texels)
    options = WriteOptions(size=(32, 24))
    if kind.only == "displaced":
        options = replace(options, displace=0.1, displace_by="luminance")
    for suffix in kind.suffixes:
        target = f"{kind.prefix}{tmp_path / 'x'}{suffix.upper()}"
        (output,) = parse_outputs([target], options, flat=kind.only == "flat")
        assert output.kind is kind
        if kind.mesh:
            with pytest.raises(InputError, match="shows the directions of a mesh"):
                upholster.write(target, plane(), painted, options=options)
            continue
        upholster.write(target, plane(), painted, options=options, flat=kind.only == "flat")
        assert set(tmp_path.iterdir()) == set(output.files())
        for file in output.files():
            assert file.stat().st_size > 0
            file.unlink()


def test_what_is_written_is_in_the_help_and_the_readme() -> None:
    (reported,) = re.findall(r"^- \*\*Output\*\*: .*$", README, re.MULTILINE)
    for kind in OUTPUTS:
        assert kind.words in outputs_in_words()
        assert kind.prefix in reported
        if kind.suffixes[0] != ".png":
            assert all(f"`{suffix}`" in reported for suffix in kind.suffixes)


@pytest.mark.parametrize("text", ["x.<UDIM>.glb", "<UDIM>/x.png", "a<UDIM>b<UDIM>.png", "atlas:x.<UDIM>.obj"])
def test_tiles_are_images(text: str) -> None:
    with pytest.raises(InputError, match=r"has <UDIM>; allowed: once, in the name of an image \(\.png"):
        parse_output(text)


@pytest.mark.parametrize("text", ["x.<udim>.png", "<Udim>.png", "atlas:x.<udim>.jpg"])
def test_the_placeholder_of_tiles_is_in_capitals(text: str) -> None:
    with pytest.raises(InputError, match="spells <UDIM> otherwise; allowed: <UDIM>, in capital letters"):
        parse_output(text)


def test_whether_a_texture_is_flat_is_yes_or_no() -> None:
    flat: Any = np.ones(2)
    with pytest.raises(InputError, match="flat is a ndarray; allowed: True or False"):
        parse_output("x.png", flat=flat)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("padding", -1, "padding is -1; allowed: 0 to 64"),
        ("padding", 65, "padding is 65; allowed: 0 to 64"),
        ("atlas_size", 128, "atlas_size is 128; allowed: a power of two from 256 to 8192"),
        ("atlas_size", 1000, "atlas_size is 1000; allowed: a power of two"),
        ("atlas_size", 16384, "atlas_size is 16384; allowed: a power of two"),
    ],
)
def test_packing_is_checked(name: str, value: int, said: str) -> None:
    with pytest.raises(InputError, match=said):
        WriteOptions(**{name: value})


def test_a_normal_maps_gutters_are_turned() -> None:
    surface = sphere()
    normals = np.random.default_rng(0).integers(0, 256, (6, 32, 32, 3), dtype=np.uint8)
    texels = Texels(tuple(Chart(n, 32, 32) for n in range(6)), tuple(normals))
    maps = {"normal": texels, "emission": texels}
    model = TexturedModel(surface, texels, maps=maps)
    seams = find_seams(surface, texels.charts)
    turned = build_normal_atlas(surface, texels, seams)
    np.testing.assert_array_equal(model.map_atlas("normal").pixels, turned.pixels)
    np.testing.assert_array_equal(model.map_atlas("emission").pixels, build_atlas(texels, seams).pixels)
    assert (model.map_atlas("normal").pixels != model.map_atlas("emission").pixels).any()


@pytest.mark.parametrize("suffix", [".png", ".webp", ".exr", ".jpg"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_plain_numbers_pass_through_no_curve(tmp_path: Path, suffix: str, dtype: type) -> None:
    ramp = np.tile(np.linspace(0, 1, 64), (32, 1))[..., None]
    top = 1 if dtype == np.float32 else np.iinfo(dtype).max
    write_map(tmp_path / f"a{suffix}", "roughness", (ramp * top).astype(dtype))
    back = read_image(tmp_path / f"a{suffix}")
    found = back / (1 if back.dtype == np.float32 else np.iinfo(back.dtype).max)
    np.testing.assert_allclose(found[..., 0], ramp[..., 0], atol=0.02)


@pytest.mark.parametrize("value", [-1, 101, np.nan])
def test_normal_scale_is_checked(value: float) -> None:
    with pytest.raises(InputError, match="normal_scale"):
        WriteOptions(normal_scale=value)


@pytest.mark.slow(reason="covers several models, or one several times")
def test_the_reported_share_of_the_page_is_covered(tmp_path: Path) -> None:
    """Texels counted one by one, of the atlas that is written, against what the report says."""
    target = f"atlas:{tmp_path / 'atlas.png'}"
    report = cover(
        EXAMPLES / "weave.png",
        EXAMPLES / "chair.glb",
        target,
        synthesis={"texels": 60_000},
        seed=1,
    )
    image = read_image(tmp_path / "atlas.png")
    model = report.model
    assert model is not None
    times = np.zeros(image.shape[:2], np.int32)
    places = (model.uv * image.shape[1::-1])[:, ::-1][model.mesh.triangles]
    coverage(np.add(places, (0.0007, 0.0013)), times)
    counts = report.counts
    assert (counts["pages"], counts["page texels"]) == (1, times.size)
    assert counts["texels"] == 60_000 < counts["painted texels"]
    assert abs((times > 0).sum() / counts["texels"] - 1) < 0.01
    assert counts["texels"] / times.size > 0.55
    assert vars(model)["layout"] is model.packed  # the atlas is laid out once


def test_the_studio_saves_each_output_that_it_offers_under_a_name_that_means_it() -> None:
    offered = [kind for kind in OUTPUTS if kind.offer]
    assert len(offered) > 5
    for kind in offered:
        assert kind.offer is not None
        only = [kind.only] if kind.only else []
        assert kind_of(*split_name(f"{kind.prefix}chair{kind.offer.ending}"), only) is kind
