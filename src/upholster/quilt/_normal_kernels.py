"""Vectors of painted normal maps: turned by the angle of a warp field, and made unit vectors."""

import numpy as np
from numpy.typing import NDArray

from upholster.jit import kernel
from upholster.quilt._field_kernels import matrix_between
from upholster.types import PixelArray

__all__ = ["lengthen_vectors", "turn_vectors"]


@kernel
def turn_vectors(
    samples: PixelArray,
    matrices: NDArray[np.int32],
    margin: int,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    top: float,
) -> None:
    """Turn each texel's (x, y) by the angle of M's second column, in place.

    `samples` (height, width, 3) lie at `rows` and `columns` of a chart, in 1/16 step; `top` stands for 1 (and
    0 for −1); 1 means floats, which are not rounded. No trigonometry: every machine gives the same.
    """
    middle = 0.5 * top
    for i in range(samples.shape[0]):
        for j in range(samples.shape[1]):
            m = matrix_between(matrices, margin, rows[i], columns[j])
            down, right = np.float64(m[1]), np.float64(m[3])
            # A field's sizes have a least one, but between two nodes half a turn apart M may vanish.
            length = max(np.sqrt(down * down + right * right), 1.0)
            sine, cosine = down / length, right / length
            x, y = samples[i, j, 0] - middle, samples[i, j, 1] - middle
            u, v = middle + (x * cosine - y * sine), middle + (x * sine + y * cosine)
            if top != 1.0:
                u = min(max(np.floor(u + 0.5), 0.0), top)
                v = min(max(np.floor(v + 0.5), 0.0), top)
            samples[i, j, 0] = u
            samples[i, j, 1] = v


@kernel
def lengthen_vectors(samples: PixelArray, top: float, slack: float) -> None:
    """Give each texel's vector length 1, in place, where it is off by more than `slack`.

    `samples` (height, width, 3); `top` as for `turn_vectors`. Vectors that vanish become (0, 0, 1); samples
    (0, 0, 0), which nothing was painted on, stay.
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
