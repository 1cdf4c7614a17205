"""Minimum cuts on grids against brute force and SciPy."""

import itertools

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import maximum_flow

from upholster.errors import InputError
from upholster.methods.mincut import FREE, NEW, OLD, OUTSIDE, minimum_cut


def random_grid(rng, height, width, most=50):
    right = rng.integers(0, most, (height, width - 1))
    down = rng.integers(0, most, (height - 1, width))
    seeds = rng.choice([FREE, OLD, NEW, OUTSIDE], (height, width), p=[0.6, 0.15, 0.15, 0.1]).astype(np.int8)
    return right, down, seeds


def cut_cost(right, down, seeds, new):
    inside = seeds != OUTSIDE
    across = right * ((new[:, 1:] != new[:, :-1]) & inside[:, 1:] & inside[:, :-1])
    along = down * ((new[1:] != new[:-1]) & inside[1:] & inside[:-1])
    return int(across.sum() + along.sum())


def scipy_flow(right, down, seeds):
    height, width = seeds.shape
    node = np.arange(height * width).reshape(height, width)
    source, sink = height * width, height * width + 1
    inside = seeds != OUTSIDE
    rows, columns, values = [], [], []

    def join(a, b, capacity, keep):
        for start, end in ((a, b), (b, a)):
            rows.extend(start[keep])
            columns.extend(end[keep])
            values.extend(capacity[keep])

    join(node[:, :-1], node[:, 1:], right, inside[:, :-1] & inside[:, 1:])
    join(node[:-1], node[1:], down, inside[:-1] & inside[1:])
    for ends, held_as in (((source, None), NEW), ((None, sink), OLD)):
        for n in node[seeds == held_as]:
            rows.append(ends[0] if ends[0] is not None else n)
            columns.append(ends[1] if ends[1] is not None else n)
            values.append(10**8)
    size = height * width + 2
    matrix = coo_array((np.array(values, np.int32), (rows, columns)), shape=(size, size)).tocsr()
    return maximum_flow(matrix, source, sink).flow_value


@pytest.mark.parametrize("seed", range(20))
def test_equals_brute_force_and_is_the_smallest_of_the_best(seed):
    rng = np.random.default_rng(seed)
    right, down, seeds = random_grid(rng, 3, 4, most=6)
    cells, cost = minimum_cut(right, down, seeds)
    free = np.argwhere(seeds == FREE)
    best, smallest = None, None
    for choice in itertools.product([0, 1], repeat=len(free)):
        new = (seeds == NEW).astype(np.uint8)
        new[tuple(free.T)] = choice
        found = cut_cost(right, down, seeds, new)
        if best is None or found < best or (found == best and new.sum() < smallest.sum()):
            best, smallest = found, new
    assert cost == best == cut_cost(right, down, seeds, cells)
    np.testing.assert_array_equal(cells, smallest)


@pytest.mark.parametrize("seed", range(40))
def test_equals_scipy(seed):
    rng = np.random.default_rng(seed)
    right, down, seeds = random_grid(rng, *rng.integers(1, 20, 2))
    cells, cost = minimum_cut(right, down, seeds)
    assert cost == scipy_flow(right, down, seeds)
    assert cost == cut_cost(right, down, seeds, cells)
    assert (cells[seeds == NEW] == 1).all()
    assert (cells[(seeds == OLD) | (seeds == OUTSIDE)] == 0).all()


def test_large_capacities_do_not_overflow():
    right = np.full((3, 3), 2**53, np.int64)
    down = np.full((2, 4), 2**53, np.int64)
    seeds = np.zeros((3, 4), np.int8)
    seeds[:, 0], seeds[:, -1] = OLD, NEW
    assert minimum_cut(right, down, seeds)[1] == 3 * 2**53


@pytest.mark.parametrize("change", ["shape", "negative", "huge"])
def test_bad_input_is_refused(change):
    right, down, seeds = np.ones((2, 2), np.int64), np.ones((1, 3), np.int64), np.zeros((2, 3), np.int8)
    if change == "shape":
        right = right[:1]
    else:
        right[0, 0] = -1 if change == "negative" else 2**54
    with pytest.raises(InputError):
        minimum_cut(right, down, seeds)
