"""The integer arithmetic of warp fields, which every decoder repeats (CONVENTIONS.md, "Painting")."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline

__all__ = ["displacement", "displacements", "matrix_at"]


@inline
def matrix_at(
    matrices: NDArray[np.int32], margin: Any, row: Any, column: Any
) -> tuple[np.int32, np.int32, np.int32, np.int32]:
    """Return M at a texel, in 1/4096: bilinear between the four nodes round it, rounded once.

    `matrices` is (rows, columns, 4), see `Field.matrices`.
    """
    rows, columns = matrices.shape[0], matrices.shape[1]
    i, j = margin + (row >> 5), margin + (column >> 5)
    down, right = np.int32(row & 31), np.int32(column & 31)
    if i < 0:
        i, down = 0, np.int32(0)
    elif i >= rows - 1:
        i, down = rows - 1, np.int32(0)
    if j < 0:
        j, right = 0, np.int32(0)
    elif j >= columns - 1:
        j, right = columns - 1, np.int32(0)
    below, beside = min(i + 1, rows - 1), min(j + 1, columns - 1)
    up, left = np.int32(32) - down, np.int32(32) - right
    a, b, c, d = matrices[i, j], matrices[i, beside], matrices[below, j], matrices[below, beside]
    half, ten = np.int32(512), np.int32(10)
    return (
        ((a[0] * left + b[0] * right) * up + (c[0] * left + d[0] * right) * down + half) >> ten,
        ((a[1] * left + b[1] * right) * up + (c[1] * left + d[1] * right) * down + half) >> ten,
        ((a[2] * left + b[2] * right) * up + (c[2] * left + d[2] * right) * down + half) >> ten,
        ((a[3] * left + b[3] * right) * up + (c[3] * left + d[3] * right) * down + half) >> ten,
    )


@inline
def displacement(
    first: tuple[np.int32, np.int32, np.int32, np.int32],
    here: tuple[np.int32, np.int32, np.int32, np.int32],
    down: Any,
    right: Any,
) -> tuple[Any, Any]:
    """Return where a texel falls in the exemplar, seen from its block's centre, in 1/16 pixel.

    `first` and `here` are M at the centre and at the texel, which lies `down` rows and `right` columns away.
    """
    a, b = np.int64(first[0]) + here[0], np.int64(first[1]) + here[1]
    c, d = np.int64(first[2]) + here[2], np.int64(first[3]) + here[3]
    return (a * down + b * right + 256) >> 9, (c * down + d * right + 256) >> 9


@inline
def displacements(
    matrices: NDArray[np.int32],
    margin: Any,
    row: Any,
    column: Any,
    top: Any,
    left: Any,
    ys: NDArray[np.int32],
    xs: NDArray[np.int32],
) -> None:
    """Fill `ys` and `xs` (height, width) with the `displacement` of every texel of a block.

    The block's first texel is (top, left), its centre (row, column). Between two nodes M is linear along a
    row, so that sums take the place of products.
    """
    rows, columns = matrices.shape[0], matrices.shape[1]
    first = matrix_at(matrices, margin, row, column)
    ten, half = np.int64(10), np.int64(512)
    for i in range(ys.shape[0]):
        line_y, line_x = ys[i], xs[i]
        r, dr = top + i, np.int64(top + i - row)
        n, down = margin + (r >> 5), np.int64(r & 31)
        if n < 0:
            n, down = 0, np.int64(0)
        elif n >= rows - 1:
            n, down = rows - 1, np.int64(0)
        upper, lower = matrices[n], matrices[min(n + 1, rows - 1)]
        up = np.int64(32) - down
        j = 0
        while j < line_y.shape[0]:
            c = left + j
            m, right = margin + (c >> 5), np.int64(c & 31)
            stop = min(line_y.shape[0], j + 32 - (c & 31))
            if m < 0:
                m, right = 0, np.int64(0)
            elif m >= columns - 1:
                m, right = columns - 1, np.int64(0)
            beside = m if c >> 5 < -margin else min(m + 1, columns - 1)
            a0, a1 = upper[m, 0] * up + lower[m, 0] * down, upper[m, 1] * up + lower[m, 1] * down
            a2, a3 = upper[m, 2] * up + lower[m, 2] * down, upper[m, 3] * up + lower[m, 3] * down
            s0 = upper[beside, 0] * up + lower[beside, 0] * down - a0
            s1 = upper[beside, 1] * up + lower[beside, 1] * down - a1
            s2 = upper[beside, 2] * up + lower[beside, 2] * down - a2
            s3 = upper[beside, 3] * up + lower[beside, 3] * down - a3
            a0, a1 = 32 * a0 + s0 * right + half, 32 * a1 + s1 * right + half
            a2, a3 = 32 * a2 + s2 * right + half, 32 * a3 + s3 * right + half
            part_y, part_x = line_y[j:stop], line_x[j:stop]
            dc = np.int64(c - column)
            for k in range(part_y.shape[0]):
                part_y[k] = (
                    (first[0] + ((a0 + s0 * k) >> ten)) * dr
                    + (first[1] + ((a1 + s1 * k) >> ten)) * (dc + k)
                    + 256
                ) >> 9
                part_x[k] = (
                    (first[2] + ((a2 + s2 * k) >> ten)) * dr
                    + (first[3] + ((a3 + s3 * k) >> ten)) * (dc + k)
                    + 256
                ) >> 9
            j = stop
