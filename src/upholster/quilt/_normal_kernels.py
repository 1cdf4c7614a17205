"""Vectors of painted normal maps: rotated by the angle of a warp field, and normalized."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray
from upholster.quilt._field_kernels import matrix_between
from upholster.runtime.jit import inline, kernel

__all__ = ["lengthen_vectors", "turn_vectors"]


_ONE = 8192
"""The integer that represents 1 in sines and cosines."""


@inline
def _turn(m: tuple[Any, Any, Any, Any]) -> tuple[Any, Any]:
    """Return sine and cosine of the angle of M's second column, in 1/8192, with 32-bit integers only."""
    down, right = np.int64(m[1]), np.int64(m[3])
    while max(abs(down), abs(right)) > 32767:
        down, right = down >> 1, right >> 1
    # Sizes at nodes have a lower limit, but between two nodes half a turn apart M may vanish.
    while 0 < max(abs(down), abs(right)) < 16384:
        down, right = 2 * down, 2 * right
    length: Any = max(np.int64(np.sqrt(np.float64(down * down + right * right))), 1)
    half = length >> 1
    return (_ONE * down + half) // length, (_ONE * right + half) // length


@kernel
def turn_vectors(
    samples: PixelArray,
    matrices: NDArray[np.int32],
    margin: int,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    top: int,
) -> None:
    """Rotate each texel's (x, y) by the angle of M's second column, in place.

    `samples` (height, width, 3) are at `rows` and `columns` of a chart, in 1/16 step. `top` represents 1 (and
    0 represents −1); a `top` of 1 means floats, which are not rounded. Without trigonometry, every machine
    gives the same result.
    """
    for i in range(samples.shape[0]):
        for j in range(samples.shape[1]):
            sine, cosine = _turn(matrix_between(matrices, margin, rows[i], columns[j]))
            if top == 1:
                x, y = samples[i, j, 0] - 0.5, samples[i, j, 1] - 0.5
                samples[i, j, 0] = 0.5 + (x * cosine - y * sine) / _ONE
                samples[i, j, 1] = 0.5 + (x * sine + y * cosine) / _ONE
            else:
                u, v = 2 * np.int64(samples[i, j, 0]) - top, 2 * np.int64(samples[i, j, 1]) - top
                middle = _ONE * (top + 1)
                samples[i, j, 0] = min(max((u * cosine - v * sine + middle) >> 14, 0), top)
                samples[i, j, 1] = min(max((u * sine + v * cosine + middle) >> 14, 0), top)


@kernel
def lengthen_vectors(samples: PixelArray, top: float, slack: float) -> None:
    """Scale each texel's vector to length 1, in place, if its length is off by more than `slack`.

    `samples` (height, width, 3); `top` as for `turn_vectors`. Vectors that vanish become (0, 0, 1). Samples
    (0, 0, 0), on which nothing was painted, stay.
    """
    middle = 0.5 * top
    for i in range(samples.shape[0]):
        for j in range(samples.shape[1]):
            x, y, z = (
                samples[i, j, 0] / middle - 1.0,
                samples[i, j, 1] / middle - 1.0,
                samples[i, j, 2] / middle - 1.0,
            )
            length = np.sqrt(x * x + y * y + z * z)
            unpainted = x == -1.0 and y == -1.0 and z == -1.0
            if unpainted or abs(length - 1.0) <= slack:
                continue
            if length < slack:
                x, y, z, length = 0.0, 0.0, 1.0, 1.0
            for k, part in enumerate((x, y, z)):
                value = middle + middle * part / length
                samples[i, j, k] = value if top == 1.0 else np.floor(value + 0.5)
