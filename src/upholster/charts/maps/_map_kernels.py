"""Hot loops of maps: looking up images, choosing and spreading coarse steps, and finding strokes."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.runtime.jit import inline, kernel

__all__ = ["ALIKE", "look_up", "middle_steps", "nearest_strokes", "spread"]

ALIKE = 0.5
"""Cosine between normals of adjacent cells from which they influence each other."""

BESIDE_EACH_OTHER = 256
"""Number of points that share one list of the strokes that may reach them."""


@kernel
def look_up(grey: NDArray[np.float32], uv: FloatArray, repeats: bool, out: NDArray[np.float32]) -> None:
    """Write to `out` (n,) an image's values (height, width) at places `uv` (n, 2), bilinear between pixels.

    u runs to the right and v downward, from 0 to 1. Beyond that the image repeats, or its border continues.
    Clear pixels are NaN: places in them give NaN, and elsewhere they have no weight. Places that are NaN give
    NaN.
    """
    height, width = grey.shape
    for n in range(uv.shape[0]):
        u, v = uv[n, 0], uv[n, 1]
        out[n] = np.nan
        if not (np.isfinite(u) and np.isfinite(v)):
            continue
        u = u - np.floor(u) if repeats else min(max(u, 0.0), 1.0)
        v = v - np.floor(v) if repeats else min(max(v, 0.0), 1.0)
        if np.isnan(grey[min(int64(v * height), height - 1), min(int64(u * width), width - 1)]):
            continue
        y, x = v * height - 0.5, u * width - 0.5
        top, left = int64(np.floor(y)), int64(np.floor(x))
        total, weights = 0.0, 0.0
        for r in range(top, top + 2):
            for c in range(left, left + 2):
                row = r % height if repeats else min(max(r, 0), height - 1)
                column = c % width if repeats else min(max(c, 0), width - 1)
                weight = (1.0 - abs(y - r)) * (1.0 - abs(x - c))
                if not np.isnan(grey[row, column]):
                    total += weight * grey[row, column]
                    weights += weight
        out[n] = np.float32(total / weights)


@kernel
def middle_steps(triangles: IntArray, stride: int, found: NDArray[np.int64]) -> None:
    """Write to `found` (rows, columns, 2) the step of each cell that is nearest to its middle; −1 for none.

    Cells are `stride` steps wide. `triangles` (height, width) is negative for steps off the surface.
    """
    height, width = triangles.shape
    for i in range(found.shape[0]):
        for j in range(found.shape[1]):
            found[i, j, :] = -1
            least = 4.0 * stride * stride
            for r in range(i * stride, min((i + 1) * stride, height)):
                for c in range(j * stride, min((j + 1) * stride, width)):
                    y, x = r + 0.5 - (i + 0.5) * stride, c + 0.5 - (j + 0.5) * stride
                    if triangles[r, c] >= 0 and y * y + x * x < least:
                        least = y * y + x * x
                        found[i, j, 0], found[i, j, 1] = r, c


@kernel
def spread(
    steps: FloatArray,
    stride: int,
    values: NDArray[np.float32],
    points: FloatArray,
    normals: FloatArray,
    reach: FloatArray,
    out: NDArray[np.float32],
) -> None:
    """Write to `out` (n,) cells' values, interpolated bilinearly, at `steps` (n, 2).

    Parameters
    ----------
    steps
        (n, 2): rows and columns of places on the chart.
    stride
        Width of a cell in steps.
    values
        (rows, columns): NaN in cells without a value. The cells that contain the steps have values.
    points
        (rows, columns, 3): the cells' positions in space.
    normals
        (rows, columns, 3): a neighbour counts if its normal differs by 60° at most.
    reach
        (rows, columns): a neighbour counts up to this distance in space.
    """
    for n in range(steps.shape[0]):
        y, x = steps[n, 0] / stride, steps[n, 1] / stride
        own_row, own_column = int64(y), int64(x)
        top, left = int64(np.floor(y - 0.5)), int64(np.floor(x - 0.5))
        total, weights = 0.0, 0.0
        for r in range(max(top, 0), min(top + 2, values.shape[0])):
            for c in range(max(left, 0), min(left + 2, values.shape[1])):
                if np.isnan(values[r, c]):
                    continue
                away, alike = 0.0, 0.0
                for axis in range(3):
                    offset = points[r, c, axis] - points[own_row, own_column, axis]
                    away += offset * offset
                    alike += normals[r, c, axis] * normals[own_row, own_column, axis]
                if r == own_row and c == own_column:
                    alike = 1.0
                if alike >= ALIKE and away <= reach[own_row, own_column] * reach[own_row, own_column]:
                    weight = (1.0 - abs(y - 0.5 - r)) * (1.0 - abs(x - 0.5 - c))
                    total += weight * values[r, c]
                    weights += weight
        out[n] = np.float32(total / weights)


@inline
def _radius(points: FloatArray, first: int, last: int, middle: int) -> float:
    # Radius of the ball around one of some points that contains them all.
    radius = 0.0
    for n in range(first, last):
        a, b = points[n, 0] - points[middle, 0], points[n, 1] - points[middle, 1]
        c = points[n, 2] - points[middle, 2]
        radius = max(radius, a * a + b * b + c * c)
    return float(np.sqrt(radius))


@kernel
def nearest_strokes(
    points: FloatArray,
    normals: FloatArray,
    places: FloatArray,
    facing: FloatArray,
    radii: FloatArray,
    values: FloatArray,
    listed: IntArray,
    out: NDArray[np.float32],
) -> None:
    """Write to `out` (n,) the value of the stroke nearest to each point, NaN where none reaches.

    `points` and `normals` are (n, 3). Strokes have `places` and normals `facing` (S, 3), `radii` and `values`
    (S,). A stroke reaches the points within its radius whose normal differs by at most 120° from its own.
    `listed` (S,) is scratch space.
    """
    for first in range(0, points.shape[0], BESIDE_EACH_OTHER):
        last = min(first + BESIDE_EACH_OTHER, points.shape[0])
        middle = (first + last) // 2
        radius = _radius(points, first, last, middle)
        count = int64(0)
        for s in range(places.shape[0]):
            a, b = places[s, 0] - points[middle, 0], places[s, 1] - points[middle, 1]
            c = places[s, 2] - points[middle, 2]
            reach = (radius + radii[s]) * (1.0 + 1e-9)
            if a * a + b * b + c * c <= reach * reach:
                listed[count] = s
                count += 1
        for n in range(first, last):
            least, value = np.inf, np.nan
            for m in range(count):
                s = listed[m]
                a, b, c = (
                    places[s, 0] - points[n, 0],
                    places[s, 1] - points[n, 1],
                    places[s, 2] - points[n, 2],
                )
                away = a * a + b * b + c * c
                if away > radii[s] * radii[s] or away > least:
                    continue
                alike = facing[s, 0] * normals[n, 0] + facing[s, 1] * normals[n, 1]
                if alike + facing[s, 2] * normals[n, 2] >= -0.5:
                    least, value = away, values[s]
            out[n] = np.float32(value)
