"""The integer arithmetic of warp fields, which every decoder repeats (SPEC.md, section 8)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.runtime.jit import inline, kernel

__all__ = [
    "matrices_between",
    "matrix_between",
    "node_matrices",
    "node_row",
    "reading",
]


@inline
def node_row(matrices: NDArray[np.int32], margin: Any, place: Any) -> tuple[Any, Any, Any]:
    """Return the rows of nodes above and below a place in 1/16 step, and its fraction between, in 1/512."""
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
    """Return M, in 1/4096, at a place in 1/16 step: between rows of nodes, rounded, then between columns."""
    i, below, down = node_row(matrices, margin, row)
    last = matrices.shape[1] - 1
    x = np.int64(column) - 8
    j, right = margin + (x >> 9), x & 511
    if j < 0:
        j, right = np.int64(0), np.int64(0)
    elif j >= last:
        j, right = np.int64(last), np.int64(0)
    next_column = min(j + 1, last)
    a, b, c, d = matrices[i, j], matrices[i, next_column], matrices[below, j], matrices[below, next_column]
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
    """Return where a place reads in the exemplar, relative to its placement's source, in 1/16 pixel.

    `first` and `here` are M at the centre and at the place. The place is `down` and `right` of the centre, in
    1/16 step, within ±16383, so that 32 bits suffice.
    """
    a, b, c, d = first[0] + here[0], first[1] + here[1], first[2] + here[2], first[3] + here[3]
    y, x, u, v = down >> 4, right >> 4, down & 15, right & 15
    return (
        (a * y + b * x + ((a * u + b * v) >> 4) + 256) >> 9,
        (c * y + d * x + ((c * u + d * v) >> 4) + 256) >> 9,
    )


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
