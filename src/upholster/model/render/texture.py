"""A texture prepared for look-up: a pyramid of levels in linear light, weighted with alpha."""

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import PixelArray, frozen_array
from upholster.image.color import to_linear
from upholster.runtime.parallel import run_tasks

__all__ = ["MipPyramid", "averaged_down", "build_mip_pyramid", "checked_texture"]

CLAY = (0.62, 0.60, 0.57, 1.0)
"""Linear colour of a model without texture."""

MAX_LEVEL = 12
_BAND_TEXELS = 1 << 18


class MipPyramid(NamedTuple):
    """Mip levels of one texture, as a tuple, which kernels accept directly.

    Attributes
    ----------
    texels
        (total, 4) float32, read-only: red, green, blue times alpha, and alpha, linear, level after level.
    levels
        (n, 3) int64, read-only: first row in `texels`, height and width of each level.
    first
        The level of `levels[0]`; a texel of level l is 2^l texels of the texture wide.
    height, width
        Size of the texture.
    see_through
        Whether any alpha is below 1.
    """

    texels: NDArray[np.float32]
    levels: NDArray[np.int64]
    first: int
    height: int
    width: int
    see_through: bool


def checked_texture(texture: PixelArray) -> PixelArray:
    """Return `texture` if it is a valid image for look-up, or raise `InputError`."""
    if not isinstance(texture, np.ndarray) or texture.ndim != 3 or not 1 <= texture.shape[2] <= 4:
        raise InputError(
            f"texture has shape {np.shape(texture)}; allowed: (height, width, channels) with 1 to 4 channels"
        )
    if 0 in texture.shape or max(texture.shape) > 1 << 20:
        raise InputError(
            f"texture is {texture.shape[1]} x {texture.shape[0]}; allowed: 1 to 1048576 each side"
        )
    if texture.dtype not in (np.uint8, np.uint16, np.float32):
        raise InputError(f"texture is of type {texture.dtype}; allowed: uint8, uint16, float32")
    return texture


def build_mip_pyramid(texture: PixelArray | None, *, first: int = 0, last: int = 4) -> MipPyramid:
    """Decode a texture to linear light and average it down.

    Parameters
    ----------
    texture
        (H, W, C) uint8 or uint16, sRGB-coded, or float32, linear; C is 1 (grey), 2 (grey and alpha), 3 or 4.
        None gives one texel of the colour of clay.
    first, last
        Levels to keep, 0 ≤ first ≤ last. Level l averages squares of 2^l × 2^l texels; a texture whose sides
        are not multiples repeats its last row and column. Levels below one texel are left out.

    Raises
    ------
    InputError
        A float texture holds values that are not finite.

    References
    ----------
    L. Williams: Pyramidal Parametrics, SIGGRAPH 1983. T. Porter, T. Duff: Compositing Digital Images,
    SIGGRAPH 1984 (why colours are averaged weighted with alpha).
    """
    if texture is None:
        clay = frozen_array(np.array([CLAY], np.float32))
        return MipPyramid(clay, frozen_array(np.array([[0, 1, 1]])), 0, 1, 1, see_through=False)
    return averaged_down(partial(_color_rows, texture), *texture.shape[:2], first=first, last=last)


def averaged_down(
    rows: Callable[[int, int], NDArray[np.float32]],
    height: int,
    width: int,
    *,
    first: int,
    last: int,
) -> MipPyramid:
    """Average down an image of four numbers per texel, of which the last is alpha, if there is any.

    Parameters
    ----------
    rows
        Returns rows `start` to `stop` of the image: (stop - start, width, 4).
    height, width
        Size of the image.
    first, last
        As for `build_mip_pyramid`.
    """
    last = min(last, max(0, math.ceil(math.log2(max(height, width)))))
    first = min(first, last)
    shapes = [(-(-height // 2**level), -(-width // 2**level)) for level in range(first, last + 1)]
    starts = np.cumsum([0] + [h * w for h, w in shapes])
    texels = np.empty((int(starts[-1]), 4), np.float32)
    views = [texels[a:b].reshape(h, w, 4) for a, b, (h, w) in zip(starts, starts[1:], shapes, strict=False)]
    # Bands are as high as whole squares of the coarsest level, so each can make all its levels alone.
    unit = 2**last
    step = unit * max(1, _BAND_TEXELS // (unit * width))
    bands = range(0, height, step)
    opaque = np.ones(len(bands), np.bool_)
    tasks: list[Callable[[], object]] = [
        partial(_build_band, rows, row, min(row + step, height), first, views, opaque[i : i + 1])
        for i, row in enumerate(bands)
    ]
    run_tasks(tasks)
    levels = np.array([(start, h, w) for start, (h, w) in zip(starts, shapes, strict=False)], np.int64)
    return MipPyramid(
        frozen_array(texels), frozen_array(levels), first, height, width, see_through=not opaque.all()
    )


def _color_rows(texture: PixelArray, row: int, stop: int) -> NDArray[np.float32]:
    """Return rows of a texture: linear colour times alpha, and alpha."""
    source = texture[row:stop]
    if source.dtype == np.float32 and not np.isfinite(source).all():
        raise InputError(f"texture holds values that are not finite in rows {row} to {stop - 1}")
    linear = to_linear(source)
    block = np.empty((*linear.shape[:2], 4), np.float32)
    if linear.shape[2] in (2, 4):
        alpha = np.clip(linear[..., -1:], 0.0, 1.0)
        np.multiply(linear[..., :-1], alpha, out=block[..., :3])
        block[..., 3:] = alpha
    else:
        block[..., :3] = linear
        block[..., 3] = 1.0
    return block


def _build_band(
    rows: Callable[[int, int], NDArray[np.float32]],
    row: int,
    stop: int,
    first: int,
    views: list[NDArray[np.float32]],
    opaque: NDArray[np.bool_],
) -> None:
    """Fill rows `row` to `stop` of the image into every level's view."""
    block = rows(row, stop)
    opaque[0] = bool((block[..., 3] == 1.0).all())
    for level in range(first + len(views)):
        if level > 0:
            block = _halved(block)
        if level >= first:
            top = row >> level
            views[level - first][top : top + len(block)] = block


def _halved(block: NDArray[np.float32]) -> NDArray[np.float32]:
    """Average 2 × 2 texels; an odd last row or column counts twice."""
    rows = block[0::2].copy()
    rows[: len(block) // 2] += block[1::2]
    if len(block) % 2:
        rows[-1] *= 2.0
    result = rows[:, 0::2].copy()
    result[:, : rows.shape[1] // 2] += rows[:, 1::2]
    if rows.shape[1] % 2:
        result[:, -1] *= 2.0
    result *= np.float32(0.25)
    return result
