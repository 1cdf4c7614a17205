"""Hot loops over charts' steps: the triangle that each step is in, and values interpolated from corners."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.runtime.jit import inline, kernel

__all__ = ["CLOSE", "StepGrid", "bounds", "clamped", "interpolate", "locate_steps"]

CLOSE = 0.75
"""Texels: a texel this close to a triangle belongs to it."""


class StepGrid(NamedTuple):
    """Charts' steps, chart by chart: step (r, c) of chart k is at ``firsts[k] + r·widths[k] + c``.

    `heights` and `widths` are the charts' sizes in steps.
    """

    firsts: NDArray[np.int64]
    heights: NDArray[np.int64]
    widths: NDArray[np.int64]


@inline
def clamped(b: float, c: float) -> tuple[float, float]:
    """Return the barycentric coordinates of a place near a triangle, clamped to the triangle."""
    b, c = max(b, 0.0), max(c, 0.0)
    total = b + c
    return (b / total, c / total) if total > 1.0 else (b, c)


@inline
def bounds(a: float, b: float, c: float, beyond: float, size: int) -> tuple[int, int]:
    """Return the range (from, to) of integers spanned by three numbers, at most `beyond` outside them."""
    low = int64(np.ceil(min(a, b, c) - beyond))
    return max(low, 0), min(int64(np.floor(max(a, b, c) + beyond)) + 1, size)


@kernel
def locate_steps(
    places: FloatArray,
    chart: IntArray,
    grid: StepGrid,
    triangles: IntArray,
    share: tuple[int, int],
    away: NDArray[np.float32],
) -> None:
    """Write the triangle that contains each step's centre, or else the nearest close one, to `triangles`.

    `places` (T, 3, 2) are the triangles' corners on the charts, where step (r, c) has its centre at (r, c).
    `share` (n, of how many) selects part n of each chart's rows. `triangles` (steps,) is −1 at first; `away`
    (steps,) is scratch space, infinite at first.
    """
    for t in range(places.shape[0]):
        k = int64(chart[t])
        if k < 0:
            continue
        p = places[t]
        y1, x1, y2, x2 = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
        area = y1 * x2 - x1 * y2
        if area <= 1e-12:
            continue
        rows = grid.heights[k]
        top, bottom = bounds(p[0, 0], p[1, 0], p[2, 0], CLOSE, rows)
        top, bottom = max(top, rows * share[0] // share[1]), min(bottom, rows * (share[0] + 1) // share[1])
        left, right = bounds(p[0, 1], p[1, 1], p[2, 1], CLOSE, grid.widths[k])
        for r in range(top, bottom):
            y = r - p[0, 0]
            for c in range(left, right):
                x = c - p[0, 1]
                b0, d0 = (y * x2 - x * y2) / area, (y1 * x - x1 * y) / area
                b, d = clamped(b0, d0)
                away_y, away_x = y - b * y1 - d * y2, x - b * x1 - d * x2
                far = np.float32(away_y * away_y + away_x * away_x)
                at = grid.firsts[k] + r * grid.widths[k] + c
                if far <= CLOSE * CLOSE and far < away[at]:
                    away[at] = far
                    triangles[at] = t


@kernel
def interpolate(
    steps: FloatArray, triangles: IntArray, places: FloatArray, corners: FloatArray, out: FloatArray
) -> None:
    """Interpolate corner values `corners` (T, 3, k) at places `steps` (n, 2) of a chart; write `out` (n, k).

    `triangles` (n,) gives the triangle that contains each place or is next to it. A place outside takes the
    value at approximately the nearest point of the triangle.
    """
    for n in range(steps.shape[0]):
        t = triangles[n]
        p = places[t]
        y1, x1, y2, x2 = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
        area = y1 * x2 - x1 * y2
        y, x = steps[n, 0] - p[0, 0], steps[n, 1] - p[0, 1]
        b, c = clamped((y * x2 - x * y2) / area, (y1 * x - x1 * y) / area)
        for k in range(out.shape[1]):
            first = corners[t, 0, k]
            out[n, k] = first + b * (corners[t, 1, k] - first) + c * (corners[t, 2, k] - first)
