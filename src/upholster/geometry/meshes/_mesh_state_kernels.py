"""Overlaps of texture coordinates: how many triangles cover each cell."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.runtime.jit import inline, kernel

__all__ = ["count_covers"]


@kernel
def count_covers(triangles: FloatArray, counts: NDArray[Any]) -> None:
    """Count how many triangles cover the centre of each cell of a raster.

    A centre on an edge counts for one of the edge's two triangles.

    Parameters
    ----------
    triangles
        (T, 3, 2) corners (x, y) in cells, of any orientation.
    counts
        (height, width) uint8, incremented in place, up to 255.
    """
    height, width = counts.shape
    for t in range(len(triangles)):
        x0, y0 = triangles[t, 0, 0], triangles[t, 0, 1]
        x1, y1 = triangles[t, 1, 0], triangles[t, 1, 1]
        x2, y2 = triangles[t, 2, 0], triangles[t, 2, 1]
        turn = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if turn == 0.0:
            continue
        if turn < 0.0:
            x1, y1, x2, y2 = x2, y2, x1, y1
        top = max(0, int(np.ceil(min(y0, min(y1, y2)) - 0.5)))
        bottom = min(height - 1, int(np.floor(max(y0, max(y1, y2)) - 0.5)))
        for row in range(top, bottom + 1):
            y = row + 0.5
            low, high = _span(x0, y0, x1, y1, x2, y2, y)
            first = max(0, int(np.ceil(low - 0.5)) - 1)
            last = min(width - 1, int(np.floor(high - 0.5)) + 1)
            for column in range(first, last + 1):
                x = column + 0.5
                if (
                    _inside(x0, y0, x1, y1, x, y)
                    and _inside(x1, y1, x2, y2, x, y)
                    and _inside(x2, y2, x0, y0, x, y)
                    and counts[row, column] < 255
                ):
                    counts[row, column] += 1


@inline
def _span(x0: float, y0: float, x1: float, y1: float, x2: float, y2: float, y: float) -> tuple[float, float]:
    """Return the least and greatest x of a triangle at a height y."""
    low, high = np.inf, -np.inf
    for k in range(3):
        ax, ay, bx, by = x0, y0, x1, y1
        if k == 1:
            ax, ay, bx, by = x1, y1, x2, y2
        elif k == 2:
            ax, ay, bx, by = x2, y2, x0, y0
        if min(ay, by) <= y <= max(ay, by):
            share = 0.0 if ay == by else (y - ay) / (by - ay)
            x = ax + share * (bx - ax)
            low, high = min(low, x), max(high, x)
            if ay == by:
                low, high = min(low, bx), max(high, bx)
    return low, high


@inline
def _inside(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> bool:
    """Return whether a point is to the left of an edge; a point on it counts for only one of its directions.

    Both sides evaluate the edge in the same direction, so that rounding is the same.
    """
    rising = ay < by or (ay == by and ax < bx)
    if not rising:
        ax, ay, bx, by = bx, by, ax, ay
    side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    return side >= 0.0 if rising else side < 0.0
