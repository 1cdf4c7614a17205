"""Materials and flat textures through the command: every map in every output, and what is refused."""

import json
import os
import struct
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

import upholster
from upholster.base.errors import InputError
from upholster.base.options.write_options import WriteOptions
from upholster.image.files.read import read_image
from upholster.image.files.write import write_image
from upholster.pipeline import cover, refine

SIDE = 64


def relief() -> Any:
    """Height of a wall of 16 × 8 stones, (64, 64) from 0 to 1."""
    rows, columns = np.mgrid[:SIDE, :SIDE]
    columns = columns + 8 * (rows // 8 % 2)
    edge = np.minimum(np.minimum(rows % 8, 7 - rows % 8), np.minimum(columns % 16, 15 - columns % 16))
    grain = np.random.default_rng(3).random((SIDE, SIDE))
    return np.clip(np.minimum(edge, 2) / 2 * 0.8 + 0.2 * grain, 0, 1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A material whose other maps follow from its red, and files that fit no material."""
    folder = tmp_path_factory.mktemp("wall")
    height = relief()
    red = np.rint(255 * height).astype(np.uint8)
    albedo = np.stack([red, red // 2, 255 - red], axis=2)
    slope = np.gradient(4 * height)
    normal = np.stack([-slope[1], slope[0], np.ones_like(height)], axis=2)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    wall = folder / "wall"
    wall.mkdir()
    write_image(wall / "wall_albedo.png", albedo)
    write_image(wall / "wall_normal.png", np.rint(127.5 + 127.5 * normal).astype(np.uint8))
    write_image(wall / "wall_roughness.png", (255 - red)[:, :, None])
    write_image(wall / "wall_height.png", (red * np.uint16(257))[:, :, None])
    write_image(folder / "plain.png", albedo)
    write_image(folder / "wall_ao.png", red[:48, :40, None])
    write_image(folder / "wall_shine.png", red[:, :, None])
    (folder / "notes.txt").write_text("no image")
    (folder / "bare").mkdir()
    write_image(folder / "bare" / "bare_normal.png", albedo)
    return folder


@pytest.fixture
def command(folder: Path) -> Any:
    """``upholster cover`` in that folder."""
    return partial(run_cli, "cover", cwd=folder)


def glb(path: Path) -> Any:
    data = path.read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    return json.loads(data[20 : 20 + length])


def follows(base: Any, roughness: Any, height: Any) -> None:
    """The maps are the ones of the same texels: painted by one quilt, each at its depth and rounded there."""
    assert base.dtype == roughness.dtype == np.uint8
    assert height.dtype == np.uint16
    assert np.abs(255 - base[..., 0].astype(int) - roughness[..., 0]).max() <= 2
    assert np.abs(257 * base[..., 0].astype(int) - height[..., 0]).max() <= 2 * 257


@pytest.mark.slow(reason="covers several models, or one several times")
def test_every_map_is_in_every_output(command: Any, tmp_path: Path) -> None:
    outputs = [tmp_path / name for name in ("m.glb", "m.obj", "m.npz", "m.png")]
    done = command(
        "wall", "--on", "sphere", "--texels", "40k", "--quads", "600", "--size", "64x48",
        "--normal-scale", "0.5", *[f"-o{path}" for path in outputs], f"-oatlas:{tmp_path / 'm_tex.png'}",
        "--report", tmp_path / "report.json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[1].startswith("block ")
    assert done.stdout.splitlines()[1].endswith("maps albedo, normal, roughness, height")
    reported = json.loads((tmp_path / "report.json").read_text())
    assert reported["counts"]["maps"] == 4
    assert reported["settled"]["maps"] == "albedo, normal, roughness, height"
    assert len(reported["written"]) == 2 + 3 + 3 + 1 + 4
    assert {Path(name).name for name in reported["written"]} == {path.name for path in tmp_path.iterdir()} - {
        "report.json"
    }

    head = glb(tmp_path / "m.glb")
    assert "TANGENT" in head["meshes"][0]["primitives"][0]["attributes"]
    assert head["materials"][0]["normalTexture"]["scale"] == 0.5
    assert "metallicRoughnessTexture" in head["materials"][0]["pbrMetallicRoughness"]
    assert len(head["images"]) == 3

    with np.load(tmp_path / "m.npz") as file:
        assert sum(name.startswith("normal_") for name in file) == sum(
            name.startswith("chart_") for name in file
        )
        follows(file["chart_000"], file["roughness_000"], file["height_000"])
    atlas = {
        role: read_image(tmp_path / f"m_tex{role}.png") for role in ("", "_normal", "_roughness", "_height")
    }
    follows(atlas[""], atlas["_roughness"], atlas["_height"])
    assert atlas["_normal"].shape == atlas[""].shape
    lines = (tmp_path / "m.mtl").read_text().splitlines()
    assert "norm m_texture_normal.png" in lines
    assert "map_Pr m_texture_roughness.png" in lines
    assert "Pm 0" in lines
    assert not any(line.startswith("Pr 0") for line in lines)
    for role, pixels in atlas.items():
        np.testing.assert_array_equal(read_image(tmp_path / f"m_texture{role}.png"), pixels)


def test_maps_can_be_named_and_normals_turned(command: Any, folder: Path, tmp_path: Path) -> None:
    options = ["--map", f"orm={folder / 'plain.png'}", "--normal", "dx", "--texels", "64x64"]
    done = command("wall", *options, "--on", "plane", "-o", tmp_path / "m.png", "-o", tmp_path / "m.npz")
    assert done.returncode == 0, done.stderr
    assert "note: 'plain.png' holds ao, roughness, metallic in its channels" in done.stderr
    base, rough, ao = (read_image(tmp_path / f"m{role}.png") for role in ("", "_roughness", "_ao"))
    np.testing.assert_array_equal(rough[..., 0], base[..., 1])
    np.testing.assert_array_equal(ao[..., 0], base[..., 0])
    own = command(
        "wall", *options[:2], "--normal", "gl", *options[4:], "--on", "plane", "-o", tmp_path / "g.png"
    )
    assert own.returncode == 0, own.stderr
    turned, kept = (read_image(tmp_path / f"{name}_normal.png") for name in "mg")
    assert np.abs(255 - turned[..., 1].astype(int) - kept[..., 1]).max() <= 2
    # No file that is read is written.
    assert_one_line(command("wall", "--map", "ao=a.png", "--on", "sphere", "-o", "a.png"), "a.png")


def test_a_flat_material_tiles_and_keeps_its_convention(command: Any, tmp_path: Path) -> None:
    done = command(
        "wall/wall_albedo.png", "wall/wall_normal.png", "wall/wall_roughness.png", "wall/wall_height.png",
        "--on", "plane", "--texels", "96x80", "--tileable",
        "-o", tmp_path / "t.png", "-o", tmp_path / "t.exr",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "7,680 texels" in done.stdout
    flat = {role: read_image(tmp_path / f"t{role}.png") for role in ("", "_normal", "_roughness", "_height")}
    assert {pixels.shape[:2] for pixels in flat.values()} == {(80, 96)}
    follows(flat[""], flat["_roughness"], flat["_height"])
    # Away from cuts, green tells the slope upward as in the exemplar: the height falls where y is positive.
    height = flat["_height"][..., 0] / 65535.0
    up = flat["_normal"][..., 1] / 127.5 - 1
    across = flat["_normal"][..., 0] / 127.5 - 1
    assert np.corrcoef(np.gradient(height, axis=0).ravel(), up.ravel())[0, 1] > 0.9
    assert np.corrcoef(np.gradient(height, axis=1).ravel(), across.ravel())[0, 1] < -0.9
    # Plain numbers pass through no colour curve, whatever the format.
    np.testing.assert_allclose(
        read_image(tmp_path / "t_roughness.exr")[..., 0], flat["_roughness"][..., 0] / 255.0, atol=1e-6
    )
    assert abs(read_image(tmp_path / "t.exr")[..., 0].mean() - flat[""][..., 0].mean() / 255) > 0.02


@pytest.mark.slow(reason="covers several models, or one several times")
def test_a_stream_holds_every_map(command: Any, tmp_path: Path) -> None:
    """Refined as a whole it gives what `cover` gave; its start gives the maps that have come."""
    done = command(
        "wall", "--on", "sphere", "--texels", "40k", "--sample-quality", "lossless", "--quads", "600",
        *[f"-o{tmp_path / name}" for name in ("a.uph", "a.npz", "a.glb")],
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    options = WriteOptions(quads=600)
    refine(
        tmp_path / "a.uph", [str(tmp_path / f"b.{kind}") for kind in ("npz", "glb", "uph")], options=options
    )
    with np.load(tmp_path / "a.npz") as direct, np.load(tmp_path / "b.npz") as again:
        assert sorted(direct.files) == sorted(again.files)
        for name in direct.files:
            np.testing.assert_array_equal(direct[name], again[name])
    assert glb(tmp_path / "b.glb")["materials"] == glb(tmp_path / "a.glb")["materials"]
    data = (tmp_path / "a.uph").read_bytes()
    seen = []
    for share in (0.0, 0.3, 0.6, 0.9):
        (tmp_path / "cut.uph").write_bytes(data[: 400 + int(share * len(data))])
        done = refine(tmp_path / "cut.uph", [f"atlas:{tmp_path / 'c.png'}"])
        seen.append(len(done.written))
        assert not done.complete
    assert seen[0] == 1
    assert seen == sorted(seen)
    assert seen[-1] == 4


def test_one_file_is_an_image_whatever_its_name(command: Any, tmp_path: Path) -> None:
    """A flat picture is the texels, and of one file no material is made."""
    done = command(
        "wall/wall_albedo.png", "--on", "plane", "--texels", "64x96", "-o", tmp_path / "a.png",
        "-o", tmp_path / "a.npz",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert sorted(os.listdir(tmp_path)) == ["a.npz", "a.png"]
    with np.load(tmp_path / "a.npz") as file:
        assert file["chart_000"].shape == (96, 64, 3)
        np.testing.assert_array_equal(read_image(tmp_path / "a.png"), file["chart_000"])


def test_in_python(folder: Path, tmp_path: Path) -> None:
    wall = folder / "wall"
    material = upholster.read_material(
        {"albedo": wall / "wall_albedo.png", "normal": wall / "wall_normal.png"}
    )
    surface = upholster.plane()
    quilt = upholster.synthesize(material, surface, texels=(48, 64), seed=2)
    maps = upholster.paint_material(quilt, material)
    upholster.write(tmp_path / "a.png", surface, maps, flat=True)
    np.testing.assert_array_equal(read_image(tmp_path / "a_normal.png"), maps["normal"].arrays[0])
    report = cover(
        material, "plane", [str(tmp_path / "b.png")], synthesis={"texels": (48, 64)}, seed=2,
        report=tmp_path / "b.json",
    )  # fmt: skip
    for name in ("", "_normal"):
        assert (tmp_path / f"a{name}.png").read_bytes() == (tmp_path / f"b{name}.png").read_bytes()
    assert report.settled["maps"] == "albedo, normal"
    with pytest.raises(InputError, match="albedo"):
        upholster.write(tmp_path / "c.glb", surface, {"normal": maps["normal"]})
    sphere, albedo = upholster.sphere(), material.maps["albedo"]
    texels = upholster.paint(upholster.synthesize(albedo, sphere, texels=20000), albedo)
    with pytest.raises(InputError, match="one chart"):
        upholster.write(tmp_path / "c.png", sphere, texels, flat=True)
    with pytest.raises(InputError, match="lacks 'normal'"):
        upholster.write(tmp_path / "c.uph", surface, maps, quilt=quilt, exemplar=material.color())
    assert not list(tmp_path.glob("c*"))


def test_a_function_tells_the_direction(folder: Path, tmp_path: Path) -> None:
    def swirl(points: Any) -> Any:
        return np.stack([-points[:, 1], points[:, 0], 0 * points[:, 0]], axis=1)

    report = cover(
        folder / "plain.png", "sphere", [str(tmp_path / "a.npz")], report=tmp_path / "a.json",
        synthesis={"texels": 20000, "direction": swirl},
    )  # fmt: skip
    assert report.settled["direction"].startswith("swirl, ")
    assert json.loads((tmp_path / "a.json").read_text())["parameters"]["direction"].startswith("swirl")
    for wrong in (np.nan, 0.0):
        with pytest.raises(InputError, match=r"direction.* is (not finite|nowhere along)"):
            cover(
                folder / "plain.png", "sphere", [str(tmp_path / "b.npz")],
                synthesis={"texels": 20000, "direction": lambda points, wrong=wrong: points * wrong},
            )  # fmt: skip
    assert sorted(os.listdir(tmp_path)) == ["a.json", "a.npz"]


def test_method_paper_paints_materials_too(command: Any, tmp_path: Path) -> None:
    """It matches the base colour alone: the quilt is the plain image's, and paints every map."""
    for name, exemplar in (("plain", "plain.png"), ("wall", "wall")):
        done = command(
            exemplar,
            "--on",
            "torus:R=3,r=1",
            "--method",
            "paper",
            "--chart",
            "64",
            "-o",
            tmp_path / f"{name}.npz",
        )
        assert done.returncode == 0, done.stderr
    with np.load(tmp_path / "plain.npz") as plain, np.load(tmp_path / "wall.npz") as wall:
        for name in plain.files:
            np.testing.assert_array_equal(plain[name], wall[name])
        follows(wall["chart_003"], wall["roughness_003"], wall["height_003"])


PAPER = ["--method", "paper"]
WALL = ["wall/wall_albedo.png", "wall/wall_normal.png"]
BAD = {
    "direction zero": (["plain.png", "--on", "sphere", "--direction", "0,0,0"], "direction"),
    "direction no number": (["plain.png", "--on", "sphere", "--direction", "nan,0,1"], "direction"),
    "direction beyond floats": (["plain.png", "--on", "sphere", "--direction", "1e999,0,1"], "direction"),
    "direction off the surface": (
        ["plain.png", "--on", "plane", "--direction", "0,0,1"],
        "nowhere along the surface",
    ),
    "direction misspelt": (["plain.png", "--on", "sphere", "--direction", "up"], "around"),
    "sample too large": (["plain.png", "--on", "sphere", "--sample-size", "1e9"], "less than one block"),
    "sample too small": (
        ["plain.png", "--on", "sphere", "--sample-size", "1e-9"],
        "pixels of the sample to a texel",
    ),
    "sample negative": (["plain.png", "--on", "sphere", "--sample-size", "-1"], "sample size"),
    "sample no number": (["plain.png", "--on", "sphere", "--sample-size", "nan"], "sample size"),
    "too few texels": (["plain.png", "--on", "sphere", "--texels", "63"], "texels is 63"),
    "too thin": (["plain.png", "--on", "sphere", "--density", "1"], "density is 1"),
    "too dense": (["plain.png", "--on", "sphere", "--density", "1e6"], "GiB"),
    "too many texels": (["plain.png", "--on", "sphere", "--texels", "3G"], "texels"),
    "texels no number": (["plain.png", "--on", "sphere", "--texels", "many"], "texels"),
    "density and texels": (["plain.png", "--on", "sphere", "--texels", "1M", "--density", "9"], "density"),
    "block beyond the exemplar": (["plain.png", "--on", "sphere", "--block", "49"], "8 to 48"),
    "overlap": (["plain.png", "--on", "sphere", "--block", "20", "--overlap", "11"], "overlap"),
    "unknown method": (["plain.png", "--on", "sphere", "--method", "quilted"], "did you mean 'quilt'"),
    "normal scale": ([*WALL, "--on", "sphere", "--normal-scale", "-1"], "normal_scale"),
    "tileable, no size": (["plain.png", "--on", "plane", "--tileable"], "tileable"),
    "tileable, a number": (["plain.png", "--on", "plane", "--tileable", "--texels", "64k"], "tileable"),
    "flat, many patches": (["plain.png", "--on", "sphere", "--texels", "64x64"], "6 patches"),
    "flat, too small": (["plain.png", "--on", "plane", "--texels", "64x4"], "8 to 16384"),
    "flat with a density": (["plain.png", "--on", "plane", "--texels", "64x64", "--density", "3"], "density"),
    "flat with a direction": (
        ["plain.png", "--on", "plane", "--texels", "64x64", "--direction", "v"],
        "direction",
    ),
    "chart of paper": (["plain.png", "--on", "sphere", "--chart", "64"], "chart belongs to method 'paper'"),
    "levels of paper": (["plain.png", "--on", "sphere", "--levels", "3"], "levels belongs to method 'paper'"),
    "seams of paper": (["plain.png", "--on", "sphere", "--no-seams"], "seams belongs to method 'paper'"),
    "texels of quilt": (["plain.png", "--on", "sphere", *PAPER, "--texels", "1M"], "texels belongs"),
    "density of quilt": (["plain.png", "--on", "sphere", *PAPER, "--density", "9"], "density belongs"),
    "sample of quilt": (["plain.png", "--on", "sphere", *PAPER, "--sample-size", "1"], "sample_size belongs"),
    "direction of quilt": (["plain.png", "--on", "sphere", *PAPER, "--direction", "u"], "direction belongs"),
    "tileable of quilt": (["plain.png", "--on", "sphere", *PAPER, "--tileable"], "tileable belongs"),
    "maps of different shapes": ([*WALL, "wall_ao.png", "--on", "sphere"], "ao is 40x48"),
    "unknown role": ([*WALL, "wall_shine.png", "--on", "sphere"], "role of 'wall_shine.png'"),
    "two of one role": ([*WALL, "bare/bare_normal.png", "--on", "sphere"], "two files of role 'normal'"),
    "map without a file": (["plain.png", "--map", "ao", "--on", "sphere"], "allowed: role=file"),
    "map twice": (["wall", "--map", "ao=a", "--map", "ao=b", "--on", "sphere"], "'ao' is given twice"),
    "map of no role": (["wall", "--map", "shine=plain.png", "--on", "sphere"], "role 'shine' is unknown"),
    "normal of no way": (["wall", "--normal", "up", "--on", "sphere"], "normal is 'up'; allowed: gl"),
    "normal of an image": (["plain.png", "--normal", "dx", "--on", "sphere"], "is not a material"),
    "zip file missing": (["none.zip", "--on", "sphere"], "'none.zip' does not exist"),
    "no albedo": (["bare", "--on", "sphere"], "folder 'bare': material has no albedo"),
    "no map": ([*WALL, "notes.txt", "--on", "sphere"], "notes.txt"),
    "map missing": ([*WALL, "wall_height.png", "--on", "sphere"], "wall_height.png"),
    "crop of a material": ([*WALL, "--crop", "60,60,32,32", "--on", "sphere"], "crop"),
    "size of a material": ([*WALL, "--resize", "8", "--on", "sphere"], "resize"),
    "a map's file twice": (
        ["wall", "--on", "sphere", "-o", "atlas:a.png", "-o", "a_normal.png"],
        "'a_normal.png' is given twice",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_line_and_status_2(name: str, command: Any, folder: Path) -> None:
    arguments, named = BAD[name]
    before = sorted(folder.rglob("*"))
    assert_one_line(command(*arguments, "-o", "a.glb"), named)
    assert sorted(folder.rglob("*")) == before
