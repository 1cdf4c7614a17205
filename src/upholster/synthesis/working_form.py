"""The working form: an exemplar in fixed point, which gives every method equal results on any machine."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray

__all__ = ["working_form"]

WORKING_MAX = 1023


def working_form(exemplar: PixelArray) -> NDArray[np.uint16]:
    """Return the exemplar in the form that matching compares: (H, W, C) uint16 from 0 to 1023.

    8-bit samples times 4, 16-bit samples divided by 64; float samples scaled from their minimum to maximum.
    """
    if exemplar.dtype == np.uint8:
        return np.left_shift(exemplar, 2, dtype=np.uint16)
    if exemplar.dtype == np.uint16:
        return np.right_shift(exemplar, 6, dtype=np.uint16)
    low, high = float(exemplar.min()), float(exemplar.max())
    scale = WORKING_MAX / (high - low) if high > low else 0.0
    return np.rint((exemplar.astype(np.float64) - low) * scale).astype(np.uint16)
