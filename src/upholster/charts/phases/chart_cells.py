"""Cells of charts: even grids, linked inside each chart and over seams.

All lengths are exemplar pixels, for a chart's warp field holds the surface's metric; nothing is asked of the
surface itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts.phases.links import Links, joined_links, matched_waves
from upholster.charts.seams import SAMPLES, ChartSeam, Transition
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import WarpField
from upholster.types import FloatArray

__all__ = ["MOST_CELLS", "CellGrid", "carried_waves", "chart_grids", "chart_links"]

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

    def centres(self, cells: NDArray[np.intp]) -> FloatArray:
        """Return the centres (n, 2), in texels, of some of its cells, counted from its first."""
        at = np.stack([cells // self.columns, cells % self.columns], axis=1)
        centres: FloatArray = (at + 0.5) * np.array(self.size) - 0.5
        return centres

    def places(self, ring: int) -> tuple[FloatArray, FloatArray]:
        """Return rows and columns of all its cells' centres, in texels, and of a ring of cells round them."""
        i, j = (np.arange(-ring, count + ring, dtype=np.float64) for count in (self.rows, self.columns))
        rows, columns = np.meshgrid(
            (i + 0.5) * self.size[0] - 0.5, (j + 0.5) * self.size[1] - 0.5, indexing="ij"
        )
        return rows, columns

    def beside(self, edge: int, along: FloatArray) -> NDArray[np.intp]:
        """Return which cells lie at places along an edge, see `upholster.charts.seams.ChartSeam`."""
        size, count = (self.size[0], self.rows) if edge & 1 else (self.size[1], self.columns)
        at = np.clip((along / size).astype(np.intp), 0, count - 1)
        across = (0, self.columns - 1, self.rows - 1, 0)[edge]
        return at * self.columns + across if edge & 1 else across * self.columns + at


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
    found = [_inside(grid, axis, len(waves)) for grid in grids for axis in (0, 1)]
    for transition in transitions:
        m = transition.seam
        if (m.chart, m.edge, m.start) <= (m.other_chart, m.other_edge, min(m.other_start, m.other_stop)):
            found.append(_over(grids[m.chart], grids[m.other_chart], transition, waves))
    return joined_links(found)


def carried_waves(
    here: CellGrid, there: CellGrid, transition: Transition, waves: FloatArray, places: FloatArray
) -> tuple[FloatArray, NDArray[np.int8]]:
    """Carry places beyond an edge of a chart to the chart that lies there.

    Parameters
    ----------
    here, there
        The two charts.
    transition
        From the first to the second.
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
    m = transition.seam
    rows, columns, carried = transition.apply(*places.T)
    sound: NDArray[np.bool_] = np.asarray(np.isfinite(carried).all(axis=(1, 2)))
    foot = np.clip(places[:, 1 - (m.edge & 1)] + 0.5, m.start, m.stop)
    other_foot = m.other_start + (foot - m.start) * (m.other_stop - m.other_start) / (m.stop - m.start)
    _, before = _at_edge(here, m.edge, transition.line, foot)
    _, after = _at_edge(there, m.other_edge, transition.other_line, other_foot)
    goes_on = matched_waves(waves, before, after @ np.where(sound[:, None, None], carried, 0.0))
    goes_on[~sound] = -1
    return np.where(sound[:, None], np.stack([rows, columns], axis=1), 0.0), goes_on


def _inside(grid: CellGrid, axis: int, count: int) -> Links:
    # Links down (axis 0) or to the right (axis 1) within a chart.
    last = grid.first + grid.rows * grid.columns
    number = np.arange(grid.first, last, dtype=np.int32).reshape(grid.rows, grid.columns)
    low = (slice(None, -1), slice(None)) if axis == 0 else (slice(None), slice(None, -1))
    high = (slice(1, None), slice(None)) if axis == 0 else (slice(None), slice(1, None))
    mean = (0.5 * (grid.matrices[low] + grid.matrices[high])).reshape(-1, 2, 2)
    step = mean[:, :, axis] * grid.size[axis]
    side = grid.size[0] * grid.size[1] * np.abs(mean[:, 0, 0] * mean[:, 1, 1] - mean[:, 0, 1] * mean[:, 1, 0])
    weights = _weights(side, (step**2).sum(axis=1))
    all_go_on = np.broadcast_to(np.arange(2 * count, dtype=np.int8), (len(step), 2 * count))
    return Links(
        number[low].reshape(-1), number[high].reshape(-1), 0.5 * step, 0.5 * step, weights, all_go_on
    )


def _over(here: CellGrid, there: CellGrid, transition: Transition, waves: FloatArray) -> Links:
    # Links over a seam: one for each piece of it on which two cells meet.
    m = transition.seam
    slope = (m.other_stop - m.other_start) / (m.stop - m.start)
    ends = _ends(m, here.size[1 - m.edge % 2], there.size[1 - m.other_edge % 2])
    middle, length = 0.5 * (ends[1:] + ends[:-1]), np.diff(ends)
    other_middle = m.other_start + slope * (middle - m.start)
    a, b = here.beside(m.edge, middle), there.beside(m.other_edge, other_middle)
    place, before = _at_edge(here, m.edge, transition.line, middle)
    other_place, after = _at_edge(there, m.other_edge, transition.other_line, other_middle)
    from_a = _read(here, a, before, place - here.centres(a))
    to_b = _read(there, b, after, there.centres(b) - other_place)
    carried = _matrices(transition, middle)
    # Where a chart is degenerate nothing is known of what lies beyond: no wave goes on.
    carried = np.where(np.isfinite(carried), carried, 0.0)
    goes_on = matched_waves(waves, before, after @ carried)
    along = before[:, :, 0 if m.edge & 1 else 1]
    side = np.sqrt((along**2).sum(axis=1)) * length
    # Straight across: what lies aslant of a short piece is no farther away.
    away = _across(before, m.edge, here.size) + _across(after, m.other_edge, there.size)
    return Links(
        (here.first + a).astype(np.int32),
        (there.first + b).astype(np.int32),
        from_a,
        to_b,
        _weights(side * away, away**2),
        goes_on,
    )


def _ends(seam: ChartSeam, size: float, other_size: float) -> FloatArray:
    # Where along a seam cells of either chart, of these sizes, begin or end; and the seam itself.
    low, high = sorted((seam.other_start, seam.other_stop))
    own = np.arange(np.ceil(seam.start / size), np.floor(seam.stop / size) + 1) * size
    others = np.arange(np.ceil(low / other_size), np.floor(high / other_size) + 1) * other_size
    shares = (others - seam.other_start) / (seam.other_stop - seam.other_start)
    ends = np.concatenate([own, seam.start + shares * (seam.stop - seam.start), (seam.start, seam.stop)])
    ends = np.unique(np.clip(ends, seam.start, seam.stop))
    found: FloatArray = ends[np.diff(ends, prepend=-np.inf) > 1e-6 * size]
    return found


def _across(matrices: FloatArray, edge: int, size: tuple[float, float]) -> FloatArray:
    # How far the middles of a chart's cells lie from its edge, in pixels, where M is as given.
    m = matrices.reshape(-1, 4)
    areas = np.abs(m[:, 0] * m[:, 3] - m[:, 1] * m[:, 2])
    along = m[:, 0::2] if edge & 1 else m[:, 1::2]
    depth = 0.5 * size[edge & 1]
    across: FloatArray = depth * areas / np.maximum(np.sqrt((along**2).sum(axis=1)), 1e-6)
    return across


def _weights(area: FloatArray, squared: FloatArray) -> FloatArray:
    weights: FloatArray = np.clip(area / np.maximum(squared, 1e-12), 1 / _HEAVIEST, _HEAVIEST)
    return weights


def _at_edge(grid: CellGrid, edge: int, line: float, along: FloatArray) -> tuple[FloatArray, FloatArray]:
    # Places (n, 2) along an edge, in texels, and M there.
    across = np.full(len(along), line)
    rows, columns = (along - 0.5, across) if edge & 1 else (across, along - 0.5)
    return np.stack([rows, columns], axis=1), grid.field.at(rows, columns)


def _read(grid: CellGrid, cells: NDArray[np.intp], matrices: FloatArray, steps: FloatArray) -> FloatArray:
    # Steps (n, 2) between cells' centres and places with given M, in pixels.
    mean = 0.5 * (grid.matrices.reshape(-1, 2, 2)[cells] + matrices)
    read: FloatArray = (mean @ steps[:, :, None])[:, :, 0]
    return read


def _matrices(transition: Transition, along: FloatArray) -> FloatArray:
    # The transition's matrices at places along its seam, linear between its samples.
    m = transition.seam
    place = np.clip((along - m.start) / (m.stop - m.start), 0.0, 1.0) * (SAMPLES - 1)
    first = np.minimum(place.astype(np.intp), SAMPLES - 2)
    weight = (place - first)[:, None, None]
    matrices: FloatArray = (1.0 - weight) * transition.matrices[first] + weight * transition.matrices[
        first + 1
    ]
    return matrices
