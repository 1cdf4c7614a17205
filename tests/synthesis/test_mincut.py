"""Minimum cuts on grids against brute force and SciPy."""

import itertools

import numpy as np
import pytest
from plain_cut import FREE, NEW, OLD, OUTSIDE, cut_cost, plain_cut

from upholster.synthesis._cut_kernels import cut_grid, cut_weighted


def found_cut(right, down, seeds):
    """Return what the kernel finds: the new side's cells, and the flow."""
    height, width = seeds.shape
    residual = np.zeros((4, height, width), np.int64)
    residual[0, :, :-1] = residual[2, :, 1:] = right
    residual[1, :-1] = residual[3, 1:] = down
    work, cells = np.empty((4, height * width), np.int32), np.empty(height * width, np.uint8)
    cost = cut_grid(residual.reshape(4, -1), seeds.reshape(-1), width, work, cells)
    return cells.reshape(height, width), int(cost)


def random_grid(rng, height, width, most=50):
    right = rng.integers(0, most, (height, width - 1))
    down = rng.integers(0, most, (height - 1, width))
    seeds = rng.choice([FREE, OLD, NEW, OUTSIDE], (height, width), p=[0.6, 0.15, 0.15, 0.1]).astype(np.int8)
    return right, down, seeds


@pytest.mark.parametrize("seed", range(20))
def test_equals_brute_force_and_is_the_smallest_of_the_best(seed):
    rng = np.random.default_rng(seed)
    right, down, seeds = random_grid(rng, 3, 4, most=6)
    cells, cost = found_cut(right, down, seeds)
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
    # The oracle that other tests use says the same.
    other, price = plain_cut(right, down, seeds)
    assert price == best
    np.testing.assert_array_equal(other, smallest)


@pytest.mark.parametrize("seed", range(20))
def test_equals_scipy(seed):
    rng = np.random.default_rng(seed)
    right, down, seeds = random_grid(rng, *rng.integers(1, 20, 2))
    cells, cost = found_cut(right, down, seeds)
    wanted, price = plain_cut(right, down, seeds)
    assert cost == price == cut_cost(right, down, seeds, cells)
    np.testing.assert_array_equal(cells, wanted)
    assert (cells[seeds == NEW] == 1).all()
    assert (cells[(seeds == OLD) | (seeds == OUTSIDE)] == 0).all()


def test_large_capacities_do_not_overflow():
    right = np.full((3, 3), 2**53, np.int64)
    down = np.full((2, 4), 2**53, np.int64)
    seeds = np.zeros((3, 4), np.int8)
    seeds[:, 0], seeds[:, -1] = OLD, NEW
    assert found_cut(right, down, seeds)[1] == 3 * 2**53


def weighted_cost(residual, balance, new):
    """Return what a choice of sides costs: cells that stay or become new, and steps from new to old ones."""
    old = 1 - new.astype(np.int64)
    total = (np.maximum(balance, 0) * old).sum() + (np.maximum(-balance, 0) * new).sum()
    total += (residual[0, :, :-1] * new[:, :-1] * old[:, 1:]).sum()
    total += (residual[1, :-1] * new[:-1] * old[1:]).sum()
    total += (residual[2, :, 1:] * new[:, 1:] * old[:, :-1]).sum()
    return total + (residual[3, 1:] * new[1:] * old[:-1]).sum()


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize("seed", range(12))
def test_weighted_cells_choose_the_cheapest_and_the_fewest_new(seed):
    rng = np.random.default_rng(seed)
    height, width = 3, 4
    residual = rng.integers(0, 9, (4, height, width))
    residual[0, :, -1] = residual[1, -1] = residual[2, :, 0] = residual[3, 0] = 0
    balance = rng.integers(-12, 13, (height, width))
    prices = {
        choice: weighted_cost(residual, balance, np.array(choice).reshape(height, width))
        for choice in itertools.product([0, 1], repeat=height * width)
    }
    best = min(prices.values())
    smallest = min((sum(choice), choice) for choice, price in prices.items() if price == best)[1]
    work, cells = np.empty((4, height * width), np.int32), np.empty(height * width, np.uint8)
    flat = residual.reshape(4, -1).copy()
    cost = cut_weighted(flat, balance.reshape(-1).copy(), width, work, cells)
    assert cost == best
    assert tuple(cells.tolist()) == smallest
