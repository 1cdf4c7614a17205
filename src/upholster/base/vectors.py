"""Vectors of length 1."""

import numpy as np

from upholster.base.types import FloatArray

__all__ = ["unit_vectors"]


def unit_vectors(
    vectors: FloatArray, *, least: float = 1e-300, instead: FloatArray | float | None = None
) -> FloatArray:
    """Return vectors (…, n) divided by their lengths; vectors of length 0 stay 0.

    Vectors no longer than `least` are replaced by `instead` if it is given; otherwise they are divided by
    `least`, and stay shorter than 1.
    """
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: FloatArray = vectors / np.maximum(length, least)
    return unit if instead is None else np.where(length > least, unit, instead)
