"""`--use`: a mask of the sample, in the command, the library and project files."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

import upholster
from upholster import Project, Sample, read_project, save_project
from upholster.apps.studio.words import command, python
from upholster.codec.stream.reader import read_stream
from upholster.image.files.read import read_image
from upholster.image.files.write import write_image

BRICKS = Path(__file__).parents[1] / "examples" / "bricks.png"
FLAT = ("--on", "plane", "--texels", "160x140")
HIDDEN = (255, 0, 255)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A photo of bricks with a window of a colour that bricks do not have, and its mask."""
    photo = read_image(BRICKS)[..., :3].copy()
    used = np.ones(photo.shape[:2], bool)
    used[60:130, 90:150] = False
    photo[~used] = HIDDEN
    write_image(tmp_path / "photo.png", photo)
    write_image(tmp_path / "mask.png", np.where(used, 255, 0).astype(np.uint8)[..., None])
    return tmp_path


def is_hidden(pixels: np.ndarray) -> np.ndarray:
    red, green, blue = (pixels[..., k].astype(int) for k in range(3))
    return (red - green > 60) & (blue - green > 60)


@pytest.mark.slow(reason="covers several models, or one several times")
def test_the_command_and_the_library_write_the_same(folder: Path) -> None:
    done = run_cli(
        "cover", "photo.png", "--use", "mask.png", *FLAT, "-o", "a.png", "--report", "a.json", cwd=folder
    )
    assert done.returncode == 0, done.stderr
    reported = json.loads((folder / "a.json").read_text())
    assert reported["parameters"]["use"] == "mask.png"
    assert not is_hidden(read_image(folder / "a.png")).any()
    use = str(folder / "mask.png")
    upholster.cover(
        str(folder / "photo.png"),
        "plane",
        str(folder / "b.png"),
        sample={"use": use},
        synthesis={"texels": (160, 140)},
    )
    assert (folder / "a.png").read_bytes() == (folder / "b.png").read_bytes()
    quilt = upholster.synthesize(
        Sample(folder / "photo.png", options={"use": use}), "plane", texels=(160, 140)
    )
    texels = upholster.paint_material(quilt, Sample(folder / "photo.png", options={"use": use}))["albedo"]
    np.testing.assert_array_equal(texels.arrays[0], read_image(folder / "a.png"))
    done = run_cli("cover", "photo.png", *FLAT, "-o", "c.png", cwd=folder)
    assert is_hidden(read_image(folder / "c.png")).mean() > 0.02


@pytest.mark.slow(reason="covers several models, or one several times")
def test_a_stream_holds_nothing_of_what_is_hidden(folder: Path) -> None:
    done = run_cli("cover", "photo.png", "--use", "mask.png", *FLAT, "-o", "a.uph", "-o", "a.png", cwd=folder)
    assert done.returncode == 0, done.stderr
    sample = read_stream((folder / "a.uph").read_bytes()).exemplar()
    assert not is_hidden(sample).any()


def test_a_project_keeps_its_mask(folder: Path, tmp_path: Path) -> None:
    sample = Sample(
        str(folder / "photo.png"), options={"use": str(folder / "mask.png"), "crop": (0, 0, 200, 200)}
    )
    project = Project("plane", sample, synthesis={"texels": (96, 80)})
    assert str(folder / "mask.png") in project.files()
    place = tmp_path / "other" / "x.upholster.json"
    copied = save_project(project, place)
    assert {Path(file).name for file in copied} == {"photo.png", "mask.png"}
    reported = json.loads(place.read_text())
    assert reported["sample"] == {"source": "photo.png", "use": "mask.png", "crop": [0, 0, 200, 200]}
    assert set(reported["files"]) == {"photo.png", "mask.png"}
    again = read_project(place)
    assert again.sample is not None
    assert again.sample.options.use == str(place.parent / "mask.png")
    project.cover([str(folder / "a.png")])
    again.cover([str(folder / "b.png")])
    assert (folder / "a.png").read_bytes() == (folder / "b.png").read_bytes()
    assert again.change(use=None).sample == Sample(
        str(place.parent / "photo.png"), options={"crop": (0, 0, 200, 200)}
    )
    assert "--use mask.png" in command(project, "x.png")
    assert "'use': " in python(project, "x.png")
    write_image(place.parent / "mask.png", np.full((256, 256, 1), 255, np.uint8))
    assert "mask.png has changed since the project was saved" in read_project(place).notes


def test_a_project_reaches_no_mask_outside_its_folder(folder: Path) -> None:
    place = folder / "in" / "x.upholster.json"
    place.parent.mkdir()
    reported = {"upholster": 1, "model": "plane", "sample": {"source": "p.png", "use": "../mask.png"}}
    place.write_text(json.dumps(reported))
    (place.parent / "p.png").write_bytes((folder / "photo.png").read_bytes())
    done = run_cli("cover", "--project", place, "-o", "x.png", cwd=folder)
    assert_one_line(done, "mask.png")
    reported["sample"]["use"] = "alpha"  # type: ignore[index]  # that is no file
    place.write_text(json.dumps(reported))
    assert read_project(place).files() == [str(place.parent / "p.png")]


def test_prepare_writes_the_mask_as_alpha(folder: Path) -> None:
    done = run_cli(
        "prepare", "photo.png", "--use", "mask.png", "--resize", "128", "-o", "sample.png", cwd=folder
    )
    assert done.returncode == 0, done.stderr
    assert "--use alpha" in done.stdout
    sample = read_image(folder / "sample.png")
    assert sample.shape == (128, 128, 4)
    assert set(np.unique(sample[..., 3])) == {0, 255}
    assert not is_hidden(sample).any()
    done = run_cli("cover", "sample.png", "--use", "alpha", *FLAT, "-o", "x.png", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert read_image(folder / "x.png").shape == (140, 160, 3)
    assert_one_line(run_cli("prepare", "photo.png", "--use", "mask.png", "-o", "s.jpg", cwd=folder), "s.jpg")


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--use", "mask.png", "--method", "paper", "--on", "torus"), "with method 'quilt'"),
        (("--use", "mask.png", "--method", "pixel", "--on", "torus"), "with method 'quilt'"),
        (("--use", "small.png", *FLAT), "256x256"),
        (("--use", "black.png", *FLAT), "leaves nothing"),
        (("--use", "speck.png", *FLAT), "12x12 pixels"),
        (("--use", "missing.png", *FLAT), "missing.png"),
        (("--use", "alpha", *FLAT), "alpha"),
        (("--use", "mask.png", "--crop", "95,65,40,40", *FLAT), "leaves nothing"),
    ],
)
def test_bad_masks_are_one_line(folder: Path, words: tuple[str, ...], named: str) -> None:
    write_image(folder / "small.png", np.full((64, 64, 1), 255, np.uint8))
    write_image(folder / "black.png", np.zeros((256, 256, 1), np.uint8))
    speck = np.zeros((256, 256, 1), np.uint8)
    speck[9:21, 30:90] = 255
    write_image(folder / "speck.png", speck)
    done = run_cli("cover", "photo.png", *words, "-o", "x.png", cwd=folder)
    assert_one_line(done)
    assert re.search(named, done.stderr)
    assert not (folder / "x.png").exists()


def test_a_mask_is_never_written_over(folder: Path) -> None:
    done = run_cli("cover", "photo.png", "--use", "mask.png", *FLAT, "-o", "mask.png", cwd=folder)
    assert_one_line(done, "mask.png")
