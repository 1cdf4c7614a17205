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
    samples = working_form(image).reshape(-1, image.shape[2]).astype(np.int64)
    centred = samples - np.rint(samples.mean(axis=0)).astype(np.int64)
    values, directions = np.linalg.eigh((centred.T @ centred).astype(np.float64))
    order = np.argsort(values)[::-1][:most]
    share = np.cumsum(values[order]) / max(1e-9, values.sum())
    order = order[: 1 + int(np.searchsorted(share, 0.99))]
    main = directions[:, order]
    main = main * np.sign(main[np.abs(main).argmax(axis=0), np.arange(main.shape[1])])
    parts = centred @ np.rint(1024 * main).astype(np.int64)
    low, high = np.sort(parts[:, 0])[[len(parts) // 1000, -1 - len(parts) // 1000]]
    span = max(1, int(high - low))
    middle = np.zeros(len(order), np.int64)
    middle[0] = (low + high) // 2
    form = np.clip((2 * 255 * (parts - middle) + 256 * span) // (2 * span), 0, 255).astype(np.uint8)
    variance = float(form.astype(np.float64).var(axis=0).sum())
    return form.reshape(*image.shape[:2], -1), variance
