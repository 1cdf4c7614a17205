"""Large sparse Hermitian systems, solved by conjugate gradients with a multigrid cycle as preconditioner.

Unknowns are complex numbers that stand for directions (a real matrix is one whose entries have no imaginary
part). Coarser levels join unknowns to groups of about four by their strongest couplings; within a group the
unknowns differ by the phases of these couplings, so that a coarse unknown is a field parallel over its group.
No step depends on threads, on libraries of linear algebra or on chance: the same input gives the same bits.

References
----------
Y. Notay: An aggregation-based algebraic multigrid method, Electronic Transactions on Numerical Analysis 37,
2010. Y. T. Feng, D. R. J. Owen: Conjugate gradient methods for solving the smallest eigenpair of large
symmetric eigenvalue problems, International Journal for Numerical Methods in Engineering 39, 1996.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from upholster.charts._multigrid_kernels import (
    ComplexArray,
    Rows,
    coarse_rows,
    divide_out,
    factor,
    inner,
    inner_by_part,
    join_pairs,
    match_pairs,
    multiply,
    prolong,
    restrict,
    smooth_down,
    smooth_up,
    step,
    subtract_product,
)
from upholster.parallel import check_cancelled
from upholster.types import FloatArray, IntArray

__all__ = ["Multigrid", "hermitian", "smallest_eigenvectors", "solve"]

DENSE = 100
"""A level of so many unknowns is solved at once."""


def hermitian(
    count: int, first: IntArray, second: IntArray, values: ComplexArray, diagonal: FloatArray
) -> Rows:
    """Return the matrix with the entries (first, second) = value and (second, first) = conj(value).

    Parameters
    ----------
    count
        Unknowns.
    first, second
        (E,) indices, each pair at most once and no two equal ones.
    values
        (E,) complex.
    diagonal
        (count,) real.
    """
    row = np.concatenate([first, second])
    order = np.argsort(row, kind="stable")
    starts = np.zeros(count + 1, np.int32)
    np.cumsum(np.bincount(row, minlength=count), out=starts[1:])
    columns = np.concatenate([second, first]).astype(np.int32)[order]
    both = np.concatenate([values, np.conj(values)]).astype(np.complex128)[order]
    return Rows(starts, columns, both, np.ascontiguousarray(diagonal, np.float64))


@dataclass(frozen=True, slots=True)
class _Level:
    rows: Rows
    group: IntArray
    phase: ComplexArray
    residual: ComplexArray
    """Room for the cycle's residual and, on the coarser level, its right side and two directions."""


class Multigrid:
    """Levels of a positive Hermitian matrix, and the cycle over them.

    Parameters
    ----------
    rows
        The matrix. Its diagonal is positive.
    """

    def __init__(self, rows: Rows) -> None:
        self.rows = rows
        self.levels: list[_Level] = []
        while len(rows.diagonal) > DENSE:
            group, phase, count = _groups(rows)
            if not count or count > 0.9 * len(group):
                break
            self.levels.append(_Level(rows, group, phase, np.empty(len(group), np.complex128)))
            rows = _coarser(rows, group, phase, count)
        self._last = rows
        self._factor = _dense_factor(rows) if len(rows.diagonal) <= DENSE else None

    def rows_at(self, depth: int) -> Rows:
        """Return the matrix of a level; 0 is the finest."""
        return self.levels[depth].rows if depth < len(self.levels) else self._last

    def cycle(self, right: ComplexArray, x: ComplexArray, depth: int = 0) -> None:
        """Put in x about the solution for `right`: one K-cycle, a preconditioner that varies a little."""
        if depth == len(self.levels):
            self._at_last(right, x)
            return
        level = self.levels[depth]
        smooth_down(level.rows, right, x)
        subtract_product(level.rows, x, right, level.residual)
        coarser = self.rows_at(depth + 1)
        below = np.empty(len(coarser.diagonal), np.complex128)
        restrict(level.group, level.phase, level.residual, below)
        prolong(level.group, level.phase, self._below(coarser, below, depth + 1), x)
        smooth_up(level.rows, right, x)

    def _below(self, rows: Rows, right: ComplexArray, depth: int) -> ComplexArray:
        """Solve on a coarser level: there by one cycle or two, joined as conjugate gradients join them."""
        x = np.empty(len(right), np.complex128)
        self.cycle(right, x, depth)
        if depth == len(self.levels):
            return x
        product = np.empty_like(x)
        multiply(rows, x, product)
        curved = inner(x, product).real
        if not curved > 0:
            return x
        share = inner(x, right) / curved
        rest = right.copy()
        step(-share, product, rest)
        first, x = x, share * x
        if inner(rest, rest).real <= 0.0625 * inner(right, right).real:
            return x
        more = np.empty_like(x)
        self.cycle(rest, more, depth)
        along = np.conj(inner(more, product)) / curved
        direction = more - along * first
        multiply(rows, direction, product)
        curved = inner(direction, product).real
        if curved > 0:
            step(inner(direction, rest) / curved, direction, x)
        return x

    def _at_last(self, right: ComplexArray, x: ComplexArray) -> None:
        if self._factor is not None:
            divide_out(self._factor, right, x)
            return
        smooth_down(self._last, right, x)
        smooth_up(self._last, right, x)


def solve(
    grid: Multigrid, right: ComplexArray, start: ComplexArray, *, tolerance: float = 1e-6, most: int = 100
) -> ComplexArray:
    """Solve the grid's system by flexible conjugate gradients.

    Parameters
    ----------
    grid
        Levels of the matrix, which is positive.
    right
        (n,) complex.
    start
        (n,) complex: where to begin.
    tolerance
        Length of the residual over that of `right` at which it ends.
    most
        Steps at which it ends in any case.
    """
    x = start.astype(np.complex128)
    rest = np.empty_like(x)
    subtract_product(grid.rows, x, right, rest)
    enough = tolerance**2 * inner(right, right).real
    direction, product, next_one = np.zeros_like(x), np.zeros_like(x), np.empty_like(x)
    curved = 0.0
    for _ in range(most):
        check_cancelled()
        if inner(rest, rest).real <= enough:
            break
        grid.cycle(rest, next_one)
        along = inner(product, next_one) / curved if curved > 0 else 0j
        direction = next_one - along * direction
        multiply(grid.rows, direction, product)
        curved = inner(direction, product).real
        if not curved > 0:
            break
        size = inner(direction, rest) / curved
        step(size, direction, x)
        step(-size, product, rest)
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
    """Return the vector that makes xᴴAx / xᴴMx least in each part by itself.

    Parameters
    ----------
    rows
        A, Hermitian and not negative, which couples no two parts.
    mass
        (n,) positive: the diagonal of M.
    part
        (n,) the part of each unknown: 0 to their number less 1.
    start
        (n,) complex: what to begin with; of several vectors as good the one most like it is found.
    shift
        (parts,) positive: the preconditioner is for A + shift·M. About a tenth of the least eigenvalues.
    tolerance
        What a step can still lower a quotient by, as a part of it, at which the part has its vector.
    steps
        Steps on each level at most.

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
    """Return the vectors of a level, begun from those of the next coarser one."""
    start = _unit(start, mass, part, len(shift))
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
        start = _unit(start, mass, part, len(shift))
    return _descend(grid, depth, mass, part, start, shift, limits)


def _unit(x: ComplexArray, mass: FloatArray, part: IntArray, parts: int) -> ComplexArray:
    size = _by_part(part, mass, x, x, parts).real
    empty = ~(size > 1e-30 * np.maximum(np.bincount(part, mass, parts), 1e-300))
    x = np.where(empty[part], 1.0 + 0j, x)
    size = _by_part(part, mass, x, x, parts).real
    return x / np.sqrt(size)[part]


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
    """Lower each part's quotient by preconditioned conjugate gradients with exact steps."""
    rows, ones, parts = grid.rows_at(depth), np.ones(len(mass)), len(shift)
    rows = rows._replace(diagonal=rows.diagonal - shift[part] * mass)
    moving = np.ones(parts, np.bool_)
    product, direction = np.empty_like(x), np.zeros_like(x)
    image, next_one = np.zeros_like(x), np.empty_like(x)
    multiply(rows, x, product)
    before = np.ones(parts)
    last = np.zeros_like(x)
    for count in range(limits[1]):
        check_cancelled()
        quotient = _by_part(part, ones, x, product, parts).real
        slope = product - (quotient[part] * mass) * x
        grid.cycle(slope, next_one, depth)
        now = _by_part(part, ones, next_one, slope, parts).real
        change = now - _by_part(part, ones, next_one, last, parts).real
        moving &= now > limits[0] * (np.maximum(quotient, 0) + shift)
        if not moving.any():
            break
        keep = np.where(before > 0, np.maximum(change, 0.0) / np.where(before > 0, before, 1.0), 0.0)
        direction = next_one + (keep[part] if count else 0.0) * direction
        direction -= _by_part(part, mass, x, direction, parts)[part] * x
        multiply(rows, direction, image)
        fall = _best_step(
            quotient,
            _by_part(part, ones, direction, product, parts),
            _by_part(part, ones, direction, image, parts).real,
            _by_part(part, mass, direction, direction, parts).real,
        )
        fall = np.where(moving, fall, 0)
        x = x + fall[part] * direction
        product = product + fall[part] * image
        size = np.sqrt(_by_part(part, mass, x, x, parts).real)
        x, product = x / size[part], product / size[part]
        before, last = now, slope
    return x


def _best_step(
    quotient: FloatArray, mixed: ComplexArray, curved: FloatArray, size: FloatArray
) -> ComplexArray:
    """Return how far to go along directions, at right angles to x, for the least quotients."""
    good = size > 0
    size = np.where(good, size, 1.0)
    length = np.sqrt(mixed.real**2 + mixed.imag**2)
    b = length / np.sqrt(size)
    gap = curved / size - quotient
    # Tangent of the angle by which (x, direction) has to turn.
    turn = -2 * b / (gap + np.sqrt(gap * gap + 4 * b * b) + 1e-300)
    phase = np.where(b > 0, mixed / np.where(b > 0, length, 1.0), 0)
    return np.where(good, turn * phase / np.sqrt(size), 0)


def _groups(rows: Rows) -> tuple[IntArray, ComplexArray, int]:
    count = len(rows.diagonal)
    group, phase = np.empty(count, np.int32), np.zeros(count, np.complex128)
    pairs = match_pairs(rows, group, phase)
    if not pairs:
        return group, phase, 0
    pair_rows = _coarser(rows, group, phase, pairs)
    second, second_phase = np.empty(pairs, np.int32), np.zeros(pairs, np.complex128)
    groups = match_pairs(pair_rows, second, second_phase)
    join_pairs(group, phase, second, second_phase)
    return group, phase, groups


def _coarser(rows: Rows, group: IntArray, phase: ComplexArray, count: int) -> Rows:
    members = np.argsort(group, kind="stable").astype(np.int32)
    members = members[np.searchsorted(group[members], 0) :]
    first = np.searchsorted(group[members], np.arange(count + 1)).astype(np.int32)
    room = len(rows.columns)
    coarse = Rows(
        np.zeros(count + 1, np.int32),
        np.empty(room, np.int32),
        np.empty(room, np.complex128),
        np.empty(count),
    )
    filled = coarse_rows(rows, group, phase, members, first, np.full(count, -1, np.int32), coarse)
    return coarse._replace(columns=coarse.columns[:filled].copy(), values=coarse.values[:filled].copy())


def _dense_factor(rows: Rows) -> ComplexArray:
    dense = np.diag(rows.diagonal).astype(np.complex128)
    for i, (start, stop) in enumerate(pairwise(rows.starts.tolist())):
        dense[i, rows.columns[start:stop]] += rows.values[start:stop]
    factor(dense)
    return dense
