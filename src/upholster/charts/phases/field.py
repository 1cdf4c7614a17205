"""The wanted phase of a repeating texture, anywhere on a surface's charts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts._multigrid_kernels import ComplexArray
from upholster.charts.phases.chart_cells import CellGrid, chart_grids, chart_links
from upholster.charts.phases.solving import solved_phases, turned
from upholster.charts.seams import Transition
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import WarpField
from upholster.types import FloatArray

__all__ = ["TURN", "PhaseField", "StraightPhases", "phase_field", "phase_units"]

TURN = 65536
"""Units of a phase in a turn: phases are int16, and wrap as they do."""


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
    """

    waves: FloatArray
    grids: tuple[CellGrid, ...]
    phases: ComplexArray

    def at(self, chart: int, rows: FloatArray, columns: FloatArray) -> NDArray[np.int16]:
        """Return the phases at places on a chart, and beyond its edges, where they go on by its warp field.

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
        grid = self.grids[chart]
        (tall, wide), own = grid.size, self.phases[:, grid.first : grid.first + grid.rows * grid.columns]
        matrices, flat = grid.field.at(rows, columns), grid.matrices.reshape(-1, 2, 2)
        i, down = _between((rows + 0.5) / tall - 0.5, grid.rows)
        j, right = _between((columns + 0.5) / wide - 0.5, grid.columns)
        total = np.zeros((len(self.waves), len(rows)), np.complex128)
        for a, b in ((0, 0), (0, 1), (1, 0), (1, 1)):
            cell = (i + a) * grid.columns + j + b
            step = np.stack([rows, columns], axis=1) - grid.centres(cell)
            read = (0.5 * (flat[cell] + matrices) @ step[:, :, None])[:, :, 0]
            weight = (down if a else 1 - down) * (right if b else 1 - right)
            total += weight * own[:, cell] * turned(self.waves @ read.T)
        return phase_units(_jump(total))

    @property
    def ends(self) -> int:
        """How many courses end inside charts: places round which a phase does not close."""
        found = 0
        for grid in self.grids:
            down, right = (turns + missing for turns, missing, _ in self._steps(grid))
            around = right[:, :-1] + down[:, :, 1:] - right[:, 1:] - down[:, :, :-1]
            found += int(np.abs(np.rint(around)).sum())
        return found

    def strain(self, share: float) -> float:
        """Return by how much waves are stretched, in cycles per pixel: the most strained wave's quantile."""
        found: list[list[FloatArray]] = [[] for _ in self.waves]
        for grid in self.grids:
            for _, missing, length in self._steps(grid):
                for k, wave in enumerate(found):
                    wave.append((np.abs(missing[k]) / length).reshape(-1))
        return max(float(np.quantile(np.concatenate(wave), share)) for wave in found)

    def _steps(self, grid: CellGrid) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
        # Down and to the right, from each cell to the next: turns (n, rows, columns) by the warp field, what
        # is missing, and the way in pixels.
        own = self.phases[:, grid.first : grid.first + grid.rows * grid.columns]
        own = own.reshape(-1, grid.rows, grid.columns)
        found = []
        for axis in (0, 1):
            first = (np.s_[:-1], np.s_[:]) if axis == 0 else (np.s_[:], np.s_[:-1])
            second = (np.s_[1:], np.s_[:]) if axis == 0 else (np.s_[:], np.s_[1:])
            step = 0.5 * grid.size[axis] * (grid.matrices[first] + grid.matrices[second])[..., axis]
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
    """
    grids = chart_grids(charts, fields, cell)
    areas = np.concatenate([grid.areas for grid in grids])
    return PhaseField(
        waves, tuple(grids), solved_phases(chart_links(grids, transitions, waves), areas, waves)
    )
