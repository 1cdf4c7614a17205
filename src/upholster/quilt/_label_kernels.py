"""The nearest placement of each cell, exactly, in two passes."""

import numpy as np
from numpy.typing import NDArray

from upholster.jit import kernel

__all__ = ["nearest_in_columns", "nearest_in_rows"]


@kernel
def nearest_in_columns(
    order: NDArray[np.int64],
    rows: NDArray[np.int64],
    starts: NDArray[np.int64],
    ends: NDArray[np.int64],
    cells: NDArray[np.int64],
    best: NDArray[np.int32],
) -> None:
    """Find of each line of centres, and each row of cells, the line's nearest centre; ties: the first number.

    `order` has the centres' numbers, line after line, from `starts` to `ends`, in each by their `rows`;
    `cells` are the places of the rows of cells; `best` is (lines, rows of cells).
    """
    for line in range(len(starts)):
        near = starts[line]
        for i in range(len(cells)):
            while near + 1 < ends[line] and abs(rows[order[near + 1]] - cells[i]) <= abs(
                rows[order[near]] - cells[i]
            ):
                near += 1
            found = order[near]
            away = abs(rows[found] - cells[i])
            k = near - 1  # others as near lie before it
            while k >= starts[line] and abs(rows[order[k]] - cells[i]) <= away:
                found = min(found, order[k])
                k -= 1
            best[line, i] = found


@kernel
def nearest_in_rows(
    best: NDArray[np.int32],
    rows: NDArray[np.int64],
    lines: NDArray[np.int64],
    at_rows: NDArray[np.int64],
    at_columns: NDArray[np.int64],
    out: NDArray[np.int32],
) -> None:
    """Find of each cell the nearest of its row's candidates, one of each line; ties: the first number.

    `lines` are the lines' places, rising. From the line next to the cell it looks both ways, as long as lines
    are no farther than what was found.
    """
    for i in range(out.shape[0]):
        middle = 0
        for j in range(out.shape[1]):
            place = at_columns[j]
            while middle + 1 < len(lines) and abs(lines[middle + 1] - place) <= abs(lines[middle] - place):
                middle += 1
            found, least = -1, np.int64(2**62)
            for way in (-1, 1):
                k = middle if way < 0 else middle + 1
                while 0 <= k < len(lines):
                    across = (lines[k] - place) * (lines[k] - place)
                    if across > least:
                        break
                    candidate = best[k, i]
                    down = rows[candidate] - at_rows[i]
                    away = across + down * down
                    if away < least or (away == least and candidate < found):
                        found, least = candidate, away
                    k += way
            out[i, j] = found
