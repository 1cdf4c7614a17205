"""How irregular a sample is: how badly its blocks fit at the best other place."""

import numpy as np
from numpy.typing import NDArray

from upholster.image.masks import Used, squares
from upholster.runtime.stages import stage

__all__ = ["irregularity"]

_BOX, _MOST = 4, 128
"""Side in pixels of the boxes whose means are compared, and the maximum number of boxes along the shorter
side: boxes of a larger sample are larger."""

_PART = 3
"""Of a window, the first 1/3 of its rows and of its columns is compared: about what a block overlaps."""

_COUNT = 24
"""Number of windows."""


@stage
def irregularity(form: NDArray[np.uint8], side: int, used: Used | None = None) -> float:
    """Return the mean misfit of windows of a sample at the best other place.

    Parameters
    ----------
    form
        (H, W, K) the features by which pixels are compared.
    side
        Side of the windows in pixels.
    used
        (H, W) the pixels that blocks may show; None: all.

    Returns
    -------
    float
        Mean squared difference over the sample's variance: 0 for tiles that repeat exactly, about ½ for
        boards, 1.2 for gravel, 2 for noise.
    """
    box = max(_BOX, min(form.shape[:2]) // _MOST)
    means = _boxes(form, box).astype(np.int64).sum(axis=(1, 3)) // box**2
    side = max(1, min(round(side / box), min(means.shape[:2]) // 2))
    part = np.ones((side, side, 1), np.int64)
    part[-(-side // _PART) :, -(-side // _PART) :] = 0
    usable = _boxes(np.ones(form.shape[:2], np.bool_) if used is None else used, box)
    free = squares(np.logical_and.reduce(usable, axis=(1, 3, 4)), side)
    places = np.argwhere(free)
    variance, found, rng = float(means.var(axis=(0, 1)).sum()), [], np.random.default_rng(0)
    squared = _products((means**2).sum(axis=2, keepdims=True), part)
    for y, x in places[rng.integers(len(places), size=_COUNT)].tolist() if len(places) else ():
        window = means[y : y + side, x : x + side] * part
        costs = squared - 2 * _products(means, window) + (window**2).sum()
        near = side // 4
        away = free.copy()
        away[max(0, y - near) : y + near + 1, max(0, x - near) : x + near + 1] = False
        if away.any():
            found.append(int(costs[away].min()))
    return float(np.mean(found)) / (variance * int(part.sum())) if found and variance else 0.0


def _boxes(image: NDArray[np.generic], box: int) -> NDArray[np.generic]:
    # The complete boxes of an image (H, W, …): (rows, box, columns, box, K).
    rows, columns = image.shape[0] // box, image.shape[1] // box
    return image[: rows * box, : columns * box].reshape(rows, box, columns, box, -1)


def _products(image: NDArray[np.int64], window: NDArray[np.int64]) -> NDArray[np.int64]:
    # Σ image(p + d)·window(p) for each place d at which the window (h, w, K) is inside the image. Sums of
    # whole numbers are whole, so rounding makes them exact.
    shape = image.shape[:2]
    spectra = np.fft.rfft2(image, shape, (0, 1)) * np.fft.rfft2(window, shape, (0, 1)).conj()
    found = np.rint(np.fft.irfft2(spectra.sum(axis=2), shape)).astype(np.int64)
    return found[: shape[0] - window.shape[0] + 1, : shape[1] - window.shape[1] + 1]
