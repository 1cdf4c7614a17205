"""The data that measures work on: samples as comparable numbers, and a bounded part of large results."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, PixelArray
from upholster.image.color import alpha_channel

__all__ = ["Samples", "Window", "bilinear", "chosen_windows", "coded"]

Samples = NDArray[np.float32]
"""Samples in perceptual units, see `coded`."""

SEED = 2006
"""The seed of all sampling: the same input gives the same figures."""


@dataclass(frozen=True, slots=True)
class Window:
    """A rectangle of one of several arrays: rows [row, row + height), columns [column, column + width)."""

    index: int
    row: int
    column: int
    height: int
    width: int

    def of(self, array: PixelArray) -> PixelArray:
        """Return a view of the part of array `index` that lies in the window."""
        return array[self.row : self.row + self.height, self.column : self.column + self.width]


def coded(pixels: PixelArray) -> Samples:
    """Return samples in perceptual units: sRGB-coded, 0 to 1.

    Parameters
    ----------
    pixels
        (..., C), C from 1 to 4: uint8 and uint16 are sRGB-coded, floats are linear.

    Returns
    -------
    ndarray
        (..., C) float32. Floats are coded by the curve of IEC 61966-2-1, which is continued beyond 1 and
        mirrored below 0: nothing is clipped. Alpha is only scaled.
    """
    if pixels.dtype.kind == "u":
        return pixels.astype(np.float32) / np.float32(np.iinfo(pixels.dtype).max)
    linear = pixels.astype(np.float32)
    size = np.abs(linear)
    curve = np.float32(1.055) * size ** np.float32(1 / 2.4) - np.float32(0.055)
    out: Samples = np.copysign(np.where(size <= 0.0031308, size * np.float32(12.92), curve), linear)
    alpha = alpha_channel(pixels.shape[-1])
    if alpha is not None:
        out[..., alpha] = linear[..., alpha]
    return out


def bilinear(pixels: PixelArray, rows: FloatArray, columns: FloatArray) -> Samples:
    """Return sRGB-coded samples between pixels, interpolated after `coded`.

    Parameters
    ----------
    pixels
        (h, w, C), pixel (r, c) having its centre at exactly (r, c).
    rows, columns
        (n,) places; beyond the outermost pixel centres, their values hold.

    Returns
    -------
    ndarray
        (n, C) float32.
    """
    height, width = pixels.shape[:2]
    r, c = np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)
    top, left = r.astype(np.intp), c.astype(np.intp)
    down, right = (r - top).astype(np.float32)[:, None], (c - left).astype(np.float32)[:, None]
    below, after = np.minimum(top + 1, height - 1), np.minimum(left + 1, width - 1)
    upper, lower = (_between(coded(pixels[r, left]), coded(pixels[r, after]), right) for r in (top, below))
    return _between(upper, lower, down)


def _between(one: Samples, other: Samples, share: Samples) -> Samples:
    return one + (other - one) * share  # exact where both are equal


def chosen_windows(shapes: Sequence[tuple[int, ...]], *, side: int, most: int) -> list[Window]:
    """Choose parts of several arrays: all of them where they are small, else a random part.

    Parameters
    ----------
    shapes
        (height, width, …) of each array.
    side
        Arrays are divided evenly into windows whose sides are at most this.
    most
        Samples to choose at most; at least one window is chosen.

    Returns
    -------
    list of Window
        In the order of the arrays.
    """
    windows = []
    for index, (height, width, *_) in enumerate(shapes):
        rows = _cuts(height, side)
        columns = _cuts(width, side)
        windows += [Window(index, r, c, h, w) for r, h in rows for c, w in columns]
    if sum(window.height * window.width for window in windows) <= most:
        return windows
    taken: list[int] = []
    count = 0
    for n in np.random.default_rng(SEED).permutation(len(windows)).tolist():
        count += windows[n].height * windows[n].width
        if taken and count > most:
            break
        taken.append(n)
    return [windows[n] for n in sorted(taken)]


def _cuts(size: int, side: int) -> list[tuple[int, int]]:
    parts = -(-size // side)
    ends = [size * part // parts for part in range(parts + 1)]
    return [(low, high - low) for low, high in pairwise(ends)]
