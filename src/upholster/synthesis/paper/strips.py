"""Shared edges along which texels of two charts match one to one, and sets of edges for parallel work."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import IntArray
from upholster.geometry.patches.adjacency import SharedEdge
from upholster.quilt.chart import Chart

_Texels = TypeVar("_Texels", int, IntArray)

__all__ = ["Strip", "block_count", "color_classes", "strip_along"]


@dataclass(frozen=True)
class Strip:
    """An interval of a shared edge that edge blocks cover, half on either chart.

    Attributes
    ----------
    a, b
        Numbers of the two charts.
    edge_a, edge_b
        Edge of each, 0 to 3.
    opposed
        Whether the two edges run in opposite directions.
    start, length
        The interval on A's edge, in texels.
    other
        The interval's first texel on B's edge, counted along B's edge from its low end.
    """

    a: int
    b: int
    edge_a: int
    edge_b: int
    opposed: bool
    start: int
    length: int
    other: int

    @property
    def along_rows(self) -> bool:
        """Whether it runs along A's rows axis."""
        return self.edge_a in (1, 3)

    def to_b(self, row: _Texels, column: _Texels, a: Chart, b: Chart) -> tuple[_Texels, _Texels]:
        """Return row and column in B's grid for texels of A's grid, on either side of the edge."""
        along = row if self.along_rows else column
        depth = (-1 - row, column - a.width, row - a.height, -1 - column)[self.edge_a]
        step = along - self.start
        there = self.other + (self.length - 1 - step if self.opposed else step)
        return (
            (depth, there),
            (there, b.width - 1 - depth),
            (b.height - 1 - depth, there),
            (there, depth),
        )[self.edge_b]

    def map_to_b(self, a: Chart, b: Chart) -> NDArray[np.int64]:
        """Return (6,): texel (r, c) of A's grid is (m0·r + m1·c + m4, m2·r + m3·c + m5) of B's."""
        (r0, c0), (r1, c1), (r2, c2) = (self.to_b(*at, a, b) for at in ((0, 0), (1, 0), (0, 1)))
        return np.array([r1 - r0, r2 - r0, c1 - c0, c2 - c0, r0, c0])

    def corners(self, a: Chart, block: int, overlap: int) -> NDArray[np.int64]:
        """Return the first texels on A of its edge blocks, (n, 2).

        Blocks begin at the strip's start, one step apart; the last one is moved back to end with it.
        """
        steps = np.arange(block_count(self.length, block, overlap)) * (block - overlap)
        along = self.start + np.minimum(steps, self.length - block)
        across = np.full_like(along, (0, a.width, a.height, 0)[self.edge_a] - block // 2)
        return np.stack([along, across] if self.along_rows else [across, along], axis=1)


def block_count(length: int, block: int, overlap: int) -> int:
    """Return the number of blocks that cover so many texels, each overlapping the previous one."""
    return max(1, -(-(length - overlap) // (block - overlap)))


def strip_along(edge: SharedEdge, charts: Sequence[Chart], block: int) -> Strip | None:
    """Return the strip along a shared edge; None if texels do not match one to one, or no block fits.

    Parameters
    ----------
    edge
        The edge of two patches.
    charts
        Chart n covers the whole of patch n.
    block
        Side of an edge block in texels.
    """
    long_a = _edge_length(charts[edge.patch], edge.edge)
    long_b = _edge_length(charts[edge.other_patch], edge.other_edge)
    ends = np.array(
        [edge.start * long_a, edge.stop * long_a, edge.other_start * long_b, edge.other_stop * long_b]
    )
    start, stop, other, other_stop = (int(end) for end in np.rint(ends))
    if np.abs(ends - np.rint(ends)).max() > 1e-6 or stop - start != abs(other_stop - other):
        return None
    if stop - start < block:
        return None
    return Strip(
        edge.patch,
        edge.other_patch,
        edge.edge,
        edge.other_edge,
        other > other_stop,
        start,
        stop - start,
        min(other, other_stop),
    )


def _edge_length(chart: Chart, edge: int) -> int:
    # Texels along edge 0 to 3.
    return chart.width if edge in (0, 2) else chart.height


def color_classes(pairs: Sequence[tuple[int, int]]) -> list[list[int]]:
    """Sort edges, as pairs of charts, into classes in which no chart occurs twice (a greedy edge colouring).

    Returns
    -------
    list of list of int
        Indices into `pairs`, each exactly once.
    """
    classes: list[list[int]] = []
    used: list[set[int]] = []
    for index, (a, b) in enumerate(pairs):
        for members, charts in zip(classes, used, strict=True):
            if a not in charts and b not in charts:
                members.append(index)
                charts |= {a, b}
                break
        else:
            classes.append([index])
            used.append({a, b})
    return classes
