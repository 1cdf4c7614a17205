"""``upholster prepare`` and the same options of ``cover``."""

import re
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

import upholster
from upholster.base.options.sample_options import SampleOptions
from upholster.covering.photos import prepare_sample
from upholster.image.color import from_linear
from upholster.image.files.read import read_image
from upholster.image.files.write import write_image
from upholster.image.photo.rectify import Rectification

BRICKS = Path(__file__).parents[1] / "examples" / "bricks.png"
CORNERS = ("--rectify", "10,12", "240,20", "250,251", "5,240")
SOME = ((10, 12), (240, 20), (250, 251), (5, 240))


def test_a_photo_becomes_a_sample(tmp_path: Path) -> None:
    done = run_cli(
        "prepare", BRICKS, "-o", "sample.png", *CORNERS, "--even-light", "--crop", "0,0,200,180",
        "--resize", "100", "--picture", "both.jpg", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "100x90 pixels of 8 bits" in done.stdout
    expected = upholster.read_exemplar(
        BRICKS, rectify=SOME, crop=(0, 0, 200, 180), resize=100, even_light=True
    )
    np.testing.assert_array_equal(read_image(tmp_path / "sample.png"), expected)
    picture = read_image(tmp_path / "both.jpg")
    assert picture.shape == (512, 512 + 16 + 569, 3)
    pink = (picture[..., 0] > 200) & (picture[..., 1] < 100) & (picture[..., 2] > 100)
    assert pink[:, :512].sum() > 1000  # the outline, on the photo alone
    assert pink[:, 528:].sum() == 0


@pytest.mark.slow(reason="covers several models, or one several times")
@pytest.mark.parametrize(
    ("dtype", "channels"), [(np.uint8, 1), (np.uint16, 2), (np.uint16, 3), (np.uint8, 4)]
)
def test_depth_and_channels_are_kept(tmp_path: Path, dtype: type, channels: int) -> None:
    pixels = np.random.default_rng(3).integers(0, np.iinfo(dtype).max, (60, 70, channels)).astype(dtype)
    write_image(tmp_path / "x.png", pixels)
    report = prepare_sample(
        tmp_path / "x.png", tmp_path / "y.png", SampleOptions(), picture=tmp_path / "p.png"
    )
    np.testing.assert_array_equal(read_image(tmp_path / "y.png"), pixels)
    assert (report.width, report.height, report.bits) == (70, 60, 8 * pixels.itemsize)


def test_cover_takes_the_same_options(tmp_path: Path) -> None:
    prepared = run_cli("prepare", BRICKS, "-o", "s.png", *CORNERS, "--even-light", cwd=tmp_path)
    assert prepared.returncode == 0, prepared.stderr
    flat = ("--on", "plane", "--texels", "128x128", "-q")
    for sample, options, out in (("s.png", (), "a.png"), (BRICKS, (*CORNERS, "--even-light"), "b.png")):
        done = run_cli("cover", sample, *flat, *options, "-o", out, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    np.testing.assert_array_equal(read_image(tmp_path / "a.png"), read_image(tmp_path / "b.png"))


BAD = {
    "three corners": (["-o", "s.png", "--rectify", "1,1", "9,1", "9,9"], "--rectify"),
    "no numbers": (["-o", "s.png", "--rectify", "1,1", "9,x", "9,9", "1,9"], "rectify is '9,x'"),
    "outside": (["-o", "s.png", "--rectify", "1,1", "900,1", "9,9", "1,9"], "the corner 900,1"),
    "crossing": (["-o", "s.png", "--rectify", "1,1", "90,90", "90,1", "1,90"], "no convex quadrilateral"),
    "crop": (["-o", "s.png", *CORNERS, "--crop", "0,0,300,300"], "crop is 0,0,300,300"),
    "no image": (["-o", "s.glb"], "'s.glb' is no image"),
    "no picture": (["-o", "s.png", "--picture", "p.txt"], "'p.txt' is no image"),
    "same file twice": (["-o", "s.png", "--picture", "s.png"], "given twice"),
    "the photo itself": (["-o", BRICKS], "same file as input"),
    "too small": (["-o", "s.png", "--resize", "8"], "resize is 8"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_is_said_in_one_line(tmp_path: Path, case: str) -> None:
    arguments, named = BAD[case]
    assert_one_line(run_cli("prepare", BRICKS, *arguments, cwd=tmp_path), named)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow(reason="covers several models, or one several times")
def test_a_note_is_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a reader has to tell comes out of all commands."""
    from PIL import Image

    photo = Image.fromarray(np.full((64, 64, 3), 90, np.uint8))
    photo.save(tmp_path / "x.tif", icc_profile=b"no profile")
    for command in (["prepare", "x.tif", "-o", "s.png"], ["encode", "x.tif", "-o", "x.ezw"], [
        "cover", "x.tif", "--on", "plane", "--texels", "64x64", "-o", "t.png",
    ]):  # fmt: skip
        done = run_cli(*command, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        said = done.stdout + done.stderr
        assert said.count("note: 'x.tif': the colour profile was not applied") == 1


@pytest.mark.slow(reason="covers several models, or one several times")
def test_what_would_help_is_reported_and_helps(tmp_path: Path) -> None:
    weave = upholster.read_exemplar(BRICKS.with_name("weave.png"))
    seen = Rectification(((0, 0), (256, 40), (256, 216), (0, 256)), 256, 256).apply(weave)
    shaded = seen * np.linspace(1, 0.4, seen.shape[1])[None, :, None]
    write_image(tmp_path / "photo.png", from_linear(shaded.astype(np.float32), "uint8"))
    reported = run_cli("prepare", "photo.png", "-o", "a.png", cwd=tmp_path).stdout
    assert "--even-light" in reported
    (words,) = re.findall(r"--rectify ((?:[0-9]+,[0-9]+ ){4})", reported)
    done = run_cli(
        "prepare", "photo.png", "-o", "b.png", "--even-light", "--rectify", *words.split(), cwd=tmp_path
    )
    assert done.returncode == 0
    assert "note" not in done.stdout
