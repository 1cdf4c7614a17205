"""Where a chart's blocks lie: they cover what is needed, fit the exemplar, and read the level that fits."""

import numpy as np
import pytest

from upholster.methods.quilt._block_kernels import COLUMN, LEFT, ROW, TOP
from upholster.methods.quilt.grid import BlockGrid, coarse_cells
from upholster.quilt import Chart
from upholster.quilt.displacement import warped_sources
from upholster.quilt.placement import PLACEMENT
from upholster.quilt.warp_field import WarpField


def field_of(matrix):
    return WarpField.quantised(np.tile(np.asarray(matrix, float), (12, 12, 1, 1)))


def rotation(scale, degrees=0.0):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return scale * np.array([[c, s], [-s, c]])


IDENTITY = WarpField.identity()
FIELDS = [
    IDENTITY,
    *(field_of(rotation(*args)) for args in [(0.3, 0), (0.8, 20), (1.4, 45), (3, -80), (9, 10)]),
]


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("open_sides", [set(), {0}, {1, 2}, {0, 1, 2, 3}])
def test_blocks_cover_what_is_needed(field, open_sides):
    for size in ((1, 1), (7, 130), (90, 75), (200, 40)):
        grid = BlockGrid.of(Chart(0, *size), field, (128, 128), 40, None)
        need = grid.need(open_sides)
        top, bottom, left, right = need
        assert [top < 0, right > size[1], bottom > size[0], left < 0] == [n in open_sides for n in range(4)]
        assert top <= 0
        assert left <= 0
        assert bottom >= size[0]
        assert right >= size[1]
        counts = np.zeros((bottom - top, right - left), int)
        blocks = grid.blocks(need)
        across = grid.across(need)
        for n, block in enumerate(blocks):
            first = block[ROW] - grid.height // 2 - top, block[COLUMN] - grid.width // 2 - left
            assert min(first) >= 0  # in raster order, from the first corner on
            counts[first[0] : first[0] + grid.height, first[1] : first[1] + grid.width] += 1
            assert block[LEFT] == (n - 1 if n % across else -1)
            assert block[TOP] == (n - across if n >= across else -1)
        assert counts.min() >= 1
        # and none in vain: the last ones of a row or a column begin within what is needed
        assert len(blocks) % across == 0
        for n, steps, end in (
            (across, grid.width - grid.overlap_columns, counts.shape[1]),
            (len(blocks) // across, grid.height - grid.overlap_rows, counts.shape[0]),
        ):
            assert n == 1 or (n - 1) * steps < end


@pytest.mark.parametrize("field", FIELDS)
def test_sizes_fit_together(field):
    grid = BlockGrid.of(Chart(0, 90, 75), field, (128, 100), 40, None)
    assert grid.mask_cell == 2 * grid.sample
    for side, overlap in (
        (grid.height, grid.overlap_rows),
        (grid.width, grid.overlap_columns),
    ):
        assert side % grid.mask_cell == 0
        assert side >= 16
        assert 4 * grid.sample <= overlap <= side // 2
    assert grid.cells * grid.mask_cell**2 == grid.height * grid.width


def test_large_blocks_have_coarse_masks():
    large = Chart(0, 300, 300)
    found = coarse_cells([large], [IDENTITY], {44, 48})
    kinds = [found[44], found[48]]
    assert kinds == [False, True]
    fine, coarse = (BlockGrid.of(large, IDENTITY, (256, 256), 48, None, coarse=kind) for kind in kinds)
    assert fine.mask_cell == 2
    assert coarse.mask_cell == 4
    assert coarse.height % 4 == 0
    # What counts is the chart where they have the fewest texels.
    small = field_of(rotation(3.9))
    assert coarse_cells([large, large], [IDENTITY, small], {92, 96}) == {92: False, 96: True}


def test_small_blocks_of_a_minified_texture_overlap_by_four_cells():
    for scale in (1.5, 4, 9):
        grid = BlockGrid.of(Chart(0, 300, 300), field_of(rotation(scale)), (512, 512), 40, None)
        assert min(grid.overlap_rows, grid.overlap_columns) >= 8 >= 4 * grid.mask_cell
    assert BlockGrid.of(Chart(0, 300, 300), field_of(rotation(4)), (512, 512), 40, 12).overlap_rows == 4


def test_a_texel_is_a_pixel_without_a_field():
    grid = BlockGrid.of(Chart(0, 90, 75), IDENTITY, (128, 128), 40, 12)
    assert (grid.height, grid.width, grid.overlap_rows, grid.overlap_columns) == (40, 40, 12, 12)
    assert (grid.level, grid.sample, grid.mask_cell) == (0, 1, 2)
    assert BlockGrid.of(Chart(0, 90, 75), IDENTITY, (128, 128), 40, None).overlap_rows == 12
    assert BlockGrid.of(Chart(0, 90, 75), IDENTITY, (128, 128), 30, None).overlap_rows == 8


@pytest.mark.parametrize(
    ("scale", "level", "sample"),
    [
        (0.24, 0, 4),
        (0.34, 0, 3),
        (0.5, 0, 2),
        (1, 0, 1),
        (1.3, 0, 1),
        (1.5, 1, 1),
        (2, 1, 1),
        (4, 2, 1),
        (8, 3, 1),
    ],
)
def test_blocks_have_their_size_in_pixels(scale, level, sample):
    grid = BlockGrid.of(Chart(0, 300, 300), field_of(rotation(scale, 5)), (256, 256), 40, 12)
    assert (grid.level, grid.sample) == (level, sample)
    wanted = max(16, 40 / scale)
    assert abs(grid.height - wanted) <= grid.mask_cell
    assert abs(grid.overlap_rows - 0.3 * wanted) <= grid.mask_cell + 4 * grid.sample * (scale > 2)


def test_uneven_texels_make_oblong_blocks():
    grid = BlockGrid.of(Chart(0, 300, 300), field_of([[0.5, 0], [0, 1]]), (256, 256), 40, 12)
    assert abs(grid.height - 80) <= 2
    assert abs(grid.width - 40) <= 2


def test_no_level_is_smaller_than_a_few_pixels():
    assert BlockGrid.of(Chart(0, 300, 300), field_of(rotation(30)), (64, 40), 20, None).level == 1
    assert BlockGrid.of(Chart(0, 300, 300), field_of(rotation(30)), (8, 8), 20, None).level == 0


@pytest.mark.parametrize("degrees", [0, 30, 45, 90, 200])
def test_a_block_reads_no_more_than_three_quarters_of_the_exemplar(degrees):
    field = field_of(rotation(1.0, degrees))
    grid = BlockGrid.of(Chart(0, 300, 300), field, (96, 128), 300, None)
    at = 16 * np.mgrid[: grid.height, : grid.width].reshape(2, -1) + 8
    owner = np.zeros(at.shape[1], PLACEMENT)
    owner["row"], owner["column"] = 8 * grid.height, 8 * grid.width
    for read, size in zip(warped_sources(field, owner, *at), (96, 128), strict=True):
        assert np.ptp(read) / 16 <= 0.75 * size + 4
    assert grid.height > 40


@pytest.mark.parametrize("size", [4, 5, 11, 14, 20, 22])
def test_copied_blocks_fit_in_the_exemplar(size):
    grid = BlockGrid.of(Chart(0, 90, 75), IDENTITY, (size, 64), 40, None, copied=True)
    assert grid.height <= size
    assert grid.width >= 16
    assert grid.overlap_rows <= grid.height // 2
