"""Large sparse Hermitian systems, solved by conjugate gradients with a multigrid cycle as preconditioner.

Unknowns are complex numbers that represent directions; a real matrix has entries without an imaginary part.
Coarser levels join unknowns into groups of about four by their strongest couplings. Within a group the
unknowns differ by the phases of these couplings, so a coarse unknown is a field that is parallel over its
group. Nothing depends on threads, linear algebra libraries or chance: the same input gives the same bits.

References
----------
Y. Notay: An aggregation-based algebraic multigrid method, Electronic Transactions on Numerical Analysis 37,
2010. Y. T. Feng, D. R. J. Owen: Conjugate gradient methods for solving the smallest eigenpair of large
symmetric eigenvalue problems, International Journal for Numerical Methods in Engineering 39, 1996.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from upholster.base.types import ComplexArray, FloatArray, IntArray
from upholster.charts._multigrid_kernels import (
    GridLevels,
    Rows,
    Work,
    coarse_rows,
    conjugate_gradients,
    factor,
    follow_matching,
    inner_by_part,
    lower_quotients,
    match_pairs,
    prolong,
    restrict,
)
from upholster.runtime.parallel import check_cancelled

__all__ = ["Multigrid", "hermitian", "smallest_eigenvectors", "solve", "unit_complex"]

DENSE = 100
"""A level with at most this many unknowns is solved directly."""


def hermitian(
    count: int, first: IntArray, second: IntArray, values: ComplexArray, diagonal: FloatArray
) -> Rows:
    """Return the matrix with the entries (first, second) = value and (second, first) = conj(value).

    Parameters
    ----------
    count
        Number of unknowns.
    first, second
        (E,) indices, each pair at most once and no two equal ones.
    values
        (E,) complex.
    diagonal
        (count,) real.
    """
    row, column = np.concatenate([first, second]), np.concatenate([second, first]).astype(np.int32)
    before = column < row
    order = np.argsort(2 * row.astype(np.int64) + ~before, kind="stable")
    starts = np.zeros(count + 1, np.int32)
    np.cumsum(np.bincount(row, minlength=count), out=starts[1:])
    middles = starts[:-1] + np.bincount(row[before], minlength=count).astype(np.int32)
    both = np.concatenate([values, np.conj(values)]).astype(np.complex128)[order]
    return Rows(starts, middles, column[order], both, np.ascontiguousarray(diagonal, np.float64))


@dataclass(frozen=True, slots=True)
class _Level:
    rows: Rows
    group: IntArray
    phase: ComplexArray


class Multigrid:
    """GridLevels of a positive Hermitian matrix, for cycles over them.

    Parameters
    ----------
    rows
        The matrix. Its diagonal is positive.
    """

    def __init__(self, rows: Rows) -> None:
        self.levels: list[_Level] = []
        while len(rows.diagonal) > DENSE:
            group, phase, count = _groups(rows)
            if not count or count > 0.9 * len(group):
                break
            self.levels.append(_Level(rows, group, phase))
            rows = _coarser(rows, group, phase, count)
        self._last = rows
        self.kept = _kept(self.levels, rows)
        self.work = Work.of(self.kept)

    def rows_at(self, depth: int) -> Rows:
        """Return the matrix of a level; 0 is the finest."""
        return self.levels[depth].rows if depth < len(self.levels) else self._last


def _kept(levels: list[_Level], last: Rows) -> GridLevels:
    # All levels in the form that kernels take.
    rows = [*(level.rows for level in levels), last]
    sizes = [(len(one.diagonal), len(one.columns)) for one in rows]
    firsts = np.concatenate([np.zeros((1, 2), np.int64), np.cumsum(sizes, axis=0, dtype=np.int64)])
    group = np.concatenate([np.zeros(0, np.int32), *(level.group for level in levels)])
    phase = np.concatenate([np.zeros(0, np.complex128), *(level.phase for level in levels)])
    together = Rows(*(np.concatenate(part) for part in zip(*rows, strict=True)))
    dense = _dense_factor(last) if len(last.diagonal) <= DENSE else np.zeros((0, 0), np.complex128)
    return GridLevels(firsts, together, group, phase, dense)


def solve(
    grid: Multigrid, right: ComplexArray, start: ComplexArray, *, tolerance: float = 1e-6, most: int = 100
) -> ComplexArray:
    """Solve the grid's system by flexible conjugate gradients.

    Parameters
    ----------
    grid
        GridLevels of the matrix, which is positive.
    right
        (n,) complex.
    start
        (n,) complex: the initial guess.
    tolerance
        It ends when the residual's norm over that of `right` is at most this.
    most
        Most steps.
    """
    check_cancelled()
    x = start.astype(np.complex128)
    room = np.empty((4, len(x)), np.complex128)
    conjugate_gradients(grid.kept, grid.work, right.astype(np.complex128), room, tolerance, most, x)
    return x


def smallest_eigenvectors(
    rows: Rows,
    mass: FloatArray,
    part: IntArray,
    start: ComplexArray,
    *,
    shift: FloatArray,
    tolerance: float = 1e-4,
    steps: int = 40,
) -> ComplexArray:
    """Return the vector that minimizes xᴴAx / xᴴMx in each part separately.

    Parameters
    ----------
    rows
        A, Hermitian and positive semidefinite, with no couplings between parts.
    mass
        (n,) positive: the diagonal of M.
    part
        (n,) the part of each unknown, from 0.
    start
        (n,) complex: the initial guess; of several equally good vectors, the one most like it is found.
    shift
        (parts,) positive: the preconditioner is for A + shift·M. About a tenth of the smallest eigenvalues.
    tolerance
        A part is done when a step can lower its quotient by no more than this share.
    steps
        Most steps on each level.

    Returns
    -------
    ndarray
        (n,) complex, with xᴴMx = 1 in each part.
    """
    grid = Multigrid(rows._replace(diagonal=rows.diagonal + shift[part] * mass))
    return _smallest(grid, 0, mass, part, start, shift, (tolerance, steps))


def _smallest(
    grid: Multigrid,
    depth: int,
    mass: FloatArray,
    part: IntArray,
    start: ComplexArray,
    shift: FloatArray,
    limits: tuple[float, int],
) -> ComplexArray:
    """Return the vectors of a level, starting from those of the next coarser one."""
    start = _normalized(start, mass, part, len(shift))
    if depth < len(grid.levels):
        level = grid.levels[depth]
        count = len(grid.rows_at(depth + 1).diagonal)
        used = level.group >= 0
        coarse_mass: FloatArray = np.bincount(level.group[used], mass[used], count).astype(np.float64)
        coarse_part = np.empty(count, np.int32)
        coarse_part[level.group[used]] = part[used]
        coarse_start = np.empty(count, np.complex128)
        restrict(level.group, level.phase, mass * start, coarse_start)
        found = _smallest(
            grid, depth + 1, coarse_mass, coarse_part, coarse_start / coarse_mass, shift, limits
        )
        start = np.where(used, 0, start)
        prolong(level.group, level.phase, found, start)
        start = _normalized(start, mass, part, len(shift))
    return _descend(grid, depth, mass, part, start, shift, limits)


def _normalized(x: ComplexArray, mass: FloatArray, part: IntArray, parts: int) -> ComplexArray:
    size = _by_part(part, mass, x, x, parts).real
    empty = ~(size > 1e-30 * np.maximum(np.bincount(part, mass, parts), 1e-300))
    x = np.where(empty[part], 1.0 + 0j, x)
    size = _by_part(part, mass, x, x, parts).real
    return x / np.sqrt(size)[part]


def unit_complex(z: ComplexArray) -> ComplexArray:
    """Return complex numbers divided by their magnitudes; 1 for 0."""
    length = np.sqrt(z.real**2 + z.imag**2)
    unit: ComplexArray = np.where(length > 0, z / np.where(length > 0, length, 1.0), 1.0)
    return unit


def _by_part(
    part: IntArray, weights: FloatArray, x: ComplexArray, y: ComplexArray, parts: int
) -> ComplexArray:
    out = np.empty(parts, np.complex128)
    inner_by_part(part, weights, x, y, out)
    return out


def _descend(
    grid: Multigrid,
    depth: int,
    mass: FloatArray,
    part: IntArray,
    x: ComplexArray,
    shift: FloatArray,
    limits: tuple[float, int],
) -> ComplexArray:
    """Lower each part's quotient."""
    check_cancelled()
    rows = grid.rows_at(depth)
    rows = rows._replace(diagonal=rows.diagonal - shift[part] * mass)
    vectors, sums = np.empty((6, len(x)), np.complex128), np.empty((8, len(shift)), np.complex128)
    lower_quotients(grid.kept, grid.work, depth, rows, mass, part, shift, limits, vectors, sums, x)
    return x


def _groups(rows: Rows) -> tuple[IntArray, ComplexArray, int]:
    count = len(rows.diagonal)
    group, phase = np.empty(count, np.int32), np.zeros(count, np.complex128)
    pairs = match_pairs(rows, group, phase)
    if not pairs:
        return group, phase, 0
    pair_rows = _coarser(rows, group, phase, pairs)
    second, second_phase = np.empty(pairs, np.int32), np.zeros(pairs, np.complex128)
    groups = match_pairs(pair_rows, second, second_phase)
    follow_matching(group, phase, second, second_phase)
    return group, phase, groups


def _coarser(rows: Rows, group: IntArray, phase: ComplexArray, count: int) -> Rows:
    room = len(rows.columns)
    coarse = Rows(
        np.zeros(count + 1, np.int32),
        np.empty(count, np.int32),
        np.empty(room, np.int32),
        np.empty(room, np.complex128),
        np.empty(count),
    )
    members, first = np.empty(len(group), np.int32), np.empty(count + 1, np.int32)
    filled = coarse_rows(rows, group, phase, members, first, np.empty(count, np.int32), coarse)
    return coarse._replace(columns=coarse.columns[:filled].copy(), values=coarse.values[:filled].copy())


def _dense_factor(rows: Rows) -> ComplexArray:
    dense = np.diag(rows.diagonal).astype(np.complex128)
    for i, (start, stop) in enumerate(pairwise(rows.starts.tolist())):
        dense[i, rows.columns[start:stop]] += rows.values[start:stop]
    factor(dense)
    return dense
