"""A block as it is laid: a rectangle of texels with a mask, laid over what is there.

What shows in the end becomes label maps, see `upholster.methods.quilt.emit`.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import WarpField
from upholster.types import IntArray

__all__ = ["BLOCK", "LARGEST_BLOCK", "MATRIX_UNIT", "step_matrices", "touches"]

MATRIX_UNIT = 64
"""In 1/4096 pixel per texel: an own centre matrix differs from the warp field by multiples of this."""

LARGEST_BLOCK = 2048
"""Texels of a block, each way: keeps all of its arithmetic within 32 bits."""

BLOCK = np.dtype(
    [
        ("chart", np.int32),
        ("row", np.int32),  # of its centre, in texels of the chart
        ("column", np.int32),
        ("height", np.int32),  # of its rectangle, which may reach beyond the chart
        ("width", np.int32),
        ("source_row", np.int32),  # where the centre falls in the exemplar, in 1/16 pixel
        ("source_column", np.int32),
        ("first_cell", np.int32),  # where its mask starts among the cells, row by row; -1: shows everywhere
        ("matrix", np.int32, 4),  # if `centred`: the centre matrix, row by row, in 1/4096 pixel per texel
        ("symmetry", np.uint8),  # of the square, takes chart steps to exemplar steps: 0…7
        ("centred", np.uint8),  # 1: has a centre matrix of its own, in place of the warp field's there
        ("mask_cell", np.uint8),  # side of a cell of its mask in texels, 0 without a mask
    ],
    align=True,
)


def touches(placed: NDArray[np.void], chart: Chart) -> NDArray[np.bool_]:
    """Return which blocks touch their chart."""
    out = np.ones(len(placed), bool)
    for at, extent, size in (("row", "height", chart.height), ("column", "width", chart.width)):
        low = placed[at] - placed[extent] // 2
        out &= (low < size) & (low + placed[extent] > 0)
    return out


def step_matrices(field: WarpField, placed: NDArray[np.void]) -> IntArray:
    """Return blocks' centre matrices, (n, 4) int32 in 1/4096 pixel per texel, row by row."""
    found = field.integers_at(placed["row"], placed["column"])
    own = placed["centred"] > 0
    return np.where(own[:, None], placed["matrix"], found) if own.any() else found
