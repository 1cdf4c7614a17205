"""How many quadrilaterals each chart gets, and where its rows and columns of vertices lie."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts.seams import ChartSeam
from upholster.geometry import Surface
from upholster.quilt.chart import Chart
from upholster.types import FloatArray

__all__ = ["EPS", "ChartGrid", "chart_grids", "connected"]

EPS = 1e-6
"""Places on a chart's edge closer than this share of its length are one."""

LEAST_SHARE = 4
"""A patch gets at least this part, one in so many, of an even share of quadrilaterals each way."""


RING = 4
"""A chart across so many patches or more, which may close to a ring, gets so many quadrilaterals at least."""


@dataclass(frozen=True, slots=True, eq=False)
class ChartGrid:
    """The rows and columns of vertices on a chart.

    Attributes
    ----------
    rows, columns
        (R + 1,) and (C + 1,) rising, in texels: 0 to the chart's height and width.
    first, first_quad
        Number of its first vertex and quadrilateral; both are numbered row by row.
    """

    rows: FloatArray
    columns: FloatArray
    first: int
    first_quad: int

    @property
    def vertices(self) -> int:
        """Number of its vertices."""
        return len(self.rows) * len(self.columns)

    def breaks(self, edge: int) -> FloatArray:
        """Return where the vertices of an edge lie along it, in texels."""
        return self.rows if edge & 1 else self.columns

    def ring(self, edge: int) -> NDArray[np.int64]:
        """Return the numbers of the vertices of an edge, along it."""
        width, last = len(self.columns), len(self.rows) - 1
        if edge & 1:
            return self.first + np.arange(last + 1) * width + (width - 1 if edge == 1 else 0)
        return self.first + (last * width if edge == 2 else 0) + np.arange(width)


def chart_grids(
    surface: Surface, charts: Sequence[Chart], seams: Sequence[ChartSeam], quads: int
) -> list[ChartGrid]:
    """Share out about `quads` quadrilaterals, see `tessellate`: a grid for each chart."""
    sizes = np.array([(chart.height, chart.width) for chart in charts], np.float64)
    wanted = _agreed(sizes, seams)
    # What is exactly between two numbers rounds alike on any machine.
    wanted = np.round(wanted * np.sqrt(quads / wanted.prod(axis=1).sum()), 9)
    least = int((quads / len(surface.patches)) ** 0.5) // LEAST_SHARE
    grids: list[ChartGrid] = []
    first = first_quad = 0
    for chart, cells in zip(charts, wanted.tolist(), strict=True):
        face = surface.faces[chart.face]
        rows, columns = (
            size * _breaks(low, high, range(count + 1) if least else jumps, number, least)
            for size, low, high, count, jumps, number in (
                (chart.height, chart.s0, chart.s1, face.rows, face.breaks[0], cells[0]),
                (chart.width, chart.t0, chart.t1, face.columns, face.breaks[1], cells[1]),
            )
        )
        grids.append(ChartGrid(rows, columns, first, first_quad))
        first += grids[-1].vertices
        first_quad += (len(rows) - 1) * (len(columns) - 1)
    return grids


def connected(count: int, pairs: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return for each of `count` things the least of those that pairs (N, 2) connect it with: (count,)."""
    a, b = pairs.T
    label = np.arange(count)
    while True:
        before = label
        lowest = np.minimum(label[a], label[b])
        label = label.copy()
        np.minimum.at(label, a, lowest)
        np.minimum.at(label, b, lowest)
        label = label[label]
        if np.array_equal(label, before):
            return label


def _agreed(sizes: FloatArray, seams: Sequence[ChartSeam]) -> FloatArray:
    """Return sizes (charts, 2) of which those that meet as a whole are one, their mean."""
    pairs = [
        (2 * m.chart + axis, 2 * m.other_chart + other_axis)
        for m in seams
        # Edges 1 and 3 run down, 0 and 2 to the right.
        for axis, other_axis in ((1 - m.edge % 2, 1 - m.other_edge % 2),)
        if m.stop - m.start > (1.0 - EPS) * sizes[m.chart, axis]
        and abs(m.other_stop - m.other_start) > (1.0 - EPS) * sizes[m.other_chart, other_axis]
    ]
    label = connected(sizes.size, np.array(pairs, np.int64).reshape(-1, 2))
    mean = np.bincount(label, sizes.ravel()) / np.maximum(np.bincount(label), 1)
    return mean[label].reshape(-1, 2)


def _breaks(low: float, high: float, lines: Sequence[int], wanted: float, least: int) -> FloatArray:
    """Return where about `wanted` intervals begin and end between two parameters, as shares: 0 to 1.

    Lines between the two are among them, and so many intervals lie in each patch at least.
    """
    span = high - low
    wanted = max(wanted, min(span, RING))
    inner = [(line - low) / span for line in lines if low + EPS < line < high - EPS]
    ends = np.array([0.0, *inner, 1.0])
    counts = np.diff(np.rint(max(1, round(wanted)) * ends))
    counts = np.maximum(counts, np.maximum(1, np.rint(least * span * np.diff(ends)))).astype(int)
    parts = [a + (b - a) * (np.arange(n) / n) for a, b, n in zip(ends, ends[1:], counts, strict=False)]
    return np.concatenate([*parts, [1.0]])
