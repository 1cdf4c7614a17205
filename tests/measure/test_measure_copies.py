"""Verbatim copies: known quilts, and the kernel against a plain twin."""

import itertools

import numpy as np
import pytest
from measured import quilt_of, quilt_of_nearest, warped

from upholster.errors import InputError
from upholster.geometry import MeshSurface, TriangleMesh
from upholster.measure import copies
from upholster.measure._kernels import largest_copied_square
from upholster.measure.samples import Window
from upholster.measure.trace import Trace, quilt_windows


def plain_largest_square(painted, below, right):
    best = 0
    height, width = painted.shape
    for row, column in itertools.product(range(height), range(width)):
        for side in range(1, min(height - row, width - column) + 1):
            rows, columns = slice(row, row + side), slice(column, column + side)
            if (
                painted[rows, columns].all()
                and below[row : row + side - 1, columns].all()
                and right[rows, column : column + side - 1].all()
            ):
                best = max(best, side)
    return best


@pytest.mark.parametrize("seed", range(6))
def test_largest_square_against_its_twin(seed):
    rng = np.random.default_rng(seed)
    for height, width, share in ((6, 7, 0.8), (9, 12, 0.95), (9, 12, 1.0), (1, 7, 0.8), (6, 1, 0.8)):
        painted = rng.random((height, width)) < share
        below = (rng.random((height - 1, width)) < share) & painted[:-1] & painted[1:]
        right = (rng.random((height, width - 1)) < share) & painted[:, :-1] & painted[:, 1:]
        found = largest_copied_square(painted, below, right, np.zeros(width, np.int32))
        assert found == plain_largest_square(painted, below, right)


def test_one_large_block_is_all_copied():
    found = copies(quilt_of([(16, 16, 32, 32, 30, 30, 0)]))
    assert found.ratio == 1
    assert found.longest == 32


@pytest.mark.parametrize("symmetry", range(8))
def test_blocks_that_continue_one_another_are_one_copy(symmetry):
    from upholster.quilt.placement import SYMMETRIES

    step = SYMMETRIES[symmetry].reshape(2, 2)
    places = [(8, 8), (8, 24), (24, 8), (24, 24)]
    sources = [np.array([32, 32]) + step @ (np.array(place) - 16) for place in places]
    blocks = [(*place, 16, 16, *source, symmetry) for place, source in zip(places, sources, strict=True)]
    assert copies(quilt_of(blocks)).ratio == 1
    assert copies(quilt_of(blocks)).longest == 32
    row, column, height, width, source_row, source_column, _ = blocks[3]
    blocks[3] = (row, column, height, width, source_row + 1, source_column, symmetry)
    found = copies(quilt_of(blocks))
    # The last block's two inner sides are cuts of 16 pairs each.
    assert found.ratio == pytest.approx(1 - 32 / (2 * 31 * 32))
    assert found.longest == 16


def test_equal_sources_under_other_turns_are_no_continuation():
    # Both would read texel (0, 0) from pixel (16, 34); turn 5 goes through the columns backwards.
    assert copies(quilt_of([(16, 8, 32, 16, 32, 42, 0), (16, 24, 32, 16, 32, 10, 5)])).longest == 16
    # And these texels of column 16 from pixels of column 50, from where the second goes back.
    assert copies(quilt_of([(16, 8, 32, 16, 32, 42, 0), (16, 24, 32, 16, 32, 42, 5)])).longest == 16


def test_what_lies_beyond_a_mesh_does_not_count():
    quilt = quilt_of([(16, 8, 32, 16, 30, 30, 0), (16, 24, 32, 16, 20, 20, 0)])
    assert copies(quilt).ratio < 1
    # A rectangle over the left half of the chart: the cut is its edge.
    positions = np.array([(0, 0, 0), (0, -1, 0), (0.5, 0, 0), (0.5, -1, 0)], float)
    corners = np.array([(0, 1, 2), (1, 3, 2)])
    places = np.array([(0, 0), (1, 0), (0, 0.5), (1, 0.5)], float)
    surface = MeshSurface(TriangleMesh(positions, corners), np.zeros(2, int), places[corners])
    found = copies(quilt.on(surface))
    assert (found.ratio, found.longest) == (1, 16)


def test_windows_see_what_the_whole_chart_does():
    rng = np.random.default_rng(1)
    flat = quilt_of(
        [(*rng.integers(0, 40, 2), 12, 12, *rng.integers(12, 50, 2), rng.integers(8)) for _ in range(40)],
        chart=(40, 36),
    )
    for quilt in (flat, warped(rng, 0.5, chart=(64, 60))):
        whole = Trace.of(quilt, quilt_windows(quilt)[0])
        assert len(np.unique(whole.owners)) > 4
        for window in (Window(0, 5, 7, 20, 11), Window(0, 0, 20, 40, 16)):
            part = Trace.of(quilt, window)
            np.testing.assert_array_equal(part.links(0), window.of(whole.links(0))[: window.height - 1])
            expected = window.of(whole.links(1))[:, : window.width - 1]
            np.testing.assert_array_equal(part.links(1)[:, : expected.shape[1]], expected)


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.5])
def test_links_through_a_field_against_the_quilts_own_sources(scale):
    rng = np.random.default_rng(7)
    quilt = warped(rng, scale, exemplar=(512, 512))
    trace = Trace.of(quilt, quilt_windows(quilt)[0])
    # What each placement would give everywhere, painted alone: exact, from the quilt itself.
    alone = []
    for n in range(len(quilt.placements)):
        placed = quilt.placements[n : n + 1].copy()
        shape = quilt.exemplar_shape
        alone.append(quilt_of_nearest(quilt.charts, placed, exemplar=shape, fields=quilt.fields).sources()[0])
    for axis, (one, other) in enumerate(
        ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])),
    ):
        first, second = trace.owners[one], trace.owners[other]
        far = np.zeros(first.shape)
        for a, b in set(zip(first.ravel().tolist(), second.ravel().tolist(), strict=True)):
            pair = (first == a) & (second == b)
            far[pair] = np.abs(alone[a][other] - alone[b][other]).max(axis=2)[pair]
        np.testing.assert_array_equal(trace.links(axis), far <= 8)
    found = copies(quilt)
    assert 1 - 2 / 16 < found.ratio <= 1
    assert found.longest >= 16


def test_a_single_texel_has_no_neighbours():
    with pytest.raises(InputError, match="neighbouring"):
        copies(quilt_of([(0, 0, 1, 1, 8, 8, 0)], chart=(1, 1)))
