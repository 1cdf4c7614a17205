"""The kernel of `upholster.image.photo.rectify`."""

import numpy as np

from upholster.base.types import FloatArray, IntArray, PixelArray
from upholster.runtime.jit import inline, kernel

__all__ = ["project_bicubic"]


@inline
def _cubic_weight(tap: int, part: float) -> float:
    # Catmull and Rom: the weight of sample tap − 1, for a point that is `part` after sample 0.
    x = abs(part - (tap - 1))
    if x < 1.0:
        return (1.5 * x - 2.5) * x * x + 1.0
    return ((-0.5 * x + 2.5) * x - 4.0) * x + 2.0


@kernel
def project_bicubic(
    source: PixelArray, origin: IntArray, matrix: FloatArray, start: IntArray, out: PixelArray
) -> None:
    """Read an image through a projective map, by cubic interpolation.

    Parameters
    ----------
    source
        (h, w, C) float32: a part of the image; outside it the nearest sample is used.
    origin
        Row and column of the image at which `source` begins.
    matrix
        (3, 3): from (x, y, 1) in the result to (x, y, w) in the image; sample (row, column) is at
        (column + ½, row + ½).
    start
        Row and column of the result at which `out` begins.
    out
        (h, w, C) float32, to be filled.
    """
    height, width, channels = source.shape
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            x, y = start[1] + column + 0.5, start[0] + row + 0.5
            depth = matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2]
            across = (matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2]) / depth - 0.5 - origin[1]
            down = (matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2]) / depth - 0.5 - origin[0]
            left, top = int(np.floor(across)), int(np.floor(down))
            for channel in range(channels):
                out[row, column, channel] = 0.0
            for i in range(4):
                high = min(max(top + i - 1, 0), height - 1)
                weight = _cubic_weight(i, down - top)
                for j in range(4):
                    far = min(max(left + j - 1, 0), width - 1)
                    share = weight * _cubic_weight(j, across - left)
                    for channel in range(channels):
                        out[row, column, channel] += share * source[high, far, channel]
