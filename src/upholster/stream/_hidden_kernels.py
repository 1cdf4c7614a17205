"""Which cells of a chart's masks can not be seen: others lie over all that they change."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.methods.quilt._masked_kernels import fill_weights, mask_window
from upholster.types import int64

__all__ = ["find_hidden"]

_FULL = 256


@inline
def _is_seen(opaque: NDArray[np.uint8], row0: Any, row1: Any, column0: Any, column1: Any) -> bool:
    # Whether some of these texels of the chart are bare.
    tall, wide = opaque.shape
    for row in range(max(row0, int64(0)), min(row1, int64(tall))):
        for column in range(max(column0, int64(0)), min(column1, int64(wide))):
            if opaque[row, column] == 0:
                return True
    return False


@kernel
def find_hidden(
    placements: Any,
    cells: NDArray[np.uint8],
    scratch: NDArray[np.int32],
    opaque: NDArray[np.uint8],
    hidden: NDArray[np.uint8],
) -> None:
    """Mark in `hidden`, one a cell of `cells`, the cells of a chart's masks that change no texel.

    `placements` are the chart's, in painting order; `opaque` (rows, columns) is 0, and tells at the end which
    texels some block covers with its whole weight. `scratch` is (2, `weight_rows`, width of the widest).
    """
    tall, wide = opaque.shape
    weights, spare = scratch[0], scratch[1]
    for n in range(placements.shape[0] - 1, -1, -1):
        placement = placements[n]
        height, width = int64(placement.height), int64(placement.width)
        top, left = placement.row - height // 2, placement.column - width // 2
        window = mask_window(placement, tall, wide) if placement.mask == 2 else (0, 0, 0, 0)
        i0, i1, j0, j1 = window
        size, reach = int64(placement.mask_cell), int64(placement.feather)
        for i in range(i0, i1):
            # A cell changes texels of its block alone, as far as feathering carries it.
            row0, row1 = top + max(i * size - reach, 0), top + min((i + 1) * size + reach, height)
            for j in range(j0, j1):
                column0 = left + max(j * size - reach, 0)
                column1 = left + min((j + 1) * size + reach, width)
                at = int64(placement.first_cell) + (i - i0) * (j1 - j0) + j - j0
                hidden[at] = 0 if _is_seen(opaque, row0, row1, column0, column1) else 1
        row0, row1 = max(top, int64(0)), min(top + height, int64(tall))
        column0, column1 = max(left, int64(0)), min(left + width, int64(wide))
        if row0 >= row1 or column0 >= column1:
            continue
        first_i, first_j = fill_weights(placement, cells, window, row0 - top, row1 - top, weights, spare)
        for row in range(row0, row1):
            for column in range(column0, column1):
                if weights[row - top - first_i, column - left - first_j] == _FULL:
                    opaque[row, column] = 1
