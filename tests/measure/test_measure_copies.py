"""Verbatim copies: known quilts, and the kernel against a plain twin."""

import itertools

import numpy as np
import pytest
from measured import quilt_of

from upholster.errors import InputError
from upholster.measure import copies
from upholster.measure._kernels import largest_square
from upholster.measure.copies import copy_labels, copy_maps, quilt_windows
from upholster.measure.samples import Window
from upholster.synthesis.quilt import Chart, Quilt


def plain_largest_square(labels):
    best = 0
    height, width = labels.shape
    for row, column in itertools.product(range(height), range(width)):
        for side in range(1, min(height - row, width - column) + 1):
            part = labels[row : row + side, column : column + side]
            if part.min() >= 0 and part.min() == part.max():
                best = max(best, side)
    return best


@pytest.mark.parametrize("seed", range(6))
def test_largest_square_against_its_twin(seed):
    rng = np.random.default_rng(seed)
    small = rng.integers(-1, 2, (6, 7)).astype(np.int32)
    holed = (rng.random((9, 12)) > 0.1).astype(np.int32)
    for labels in (small, np.kron(small, np.ones((3, 3), np.int32)), holed, small[:1], small[:, :1]):
        found = largest_square(np.ascontiguousarray(labels), np.zeros(labels.shape[1], np.int32))
        assert found == plain_largest_square(labels)


def test_one_large_block_is_all_copied():
    found = copies(quilt_of([(16, 16, 32, 32, 30, 30, 0)]))
    assert found.ratio == 1
    assert found.longest == 32


@pytest.mark.parametrize("turn", range(8))
def test_blocks_that_continue_one_another_are_one_copy(turn):
    from upholster.synthesis._paint_kernels import TURNS

    step = TURNS[turn].reshape(2, 2)
    places = [(8, 8), (8, 24), (24, 8), (24, 24)]
    sources = [np.array([32, 32]) + step @ (np.array(place) - 16) for place in places]
    blocks = [(*place, 16, 16, *source, turn) for place, source in zip(places, sources, strict=True)]
    assert copies(quilt_of(blocks)).ratio == 1
    assert copies(quilt_of(blocks)).longest == 32
    row, column, height, width, source_row, source_column, _ = blocks[3]
    blocks[3] = (row, column, height, width, source_row + 1, source_column, turn)
    found = copies(quilt_of(blocks))
    # The last block's two inner sides are cuts of 16 pairs each.
    assert found.ratio == pytest.approx(1 - 32 / (2 * 31 * 32))
    assert found.longest == 16


def test_equal_sources_under_other_turns_are_no_continuation():
    # Both would read texel (0, 0) from pixel (16, 34); turn 5 goes through the columns backwards.
    assert copies(quilt_of([(16, 8, 32, 16, 32, 42, 0), (16, 24, 32, 16, 32, 10, 5)])).longest == 16


def test_texels_that_nothing_paints_are_no_copies():
    found = copies(quilt_of([(16, 8, 32, 16, 30, 30, 0)]))
    assert found.longest == 16
    assert found.ratio == pytest.approx((15 * 32 + 16 * 31) / (2 * 31 * 32))
    assert copies(quilt_of([])).ratio == 0


def test_windows_see_what_the_whole_chart_does():
    rng = np.random.default_rng(1)
    quilt = quilt_of(
        [(*rng.integers(0, 40, 2), 12, 12, *rng.integers(12, 50, 2), rng.integers(8)) for _ in range(40)],
        chart=(40, 36),
    )
    maps = copy_maps(quilt)
    whole = copy_labels(quilt, quilt_windows(quilt)[0], maps)
    assert len(np.unique(whole)) > 10
    for window in (Window(0, 5, 7, 20, 11), Window(0, 0, 30, 40, 6)):
        np.testing.assert_array_equal(copy_labels(quilt, window, maps), window.of(whole))


def test_a_single_texel_has_no_neighbours():
    with pytest.raises(InputError, match="neighbouring"):
        copies(Quilt((Chart(0, 1, 1),), (32, 32), quilt_of([]).placements, np.zeros(0, np.uint8)))
