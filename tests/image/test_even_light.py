"""Even light: what was put on is taken out, and what was there stays."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upholster.image.color import from_linear, to_linear
from upholster.image.files.material_files import read_material
from upholster.image.files.read import read_exemplar
from upholster.image.files.write import write_image
from upholster.image.photo.even_light import UNEVEN, even_light, light_range

EXAMPLES = Path(__file__).parents[2] / "examples"
NAMES = ("bricks", "granite", "grass", "gravel", "pebbles", "weave")


def light(kind: str, height: int = 256, width: int = 256) -> np.ndarray:
    y, x = ((2 * np.arange(n) + 1) / n - 1 for n in (height, width))
    x, y = np.meshgrid(x, y)
    vignette = 1 / (1 + 0.35 * ((x - 0.1) ** 2 + (y + 0.1) ** 2)) ** 2  # a lens' law, off the middle
    slope = np.exp(0.35 * x - 0.2 * y)
    return {"vignette": vignette, "slope": slope, "both": vignette * slope}[kind]


def tilt(applied: Any) -> float:
    return float(np.log(applied).std())


def texture(name: str, kind: str | None = None, dtype: Any = np.uint8) -> Any:
    linear = to_linear(read_exemplar(EXAMPLES / f"{name}.png"))[:, :, :3]
    return from_linear(linear if kind is None else 0.9 * linear * light(kind)[:, :, None], dtype)


def gain(before: Any, after: Any) -> Any:
    """What cells of 8 × 8 pixels were multiplied with."""
    sums = []
    for image in (before, after):
        linear = to_linear(image)[:, :, :3].sum(axis=2, dtype=float)
        sums.append(linear.reshape(linear.shape[0] // 8, 8, -1, 8).sum(axis=(1, 3)))
    return sums[1] / sums[0]


@pytest.mark.slow(reason="large photographs")
@pytest.mark.parametrize(("kind", "names"), [("vignette", NAMES), ("slope", NAMES[1::2]), ("both", NAMES)])
def test_most_of_the_light_goes(kind: str, names: tuple[str, ...]) -> None:
    left = []
    for name in names:
        dark = texture(name, kind, np.uint16)
        rest = light(kind)[4::8, 4::8] * gain(dark, even_light(dark))
        left.append(tilt(rest) / tilt(light(kind)))
        assert left[-1] < 0.6, name
    assert np.mean(left) < 0.35


@pytest.mark.parametrize("name", NAMES)
def test_an_evenly_lit_sample_stays(name: str) -> None:
    pixels = texture(name, None, np.uint16)
    assert tilt(gain(pixels, even_light(pixels))) < 0.045


def test_the_arrangement_of_elements_is_no_light() -> None:
    """Black and white tiles at random, eight across: they have a slope by chance."""
    for seed in range(4):
        tiles = np.random.default_rng(seed).choice([60, 190], (8, 8)).astype(np.uint8)
        pixels = tiles.repeat(32, axis=0).repeat(32, axis=1)[:, :, None]
        after = even_light(pixels)
        assert tilt(gain(pixels, after)) < 0.1 * tilt(to_linear(pixels))


def test_a_plain_wall_becomes_plain() -> None:
    wall = np.full((200, 300, 3), (0.5, 0.3, 0.2), np.float32) * light("both", 200, 300)[:, :, None]
    after = even_light(wall.astype(np.float32))
    assert (after.std(axis=(0, 1)) / after.mean(axis=(0, 1))).max() < 0.02
    np.testing.assert_allclose(after.mean(), wall.mean(), rtol=1e-3)


@pytest.mark.parametrize("value", [0, 77, 255])
def test_one_colour_is_returned_as_it_is(value: int) -> None:
    pixels = np.full((40, 50, 3), value, np.uint8)
    assert even_light(pixels) is pixels


def test_colours_keep_their_ratios() -> None:
    """One gain for all channels: chromaticity does not change."""
    pixels = to_linear(texture("bricks", "both", np.uint16))
    after = even_light(pixels)
    shares = [image / np.maximum(image.sum(axis=2, keepdims=True), 1e-6) for image in (pixels, after)]
    np.testing.assert_allclose(*shares, atol=1e-5)


@pytest.mark.slow(reason="large photographs")
def test_mean_light_and_depth_and_alpha_are_kept() -> None:
    for dtype in (np.uint8, np.uint16, np.float32):
        pixels = texture("granite", "both", dtype)
        one = 1.0 if dtype == np.float32 else np.iinfo(dtype).max
        alpha = np.full((256, 256, 1), one, dtype)
        alpha[:40] = 0
        cut = np.concatenate([pixels, alpha], axis=2)
        cut[:40, :, :3] = one  # what nobody sees must not count
        after = even_light(cut)
        assert after.dtype == dtype
        np.testing.assert_array_equal(after[:, :, 3:], alpha)
        means = [to_linear(image)[40:, :, :3].mean() for image in (cut, after)]
        assert means[1] == pytest.approx(means[0], rel=0.02)
        assert tilt((light("both")[4::8, 4::8] * gain(cut, after))[5:]) < 0.5 * tilt(light("both")[44:])


def test_floats_are_not_changed_in_place() -> None:
    pixels = to_linear(texture("granite", "both"))
    before = pixels.copy()
    assert even_light(pixels) is not pixels
    np.testing.assert_array_equal(pixels, before)


@pytest.mark.parametrize("size", [(32, 32), (33, 200), (4096, 32)])
def test_any_size_works(size: Any) -> None:
    pixels = np.random.default_rng(1).integers(90, 160, (*size, 3), dtype=np.uint8)
    after = even_light(pixels)
    assert after.shape == pixels.shape
    assert np.abs(after.astype(int) - pixels).max() < 40


def test_of_a_material_the_albedo_alone(tmp_path: Path) -> None:
    for role in ("albedo", "height", "emission"):
        write_image(tmp_path / f"wall_{role}.png", texture("granite", "both"))
    plain, even = read_material(tmp_path).maps, read_material(tmp_path, even_light=True).maps
    assert (plain["albedo"] != even["albedo"]).any()
    for role in ("height", "emission"):
        np.testing.assert_array_equal(plain[role], even[role])


def test_the_range_of_light_is_reported() -> None:
    rng = np.random.default_rng(3)
    even = rng.integers(60, 200, (96, 128, 3)).astype(np.uint8)
    assert light_range(even) < UNEVEN
    light = np.linspace(1, 0.5, 128)[None, :, None]
    shaded = from_linear(to_linear(even) * light.astype(np.float32), np.uint8)
    assert light_range(shaded) == pytest.approx(1.8, abs=0.15)
    assert light_range(np.concatenate([shaded, even, even], axis=2)) == light_range(shaded)
