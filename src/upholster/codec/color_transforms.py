"""Colour transforms for coding: one fitted to the image (KLT), and a reversible one (YCoCg-R).

The KLT's matrix is orthonormal except for rounding; its entries are stored in 1/16384. Decoders compute with
the
stored matrix in float64, in a fixed order.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray

__all__ = ["MATRIX_UNIT", "fit_klt", "from_ycocg", "to_ycocg", "unmix"]

MATRIX_UNIT = 16384


def fit_klt(pixels: FloatArray) -> NDArray[np.int16]:
    """Return the matrix from principal components to colours, (3, 3) int16 in 1/16384.

    Parameters
    ----------
    pixels
        (..., 3) colours with their means taken off.

    Returns
    -------
    ndarray
        Columns are the principal axes, strongest first, each with its largest entry positive.
    """
    flat = pixels.reshape(-1, 3)
    _, axes = np.linalg.eigh(flat.T @ flat)
    axes = axes[:, ::-1]
    signs = np.sign(axes[np.abs(axes).argmax(axis=0), np.arange(3)])
    return np.rint(axes * np.where(signs == 0, 1, signs) * MATRIX_UNIT).astype(np.int16)


def unmix(components: FloatArray, matrix: NDArray[np.int16]) -> FloatArray:
    """Turn principal components (..., 3) into colours: (c0·m0 + c1·m1) + c2·m2, in this order."""
    scaled = matrix.astype(np.float64) / MATRIX_UNIT
    colors = np.empty_like(components)
    for k in range(3):
        colors[..., k] = (components[..., 0] * scaled[k, 0] + components[..., 1] * scaled[k, 1]) + components[
            ..., 2
        ] * scaled[k, 2]
    return colors


def to_ycocg(pixels: NDArray[np.int32]) -> NDArray[np.int32]:
    """Turn RGB integers (..., 3) into YCoCg-R, reversibly (Malvar, Sullivan 2003)."""
    red, green, blue = pixels[..., 0], pixels[..., 1], pixels[..., 2]
    orange = red - blue
    middle = blue + (orange >> 1)
    difference = green - middle
    return np.stack([middle + (difference >> 1), orange, difference], axis=-1)


def from_ycocg(values: NDArray[np.int32]) -> NDArray[np.int32]:
    """Invert `to_ycocg`."""
    luma, orange, difference = values[..., 0], values[..., 1], values[..., 2]
    middle = luma - (difference >> 1)
    blue = middle - (orange >> 1)
    return np.stack([blue + orange, difference + middle, blue], axis=-1)
