"""Where the vertices of neighbouring charts coincide, and the extra vertices that T-junctions need."""

from bisect import bisect_left, insort
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts.chart_seams import ChartSeam
from upholster.charts.tessellation.grids import EPS, VertexGrid
from upholster.geometry.components import connected
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart

__all__ = ["Fans", "Junctions", "cell_fans", "find_junctions", "weld"]


@dataclass
class Junctions:
    """Vertices that coincide, and vertices that are missing from the charts' grids.

    Attributes
    ----------
    first
        Number of the first extra vertex.
    pairs
        (N, 2): vertices at one position.
    chart, places
        For the extra vertices: (M,), and (M, 2) in texels.
    sides
        Per (chart, edge), the extra vertices along it: (place along the edge, vertex), sorted.
    """

    first: int
    pairs: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))
    chart: list[int] = field(default_factory=list)
    places: list[tuple[float, float]] = field(default_factory=list)
    sides: dict[tuple[int, int], list[tuple[float, int]]] = field(default_factory=lambda: defaultdict(list))

    def add(self, chart: int, row: float, column: float) -> int:
        """Add a vertex and return its number."""
        self.chart.append(chart)
        self.places.append((row, column))
        return self.first + len(self.chart) - 1

    def on_edge(self, chart: int, edge: int, at: float, grid: VertexGrid) -> int:
        """Return the extra vertex at a place of an edge, adding it if it is new."""
        side, height, width = self.sides[chart, edge], grid.rows[-1], grid.columns[-1]
        near = EPS * (height if edge & 1 else width)
        k = bisect_left(side, (at - near, -1))
        if k < len(side) and side[k][0] <= at + near:
            return side[k][1]
        vertex = self.add(chart, *((0.0, at), (at, width), (height, at), (at, 0.0))[edge])
        insort(side, (at, vertex))
        return vertex


@dataclass(frozen=True, slots=True)
class Fans:
    """Cells cut into triangles: their numbers (C,) among the quadrilaterals, and the triangles (T, 3)."""

    cells: NDArray[np.int64]
    triangles: IntArray


def find_junctions(
    surface: Surface, charts: Sequence[Chart], seams: Sequence[ChartSeam], grids: Sequence[VertexGrid]
) -> Junctions:
    """Find vertices that coincide, and add the missing ones where the vertices of two sides do not match."""
    found = Junctions(first=grids[-1].first + grids[-1].vertices)
    pairs = [found.pairs, *_collapsed(surface, charts, grids)]
    for m in seams:
        # Each seam is listed from both sides; it is united once.
        other = (m.other_chart, m.other_edge, min(m.other_start, m.other_stop))
        if (m.chart, m.edge, m.start) <= other:
            pairs.append(_unite(m, grids, found))
    found.pairs = np.concatenate(pairs)
    return found


def _collapsed(
    surface: Surface, charts: Sequence[Chart], grids: Sequence[VertexGrid]
) -> Iterator[NDArray[np.int64]]:
    """Yield pairs of vertices along edges of patches that are points."""
    if not surface.degenerate:
        return
    for chart, grid in zip(charts, grids, strict=True):
        for edge, line in enumerate((chart.s0, chart.t1, chart.s1, chart.t0)):
            if abs(line - round(line)) > EPS:
                continue
            before = round(line) - (1 if edge in (1, 2) else 0)
            low, high = (chart.s0, chart.s1) if edge & 1 else (chart.t0, chart.t1)
            breaks, ring = grid.breaks(edge), grid.ring(edge)
            at = low + (high - low) * breaks / breaks[-1]
            patches = [
                surface.patch_number(chart.face, *((k, before) if edge & 1 else (before, k)))
                for k in range(int(low + EPS), int(np.ceil(high - EPS)))
            ]
            # The length of the edge, up to each patch, that is not a point.
            sound = np.cumsum([0.0, *((patch, edge) not in surface.degenerate for patch in patches)])
            passed = np.interp(at, int(low + EPS) + np.arange(len(sound)), sound)
            point = np.flatnonzero(np.diff(passed) <= EPS)
            yield np.stack([ring[point], ring[point + 1]], axis=1)


def _unite(m: ChartSeam, grids: Sequence[VertexGrid], found: Junctions) -> NDArray[np.int64]:
    """Give both sides of a seam the vertices of the other; return the pairs that coincide."""
    sides = (
        (m.chart, m.edge, m.start, m.stop),
        (m.other_chart, m.other_edge, m.other_start, m.other_stop),
    )
    one, other = (grids[chart].breaks(edge) for chart, edge, *_ in sides)
    if len(one) == len(other) and (m.start, m.stop) == (0.0, one[-1]):
        # Most seams are complete sides with equal numbers of vertices.
        theirs = m.other_start + (m.other_stop - m.other_start) / one[-1] * one
        opposed = m.other_start > m.other_stop
        if np.abs(theirs - (other[::-1] if opposed else other)).max() <= EPS * other[-1]:
            ring = grids[m.other_chart].ring(m.other_edge)
            return np.stack([grids[m.chart].ring(m.edge), ring[::-1] if opposed else ring], axis=1)
    # 0 … 1 along the seam
    breaks, near = [np.array([0.0, 1.0])], 0.0
    for chart, edge, start, stop in sides:
        own = grids[chart].breaks(edge)
        breaks.append((own - start) / (stop - start))
        near = max(near, EPS * float(own[-1]) / abs(stop - start))
    united = np.sort(np.concatenate(breaks))
    united = united[(united >= 0.0) & (united <= 1.0)]
    united = united[np.diff(united, prepend=-1.0 - near) > near]
    return np.stack([_vertices_at(found, grids, *side, united) for side in sides], axis=1)


def _vertices_at(
    found: Junctions,
    grids: Sequence[VertexGrid],
    chart: int,
    edge: int,
    start: float,
    stop: float,
    shares: FloatArray,
) -> NDArray[np.int64]:
    """Return a side's vertices at shares of a seam, extra ones where its grid has none."""
    grid = grids[chart]
    own, ring = grid.breaks(edge), grid.ring(edge)
    at = start + (stop - start) * shares
    right = np.clip(np.searchsorted(own, at), 1, len(own) - 1)
    nearest = np.where(at - own[right - 1] <= own[right] - at, right - 1, right)
    vertices = ring[nearest]
    for k in np.flatnonzero(np.abs(at - own[nearest]) > EPS * own[-1]).tolist():
        vertices[k] = found.on_edge(chart, edge, float(at[k]), grid)
    return vertices


def cell_fans(found: Junctions, grids: Sequence[VertexGrid]) -> Fans:
    """Cut cells with extra vertices on their sides into triangles around a new vertex in the middle."""
    extras: dict[tuple[int, int, int], list[list[int]]] = defaultdict(lambda: [[], [], [], []])
    for (chart, edge), side in found.sides.items():
        grid = grids[chart]
        last_row, last_column = len(grid.rows) - 2, len(grid.columns) - 2
        intervals = np.searchsorted(grid.breaks(edge), [at for at, _ in side], side="right") - 1
        for (_, vertex), k in zip(side, intervals.tolist(), strict=True):
            i, j = ((0, k), (k, last_column), (last_row, k), (k, 0))[edge]
            extras[chart, i, j][edge].append(vertex)
    cells, triangles = [], []
    for (chart, i, j), (top, right, bottom, left) in extras.items():
        grid = grids[chart]
        width = len(grid.columns)
        a = grid.first + i * width + j
        b, c, d = a + width, a + width + 1, a + 1
        # counter-clockwise: down the left side, along the bottom, up the right side, back along the top
        outline = [a, *left, b, *bottom, c, *right[::-1], d, *top[::-1]]
        middle = found.add(
            chart, *((line[k] + line[k + 1]) / 2 for line, k in ((grid.rows, i), (grid.columns, j)))
        )
        triangles += [(middle, v, w) for v, w in zip(outline, outline[1:] + outline[:1], strict=True)]
        cells.append(grid.first_quad + i * (width - 1) + j)
    return Fans(np.array(cells, dtype=np.int64), np.array(triangles, dtype=np.int32).reshape(-1, 3))


def weld(positions: FloatArray, pairs: NDArray[np.int64]) -> None:
    """Move all vertices that pairs (N, 2) connect to the position of the lowest of them, in place."""
    vertices, index = np.unique(pairs, return_inverse=True)
    label = connected(len(vertices), index.reshape(-1, 2))
    positions[vertices] = positions[vertices[label]]
