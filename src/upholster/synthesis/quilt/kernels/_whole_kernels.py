"""Blocks that are completely on one chart: they are not unfolded, but read as a decoder reads them.

A place q of the chart reads at ``s + ½·(C + M(q))·(q − c)``. The inverse of this map takes the corners of a
coarse grid over the frame to the chart; between these corners it is interpolated linearly.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, int64
from upholster.runtime.jit import inline, kernel, shared
from upholster.synthesis.quilt.kernels._sheet_kernels import FieldArrays, enter_fit, field_at, turned
from upholster.synthesis.quilt.kernels._unfold_kernels import Footprint, MeshArrays

__all__ = ["CLEAR_CELL", "ClearCells", "mark_edges", "place_inside_chart"]

CLEAR_CELL = 8
"""Side in steps of the cells for which it is stored whether a sheet may end there."""

_GRID = 4
"""Number of the grid's cells over a frame each way."""

_VARIES = 0.25
"""Maximum relative difference between M inside a block and M at its centre. Where M varies more, blocks are
unfolded and trimmed."""

_STEPS = 3
"""Iterations for inverting the map, which is nearly linear."""


class ClearCells(NamedTuple):
    """The cells of charts, `CLEAR_CELL` steps wide, that are crossed by edges at which sheets end.

    `crossed` contains charts one after another, row by row; `firsts` is the index of each chart's first cell,
    `shapes` (charts, 2) are the rows and columns of cells.
    """

    crossed: NDArray[np.uint8]
    firsts: NDArray[np.int64]
    shapes: NDArray[np.int64]


@inline
def _is_outer(p: FloatArray, k: int, m: int, corner: NDArray[np.int64], size: NDArray[np.int64]) -> bool:
    # Whether an edge is on the outer edge of its chart, beyond which there is no step.
    for axis in range(2):
        first, last = -0.5 - corner[axis], size[axis] - 0.5 - corner[axis]
        if abs(p[k, axis] - first) < 1e-6 and abs(p[m, axis] - first) < 1e-6:
            return True
        if abs(p[k, axis] - last) < 1e-6 and abs(p[m, axis] - last) < 1e-6:
            return True
    return False


@kernel
def mark_edges(
    mesh: MeshArrays, corners: NDArray[np.int64], sizes: NDArray[np.int64], clear: ClearCells
) -> None:
    """Mark the cells that seams, creases and borders cross, except for borders along charts' edges.

    `corners` (charts, 2) are the first steps of the charts' windows, `sizes` (charts, 2) the charts' sizes.
    """
    for t in range(mesh.triangles.shape[0]):
        chart = int64(mesh.chart[t])
        if chart < 0:
            continue
        rows, columns = clear.shapes[chart, 0], clear.shapes[chart, 1]
        for k in range(3):
            m, p = (k + 1) % 3, mesh.places[t]
            ends = mesh.neighbours[t, k] < 0
            if not (ends or mesh.seam[t, k] >= 0):
                continue
            if ends and _is_outer(p, k, m, corners[chart], sizes[chart]):
                continue
            y, x = p[m, 0] - p[k, 0], p[m, 1] - p[k, 1]
            count = int64(max(abs(y), abs(x))) // 2 + 1
            for step in range(count + 1):
                share = step / count
                i = int64((p[k, 0] + share * y + 0.5) / CLEAR_CELL)
                j = int64((p[k, 1] + share * x + 0.5) / CLEAR_CELL)
                i, j = min(max(i, 0), rows - 1), min(max(j, 0), columns - 1)
                clear.crossed[clear.firsts[chart] + i * columns + j] = 1


@inline
def _is_clear(clear: ClearCells, chart: int, low: tuple[float, float], high: tuple[float, float]) -> bool:
    rows, columns, first = clear.shapes[chart, 0], clear.shapes[chart, 1], clear.firsts[chart]
    i0, i1 = max(int64(low[0]) // CLEAR_CELL, 0), min(int64(high[0]) // CLEAR_CELL + 1, rows)
    j0, j1 = max(int64(low[1]) // CLEAR_CELL, 0), min(int64(high[1]) // CLEAR_CELL + 1, columns)
    for i in range(i0, i1):
        for j in range(j0, j1):
            if clear.crossed[first + i * columns + j]:
                return False
    return True


@inline
def _place_of(
    field: FieldArrays, root: FloatArray, centre: tuple[float, float, float, float], down: float, right: float
) -> tuple[bool, float, float]:
    # The place on the chart of the frame's point (down, right), and whether M varies little up to there.
    chart, turns = int64(root[0]), root[5]
    y, x = down - root[3], right - root[4]
    row, column, sound = root[1], root[2], True
    size = centre[0] * centre[0] + centre[1] * centre[1] + centre[2] * centre[2] + centre[3] * centre[3]
    m = centre
    for _ in range(_STEPS):
        a, b, c, d = (
            0.5 * (centre[0] + m[0]),
            0.5 * (centre[1] + m[1]),
            0.5 * (centre[2] + m[2]),
            0.5 * (centre[3] + m[3]),
        )
        determinant = a * d - b * c
        if determinant <= 1e-6 * size:
            return False, row, column
        row, column = root[1] + (d * y - b * x) / determinant, root[2] + (a * x - c * y) / determinant
        m = turned(field_at(field, chart, row, column), turns)
    off = (
        (m[0] - centre[0]) ** 2 + (m[1] - centre[1]) ** 2 + (m[2] - centre[2]) ** 2 + (m[3] - centre[3]) ** 2
    )
    sound = off <= _VARIES * _VARIES * size
    return sound, row, column


@shared
def place_inside_chart(
    field: FieldArrays, clear: ClearCells, root: FloatArray, half: float, out: Footprint, fits: FloatArray
) -> Any:
    """Lay a block flat on its centre's chart; return its number of triangles, 0 if it must be unfolded.

    This replaces `unfold_block` and `fit_block`. `root` is as in `fit_block`; `half` is half the block's side
    in frame pixels.
    """
    centre = turned(field_at(field, int64(root[0]), root[1], root[2]), root[5])
    reach, across = half + 2.0, _GRID + 1
    low, high = (1e30, 1e30), (-1e30, -1e30)
    # First the corners of the grid are computed in `out.corners`, then two triangles for each of its cells.
    for i in range(across):
        for j in range(across):
            down, right = reach * (2.0 * i / _GRID - 1.0), reach * (2.0 * j / _GRID - 1.0)
            sound, row, column = _place_of(field, root, centre, down, right)
            if not sound:
                return int64(0)
            low = min(low[0], row), min(low[1], column)
            high = max(high[0], row), max(high[1], column)
            n = i * across + j
            out.corners[n, 0], out.corners[n, 1], out.corners[n, 2], out.corners[n, 3] = (
                down,
                right,
                row,
                column,
            )
    if not _is_clear(clear, int64(root[0]), (low[0] - 1.0, low[1] - 1.0), (high[0] + 2.0, high[1] + 2.0)):
        return int64(0)
    count = int64(0)
    for i in range(_GRID):
        for j in range(_GRID):
            first = i * across + j
            for part in range(2):
                a, b, c = (
                    (first, first + across, first + 1)
                    if part == 0
                    else (first + across + 1, first + 1, first + across)
                )
                out.triangles[count], out.charts[count] = -1, int64(root[0])
                out.sheets[count] = 0
                for axis in range(2):
                    out.maps[count, 0, axis], out.places[count, 0, axis] = (
                        out.corners[a, axis],
                        out.corners[a, 2 + axis],
                    )
                    out.maps[count, 1, axis], out.places[count, 1, axis] = (
                        out.corners[b, axis],
                        out.corners[b, 2 + axis],
                    )
                    out.maps[count, 2, axis], out.places[count, 2, axis] = (
                        out.corners[c, axis],
                        out.corners[c, 2 + axis],
                    )
                count += 1
    enter_fit(fits[0], root, centre)
    return count
