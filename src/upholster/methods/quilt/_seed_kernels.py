"""Where a block's cut may run, and where it does."""

import numpy as np
from numpy.typing import NDArray

from upholster.jit import spliced
from upholster.methods._cut_kernels import cut_grid

__all__ = ["OUTSIDE", "cut", "seed_labels"]

FREE, OLD, NEW, OUTSIDE = 0, 1, 2, 3


@spliced
def seed_labels(
    missing: NDArray[np.int32],
    marks: NDArray[np.int32],
    covered: NDArray[np.uint8],
    around_rows: NDArray[np.int64],
    around_columns: NDArray[np.int64],
    cell: int,
    cell_columns: int,
    seeds: NDArray[np.int8],
) -> int:
    """Tell which cells stay old and which become new, whatever it costs; bit 0: some old, bit 1: some new.

    New is what is bare and `missing` (then out of the grid), and what is round it, so that feathering never
    meets bare texels. Old is what a finished chart shows, and the block's rim where its chart goes on.

    `marks` tells what a cell's texels are: bit 0 something laid, 1 a finished chart's, 2 something bare.
    `around_rows`, `around_columns` are the canvas's rows and columns of the block and one more each way.
    """
    cell_rows = seeds.shape[0] // cell_columns
    kinds = 0
    for a in range(cell_rows):
        for b in range(cell_columns):
            at = a * cell_columns + b
            kind = FREE
            if missing[at]:
                kind = OUTSIDE
            elif marks[at] & 4:
                # Bare, but where nobody needs it: a finished chart's, or beyond reach. What is needed beside
                # it must not be feathered against it.
                kind = OLD if marks[at] & 2 else OUTSIDE
                for i in range(max(a - 1, 0), min(a + 2, cell_rows)):
                    for j in range(max(b - 1, 0), min(b + 2, cell_columns)):
                        if missing[i * cell_columns + j]:
                            kind = OUTSIDE
            else:
                for i in range(max(a - 1, 0), min(a + 2, cell_rows)):
                    for j in range(max(b - 1, 0), min(b + 2, cell_columns)):
                        if missing[i * cell_columns + j]:
                            kind = NEW
                if kind == FREE and marks[at] & 2:
                    kind = OLD
                if kind == FREE and (a == 0 or b == 0 or a == cell_rows - 1 or b == cell_columns - 1):
                    r, c = around_rows[a * cell + 1], around_columns[b * cell + 1]
                    above, below = around_rows[0], around_rows[around_rows.shape[0] - 1]
                    left, right = around_columns[0], around_columns[around_columns.shape[0] - 1]
                    if (
                        (a == 0 and above >= 0 and covered[above, c] & 1)
                        or (b == 0 and left >= 0 and covered[r, left] & 1)
                        or (a == cell_rows - 1 and below >= 0 and covered[below, c] & 1)
                        or (b == cell_columns - 1 and right >= 0 and covered[r, right] & 1)
                    ):
                        kind = OLD
            seeds[at] = kind
            kinds |= (kind == OLD) | (kind == NEW) << 1
    return kinds


@spliced
def cut(
    errors: NDArray[np.int64],
    seeds: NDArray[np.int8],
    cell_columns: int,
    residual: NDArray[np.int64],
    work: NDArray[np.int32],
    mask: NDArray[np.uint8],
) -> None:
    """Find the minimum cut between cells held old and new; a step costs 1 at least, to keep it short.

    `errors` are squared differences summed over each cell; `residual`, `work` are scratch; `mask`: 1 = new.
    """
    residual[:] = 0
    for at in range(seeds.shape[0]):
        if seeds[at] != OUTSIDE:
            if (at + 1) % cell_columns and seeds[at + 1] != OUTSIDE:
                residual[0, at] = residual[2, at + 1] = errors[at] + errors[at + 1] + 1
            below = at + cell_columns
            if below < seeds.shape[0] and seeds[below] != OUTSIDE:
                residual[1, at] = residual[3, below] = errors[at] + errors[below] + 1
    cut_grid(residual, seeds, cell_columns, work, mask)
    for at in range(seeds.shape[0]):
        if seeds[at] == OUTSIDE:
            mask[at] = 1
