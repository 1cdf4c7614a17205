"""Two figures for what an eye sees in a texture: windows that the sample does not have, and copies."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.ndimage import convolve1d

from upholster.base.types import PixelArray

__all__ = ["NEAR", "broken_windows", "copies", "window_sides"]

COUNT = 80
"""Windows of each size."""

SEED = 0
COPIED = 32
NEAR = 160
"""Side of the windows whose copies are counted, and how far apart near copies are at most, in pixels."""

MOST = 64
"""Of equal windows, in their order, as many are looked at from each."""

Whole = NDArray[np.int64]


def window_sides(exemplar: PixelArray) -> tuple[int, ...]:
    """Return sides of windows, in pixels: as large as elements are."""
    least = min(exemplar.shape[:2])
    sides = {32, 48, 64} | ({64, 96, 128} if least >= 256 else set())
    return tuple(sorted(side for side in sides if side <= least // 2)) or (least // 4 * 2,)


def broken_windows(
    images: Sequence[PixelArray], exemplar: PixelArray, sides: Sequence[int] = (), count: int = COUNT
) -> float:
    """Return the mean distance of random windows to the nearest window of the exemplar.

    The distance is the mean squared difference over the exemplar's variance: 0 is copied, 2 is unrelated.
    Both are reduced to half their size, as whole numbers of 12 bits, so that sums are exact.

    Parameters
    ----------
    images
        (h, w, C) uint8, each at least as large as the largest window.
    exemplar
        (H, W, C) uint8.
    sides
        Of the windows, in pixels; by default those of `window_sides`.
    count
        Windows of each side, over all images.
    """
    rng = np.random.default_rng(SEED)
    halves, sample = [_half(image) for image in images], _half(exemplar)
    variance = sample.var(axis=(0, 1)).sum()
    means = []
    for side in sides or window_sides(exemplar):
        w = side // 2
        corners = [rng.integers(0, np.array(half.shape[:2]) - w + 1, (count, 2)) for half in halves]
        of = rng.integers(len(halves), size=count)
        windows = np.stack(
            [
                halves[k][slice(y, y + w), slice(x, x + w)]
                for n, k in enumerate(of)
                for y, x in [corners[k][n]]
            ]
        )
        means.append(_nearest(windows, sample).mean() / (variance * w * w))
    return float(np.mean(means))


def _half(image: PixelArray) -> Whole:
    """Return an image blurred by a pixel, binomially, and at half its size: 0 to 4080."""
    taps = np.array([1, 4, 6, 4, 1])
    blurred = image.astype(np.int64)
    for axis in (0, 1):
        blurred = convolve1d(blurred, taps, axis=axis, mode="mirror")
    return ((blurred + 8) // 16)[::2, ::2]


def _nearest(windows: Whole, sample: Whole) -> Whole:
    """Return each window's squared distance to the nearest window of the sample, exactly."""
    w, shape = windows.shape[1], sample.shape[:2]
    spectrum = fft.rfft2(sample.astype(float), axes=(0, 1))
    sums = np.pad((sample**2).sum(axis=2).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    own = sums[w:, w:] - sums[:-w, w:] - sums[w:, :-w] + sums[:-w, :-w]
    found = []
    for window in windows:
        there = fft.rfft2(window.astype(float), shape, axes=(0, 1)).conj()
        product = fft.irfft2((spectrum * there).sum(axis=2), shape)[: own.shape[0], : own.shape[1]]
        found.append((own - 2 * np.rint(product).astype(np.int64)).min() + (window**2).sum())
    return np.array(found)


def copies(image: PixelArray, *, side: int = COPIED, near: int = NEAR) -> tuple[float, float]:
    """Return the shares of windows that recur verbatim: anywhere in an image, and at most `near` pixels away.

    Every window is compared with every other, by a sum modulo 2⁶⁴ with random odd weights: windows that
    differ have equal sums by one chance in 10¹⁰ or so.
    """
    rng = np.random.default_rng(SEED)
    row, column, channel = (
        rng.integers(0, 2**62, n, dtype=np.uint64) * np.uint64(2) + np.uint64(1)
        for n in (side, side, image.shape[2])
    )
    values = (image.astype(np.uint64) * channel).sum(axis=2, dtype=np.uint64)
    height, width = (size - side + 1 for size in values.shape)
    values = sum(row[k] * values[k : k + height] for k in range(side))
    values = sum(column[k] * values[:, k : k + width] for k in range(side))
    keys = values.ravel()
    order = np.argsort(keys, kind="stable")
    y, x = np.divmod(order, width)
    sorted_keys = keys[order]
    recurs, nearby = np.zeros((2, keys.size), bool)
    for step in range(1, keys.size):
        same = np.flatnonzero(sorted_keys[step:] == sorted_keys[:-step])
        if not same.size or step > MOST:
            break
        recurs[same] = recurs[same + step] = True
        away = np.maximum(abs(y[same + step] - y[same]), abs(x[same + step] - x[same]))
        nearby[same[away <= near]] = nearby[same[away <= near] + step] = True
    return float(recurs.mean()), float(nearby.mean())
