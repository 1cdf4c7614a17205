"""Which block shows in each cell, once all are laid."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import kernel
from upholster.methods.quilt._masked_kernels import fill_weights, mask_window
from upholster.types import int64

__all__ = ["fill_labels", "trace_cells"]


@kernel
def trace_cells(
    placements: Any,
    cells: NDArray[np.uint8],
    sizes: tuple[int, int],
    cell: int,
    whole: bool,
    scratch: NDArray[np.int32],
    seen: NDArray[np.int32],
) -> None:
    """Write to `seen` which of a chart's blocks shows in each cell of a label map, −1 at first.

    That is the last one that covers the step at the cell's middle with at least half of the weight. `sizes` is
    the chart's height and width. Masks are `whole`, or windows: then nothing is known beyond the chart's edges.
    `scratch` holds the weights of any block.
    """
    tall, wide = sizes
    weights, spare = scratch[0], scratch[1]
    rim = cell if whole else 0
    for n in range(placements.shape[0]):
        placement = placements[n]
        window = (0, 0, 0, 0)
        if placement.mask == 2 and whole:
            size = int64(placement.mask_cell)
            window = (0, (placement.height + size - 1) // size, 0, (placement.width + size - 1) // size)
        elif placement.mask == 2:
            window = mask_window(placement, tall, wide)
        top, left = placement.row - placement.height // 2, placement.column - placement.width // 2
        row0, row1 = max(top, -rim), min(top + placement.height, tall + rim)
        column0, column1 = max(left, -rim), min(left + placement.width, wide + rim)
        if row0 >= row1 or column0 >= column1:
            continue
        first_i, first_j = fill_weights(placement, cells, window, row0 - top, row1 - top, weights, spare)
        for i in range(max(row0 // cell, 0), min((row1 - 1) // cell + 2, seen.shape[0])):
            row = (i - 1) * cell + cell // 2
            if row < row0 or row >= row1:
                continue
            for j in range(max(column0 // cell, 0), min((column1 - 1) // cell + 2, seen.shape[1])):
                column = (j - 1) * cell + cell // 2
                if (
                    column0 <= column < column1
                    and weights[row - top - first_i, column - left - first_j] >= 128
                ):
                    seen[i, j] = n


@kernel
def fill_labels(labels: NDArray[np.int32], queue: NDArray[np.int64]) -> None:
    """Give each cell without a label, −1, that of the nearest one by rows and columns; `queue` has room for all."""
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
