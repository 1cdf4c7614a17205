"""Wavelet transforms for coding: 9/7 in float64, 5/3 in integers, reversible; Haar in float64, orthonormal.

Coefficients are nested in an array of the image's shape, as in `upholster.codec.haar`. Any size from 1×1
works; each level halves both sides, rounding up, and a side of 1 stays 1.

The first two are lifted. Haar is that of `upholster.codec.haar`, except that a last row or column without a
partner is used twice: so a coefficient of level l is a multiple of 2^-l, and no operation on it rounds.
"""

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.codec._lifting_kernels import DAUBECHIES97, LEGALL53, lift_forward, lift_inverse
from upholster.codec.haar import level_shape, merge_pairs, split_pairs

__all__ = ["MAX_LEVELS", "WAVELETS", "Wavelet", "band_norms", "forward", "inverse"]

Wavelet = Literal["9/7", "5/3", "haar"]

MAX_LEVELS = 10

WAVELETS: dict[str, type] = {"9/7": np.float64, "5/3": np.int32, "haar": np.float64}
"""The dtype of each wavelet's computation."""

_LIFTED = {"9/7": (DAUBECHIES97, 4), "5/3": (LEGALL53, 2)}
"""Kind and number of steps of the lifted ones."""

# L2 norms of the synthesis functions of LL, HL (as LH) and HH at levels 1, 2 …; later levels use the last.
_NORMS: dict[str, tuple[tuple[float, float, float], ...]] = {
    "9/7": (
        (0.9830, 1.0113, 1.0404),
        (1.0306, 0.9984, 0.9672),
        (1.0521, 1.0458, 1.0396),
        (1.0585, 1.0668, 1.0751),
        (1.0602, 1.0729, 1.0858),
        (1.0606, 1.0745, 1.0887),
        (1.0607, 1.0749, 1.0894),
    ),
}


def forward(image: NDArray[Any], *, wavelet: Wavelet, levels: int) -> NDArray[Any]:
    """Transform an image.

    Parameters
    ----------
    image
        (H, W) or (H, W, C), at least 1×1; integers for "5/3", within ±2^24.
    wavelet
        "9/7" (float64), "5/3" (int32, reversible) or "haar" (float64).
    levels
        0 to 10.

    Returns
    -------
    ndarray
        Coefficients of the image's shape: float64 or int32.

    Raises
    ------
    InputError
        For an unknown wavelet, levels out of range, or an array that does not fit.

    References
    ----------
    Daubechies, Sweldens: Factoring wavelet transforms into lifting steps, 1998. Calderbank et al.: Wavelet
    transforms that map integers to integers, 1998.
    """
    _check(image, wavelet, levels)
    if wavelet == "haar":
        return _haar_forward(image, levels)
    planes, kind, steps = _planes(image, wavelet)
    out = np.empty_like(planes)
    for low, nested in zip(planes, out, strict=True):
        for level in range(1, levels + 1):
            samples, low = low, np.empty(level_shape(planes.shape[1:], level), planes.dtype)
            lift_forward(kind, steps, samples, low, nested)
        nested[: low.shape[0], : low.shape[1]] = low
    return _joined(out, image)


def inverse(coefficients: NDArray[Any], *, wavelet: Wavelet, levels: int) -> NDArray[Any]:
    """Invert `forward`: exactly for "5/3" and for "haar" coefficients of integers, to rounding for "9/7".

    Raises
    ------
    InputError
        As `forward`.
    """
    _check(coefficients, wavelet, levels)
    if wavelet == "haar":
        return _haar_inverse(coefficients, levels)
    planes, kind, steps = _planes(coefficients, wavelet)
    shape = planes.shape[1:]
    height, width = level_shape(shape, levels)
    out = np.empty_like(planes)
    for nested, image in zip(planes, out, strict=True):
        low = np.ascontiguousarray(nested[:height, :width])
        for level in range(levels - 1, 0, -1):
            samples = np.empty(level_shape(shape, level), planes.dtype)
            lift_inverse(kind, steps, low, nested, samples)
            low = samples
        if levels > 0:
            lift_inverse(kind, steps, low, nested, image)
        else:
            image[...] = low
    return _joined(out, coefficients)


def band_norms(wavelet: Wavelet, level: int) -> tuple[float, float, float, float]:
    """Return the L2 norms of the synthesis functions of LL, HL, LH and HH at `level` (0: the image itself).

    A coefficient times its norm is its weight, in samples. For the integer transform the norms are rounded to
    powers of 2, so that weighting is a shift.
    """
    if level == 0 or wavelet == "haar":
        return 1.0, 1.0, 1.0, 1.0
    if wavelet == "9/7":
        low, mixed, high = _NORMS["9/7"][min(level, 7) - 1]
    else:
        low, mixed, high = 2.0**level, 2.0 ** (level - 1), 2.0 ** (level - 2)
    return low, mixed, mixed, high


def _haar_forward(image: NDArray[Any], levels: int) -> FloatArray:
    low = np.array(image, np.float64).reshape(*image.shape[:2], -1)
    nested = np.empty(low.shape)
    for _ in range(levels):
        height, width = low.shape[:2]
        low, parts = split_pairs(low)
        nested[:height, :width] = parts[:height, :width]
    nested[: low.shape[0], : low.shape[1]] = low
    return nested.reshape(image.shape)


def _haar_inverse(coefficients: NDArray[Any], levels: int) -> FloatArray:
    nested = np.asarray(coefficients, np.float64).reshape(*coefficients.shape[:2], -1)
    height, width = level_shape(nested.shape, levels)
    low = nested[:height, :width]
    for level in range(levels - 1, -1, -1):
        height, width = level_shape(nested.shape, level)
        low = merge_pairs(low, nested[:height, :width])
    return low.reshape(coefficients.shape)


def _check(array: NDArray[Any], wavelet: Wavelet, levels: int) -> None:
    shape = np.shape(array)
    if wavelet not in WAVELETS:
        raise InputError(f"unknown wavelet {wavelet!r}; allowed: {', '.join(WAVELETS)}")
    if not 0 <= levels <= MAX_LEVELS:
        raise InputError(f"levels is {levels}; allowed: 0 to {MAX_LEVELS}")
    if len(shape) not in (2, 3) or 0 in shape:
        raise InputError(f"image has shape {shape}; allowed: (height, width) or (height, width, channels)")
    if WAVELETS[wavelet] is np.int32 and not np.issubdtype(np.asarray(array).dtype, np.integer):
        raise InputError(f"image is of {np.asarray(array).dtype}; wavelet {wavelet} is for integers")


def _planes(array: NDArray[Any], wavelet: Wavelet) -> tuple[NDArray[Any], int, int]:
    # (channels, height, width), of the wavelet's dtype; with the wavelet's kind and number of steps.
    kind, steps = _LIFTED[wavelet]
    stacked = np.reshape(array, (*np.shape(array)[:2], -1)).transpose(2, 0, 1)
    return np.ascontiguousarray(stacked, dtype=WAVELETS[wavelet]), kind, steps


def _joined(planes: NDArray[Any], like: NDArray[Any]) -> NDArray[Any]:
    return np.ascontiguousarray(planes.transpose(1, 2, 0)).reshape(np.shape(like))
