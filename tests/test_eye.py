"""The judge of textures: figures, textbook quilting, windows unfolded from models, pairs without names."""

import csv
from pathlib import Path

import numpy as np
import pytest
from benchmarks.eye_measures import broken_windows, copies, window_sides
from benchmarks.eye_pairs import write_pairs
from benchmarks.quilting import quilting
from benchmarks.unfolding import unfolded_windows

from upholster.image.files.write import write_image
from upholster.output.glb_picture import ShownModel


def noise(height: int, width: int, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    found = rng.normal(size=(height, width, 3))
    for axis in (0, 1):
        found = sum(np.roll(found, shift, axis) for shift in range(4))
    return np.uint8(np.clip(128 + 10 * found, 0, 255))


def test_windows_are_as_large_as_elements() -> None:
    assert window_sides(noise(128, 200)) == (32, 48, 64)
    assert window_sides(noise(256, 300)) == (32, 48, 64, 96, 128)
    assert window_sides(noise(50, 50)) == (24,)


def test_copied_windows_are_whole_and_others_broken() -> None:
    sample = noise(96, 96)
    # Windows at even places, as halved samples have them.
    assert broken_windows([sample[8:72, 20:84]], sample, (24, 32)) < 0.01
    cut = sample[8:72, 20:84].copy()
    cut[:, 32:] = sample[30:94, 2:34]
    assert (
        0.1 < broken_windows([cut], sample, (24, 32)) < broken_windows([noise(64, 64, 2)], sample, (24, 32))
    )
    assert broken_windows([noise(64, 64, 2)], sample, (24, 32)) == pytest.approx(1.2, abs=0.5)


def test_copies_are_found_anywhere_and_nearby() -> None:
    sheet = noise(96, 200)
    assert copies(sheet, side=16) == (0, 0)
    sheet[:40, 150:190] = sheet[50:90, 10:50]
    copied = 2 * (40 - 15) ** 2 / ((96 - 15) * (200 - 15))
    assert copies(sheet, side=16) == pytest.approx((copied, copied))
    assert copies(sheet, side=16, near=139) == pytest.approx((copied, 0))
    tiled = np.tile(noise(32, 32), (3, 3, 1))
    assert copies(tiled, side=16, near=32) == (1, 1)


def test_quilting_continues_a_sample_that_wraps() -> None:
    sample = np.tile(noise(16, 16), (4, 4, 1))
    sheet = quilting(sample, 80, seed=3)
    assert sheet.shape == (80, 80, 3)
    row, column = np.argwhere((sample[:16, :16] == sheet[0, 0]).all(axis=2))[0]
    wrapped = np.roll(np.tile(sample, (2, 2, 1)), (-row, -column), (0, 1))
    assert np.array_equal(sheet, wrapped[:80, :80])
    other = noise(64, 64)
    sheets = [quilting(other, 100, seed=seed) for seed in (1, 1, 2)]
    assert np.array_equal(sheets[0], sheets[1])
    assert not np.array_equal(sheets[0], sheets[2])
    colors = {tuple(pixel) for pixel in other.reshape(-1, 3)}
    assert {tuple(pixel) for pixel in sheets[0].reshape(-1, 3)} <= colors


def barrel(texture: np.ndarray) -> ShownModel:
    """A cylinder around the z axis, open above and below, whose texels are squares of side 1."""
    height, around = texture.shape[:2]
    rows, columns = (part.ravel() for part in np.mgrid[0:height:6, 0:around:6])
    lower = np.stack([rows, columns], axis=1)
    # Rows run down, columns to the right as seen from outside; corners run against the clock.
    square = lower[:, None] + np.array([(0, 0), (6, 0), (6, 6), (0, 6)])
    places = np.concatenate([square[:, [0, 1, 2]], square[:, [0, 2, 3]]]).astype(float)
    angle = 2 * np.pi * places[..., 1] / around
    radius = around / (2 * np.pi)
    space = np.stack([radius * np.cos(angle), radius * np.sin(angle), -places[..., 0]], axis=2)
    return ShownModel(space, np.zeros_like(space), places[..., ::-1], texture, {})


def test_windows_unfolded_from_a_barrel_are_its_texture() -> None:
    texture = noise(96, 240)
    wide = np.tile(texture, (1, 2, 1))
    windows = unfolded_windows(barrel(texture), 1.0, "around:z", (32,))
    assert all(window.shape == (32, 32, 3) for window in windows)
    assert broken_windows(windows, wide, (24,), count=30) < 0.2
    for turned in (np.fliplr, np.flipud, np.rot90):
        assert broken_windows([turned(window) for window in windows], wide, (24,), count=30) > 1


def test_pages_of_pairs_have_no_names_and_the_key_has_them(tmp_path: Path) -> None:
    shown = {}
    for number in range(6):
        files = {way: tmp_path / f"{way}{number}.png" for way in ("ours", "textbook")}
        sample = tmp_path / f"stone{number}.png"
        for seed, file in enumerate((sample, *files.values())):
            write_image(file, noise(32, 32, 3 * number + seed))
        shown[sample, "flat"] = files
    page = write_pairs(tmp_path, shown, [("ours", "textbook")], seed=4)
    said = page.read_text(encoding="utf-8")
    assert said.count("<img") == 6
    assert not any(word in said for word in ("ours", "textbook", "stone"))
    with (tmp_path / "key.csv").open(encoding="utf-8") as file:
        key = list(csv.DictReader(file))
    assert sorted(row["sample"] for row in key) == [f"stone{n}" for n in range(6)]
    assert {row["A"] for row in key} == {"ours", "textbook"}
    assert all({row["A"], row["B"]} == {"ours", "textbook"} for row in key)
    assert all((page.parent / f"{row['pair']}.png").exists() for row in key)
