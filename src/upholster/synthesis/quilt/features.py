"""The features by which blocks are compared: the exemplar's principal colours, as integers."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, PixelArray
from upholster.synthesis.working_form import working_form

__all__ = ["pca_features"]


def pca_features(image: PixelArray, *, most: int = 4) -> NDArray[np.uint8]:
    """Return an image's principal colours, as integers from 0 to 255.

    These are the principal components, in order of their variance, that together hold 99 % of it. All have
    the same scale, which preserves ratios of distances; the first spans 0 to 255. The directions are rounded,
    so that every machine finds the same numbers.

    Parameters
    ----------
    image
        (H, W, C), C any; uint8, uint16 or float32.
    most
        Maximum number of components.

    Returns
    -------
    ndarray
        (H, W, K) uint8.
    """
    return _in_bytes(_components(image, most))


def _components(image: PixelArray, most: int) -> FloatArray:
    # Principal components (H, W, K) of an image, as integers with mean 0.
    samples = working_form(image).reshape(-1, image.shape[2])
    # All values are integers below 2^53, so that floating-point sums are exact in any order.
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
    # All components get the same scale, with which the first spans 0 to 255.
    first = parts[..., 0].reshape(-1)
    few = len(first) // 1000
    low, high = np.partition(first, [few, len(first) - 1 - few])[[few, -1 - few]]
    span = max(1, int(high - low))
    parts[..., 0] -= (low + high) // 2
    parts *= 2 * 255
    parts += 256 * span
    parts /= 2 * span
    return np.clip(np.floor(parts, out=parts), 0, 255, out=parts).astype(np.uint8)
