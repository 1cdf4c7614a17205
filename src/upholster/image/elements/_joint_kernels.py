"""Ridges of a plane, the lines along them, and distances from these; all in a fixed order of operations."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.runtime.jit import inline, kernel

__all__ = ["filter_plane", "measure_distances", "measure_ridges", "thin_ridges", "trace_joints"]


@inline
def _mirrored(n: int, size: int) -> int:
    # A plane is mirrored beyond its edges.
    if n < 0:
        n = -1 - n
    return min(n, 2 * size - 1 - n)


@kernel
def filter_plane(
    plane: FloatArray, down: FloatArray, right: FloatArray, scratch: FloatArray, out: FloatArray
) -> None:
    """Filter a plane (H, W) by `down` (2·n + 1,) along its columns, and by `right` (2·n + 1,) along its rows.

    Both sides are longer than n. Values and taps are whole numbers, so that sums are exact.
    """
    height, width = plane.shape
    reach = down.shape[0] // 2
    for i in range(height):
        for j in range(width):
            scratch[i, j] = 0.0
        for k in range(-reach, reach + 1):
            at, tap = _mirrored(i + k, height), down[k + reach]
            for j in range(width):
                scratch[i, j] += tap * plane[at, j]
    for i in range(height):
        for j in range(width):
            out[i, j] = 0.0
        for k in range(-reach, reach + 1):
            tap, first, last = right[k + reach], max(0, -k), min(width, width - k)
            for j in range(first, last):
                out[i, j] += tap * scratch[i, j + k]
            for j in range(first):
                out[i, j] += tap * scratch[i, _mirrored(j + k, width)]
            for j in range(last, width):
                out[i, j] += tap * scratch[i, _mirrored(j + k, width)]


@kernel
def measure_ridges(
    upright: FloatArray,
    level: FloatArray,
    mixed: FloatArray,
    sign: float,
    ridges: FloatArray,
    across: NDArray[np.int8],
) -> None:
    """Measure how strongly a plane bends up, `sign` 1, or down, −1, across a line at each pixel.

    The inputs are its second derivatives, (H, W): down the rows, along them, and mixed. The strength is the
    larger eigenvalue of the Hessian minus half the magnitude of the smaller one. `across` is the direction in
    which the plane bends most: right (0), right and down (1), down (2), left and down (3).
    """
    for i in range(ridges.shape[0]):
        for j in range(ridges.shape[1]):
            mean = 0.5 * sign * (upright[i, j] + level[i, j])
            apart, mixture = 0.5 * sign * (level[i, j] - upright[i, j]), sign * mixed[i, j]
            length = np.sqrt(apart * apart + mixture * mixture)
            ridges[i, j] = max(mean + length - 0.5 * abs(mean - length), 0.0)
            if abs(mixture) <= abs(apart):
                across[i, j] = 0 if apart > 0.0 else 2
            else:
                across[i, j] = 1 if mixture > 0.0 else 3


@kernel
def thin_ridges(ridges: FloatArray, across: NDArray[np.int8], least: float, thin: NDArray[np.uint8]) -> None:
    """Mark the crests of ridges (H, W): above `least`, and not lower than the pixels on either side."""
    height, width = ridges.shape
    for i in range(height):
        for j in range(width):
            kind, value = across[i, j], ridges[i, j]
            down, right = (0 if kind == 0 else 1), (0 if kind == 2 else -1 if kind == 3 else 1)
            one = ridges[min(max(i - down, 0), height - 1), min(max(j - right, 0), width - 1)]
            other = ridges[min(max(i + down, 0), height - 1), min(max(j + right, 0), width - 1)]
            thin[i, j] = value > least and value >= one and value >= other


@kernel
def trace_joints(
    ridges: FloatArray, thin: NDArray[np.uint8], strong: float, long: int, queue: NDArray[np.int32]
) -> None:
    """Mark the lines that touching pixels of `thin` make: long ones as 2, the others as 1.

    A line counts if it is above `strong` somewhere; it is long if it spans `long` pixels, down or across.
    `queue` (H · W,) is scratch.
    """
    height, width = thin.shape
    for start in range(height * width):
        if thin[start // width, start % width] != 1 or not ridges[start // width, start % width] > strong:
            continue
        thin[start // width, start % width], queue[0] = 3, start
        head, tail = 0, 1
        top, low, left, last = height, 0, width, 0
        while head < tail:
            i, j = queue[head] // width, queue[head] % width
            head += 1
            top, low, left, last = min(top, i), max(low, i), min(left, j), max(last, j)
            for y in range(max(i - 1, 0), min(i + 2, height)):
                for x in range(max(j - 1, 0), min(j + 2, width)):
                    if thin[y, x] == 1:
                        thin[y, x], queue[tail] = 3, y * width + x
                        tail += 1
        kind = 2 if max(low - top, last - left) + 1 >= long else 4
        for n in range(tail):
            thin[queue[n] // width, queue[n] % width] = kind
    for i in range(height):
        for j in range(width):
            kind = thin[i, j]
            thin[i, j] = 2 if kind == 2 else 1 if kind == 4 else 0


@inline
def _nearer(distances: NDArray[np.int32], i: int, j: int, steps: Any) -> None:
    height, width = distances.shape
    for down, right, length in steps:
        y, x = i + down, j + right
        if y >= 0 and y < height and x >= 0 and x < width:
            distances[i, j] = min(distances[i, j], distances[y, x] + length)


@kernel
def measure_distances(lines: NDArray[np.uint8], distances: NDArray[np.int32]) -> None:
    """Measure each pixel's distance from the nearest of `lines` (H, W), in thirds of a pixel, to about 5 %.

    References
    ----------
    Borgefors: Distance transformations in digital images, CVGIP 34 (1986), the chamfer 3-4 distance.
    """
    height, width = distances.shape
    for i in range(height):
        for j in range(width):
            distances[i, j] = 0 if lines[i, j] else 3 * (height + width)
            _nearer(distances, i, j, ((0, -1, 3), (-1, -1, 4), (-1, 0, 3), (-1, 1, 4)))
    for i in range(height - 1, -1, -1):
        for j in range(width - 1, -1, -1):
            _nearer(distances, i, j, ((0, 1, 3), (1, 1, 4), (1, 0, 3), (1, -1, 4)))
