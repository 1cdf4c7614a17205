"""Phases over a charted surface: cells are pieces of it with nearly constant directions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import ComplexArray, FloatArray, IntArray
from upholster.base.vectors import unit_vectors
from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.mesh_warp_fields import triangle_frames
from upholster.charts.phases._kernels import first_members, nearest_parts
from upholster.charts.phases.links import Links, matched_waves
from upholster.charts.phases.phase_solution import solved_phases, unit_phases
from upholster.charts.size_map import SizeField
from upholster.charts.subdivision import Subdivided, subdivided
from upholster.runtime.stages import stage

__all__ = [
    "TURN",
    "Cells",
    "PhaseField",
    "cells_of",
    "edges_at",
    "in_units",
    "links_of",
    "phase_field",
    "turns_of",
]

TURN = 65536
"""Units of a phase per turn: phases are int16, and wrap around with them."""

_SIDE = 0.7
"""Side of a cell, in periods of the fastest wave: courses that end do so within two cells."""

_MOST_CELLS = 6000
"""Approximate greatest number of cells of a surface: more take time without a visible gain."""

_LONGEST = 2.5
"""Longest edge of a triangle, in sides of a cell."""

_JUMP = 0.5
"""Cosine between the directions of two triangles below which they are not in one cell."""

_HEAVIEST = 1e3
"""Upper limit of the weights of links, which have no unit."""


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """Connected pieces of a surface whose triangles are cut into parts, none of which is longer than a cell.

    Attributes
    ----------
    firsts
        (T + 1,) int32: the first part of each triangle; its last part precedes the next one's first.
    middles
        (parts, 3) points.
    own
        (parts, 2, 3) exemplar pixels per model unit: down the sample's columns, and along its rows.
    cell
        (parts,) int32: the cell of each part.
    centres, axes
        (cells, 3) and (cells, 2, 3): means of their parts' middles and axes.
    areas
        (cells,) square exemplar pixels.
    """

    firsts: IntArray
    middles: FloatArray
    own: FloatArray
    cell: IntArray
    centres: FloatArray
    axes: FloatArray
    areas: FloatArray

    def turns(
        self, part: IntArray, points: FloatArray, waves: FloatArray, phases: ComplexArray
    ) -> FloatArray:
        """Return the turns (n, m) of waves (n, 2) at points (m, 3) in parts (m,).

        `phases` (n, cells) are those at the cells' centres.
        """
        cell = self.cell[part]
        read = product(0.5 * (self.axes[cell] + self.own[part]), points - self.centres[cell])
        found: FloatArray = turns_of(phases[:, cell]) + waves @ read.T
        return found


@dataclass(frozen=True, eq=False, slots=True)
class PhaseField:
    """Phases of waves over a charted surface.

    Attributes
    ----------
    waves
        (n, 2) cycles per exemplar pixel.
    cells
        The pieces of the surface.
    phases
        (n, cells) complex: the phases at the centres; small near the end of a course.
    missing
        (n, links) cycles per exemplar pixel, at least 0, by which waves are stretched from a cell to the
        next; 0 where they do not continue.
    areas
        (links,) share of the surface between the two cells, without a unit.
    """

    waves: FloatArray
    cells: Cells
    phases: ComplexArray
    missing: FloatArray
    areas: FloatArray

    def at(self, triangles: IntArray, points: FloatArray) -> NDArray[np.int16]:
        """Return the phases at points (m, 3) in triangles (m,): (n, m) int16, in 1/65536 turn."""
        part = np.empty(len(triangles), np.int32)
        triangles, points = np.ascontiguousarray(triangles, np.int32), np.ascontiguousarray(points)
        nearest_parts(self.cells.firsts, self.cells.middles, triangles, points, part)
        return in_units(self.cells.turns(part, points, self.waves, self.phases))

    def strain(self, share: float) -> float:
        """Return the greatest stretch of waves on a share (0 to 1) of the surface, in cycles per pixel."""
        missing = self.missing.max(axis=0, initial=0.0)
        if not len(missing):
            return 0.0
        order = np.argsort(missing, kind="stable")
        below = np.cumsum(self.areas[order])
        at = int(np.searchsorted(below, share * below[-1]))
        return float(missing[order[min(at, len(order) - 1)]])


@stage
def phase_field(
    surface: ChartedSurface,
    vectors: FloatArray,
    scale: float,
    waves: FloatArray,
    sizes: SizeField | None = None,
) -> PhaseField:
    """Find the phases that follow a surface's directions best.

    Over an edge at which directions jump by quarter turns, a wave continues as its opposite or as another
    wave; otherwise it starts with an independent phase.

    Parameters
    ----------
    surface
        The surface; triangles on no chart are left out.
    vectors
        (T, 3, 3), unit vectors at the triangles' corners: the direction of the exemplar's rows.
    scale
        Exemplar pixels per model unit.
    waves
        (n, 2) cycles per exemplar pixel.
    sizes
        Factors of the sample's size; None: 1.
    """
    period = 1 / float(np.sqrt((waves**2).sum(axis=1).max()))
    area = float(surface.mesh.areas[surface.chart >= 0].sum())
    smallest = 1.0 if sizes is None else sizes.least
    side = max(_SIDE * period / scale * smallest, (area / _MOST_CELLS) ** 0.5)
    fine = subdivided(surface, vectors, _LONGEST * side)
    cells = cells_of(fine, side, scale, sizes)
    links = links_of(fine.surface, cells, waves)
    phases = solved_phases(links, cells.areas, waves)
    missing, between = _strains(links, waves, phases)
    return PhaseField(waves, cells, phases, missing, between)


def cells_of(fine: Subdivided, side: float, scale: float, sizes: SizeField | None = None) -> Cells:
    """Return the cells of a surface, `side` model units wide; other parameters as for `phase_field`."""
    flat, mesh = fine.surface, fine.surface.mesh
    along, down = triangle_frames(mesh, fine.vectors)
    areas = np.maximum(mesh.areas, 1e-12 * mesh.size**2)
    cell = _cells(flat, along, side * float(np.sqrt(_steps(flat) / areas.sum())))
    total: FloatArray = np.bincount(cell, areas).astype(np.float64)
    middles = mesh.corners.mean(axis=1)
    centres = _mean(cell, areas, middles, total)
    axes = (
        np.stack([unit_vectors(_mean(cell, areas, of, total), least=1e-12) for of in (down, along)], axis=1)
        * scale
    )
    own = np.stack([down, along], axis=1) * scale
    shown = total * scale**2
    if sizes is not None:
        smaller = 1 / sizes.at(fine.parent, middles)
        of_cells = np.bincount(cell, areas * smaller) / total
        own, axes, shown = own * smaller[:, None, None], axes * of_cells[:, None, None], shown * of_cells**2
    firsts = np.searchsorted(fine.parent, np.arange(int(fine.parent.max()) + 2)).astype(np.int32)
    return Cells(firsts, middles, own, cell, centres, axes, shown)


def _steps(surface: ChartedSurface) -> float:
    # The number of square steps that triangles cover.
    flat = surface.places[:, 1:] - surface.places[:, :1]
    return 0.5 * float(np.abs(flat[:, 0, 0] * flat[:, 1, 1] - flat[:, 0, 1] * flat[:, 1, 0]).sum())


def _cells(surface: ChartedSurface, along: FloatArray, side: float) -> IntArray:
    # Connected pieces of squares of each chart; a jump of directions starts another cell.
    rows, columns = np.floor(surface.places.mean(axis=1) / side).astype(np.int64).T
    triangle, edge = np.nonzero(surface.across > 3 * np.arange(len(along))[:, None] + 2)
    other = surface.across[triangle, edge] // 3
    alike = (rows[triangle] == rows[other]) & (columns[triangle] == columns[other])
    alike &= (surface.chart[triangle] == surface.chart[other]) & ~surface.is_seam[triangle, edge]
    triangle, other = triangle[alike].astype(np.int32), other[alike].astype(np.int32)
    gone_on = (along[triangle] * along[other]).sum(axis=1) > _JUMP
    top = np.empty(len(along), np.int32)
    first_members(triangle[gone_on], other[gone_on], top)
    found: IntArray = (np.cumsum(top == np.arange(len(top))) - 1).astype(np.int32)[top]
    return found


def links_of(surface: ChartedSurface, cells: Cells, waves: FloatArray) -> Links:
    """Return one link for every two cells that share edges of a surface, whose triangles are their parts."""
    cell, own, axes, centres = cells.cell, cells.own, cells.axes, cells.centres
    corners, across = surface.mesh.corners, surface.across
    triangle, edge = np.nonzero(across >= 0)
    other, back = np.divmod(across[triangle, edge], 3)
    # All edges between two cells form one link, from the lower cell.
    once = cell[triangle] < cell[other]
    triangle, edge, other, back = triangle[once], edge[once], other[once], back[once]
    a, b = cell[triangle], cell[other]
    keys, number = np.unique(a * np.int64(len(centres)) + b, return_inverse=True)
    first, second = np.divmod(keys, len(centres))
    # The rotation takes an edge, as (down, along) in one side's axes, to the same edge in the other's. Each
    # side uses its own corners: in a tile, neighbours may be far apart.
    middle, tangent = edges_at(corners, triangle, edge)
    other_middle, other_tangent = edges_at(corners, other, back)
    before, after = product(own[triangle], tangent), -product(own[other], other_tangent)
    length = np.maximum(np.sqrt((before**2).sum(axis=1)), 1e-12)
    real = (before * after).sum(axis=1) / length
    imaginary = (before[:, 1] * after[:, 0] - before[:, 0] * after[:, 1]) / length
    here = product(0.5 * (axes[a] + own[triangle]), middle - centres[a]) * length[:, None]
    there = product(0.5 * (axes[b] + own[other]), centres[b] - other_middle) * length[:, None]
    whole = np.bincount(number, length, len(keys))
    sums = [np.bincount(number, of, len(keys)) / whole for of in (*here.T, *there.T, real, imaginary)]
    here, there = np.stack(sums[:2], axis=1), np.stack(sums[2:4], axis=1)
    turn = np.stack([sums[4], sums[5], -sums[5], sums[4]], axis=1).reshape(-1, 2, 2)
    goes_on = matched_waves(waves, np.broadcast_to(np.eye(2), turn.shape), turn)
    weights = np.clip(whole / np.maximum(_away(here, there), 1e-12), 1 / _HEAVIEST, _HEAVIEST)
    return Links(first.astype(np.int32), second.astype(np.int32), here, there, weights, goes_on)


def edges_at(
    corners: FloatArray, triangle: NDArray[np.integer], edge: NDArray[np.integer]
) -> tuple[FloatArray, FloatArray]:
    """Return the midpoints of triangles' edges, and the edges as vectors, each (n, 3)."""
    start, stop = corners[triangle, edge], corners[triangle, (edge + 1) % 3]
    return 0.5 * (start + stop), stop - start


def _away(here: FloatArray, there: FloatArray) -> FloatArray:
    away: FloatArray = np.sqrt((here**2).sum(axis=1)) + np.sqrt((there**2).sum(axis=1))
    return away


def _strains(links: Links, waves: FloatArray, phases: ComplexArray) -> tuple[FloatArray, FloatArray]:
    # `PhaseField.missing` and `areas`.
    both, psi = np.concatenate([waves, -waves]), np.concatenate([phases, np.conj(phases)])
    away = np.maximum(_away(links.here, links.there), 1e-12)
    missing = np.zeros((len(waves), len(away)))
    for wave in range(len(waves)):
        on = np.flatnonzero(links.goes_on[:, wave] >= 0)
        next_one = links.goes_on[on, wave]
        cycles = links.here[on] @ waves[wave] + (links.there[on] * both[next_one]).sum(axis=1)
        gone_on = phases[wave, links.first[on]] * unit_phases(cycles)
        missing[wave, on] = np.abs(turns_of(psi[next_one, links.second[on]] * np.conj(gone_on))) / away[on]
    return missing, links.weights * away**2


def turns_of(z: ComplexArray) -> FloatArray:
    """Return the angles of complex numbers in turns, −½ to ½."""
    turns: FloatArray = np.arctan2(z.imag, z.real) / (2 * np.pi)
    return turns


def in_units(turns: FloatArray) -> NDArray[np.int16]:
    """Return turns in units of 1/65536, which wrap around."""
    return np.rint(TURN * (turns - np.rint(turns))).astype(np.int64).astype(np.int16)


def product(axes: FloatArray, steps: FloatArray) -> FloatArray:
    """Return axes (n, 2, 3) times steps (n, 3): (n, 2)."""
    found: FloatArray = (axes @ steps[:, :, None])[..., 0]
    return found


def _mean(cell: IntArray, weights: FloatArray, vectors: FloatArray, total: FloatArray) -> FloatArray:
    sums = [np.bincount(cell, weights * vectors[:, axis], len(total)) for axis in range(3)]
    found: FloatArray = np.stack(sums, axis=1) / total[:, None]
    return found
