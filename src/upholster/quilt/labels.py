"""Label maps: the placement that shows in each cell of a chart (SPEC.md, section 8).

A cell is a square of steps. There is one row of cells beyond each edge of the chart, so that blocks that
continue over a seam are blended alike on both sides of it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import frozen_array
from upholster.quilt._label_kernels import nearest_in_columns, nearest_in_rows
from upholster.quilt.chart import Chart

__all__ = ["MOST_CELL", "LabelMap", "cell_centres", "label_shape", "nearest_labels"]

MOST_CELL = 255
"""Largest side of a cell, in steps."""


@dataclass(frozen=True, eq=False, slots=True)
class LabelMap:
    """A layer of a chart: for each cell the placement that shows there.

    Attributes
    ----------
    cell
        Side of a cell in steps, 1 to 255.
    labels
        (⌈height / cell⌉ + 2, ⌈width / cell⌉ + 2) int32, read-only: indices into the chart's placements; −1,
        only in a second layer, for none.
    half
        Whether cells are moved by half a cell towards the first row and column. Then the bilinear weights of
        two cells form a linear ramp, one cell wide, that begins at a multiple of `cell`.

    Raises
    ------
    InputError
        For a cell outside its range, or labels of another type.
    """

    cell: int
    labels: NDArray[np.int32]
    half: bool = False

    def __post_init__(self) -> None:
        if not 1 <= self.cell <= MOST_CELL:
            raise InputError(f"a cell of a label map is {self.cell} steps; allowed: 1 to {MOST_CELL}")
        if self.labels.dtype != np.int32 or self.labels.ndim != 2:
            raise InputError(f"labels are of {self.labels.dtype} {self.labels.shape}; allowed: int32 (n, m)")
        frozen_array(self.labels)

    def check(self, chart: Chart, first: int, stop: int, *, empty: bool) -> None:
        """Raise InputError unless labels fit a chart and are `first` to `stop` − 1, or −1 if `empty`."""
        wanted = label_shape(chart.height, chart.width, self.cell)
        if self.labels.shape != wanted:
            raise InputError(f"labels have shape {self.labels.shape}; the chart wants {wanted}")
        named = self.labels[self.labels >= 0] if empty else self.labels
        if self.labels.min() < -1 or (len(named) and (named.min() < first or named.max() >= stop)):
            raise InputError(f"a label is outside {first} to {stop - 1}, the placements of its layer")

    def at(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.int32]:
        """Return the labels of the cells that contain steps: broadcast like the steps' numbers."""
        moved = (3 if self.half else 2) * self.cell + 1  # twice the middle of step 0, from the first cell on
        i = (2 * rows + moved) // (2 * self.cell)
        j = (2 * columns + moved) // (2 * self.cell)
        found: NDArray[np.int32] = self.labels[i, j]
        return found


def label_shape(height: int, width: int, cell: int) -> tuple[int, int]:
    """Return the numbers of rows and columns of cells on a chart of this many steps."""
    return -(-height // cell) + 2, -(-width // cell) + 2


def cell_centres(count: int, cell: int, *, half: bool = False) -> NDArray[np.int64]:
    """Return the centres of the first `count` rows (or columns) of cells, in 1/16 step."""
    found: NDArray[np.int64] = 16 * cell * (np.arange(count, dtype=np.int64) - 1) + (0 if half else 8 * cell)
    return found


def nearest_labels(
    rows: NDArray[np.int32], columns: NDArray[np.int32], chart: Chart, cell: int, *, half: bool = False
) -> NDArray[np.int32]:
    """Return for each cell the placement whose centre is nearest to its own; of equally near ones, the first.

    Parameters
    ----------
    rows, columns
        (n,) the placements' centres, in 1/16 step; n ≥ 1.
    chart
        The chart with the cells.
    cell, half
        As for `LabelMap`.

    Returns
    -------
    ndarray
        (rows of cells, columns of cells) int32: 0 to n − 1.
    """
    high, wide = label_shape(chart.height, chart.width, cell)
    at_rows, at_columns = cell_centres(high, cell, half=half), cell_centres(wide, cell, half=half)
    out = np.empty((high, wide), np.int32)
    # Sorts placements by columns of cells. Exact for any centres: a column keeps the nearest one for each
    # row.
    order = np.lexsort((np.arange(len(rows)), rows, columns))
    starts = np.flatnonzero(np.diff(columns[order], prepend=np.int64(-(2**40))))
    ends = np.append(starts[1:], len(order))
    lines = columns[order][starts].astype(np.int64)
    best = np.empty((len(lines), high), np.int32)
    nearest_in_columns(order.astype(np.int64), rows.astype(np.int64), starts, ends, at_rows, best)
    scratch = np.empty((2, len(lines)), np.int64)
    nearest_in_rows(best, rows.astype(np.int64), lines, at_rows, at_columns, scratch, out)
    return out
