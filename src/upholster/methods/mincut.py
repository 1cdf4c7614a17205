"""Minimum cuts on 4-connected grids of any shape, by Dinic's algorithm on the grid itself.

The grid's nodes are cells of an overlap; an edge's capacity is what it costs to have the cut run between its
two cells. Capacities are integers and the cut returned is the smallest one on the new side, so that it is
unique.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.methods._cut_kernels import cut_grid

__all__ = ["FREE", "NEW", "OLD", "OUTSIDE", "minimum_cut"]

FREE, OLD, NEW, OUTSIDE = 0, 1, 2, 3


def minimum_cut(
    right: NDArray[np.int64], down: NDArray[np.int64], seeds: NDArray[np.int8]
) -> tuple[NDArray[np.uint8], int]:
    """Separate the cells held new from the cells held old at least cost.

    Parameters
    ----------
    right
        (h, w − 1) int64, 0 to 2^53: capacity between cell (i, j) and (i, j + 1), the same both ways.
    down
        (h − 1, w) int64, likewise between (i, j) and (i + 1, j).
    held
        (h, w) int8: `FREE`, `OLD` (stays), `NEW` (is replaced), or `OUTSIDE` (not part of the grid).

    Returns
    -------
    cells : ndarray
        (h, w) uint8: 1 where the new side is. Cells that nothing connects to a new one stay old.
    cost : int
        The cut's cost: the sum of the capacities that it crosses.

    Raises
    ------
    InputError
        For shapes that do not fit together or capacities out of range.

    References
    ----------
    Kwatra et al.: Graphcut textures, 2003, section 3. Dinic: Algorithm for solution of a problem of maximum
    flow in networks with power estimation, 1970.
    """
    height, width = seeds.shape
    if right.shape != (height, width - 1) or down.shape != (height - 1, width):
        raise InputError(
            f"capacities have shapes {right.shape}, {down.shape}; allowed for a grid {seeds.shape}: "
            f"{(height, width - 1)}, {(height - 1, width)}"
        )
    if (
        min(right.min(initial=0), down.min(initial=0)) < 0
        or max(right.max(initial=0), down.max(initial=0)) > 2**53
    ):
        raise InputError("a capacity is outside 0 to 2^53")
    residual = np.zeros((4, height, width), np.int64)
    residual[0, :, :-1] = residual[2, :, 1:] = right
    residual[1, :-1] = residual[3, 1:] = down
    work = np.empty((4, height * width), np.int32)
    cells = np.empty((height, width), np.uint8)
    cost = cut_grid(
        residual.reshape(4, -1), np.ascontiguousarray(seeds).reshape(-1), width, work, cells.reshape(-1)
    )
    return cells, int(cost)
