"""Whether a normal map's green points upward (OpenGL) or downward (DirectX), from the height map."""

import numpy as np

from upholster.base.types import FloatArray, PixelArray
from upholster.image.numbers import to_unit

__all__ = ["points_down"]

_LEAST = 0.3
"""Correlations below this are inconclusive; those of materials from libraries are 0.8 and more."""


def points_down(normal: PixelArray, height: PixelArray) -> bool | None:
    """Return whether green points downward: only then are x and y the slopes of one relief.

    A normal is (−∂h/∂x, −∂h/∂y, 1), of any length, with y upward. So both of its slopes correlate with those
    of the height with the same sign. The sign itself may be either: some height maps are depths.

    Parameters
    ----------
    normal
        (H, W, 3), coded as `upholster.image.files.material.Material` has it.
    height
        (H, W, 1).

    Returns
    -------
    bool or None
        None if the maps do not agree well enough.
    """
    vectors = 2 * to_unit(normal) - 1
    by_row, by_column = (np.asarray(slope) for slope in np.gradient(_smoothed(to_unit(height)[:, :, 0])))
    slopes = vectors[:, :, :2] / np.maximum(vectors[:, :, 2:], 0.05)
    right = _correlation(_smoothed(slopes[:, :, 0]), -by_column)
    up = _correlation(_smoothed(slopes[:, :, 1]), by_row)
    if min(abs(right), abs(up)) < _LEAST:
        return None
    return bool(right * up < 0)


def _smoothed(values: FloatArray) -> FloatArray:
    """Average 3 × 3, to remove steps that come from coarse coding of either map."""
    padded = np.pad(values, 1, mode="edge")
    rows = padded[:-2] + padded[1:-1] + padded[2:]
    return np.asarray(rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]) / 9


def _correlation(one: FloatArray, two: FloatArray) -> float:
    one, two = one - one.mean(), two - two.mean()
    scale = float(np.sqrt((one**2).sum() * (two**2).sum()))
    return float((one * two).sum()) / scale if scale > 0 else 0.0
