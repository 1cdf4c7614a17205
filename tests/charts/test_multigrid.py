"""The solver of sparse systems against SciPy's: solutions, smallest eigenvectors, coarser levels."""

import numpy as np
import pytest
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg

from upholster.charts.multigrid import Multigrid, hermitian, smallest_eigenvectors, solve


def random_field(rows, columns, seed, cut=False, noise=0.3, spread=2.0):
    """Return a grid's matrix with random weights and phases, both ways, and its unknowns' parts."""
    rng = np.random.default_rng(seed)
    number = np.arange(rows * columns).reshape(rows, columns)
    across = [number[:, :-1].ravel(), number[:, 1:].ravel()]
    down = [number[:-1].ravel(), number[1:].ravel()]
    first, second = (np.concatenate(pair).astype(np.int32) for pair in zip(across, down, strict=True))
    if cut:
        keep = ~((first % columns == 9) & (second == first + 1))
        first, second = first[keep], second[keep]
    weights = np.exp(spread * rng.standard_normal(len(first)))
    values = -weights * np.exp(1j * noise * rng.standard_normal(len(first)))
    count = rows * columns
    diagonal = np.bincount(first, weights, count) + np.bincount(second, weights, count)
    matrix = hermitian(count, first, second, values, diagonal)
    full = sparse.csr_matrix((matrix.values, matrix.columns, matrix.starts), (count, count))
    part = (number % columns > 9).ravel().astype(np.int32) if cut else np.zeros(count, np.int32)
    return matrix, (full + sparse.diags(diagonal, dtype=float)).tocsc(), part


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (9, 8), (60, 50)])
def test_solutions_are_scipys(size):
    rows, full, _ = random_field(*size, seed=1)
    force = np.linspace(0.001, 0.1, len(rows.diagonal))
    rows = rows._replace(diagonal=rows.diagonal + force)
    right = np.random.default_rng(2).standard_normal((len(force), 2)) @ (1, 1j)
    found = solve(Multigrid(rows), right, np.zeros(len(force), complex), tolerance=1e-10)
    wanted = linalg.spsolve((full + sparse.diags(force, dtype=float)).tocsc(), right)
    np.testing.assert_allclose(found, wanted, atol=1e-7 * np.abs(wanted).max())


def test_few_cycles_are_enough_whatever_the_number_of_unknowns():
    for size in (30, 120):
        rows, full, _ = random_field(size, size, seed=3, noise=0.02, spread=0.5)
        rows = rows._replace(diagonal=rows.diagonal + 1e-4)
        right = np.random.default_rng(4).standard_normal((size * size, 2)) @ (1, 1j)
        found = solve(Multigrid(rows), right, np.zeros(size * size, complex), tolerance=1e-6, most=30)
        rest = full @ found + 1e-4 * found - right
        assert np.linalg.norm(rest) <= 1.01e-6 * np.linalg.norm(right)


@pytest.mark.parametrize("cut", [False, True])
def test_smallest_eigenvectors_are_scipys_part_by_part(cut):
    rows, full, part = random_field(24, 25, seed=5, cut=cut)
    mass = np.random.default_rng(6).uniform(0.5, 2, len(part))
    parts = part.max() + 1
    found = smallest_eigenvectors(
        rows, mass, part, np.ones(len(part), complex), shift=np.full(parts, 0.01), tolerance=1e-9
    )
    for k in range(parts):
        inside = part == k
        block, weights = full[inside][:, inside], sparse.diags(mass[inside], dtype=float)
        value, vector = linalg.eigsh(block, k=1, M=weights.tocsc(), sigma=-0.01)
        x = found[inside]
        assert (x.conj() @ (weights @ x)).real == pytest.approx(1)
        assert (x.conj() @ (block @ x)).real == pytest.approx(value[0], rel=1e-5)
        assert abs(vector[:, 0].conj() @ (weights @ x)) == pytest.approx(1, abs=1e-4)


def test_a_matrix_is_hermitian_and_has_each_entry_once():
    rows, full, _ = random_field(5, 6, seed=7)
    assert abs(full - full.getH()).max() == 0
    assert len(rows.values) == 2 * (4 * 6 + 5 * 5)
