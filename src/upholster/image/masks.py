"""Masks: which pixels of a sample are used. Unused pixels show nowhere, not even in an average."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray
from upholster.image.color import alpha_channel
from upholster.image.numbers import to_unit, top_of

__all__ = ["Used", "as_alpha", "as_map", "filled", "is_white", "largest_square", "on_shape", "squares"]

Used = NDArray[np.bool_]
"""(H, W): which pixels are used."""


def is_white(mask: PixelArray) -> Used:
    """Return where a mask is white: at least half of white, and not transparent.

    Parameters
    ----------
    mask
        (H, W, C), plain numbers, with alpha or without.
    """
    unit = to_unit(mask)
    alpha = alpha_channel(mask.shape[2])
    white = unit[:, :, :alpha].mean(axis=2)
    found: Used = (white if alpha is None else white * unit[:, :, alpha]) >= 0.5
    return found


def as_map(used: Used) -> PixelArray:
    """Return which pixels are used as a map (H, W, 1) uint8, white where they are: `is_white` reads it."""
    return np.where(used, 255, 0).astype(np.uint8)[:, :, None]


def as_alpha(pixels: PixelArray, used: Used) -> PixelArray:
    """Return an image whose alpha is 1 where it is used and 0 elsewhere, so the mask travels with it."""
    alpha = alpha_channel(pixels.shape[2])
    top = (top_of(pixels.dtype) * used[:, :, None]).astype(pixels.dtype)
    return np.concatenate([pixels[:, :, :alpha], top], axis=2)


def on_shape(used: Used, height: int, width: int) -> Used:
    """Return the used pixels at the size of a map: a whole multiple or a whole fraction of the sample.

    A pixel of a smaller map is used if all pixels of the sample that it covers are used.
    """
    if height > used.shape[0]:
        return used.repeat(height // used.shape[0], axis=0).repeat(width // used.shape[1], axis=1)
    by, across = used.shape[0] // height, used.shape[1] // width
    return np.asarray(used.reshape(height, by, width, across).all(axis=(1, 3)))


def filled(pixels: PixelArray, used: Used) -> PixelArray:
    """Return an image whose unused pixels hold a smooth mean of the nearest used ones.

    So they have no edges of their own: nothing is found there, and they take few bytes.

    Parameters
    ----------
    pixels
        (H, W, C) uint8, uint16 or float32, finite.
    used
        (H, W).

    Returns
    -------
    ndarray
        (H, W, C) of the same dtype; `pixels` itself where all are used, or none.
    """
    if used.all() or not used.any():
        return pixels
    out, unused = pixels.copy(), ~used
    for channel in range(pixels.shape[2]):
        spread = _spread(pixels[:, :, channel].astype(np.float32), used)[unused]
        if pixels.dtype.kind != "f":
            spread = np.clip(np.rint(spread), 0, top_of(pixels.dtype))
        out[:, :, channel][unused] = spread
    return out


def _spread(values: NDArray[np.float32], used: Used) -> NDArray[np.float32]:
    # Used values stay; elsewhere they come smoothly from a plane of half the size.
    if used.all():
        return values
    ends = [(0, side % 2) for side in values.shape]
    weighted = np.pad(np.where(used, values, np.float32(0)), ends)
    counts = np.pad(used.astype(np.float32), ends)
    for axis in (0, 1):
        even, odd = (slice(None),) * axis + (slice(0, None, 2),), (slice(None),) * axis + (slice(1, None, 2),)
        weighted, counts = weighted[even] + weighted[odd], counts[even] + counts[odd]
    means = (weighted / np.maximum(counts, np.float32(1))).astype(np.float32, copy=False)
    coarse = _spread(means, counts > 0)
    for axis in (0, 1):
        coarse = _doubled(coarse, values.shape[axis], axis)
    return np.where(used, values, coarse)


def _doubled(plane: NDArray[np.float32], size: int, axis: int) -> NDArray[np.float32]:
    # Twice as many rows or columns, `size` of them: linear between the middles of the old ones.
    at = np.arange(size)
    near = at // 2
    other = np.clip(near + 2 * (at % 2) - 1, 0, plane.shape[axis] - 1)
    first, second = np.take(plane, near, axis), np.take(plane, other, axis)
    doubled: NDArray[np.float32] = np.float32(0.75) * first + np.float32(0.25) * second
    return doubled


def squares(used: Used, side: int) -> Used:
    """Return where squares of used pixels begin: (H - side + 1, W - side + 1), which may be empty."""
    height, width = used.shape
    if side > min(height, width):
        return np.zeros((0, 0), np.bool_)
    sums = np.zeros((height + 1, width + 1), np.int64)
    sums[1:, 1:] = used.cumsum(axis=0).cumsum(axis=1)
    inside = sums[side:, side:] - sums[side:, :-side] - sums[:-side, side:] + sums[:-side, :-side]
    found: Used = inside == side * side
    return found


def largest_square(used: Used) -> int:
    """Return the side of the largest square of used pixels, 0 if there is none."""
    least, most = 0, min(used.shape)
    while least < most:
        side = (least + most + 1) // 2
        if squares(used, side).any():
            least = side
        else:
            most = side - 1
    return least
