"""The wanted phase of a repeating texture, anywhere on a surface's charts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts._multigrid_kernels import ComplexArray
from upholster.charts.phases.calming import calmed
from upholster.charts.phases.chart_cells import CellGrid, Cells, carried_waves, chart_grids, chart_links
from upholster.charts.phases.solving import solved_phases, turned
from upholster.charts.transitions import Transition, TransitionTable
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import WarpField
from upholster.types import FloatArray

__all__ = ["RING", "TURN", "PhaseField", "StraightPhases", "phase_field", "phase_units", "ringed_phases"]

TURN = 65536
"""Units of a phase in a turn: phases are int16, and wrap as they do."""

RING = 4
"""Cells beyond a chart's edges that have a phase: a block's side, where cells are a quarter of it."""


_NEAR = 2
"""Of these, those that blocks look at to see how waves are stretched round a chart."""


@dataclass(frozen=True, eq=False, slots=True)
class PhaseField:
    """Phases of waves over charts.

    Attributes
    ----------
    waves
        (n, 2) cycles per exemplar pixel.
    grids
        Each chart's cells.
    phases
        (n, cells) complex: the waves' phases at the cells' centres; small near the end of a course.
    ringed
        Each chart's phases, (n, rows + 2 · `RING`, columns + 2 · `RING`): its cells, and as many beyond each
        edge, which have the phases that the neighbours want there.
    """

    waves: FloatArray
    grids: tuple[CellGrid, ...]
    phases: ComplexArray
    ringed: tuple[ComplexArray, ...]

    def at(self, chart: int, rows: FloatArray, columns: FloatArray) -> NDArray[np.int16]:
        """Return the phases at places on a chart, and beyond its edges, as far as blocks reach.

        Parameters
        ----------
        chart
            Which one.
        rows, columns
            (m,) in texels.

        Returns
        -------
        ndarray
            (n, m) int16, in 1/65536 turn.
        """
        grid, own = self.grids[chart], self.ringed[chart]
        (tall, wide), (_, down, right) = grid.size, own.shape
        matrices = grid.field.at(rows, columns)
        i, below = _between((rows + 0.5) / tall - 0.5 + RING, down)
        j, beside = _between((columns + 0.5) / wide - 0.5 + RING, right)
        # The four cells round each place, (4, m).
        i, j = i + np.array([[0], [0], [1], [1]]), j + np.array([[0], [1], [0], [1]])
        weights = np.array([1 - below, 1 - below, below, below]) * np.array([1 - beside, beside] * 2)
        middle = (i - RING + 0.5) * tall - 0.5, (j - RING + 0.5) * wide - 0.5
        step = np.stack([rows - middle[0], columns - middle[1]], axis=2)
        read = (0.5 * (grid.field.at(*middle) + matrices) @ step[..., None])[..., 0]
        gone_on = turned(self.waves @ read.reshape(-1, 2).T).reshape(len(self.waves), *i.shape)
        total = (weights * own[:, i, j] * gone_on).sum(axis=1)
        return phase_units(_jump(total))

    @property
    def ends(self) -> int:
        """How many courses end inside charts: places round which a phase does not close."""
        found = 0
        for grid in self.grids:
            own = self.phases[:, grid.first : grid.first + grid.rows * grid.columns]
            own = own.reshape(-1, grid.rows, grid.columns)
            found += int(self._ends(grid, own, grid.matrices).sum())
        return found

    def ends_on(self, chart: int) -> NDArray[np.intp]:
        """Return how many courses of each wave, (n,), end on a chart or over its edges, but for corners."""
        grid, near = self.grids[chart], slice(RING - 1, 1 - RING)
        ends = self._ends(grid, self.ringed[chart][:, near, near], grid.field.at(*grid.places(1)))
        # Beyond corners surfaces unfold in more than one way.
        ends[:, [[0], [-1]], [0, -1]] = 0
        count: NDArray[np.intp] = ends.sum(axis=(1, 2))
        return count

    def _ends(self, grid: CellGrid, own: ComplexArray, matrices: FloatArray) -> NDArray[np.intp]:
        # How many courses end between each four cells, (n, rows - 1, columns - 1): parameters as of `steps`.
        down, right = (turns + missing for turns, missing, _ in self.steps(grid, own, matrices))
        around = right[:, :-1] + down[:, :, 1:] - right[:, 1:] - down[:, :, :-1]
        ends: NDArray[np.intp] = np.abs(np.rint(around)).astype(np.intp)
        return ends

    def strain(self, chart: int, shares: Sequence[float]) -> list[float]:
        """Return by how much waves are stretched on a chart and round it, in cycles per pixel.

        Parameters
        ----------
        chart
            Which one.
        shares
            0 to 1: which quantiles are meant, each of the most strained wave.
        """
        grid = self.grids[chart]
        i, j = (np.arange(-_NEAR, count + _NEAR) for count in (grid.rows, grid.columns))
        near = slice(RING - _NEAR, _NEAR - RING)
        steps = self.steps(grid, self.ringed[chart][:, near, near], grid.field.at(*grid.places(_NEAR)))
        down, right = (np.abs(missing) / length for _, missing, length in steps)
        # Not at corners, beyond which surfaces unfold in more than one way.
        inside = [(k >= 0) & (k < count) for k, count in ((i, grid.rows), (j, grid.columns))]
        sound = inside[0][:, None] | inside[1]
        down, right = down[:, sound[1:] & sound[:-1]], right[:, sound[:, 1:] & sound[:, :-1]]
        found: list[float] = (
            np.quantile(np.concatenate([down, right], axis=1), shares, axis=1).max(axis=1).tolist()
        )
        return found

    def steps(
        self, grid: CellGrid, own: ComplexArray, matrices: FloatArray
    ) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
        """Tell of the steps down, and of those to the right, from each cell to the next.

        Parameters
        ----------
        grid
            The chart's cells.
        own, matrices
            (n, rows, columns) phases and (rows, columns, 2, 2) M, of its cells, or of a ring round them too.

        Returns
        -------
        list
            For steps down and to the right: turns (n, rows, columns) by the warp field, turns that are
            missing to reach the next cell's phase, and lengths (rows, columns) in pixels.
        """
        found = []
        for axis in (0, 1):
            first = (np.s_[:-1], np.s_[:]) if axis == 0 else (np.s_[:], np.s_[:-1])
            second = (np.s_[1:], np.s_[:]) if axis == 0 else (np.s_[:], np.s_[1:])
            step = 0.5 * grid.size[axis] * (matrices[first] + matrices[second])[..., axis]
            turns = np.einsum("ka,ija->kij", self.waves, step)
            missing = own[:, *second] * np.conj(own[:, *first] * turned(turns))
            length = np.maximum(np.sqrt((step**2).sum(axis=2)), 1e-6)
            found.append((turns, _jump(missing), length))
        return found


@dataclass(frozen=True, eq=False, slots=True)
class StraightPhases:
    """Phases on a flat texture: the same waves everywhere.

    Attributes
    ----------
    waves
        (n, 2) cycles per texel.
    """

    waves: FloatArray

    def at(self, _chart: int, rows: FloatArray, columns: FloatArray) -> NDArray[np.int16]:
        """Return the phases at places (m,) of the only chart, as `PhaseField.at` does."""
        return phase_units(self.waves @ np.stack([rows, columns]))


def phase_units(turns: FloatArray) -> NDArray[np.int16]:
    """Return phases, in turns, in 1/65536 turn."""
    return np.rint(TURN * (turns - np.rint(turns))).astype(np.int64).astype(np.int16)


def _gone_on(
    cells: Cells, waves: FloatArray, phases: ComplexArray, chart: NDArray[np.intp], places: FloatArray
) -> ComplexArray:
    # Phases (n, m) at places (m, 2) on charts (m,): those of the nearest cells go on by the warp fields.
    at = np.rint((places + 0.5) / cells.size[chart] - 0.5).astype(np.intp)
    i, j = np.clip(at.T, 0, (cells.rows[chart] - 1, cells.columns[chart] - 1))
    nearest = cells.number(chart, i, j)
    step = places - (np.stack([i, j], axis=1) + 0.5) * cells.size[chart] + 0.5
    matrices = 0.5 * (cells.matrices[nearest] + cells.fields.at(chart, *places.T))
    found: ComplexArray = phases[:, nearest] * turned(waves @ (matrices @ step[:, :, None])[:, :, 0].T)
    return found


def _between(places: FloatArray, count: int) -> tuple[NDArray[np.intp], FloatArray]:
    # The first of the two cells between whose centres places lie, and the second one's share.
    places = np.clip(places, 0, count - 1)
    first = np.minimum(places.astype(np.intp), count - 2)
    return first, places - first


def _jump(z: ComplexArray) -> FloatArray:
    turns: FloatArray = np.arctan2(z.imag, z.real) / (2 * np.pi)
    return turns


def phase_field(
    charts: Sequence[Chart],
    fields: Sequence[WarpField],
    transitions: Sequence[Transition],
    waves: FloatArray,
    cell: float,
    *,
    calm: bool = False,
) -> PhaseField:
    """Find the phases that follow the warp fields best and close over seams.

    Parameters
    ----------
    charts, fields
        The layout.
    transitions
        Over all its seams.
    waves
        (n, 2) cycles per exemplar pixel.
    cell
        About the side of a cell in texels.
    calm
        Whether warp fields are turned first where directions turn too fast for courses, see `calmed`; the
        field's grids have them.
    """
    grids = chart_grids(charts, fields, cell)
    links = chart_links(grids, transitions, waves)
    calmer = calmed(grids, links, waves) if calm else [grid.field for grid in grids]
    if any(field is not grid.field for field, grid in zip(calmer, grids, strict=True)):
        grids = chart_grids(charts, calmer, cell)
        links = chart_links(grids, transitions, waves)
    areas = np.concatenate([grid.areas for grid in grids])
    phases = solved_phases(links, areas, waves)
    return PhaseField(waves, tuple(grids), phases, ringed_phases(grids, transitions, waves, phases))


def ringed_phases(
    grids: Sequence[CellGrid], transitions: Sequence[Transition], waves: FloatArray, phases: ComplexArray
) -> tuple[ComplexArray, ...]:
    """Return each chart's phases with those of a ring of cells round it, see `PhaseField`."""
    cells, over = Cells.of(grids), TransitionTable.of(transitions)
    chart, i, j = cells.raster(RING)
    outside = (i < 0) | (i >= cells.rows[chart]) | (j < 0) | (j >= cells.columns[chart])
    ringed = np.empty((len(waves), len(chart)), np.complex128)
    ringed[:, ~outside] = phases
    places = cells.centres(chart[outside], i[outside], j[outside])
    ringed[:, outside] = _beyond(cells, over, waves, phases, chart[outside], places)
    stops = np.cumsum(np.bincount(chart, minlength=len(grids)))
    parts = np.split(ringed, stops[:-1], axis=1)
    return tuple(
        part.reshape(len(waves), grid.rows + 2 * RING, grid.columns + 2 * RING)
        for part, grid in zip(parts, grids, strict=True)
    )


def _beyond(
    cells: Cells,
    over: TransitionTable,
    waves: FloatArray,
    phases: ComplexArray,
    chart: NDArray[np.intp],
    places: FloatArray,
) -> ComplexArray:
    # Phases (n, m) at places (m, 2) beyond the edges of charts (m,): what the charts there want. Where there
    # is none, or where a wave does not go on, they go on by the chart's own warp field.
    found = _gone_on(cells, waves, phases, chart, places)
    nearest = _nearest_seams(cells, over, chart, places)
    at = np.flatnonzero(nearest >= 0)
    beyond, goes_on = carried_waves(cells, over, nearest[at], waves, places[at])
    onward = _gone_on(cells, waves, phases, over.other_chart[nearest[at]], beyond)
    onward = np.concatenate([onward, np.conj(onward)])
    wave, place = np.nonzero(goes_on.T[: len(waves)] >= 0)
    found[wave, at[place]] = onward[goes_on[place, wave], place]
    return found


def _nearest_seams(
    cells: Cells, over: TransitionTable, chart: NDArray[np.intp], places: FloatArray
) -> NDArray[np.intp]:
    # Which of its chart's seams is nearest to places beyond the edges, in cells; −1 where there is none.
    found, least = np.full(len(places), -1, np.intp), np.full(len(places), np.inf)
    order = np.argsort(over.chart, kind="stable")
    counts = np.bincount(over.chart, minlength=len(cells.rows))
    first = np.cumsum(counts) - counts
    for k in range(int(counts.max())):
        at = np.flatnonzero(counts[chart] > k)
        own, n = chart[at], order[first[chart[at]] + k]
        down, line = over.edge[n] & 1, over.line[n]
        across, along = places[at, down], places[at, 1 - down] + 0.5
        depth = np.abs(across - line) / cells.size[own, down]
        aside = np.abs(along - np.clip(along, over.start[n], over.stop[n])) / cells.size[own, 1 - down]
        beyond = (across < line) == ((over.edge[n] == 0) | (over.edge[n] == 3))
        away = np.where(beyond, depth + aside, np.inf)
        nearer = away < least[at] - 1e-9
        found[at[nearer]], least[at[nearer]] = n[nearer], away[nearer]
    return found
