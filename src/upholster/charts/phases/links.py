"""Cells that meet, and the continuation of each wave from one to the next."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray

__all__ = ["Links", "matched_waves", "signed"]

_NEAR = 0.4
"""Waves continue in one another if they differ by less than this share of their length. Directions may then
differ by 23 degrees, about as much as where blocks are transferred."""


@dataclass(frozen=True, eq=False, slots=True)
class Links:
    """Pairs of cells that meet.

    Attributes
    ----------
    first, second
        (E,) the cells.
    here, there
        (E, 2) exemplar pixels: the way from the first cell's centre to the common border, in the first cell's
        axes, and from there to the second cell's centre, in the second cell's axes.
    weights
        (E,) length of the common side over distance of the centres.
    goes_on
        (E, 2n) int8: for each wave of the first cell (all n, then their opposites) the wave of the second
        cell that continues it, −1 for none.
    """

    first: IntArray
    second: IntArray
    here: FloatArray
    there: FloatArray
    weights: FloatArray
    goes_on: NDArray[np.int8]


def signed(waves: FloatArray) -> FloatArray:
    """Return waves (n, 2) and their opposites, (2n, 2)."""
    return np.concatenate([waves, -waves])


def matched_waves(waves: FloatArray, before: FloatArray, after: FloatArray) -> NDArray[np.int8]:
    """Return the signed wave of one cell that continues each signed wave of another.

    Parameters
    ----------
    waves
        (n, 2) cycles per exemplar pixel.
    before, after
        (E, 2, 2) exemplar pixels per step, the same steps for both.

    Returns
    -------
    ndarray
        (E, 2n) int8: see `Links.goes_on`. A wave and its opposite continue in a wave and its opposite.
    """
    both = signed(waves)
    left, right = both @ before, both @ after  # (E, 2n, 2) cycles per step
    away = ((left[:, :, None] - right[:, None]) ** 2).sum(axis=3)
    size = (left**2).sum(axis=2)
    nearest = away.argmin(axis=2)
    chosen = np.take_along_axis(away, nearest[..., None], axis=2)[..., 0]
    # A one-to-one match: each continues in one other, which continues no other.
    back = np.take_along_axis(away.argmin(axis=1), nearest, axis=1)
    sure = (chosen <= _NEAR**2 * size) & (back == np.arange(len(both)))
    return np.where(sure, nearest, -1).astype(np.int8)
