from typing import Any

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.image.color import alpha_channel, from_linear, to_linear


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_every_code_comes_back(dtype: Any, channels: int) -> None:
    codes = np.arange(np.iinfo(dtype).max + 1, dtype=dtype).reshape(-1, 16, 1)
    # Every channel sees other values, so that a mixed-up alpha would show.
    pixels = np.concatenate([np.roll(codes, 5 * channel, axis=0) for channel in range(channels)], axis=2)
    linear = to_linear(pixels)
    assert linear.dtype == np.float32
    np.testing.assert_array_equal(from_linear(linear, dtype), pixels)


def test_srgb_curve() -> None:
    """Values of IEC 61966-2-1: ends, the straight part, and the middle grey that everyone knows."""
    pixels = np.array([0, 10, 188, 255], np.uint8).reshape(1, -1, 1)
    np.testing.assert_allclose(
        to_linear(pixels).ravel(), [0, 10 / 255 / 12.92, ((188 / 255 + 0.055) / 1.055) ** 2.4, 1], rtol=1e-6
    )
    assert abs(float(to_linear(pixels)[0, 2, 0]) - 0.5) < 0.005


def test_alpha_is_linear() -> None:
    pixels = np.full((1, 1, 4), 128, np.uint8)
    linear = to_linear(pixels)[0, 0]
    assert linear[3] == np.float32(128 / 255)
    assert linear[0] < 0.22
    assert [alpha_channel(channels) for channels in (1, 2, 3, 4)] == [None, 1, None, 3]


def test_floats_are_linear_already() -> None:
    pixels = np.array([[[-0.5, 0.5, 70.0]]], np.float32)
    assert to_linear(pixels) is pixels
    assert from_linear(pixels, np.float32) is pixels


def test_out_of_range_is_clipped() -> None:
    linear = np.array([[[-1.0, 0.0, 2.0]]], np.float32)
    assert from_linear(linear, np.uint8).tolist() == [[[0, 0, 255]]]
    assert from_linear(linear, np.uint16).tolist() == [[[0, 0, 65535]]]


def test_bytes_round_to_nearest() -> None:
    linear = np.linspace(0, 1, 99991, dtype=np.float32).reshape(1, -1, 1)
    exact = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear.astype(float) ** (1 / 2.4) - 0.055)
    assert np.abs(from_linear(linear, np.uint8) - exact * 255).max() < 0.53
    assert np.abs(from_linear(linear, np.uint16) - exact * 65535).max() < 0.53
    # Of all 65536 steps this one comes nearest to a half: 213.4999…
    assert from_linear(np.array([[[43837 / 65535]]], np.float32), np.uint8) == 213


def test_other_types_are_refused() -> None:
    with pytest.raises(InputError, match=r"int32.*allowed: uint8"):
        from_linear(np.zeros((1, 1, 1), np.float32), np.int32)


def test_dithering_keeps_codes_and_shows_what_lies_between() -> None:
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16, 1)
    np.testing.assert_array_equal(from_linear(to_linear(codes), "uint8", dither=True), codes)
    ramp = np.linspace(0.5, 0.52, 64 * 512, dtype=np.float32).reshape(64, 512, 1)
    exact = from_linear(ramp, "uint16")[..., 0] / 257
    dithered, plain = (from_linear(ramp, "uint8", dither=way)[..., 0].astype(float) for way in (True, False))
    assert np.abs(dithered - exact).max() <= 1
    tiles = (
        np.abs((image - exact).reshape(8, 8, 64, 8).mean(axis=(1, 3))).mean() for image in (dithered, plain)
    )
    smooth, banded = tiles
    assert smooth < banded / 3
