"""Reading an exemplar's pyramid at a place of a placement (SPEC.md, section 8).

Integer samples are packed in words of 64 bits, as lanes of 16 or 32 bits, so that one multiplication weights
several channels of a pixel. No lane overflows. Bytes take 16 bits when weighted within a pixel (weights add
up to 256), and 16-bit samples take 24 of 32 bits.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray
from upholster.runtime.jit import by_type, inline, is_float

__all__ = ["PyramidWords", "Readings", "bilinear", "pixels_at"]


class Readings(NamedTuple):
    """Placements of a chart, n of them.

    (n, 2) centres and sources, (n, 4) centre matrices and symmetries, (n,) levels as indices into the
    pyramid's table, and `shifts`, how often these are halved. `copies` marks placements
    whose texels are pixels of the sample, as they are there.
    """

    centres: NDArray[np.int64]
    sources: NDArray[np.int64]
    matrices: NDArray[np.int64]
    symmetries: NDArray[np.int64]
    levels: NDArray[np.int64]
    shifts: NDArray[np.int64]
    copies: NDArray[np.bool_]


class PyramidWords(NamedTuple):
    """A pyramid's samples, see `upholster.quilt.pyramid.Pyramid`; `bits` is unused for floats."""

    words: PixelArray
    per_pixel: int
    bits: int
    table: NDArray[np.int64]


def bilinear(words: Any, at: Any, k: Any, y: Any, x: Any) -> Any:
    """Return four pixels' k-th words, weighted by fractions in 1/16: for integers 256 times their mean."""
    raise NotImplementedError  # compiled only


@by_type(bilinear)
def bilinear_overload(words: Any, at: Any, k: Any, y: Any, x: Any) -> Any:
    if not is_float(words.dtype):

        def mixed(words: Any, at: Any, k: Any, y: Any, x: Any) -> Any:
            both = y * x
            return (
                words[at[0] + k] * np.uint64(256 - 16 * (y + x) + both)
                + words[at[1] + k] * np.uint64(16 * x - both)
                + words[at[2] + k] * np.uint64(16 * y - both)
                + words[at[3] + k] * np.uint64(both)
            )

        return mixed

    def floats(words: Any, at: Any, k: Any, y: Any, x: Any) -> Any:
        both, unit = y * x, np.float32(1 / 256)
        return (
            words[at[0] + k] * (np.float32(256 - 16 * (y + x) + both) * unit)
            + words[at[1] + k] * (np.float32(16 * x - both) * unit)
            + words[at[2] + k] * (np.float32(16 * y - both) * unit)
            + words[at[3] + k] * (np.float32(both) * unit)
        )

    return floats


@inline
def _mirrored(place: Any, size: Any) -> Any:
    if 0 <= place < size:
        return place
    place %= 2 * size
    return place if place < size else 2 * size - 1 - place


@inline
def pixels_at(pyramid: PyramidWords, level: Any, r: Any, c: Any) -> Any:
    """Return the words of the four pixels around a place, in 1/16 pixel of a level, and its fractions."""
    base, height, width, each = level[0], level[1], level[2], np.int64(pyramid.per_pixel)
    y, x, r, c = r & 15, c & 15, r >> 4, c >> 4
    if 0 <= r < height - 1 and 0 <= c < width - 1:
        at = base + (r * width + c) * each
        return (at, at + each, at + width * each, at + (width + 1) * each), y, x
    top, bottom = base + _mirrored(r, height) * width * each, base + _mirrored(r + 1, height) * width * each
    left, right = _mirrored(c, width) * each, _mirrored(c + 1, width) * each
    return (top + left, top + right, bottom + left, bottom + right), y, x
