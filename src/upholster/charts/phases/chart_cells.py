"""Cells of charts: even grids, linked inside each chart and over seams.

All lengths are exemplar pixels, for a chart's warp field holds the surface's metric; nothing is asked of the
surface itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts.phases.links import Links, joined_links, matched_waves
from upholster.charts.transitions import Transition, TransitionTable
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import WarpField, WarpFields
from upholster.types import FloatArray

__all__ = ["MOST_CELLS", "CellGrid", "Cells", "carried_waves", "chart_grids", "chart_links"]

IndexArray = NDArray[np.intp]

_LEAST = 3
"""Cells of a chart each way, so that none is beside itself where a chart closes."""

MOST_CELLS = 8192
"""Of a surface, about: more take time, and show no more."""

_HEAVIEST = 1e3
"""Of the weights of links, which have no unit: about 1 between square cells."""


@dataclass(frozen=True, eq=False, slots=True)
class CellGrid:
    """The cells of one chart.

    Attributes
    ----------
    chart, field
        The chart.
    first
        Its first cell's number; the others follow in raster order.
    rows, columns
        How many there are each way.
    matrices
        (rows, columns, 2, 2) M at their centres.
    """

    chart: Chart
    field: WarpField
    first: int
    rows: int
    columns: int
    matrices: FloatArray

    @property
    def size(self) -> tuple[float, float]:
        """Height and width of a cell in texels."""
        return self.chart.height / self.rows, self.chart.width / self.columns

    @property
    def areas(self) -> FloatArray:
        """(rows · columns,) in square pixels, above 0."""
        m, (tall, wide) = self.matrices.reshape(-1, 4), self.size
        determinants = m[:, 0] * m[:, 3] - m[:, 1] * m[:, 2]
        areas: FloatArray = np.maximum(np.abs(determinants), 1e-6) * (tall * wide)
        return areas

    def places(self, ring: int) -> tuple[FloatArray, FloatArray]:
        """Return rows and columns of all its cells' centres, in texels, and of a ring of cells round them."""
        i, j = (np.arange(-ring, count + ring, dtype=np.float64) for count in (self.rows, self.columns))
        rows, columns = np.meshgrid(
            (i + 0.5) * self.size[0] - 0.5, (j + 0.5) * self.size[1] - 0.5, indexing="ij"
        )
        return rows, columns


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """The cells of all charts as columns, so that places on any of them are looked at together.

    Attributes
    ----------
    fields
        The charts' warp fields.
    first, rows, columns
        (charts,) of each chart its first cell, and how many there are each way.
    size
        (charts, 2) height and width of a chart's cells in texels.
    matrices
        (cells, 2, 2) M at their centres.
    """

    fields: WarpFields
    first: IndexArray
    rows: IndexArray
    columns: IndexArray
    size: FloatArray
    matrices: FloatArray

    @classmethod
    def of(cls, grids: Sequence[CellGrid]) -> "Cells":
        """Return the cells of all charts, in their order."""
        first, rows, columns = np.array([(one.first, one.rows, one.columns) for one in grids], np.intp).T
        matrices = np.concatenate([one.matrices.reshape(-1, 2, 2) for one in grids])
        fields = WarpFields.of([one.field for one in grids])
        return cls(fields, first, rows, columns, np.array([one.size for one in grids]), matrices)

    def raster(self, ring: int) -> tuple[IndexArray, IndexArray, IndexArray]:
        """Return chart, row and column of all cells and of a ring round each chart's, chart after chart."""
        wide = self.columns + 2 * ring
        counts = (self.rows + 2 * ring) * wide
        chart = np.repeat(np.arange(len(counts)), counts)
        own = np.arange(len(chart)) - np.repeat(np.cumsum(counts) - counts, counts)
        rows, columns = np.divmod(own, wide[chart])
        return chart, rows - ring, columns - ring

    def centres(self, chart: IndexArray, rows: IndexArray, columns: IndexArray) -> FloatArray:
        """Return centres of cells, (n, 2) in texels."""
        found: FloatArray = (np.stack([rows, columns], axis=1) + 0.5) * self.size[chart] - 0.5
        return found

    def number(self, chart: IndexArray, rows: IndexArray, columns: IndexArray) -> IndexArray:
        """Return the numbers of cells."""
        return self.first[chart] + rows * self.columns[chart] + columns

    def beside(self, chart: IndexArray, edge: IndexArray, along: FloatArray) -> tuple[IndexArray, IndexArray]:
        """Return row and column of the cells at places along edges, see `ChartSeam`."""
        down = edge & 1
        last = np.stack([self.columns[chart], self.rows[chart]], axis=1)[np.arange(len(down)), down] - 1
        at = np.clip((along / self.size[chart, 1 - down]).astype(np.intp), 0, last)
        rows, columns = self.rows[chart] - 1, self.columns[chart] - 1
        across = np.where(edge == 1, columns, np.where(edge == 2, rows, 0))
        return np.where(down == 1, at, across), np.where(down == 1, across, at)

    def at_edge(
        self, chart: IndexArray, edge: IndexArray, line: FloatArray, along: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return places (n, 2) along edges, in texels, and M there."""
        down = edge & 1 == 1
        rows, columns = np.where(down, along - 0.5, line), np.where(down, line, along - 0.5)
        return np.stack([rows, columns], axis=1), self.fields.at(chart, rows, columns)


def chart_grids(charts: Sequence[Chart], fields: Sequence[WarpField], cell: float) -> list[CellGrid]:
    """Return each chart's cells.

    Parameters
    ----------
    charts, fields
        The layout.
    cell
        About the side of a cell in texels.
    """
    texels = sum(chart.height * chart.width for chart in charts)
    cell = max(cell, (texels / MOST_CELLS) ** 0.5)
    grids, first = [], 0
    for chart, field in zip(charts, fields, strict=True):
        rows, columns = (max(_LEAST, round(size / cell)) for size in (chart.height, chart.width))
        down = (np.arange(rows) + 0.5) * (chart.height / rows) - 0.5
        right = (np.arange(columns) + 0.5) * (chart.width / columns) - 0.5
        matrices = field.at(*np.meshgrid(down, right, indexing="ij"))
        grids.append(CellGrid(chart, field, first, rows, columns, matrices))
        first += rows * columns
    return grids


def chart_links(grids: Sequence[CellGrid], transitions: Sequence[Transition], waves: FloatArray) -> Links:
    """Return the links between all cells.

    Parameters
    ----------
    grids
        The cells.
    transitions
        Over all seams, seen from either side; one of the two counts.
    waves
        (n, 2) cycles per exemplar pixel.
    """
    cells, over = Cells.of(grids), TransitionTable.of(transitions)
    seams = [transition.seam for transition in transitions]
    once = [
        (m.chart, m.edge, m.start) <= (m.other_chart, m.other_edge, min(m.other_start, m.other_stop))
        for m in seams
    ]
    chosen = np.flatnonzero(np.array(once, bool))
    return joined_links([_inside(cells, len(waves)), _over(cells, over, chosen, waves)])


def carried_waves(
    cells: Cells, over: TransitionTable, which: IndexArray, waves: FloatArray, places: FloatArray
) -> tuple[FloatArray, NDArray[np.int8]]:
    """Carry places beyond edges of charts to the charts that lie there.

    Parameters
    ----------
    cells
        Of all charts.
    over, which
        Transitions, and which of them (m,) each place is carried over by.
    waves
        (n, 2) cycles per exemplar pixel.
    places
        (m, 2) rows and columns in texels of the first chart.

    Returns
    -------
    places
        (m, 2) in texels of the second chart; 0 where nothing goes on.
    goes_on
        (m, 2n) int8: see `Links.goes_on`.
    """
    rows, columns, carried = over.apply(which, *places.T)
    sound: NDArray[np.bool_] = np.asarray(np.isfinite(carried).all(axis=(1, 2)))
    chart, edge, start, stop = over.chart[which], over.edge[which], over.start[which], over.stop[which]
    other_start, other_stop = over.other_start[which], over.other_stop[which]
    foot = np.clip(places[np.arange(len(places)), 1 - (edge & 1)] + 0.5, start, stop)
    other_foot = other_start + (foot - start) * (other_stop - other_start) / (stop - start)
    _, before = cells.at_edge(chart, edge, over.line[which], foot)
    _, after = cells.at_edge(
        over.other_chart[which], over.other_edge[which], over.other_line[which], other_foot
    )
    goes_on = matched_waves(waves, before, after @ np.where(sound[:, None, None], carried, 0.0))
    goes_on[~sound] = -1
    return np.where(sound[:, None], np.stack([rows, columns], axis=1), 0.0), goes_on


def _inside(cells: Cells, count: int) -> Links:
    # Links within charts: of each chart those down, then those to the right.
    chart, rows, columns = cells.raster(0)
    down, right = (
        np.flatnonzero(at < last[chart] - 1) for at, last in ((rows, cells.rows), (columns, cells.columns))
    )
    first, axis = np.concatenate([down, right]), np.repeat((0, 1), (len(down), len(right)))
    order = np.argsort(chart[first], kind="stable")
    first, axis = first[order], axis[order]
    own = chart[first]
    second = first + np.where(axis == 0, cells.columns[own], 1)
    mean = 0.5 * (cells.matrices[first] + cells.matrices[second])
    step = mean[np.arange(len(axis)), :, axis] * cells.size[own, axis][:, None]
    area = np.abs(mean[:, 0, 0] * mean[:, 1, 1] - mean[:, 0, 1] * mean[:, 1, 0])
    weights = _weights(cells.size[own, 0] * cells.size[own, 1] * area, (step**2).sum(axis=1))
    all_go_on = np.broadcast_to(np.arange(2 * count, dtype=np.int8), (len(step), 2 * count))
    return Links(first.astype(np.int32), second.astype(np.int32), 0.5 * step, 0.5 * step, weights, all_go_on)


def _over(cells: Cells, over: TransitionTable, chosen: IndexArray, waves: FloatArray) -> Links:
    # Links over some seams: one for each piece of them on which two cells meet.
    which, middle, length = _pieces(cells, over, chosen)
    here, edge = over.chart[which], over.edge[which]
    there, other_edge = over.other_chart[which], over.other_edge[which]
    start, other_start = over.start[which], over.other_start[which]
    slope = (over.other_stop[which] - other_start) / (over.stop[which] - start)
    other_middle = other_start + slope * (middle - start)
    a, b = cells.beside(here, edge, middle), cells.beside(there, other_edge, other_middle)
    place, before = cells.at_edge(here, edge, over.line[which], middle)
    other_place, after = cells.at_edge(there, other_edge, over.other_line[which], other_middle)
    first, second = cells.number(here, *a), cells.number(there, *b)
    from_a = _read(cells.matrices[first], before, place - cells.centres(here, *a))
    to_b = _read(cells.matrices[second], after, cells.centres(there, *b) - other_place)
    carried = over.matrices_at(which, middle)
    # Where a chart is degenerate nothing is known of what lies beyond: no wave goes on.
    carried = np.where(np.isfinite(carried), carried, 0.0)
    goes_on = matched_waves(waves, before, after @ carried)
    side = np.sqrt((_along(before, edge) ** 2).sum(axis=1)) * length
    # Straight across: what lies aslant of a short piece is no farther away.
    away = _across(before, edge, cells.size[here]) + _across(after, other_edge, cells.size[there])
    weights = _weights(side * away, away**2)
    return Links(first.astype(np.int32), second.astype(np.int32), from_a, to_b, weights, goes_on)


def _pieces(
    cells: Cells, over: TransitionTable, chosen: IndexArray
) -> tuple[IndexArray, FloatArray, FloatArray]:
    # Where along seams cells of either chart begin or end, and the seams themselves: of each piece between
    # its transition, its middle and its length.
    size = cells.size[over.chart[chosen], 1 - over.edge[chosen] % 2]
    other_size = cells.size[over.other_chart[chosen], 1 - over.other_edge[chosen] % 2]
    start, stop = over.start[chosen], over.stop[chosen]
    other_start, other_stop = over.other_start[chosen], over.other_stop[chosen]
    mine, own = _multiples(start, stop, size)
    theirs, others = _multiples(
        np.minimum(other_start, other_stop), np.maximum(other_start, other_stop), other_size
    )
    shares = (others - other_start[theirs]) / (other_stop - other_start)[theirs]
    met = start[theirs] + shares * (stop - start)[theirs]
    both = np.arange(len(chosen))
    seam, ends = np.concatenate([mine, theirs, both, both]), np.concatenate([own, met, start, stop])
    ends = np.clip(ends, start[seam], stop[seam])
    order = np.lexsort((ends, seam))
    seam, ends = seam[order], ends[order]
    step = np.diff(ends, prepend=0.0)
    kept = (np.diff(seam, prepend=-1) > 0) | (step > 1e-6 * size[seam])
    seam, ends = seam[kept], ends[kept]
    piece = np.flatnonzero(seam[1:] == seam[:-1])
    return chosen[seam[piece]], 0.5 * (ends[piece + 1] + ends[piece]), ends[piece + 1] - ends[piece]


def _multiples(low: FloatArray, high: FloatArray, size: FloatArray) -> tuple[IndexArray, FloatArray]:
    # The multiples of sizes (n,) from low to high: which of the n each is of, and itself.
    first = np.ceil(low / size).astype(np.intp)
    counts = np.maximum(0, np.floor(high / size).astype(np.intp) + 1 - first)
    which = np.repeat(np.arange(len(size)), counts)
    own = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    return which, (first[which] + own) * size[which]


def _along(matrices: FloatArray, edge: IndexArray) -> FloatArray:
    # What a step along an edge is in pixels, (n, 2), where M is as given.
    return np.where((edge & 1 == 1)[:, None], matrices[:, :, 0], matrices[:, :, 1])


def _across(matrices: FloatArray, edge: IndexArray, size: FloatArray) -> FloatArray:
    # How far the middles of cells lie from edges of their charts, in pixels, where M is as given.
    m = matrices.reshape(-1, 4)
    areas = np.abs(m[:, 0] * m[:, 3] - m[:, 1] * m[:, 2])
    depth = 0.5 * size[np.arange(len(edge)), edge & 1]
    length = np.sqrt((_along(matrices, edge) ** 2).sum(axis=1))
    across: FloatArray = depth * areas / np.maximum(length, 1e-6)
    return across


def _weights(area: FloatArray, squared: FloatArray) -> FloatArray:
    weights: FloatArray = np.clip(area / np.maximum(squared, 1e-12), 1 / _HEAVIEST, _HEAVIEST)
    return weights


def _read(own: FloatArray, there: FloatArray, steps: FloatArray) -> FloatArray:
    # Steps (n, 2) between two places, in pixels: M is linear between.
    read: FloatArray = (0.5 * (own + there) @ steps[:, :, None])[:, :, 0]
    return read
