"""Courses that close: each has its own whole number of elements, and slips along the joints beside it.

The phases of a lattice (`phase_cells`) tie each course to the next. Where a surface widens, the next course
is longer, and elements must end somewhere inside. A mason lets courses slip instead: only the joints between
them go on. Here the wave that counts courses is solved alone. Its joints cut the surface into courses. Along
each of them, a wave that counts its elements is solved alone, too.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import ComplexArray, FloatArray, IntArray
from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.phases._kernels import carry_phases, first_members, nearest_in_course
from upholster.charts.phases.links import Links
from upholster.charts.phases.phase_cells import (
    TURN,
    Cells,
    PhaseField,
    cells_of,
    edges_at,
    in_units,
    links_of,
    phase_field,
)
from upholster.charts.phases.phase_solution import solved_phases, unit_phases
from upholster.charts.size_map import SizeField
from upholster.charts.subdivision import Subdivided, subdivided
from upholster.image.elements.courses import Courses
from upholster.runtime.stages import stage

__all__ = ["CourseField", "course_field"]

_SHARE = 0.94
"""Share of the surface on which strays are measured: the turns that waves miss over a course's height."""

_EVEN, _UNEVEN, _TIMES = 0.05, 0.03, 4.0
"""Courses slip if joints between them stray by at most the first number, the lattice by at least the second,
and the lattice this many times as much. Otherwise joints must end, too, or running bond fits."""

_FINE = 0.6
"""Longest edge of the triangles that are cut into courses, in heights of a course."""

_MOST_CELLS = 60000
"""Greatest number of cells, about a course high and wide: they take some 3 s. With more, elements are tiny
on the surface."""

_FAINT = 0.1
"""Courses are in bond on average if at least this share of the joint between them agrees."""

_MULTIPLIER = 0x9E3779B97F4A7C15
"""Of Fibonacci hashing: numbers times this look random."""


@dataclass(frozen=True, eq=False, slots=True)
class CourseField:
    """Phases of a lattice in running bond over a charted surface, each course for itself.

    Attributes
    ----------
    waves
        (2, 2) the lattice's waves, in cycles per exemplar pixel.
    courses
        How they count courses.
    beds
        The phases of the wave that counts courses.
    cells
        Pieces of courses.
    heights
        (parts,) where the cells' parts are in their course, 0 to 1 from joint to joint.
    head
        (2,) the wave that counts elements along a course, in cycles per exemplar pixel: across courses it
        does not change. It is one of the lattice's waves less `lean` times the wave that counts courses.
    lean
        Turns of that wave of the lattice over the height of a course.
    phases
        (cells,) complex: the phases of `head` at the cells' centres.
    """

    waves: FloatArray
    courses: Courses
    beds: PhaseField
    cells: Cells
    heights: FloatArray
    head: FloatArray
    lean: float
    phases: ComplexArray

    def at(self, triangles: IntArray, points: FloatArray) -> NDArray[np.int16]:
        """Return the phases at points (m, 3) in triangles (m,): (2, m) int16, in 1/65536 turn."""
        triangles, points = np.ascontiguousarray(triangles, np.int32), np.ascontiguousarray(points)
        bed = self.beds.at(triangles, points)[0] / TURN
        height = (bed - self.courses.joint) % 1.0
        part = np.empty(len(triangles), np.int32)
        nearest_in_course(
            self.cells.firsts, self.cells.middles, self.heights, triangles, points, height, part
        )
        # Right beyond a joint the nearest part may be of the course before: its lattice goes on.
        height = self.heights[part] + (height - self.heights[part] + 0.5) % 1.0 - 0.5
        free = self.cells.turns(part, points, self.head[None], self.phases[None])[0] + self.lean * height
        once, multiples = self.courses.once, self.courses.multiples
        other = multiples[once] * (bed - multiples[1 - once] * free)
        return in_units(np.stack([free, other] if once else [other, free]))

    def strain(self, share: float) -> float:
        """Return the greatest stretch of courses' heights on a share of the surface, as for `PhaseField`."""
        return self.beds.strain(share)


@stage
def course_field(
    lattice: PhaseField,
    courses: Courses,
    surface: ChartedSurface,
    vectors: FloatArray,
    scale: float,
    sizes: SizeField | None = None,
) -> CourseField | None:
    """Return phases with which courses slip; None: the lattice's phases are as good, or joints end, too.

    Parameters
    ----------
    lattice
        The phases of both waves, solved together.
    courses
        How these count courses.
    surface, vectors, scale, sizes
        As for `phase_field`.
    """
    wave = courses.wave(lattice.waves)
    high, least = 1 / float(np.hypot(*wave)), 1.0 if sizes is None else sizes.least
    side = high / scale * least
    stray = lattice.strain(_SHARE) * high
    if stray < _UNEVEN or surface.mesh.areas.sum() > _MOST_CELLS * side**2:
        return None
    beds = phase_field(surface, vectors, scale, wave[None], sizes)
    if beds.strain(_SHARE) * high > min(_EVEN, stray / _TIMES):
        return None
    fine, heights, ends = _cut_at_joints(subdivided(surface, vectors, _FINE * side), beds, courses)
    cells = cells_of(fine, side, scale, sizes)
    free = lattice.waves[1 - courses.once]
    lean = float(free @ wave) * high**2
    head = free - lean * wave
    links = links_of(fine.surface, cells, head[None])
    phases = solved_phases(links, cells.areas, head[None])
    # From the last part before a joint to the first one after it, the lattice goes on in running bond.
    last, first, edge = ends
    middle, along = edges_at(fine.surface.mesh.corners, last, edge)
    before, after = (cells.turns(part, middle, head[None], phases)[0] for part in (last, first))
    bonds = np.sqrt((along**2).sum(axis=1)) * unit_phases(before + lean - after)
    turned = _in_bond(links, cells.cell[last], cells.cell[first], bonds, len(cells.areas))
    return CourseField(lattice.waves, courses, beds, cells, heights, head, lean, phases[0] * turned)


def _cut_at_joints(
    fine: Subdivided, beds: PhaseField, courses: Courses
) -> tuple[Subdivided, FloatArray, tuple[IntArray, IntArray, IntArray]]:
    """Return a surface whose triangles do not meet across joints, their heights (T,), and the joints' edges.

    Edges (n,) are the last triangle before a joint, the first one after it, and the edge of the former.
    """
    surface = fine.surface
    middles = surface.mesh.corners.mean(axis=1)
    heights = (beds.at(fine.parent, middles)[0] / TURN - courses.joint) % 1.0
    triangle, edge = np.nonzero(surface.across >= 0)
    other = surface.across[triangle, edge] // 3
    crossed = np.abs(heights[triangle] - heights[other]) >= 0.5
    across = surface.across.copy()
    across[triangle[crossed], edge[crossed]] = -1
    ends = np.flatnonzero(crossed & (heights[triangle] > 0.5))
    last, first, at = (of[ends].astype(np.int32) for of in (triangle, other, edge))
    return replace(fine, surface=replace(surface, across=across)), heights, (last, first, at)


def _in_bond(
    links: Links, before: IntArray, after: IntArray, bonds: ComplexArray, count: int
) -> ComplexArray:
    """Return the turns (count,) of cells, as unit numbers, with which courses are in bond.

    Cells that are linked are of one course. At a joint between the cells `before` and `after` (n,), the turn
    of the second course would be that of the first times `bonds` (n,), longer where more of the joint is.
    """
    course = np.empty(count, np.int32)
    first_members(links.first, links.second, course)
    pairs, number = np.unique(course[before] * np.int64(count) + course[after], return_inverse=True)
    mean = np.bincount(number, bonds.real) + 1j * np.bincount(number, bonds.imag)
    # Courses of different lengths are in and out of bond in turn: then any one edge of the joint decides.
    counts = np.bincount(number, minlength=len(pairs))
    drawn = (np.arange(len(pairs), dtype=np.uint64) * np.uint64(_MULTIPLIER)) >> np.uint64(33)
    edge = np.cumsum(counts) - counts + drawn.astype(np.int64) % np.maximum(counts, 1)
    some = bonds[np.argsort(number, kind="stable")[edge]]
    mean = np.where(np.abs(mean) > _FAINT * np.bincount(number, np.abs(bonds)), mean, some)
    one, other = np.divmod(pairs, count)
    ends, turns = np.concatenate([one, other]), np.concatenate([mean, np.conj(mean)])
    turns /= np.maximum(np.abs(turns), 1e-300)
    order = np.argsort(ends, kind="stable")
    starts = np.searchsorted(ends[order], np.arange(count + 1)).astype(np.int32)
    seconds = np.concatenate([other, one])[order].astype(np.int32)
    found = np.zeros(count, np.complex128)
    carry_phases(starts, seconds, turns[order], np.empty(count, np.int32), found)
    return found[course]
