"""Colours of vertices, for all formats: numbers from 0 to 1."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray

__all__ = ["as_colors", "largest_color"]


def as_colors(values: FloatArray, largest: float) -> NDArray[np.float32]:
    """Return red, green and blue, (n, 3) float32, 0 to 1, from numbers (n, 3 or more); `largest` is 1."""
    out: NDArray[np.float32] = np.clip(values[:, :3] / largest, 0.0, 1.0).astype(np.float32)
    return out


def largest_color(values: FloatArray) -> float:
    """Return the number for full intensity in a text: 255 if a number is greater than 1, else 1."""
    return 255.0 if (values[:, :3] > 1.0).any() else 1.0
