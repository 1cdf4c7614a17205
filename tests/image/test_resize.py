from typing import Any

import numpy as np
import pytest

from upholster.image import resize as module
from upholster.image.color import from_linear, to_linear
from upholster.image.resize import resize_image


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("size", [(64, 48), (33, 100), (7, 5), (200, 300)])
def test_constant_stays(dtype: Any, size: Any) -> None:
    value = 77 if dtype != np.float32 else 0.3
    pixels = np.full((100, 70, 3), value, dtype)
    small = resize_image(pixels, height=size[0], width=size[1])
    assert small.shape == (*size, 3)
    assert small.dtype == dtype
    np.testing.assert_allclose(small, np.full((*size, 3), value, dtype), rtol=1e-5)


def test_mean_is_kept_in_linear_light() -> None:
    """Black and white in equal parts look like 188, not like 128."""
    board = np.indices((256, 256)).sum(axis=0) % 2 * np.uint8(255)
    small = resize_image(board.astype(np.uint8)[:, :, None], height=32, width=32)
    assert np.abs(small.astype(int) - 188).max() <= 2


def test_ramp_stays_a_ramp() -> None:
    """A linear function is reproduced away from the borders, so nothing is shifted."""
    ramp = np.add.outer(np.arange(240) * 2.0, np.arange(160) + 5.0)[:, :, None].astype(np.float32)
    small = resize_image(ramp, height=60, width=80)
    expected = np.add.outer((np.arange(60) + 0.5) * 8 - 1, (np.arange(80) + 0.5) * 2 - 0.5 + 5)[:, :, None]
    np.testing.assert_allclose(small[4:-4, 4:-4], expected[4:-4, 4:-4], rtol=1e-4)


def test_no_aliasing() -> None:
    """A pattern finer than the new pixels vanishes into grey, rather than showing up as stripes."""
    fine = np.sin(np.arange(1024) * 2.9)[None, :, None] * 0.5 + 0.5
    small = resize_image(np.repeat(fine, 64, axis=0).astype(np.float32), height=64, width=100)
    assert np.ptp(small[:, 5:-5]) < 0.03


def test_transparent_color_does_not_bleed() -> None:
    pixels = np.zeros((64, 64, 4), np.uint8)
    pixels[:, :32] = (200, 100, 50, 255)
    pixels[:, 32:] = (0, 255, 0, 0)  # green, but nobody sees it
    small = resize_image(pixels, height=21, width=21)
    seen = small[small[:, :, 3] > 8][:, :3].astype(int)
    assert np.abs(seen - [200, 100, 50]).max() <= 2


def test_light_does_not_turn_negative() -> None:
    spot = np.zeros((64, 64, 1), np.float32)
    spot[32, 32] = 100
    assert resize_image(spot, height=100, width=100).min() >= 0


def test_bands_make_no_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    pixels = np.random.default_rng(3).integers(0, 256, (301, 97, 4), dtype=np.uint8)
    whole = resize_image(pixels, height=50, width=60)
    monkeypatch.setattr(module, "_BAND", 97 * 4 * 40)
    np.testing.assert_array_equal(resize_image(pixels, height=50, width=60), whole)


def test_same_size_is_the_same() -> None:
    pixels = np.random.default_rng(3).integers(0, 256, (40, 50, 3), dtype=np.uint8)
    np.testing.assert_array_equal(resize_image(pixels, height=40, width=50), pixels)
    assert from_linear(to_linear(pixels), np.uint8).shape == pixels.shape
