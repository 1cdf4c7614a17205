"""Masks that have not come yet: straight cuts, which follow from where blocks lie (SPEC.md, section 4)."""

import numpy as np
from numpy.typing import NDArray

from upholster.jit import allocating_kernel, inline
from upholster.stream._bit_kernels import signed
from upholster.stream._block_records import COLUMN, CUT, ROW, SIZE
from upholster.stream._mask_kernels import HELD, NEXT, Frame, cover, frame_of, judge, seen_from, source_of

__all__ = ["cut_straight"]

_FAR = 1 << 20


@inline
def _spread(steps: NDArray[np.int32], rows: int, columns: int) -> None:
    # Cells from the nearest 0, along rows and columns.
    for i in range(rows):
        for j in range(columns):
            at = i * columns + j
            if i > 0:
                steps[at] = min(steps[at], steps[at - columns] + 1)
            if j > 0:
                steps[at] = min(steps[at], steps[at - 1] + 1)
    for i in range(rows - 1, -1, -1):
        for j in range(columns - 1, -1, -1):
            at = i * columns + j
            if i + 1 < rows:
                steps[at] = min(steps[at], steps[at + columns] + 1)
            if j + 1 < columns:
                steps[at] = min(steps[at], steps[at + 1] + 1)


@inline
def _halve(
    f: Frame,
    known: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    to_old: NDArray[np.int32],
    to_new: NDArray[np.int32],
) -> None:
    # Gives each cell of an own block to the nearer side: what is held, or what must be new.
    rows, columns = f.i1 - f.i0, f.j1 - f.j0
    any_new = False
    for at in range(rows * columns):
        to_old[at] = 0 if known[at] == HELD else _FAR
        to_new[at] = 0 if known[at] >= NEXT else _FAR
        any_new = any_new or known[at] >= NEXT
    if not any_new and rows * columns > 0:
        to_new[rows // 2 * columns + columns // 2] = 0
    _spread(to_old, rows, columns)
    _spread(to_new, rows, columns)
    for at in range(rows * columns):
        mask[at] = 1 if to_new[at] <= to_old[at] else 0


@allocating_kernel
def cut_straight(
    records: NDArray[np.int32],
    windows: NDArray[np.int32],
    first: NDArray[np.int64],
    cells: NDArray[np.uint8],
    settled: NDArray[np.uint8],
    covered: NDArray[np.uint8],
    first_own: int,
    start: int,
    stop: int,
) -> None:
    """Cut the masks of a chart's blocks from `start` to `stop`, but for those that are `settled`.

    The other arguments are those of `code_masks`, but every record tells the size of its mask's cells.
    """
    most = 1
    for n in range(start, stop):
        most = max(most, (windows[n, 1] - windows[n, 0]) * (windows[n, 3] - windows[n, 2]))
    known, under = np.empty(most, np.uint8), np.empty(most, np.uint8)
    to_old, to_new = np.empty(most, np.int32), np.empty(most, np.int32)
    for n in range(start, stop):
        cell = signed(records[n, SIZE])
        f = frame_of(records[n], windows[n], max(cell, 1), n >= first_own)
        if not records[n, CUT]:
            cover(covered, f, under, under, True)
            continue
        across = f.j1 - f.j0
        mask = cells[first[n] : first[n] + (f.i1 - f.i0) * across]
        judge(covered, frame_of(records[n], windows[n], cell, True), known, under)
        if not settled[n]:
            if f.own:
                _halve(f, known, mask, to_old, to_new)
            else:
                source = source_of(records, windows, first, n)
                for at in range(mask.shape[0]):
                    down = 2 * (f.top + (f.i0 + at // across) * cell - records[n, ROW]) + cell - 1
                    right = 2 * (f.left + (f.j0 + at % across) * cell - records[n, COLUMN]) + cell - 1
                    seen = seen_from(source, cells, down, right)
                    mask[at] = 1 if seen == 2 or known[at] >= NEXT else 0
        cover(covered, f, mask, under, False)
