"""Maximum flow on a grid, and the cut that it leaves (Dinic's algorithm)."""

import numpy as np
from numpy.typing import NDArray

from upholster.jit import kernel

__all__ = ["cut_grid"]


@kernel
def cut_grid(
    residual: NDArray[np.int64],
    seeds: NDArray[np.int8],
    width: int,
    work: NDArray[np.int32],
    cells: NDArray[np.uint8],
) -> int:
    """Push the maximum flow from cells held new (2) to cells held old (1); return it, mark the new side.

    The new side is 1 in `cells`. `residual` (4, n) holds the capacities to the right, below, left and above,
    and is used up; capacities across the grid's rim must be 0. `held` (n,) also knows free (0) and outside
    (3) cells. `work` (4, n) is scratch.
    """
    count = seeds.shape[0]
    steps = (1, width, -1, -width)
    level, pointer, queue, trail = work[0], work[1], work[2], work[3]
    flow = 0
    while True:
        # Breadth first from all new cells at once; cells held old take flow and pass none on.
        head, tail = 0, 0
        for n in range(count):
            level[n] = -1
            pointer[n] = 0
            if seeds[n] == 2:
                level[n] = 0
                queue[tail] = n
                tail += 1
        sources = tail
        reached = False
        while head < tail:
            n = queue[head]
            head += 1
            for d in range(4):
                if residual[d, n] > 0:
                    m = n + steps[d]
                    if level[m] < 0 and seeds[m] != 3:
                        level[m] = level[n] + 1
                        if seeds[m] == 1:
                            reached = True
                        else:
                            queue[tail] = m
                            tail += 1
        if not reached:
            break
        # Depth first along rising levels; `trail` holds the nodes of the path, `pointer` each one's next
        # direction.
        for s in range(sources):
            n = queue[s]
            depth = 0
            while True:
                if seeds[n] == 1:
                    least = residual[pointer[trail[0]], trail[0]]
                    for k in range(1, depth):
                        least = min(least, residual[pointer[trail[k]], trail[k]])
                    flow += least
                    first = depth
                    for k in range(depth - 1, -1, -1):
                        d, a = pointer[trail[k]], trail[k]
                        residual[d, a] -= least
                        residual[(d + 2) & 3, a + steps[d]] += least
                        if residual[d, a] == 0:
                            first = k
                    depth = first
                    n = trail[depth]
                    continue
                found = False
                while pointer[n] < 4:
                    d = pointer[n]
                    if residual[d, n] > 0:
                        m = n + steps[d]
                        if level[m] == level[n] + 1 and seeds[m] != 3:
                            trail[depth] = n
                            depth += 1
                            n = m
                            found = True
                            break
                    pointer[n] += 1
                if not found:
                    if depth == 0:
                        break
                    depth -= 1
                    n = trail[depth]
                    pointer[n] += 1
    for n in range(count):
        cells[n] = 1 if level[n] >= 0 and seeds[n] != 1 else 0
    return flow
