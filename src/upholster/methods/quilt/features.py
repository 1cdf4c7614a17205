"""What blocks are compared by: the exemplar's main colours, in whole numbers."""

import numpy as np
from numpy.typing import NDArray

from upholster.methods.working_form import working_form
from upholster.types import PixelArray

__all__ = ["pca_features"]


def pca_features(image: PixelArray, *, most: int = 4) -> tuple[NDArray[np.uint8], float]:
    """Return what the search compares of an image: its main colours, in whole numbers of 0 to 255.

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
    form : ndarray
        (H, W, K) uint8.
    variance
        Mean squared distance from the mean colour, in these units.
    """
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
    parts = centred @ np.rint(1024 * main)
    few = len(parts) // 1000
    low, high = np.partition(parts[:, 0], [few, len(parts) - 1 - few])[[few, -1 - few]]
    span = max(1, int(high - low))
    parts[:, 0] -= (low + high) // 2
    parts *= 2 * 255
    parts += 256 * span
    parts /= 2 * span
    form = np.clip(np.floor(parts, out=parts), 0, 255, out=parts).astype(np.uint8)
    variance = float(form.astype(np.float64).var(axis=0).sum())
    return form.reshape(*image.shape[:2], -1), variance
