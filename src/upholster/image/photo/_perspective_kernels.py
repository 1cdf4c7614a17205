"""The kernel of `upholster.image.photo.perspective`."""

from upholster.base.types import FloatArray, IntArray, PixelArray
from upholster.runtime.jit import kernel

__all__ = ["pencil_contrast"]

_LEAST = 20
"""Pixels that a line needs to count."""


@kernel
def pencil_contrast(
    planes: PixelArray,
    places: FloatArray,
    pencils: FloatArray,
    lines: FloatArray,
    counts: IntArray,
    out: FloatArray,
) -> None:
    """Measure how far lines through a vanishing point differ from each other, for many such points.

    Parameters
    ----------
    planes
        (P, N) float32: values of N pixels, of mean 0 and variance 1.
    places
        (N, 2): x and y of each pixel, (0, 0) the middle, 1 half the longer side.
    pencils
        (M, 3): the point (x, y, w) in homogeneous coordinates, x² + y² = 1.
    lines, counts
        (P, L) float64 and (L,) int32: scratch space for sums. L lines cover up to 1.6 on either side of
        the middle.
    out
        (M,) to be filled: the variance between lines divided by that of single pixels, as a mean over
        the planes; 0 where the vanishing point is too near.
    """
    count, bins = places.shape[0], counts.shape[0]
    for m in range(pencils.shape[0]):
        x, y, w = pencils[m]
        out[m] = 0.0
        lines[:] = 0.0
        counts[:] = 0
        near = False
        for n in range(count):
            depth = 1.0 - w * (x * places[n, 0] + y * places[n, 1])
            if depth < 0.1:
                near = True
                break
            across = (x * places[n, 1] - y * places[n, 0]) / depth
            line = min(max(int((across + 1.6) / 3.2 * bins), 0), bins - 1)
            counts[line] += 1
            for p in range(planes.shape[0]):
                lines[p, line] += planes[p, n]
        if near:
            continue
        for p in range(planes.shape[0]):
            used, pixels, total, squares = 0, 0, 0.0, 0.0
            for line in range(bins):
                if counts[line] >= _LEAST:
                    used += 1
                    pixels += counts[line]
                    total += lines[p, line]
                    squares += lines[p, line] * lines[p, line] / counts[line]
            if used > 1:
                out[m] += (squares - total * total / pixels) / (used - 1) / planes.shape[0]
