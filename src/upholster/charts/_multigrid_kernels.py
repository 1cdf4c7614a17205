"""Hot loops of `upholster.charts.multigrid`: coarsening, the cycle over all levels, and the solvers.

A matrix is Hermitian. `starts` (n + 1,), `columns` and `values` hold its rows without the diagonal, which is
real and stored in `diagonal` (n,). A row's entries left of the diagonal come first: `middles` (n,) give the
position where those right of it begin.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import ComplexArray, FloatArray, IntArray
from upholster.runtime.jit import inline, kernel, shared, spliced

__all__ = [
    "GridLevels",
    "Rows",
    "Work",
    "coarse_rows",
    "conjugate_gradients",
    "factor",
    "follow_matching",
    "inner_by_part",
    "lower_quotients",
    "match_pairs",
    "prolong",
    "restrict",
]

_STRONG = 0.25
"""Two unknowns form a pair if their coupling is at least this share of the row's strongest one."""

_DOMINANT = 5.0
"""A row needs no coarser level if its diagonal exceeds its other entries by this factor: smoothing solves
it."""


class Rows(NamedTuple):
    """A Hermitian matrix, see the module."""

    starts: IntArray
    middles: IntArray
    columns: IntArray
    values: ComplexArray
    diagonal: FloatArray


class GridLevels(NamedTuple):
    """The matrices of all levels, concatenated, finest first.

    `firsts` (levels + 1, 2) give the positions where each level's unknowns and entries begin. `rows` holds
    all levels: a level has one `starts` more than unknowns, counted from its own first entry. `group` and
    `phase` are those of `match_pairs`; the last level has none. `factor` is the Cholesky factor of the last
    level's dense matrix, (0, 0) where that is too large.
    """

    firsts: NDArray[np.int64]
    rows: Rows
    group: IntArray
    phase: ComplexArray
    factor: ComplexArray


class Work(NamedTuple):
    """Scratch space of a cycle: `vectors` (7, unknowns of all levels); `stages` and `curved` by level."""

    vectors: ComplexArray
    stages: NDArray[np.int64]
    curved: FloatArray

    @classmethod
    def of(cls, levels: GridLevels) -> "Work":
        """Return scratch space for these levels."""
        count = len(levels.firsts)
        vectors = np.empty((7, len(levels.rows.diagonal)), np.complex128)
        return cls(vectors, np.empty(count, np.int64), np.empty(count))


_RIGHT, _FOUND, _FIRST, _MORE, _PRODUCT, _REST, _RESIDUAL = range(7)
"""The vectors of `Work` on a level, in order: its right side, the solution found for it, the result of a
first cycle, the result of a second cycle for the remainder, the matrix times the first, the remainder, a
cycle's residual."""


@inline
def _size(z: complex) -> float:
    # Square roots give the same result on every machine, hypot does not.
    size: float = np.sqrt(z.real * z.real + z.imag * z.imag)
    return size


@inline
def _copy(x: ComplexArray, out: ComplexArray) -> None:
    for i in range(len(x)):
        out[i] = x[i]


@inline
def _multiply(rows: Rows, x: ComplexArray, out: ComplexArray) -> None:
    """Put the matrix times x in `out`."""
    for i in range(len(x)):
        total = rows.diagonal[i] * x[i]
        for k in range(rows.starts[i], rows.starts[i + 1]):
            total += rows.values[k] * x[rows.columns[k]]
        out[i] = total


@inline
def _subtract_product(rows: Rows, x: ComplexArray, right: ComplexArray, out: ComplexArray) -> None:
    """Put `right` minus the matrix times x in `out`."""
    for i in range(len(x)):
        total = right[i] - rows.diagonal[i] * x[i]
        for k in range(rows.starts[i], rows.starts[i + 1]):
            total -= rows.values[k] * x[rows.columns[k]]
        out[i] = total


@inline
def _smooth_down(rows: Rows, right: ComplexArray, x: ComplexArray, rest: ComplexArray) -> None:
    # One Gauss-Seidel sweep from the first unknown to the last, starting from x = 0 whatever x holds. The
    # residual comes only from entries right of the diagonal.
    for i in range(len(x)):
        total = right[i]
        for k in range(rows.starts[i], rows.middles[i]):
            total -= rows.values[k] * x[rows.columns[k]]
        x[i] = total * (1.0 / rows.diagonal[i])
    for i in range(len(x)):
        total = 0j
        for k in range(rows.middles[i], rows.starts[i + 1]):
            total -= rows.values[k] * x[rows.columns[k]]
        rest[i] = total


@inline
def _smooth_up(rows: Rows, right: ComplexArray, x: ComplexArray) -> None:
    """One Gauss-Seidel sweep from the last unknown to the first."""
    for i in range(len(x) - 1, -1, -1):
        total = right[i]
        for k in range(rows.starts[i], rows.starts[i + 1]):
            total -= rows.values[k] * x[rows.columns[k]]
        x[i] = total * (1.0 / rows.diagonal[i])


@kernel
def match_pairs(rows: Rows, group: IntArray, phase: ComplexArray) -> int:
    """Pair unknowns by their strongest couplings, in the order of their numbers.

    `group` (n,) receives the pair's number, −1 for unknowns that need no coarser level. `phase` (n,) receives
    each unknown's value where the pair's is 1: 1 at its first member, the best-fitting phase at its second.
    Returns the number of pairs.
    """
    count = len(group)
    for i in range(count):
        total = 0.0
        for k in range(rows.starts[i], rows.starts[i + 1]):
            total += _size(rows.values[k])
        group[i] = -1 if rows.diagonal[i] > _DOMINANT * total else -2
    pairs = 0
    for i in range(count):
        if group[i] != -2:
            continue
        best, strongest, most = -1, 0.0, 0.0
        for k in range(rows.starts[i], rows.starts[i + 1]):
            size = _size(rows.values[k])
            most = max(most, size)
            if group[rows.columns[k]] == -2 and size > strongest:
                best, strongest = k, size
        group[i] = pairs
        phase[i] = 1.0
        if best >= 0 and strongest >= _STRONG * most:
            j = rows.columns[best]
            group[j] = pairs
            phase[j] = -np.conj(rows.values[best]) * (1.0 / strongest)
        pairs += 1
    return pairs


@kernel
def follow_matching(
    group: IntArray, phase: ComplexArray, second: IntArray, second_phase: ComplexArray
) -> None:
    """Compose one matching with the next, in place: `group` and `phase` then lead to the second's groups."""
    for i in range(len(group)):
        at = group[i]
        if at >= 0:
            group[i] = second[at]
            phase[i] *= second_phase[at]


@inline
def _list_members(group: IntArray, first: IntArray, members: IntArray) -> None:
    # Lists the unknowns group by group: those of g from first[g] up to first[g + 1].
    first[:] = 0
    for i in range(len(group)):
        if group[i] >= 0:
            first[group[i]] += 1
    total = 0
    for g in range(len(first)):
        total += first[g]
        first[g] = total  # where the list ends: it is filled from there
    for i in range(len(group) - 1, -1, -1):
        if group[i] >= 0:
            first[group[i]] -= 1
            members[first[group[i]]] = i


@inline
def _parted(rows: Rows, row: int, stop: int) -> Any:
    # Moves a row's entries left of the diagonal, up to `stop`, to its front; returns where they end.
    middle = rows.starts[row]
    for k in range(rows.starts[row], stop):
        if rows.columns[k] < row:
            column, value = rows.columns[k], rows.values[k]
            rows.columns[k], rows.values[k] = rows.columns[middle], rows.values[middle]
            rows.columns[middle], rows.values[middle] = column, value
            middle += 1
    return middle


@kernel
def coarse_rows(
    rows: Rows,
    group: IntArray,
    phase: ComplexArray,
    members: IntArray,
    first: IntArray,
    place: IntArray,
    coarse: Rows,
) -> int:
    """Fill the matrix of the groups, PᴴAP; returns its number of off-diagonal entries.

    `members` (n,), `first` (groups + 1,) and `place` (groups,) are scratch space. `coarse` has room for as
    many entries as `rows`.
    """
    _list_members(group, first, members)
    place[:] = -1
    filled = 0
    for g in range(len(first) - 1):
        coarse.starts[g] = filled
        diagonal = 0.0
        for m in range(first[g], first[g + 1]):
            i = members[m]
            diagonal += rows.diagonal[i] * (phase[i].real ** 2 + phase[i].imag ** 2)
            for k in range(rows.starts[i], rows.starts[i + 1]):
                j = rows.columns[k]
                h = group[j]
                if h < 0:
                    continue
                value = np.conj(phase[i]) * rows.values[k] * phase[j]
                if h == g:
                    diagonal += value.real
                elif place[h] >= coarse.starts[g]:
                    coarse.values[place[h]] += value
                else:
                    place[h] = filled
                    coarse.columns[filled] = h
                    coarse.values[filled] = value
                    filled += 1
        coarse.diagonal[g] = diagonal
        coarse.middles[g] = _parted(coarse, g, filled)
    coarse.starts[len(first) - 1] = filled
    return filled


@inline
def _restrict(group: IntArray, phase: ComplexArray, fine: ComplexArray, coarse: ComplexArray) -> None:
    """Put Pᴴ times `fine` in `coarse`."""
    coarse[:] = 0.0
    for i in range(len(group)):
        if group[i] >= 0:
            coarse[group[i]] += np.conj(phase[i]) * fine[i]


@inline
def _prolong(group: IntArray, phase: ComplexArray, coarse: ComplexArray, fine: ComplexArray) -> None:
    """Add P times `coarse` to `fine`."""
    for i in range(len(group)):
        if group[i] >= 0:
            fine[i] += phase[i] * coarse[group[i]]


@kernel
def factor(matrix: ComplexArray) -> None:
    """Replace a dense positive Hermitian matrix by its Cholesky factor, the lower triangle, in place."""
    for j in range(len(matrix)):
        pivot = matrix[j, j].real
        for k in range(j):
            pivot -= matrix[j, k].real ** 2 + matrix[j, k].imag ** 2
        root = np.sqrt(max(pivot, 1e-300))
        matrix[j, j] = root
        for i in range(j + 1, len(matrix)):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * np.conj(matrix[j, k])
            matrix[i, j] = total * (1.0 / root)


@inline
def _divide_out(lower: ComplexArray, right: ComplexArray, x: ComplexArray) -> None:
    """Solve with the factor from `factor`."""
    for i in range(len(x)):
        total = right[i]
        for k in range(i):
            total -= lower[i, k] * x[k]
        x[i] = total * (1.0 / lower[i, i].real)
    for i in range(len(x) - 1, -1, -1):
        x[i] *= 1.0 / lower[i, i].real
        for k in range(i):
            x[k] -= np.conj(lower[i, k]) * x[i]


@inline
def _inner(x: ComplexArray, y: ComplexArray) -> complex:
    """Return the sum of conj(x)·y."""
    total = 0j
    for i in range(len(x)):
        total += np.conj(x[i]) * y[i]
    return total


@inline
def _step(size: complex, x: ComplexArray, y: ComplexArray) -> None:
    """Add `size` times x to y."""
    for i in range(len(x)):
        y[i] += size * x[i]


@kernel
def restrict(group: IntArray, phase: ComplexArray, fine: ComplexArray, coarse: ComplexArray) -> None:
    """Put Pᴴ times `fine` in `coarse`."""
    _restrict(group, phase, fine, coarse)


@kernel
def prolong(group: IntArray, phase: ComplexArray, coarse: ComplexArray, fine: ComplexArray) -> None:
    """Add P times `coarse` to `fine`."""
    _prolong(group, phase, coarse, fine)


@spliced  # an inline function cannot return part of an array
def _rows_at(levels: GridLevels, depth: int) -> Rows:
    # The matrix of a level.
    first, last = levels.firsts[depth], levels.firsts[depth + 1]
    rows = levels.rows
    return Rows(
        rows.starts[first[0] + depth : last[0] + depth + 1],
        rows.middles[first[0] : last[0]],
        rows.columns[first[1] : last[1]],
        rows.values[first[1] : last[1]],
        rows.diagonal[first[0] : last[0]],
    )


@spliced  # an inline function cannot return part of an array
def _vector(levels: GridLevels, work: Work, depth: int, which: int) -> ComplexArray:
    # One of the vectors of a level.
    own: ComplexArray = work.vectors[which][levels.firsts[depth, 0] : levels.firsts[depth + 1, 0]]
    return own


@inline
def _solve_at_last(levels: GridLevels, work: Work, right: ComplexArray, x: ComplexArray, depth: int) -> None:
    if len(levels.factor):
        _divide_out(levels.factor, right, x)
    else:
        rows = _rows_at(levels, depth)
        _smooth_down(rows, right, x, _vector(levels, work, depth, _RESIDUAL))
        _smooth_up(rows, right, x)


@inline
def _take_first(levels: GridLevels, work: Work, depth: int) -> bool:
    # Takes the best multiple of the first cycle's result on a level; returns whether that is enough.
    first, found = _vector(levels, work, depth, _FIRST), _vector(levels, work, depth, _FOUND)
    right, product = _vector(levels, work, depth, _RIGHT), _vector(levels, work, depth, _PRODUCT)
    rest = _vector(levels, work, depth, _REST)
    _multiply(_rows_at(levels, depth), first, product)
    curved = _inner(first, product).real
    work.curved[depth] = curved
    if not curved > 0:
        _copy(first, found)
        return True
    share = _inner(first, right) * (1.0 / curved)
    for i in range(len(first)):
        rest[i] = right[i] - share * product[i]
        found[i] = share * first[i]
    return _inner(rest, rest).real <= 0.0625 * _inner(right, right).real


@inline
def _take_second(levels: GridLevels, work: Work, depth: int) -> None:
    # Adds the second cycle's result on a level, conjugate to the first one's.
    first, found = _vector(levels, work, depth, _FIRST), _vector(levels, work, depth, _FOUND)
    more, product = _vector(levels, work, depth, _MORE), _vector(levels, work, depth, _PRODUCT)
    along = np.conj(_inner(more, product)) * (1.0 / work.curved[depth])
    _step(-along, first, more)
    _multiply(_rows_at(levels, depth), more, product)
    curved = _inner(more, product).real
    if curved > 0:
        _step(_inner(more, _vector(levels, work, depth, _REST)) * (1.0 / curved), more, found)


@shared
def _cycle(levels: GridLevels, work: Work, right: ComplexArray, x: ComplexArray, top: int) -> None:
    # Puts an approximate solution for `right` on a level in x: one K-cycle, a slightly varying
    # preconditioner. Each level below is solved by one or two cycles, combined as in conjugate gradients.
    last = levels.firsts.shape[0] - 2
    if top == last:
        _solve_at_last(levels, work, right, x, top)
        return
    _copy(right, _vector(levels, work, top, _RIGHT))
    depth, work.stages[top] = top, 0
    while True:
        while depth < last:
            first = work.stages[depth] == 0
            own = _vector(levels, work, depth, _RIGHT if first else _REST)
            z, residual = _vector(levels, work, depth, _FIRST if first else _MORE), _RESIDUAL
            rest, rows = _vector(levels, work, depth, residual), _rows_at(levels, depth)
            _smooth_down(rows, own, z, rest)
            a, b = levels.firsts[depth, 0], levels.firsts[depth + 1, 0]
            depth += 1
            _restrict(levels.group[a:b], levels.phase[a:b], rest, _vector(levels, work, depth, _RIGHT))
            work.stages[depth] = 0
        _solve_at_last(
            levels, work, _vector(levels, work, last, _RIGHT), _vector(levels, work, last, _FOUND), last
        )
        while True:
            below = _vector(levels, work, depth, _FOUND)
            depth -= 1
            first = work.stages[depth] == 0
            own = _vector(levels, work, depth, _RIGHT if first else _REST)
            z = _vector(levels, work, depth, _FIRST if first else _MORE)
            a, b = levels.firsts[depth, 0], levels.firsts[depth + 1, 0]
            _prolong(levels.group[a:b], levels.phase[a:b], below, z)
            _smooth_up(_rows_at(levels, depth), own, z)
            if depth == top:
                _copy(z, x)
                return
            if not first:
                _take_second(levels, work, depth)
            elif not _take_first(levels, work, depth):
                work.stages[depth] = 1
                break


@kernel
def conjugate_gradients(
    levels: GridLevels,
    work: Work,
    right: ComplexArray,
    vectors: ComplexArray,
    tolerance: float,
    most: int,
    x: ComplexArray,
) -> None:
    """Solve the finest level's system by flexible conjugate gradients, starting from x.

    It ends when the residual's norm is at most `tolerance` times that of `right`, or after `most` steps.
    `vectors` (4, n) is scratch space.
    """
    rows = _rows_at(levels, 0)
    rest, direction, product, next_one = vectors[0], vectors[1], vectors[2], vectors[3]
    _subtract_product(rows, x, right, rest)
    enough = tolerance**2 * _inner(right, right).real
    direction[:], product[:] = 0.0, 0.0
    curved = 0.0
    for _ in range(most):
        if _inner(rest, rest).real <= enough:
            break
        _cycle(levels, work, rest, next_one, 0)
        along = _inner(product, next_one) * (1.0 / curved if curved > 0 else 0.0)
        for i in range(len(x)):
            direction[i] = next_one[i] - along * direction[i]
        _multiply(rows, direction, product)
        curved = _inner(direction, product).real
        if not curved > 0:
            break
        size = _inner(direction, rest) * (1.0 / curved)
        _step(size, direction, x)
        _step(-size, product, rest)


@inline
def _sum_by_part(
    part: IntArray, weights: FloatArray, x: ComplexArray, y: ComplexArray, out: ComplexArray
) -> None:
    out[:] = 0.0
    for i in range(len(x)):
        out[part[i]] += weights[i] * (np.conj(x[i]) * y[i])


@kernel
def inner_by_part(
    part: IntArray, weights: FloatArray, x: ComplexArray, y: ComplexArray, out: ComplexArray
) -> None:
    """Put each part's sum of weight·conj(x)·y in `out`; `part` (n,) is the part of each unknown."""
    _sum_by_part(part, weights, x, y, out)


@inline
def _best_step(quotient: float, mixed: complex, curved: float, size: float) -> complex:
    # The step along a direction orthogonal to x that minimizes the quotient.
    if not size > 0.0:
        return 0j
    length = _size(mixed)
    b = length / np.sqrt(size)
    gap = curved / size - quotient
    # Tangent of the angle by which to rotate in the plane of x and the direction.
    turn = -2.0 * b / (gap + np.sqrt(gap * gap + 4.0 * b * b) + 1e-300)
    return mixed * (turn / (length * np.sqrt(size))) if length > 0.0 else 0j


@kernel
def lower_quotients(
    levels: GridLevels,
    work: Work,
    depth: int,
    rows: Rows,
    mass: FloatArray,
    part: IntArray,
    shift: FloatArray,
    limits: tuple[float, int],
    vectors: ComplexArray,
    sums: ComplexArray,
    x: ComplexArray,
) -> None:
    """Lower each part's quotient xᴴAx / xᴴMx by preconditioned conjugate gradients with exact steps.

    `rows` is A, and x has length 1 in each part. The levels are those of A + shift·M; `depth` is the one to
    work on. A part stops when a step lowers its quotient by less than the share ``limits[0]``; all stop after
    ``limits[1]`` steps. `vectors` (6, n) and `sums` (8, parts) are scratch space.
    """
    product, direction, image = vectors[0], vectors[1], vectors[2]
    next_one, slope, last = vectors[3], vectors[4], vectors[5]
    quotient, now, change, before = sums[0], sums[1], sums[2], sums[3]
    mixed, curved, size, moving = sums[4], sums[5], sums[6], sums[7]
    count = len(x)
    _multiply(rows, x, product)
    before[:], moving[:], direction[:], last[:] = 1.0, 1.0, 0.0, 0.0
    for done in range(limits[1]):
        _plain_by_part(part, x, product, quotient)
        for i in range(count):
            slope[i] = product[i] - (quotient[part[i]].real * mass[i]) * x[i]
        _cycle(levels, work, slope, next_one, depth)
        _plain_by_part(part, next_one, slope, now)
        _plain_by_part(part, next_one, last, change)
        resting = True
        for p in range(len(now)):
            if not now[p].real > limits[0] * (max(quotient[p].real, 0.0) + shift[p]):
                moving[p] = 0.0
            resting = resting and moving[p].real == 0.0
            grown = max(now[p].real - change[p].real, 0.0)
            change[p] = grown / before[p].real if done and before[p].real > 0.0 else 0.0
        if resting:
            break
        for i in range(count):
            direction[i] = next_one[i] + change[part[i]].real * direction[i]
        _sum_by_part(part, mass, x, direction, mixed)
        for i in range(count):
            direction[i] -= mixed[part[i]] * x[i]
        _multiply(rows, direction, image)
        _plain_by_part(part, direction, product, mixed)
        _plain_by_part(part, direction, image, curved)
        _sum_by_part(part, mass, direction, direction, size)
        for p in range(len(now)):
            fall = _best_step(quotient[p].real, mixed[p], curved[p].real, size[p].real)
            mixed[p] = fall if moving[p].real > 0.0 else 0j
            before[p] = now[p].real
        for i in range(count):
            x[i] += mixed[part[i]] * direction[i]
            product[i] += mixed[part[i]] * image[i]
            last[i] = slope[i]
        _sum_by_part(part, mass, x, x, size)
        for p in range(len(now)):
            size[p] = 1.0 / np.sqrt(size[p].real)
        for i in range(count):
            x[i] *= size[part[i]].real
            product[i] *= size[part[i]].real


@inline
def _plain_by_part(part: IntArray, x: ComplexArray, y: ComplexArray, out: ComplexArray) -> None:
    out[:] = 0.0
    for i in range(len(x)):
        out[part[i]] += np.conj(x[i]) * y[i]
