"""The phases that fit the links between cells best."""

from dataclasses import dataclass

import numpy as np

from upholster.base.types import ComplexArray, FloatArray, IntArray
from upholster.charts._multigrid_kernels import Rows
from upholster.charts.multigrid import Multigrid, hermitian, smallest_eigenvectors, solve, unit_complex
from upholster.charts.phases._kernels import carry_phases, first_members
from upholster.charts.phases.links import Links, signed

__all__ = [
    "PhaseSystem",
    "conjugate_phases",
    "phase_system",
    "smallest_phases",
    "solved_phases",
    "unit_phases",
]

_HEALING = 2.0
"""Periods over which two unnecessary ends of courses cancel out. Over more, the remaining ends are drawn
together and faults are longer: by a seventh over 3."""

_ROUNDS = 4
"""Rounds in which the field is normalized and smoothed again."""

_TRACE = 1e-9
"""Added to a diagonal, as a share of it, so that free unknowns can be solved."""


@dataclass(frozen=True, eq=False, slots=True)
class PhaseSystem:
    """The connection Laplacian of the waves.

    Each wave in each cell is an unknown. If a wave continues in its opposite somewhere, the opposite is an
    unknown as well.

    Attributes
    ----------
    number
        (2n · cells,) int32: the unknown of each wave, then of each opposite, in each cell; −1 for those that
        are the conjugate of another unknown.
    part
        (unknowns,) int32: the connected part of each unknown.
    opposite
        (unknowns,) int32: the unknown of the opposite wave in the same cell, −1 where there is none.
    mass
        (unknowns,) areas of the cells.
    pull
        (unknowns,) the same over the square of the length over which fields recover.
    first, second, turns, weights
        (E,) the links between unknowns: phase second = turns · phase first.
    """

    number: IntArray
    part: IntArray
    opposite: IntArray
    mass: FloatArray
    pull: FloatArray
    first: IntArray
    second: IntArray
    turns: ComplexArray
    weights: FloatArray

    @property
    def diagonal(self) -> FloatArray:
        """(unknowns,) sums of their links' weights."""
        count = len(self.mass)
        total = np.zeros(count)
        for end in (self.first, self.second):
            total += np.bincount(end, self.weights, count)
        return total

    def rows(self) -> Rows:
        """Return the matrix of Σ weight·|second − turns·first|²."""
        values: ComplexArray = np.multiply(-self.weights, np.conj(self.turns))  # row first, column second
        return hermitian(len(self.mass), self.first, self.second, values, self.diagonal)


def unit_phases(cycles: FloatArray) -> ComplexArray:
    """Return unit complex numbers, rotated by this many turns from 1."""
    angles = 2 * np.pi * (cycles - np.rint(cycles))
    found: ComplexArray = np.cos(angles) + 1j * np.sin(angles)
    return found


def solved_phases(links: Links, areas: FloatArray, waves: FloatArray) -> ComplexArray:
    """Return each wave's phase in each cell, (n, cells), as complex numbers.

    Takes the smallest eigenvector of the connection Laplacian (Knöppel et al. 2015, equation 7). Alternately
    normalizes and smooths it, which leaves few places where courses end. Finally spreads the mismatch of
    closed courses evenly. Numbers are small where a course ends.

    Parameters
    ----------
    links
        Links between cells.
    areas
        (cells,) areas of the cells in square exemplar pixels, positive.
    waves
        (n, 2) cycles per exemplar pixel.
    """
    system = phase_system(links, areas, waves)
    psi = _spread(system, _evened(system, conjugate_phases(system, smallest_phases(system))))
    all_of_them = np.zeros(len(system.number), np.complex128)
    all_of_them[system.number >= 0] = psi
    waves_own, opposites = all_of_them.reshape(2, len(waves), len(areas))
    found: ComplexArray = waves_own + np.conj(opposites)
    return found


def phase_system(links: Links, areas: FloatArray, waves: FloatArray) -> PhaseSystem:
    """Return the connection Laplacian of the waves; parameters as for `solved_phases`."""
    first, second, cycles, weights = _wave_links(links, waves, len(areas))
    top = np.empty(2 * len(waves) * len(areas), np.int32)
    first_members(first, second, top)
    # A connected part and the part of its opposites have conjugate solutions: only the one with the lower
    # first member is solved. If they are connected, they are solved as one.
    opposite = np.roll(top.reshape(2, -1), 1, axis=0).reshape(-1)
    kept = top <= opposite[top]
    number = np.where(kept, np.cumsum(kept) - 1, -1).astype(np.int32)
    on = kept[first] & (first != second)
    _, part = np.unique(top[kept], return_inverse=True)
    other = np.roll(number.reshape(2, -1), 1, axis=0).reshape(-1)[kept]
    wave, cell = np.divmod(np.flatnonzero(kept), len(areas))
    mass = areas[cell]
    return PhaseSystem(
        number,
        part.reshape(-1).astype(np.int32),
        other,
        mass,
        mass * (signed(waves)[wave] ** 2).sum(axis=1) / _HEALING**2,
        number[first[on]],
        number[second[on]],
        unit_phases(cycles[on]),
        weights[on],
    )


def _wave_links(
    links: Links, waves: FloatArray, cells: int
) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    # Links between waves in cells, numbered wave · cells + cell: ends, cycles from one to the other, weights.
    both = signed(waves)
    wave, link = np.nonzero(links.goes_on.T >= 0)
    there = links.goes_on[link, wave]
    cycles = (links.here[link] * both[wave]).sum(axis=1) + (links.there[link] * both[there]).sum(axis=1)
    first = (wave * cells + links.first[link]).astype(np.int32)
    second = (there.astype(np.int64) * cells + links.second[link]).astype(np.int32)
    return first, second, cycles, links.weights[link]


def smallest_phases(system: PhaseSystem) -> ComplexArray:
    """Return the smallest eigenvector of each part, as one vector (unknowns,)."""
    count = int(system.part.max()) + 1
    shift = 0.1 * np.bincount(system.part, system.pull, count) / np.bincount(system.part, system.mass, count)
    # Where nothing bends, the start is the solution. From another one the iteration may stop at the second
    # smallest eigenvector, with a fault right across a flat texture.
    start = _carried(system)
    return smallest_eigenvectors(system.rows(), system.mass, system.part, start, shift=shift, tolerance=1e-3)


def _carried(system: PhaseSystem) -> ComplexArray:
    count = len(system.mass)
    ends = np.concatenate([system.first, system.second])
    order = np.argsort(ends, kind="stable")
    starts = np.searchsorted(ends[order], np.arange(count + 1)).astype(np.int32)
    seconds = np.concatenate([system.second, system.first])[order]
    turns = np.concatenate([system.turns, np.conj(system.turns)])[order]
    phases = np.zeros(count, np.complex128)
    carry_phases(starts, seconds, turns, np.empty(count, np.int32), phases)
    return phases


def conjugate_phases(system: PhaseSystem, psi: ComplexArray) -> ComplexArray:
    """Return phases (unknowns,) in which each wave and its opposite are conjugates of each other.

    An eigenvector of a part is free up to a rotation; the rotation is chosen so that this changes it least.
    """
    count = int(system.part.max()) + 1
    both = psi * np.where(system.opposite >= 0, psi[system.opposite], 0.0)
    sums = [np.bincount(system.part, system.mass * of, count) for of in (both.real, both.imag)]
    half = np.arctan2(sums[1], sums[0]) / (4 * np.pi)
    return _as_one(system, psi * unit_phases(-half)[system.part])


def _as_one(system: PhaseSystem, psi: ComplexArray) -> ComplexArray:
    # The mean of each wave and its opposite's conjugate. No solver keeps them equal to the last bit, and
    # small differences grow if several solutions are about equally good.
    joined: ComplexArray = 0.5 * (psi + np.conj(psi[system.opposite]))
    return np.where(system.opposite >= 0, joined, psi)


def _evened(system: PhaseSystem, psi: ComplexArray) -> ComplexArray:
    # Alternately normalizes and smooths the field: it recovers where the eigenvector is small though no
    # course has to end there.
    rows = system.rows()
    grid = Multigrid(rows._replace(diagonal=rows.diagonal + system.pull))
    for _ in range(_ROUNDS):
        psi = unit_complex(psi)
        psi = _as_one(system, solve(grid, system.pull * psi, psi, tolerance=0.02, most=4))
    return psi


def _spread(system: PhaseSystem, psi: ComplexArray) -> ComplexArray:
    # Turns phases so that waves' stretch is spread as evenly as the ends of courses allow: least squares of
    # the turns that are missing over links; complete turns stay as they are.
    count = len(psi)
    missing = psi[system.first] * system.turns * np.conj(psi[system.second])
    angles = system.weights * np.arctan2(missing.imag, missing.real)
    right = np.bincount(system.second, angles, count) - np.bincount(system.first, angles, count)
    weights = -system.weights.astype(np.complex128)
    rows = hermitian(count, system.first, system.second, weights, system.diagonal * (1 + _TRACE))
    by = solve(Multigrid(rows), right.astype(np.complex128), np.zeros(count, np.complex128), tolerance=1e-3)
    return _as_one(system, psi * unit_phases(by.real / (2 * np.pi)))
