"""How alike a sample and its shifted copy are, for every shift: sums in whole numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.image.elements.planes import Plane

__all__ = [
    "ALIKE",
    "Correlation",
    "correlation",
    "highest",
    "shifted_products",
]

ALIKE = 2**14
"""The correlation of equal planes."""


@dataclass(frozen=True, eq=False)
class Correlation:
    """The correlation of planes with their shifted copies.

    Attributes
    ----------
    heights
        (2·R + 1, 2·C + 1) int64, at shifts of −R…R rows and −C…C columns; 2^14 for equal planes.
    overlaps
        Of the same shape, int64: the pixels that the planes and their copies share.
    size
        Rows and columns of the planes.
    """

    heights: Plane
    overlaps: Plane
    size: tuple[int, int]

    @property
    def reach(self) -> tuple[int, int]:
        """R and C."""
        return self.heights.shape[0] // 2, self.heights.shape[1] // 2

    def within(self, shifts: Plane) -> NDArray[np.bool_]:
        """Return which shifts (…, 2) are within reach."""
        inside: NDArray[np.bool_] = np.asarray((np.abs(shifts) <= self.reach).all(axis=-1))
        return inside

    def at(self, values: Plane, shifts: Plane) -> Plane:
        """Return the values, of the shape of `heights`, at shifts (…, 2); the nearest beyond the reach."""
        places = np.clip(shifts + self.reach, 0, np.array(self.heights.shape) - 1)
        found: Plane = values[places[..., 0], places[..., 1]]
        return found


def correlation(planes: Sequence[Plane], reach: tuple[int, int]) -> Correlation:
    """Return the correlation of planes with their shifted copies, over the pixels that both share.

    The means of the shared pixels are subtracted, plane by plane.

    Parameters
    ----------
    planes
        (H, W) int64 each, whole numbers of at most about 2^13, and 2^8 in the root mean square.
    reach
        Rows and columns of the farthest shift, less than H and W.
    """
    height, width = planes[0].shape
    rows, columns = reach
    # The exact products are integers far below 2^53, so rounding removes the transform's error.
    products = np.rint(shifted_products(planes, reach))
    square = np.zeros((height, width), np.int64)
    for plane in planes:
        square += plane * plane
    down = np.arange(height, height - rows - 1, -1)[:, None]
    overlaps = down * np.arange(width, width - columns - 1, -1)
    squares, sums = _shared(square, reach), [_shared(plane, reach) for plane in planes]
    halves = []
    for side, part in enumerate((products[:, columns:], products[:, columns::-1])):
        means = np.zeros(overlaps.shape)
        spread = [squares[side][0].astype(np.float64), squares[side][1].astype(np.float64)]
        for one, other in (found[side] for found in sums):
            means += one * other / overlaps
            spread[0] -= one * one / overlaps
            spread[1] -= other * other / overlaps
        varied = np.sqrt(np.maximum(spread[0], 0) * np.maximum(spread[1], 0))
        alike = (part - means) / np.maximum(varied, 1.0)
        halves.append(np.rint(ALIKE * np.clip(alike, -1, 1)).astype(np.int64))
    heights = np.hstack([halves[1][:, :0:-1], halves[0]])
    overlaps = np.hstack([overlaps[:, :0:-1], overlaps])
    return Correlation(_around(heights), _around(overlaps), (height, width))


def _around(lower: Plane) -> Plane:
    # Shifts up are the mirror image of shifts down.
    return np.concatenate([lower[:0:-1, ::-1], lower])


def _shared(plane: Plane, reach: tuple[int, int]) -> tuple[tuple[Plane, Plane], tuple[Plane, Plane]]:
    # Sums over the pixels that a plane shares with its copy, in either: shifted down and to the right, and
    # down and to the left.
    height, width = plane.shape
    total = np.zeros((height + 1, width + 1), np.int64)
    np.cumsum(np.cumsum(plane, axis=0), axis=1, out=total[1:, 1:])
    rows, columns = reach
    upper, left = total[: rows + 1], np.s_[: columns + 1]
    lower = total[height - rows :][::-1]
    right = np.s_[width : width - columns - 1 : -1]
    every = total[-1]
    return (
        (lower[:, right], every[-1] - upper[:, -1:] - every[left] + upper[:, left]),
        (lower[:, -1:] - lower[:, left], every[right] - upper[:, right]),
    )


def highest(values: NDArray[Any], near: int) -> NDArray[Any]:
    """Return the highest of the values (H, W) within `near` rows and columns of each."""
    for _ in range(2):
        padded = np.pad(values, ((near, near), (0, 0)), mode="edge")
        have, size = 1, 2 * near + 1
        while have < size:  # the highest of `have` rows from each row on
            step = min(have, size - have)
            padded = np.maximum(padded[: len(padded) - step], padded[step:])
            have += step
        values = padded.T
    return values


def shifted_products(planes: Sequence[Plane | FloatArray], reach: tuple[int, int]) -> FloatArray:
    """Return Σ x(p)·x(p + d) over all planes and all places p where both exist, for all shifts d.

    Parameters
    ----------
    planes
        (H, W) each.
    reach
        Rows and columns of the farthest shift.

    Returns
    -------
    ndarray
        (rows + 1, 2 · columns + 1) float64, for shifts of 0…rows and −columns…columns. Shifts by negative
        rows mirror them.
    """
    height, width = planes[0].shape
    rows, columns = np.arange(reach[0] + 1)[:, None], np.arange(-reach[1], reach[1] + 1)
    # Zeros beyond the borders prevent shifts from wrapping around.
    sizes = _smooth(height + reach[0]), _smooth(width + reach[1])
    power = np.zeros((sizes[0], sizes[1] // 2 + 1))
    for plane in planes:
        spectrum = np.fft.rfft2(plane, sizes)
        power += spectrum.real * spectrum.real + spectrum.imag * spectrum.imag
    found: FloatArray = np.fft.irfft2(power, sizes)[rows, columns]
    return found


def _smooth(size: int) -> int:
    """Return the next size whose only prime factors are 2, 3 and 5, which is fast to transform."""
    while True:
        rest = size
        for factor in (2, 3, 5):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return size
        size += 1
