"""The integer arithmetic of warp fields, which every decoder repeats (CONVENTIONS.md, "Painting")."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel, shared

__all__ = [
    "displacement",
    "displacement_row",
    "matrices_at",
    "matrices_between",
    "matrix_at",
    "matrix_between",
    "node_matrices",
    "node_row",
    "reading",
]


@kernel
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
def node_row(matrices: NDArray[np.int32], margin: Any, place: Any) -> tuple[Any, Any, Any]:
    """Return the rows of nodes above and below a place, in 1/16 step, and its fraction between, in 1/512."""
    last = matrices.shape[0] - 1
    y = np.int64(place) - 8
    i, fraction = margin + (y >> 9), y & 511
    if i < 0:
        i, fraction = np.int64(0), np.int64(0)
    elif i >= last:
        i, fraction = np.int64(last), np.int64(0)
    return i, min(i + 1, last), fraction


@inline
def matrix_between(
    matrices: NDArray[np.int32], margin: Any, row: Any, column: Any
) -> tuple[Any, Any, Any, Any]:
    """Return M at a place in 1/16 step, in 1/4096: between rows of nodes, rounded, then between columns."""
    i, below, down = node_row(matrices, margin, row)
    last = matrices.shape[1] - 1
    x = np.int64(column) - 8
    j, right = margin + (x >> 9), x & 511
    if j < 0:
        j, right = np.int64(0), np.int64(0)
    elif j >= last:
        j, right = np.int64(last), np.int64(0)
    beside = min(j + 1, last)
    a, b, c, d = matrices[i, j], matrices[i, beside], matrices[below, j], matrices[below, beside]
    up, left = 512 - down, 512 - right
    return (
        (((a[0] * up + c[0] * down + 256) >> 9) * left + ((b[0] * up + d[0] * down + 256) >> 9) * right + 256)
        >> 9,
        (((a[1] * up + c[1] * down + 256) >> 9) * left + ((b[1] * up + d[1] * down + 256) >> 9) * right + 256)
        >> 9,
        (((a[2] * up + c[2] * down + 256) >> 9) * left + ((b[2] * up + d[2] * down + 256) >> 9) * right + 256)
        >> 9,
        (((a[3] * up + c[3] * down + 256) >> 9) * left + ((b[3] * up + d[3] * down + 256) >> 9) * right + 256)
        >> 9,
    )


@kernel
def matrices_between(
    matrices: NDArray[np.int32],
    margin: int,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    out: NDArray[np.int32],
) -> None:
    """Fill `out`, (n, 4), with the `matrix_between` of n places."""
    for n in range(len(rows)):
        m = matrix_between(matrices, margin, rows[n], columns[n])
        for k in range(4):
            out[n, k] = m[k]


@inline
def reading(first: Any, here: Any, down: Any, right: Any) -> tuple[Any, Any]:
    """Return where a place falls in the exemplar, seen from its placement's centre, in 1/16 pixel.

    `first` and `here` are M at the centre and at the place, which lies `down` and `right` of it, in 1/16
    step, within ±16383: then 32 bits hold all of it.
    """
    a, b, c, d = first[0] + here[0], first[1] + here[1], first[2] + here[2], first[3] + here[3]
    y, x, u, v = down >> 4, right >> 4, down & 15, right & 15
    return (
        (a * y + b * x + ((a * u + b * v) >> 4) + 256) >> 9,
        (c * y + d * x + ((c * u + d * v) >> 4) + 256) >> 9,
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


@kernel
def matrices_at(
    matrices: NDArray[np.int32],
    margin: int,
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    out: NDArray[np.int32],
) -> None:
    """Fill `out`, (n, 4), with the `matrix_at` of n texels."""
    for n in range(len(rows)):
        out[n] = matrix_at(matrices, margin, rows[n], columns[n])


@kernel
def node_matrices(
    nodes: NDArray[np.int16], powers: NDArray[np.int64], cosines: NDArray[np.int64], out: NDArray[np.int32]
) -> None:
    """Fill `out`, (rows, columns, 4), with the matrices of nodes, see `WarpField.matrices`."""
    for i in range(nodes.shape[0]):
        for j in range(nodes.shape[1]):
            for at in range(2):
                steps, turned = np.int64(nodes[i, j, at]), np.int64(nodes[i, j, 2])
                if at == 0:
                    turned += np.int64(nodes[i, j, 3]) + 64
                size = (powers[steps & 31] << (6 + (steps >> 5))) >> 6
                out[i, j, at] = (size * cosines[(turned - 64) & 255] + 2**15) >> 16
                out[i, j, 2 + at] = (size * cosines[turned & 255] + 2**15) >> 16


@shared
def displacement_row(
    matrices: NDArray[np.int32],
    margin: Any,
    centre: tuple[np.int32, np.int32, np.int32, np.int32],
    down: Any,
    row: Any,
    column: Any,
    right: Any,
    ys: NDArray[np.int32],
    xs: NDArray[np.int32],
) -> None:
    """Fill `ys` and `xs` with the `displacement` of the texels of a row, from (row, column) on.

    The first of them lies `down` rows and `right` columns from its block's centre, whose matrix is `centre`.
    All in 32 bits, which blocks of at most 2048 texels a side cannot leave. Between two nodes M is linear
    along a row, so that its numerator needs one multiplication.
    """
    last_i, last_j = matrices.shape[0] - 1, matrices.shape[1] - 1
    i, y = margin + (row >> 5), np.int32(down)
    up, low = np.int32(32 - (row & 31)), np.int32(row & 31)
    if i < 0:
        i, up, low = 0, np.int32(32), np.int32(0)
    # Beyond the last node it holds.
    above, below = matrices[min(i, last_i)], matrices[min(i + 1, last_i)]
    half, nine, ten = np.int32(256), np.int32(9), np.int32(10)
    start = 0
    while start < ys.shape[0]:
        first = column + start
        stop = min(ys.shape[0], start + 32 - (first & 31))
        j = margin + (first >> 5)
        j0, j1, along0 = min(max(j, 0), last_j), min(max(j + 1, 0), last_j), first & 31
        left0, right0 = above[j0, 0] * up + below[j0, 0] * low, above[j1, 0] * up + below[j1, 0] * low
        left1, right1 = above[j0, 1] * up + below[j0, 1] * low, above[j1, 1] * up + below[j1, 1] * low
        left2, right2 = above[j0, 2] * up + below[j0, 2] * low, above[j1, 2] * up + below[j1, 2] * low
        left3, right3 = above[j0, 3] * up + below[j0, 3] * low, above[j1, 3] * up + below[j1, 3] * low
        m0, d0 = np.int32(left0 * 32 + 512), np.int32(right0 - left0)
        m1, d1 = np.int32(left1 * 32 + 512), np.int32(right1 - left1)
        m2, d2 = np.int32(left2 * 32 + 512), np.int32(right2 - left2)
        m3, d3 = np.int32(left3 * 32 + 512), np.int32(right3 - left3)
        some_ys, some_xs = ys[start:stop], xs[start:stop]
        x0 = np.int32(right + start)
        for n in range(stop - start):
            along, x = np.int32(along0 + n), np.int32(x0 + n)
            a0 = np.int32((np.int32(m0 + d0 * along) >> ten) + centre[0])
            a1 = np.int32((np.int32(m1 + d1 * along) >> ten) + centre[1])
            a2 = np.int32((np.int32(m2 + d2 * along) >> ten) + centre[2])
            a3 = np.int32((np.int32(m3 + d3 * along) >> ten) + centre[3])
            some_ys[n] = np.int32(a0 * y + a1 * x + half) >> nine
            some_xs[n] = np.int32(a2 * y + a3 * x + half) >> nine
        start = stop
