"""Hot loops of `upholster.charts.multigrid`: products, smoothing, coarsening, dense solutions.

A matrix is Hermitian: `starts` (n + 1,), `columns` and `values` hold its rows without the diagonal, which is
real and stands in `diagonal` (n,).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.types import FloatArray, IntArray

__all__ = [
    "Rows",
    "coarse_rows",
    "divide_out",
    "factor",
    "inner",
    "inner_by_part",
    "join_pairs",
    "match_pairs",
    "multiply",
    "prolong",
    "restrict",
    "smooth_down",
    "smooth_up",
    "step",
    "subtract_product",
]

ComplexArray = NDArray[np.complex128]

_STRONG = 0.25
"""A coupling at least this part of a row's strongest one makes a pair."""

_DOMINANT = 5.0
"""A diagonal so many times its row's other entries needs no coarser level: smoothing solves it."""


class Rows(NamedTuple):
    """A Hermitian matrix, see the module."""

    starts: IntArray
    columns: IntArray
    values: ComplexArray
    diagonal: FloatArray


@inline
def _size(z: complex) -> float:
    # Square roots are the same on every machine, hypot is not.
    size: float = np.sqrt(z.real * z.real + z.imag * z.imag)
    return size


@kernel
def multiply(rows: Rows, x: ComplexArray, out: ComplexArray) -> None:
    """Put the matrix times x in `out`."""
    for i in range(len(x)):
        total = rows.diagonal[i] * x[i]
        for k in range(rows.starts[i], rows.starts[i + 1]):
            total += rows.values[k] * x[rows.columns[k]]
        out[i] = total


@kernel
def subtract_product(rows: Rows, x: ComplexArray, right: ComplexArray, out: ComplexArray) -> None:
    """Put `right` less the matrix times x in `out`."""
    for i in range(len(x)):
        total = right[i] - rows.diagonal[i] * x[i]
        for k in range(rows.starts[i], rows.starts[i + 1]):
            total -= rows.values[k] * x[rows.columns[k]]
        out[i] = total


@kernel
def smooth_down(rows: Rows, right: ComplexArray, x: ComplexArray) -> None:
    """One sweep of Gauss and Seidel from the first unknown to the last, from x = 0 whatever it holds."""
    for i in range(len(x)):
        total = right[i]
        for k in range(rows.starts[i], rows.starts[i + 1]):
            j = rows.columns[k]
            if j < i:
                total -= rows.values[k] * x[j]
        x[i] = total * (1.0 / rows.diagonal[i])


@kernel
def smooth_up(rows: Rows, right: ComplexArray, x: ComplexArray) -> None:
    """One sweep of Gauss and Seidel from the last unknown to the first."""
    for i in range(len(x) - 1, -1, -1):
        total = right[i]
        for k in range(rows.starts[i], rows.starts[i + 1]):
            total -= rows.values[k] * x[rows.columns[k]]
        x[i] = total * (1.0 / rows.diagonal[i])


@kernel
def match_pairs(rows: Rows, group: IntArray, phase: ComplexArray) -> int:
    """Join unknowns to pairs by their strongest couplings, in the order of their numbers.

    `group` (n,) gets the pair's number, −1 for unknowns that need no coarser level; `phase` (n,) what one on
    the pair means there: 1 at its first member, what fits it best at the second. Returns how many pairs.
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
def join_pairs(group: IntArray, phase: ComplexArray, second: IntArray, second_phase: ComplexArray) -> None:
    """Follow one matching by the next, in place: `group` and `phase` then lead to the second's groups."""
    for i in range(len(group)):
        at = group[i]
        if at >= 0:
            group[i] = second[at]
            phase[i] *= second_phase[at]


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
    """Fill the matrix of the groups, PᴴAP; returns how many entries it has beside the diagonal.

    `members` lists the unknowns group by group, from `first` (groups + 1,) on; `place` (groups,) is −1.
    `coarse` has room for as many entries as `rows`.
    """
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
    coarse.starts[len(first) - 1] = filled
    return filled


@kernel
def restrict(group: IntArray, phase: ComplexArray, fine: ComplexArray, coarse: ComplexArray) -> None:
    """Put Pᴴ times `fine` in `coarse`."""
    coarse[:] = 0.0
    for i in range(len(group)):
        if group[i] >= 0:
            coarse[group[i]] += np.conj(phase[i]) * fine[i]


@kernel
def prolong(group: IntArray, phase: ComplexArray, coarse: ComplexArray, fine: ComplexArray) -> None:
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


@kernel
def divide_out(lower: ComplexArray, right: ComplexArray, x: ComplexArray) -> None:
    """Solve with the factor that `factor` made."""
    for i in range(len(x)):
        total = right[i]
        for k in range(i):
            total -= lower[i, k] * x[k]
        x[i] = total * (1.0 / lower[i, i].real)
    for i in range(len(x) - 1, -1, -1):
        x[i] *= 1.0 / lower[i, i].real
        for k in range(i):
            x[k] -= np.conj(lower[i, k]) * x[i]


@kernel
def inner(x: ComplexArray, y: ComplexArray) -> complex:
    """Return the sum of conj(x)·y."""
    total = 0j
    for i in range(len(x)):
        total += np.conj(x[i]) * y[i]
    return total


@kernel
def step(size: complex, x: ComplexArray, y: ComplexArray) -> None:
    """Add `size` times x to y."""
    for i in range(len(x)):
        y[i] += size * x[i]


@kernel
def inner_by_part(
    part: IntArray, weights: FloatArray, x: ComplexArray, y: ComplexArray, out: ComplexArray
) -> None:
    """Put each part's sum of weight·conj(x)·y in `out`; `part` (n,) says where an unknown belongs."""
    out[:] = 0.0
    for i in range(len(x)):
        out[part[i]] += weights[i] * (np.conj(x[i]) * y[i])
