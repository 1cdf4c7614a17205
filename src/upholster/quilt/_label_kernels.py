"""The nearest placement of each cell, exactly, in two passes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.runtime.jit import inline, kernel

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
    """Find for each line of centres and each row of cells the line's nearest centre; ties: the first number.

    `order` has the centres' numbers, line by line from `starts` to `ends`, within a line sorted by `rows`.
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
            k = near - 1  # other centres as near precede it
            while k >= starts[line] and abs(rows[order[k]] - cells[i]) <= away:
                found = min(found, order[k])
                k -= 1
            best[line, i] = found


@inline
def _away(place: Any, line: Any, down: Any) -> Any:
    return (place - line) * (place - line) + down * down


@inline
def _never_nearest(lines: NDArray[np.int64], down: NDArray[np.int64], t: Any, u: Any, w: Any) -> bool:
    # Whether the middle one of three lines from left to right is never the nearest. It is nearer than t from
    # one place on, and nearer than w up to another; both places are quotients.
    x, y, z = lines[t], lines[u], lines[w]
    from_t = (y * y + down[u] * down[u]) - (x * x + down[t] * down[t])
    to_w = (z * z + down[w] * down[w]) - (y * y + down[u] * down[u])
    return bool(to_w * (y - x) < from_t * (z - y))


@kernel
def nearest_in_rows(
    best: NDArray[np.int32],
    rows: NDArray[np.int64],
    lines: NDArray[np.int64],
    at_rows: NDArray[np.int64],
    at_columns: NDArray[np.int64],
    scratch: NDArray[np.int64],
    out: NDArray[np.int32],
) -> None:
    """Find for each cell the nearest of its row's candidates, one per line; ties: the first number.

    `lines` are the lines' places, increasing; `scratch` is (2, lines). Along a row the squared distances are
    parabolas of one shape, so those that are the lowest somewhere follow each other in order: the work is
    proportional to rows times columns.
    """
    kept, down = scratch[0], scratch[1]
    for i in range(out.shape[0]):
        count = 0
        for k in range(len(lines)):
            down[k] = rows[best[k, i]] - at_rows[i]
            while count > 1 and _never_nearest(lines, down, kept[count - 2], kept[count - 1], k):
                count -= 1
            kept[count] = k
            count += 1
        at = 0
        for j in range(out.shape[1]):
            place = at_columns[j]
            least = _away(place, lines[kept[at]], down[kept[at]])
            while at + 1 < count:
                away = _away(place, lines[kept[at + 1]], down[kept[at + 1]])
                if away > least:
                    break
                at, least = at + 1, away
            found, k = best[kept[at], i], at - 1
            while k >= 0 and _away(place, lines[kept[k]], down[kept[k]]) == least:
                found = min(found, best[kept[k], i])
                k -= 1
            out[i, j] = found
