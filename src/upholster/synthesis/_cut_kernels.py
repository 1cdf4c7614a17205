"""Maximum flow on a grid, and the resulting cut (Dinic's algorithm).

`cut_grid` separates cells that are fixed to either side; `cut_weighted` lets each cell prefer a side.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.runtime.jit import inline, kernel

__all__ = ["FREE", "NEW", "OLD", "OUTSIDE", "cut_grid", "cut_weighted"]

# State of a cell before the cut: free, stays old, becomes new, or outside the grid.
FREE, OLD, NEW, OUTSIDE = 0, 1, 2, 3


@inline
def _step_to(direction: int, width: int) -> int:
    # From a cell to the one to the right, below, left or above.
    step = 1 if direction & 1 == 0 else width
    return step if direction < 2 else -step


@inline
def _rank(
    residual: NDArray[np.int64], seeds: NDArray[np.int8], width: int, work: NDArray[np.int32]
) -> tuple[int, bool]:
    # Breadth first from all new cells at once: the distance of each cell from them. Cells held old take flow
    # and pass none on. Returns the number of new cells at the front of the queue, and whether an old one was
    # reached.
    level, pointer, queue = work[0], work[1], work[2]
    head, tail = 0, 0
    for n in range(seeds.shape[0]):
        level[n], pointer[n] = -1, 0
        if seeds[n] == NEW:
            level[n] = 0
            queue[tail] = n
            tail += 1
    sources, reached = tail, False
    while head < tail:
        n = queue[head]
        head += 1
        for d in range(4):
            if residual[d, n] > 0:
                m = n + _step_to(d, width)
                if level[m] < 0 and seeds[m] != OUTSIDE:
                    level[m] = level[n] + 1
                    if seeds[m] == OLD:
                        reached = True
                    else:
                        queue[tail] = m
                        tail += 1
    return sources, reached


@inline
def _advance(
    residual: NDArray[np.int64], seeds: NDArray[np.int8], width: int, work: NDArray[np.int32], n: int
) -> int:
    # The next cell with a higher level that takes flow from cell n; -1 if there is none left.
    level, pointer = work[0], work[1]
    while pointer[n] < 4:
        d = pointer[n]
        if residual[d, n] > 0:
            m = n + _step_to(d, width)
            if level[m] == level[n] + 1 and seeds[m] != OUTSIDE:
                return m
        pointer[n] += 1
    return -1


@inline
def _augment(residual: NDArray[np.int64], width: int, work: NDArray[np.int32], depth: int) -> tuple[int, int]:
    # Pushes as much along the trail as its narrowest step takes; returns the amount, and that step's place.
    pointer, trail = work[1], work[3]
    least = residual[pointer[trail[0]], trail[0]]
    for k in range(1, depth):
        least = min(least, residual[pointer[trail[k]], trail[k]])
    first = depth
    for k in range(depth - 1, -1, -1):
        d, n = pointer[trail[k]], trail[k]
        residual[d, n] -= least
        residual[(d + 2) & 3, n + _step_to(d, width)] += least
        if residual[d, n] == 0:
            first = k
    return least, first


@kernel
def cut_grid(
    residual: NDArray[np.int64],
    seeds: NDArray[np.int8],
    width: int,
    work: NDArray[np.int32],
    cells: NDArray[np.uint8],
) -> int:
    """Push the maximum flow from cells held new to cells held old; return it, mark the new side.

    The new side is 1 in `cells`. `residual` (4, n) holds the capacities to the right, below, left and above,
    and is used up; capacities across the grid's rim must be 0. `seeds` (n,) are `FREE`, `OLD`, `NEW` or
    `OUTSIDE`. `work` (4, n) is scratch: each cell's level, its next direction, the queue, and the trail, the
    cells of a path along rising levels.
    """
    level, pointer, queue, trail = work[0], work[1], work[2], work[3]
    flow = 0
    while True:
        sources, reached = _rank(residual, seeds, width, work)
        if not reached:
            break
        for s in range(sources):
            n = queue[s]
            depth = 0
            while True:
                if seeds[n] == OLD:
                    least, depth = _augment(residual, width, work, depth)
                    flow += least
                    n = trail[depth]
                    continue
                m = _advance(residual, seeds, width, work, n)
                if m >= 0:
                    trail[depth] = n
                    depth += 1
                    n = m
                elif depth == 0:
                    break
                else:
                    depth -= 1
                    n = trail[depth]
                    pointer[n] += 1
    for n in range(seeds.shape[0]):
        cells[n] = 1 if level[n] >= 0 and seeds[n] != OLD else 0
    return flow


@inline
def _rank_weighted(
    residual: NDArray[np.int64], balance: NDArray[np.int64], width: int, work: NDArray[np.int32]
) -> tuple[int, bool]:
    # As `_rank`, from all cells that have flow left to give: returns their number, and whether a cell that
    # takes flow was reached.
    level, pointer, queue = work[0], work[1], work[2]
    head, tail = 0, 0
    for n in range(balance.shape[0]):
        level[n], pointer[n] = -1, 0
        if balance[n] > 0:
            level[n] = 0
            queue[tail] = n
            tail += 1
    sources, reached = tail, False
    while head < tail:
        n = queue[head]
        head += 1
        for d in range(4):
            if residual[d, n] > 0:
                m = n + _step_to(d, width)
                if level[m] < 0:
                    level[m] = level[n] + 1
                    reached = reached or balance[m] < 0
                    queue[tail] = m
                    tail += 1
    return sources, reached


@inline
def _advance_weighted(residual: NDArray[np.int64], width: int, work: NDArray[np.int32], n: int) -> int:
    # The next cell with a higher level that takes flow from cell n; -1 if there is none left.
    level, pointer = work[0], work[1]
    while pointer[n] < 4:
        d = pointer[n]
        if residual[d, n] > 0:
            m = n + _step_to(d, width)
            if level[m] == level[n] + 1:
                return m
        pointer[n] += 1
    return -1


@inline
def _augment_weighted(
    residual: NDArray[np.int64],
    balance: NDArray[np.int64],
    width: int,
    work: NDArray[np.int32],
    depth: int,
    n: int,
) -> tuple[int, int]:
    # Pushes from the trail's first cell to cell n at its end as much as both and the steps between take;
    # returns the amount, and the place of the first saturated step, or the trail's length.
    pointer, trail = work[1], work[3]
    source = trail[0]
    least = min(balance[source], -balance[n])
    for k in range(depth):
        least = min(least, residual[pointer[trail[k]], trail[k]])
    balance[source] -= least
    balance[n] += least
    first = depth
    for k in range(depth - 1, -1, -1):
        d, m = pointer[trail[k]], trail[k]
        residual[d, m] -= least
        residual[(d + 2) & 3, m + _step_to(d, width)] += least
        if residual[d, m] == 0:
            first = k
    return least, first


@kernel
def cut_weighted(
    residual: NDArray[np.int64],
    balance: NDArray[np.int64],
    width: int,
    work: NDArray[np.int32],
    cells: NDArray[np.uint8],
) -> int:
    """Choose a side for each cell of a grid at the lowest cost; return the cost, mark the new side.

    The new side is 1 in `cells`. A cell that stays old costs its `balance` if that is positive; a cell that
    becomes new costs the absolute balance if that is negative. A step from a new cell to an old one costs the
    capacity in `residual` (4, n), to the right, below, left and above, which must be 0 across the grid's rim.
    Of equal choices the one with the fewest new cells is taken. Both arrays are used up. `work` (4, n) is
    scratch as for `cut_grid`.
    """
    level, pointer, queue, trail = work[0], work[1], work[2], work[3]
    flow = 0
    while True:
        sources, reached = _rank_weighted(residual, balance, width, work)
        if not reached:
            break
        for s in range(sources):
            n = queue[s]
            depth = 0
            while balance[queue[s]] > 0:
                if balance[n] < 0:
                    least, first = _augment_weighted(residual, balance, width, work, depth, n)
                    flow += least
                    if first < depth:
                        depth = first
                        n = trail[depth]
                    continue
                m = _advance_weighted(residual, width, work, n)
                if m >= 0:
                    trail[depth] = n
                    depth += 1
                    n = m
                elif depth == 0:
                    break
                else:
                    depth -= 1
                    n = trail[depth]
                    pointer[n] += 1
    for n in range(balance.shape[0]):
        cells[n] = 1 if level[n] >= 0 else 0
    return flow
