"""Hot loops of packing islands by their shapes: the squares of texels that each needs, and free places."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64, uint64
from upholster.runtime.jit import inline, kernel

__all__ = ["lay_stencils", "mark_squares"]


@kernel
def mark_squares(
    places: FloatArray,
    island: IntArray,
    grids: NDArray[np.int64],
    side: float,
    reach: float,
    marked: NDArray[np.bool_],
) -> None:
    """Mark the squares that triangles intersect or come near to.

    A square and a triangle are apart if a line separates them: along a side of the square, which the bounds
    of the loops ensure, or along an edge of the triangle.

    Parameters
    ----------
    places
        (T, 3, 2) rows and columns of the triangles' corners on their charts, in texels.
    island
        (T,) the island of each triangle; -1: none.
    grids
        (islands, 5): row and column on the chart, in texels, at which the island's squares begin; their rows
        and columns; and the index of the first one in `marked`.
    side
        Side of a square, in texels.
    reach
        Distance at which a triangle counts as near, in texels.
    marked
        The squares of all islands, row by row: marked ones become True.
    """
    half = 0.5 * side + reach
    for t in range(len(places)):
        if island[t] < 0:
            continue
        grid = grids[island[t]]
        y0, y1, y2 = places[t, 0, 0] - grid[0], places[t, 1, 0] - grid[0], places[t, 2, 0] - grid[0]
        x0, x1, x2 = places[t, 0, 1] - grid[1], places[t, 1, 1] - grid[1], places[t, 2, 1] - grid[1]
        top = max(int64(np.floor((min(y0, y1, y2) - reach) / side)), 0)
        left = max(int64(np.floor((min(x0, x1, x2) - reach) / side)), 0)
        bottom = min(int64(np.ceil((max(y0, y1, y2) + reach) / side)), grid[2])
        right = min(int64(np.ceil((max(x0, x1, x2) + reach) / side)), grid[3])
        for r in range(top, bottom):
            for c in range(left, right):
                at, y, x = grid[4] + r * grid[3] + c, (r + 0.5) * side, (c + 0.5) * side
                marked[at] = marked[at] or not (
                    _apart(y0, x0, y1, x1, y2, x2, y, x, half)
                    or _apart(y1, x1, y2, x2, y0, x0, y, x, half)
                    or _apart(y2, x2, y0, x0, y1, x1, y, x, half)
                )


@inline
def _apart(
    ay: float, ax: float, by: float, bx: float, oy: float, ox: float, y: float, x: float, half: float
) -> bool:
    # Whether a square about (y, x) is beyond the edge from a to b, or beyond the opposite corner.
    across, down = by - ay, ax - bx
    deep, at = (oy - ay) * down + (ox - ax) * across, (y - ay) * down + (x - ax) * across
    wide = half * (abs(across) + abs(down))
    return at - wide > max(deep, 0.0) or at + wide < min(deep, 0.0)


@kernel
def lay_stencils(
    order: NDArray[np.int64],
    runs: NDArray[np.int64],
    spans: NDArray[np.int64],
    together: bool,
    taken: NDArray[np.uint64],
    room: NDArray[np.int64],
    since: NDArray[np.int64],
    places: NDArray[np.int64],
) -> None:
    """Place stencils one after the other, each in the first row with room for it, as far left as possible.

    A stencil as high and wide as earlier ones starts where the last of these was placed; otherwise thousands
    of small islands would search all occupied space. 64 columns are tested at once: a column is not free if
    one of the stencil's squares would be on an occupied one.

    Parameters
    ----------
    order
        The stencils to place, in order.
    runs
        (R, 4) runs of adjacent squares of stencils: row, first column, length, and the exponent of the
        largest power of two in the length.
    spans
        (stencils, 6): height, runs from, to, the row and the length of the longest run, and the kind.
    together
        Whether to stop at the first stencil that does not fit.
    taken
        (levels, rows, words): bit c % 64 of word c // 64 in level 0 is set if a square of the page is
        occupied, in level j if one of the 2^j squares from it on is. Beyond the last word all are.
    room
        (rows,) length of the longest run of free squares.
    since
        (kinds,) the row at which the search for each kind starts: zeros at first.
    places
        (stencils, 2) row and column of the placed ones; the others are unchanged.
    """
    for n in order:
        start, stop, row, column = spans[n, 1], spans[n, 2], since[spans[n, 5]], int64(-1)
        while column < 0 and row + spans[n, 0] <= taken.shape[1]:
            if room[row + spans[n, 3]] >= spans[n, 4]:
                column = _free_column(taken, row, runs, start, stop)
            row += 1
        since[spans[n, 5]] = max(row - 1, 0)
        if column >= 0:
            places[n, 0], places[n, 1] = row - 1, column
            _take(taken, room, row - 1, column, runs, start, stop)
        elif together:
            return


@inline
def _free_column(taken: NDArray[np.uint64], row: int, runs: NDArray[np.int64], start: int, stop: int) -> Any:
    # The first column at which all runs are free when they begin in that row; -1: none.
    for word in range(taken.shape[2]):
        free = ~uint64(0)
        for k in range(start, stop):
            # Two powers of two, which may overlap, cover the run.
            level, at = runs[k, 3], row + runs[k, 0]
            rest = runs[k, 2] - (int64(1) << level)
            free &= ~_shifted(taken, level, at, runs[k, 1], word)
            free &= ~_shifted(taken, level, at, runs[k, 1] + rest, word)
            if not free:
                break
        if free:
            bit = int64(0)
            while not (free >> uint64(bit)) & uint64(1):
                bit += 1
            return 64 * word + bit
    return int64(-1)


@inline
def _shifted(taken: NDArray[np.uint64], level: int, row: int, by: int, word: int) -> Any:
    # A word of a row of a level, with its columns shifted to the left.
    at, bits, words = word + (by >> 6), uint64(by & 63), taken.shape[2]
    low = taken[level, row, at] if at < words else ~uint64(0)
    if not bits:
        return low
    high = taken[level, row, at + 1] if at + 1 < words else ~uint64(0)
    return low >> bits | high << (uint64(64) - bits)


@inline
def _take(
    taken: NDArray[np.uint64],
    room: NDArray[np.int64],
    row: int,
    column: int,
    runs: NDArray[np.int64],
    start: int,
    stop: int,
) -> None:
    for k in range(start, stop):
        at = row + runs[k, 0]
        for c in range(column + runs[k, 1], column + runs[k, 1] + runs[k, 2]):
            taken[0, at, c >> 6] |= uint64(1) << uint64(c & 63)
        if k + 1 < stop and runs[k + 1, 0] == runs[k, 0]:
            continue  # the row's last run is yet to come
        for level in range(1, taken.shape[0]):
            half = int64(1) << (level - 1)
            for word in range(taken.shape[2]):
                taken[level, at, word] = taken[level - 1, at, word] | _shifted(
                    taken, level - 1, at, half, word
                )
        room[at] = _longest(taken, at)


@inline
def _longest(taken: NDArray[np.uint64], row: int) -> Any:
    # The length of the longest run of free squares in a row.
    longest, length = int64(0), int64(0)
    for word in range(taken.shape[2]):
        bits = taken[0, row, word]
        for bit in range(64):
            length = int64(0) if (bits >> uint64(bit)) & uint64(1) else length + 1
            longest = max(longest, length)
    return longest
