"""sRGB and linear light.

Integers are sRGB-coded (IEC 61966-2-1), floats are linear. Alpha is always linear and never premultiplied; it
is channel 2 of 2 or channel 4 of 4.
"""

from functools import cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from upholster.base.errors import InputError
from upholster.base.types import PixelArray

__all__ = ["alpha_channel", "from_linear", "to_linear"]

Float = TypeVar("Float", np.float32, np.float64)


def alpha_channel(channels: int) -> int | None:
    """Return the index of the alpha channel in an image of `channels` channels, None if it has none."""
    return channels - 1 if channels in (2, 4) else None


def to_linear(pixels: PixelArray) -> NDArray[np.float32]:
    """Return `pixels` in linear light.

    Parameters
    ----------
    pixels
        (H, W, C), C from 1 to 4. uint8 and uint16 are sRGB-coded; floats are linear already.

    Returns
    -------
    ndarray
        (H, W, C) float32. Integer colours and alpha are in 0…1; floats are unchanged (the same array, if
        it was float32).

    References
    ----------
    IEC 61966-2-1:1999, section 5.2.
    """
    if pixels.dtype.kind == "f":
        return pixels.astype(np.float32, copy=False)
    decoded, scaled = _tables(pixels.dtype.str)
    linear = decoded[pixels]
    alpha = alpha_channel(pixels.shape[2])
    if alpha is not None:
        linear[:, :, alpha] = scaled[pixels[:, :, alpha]]
    return linear


def from_linear(linear: PixelArray, dtype: DTypeLike, *, dither: bool = False) -> PixelArray:
    """Return linear light as pixels of `dtype`: the inverse of `to_linear`, exact on its values.

    Parameters
    ----------
    linear
        (H, W, C) float, C from 1 to 4. Values outside 0…1 are clipped where `dtype` is an integer.
    dtype
        uint8, uint16 (sRGB-coded, rounded to nearest) or float32 (as it is).
    dither
        For uint8: round by an 8×8 pattern instead, so that smooth gradients show no bands. Values that are
        exact 8-bit codes do not change.

    Returns
    -------
    ndarray
        (H, W, C) of `dtype`.

    Raises
    ------
    InputError
        If `dtype` is none of the three.

    References
    ----------
    IEC 61966-2-1:1999, section 5.2.
    """
    wanted = np.dtype(dtype)
    if wanted == np.float32:
        return linear.astype(np.float32, copy=False)
    if wanted not in (np.uint8, np.uint16):
        raise InputError(f"dtype is {wanted}; allowed: uint8, uint16 or float32")
    top = float(np.iinfo(wanted).max)
    values = np.clip(linear, 0.0, 1.0, dtype=np.float32)
    coded: PixelArray
    if wanted == np.uint8:
        # A table of 16 bits is 20 times as fast as the power, with an error below 0.03 of a step.
        places = (values * 65535.0 + 0.5).astype(np.uint16)
        if dither:
            rows, columns = np.arange(values.shape[0]) % 8, np.arange(values.shape[1]) % 8
            coded = (_byte_levels()[places] + _pattern()[np.ix_(rows, columns)][:, :, None]).astype(np.uint8)
        else:
            coded = _byte_codes()[places]
    else:
        coded = np.asarray(_encode(values) * top + 0.5).astype(wanted)
    alpha = alpha_channel(linear.shape[2])
    if alpha is not None:
        coded[:, :, alpha] = values[:, :, alpha] * top + 0.5
    return coded


def _encode(linear: NDArray[Float]) -> NDArray[Float]:
    coded: NDArray[Float] = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
    return coded


@cache
def _byte_levels() -> NDArray[np.float32]:
    """Return the sRGB code, 0…255 and not rounded, of each of 65536 even steps of linear light."""
    return np.asarray(_encode(np.linspace(0, 1, 65536, dtype=np.float32)) * 255, np.float32)


@cache
def _byte_codes() -> NDArray[np.uint8]:
    """Return the same, rounded. In double precision: one value is too close to a half for single."""
    return np.asarray(_encode(np.arange(65536) / 65535) * 255 + 0.5).astype(np.uint8)


@cache
def _pattern() -> NDArray[np.float32]:
    """Return Bayer's 8×8 thresholds, from 0.05 to 0.95: the table's error cannot change an exact code."""
    pattern = np.zeros((1, 1))
    for _ in range(3):
        pattern = np.block([[4 * pattern, 4 * pattern + 2], [4 * pattern + 3, 4 * pattern + 1]])
    return np.asarray(0.05 + 0.9 * (pattern + 0.5) / 64, np.float32)


@cache
def _tables(dtype: str) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return, for every value of an integer dtype, its linear light and its plain scaling to 0…1."""
    coded: NDArray[Any] = np.arange(np.iinfo(dtype).max + 1) / np.iinfo(dtype).max
    decoded = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
    return decoded.astype(np.float32), coded.astype(np.float32)
