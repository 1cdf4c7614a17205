"""What blocks are compared by: the exemplar's main colours, in whole numbers."""

import numpy as np
from numpy.typing import NDArray

from upholster.methods.working_form import working_form
from upholster.types import FloatArray, PixelArray

__all__ = ["match_features", "pca_features"]

_COARSE = 17
"""Part of the shorter side over which colours are averaged, to tell what differs coarsely."""

_LOOKED_AT = 128
"""Pixels of the shorter side, and less than twice as many, that are averaged."""

_COARSE_WEIGHT = 2
"""How much coarse differences count beside all differences, which they are part of."""

_HUE_WEIGHT = 3
"""How much the components after the first, which is mostly brightness, are stretched."""


def pca_features(image: PixelArray, *, most: int = 4) -> NDArray[np.uint8]:
    """Return an image's main colours, in whole numbers of 0 to 255.

    The samples' principal components, in order of their variance, as many as hold 99 % of it. All are scaled
    alike, so that distances stay what they were; the first spans 0 to 255. The directions are rounded, so
    that every machine finds the same numbers.

    Parameters
    ----------
    image
        (H, W, C), C any; uint8, uint16 or float32.
    most
        Components at most.

    Returns
    -------
    ndarray
        (H, W, K) uint8.
    """
    return _in_bytes(_components(image, most))


def match_features(image: PixelArray, *, most: int = 4) -> NDArray[np.uint8]:
    """Return what the search compares of an image: its main colours as the eye sees them apart.

    As `pca_features`, but a step between two broad shades, and one between two hues, counts for more than its
    share of the variance: the eye sees them sooner than as large a step in fine detail.
    """
    parts = _components(image, most)
    _weight_shades(parts)
    parts[..., 1:] *= _HUE_WEIGHT
    return _in_bytes(parts)


def _components(image: PixelArray, most: int) -> FloatArray:
    # Principal components (H, W, K) of an image, in whole numbers, of mean 0.
    samples = working_form(image).reshape(-1, image.shape[2])
    # Whole numbers below 2^53 throughout, so that floating point is exact in any order.
    centred = samples.astype(np.float64)
    centred -= np.rint(samples.mean(axis=0, dtype=np.float64))
    values, directions = np.linalg.eigh(centred.T @ centred)
    order = np.argsort(values)[::-1][:most]
    share = np.cumsum(values[order]) / max(1e-9, values.sum())
    order = order[: 1 + int(np.searchsorted(share, 0.99))]
    main = directions[:, order]
    main = main * np.sign(main[np.abs(main).argmax(axis=0), np.arange(main.shape[1])])
    parts: FloatArray = (centred @ np.rint(1024 * main)).reshape(*image.shape[:2], -1)
    return parts


def _in_bytes(parts: FloatArray) -> NDArray[np.uint8]:
    # All scaled alike, so that the first spans 0 to 255.
    first = parts[..., 0].reshape(-1)
    few = len(first) // 1000
    low, high = np.partition(first, [few, len(first) - 1 - few])[[few, -1 - few]]
    span = max(1, int(high - low))
    parts[..., 0] -= (low + high) // 2
    parts *= 2 * 255
    parts += 256 * span
    parts /= 2 * span
    return np.clip(np.floor(parts, out=parts), 0, 255, out=parts).astype(np.uint8)


def _weight_shades(parts: FloatArray) -> None:
    # Adds the weighted mean round each pixel of (H, W, K), in place and in whole numbers: under a pyramid,
    # which is a box filter twice each way, over squares of pixels where there are many.
    height, width, channels = parts.shape
    by = max(1, min(height, width) // _LOOKED_AT)
    rows, columns = (np.arange(0, side, by) for side in (height, width))
    sums = np.add.reduceat(np.add.reduceat(parts, rows, axis=0), columns, axis=1).astype(np.int64)
    sums //= np.diff(np.append(rows, height))[:, None, None] * np.diff(np.append(columns, width))[:, None]
    across = 1 + min(sums.shape[:2]) // _COARSE // 2 * 2
    for axis in (0, 0, 1, 1):
        ends = [(0, 0)] * 3
        ends[axis] = (across // 2 + 1, across // 2)
        run = np.pad(sums, ends, mode="edge").cumsum(axis=axis)
        size = sums.shape[axis]
        sums = np.take(run, range(across, across + size), axis) - np.take(run, range(size), axis)
    shades = np.rint(_COARSE_WEIGHT * (sums / across**4))
    for k in range(channels):
        parts[..., k] += shades[..., k].repeat(by, axis=0)[:height].repeat(by, axis=1)[:, :width]
