"""Which way a normal map's green points: upward (OpenGL) or downward (DirectX), told by the height map."""

import numpy as np

from upholster.image.numbers import to_unit
from upholster.types import FloatArray, PixelArray

__all__ = ["points_down"]

_LEAST = 0.3
"""Correlations below this one tell nothing; those of materials from libraries are 0.8 and more."""


def points_down(normal: PixelArray, height: PixelArray) -> bool | None:
    """Return whether green points downward, so that x and y are the slopes of one relief only if it does.

    A normal is (−∂h/∂x, −∂h/∂y, 1), of any length, with y upward; so both of its slopes correlate with the
    height's with one sign. The sign itself may be either: some height maps are depths.

    Parameters
    ----------
    normal
        (H, W, 3), coded as `upholster.image.material.Material` has it.
    height
        (H, W, 1).

    Returns
    -------
    bool or None
        None if the maps do not agree enough to tell.
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
    """Average 3 × 3: what coarse coding of either map adds is not a slope."""
    padded = np.pad(values, 1, mode="edge")
    rows = padded[:-2] + padded[1:-1] + padded[2:]
    return np.asarray(rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]) / 9


def _correlation(one: FloatArray, two: FloatArray) -> float:
    one, two = one - one.mean(), two - two.mean()
    scale = float(np.sqrt((one**2).sum() * (two**2).sum()))
    return float((one * two).sum()) / scale if scale > 0 else 0.0
