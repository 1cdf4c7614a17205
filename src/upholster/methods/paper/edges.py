"""Where two charts meet: texels of one in the grid of the other, and edges to be worked on at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.geometry import SharedEdge
from upholster.quilt._paint_kernels import SYMMETRIES
from upholster.quilt.model import Chart
from upholster.types import frozen_array

__all__ = ["EdgeMap", "color_classes", "edge_map"]


@dataclass(frozen=True, slots=True)
class EdgeMap:
    """An interval of an edge at which texels of two charts meet one to one.

    Attributes
    ----------
    chart_a, chart_b
        The two charts.
    along_rows
        Whether the edge runs along A's rows axis (edges 1 and 3), else along its columns axis.
    line
        The first row or column of A's grid beyond the edge's line: 0 or A's height or width.
    start, length
        Where the interval starts along the edge on A, and how long it is, in texels.
    map_b
        (6,) int64: texel (r, c) of A's grid is texel (m0·r + m1·c + m4, m2·r + m3·c + m5) of B's.
    turn_b
        The turn of a block on B that is upright on A.
    """

    chart_a: int
    chart_b: int
    along_rows: bool
    line: int
    start: int
    length: int
    map_b: NDArray[np.int64]
    turn_b: int

    def to_b(
        self, row: NDArray[np.int32], column: NDArray[np.int32]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the row and column on B of a texel of A's grid, which may lie beyond the edge."""
        m = self.map_b
        return m[0] * row + m[1] * column + m[4], m[2] * row + m[3] * column + m[5]


def edge_map(edge: SharedEdge, a: Chart, b: Chart) -> EdgeMap | None:
    """Relate the texels of two charts along an edge; None where they do not meet one to one.

    Each chart covers its whole patch.
    """
    size_a = a.height if edge.edge in (1, 3) else a.width
    size_b = b.height if edge.other_edge in (1, 3) else b.width
    start, stop = edge.start * size_a, edge.stop * size_a
    other_start, other_stop = edge.other_start * size_b, edge.other_stop * size_b
    ends = np.array([start, stop, other_start, other_stop])
    whole = np.rint(ends).astype(int)
    if np.abs(ends - whole).max() > 1e-6 or whole[1] - whole[0] != abs(whole[3] - whole[2]):
        return None
    forward = whole[3] > whole[2]

    def to_b(row: int, column: int) -> tuple[int, int]:
        # Depth counts texels beyond A's edge, which are texels inside B's.
        along = row if edge.edge in (1, 3) else column
        depth = (-1 - row, column - a.width, row - a.height, -1 - column)[edge.edge]
        there = whole[2] + (along - whole[0]) if forward else whole[2] - 1 - (along - whole[0])
        return ((depth, there), (there, b.width - 1 - depth), (b.height - 1 - depth, there), (there, depth))[
            edge.other_edge
        ]

    origin, down, right = np.array(to_b(0, 0)), np.array(to_b(1, 0)), np.array(to_b(0, 1))
    matrix = np.stack([down - origin, right - origin], axis=1)
    # A block upright on A steps through the exemplar as A does: B's steps are taken back to A's.
    symmetry = int(np.flatnonzero((np.reshape(matrix.T, -1) == SYMMETRIES).all(axis=1))[0])
    return EdgeMap(
        edge.patch,
        edge.other_patch,
        edge.edge in (1, 3),
        (0, a.width, a.height, 0)[edge.edge],
        int(whole[0]),
        int(whole[1] - whole[0]),
        frozen_array(np.array([*matrix.reshape(-1), *origin], np.int64)),
        symmetry,
    )


def color_classes(pairs: Sequence[tuple[int, int]]) -> list[list[int]]:
    """Sort edges, as pairs of charts, into rounds in which no chart occurs twice (a greedy edge colouring).

    Returns
    -------
    list of list of int
        Indices into `pairs`, each exactly once.
    """
    schedule: list[list[int]] = []
    used: list[set[int]] = []
    for index, (a, b) in enumerate(pairs):
        for members, charts in zip(schedule, used, strict=True):
            if a not in charts and b not in charts:
                members.append(index)
                charts |= {a, b}
                break
        else:
            schedule.append([index])
            used.append({a, b})
    return schedule
