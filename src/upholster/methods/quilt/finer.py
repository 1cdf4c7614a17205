"""Smaller blocks over a chart's own: where courses end, or are stretched by more than these can follow."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.charts.phases import PhaseField
from upholster.charts.phases.field import RING
from upholster.methods.quilt._block_kernels import BLOCK_COLUMNS, COLUMN, LEFT, PHASE, ROW, TOP, LayNumbers
from upholster.methods.quilt.grid import BlockGrid
from upholster.methods.quilt.phases import Phases, WantedPhases, side_at_ends
from upholster.types import IntArray

__all__ = ["finer_blocks", "finer_grids", "take_away"]

_SMALLER = 0.7
"""Of a chart's blocks: it gets no smaller ones unless they are as much smaller."""

_ALIKE = 0.95
"""Certainty that all waves must have: where a sample repeats less surely its elements differ, in colour too,
and smaller blocks cut through more of them than is gained by shorter faults. On the ring of README's bricks
these are 2.1 courses instead of 3.1, but block borders stand out by 1.25 instead of 1.07."""

_STRETCHED = 0.25
"""Turns from one block to the next above which they can not be in step."""


def finer_grids(
    grids: Sequence[BlockGrid], wanted: WantedPhases | None, shape: tuple[int, int]
) -> list[BlockGrid | None]:
    """Return the smaller blocks of each chart, None where its own are small or phases do not size blocks.

    There are none where the sample's elements are not alike.

    Parameters
    ----------
    grids
        Their own blocks.
    wanted
        Phases that the surface wants.
    shape
        The exemplar's (height, width).
    """
    if wanted is None or not wanted.blocks or not isinstance(wanted.surface, PhaseField):
        return [None] * len(grids)
    if wanted.lattice.certainty.min() < _ALIKE:
        return [None] * len(grids)
    side = round(side_at_ends(wanted.surface))
    found = [grid.smaller(side, shape) for grid in grids]
    return [
        one if min(one.height / grid.height, one.width / grid.width) <= _SMALLER else None
        for one, grid in zip(found, grids, strict=True)
    ]


def finer_blocks(
    index: int,
    grid: BlockGrid,
    finer: BlockGrid | None,
    need: tuple[int, int, int, int],
    phases: Phases | None,
) -> IntArray:
    """Return the smaller blocks that are laid over a chart's own, as `lay_blocks` takes them.

    Parameters
    ----------
    index
        The chart.
    grid, finer
        Its own blocks, and the smaller ones; None: none.
    need
        Which texels its own blocks cover, see `BlockGrid.need`.
    phases
        Those that the surface wants.
    """
    if finer is None or not isinstance(phases, PhaseField):
        return np.zeros((0, BLOCK_COLUMNS), np.int32)
    rows, columns = finer.centres(need)
    half = (finer.height - finer.overlap_rows) / 2, (finer.width - finer.overlap_columns) / 2
    marked = _stretched(index, grid, phases)
    sums = np.zeros((marked.shape[0] + 1, marked.shape[1] + 1), np.int64)
    np.cumsum(np.cumsum(marked, axis=0), axis=1, out=sums[1:, 1:])
    low_i, high_i = _cells(rows, half[0], phases.grids[index].size[0], marked.shape[0])
    low_j, high_j = _cells(columns, half[1], phases.grids[index].size[1], marked.shape[1])
    inside = sums[high_i][:, high_j] - sums[low_i][:, high_j] - sums[high_i][:, low_j] + sums[low_i][:, low_j]
    # Those beyond an edge altogether are not transferred over it.
    on = [
        (at + side // 2 > 0) & (at - side // 2 < length)
        for at, side, length in (
            (rows, finer.height, grid.chart.height),
            (columns, finer.width, grid.chart.width),
        )
    ]
    i, j = np.nonzero((inside > 0) & on[0][:, None] & on[1])
    number = np.full((len(rows) + 1, len(columns) + 1), -1, np.int32)
    number[i, j] = np.arange(len(i))
    out = np.zeros((len(i), BLOCK_COLUMNS), np.int32)
    out[:, ROW], out[:, COLUMN] = rows[i], columns[j]
    out[:, LEFT], out[:, TOP] = number[i, j - 1], number[i - 1, j]
    wanted = phases.at(index, out[:, ROW].astype(np.float64), out[:, COLUMN].astype(np.float64))
    out[:, PHASE : PHASE + len(wanted)] = wanted.T
    return out


def take_away(covered: NDArray[np.uint8], numbers: LayNumbers, finer: BlockGrid, blocks: IntArray) -> None:
    """Mark as bare what smaller blocks are to cover, but for what finished charts show.

    Parameters
    ----------
    covered
        See `ChartCanvas`; changes.
    numbers
        Of the chart.
    finer, blocks
        The smaller blocks.
    """
    down, aside = (finer.height - finer.overlap_rows) // 2, (finer.width - finer.overlap_columns) // 2
    for row, column in blocks[:, [ROW, COLUMN]].tolist():
        top, left = max(numbers.need_top, row - down), max(numbers.need_left, column - aside)
        bottom, right = min(numbers.need_bottom, row + down), min(numbers.need_right, column + aside)
        part = covered[
            top + numbers.origin_row : bottom + numbers.origin_row,
            left + numbers.origin_column : right + numbers.origin_column,
        ]
        part[part == 1] = 0


def _stretched(index: int, grid: BlockGrid, phases: PhaseField) -> NDArray[np.bool_]:
    # Of a chart's cells, and a ring of `RING` round them, those beside which a wave is stretched by more than
    # its blocks can follow.
    cells = phases.grids[index]
    steps = phases.steps(cells, phases.ringed[index], cells.field.at(*cells.places(RING)))
    found = np.zeros((cells.rows + 2 * RING, cells.columns + 2 * RING), bool)
    texels = grid.height - grid.overlap_rows, grid.width - grid.overlap_columns
    for axis, (_, missing, _) in enumerate(steps):
        over = (np.abs(missing).max(axis=0) * texels[axis] / cells.size[axis]) > _STRETCHED
        first, second = ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:]))[axis]
        found[first] |= over
        found[second] |= over
    return found


def _cells(
    centres: IntArray, half: float, size: float, count: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    # Which cells lie within `half` of places along an axis: from, to.
    low = np.floor((centres - half + 0.5) / size).astype(np.intp) + RING
    high = np.ceil((centres + half + 0.5) / size).astype(np.intp) + RING
    return np.clip(low, 0, count), np.clip(high, 0, count)
