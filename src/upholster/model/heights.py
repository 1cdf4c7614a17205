"""Heights from texels: from a height map or the luminance of colours, as a pyramid for each chart."""

import math

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray
from upholster.image.color import from_linear
from upholster.quilt.model import Texels

__all__ = ["height_levels", "height_values"]

_LUMA = np.array([0.2126, 0.7152, 0.0722], np.float32)
"""Shares of red, green and blue in perceived brightness (ITU-R BT.709)."""

_LEVELS = 5
"""Levels of the pyramid: beyond 16 texels, filtering would read past a chart's gutter."""

_TEXELS_PER_TRIANGLE = 2
"""Least number of texels of the finest level per triangle; there may be up to four times as many."""


def height_values(pixels: PixelArray) -> NDArray[np.float32]:
    """Return heights of 0 to 1, (h, w) float32.

    Parameters
    ----------
    pixels
        (h, w, C), in the form of texels. With one or two channels the first is the height, plain numbers from
        0 to the largest integer. With three or four it is the luma: the luminance of colours as coded, so
        that equal steps look equal.
    """
    if pixels.shape[2] >= 3:
        coded = from_linear(pixels[..., :3], "uint16") if pixels.dtype.kind == "f" else pixels[..., :3]
        return np.asarray(coded @ _LUMA / np.iinfo(coded.dtype).max, np.float32)
    heights = pixels[..., 0]
    return np.asarray(
        heights if heights.dtype.kind == "f" else heights / np.float32(np.iinfo(heights.dtype).max),
        np.float32,
    )


def height_levels(texels: Texels, triangles: int) -> tuple[NDArray[np.float32], NDArray[np.int64], int]:
    """Return the levels of each chart's heights that this many triangles can show.

    Parameters
    ----------
    texels
        The height map, or colours: see `height_values`.
    triangles
        Number of triangles.

    Returns
    -------
    values
        All levels of all charts, concatenated.
    table
        (charts, levels, 3): first value, height and width of each. Texel (r, c) of level l is the mean of the
        chart's texels from step·2^l·(r, c) up to step·2^l·(r + 1, c + 1), or up to the chart's end.
    step
        Chart texels along a texel of level 0: a power of two.
    """
    share = texels.count / (_TEXELS_PER_TRIANGLE * triangles)
    step = 2 ** max(0, math.floor(math.log2(share) / 2)) if share > 1 else 1
    parts: list[NDArray[np.float32]] = []
    table = np.zeros((len(texels.charts), _LEVELS, 3), np.int64)
    first = 0
    for chart, pixels in enumerate(texels.arrays):
        heights = _reduced(pixels, step)
        for level in range(_LEVELS):
            if level:
                heights = _halved(heights)
            table[chart, level] = first, *heights.shape
            first += heights.size
            parts.append(heights.ravel())
    return np.concatenate(parts), table, step


def _reduced(pixels: PixelArray, step: int) -> NDArray[np.float32]:
    """Return the heights of texels, averaged over squares of `step` texels, band by band."""
    rows = range(0, pixels.shape[0], max(step, 256 // step * step))
    bands = [height_values(pixels[row : row + rows.step]) for row in rows] if len(rows) else []
    return np.concatenate([_means(band, step) for band in bands])


def _halved(heights: NDArray[np.float32]) -> NDArray[np.float32]:
    return _means(heights, 2)


def _means(heights: NDArray[np.float32], step: int) -> NDArray[np.float32]:
    """Return the means over squares of `step` texels, fewer at the end."""
    if step == 1:
        return heights
    for axis in (0, 1):
        starts = np.arange(0, heights.shape[axis], step)
        counts = np.diff(np.append(starts, heights.shape[axis])).astype(np.float32)
        sums = np.add.reduceat(heights, starts, axis=axis)
        heights = np.asarray(sums / (counts[:, None] if axis == 0 else counts), np.float32)
    return heights
