"""Equation 7 of the paper: a sample reduced to its large Haar coefficients."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, PixelArray
from upholster.codec.haar import dwt2, idwt2

__all__ = ["keep_coefficients"]


def keep_coefficients(
    exemplar: PixelArray,
    *,
    levels: int = 3,
    threshold: float | None = None,
    coefficients: float | None = None,
) -> PixelArray:
    """Set small Haar coefficients of an exemplar to zero.

    Parameters
    ----------
    exemplar
        (H, W, C), any dtype; each channel is transformed on its own, its mean included.
    levels
        Levels of the transform, 1 to 6.
    threshold
        Coefficients of a smaller magnitude become zero. It is in units of the samples (0 to 255 for 8 bits),
        for the orthonormal transform.
    coefficients
        Alternatively the share to keep, above 0, at most 1: the largest ones over all channels, and those
        equal to the smallest of them.

    Returns
    -------
    ndarray
        Array of the exemplar's shape and dtype; integers are rounded, within their range. The exemplar itself
        if neither is given.

    References
    ----------
    Shet, Bez, Edirisinghe: Progressive texture synthesis on geometric surfaces, equation 7.
    """
    if threshold is None and coefficients is None:
        return exemplar
    found = dwt2(exemplar, levels=levels)
    magnitudes = np.abs(found)
    if coefficients is not None:
        threshold = _least(magnitudes, coefficients)
    kept = idwt2(np.where(magnitudes < threshold, 0.0, found), levels=levels)
    if exemplar.dtype.kind != "u":
        return kept.astype(exemplar.dtype)
    return np.clip(np.floor(kept + 0.5), 0, np.iinfo(exemplar.dtype).max).astype(exemplar.dtype)


def _least(magnitudes: FloatArray, share: float) -> Any:
    count = max(1, round(share * magnitudes.size))
    place = magnitudes.size - count
    ordered: NDArray[np.float64] = np.partition(magnitudes, place, axis=None)
    return ordered[place]
