"""Courses that close: each has its own whole number of elements, and slips along the joints beside it.

The phases of a lattice (`phase_cells`) tie each course to the next. Where a surface widens, the next course
is longer, and elements must end somewhere inside. A mason lets courses slip instead: only the joints between
them go on. Here the wave that counts courses is solved alone. Its joints cut the surface into courses, and
along each of them the other wave is solved alone, too.
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
"""Share of the surface on which joints between courses must be even, and elements are not."""

_EVEN, _UNEVEN, _TIMES = 0.05, 0.03, 4.0
"""Courses slip if joints between them stray by at most this many turns over the height of a course, and the
lattice by at least the second number and so many times as much: else running bond can stay, or joints end."""

_FINE = 0.6
"""Longest edge of a part, in heights of a course."""

_MOST_CELLS = 60000
"""Greatest number of cells, about a course high and wide: they take some 3 s. With more, elements are tiny
on the surface."""


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
        (2,) the wave that counts elements along a course, in cycles per exemplar pixel.
    lean
        Turns of the first wave over the height of a course.
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
        first = self.cells.turns(part, points, self.head[None], self.phases[None])[0] + self.lean * height
        one, other = self.courses.multiples
        return in_units(np.stack([first, other * (bed - one * first)]))

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
    return _slipping(subdivided(surface, vectors, _FINE * side), lattice.waves, courses, beds, scale, sizes)


def _slipping(
    fine: Subdivided,
    waves: FloatArray,
    courses: Courses,
    beds: PhaseField,
    scale: float,
    sizes: SizeField | None,
) -> CourseField:
    # The phases along each course; `fine` is the surface with triangles that are shorter than a course.
    surface, wave = fine.surface, beds.waves[0]
    high = 1 / float(np.hypot(*wave))
    middles = surface.mesh.corners.mean(axis=1)
    heights = (beds.at(fine.parent, middles)[0] / TURN - courses.joint) % 1.0
    triangle, edge = np.nonzero(surface.across >= 0)
    other = surface.across[triangle, edge] // 3
    crossed = np.abs(heights[triangle] - heights[other]) >= 0.5
    across = surface.across.copy()
    across[triangle[crossed], edge[crossed]] = -1
    cut = replace(fine, surface=replace(surface, across=across))
    cells = cells_of(cut, high / scale * (1.0 if sizes is None else sizes.least), scale, sizes)
    lean = float(waves[0] @ wave) * high**2
    head = waves[0] - lean * wave
    links = links_of(cut.surface, cells, head[None])
    phases = solved_phases(links, cells.areas, head[None])
    # From the last part before a joint to the first one after it, the first wave goes on in running bond.
    ends = np.flatnonzero(crossed & (heights[triangle] > 0.5))
    last, first = triangle[ends].astype(np.int32), other[ends].astype(np.int32)
    middle, along = edges_at(surface.mesh.corners, last, edge[ends])
    before, after = (cells.turns(part, middle, head[None], phases)[0] for part in (last, first))
    bonds = np.sqrt((along**2).sum(axis=1)) * unit_phases(before + lean - after)
    turned = _in_bond(links, cells.cell[last], cells.cell[first], bonds, len(cells.areas))
    return CourseField(waves, courses, beds, cells, heights, head, lean, phases[0] * turned)


def _in_bond(
    links: Links, before: IntArray, after: IntArray, bonds: ComplexArray, count: int
) -> ComplexArray:
    """Return the turns (count,) of cells, as unit numbers, with which courses are in bond on average.

    Cells that are linked are of one course. Between the cells `before` and `after` (n,) a joint, the turn
    of the second course would be that of the first times `bonds` (n,).
    """
    course = np.empty(count, np.int32)
    first_members(links.first, links.second, course)
    pairs, number = np.unique(course[before] * np.int64(count) + course[after], return_inverse=True)
    mean = np.bincount(number, bonds.real) + 1j * np.bincount(number, bonds.imag)
    one, other = np.divmod(pairs, count)
    ends, turns = np.concatenate([one, other]), np.concatenate([mean, np.conj(mean)])
    turns = np.where(turns == 0, 1.0, turns / np.maximum(np.abs(turns), 1e-300))
    order = np.argsort(ends, kind="stable")
    starts = np.searchsorted(ends[order], np.arange(count + 1)).astype(np.int32)
    seconds = np.concatenate([other, one])[order].astype(np.int32)
    found = np.zeros(count, np.complex128)
    carry_phases(starts, seconds, turns[order], np.empty(count, np.int32), found)
    return found[course]
