"""Masks of samples: what they are, how they go along with a photo, and what is left of what they hide."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upholster import InputError, read_material
from upholster.image.files.material import Material
from upholster.image.files.read import read_image
from upholster.image.files.source import Sample, read_source
from upholster.image.files.write import write_image
from upholster.image.masks import as_alpha, filled, is_white, largest_square, on_shape, squares

GREEN, HIDDEN = (20, 180, 30), (255, 0, 255)
CORNERS = ((10, 12), (90, 6), (96, 70), (4, 76))


def blob(height: int = 80, width: int = 100) -> np.ndarray:
    """Return a mask that hides an ellipse and a corner."""
    y, x = np.mgrid[:height, :width]
    hidden = (x - 0.6 * width) ** 2 / 300 + (y - 0.4 * height) ** 2 / 140 < 1
    return ~(hidden | ((x < 0.15 * width) & (y > 0.8 * height)))


def green(used: np.ndarray, dtype: Any = np.uint8) -> np.ndarray:
    """Return a noisy green photo, of another colour where it is not used; its red is the hidden colour's."""
    noise = np.random.default_rng(0).integers(0, 20, (*used.shape, 1))
    pixels = np.where(used[..., None], np.array(GREEN) + [0, 1, 0] * noise, np.array(HIDDEN))
    return (pixels * {np.uint8: 1, np.uint16: 257, np.float32: 1 / 255}[dtype]).astype(dtype)


def test_white_counts_and_what_is_clear_does_not() -> None:
    grey = np.array([[0, 127, 128, 255]], np.uint8)[..., None]
    assert is_white(grey).tolist() == [[False, False, True, True]]
    assert is_white(np.array([[0.4, 0.5]], np.float32)[..., None]).tolist() == [[False, True]]
    rgba = np.array([[(255, 255, 255, 100), (255, 255, 255, 200), (0, 0, 0, 255)]], np.uint8)
    assert is_white(rgba).tolist() == [[False, True, False]]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_what_is_not_used_leaves_no_trace(dtype: Any) -> None:
    used = blob(77, 61)
    pixels, other = green(used, dtype), green(np.ones_like(used), dtype)
    other[~used] = 0
    found = filled(pixels, used)
    assert found.dtype == dtype
    np.testing.assert_array_equal(found[used], pixels[used])
    np.testing.assert_array_equal(found, filled(other, used))
    for channel in range(3):
        shown = pixels[used][:, channel]
        margin = 1e-6 if dtype == np.float32 else 0
        assert found[..., channel].min() >= shown.min() - margin
        assert found[..., channel].max() <= shown.max() + margin
    assert filled(pixels, np.ones_like(used)) is pixels


@pytest.mark.parametrize("seed", range(4))
def test_squares_are_those_without_a_hidden_pixel(seed: int) -> None:
    used = np.random.default_rng(seed).random((19, 23)) < (0.6, 0.9, 0.99, 0.0)[seed]
    largest = 0
    for side in range(1, 20):
        wanted = np.array(
            [[used[i : i + side, j : j + side].all() for j in range(24 - side)] for i in range(20 - side)]
        )
        np.testing.assert_array_equal(squares(used, side), wanted)
        largest = side if wanted.any() else largest
    assert largest_square(used) == largest
    assert not squares(used, 20).any()
    assert largest_square(np.ones((19, 23), bool)) == 19


def test_of_a_smaller_map_pixels_are_used_that_show_nothing_else() -> None:
    used = blob(32, 48)
    np.testing.assert_array_equal(on_shape(used, 64, 96)[1::2, ::2], used)
    small = on_shape(used, 16, 24)
    np.testing.assert_array_equal(
        small, used[::2, ::2] & used[1::2, ::2] & used[::2, 1::2] & used[1::2, 1::2]
    )


GEOMETRIES: list[dict[str, Any]] = [
    {},
    {"crop": (8, 5, 70, 60)},
    {"resize": 64},
    {"resize": (150, 133)},
    {"rectify": CORNERS},
    {"rectify": CORNERS, "crop": (3, 2, 70, 50), "resize": (60, 50), "even_light": True},
]


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    used = blob()
    write_image(tmp_path / "photo.png", green(used))
    write_image(tmp_path / "mask.png", np.where(used, 255, 0).astype(np.uint8)[..., None])
    write_image(tmp_path / "cut.png", as_alpha(green(used), used))
    # The mask as a photo: what becomes of it tells where it should be.
    write_image(tmp_path / "shown.png", np.where(used, 255, 0).astype(np.uint8)[..., None].repeat(3, axis=2))
    return tmp_path / "photo.png"


@pytest.mark.parametrize("how", GEOMETRIES)
@pytest.mark.parametrize("use", ["mask.png", "alpha"])
def test_a_mask_goes_along_with_its_photo(photo: Path, how: dict[str, Any], use: str) -> None:
    source = photo.with_name("cut.png") if use == "alpha" else photo
    name = use if use == "alpha" else str(photo.with_name(use))
    found = read_source(Sample(source, options={**how, "use": name}))
    assert isinstance(found, Material)
    assert list(found.maps) == ["albedo"]
    pixels = found.color()
    assert pixels.shape[2] == 3  # an alpha that told is gone
    # Nothing of the hidden colour anywhere, not even mixed; even light changes brightness alone.
    assert (pixels[..., 1] > 3 * pixels[..., 0]).all()
    assert (pixels[..., 1] > 3 * pixels[..., 2]).all()
    shown = read_source(Sample(photo.with_name("shown.png"), options={**how, "even_light": False}))
    assert isinstance(shown, np.ndarray)
    assert found.used is not None
    # Linear light: half of it is 188 of 255.
    assert ((shown[..., 0] >= 188) != found.used).mean() < 0.01
    assert found.used[(shown == 255).all(axis=2)].mean() > 0.99
    assert not found.used[(shown == 0).all(axis=2)].any()


def test_a_white_mask_is_none(photo: Path) -> None:
    write_image(photo.with_name("white.png"), np.full((80, 100, 1), 255, np.uint8))
    found = read_source(Sample(photo, options={"use": str(photo.with_name("white.png"))}))
    assert isinstance(found, np.ndarray)
    np.testing.assert_array_equal(found, read_image(photo))


def test_all_maps_of_a_material_are_hidden_whatever_their_size(tmp_path: Path) -> None:
    used, maps = blob(64, 96), tmp_path / "maps"
    maps.mkdir()
    write_image(maps / "x_albedo.png", green(used))
    for role, (height, width) in (("roughness", (128, 192)), ("height", (32, 48))):
        there = on_shape(used, height, width)[..., None]
        write_image(maps / f"x_{role}.png", np.where(there, 100, 250).astype(np.uint8))
    normal = np.where(used[..., None], (128, 128, 255), 0).astype(np.uint8)
    write_image(maps / "x_normal.png", normal)
    write_image(tmp_path / "mask.png", np.where(used, 65535, 0).astype(np.uint16)[..., None])
    found = read_material(maps, use=str(tmp_path / "mask.png"), crop=(2, 2, 90, 60), resize=80)
    assert found.used is not None
    assert found.used.shape == found.shape
    assert (found.maps["roughness"] == 100).all()
    assert (found.maps["height"] == 100).all()
    assert (np.abs(found.maps["normal"].astype(int) - (128, 128, 255)) <= 1).all()
    assert (found.maps["albedo"][..., 0] <= GREEN[0] + 2).all()


def test_a_material_of_arrays_takes_a_mask() -> None:
    used = blob()
    found = Material({"albedo": green(used)}, used=used)
    np.testing.assert_array_equal(found.used, used)
    assert (found.maps["albedo"][..., 0] == GREEN[0]).all()
    assert Material({"albedo": green(used)}, used=np.ones_like(used)).used is None
    for wrong in (used[1:], used.astype(np.uint8), "mask.png"):
        with pytest.raises(InputError, match=r"^used is .*; allowed: shape \(80, 100\), bool"):
            Material({"albedo": green(used)}, used=wrong)
    with pytest.raises(InputError, match="leaves nothing"):
        Material({"albedo": green(used)}, used=np.zeros_like(used))


@pytest.mark.parametrize(
    ("use", "words"),
    [
        ("small.png", "mask '.*small.png' is 99x80 pixels; allowed: 100x80, as the upright photo"),
        ("black.png", "use '.*black.png' leaves nothing of the sample"),
        ("missing.png", "'.*missing.png' does not exist"),
        ("text.png", "'.*text.png' is not a readable image"),
    ],
)
def test_a_mask_that_does_not_fit_is_refused(photo: Path, use: str, words: str) -> None:
    folder = photo.parent
    write_image(folder / "small.png", np.full((80, 99, 1), 255, np.uint8))
    write_image(folder / "black.png", np.zeros((80, 100, 3), np.uint8))
    (folder / "text.png").write_text("white")
    with pytest.raises(InputError, match=words):
        read_source(Sample(photo, options={"use": str(folder / use)}))


def test_alpha_is_transparency_unless_it_is_asked_for(photo: Path) -> None:
    cut = photo.with_name("cut.png")
    plain = read_source(Sample(cut))
    assert isinstance(plain, np.ndarray)
    assert plain.shape[2] == 4
    with pytest.raises(InputError, match="use is 'alpha', but the sample has none"):
        read_source(Sample(photo, options={"use": "alpha"}))
    with pytest.raises(InputError, match="use is 7; allowed: an image's file, or 'alpha'"):
        Sample(photo, options={"use": 7})
    with pytest.raises(InputError, match="use is for files"):
        read_source(Sample(read_image(photo), options={"use": "mask.png"}))
