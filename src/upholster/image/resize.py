"""Resizing in linear light, weighted with alpha, without aliasing."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray
from upholster.image.color import alpha_channel, from_linear, to_linear

__all__ = ["premultiplied", "resampled_rows", "resize_image"]

_BAND = 1 << 22
"""Samples held in linear light at a time, so that a 200-megapixel photo is reduced in little memory."""


def resize_image(pixels: PixelArray, *, height: int, width: int) -> PixelArray:
    """Resize an image, up or down, with the filter of Mitchell and Netravali.

    Parameters
    ----------
    pixels
        (H, W, C) uint8, uint16 or float32.
    height, width
        The new size in pixels, at least 1.

    Returns
    -------
    ndarray
        (height, width, C) of the same dtype.

    References
    ----------
    D. Mitchell, A. Netravali: Reconstruction filters in computer graphics. SIGGRAPH 1988; B = C = 1/3.
    """
    if pixels.shape[:2] == (height, width):
        return pixels
    small = resampled_rows(
        lambda low, high: premultiplied(pixels[low:high]), pixels.shape, height=height, width=width
    )
    if pixels.dtype == np.float32 and pixels.min() >= 0:
        np.maximum(small, 0.0, out=small)  # the filter's negative lobes must not make negative light
    return np.ascontiguousarray(from_linear(small, pixels.dtype))


def resampled_rows(
    rows: Callable[[int, int], NDArray[np.float32]], shape: tuple[int, ...], *, height: int, width: int
) -> NDArray[np.float32]:
    """Resize an image whose rows are computed on demand.

    Parameters
    ----------
    rows
        ``rows(low, high)`` returns rows low … high − 1, (high − low, W, C) float32: linear light, colours
        multiplied with alpha where C is 2 or 4.
    shape
        (H, W, C) of the image.
    height, width
        The new size in pixels.

    Returns
    -------
    ndarray
        (height, width, C) float32: linear light, colours not premultiplied.
    """
    if shape[:2] == (height, width):
        return _straight(rows(0, height))
    indices, row_weights = _taps(shape[0], height)
    columns, column_weights = _taps(shape[1], width)
    tall = np.empty((height, shape[1], shape[2]), np.float32)
    start = 0
    while start < height:
        # As many output rows as have source rows that fit a band; always at least one.
        low = int(indices[start].min())
        room = max(1, _BAND // (shape[1] * shape[2]))
        stop = start + max(1, int(np.searchsorted(indices[start:, -1], low + room)))
        band = rows(low, int(indices[start:stop].max()) + 1)
        tall[start:stop] = _blend(band, indices[start:stop] - low, row_weights[start:stop])
        start = stop
    return _straight(
        _blend(np.ascontiguousarray(tall.swapaxes(0, 1)), columns, column_weights).swapaxes(0, 1)
    )


def premultiplied(pixels: PixelArray) -> NDArray[np.float32]:
    """Return an image in linear light, its colours multiplied by alpha."""
    linear = to_linear(pixels)
    alpha = alpha_channel(pixels.shape[2])
    if alpha is None:
        return linear
    return np.concatenate([linear[:, :, :alpha] * linear[:, :, alpha:], linear[:, :, alpha:]], axis=2)


def _straight(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    alpha = alpha_channel(linear.shape[2])
    if alpha is not None:
        weight = linear[:, :, alpha:]
        linear[:, :, :alpha] /= np.where(weight > 1e-6, weight, 1.0)
    return linear


def _taps(old: int, new: int) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Return, for each of `new` outputs, the indices (new, taps) of its inputs in `old`, and weights."""
    scale = max(1.0, old / new)  # the filter grows with the reduction, which prevents aliasing
    centre = (np.arange(new) + 0.5) * (old / new) - 0.5
    count = int(np.ceil(4 * scale)) + 1
    index = np.ceil(centre - 2 * scale).astype(np.int64)[:, None] + np.arange(count)
    weights = _mitchell((index - centre[:, None]) / scale)
    weights /= weights.sum(axis=1, keepdims=True)
    return np.clip(index, 0, old - 1), weights.astype(np.float32)


def _mitchell(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Evaluate the piecewise cubic (equation 8 of the paper) with B = C = 1/3."""
    x = np.abs(x)
    near = 7 * x**3 - 12 * x**2 + 16 / 3
    far = -7 / 3 * x**3 + 12 * x**2 - 20 * x + 32 / 3
    return np.where(x < 1, near, np.where(x < 2, far, 0.0)) / 6


def _blend(
    source: NDArray[np.float32], index: NDArray[np.int64], weights: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return the weighted sums of the rows of `source` that `index` (new, taps) names."""
    result = np.zeros((index.shape[0], *source.shape[1:]), np.float32)
    for tap in range(index.shape[1]):
        result += weights[:, tap, None, None] * source[index[:, tap]]
    return result
