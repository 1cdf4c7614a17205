"""What blocks are compared by: coefficients equal the transform's, the search equals a plain one."""

import numpy as np
import pytest

from upholster.codec.haar import dwt2, idwt2, subbands
from upholster.synthesis.paper._match_kernels import CandidateNumbers, Features, best_candidate
from upholster.synthesis.paper.matching import Candidates
from upholster.synthesis.working_form import working_form


@pytest.mark.parametrize("levels", [1, 2, 3, 4])
@pytest.mark.parametrize("shape", [(64, 64, 3), (70, 45, 1)])
def test_the_table_holds_the_transforms_coefficients(shape, levels):
    exemplar = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
    candidates = Candidates.of(exemplar, block=32, levels=levels)
    rows, columns = candidates.grid
    whole = working_form(exemplar)[: rows * 2**levels, : columns * 2**levels]
    bands = subbands(dwt2(whole, levels=levels), levels=levels)
    table = candidates.table.reshape(2, shape[2], rows, columns).transpose(0, 2, 3, 1)
    # Integer sums are the orthonormal coefficients times 2^levels.
    np.testing.assert_allclose(table[0], bands[f"LL{levels}"] * 2**levels, atol=1e-6)
    np.testing.assert_allclose(table[1], bands[f"HH{levels}"] * 2**levels, atol=1e-6)


def test_a_candidates_sub_bands_give_its_pixels_back():
    # Equations 5 and 6: on the LL grid, the inverse transform of a block's windows is the block itself.
    exemplar = np.random.default_rng(1).uniform(0, 1, (64, 64))
    bands = subbands(dwt2(exemplar))
    row, column = 2, 3
    block = np.empty((32, 32))
    for name, window in subbands(block).items():
        unit = 2 ** (3 - int(name[2]))
        y, x = row * unit, column * unit
        window[:] = bands[name][y : y + window.shape[0], x : x + window.shape[1]]
    np.testing.assert_allclose(idwt2(block), exemplar[16:48, 24:56], atol=1e-13)


@pytest.mark.parametrize("count", [1, 5, 8, 42])
def test_the_search_equals_a_plain_one(count):
    rng = np.random.default_rng(count)
    grid, tiles = (9, 11), 4
    table = rng.integers(0, 20, (6, grid[0] * grid[1])).astype(np.int32)
    bands = rng.integers(0, 6, count).astype(np.int32)
    places = rng.integers(0, tiles, (count, 2))
    offsets = (places[:, 0] * grid[1] + places[:, 1]).astype(np.int32)
    shape = grid[0] - tiles + 1, grid[1] - tiles + 1
    numbers = CandidateNumbers(3, 8, grid[1], *shape)
    for _ in range(20):
        values = rng.integers(0, 20, count).astype(np.int32)
        costs = {}
        for row in range(shape[0]):
            for column in range(shape[1]):
                start = row * grid[1] + column
                costs[start] = sum(
                    int(table[b, start + o] - v) ** 2 for b, o, v in zip(bands, offsets, values, strict=True)
                )
        plain = min(costs, key=lambda start: (costs[start], start))
        for chunk in (7, 2048):
            features = Features(bands, offsets, values, np.empty(chunk, np.int64))
            assert best_candidate(table, numbers, features, count) == plain


def test_among_equals_the_first_is_taken():
    table = np.zeros((2, 36), np.int32)
    zeros = np.zeros(3, np.int32)
    features = Features(zeros, zeros, zeros, np.empty(4, np.int64))
    assert best_candidate(table, CandidateNumbers(1, 8, 6, 3, 3), features, 3) == 0


def test_working_form_keeps_order_and_range():
    assert working_form(np.array([[[0], [255]]], np.uint8)).ravel().tolist() == [0, 1020]
    assert working_form(np.array([[[0], [65535]]], np.uint16)).ravel().tolist() == [0, 1023]
    assert working_form(np.array([[[-2.0], [0.0], [2.0]]], np.float32)).ravel().tolist() == [0, 512, 1023]
    assert working_form(np.full((2, 2, 1), 7.0, np.float32)).max() == 0
