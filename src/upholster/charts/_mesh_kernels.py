"""Sampling the triangles of a mesh's charts."""

import numpy as np
from numpy.typing import NDArray

from upholster.jit import kernel
from upholster.types import FloatArray, IntArray, int64

__all__ = ["splat_matrices"]


@kernel
def splat_matrices(
    places: FloatArray,
    chart: IntArray,
    matrices: FloatArray,
    spacing: float,
    step: float,
    shapes: NDArray[np.int64],
    sums: FloatArray,
) -> None:
    """Add triangles' matrices to the nodes round them, by tents, in proportion to area.

    `places` (T, 3, 2) are row and column of the corners on their charts, in texels from the first one's
    centre, and `matrices` (T, 4) theirs. Triangles are sampled at their middle and at whole multiples of
    `spacing`; nodes lie `step` texels apart, the second one of a row or column at 0. `shapes` (charts, 3)
    tell each chart's first node, rows and columns; `sums` (nodes, 6) receive weighted matrices, weights,
    and weighted determinants.
    """
    for t in range(places.shape[0]):
        k = chart[t]
        if k < 0:
            continue
        p = places[t]
        y1, x1, y2, x2 = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
        area = y1 * x2 - x1 * y2
        if area <= 0.0:
            continue
        determinant = matrices[t, 0] * matrices[t, 3] - matrices[t, 1] * matrices[t, 2]
        low_y, high_y = min(p[0, 0], p[1, 0], p[2, 0]), max(p[0, 0], p[1, 0], p[2, 0])
        low_x, high_x = min(p[0, 1], p[1, 1], p[2, 1]), max(p[0, 1], p[1, 1], p[2, 1])
        i0, i1 = int64(np.ceil(low_y / spacing)), int64(np.floor(high_y / spacing)) + 1
        j0, j1 = int64(np.ceil(low_x / spacing)), int64(np.floor(high_x / spacing)) + 1
        first, rows, columns = shapes[k, 0], shapes[k, 1], shapes[k, 2]
        for i in range(i0 - 1, i1):
            for j in range(j0, j1) if i >= i0 else range(1):
                if i < i0:  # the middle, once
                    y, x = (p[0, 0] + p[1, 0] + p[2, 0]) / 3.0, (p[0, 1] + p[1, 1] + p[2, 1]) / 3.0
                    weight = min(0.5 * area, spacing * spacing)
                else:
                    y, x, weight = i * spacing, j * spacing, spacing * spacing
                    b = ((y - p[0, 0]) * x2 - (x - p[0, 1]) * y2) / area
                    c = (y1 * (x - p[0, 1]) - x1 * (y - p[0, 0])) / area
                    if b < 0.0 or c < 0.0 or b + c > 1.0:
                        continue
                r, s = max(y / step + 1.0, 0.0), max(x / step + 1.0, 0.0)
                a, d = min(int64(r), rows - 2), min(int64(s), columns - 2)
                down, right = min(r - a, 1.0), min(s - d, 1.0)
                for e in range(4):
                    share = (down if e & 1 else 1.0 - down) * (right if e & 2 else 1.0 - right)
                    at = first + (a + (e & 1)) * columns + d + (e >> 1)
                    for m in range(4):
                        sums[at, m] += weight * share * matrices[t, m]
                    sums[at, 4] += weight * share
                    sums[at, 5] += weight * share * determinant
