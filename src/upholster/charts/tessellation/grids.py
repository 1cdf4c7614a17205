"""The number of quadrilaterals of each chart, and the places of its rows and columns of vertices.

Numbers follow from texels (`even_counts`), for files for renderers, or from the surface's bends
(`bent_counts`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts.chart_seams import ChartSeam
from upholster.geometry.components import connected
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart

__all__ = ["EPS", "VertexGrid", "bent_counts", "chart_grids", "even_counts"]

EPS = 1e-6
"""Places on a chart's edge closer than this share of its length count as one."""

LEAST_SHARE = 4
"""A patch gets at least one part in this many of an even share of quadrilaterals, each way."""


RING = 4
"""A chart across at least this many patches may close to a ring; it gets at least this many
quadrilaterals."""

ASIDE = 0.3
"""Steps by which a place on a triangle may be off, approximately."""

CHANGE = 0.45
"""Greatest relative change of steps over a triangle, in length or direction: 0.45 is 26°."""

SAMPLES, MOST_SAMPLED = 8, 32
"""Intervals of each patch in which bends are measured, and the greatest number of patches measured."""


@dataclass(frozen=True, slots=True, eq=False)
class VertexGrid:
    """The rows and columns of vertices on a chart.

    Attributes
    ----------
    rows, columns
        (R + 1,) and (C + 1,) rising, in texels: 0 to the chart's height and width.
    first, first_quad
        Numbers of its first vertex and first quadrilateral; both are numbered row by row.
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
        """Return the places of an edge's vertices along it, in texels."""
        return self.rows if edge & 1 else self.columns

    def ring(self, edge: int) -> NDArray[np.int64]:
        """Return the numbers of the vertices of an edge, along it."""
        width, last = len(self.columns), len(self.rows) - 1
        if edge & 1:
            return self.first + np.arange(last + 1) * width + (width - 1 if edge == 1 else 0)
        return self.first + (last * width if edge == 2 else 0) + np.arange(width)


def chart_grids(
    surface: Surface, charts: Sequence[Chart], counts: FloatArray, least: int, *, tips: bool = False
) -> list[VertexGrid]:
    """Return a grid for each chart, with about `counts` intervals down and to the right, (charts, 2).

    Each patch has at least `least` intervals, and patches end where intervals end. If `least` is 0, intervals
    have to end only where derivatives jump. With `tips`, the row next to an edge that is a point is a step
    high.
    """
    grids: list[VertexGrid] = []
    first = first_quad = 0
    for chart, cells in zip(charts, counts.tolist(), strict=True):
        face = surface.faces[chart.face]
        rows, columns = (
            size * _breaks(low, high, range(count + 1) if least else jumps, number, least)
            for size, low, high, count, jumps, number in (
                (chart.height, chart.s0, chart.s1, face.rows, face.breaks[0], cells[0]),
                (chart.width, chart.t0, chart.t1, face.columns, face.breaks[1], cells[1]),
            )
        )
        if tips:
            rows, columns = _with_tips(surface, chart, rows, columns)
        grids.append(VertexGrid(rows, columns, first, first_quad))
        first += grids[-1].vertices
        first_quad += (len(rows) - 1) * (len(columns) - 1)
    return grids


def _with_tips(
    surface: Surface, chart: Chart, rows: FloatArray, columns: FloatArray
) -> tuple[FloatArray, FloatArray]:
    # Next to a point, quadrilaterals are triangles and leave half of their row of steps uncovered: keep it
    # thin.
    out = []
    for axis, lines in enumerate((rows, columns)):
        tips = [1.0] * _is_point(surface, chart, 3 * axis)
        tips += [lines[-1] - 1.0] * _is_point(surface, chart, 2 - axis)
        out.append(np.unique([*lines, *(tip for tip in tips if np.abs(lines - tip).min() > 1.0 - EPS)]))
    return out[0], out[1]


def _is_point(surface: Surface, chart: Chart, edge: int) -> bool:
    """Return whether a chart's edge, or a part of it, is a point."""
    line = (chart.s0, chart.t1, chart.s1, chart.t0)[edge]
    if not surface.degenerate or abs(line - round(line)) > EPS:
        return False
    before = round(line) - (1 if edge in (1, 2) else 0)
    low, high = (chart.s0, chart.s1) if edge & 1 else (chart.t0, chart.t1)
    along = range(int(low + EPS), ceil(high - EPS))
    places = [(k, before) if edge & 1 else (before, k) for k in along]
    return any((surface.patch_number(chart.face, *place), edge) in surface.degenerate for place in places)


def even_counts(
    surface: Surface, charts: Sequence[Chart], seams: Sequence[ChartSeam], quads: int
) -> tuple[FloatArray, int]:
    """Distribute about `quads` quadrilaterals by texels: counts and `least` as `chart_grids` takes them."""
    sizes = np.array([(chart.height, chart.width) for chart in charts], np.float64)
    label = _sides_that_meet(sizes, seams)
    mean = np.bincount(label, sizes.ravel()) / np.maximum(np.bincount(label), 1)
    wanted = mean[label].reshape(-1, 2)
    # Round, so that values exactly between two numbers round alike on any machine.
    wanted = np.round(wanted * np.sqrt(quads / wanted.prod(axis=1).sum()), 9)
    spans = np.array([(chart.s1 - chart.s0, chart.t1 - chart.t0) for chart in charts])
    wanted = np.maximum(wanted, np.minimum(spans, RING))
    return wanted, int((quads / len(surface.patches)) ** 0.5) // LEAST_SHARE


def bent_counts(
    surface: Surface, charts: Sequence[Chart], seams: Sequence[ChartSeam]
) -> tuple[FloatArray, int]:
    """Return the number of intervals that makes each chart nearly linear: as `chart_grids` takes them.

    Both the surface and the steps on it count: a plane with an uneven parametrization is bent, like a ball. A
    triangle is fine enough if no point on it is more than `ASIDE` steps from its place, and if steps change
    by at most `CHANGE` of their length from one of its ends to the other.
    """
    sizes = np.array([(chart.height, chart.width) for chart in charts], np.float64)
    bends = np.array([_bends(surface, chart) for chart in charts])
    label = _sides_that_meet(sizes, seams)
    most = np.zeros(len(label))
    np.maximum.at(most, label, bends.ravel())
    # Round, as above: an integer up to rounding counts as that integer.
    return np.maximum(1.0, np.ceil(np.round(most[label], 6))).reshape(-1, 2), 0


def _bends(surface: Surface, chart: Chart) -> tuple[float, float]:
    """Return the numbers of intervals down and to the right into which to cut a chart."""
    face = surface.faces[chart.face]
    counts = [
        SAMPLES * max(1, min(MOST_SAMPLED, ceil(high - low)))
        for low, high in ((chart.s0, chart.s1), (chart.t0, chart.t1))
    ]
    s, t = (
        low + (high - low) * np.linspace(0.0, 1.0, count + 1)
        for count, low, high in zip(counts, (chart.s0, chart.t0), (chart.s1, chart.t1), strict=True)
    )
    points = face.points_grid(s, t)
    cells = float(np.prod(counts))
    whole = np.linalg.norm(np.cross(np.diff(points, axis=0)[:, :-1], np.diff(points, axis=1)[:-1]), axis=2)
    step = max(float(np.sqrt(whole.sum() / (chart.height * chart.width))), 1e-300)
    wanted = []
    for axis, count in enumerate(counts):
        edges = np.diff(points, axis=axis)
        second = np.linalg.norm(np.diff(edges, axis=axis), axis=2)
        lengths = np.linalg.norm(edges, axis=2)
        # Edges next to a pole are short: there only visible errors count.
        floor = 0.1 * float(lengths.mean())
        change = second / np.maximum(np.take(lengths, range(count - 1), axis), max(floor, 1e-300))
        by_place = np.sqrt(second.max() / (8 * ASIDE * step))
        wanted.append(count * max(float(by_place), float(change.max()) / CHANGE))
    twist = np.linalg.norm(np.diff(np.diff(points, axis=0), axis=1), axis=2).max() * cells
    short = float(np.sqrt(twist / (4 * ASIDE * step * max(wanted[0], 1.0) * max(wanted[1], 1.0))))
    return max(wanted[0], 1.0) * max(short, 1.0), max(wanted[1], 1.0) * max(short, 1.0)


def _sides_that_meet(sizes: FloatArray, seams: Sequence[ChartSeam]) -> IntArray:
    """Return a number for each side, (charts · 2,), equal for complete sides that meet; `sizes` in texels."""
    pairs = [
        (2 * m.chart + axis, 2 * m.other_chart + other_axis)
        for m in seams
        # Edges 1 and 3 run down, 0 and 2 to the right.
        for axis, other_axis in ((1 - m.edge % 2, 1 - m.other_edge % 2),)
        if m.stop - m.start > (1.0 - EPS) * sizes[m.chart, axis]
        and abs(m.other_stop - m.other_start) > (1.0 - EPS) * sizes[m.other_chart, other_axis]
    ]
    return connected(sizes.size, np.array(pairs, np.int64).reshape(-1, 2))


def _breaks(low: float, high: float, lines: Sequence[int], wanted: float, least: int) -> FloatArray:
    """Return where about `wanted` intervals begin and end between two parameters, as shares: 0 to 1.

    Lines between the two are included, and each patch has at least `least` intervals.
    """
    span = high - low
    inner = [(line - low) / span for line in lines if low + EPS < line < high - EPS]
    ends = np.array([0.0, *inner, 1.0])
    counts = np.diff(np.rint(max(1, round(wanted)) * ends))
    counts = np.maximum(counts, np.maximum(1, np.rint(least * span * np.diff(ends)))).astype(int)
    parts = [a + (b - a) * (np.arange(n) / n) for a, b, n in zip(ends, ends[1:], counts, strict=False)]
    return np.concatenate([*parts, [1.0]])
