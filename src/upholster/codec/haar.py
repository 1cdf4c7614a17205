"""The n-level orthonormal 2-D Haar transform (paper, section 4.2, equations 1 to 6).

Coefficients are in one array of the image's shape, in the usual nested layout: LLn in the top left corner,
and for each level HL to its right, LH below it, HH diagonally. With h × w samples at a level, the next one
has ⌈h/2⌉ × ⌈w/2⌉. The paper counts levels from 0; here level 1 is the finest.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.codec._haar_kernels import haar_forward, haar_inverse

__all__ = ["dwt2", "idwt2", "level_shape", "merge_pairs", "split_pairs", "subbands"]


def dwt2(image: NDArray[Any], *, levels: int = 3) -> FloatArray:
    """Transform an image; its energy stays the same.

    One level on samples a b / c d gives LL = (a+b+c+d)/2, HL = (a−b+c−d)/2 (vertical details),
    LH = (a+b−c−d)/2 (horizontal details) and HH = (a−b−c+d)/2.

    Parameters
    ----------
    image
        (H, W) or (H, W, C), any real dtype; each channel is transformed on its own.
    levels
        1 to 30; each halves the approximation, and a side of 1 stays 1.

    Returns
    -------
    ndarray
        Coefficients, float64, of the image's shape; `subbands` names its parts.

    Raises
    ------
    InputError
        For another number of dimensions, an empty image, or levels out of range.

    References
    ----------
    Shet, Bez, Edirisinghe: Progressive texture synthesis on geometric surfaces, equations 1 to 4.
    """
    samples = _planes(image, levels)
    out = np.empty(samples.shape)
    low = samples
    for level in range(1, levels + 1):
        image_in, low = low, np.empty((*level_shape(samples.shape[:2], level), samples.shape[2]))
        haar_forward(image_in, low, out)
    out[: low.shape[0], : low.shape[1]] = low
    return out.reshape(np.shape(image))


def idwt2(coefficients: NDArray[Any], *, levels: int = 3) -> FloatArray:
    """Invert `dwt2`: the same shape and levels give the image back to rounding (equations 5 and 6).

    Raises
    ------
    InputError
        As `dwt2`.
    """
    samples = _planes(coefficients, levels)
    height, width = level_shape(samples.shape[:2], levels)
    low = np.ascontiguousarray(samples[:height, :width])
    for level in range(levels, 0, -1):
        image = np.empty((*level_shape(samples.shape[:2], level - 1), samples.shape[2]))
        haar_inverse(low, samples, image)
        low = image
    return low.reshape(np.shape(coefficients))


def split_pairs(image: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Transform an image by one level; a last row or column without a partner is used twice.

    Parameters
    ----------
    image
        (h, w, c).

    Returns
    -------
    low, parts : ndarray
        LL, (⌈h/2⌉, ⌈w/2⌉, c); and HL, LH, HH in their quadrants of (2·⌈h/2⌉, 2·⌈w/2⌉, c).
    """
    height, width, channels = image.shape
    pairs = np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    low, parts = np.empty((*level_shape(image.shape, 1), channels)), np.zeros(pairs.shape)
    haar_forward(pairs, low, parts)
    return low, parts


def merge_pairs(low: FloatArray, nested: FloatArray) -> FloatArray:
    """Invert `split_pairs`: from LL, and HL, LH, HH in their places of (h, w, c), to (h, w, c)."""
    height, width, channels = nested.shape
    parts = np.zeros((2 * low.shape[0], 2 * low.shape[1], channels))
    parts[:height, :width] = nested
    pairs = np.empty(parts.shape)
    haar_inverse(np.ascontiguousarray(low), parts, pairs)
    return pairs[:height, :width]


def level_shape(shape: tuple[int, ...], level: int) -> tuple[int, int]:
    """Return (height, width) of LL at `level` of an image of `shape`; level 0 is the image itself."""
    return -(-shape[0] // 2**level), -(-shape[1] // 2**level)


def subbands(coefficients: NDArray[Any], *, levels: int = 3) -> dict[str, NDArray[Any]]:
    """Name the parts of `dwt2`'s result: views "LL3", "HL3", "LH3", "HH3", "HL2", … "HH1" for three levels.

    Raises
    ------
    InputError
        As `dwt2`.
    """
    _planes(coefficients, levels, copy=False)
    shape = coefficients.shape
    height, width = level_shape(shape, levels)
    bands = {f"LL{levels}": coefficients[:height, :width]}
    for level in range(levels, 0, -1):
        (outer_height, outer_width), (height, width) = (
            level_shape(shape, level - 1),
            level_shape(shape, level),
        )
        bands[f"HL{level}"] = coefficients[:height, width:outer_width]
        bands[f"LH{level}"] = coefficients[height:outer_height, :width]
        bands[f"HH{level}"] = coefficients[height:outer_height, width:outer_width]
    return bands


def _planes(array: NDArray[Any], levels: int, *, copy: bool = True) -> FloatArray:
    shape = np.shape(array)
    if len(shape) not in (2, 3) or 0 in shape:
        raise InputError(
            f"image has shape {shape}; allowed: (height, width) or (height, width, channels), not empty"
        )
    if not 1 <= levels <= 30:
        raise InputError(f"levels is {levels}; allowed: 1 to 30")
    if not copy:
        return array
    samples = np.ascontiguousarray(array, dtype=np.float64)
    return samples.reshape(*shape[:2], -1)
