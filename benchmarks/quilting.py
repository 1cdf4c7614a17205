"""Textbook image quilting, to compare with: rows of square blocks, all places compared, minimum cuts.

A. Efros, W. Freeman: Image quilting for texture synthesis and transfer, SIGGRAPH 2001, section 2.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, PixelArray

__all__ = ["BLOCK", "OVERLAP", "quilting"]

BLOCK, OVERLAP = 64, 20
"""Sides in pixels. A sample smaller than 128² gets blocks of half its side, with overlaps in proportion."""

WITHIN = 0.1
"""A block is drawn from those whose error is at most this share above the least."""


def quilting(
    exemplar: PixelArray, side: int, *, seed: int = 1, block: int = BLOCK, overlap: int = OVERLAP
) -> PixelArray:
    """Return a texture of side² pixels, (side, side, C) uint8, of an exemplar, (H, W, C) uint8."""
    fitting = min(block, min(exemplar.shape[:2]) // 2)
    block, overlap = fitting, max(1, round(fitting * overlap / block))
    rng, step = np.random.default_rng(seed), block - overlap
    count = -(-(side - overlap) // step)
    out = np.zeros((count * step + overlap,) * 2 + exemplar.shape[2:])
    pixels = exemplar.astype(float)
    spectrum = np.fft.rfft2(pixels, axes=(0, 1))
    squares = np.fft.rfft2((pixels**2).sum(axis=2))
    for i, j in np.ndindex(count, count):
        here = out[i * step :, j * step :][:block, :block]
        known = np.zeros((block, block))
        known[: overlap * (i > 0)] = known[:, : overlap * (j > 0)] = 1
        product = (spectrum * _spectrum(known[..., None] * here, exemplar)).sum(axis=2)
        error = np.fft.irfft2(squares * _spectrum(known, exemplar) - 2 * product, exemplar.shape[:2])
        # A sum of whole numbers: rounded, it is exact.
        error = np.rint(error[: 1 - block or None, : 1 - block or None] + (known[..., None] * here**2).sum())
        places = np.argwhere(error <= (1 + WITHIN) * error.min())
        row, column = places[rng.integers(len(places))]
        new = pixels[row : row + block, column : column + block]
        apart = ((new - here) ** 2).sum(axis=2)
        kept = np.zeros((block, block), bool)
        if j:
            kept |= np.arange(block) < _cut(apart[:, :overlap])[:, None]
        if i:
            kept |= np.arange(block)[:, None] < _cut(apart[:overlap].T)
        here[~kept] = new[~kept]
    return out[:side, :side].astype(np.uint8)


def _spectrum(window: FloatArray, exemplar: PixelArray) -> NDArray[np.complex128]:
    return np.fft.rfft2(window, exemplar.shape[:2], axes=(0, 1)).conj()


def _cut(error: FloatArray) -> NDArray[np.int64]:
    """Return for each row the column of the cheapest path from the first row to the last."""
    total = error.copy()
    for row, above in zip(total[1:], total[:-1], strict=True):
        padded = np.pad(above, 1, constant_values=np.inf)
        row += np.minimum(np.minimum(padded[:-2], padded[1:-1]), padded[2:])
    path = [int(total[-1].argmin())]
    for row in total[-2::-1]:
        low = max(path[-1] - 1, 0)
        path.append(low + int(row[low : path[-1] + 2].argmin()))
    return np.array(path[::-1])
