"""Which block shows in each cell, once all are laid."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.types import int64

__all__ = ["fill_labels", "trace_cells"]


@inline
def _first_from(place: Any, cell: int) -> Any:
    # The first row (or column) of cells whose middle lies at a step or after it.
    return (place - cell // 2 + cell - 1) // cell + 1


@kernel
def trace_cells(
    blocks: Any,
    masks: NDArray[np.uint8],
    steps: NDArray[np.int64],
    bounds: tuple[int, int, int, int],
    cell: int,
    seen: NDArray[np.int32],
) -> None:
    """Write to `seen` which of a chart's blocks shows in each cell of a label map, −1 at first.

    That is the last one that shows at the step at the cell's middle. `masks` are the cells of blocks' masks.
    Beyond `bounds` (rows from, to, columns from, to) only blocks count that come from other charts, which
    `steps` tells: the chart's own are not cut there.
    """
    for n in range(blocks.shape[0]):
        block = blocks[n]
        height, width = int64(block.height), int64(block.width)
        top, left = int64(block.row) - height // 2, int64(block.column) - width // 2
        first, size = int64(block.first_cell), max(int64(block.mask_cell), 1)
        across = (width + size - 1) // size
        low, high, start, stop = top, top + height, left, left + width
        if steps[n] == 0:
            low, high = max(low, bounds[0]), min(high, bounds[1])
            start, stop = max(start, bounds[2]), min(stop, bounds[3])
        i0, i1 = max(_first_from(low, cell), 0), min(_first_from(high, cell), seen.shape[0])
        j0, j1 = max(_first_from(start, cell), 0), min(_first_from(stop, cell), seen.shape[1])
        for i in range(i0, i1):
            row = (i - 1) * cell + cell // 2 - top
            for j in range(j0, j1):
                column = (j - 1) * cell + cell // 2 - left
                if first < 0 or masks[first + row // size * across + column // size]:
                    seen[i, j] = n


@kernel
def fill_labels(labels: NDArray[np.int32], queue: NDArray[np.int64]) -> None:
    """Give each cell without a label, −1, that of the nearest one, in steps by rows and columns.

    `queue` has room for all cells. Of several as near, the cell takes what is reached first in raster order.
    """
    wide, first, last = labels.shape[1], 0, 0
    for i in range(labels.shape[0]):
        for j in range(wide):
            if labels[i, j] >= 0:
                queue[last] = i * wide + j
                last += 1
    while first < last:
        i, j = queue[first] // wide, queue[first] % wide
        first += 1
        for k in range(4):
            a, b = i + (k == 0) - (k == 1), j + (k == 2) - (k == 3)
            if 0 <= a < labels.shape[0] and 0 <= b < wide and labels[a, b] < 0:
                labels[a, b] = labels[i, j]
                queue[last] = a * wide + b
                last += 1
