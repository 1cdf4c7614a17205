"""Weights of some rows of a placement are those of the whole, and cost no more than these rows."""

from typing import Any

import numpy as np
import pytest

from upholster.quilt import Chart, Quilt, paint
from upholster.quilt.painting import _STRIP_SAMPLES
from upholster.quilt.placement import MASK_CUT, MASK_RAMP, PLACEMENT, mask_sizes
from upholster.quilt.plans import PlacementList
from upholster.quilt.warp_field import WarpField

WIDE = _STRIP_SAMPLES // 64
"""Texels of a row of one channel at which strips have 64 rows."""


def painted(shape: Any, placed: Any, cells: Any, field: Any) -> Any:
    chart = Chart(0, *shape)
    quilt = Quilt((chart,), (300, 300), PlacementList(placed, cells), (field,))
    image = np.random.default_rng(1).integers(0, 256, (300, 300, 1), dtype=np.uint8)
    return paint(quilt, image, threads=1).arrays[0]


@pytest.mark.parametrize("warped", [False, True])
@pytest.mark.parametrize(("cell", "feather"), [(1, 16), (7, 3), (255, 16), (13, 0)])
def test_a_tall_block_on_many_strips_is_painted_as_on_one(warped: bool, cell: int, feather: int) -> None:
    rng = np.random.default_rng(cell)
    placed = np.zeros(2, PLACEMENT)
    placed["height"], placed["width"], placed["row"], placed["column"] = 250, 30, 120, 14
    placed["source_row"] = placed["source_column"] = 16 * 150
    placed["mask"], placed["mask_cell"], placed["feather"] = MASK_CUT, cell, feather
    placed["mask"][0], placed["ramp"][0], placed["sides"][0] = MASK_RAMP, 200, 1
    placed["symmetry"][0], placed["first_cell"][0] = 1, -1
    nodes = np.zeros((1, 1, 4), np.int16)
    nodes[..., 2] = 3 * warped
    field = WarpField(nodes, 0)
    chart = Chart(0, 200, 40)
    cells = rng.integers(0, 2, int(mask_sizes(placed, (chart,)).sum())).astype(np.uint8)
    narrow = painted((200, 40), placed, cells, field)
    # The window of cells is the same on a wider chart: the block ends before either chart does.
    wide = painted((200, 8 * WIDE), placed, cells, field)
    np.testing.assert_array_equal(wide[:, :40], narrow)
    assert narrow.any()
