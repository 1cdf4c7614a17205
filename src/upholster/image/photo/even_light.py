"""Removing vignetting and slow shading from a sample.

The light on a flat sample is a smooth field that multiplies the texture. It is fitted by polynomials of low
degree, the same for all channels, in linear light. Size distinguishes light from texture at such a scale: a
polynomial counts only where it exceeds those of higher degree, which hold texture alone. An evenly lit sample
stays as it is if it shows eight elements or more each way. With fewer, their arrangement cannot be
distinguished from light.
"""

from itertools import pairwise

import numpy as np
from numpy.polynomial.legendre import legvander

from upholster.base.types import FloatArray, PixelArray
from upholster.image.color import alpha_channel, from_linear, to_linear

__all__ = ["UNEVEN", "even_light", "light_field", "light_range"]

UNEVEN = 1.3
"""A `light_range` from here on is reported as uneven; evenly lit photographs have 1.2 at most."""

_DEGREE = 4
"""Degree of the light: a slope, a vignette and shapes in between. Its waves are half the sample or longer."""

_NOISE_DEGREES = (6, 9)
"""The texture's own level is measured on polynomials beyond `_DEGREE`, up to each of these. The larger
mean counts, for higher ones respond little to elements nearly as large as the light's waves."""

_HIGHEST = max(_NOISE_DEGREES)

_GRID = 24
"""Cells each way in which the sample's light is averaged; with 32 pixels each cell still has one."""

_LEAST = 6.0
"""A coefficient counts if its square is this many times the texture's mean square."""

_SMALLEST = 5e-4
"""Root mean square that is always ignored: rounding errors."""

_ROUNDS = 3
_RANGE = 8.0
"""The light is taken to vary by no more than this factor to either side."""

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_BAND = 1 << 21


def even_light(pixels: PixelArray) -> PixelArray:
    """Return a sample as if it had been lit evenly, with the same mean light.

    Parameters
    ----------
    pixels
        (H, W, C) uint8, uint16 or float32, C from 1 to 4.

    Returns
    -------
    ndarray
        The same shape and dtype; alpha is kept. The same array where no uneven light is found.
    """
    field = light_field(pixels)
    if field is None:
        return pixels
    height, width, channels = pixels.shape
    alpha = alpha_channel(channels)
    result = np.empty_like(pixels)
    rows = max(1, _BAND // (width * channels))
    for start in range(0, height, rows):
        stop = min(start + rows, height)
        linear = to_linear(pixels[start:stop])
        # A float image may be the caller's own array, which must not be changed.
        gain = (1.0 / _at_pixels(field, start, stop, height, width)).astype(np.float32)[:, :, None]
        done = linear[:, :, :alpha] * gain
        if alpha is not None:
            done = np.concatenate([done, linear[:, :, alpha:]], axis=2)
        result[start:stop] = from_linear(done, pixels.dtype)
    return result


def light_range(pixels: PixelArray) -> float:
    """Return how many times more light the brightest parts of a sample get than the darkest; 1: even.

    Parameters
    ----------
    pixels
        As for `even_light`; with more than 4 channels the first three count.
    """
    field = light_field(pixels[..., :3] if pixels.shape[2] > 4 else pixels)
    if field is None:
        return 1.0
    along = legvander(np.linspace(-0.9, 0.9, 9), _DEGREE)
    dark, bright = np.percentile(_clipped(along @ field @ along.T) ** 2, [5, 95])
    return float(bright / dark)


def light_field(pixels: PixelArray) -> FloatArray | None:
    """Return the light on a sample, relative to its mean over the texture.

    Parameters
    ----------
    pixels
        As for `even_light`.

    Returns
    -------
    ndarray or None
        (5, 5) coefficients of Legendre polynomials over (rows, columns), both from −1 to 1, for the
        square root of the light; None where it is even.
    """
    roots, weights = _cell_means(pixels)
    seen = weights > 0
    if seen.sum() < (_HIGHEST + 1) ** 2 or not roots[seen].any():
        return None
    height, width = roots.shape
    basis = [_legendre(count, _HIGHEST) for count in (height, width)]
    pairs = [(i, j) for i in range(_HIGHEST + 1) for j in range(_HIGHEST + 1) if i + j <= _HIGHEST]
    pairs.sort(key=sum)
    design = np.stack([np.outer(basis[0][:, i], basis[1][:, j])[seen] for i, j in pairs], axis=1)
    values, weights = roots[seen] / np.average(roots[seen], weights=weights[seen]), weights[seen]
    counts = [sum(1 for pair in pairs if sum(pair) <= top) for top in (_DEGREE, *_NOISE_DEGREES)]
    found = _fitted(values, weights, design, counts)
    if not found.any():
        return None
    coefficients = np.zeros((_DEGREE + 1, _DEGREE + 1))
    for pair, value in zip(pairs, found, strict=False):
        coefficients[pair] = value
    # Mean light stays: dividing the sample by the field does not change its sum.
    light, field = values**2 * weights, _clipped(design[:, : len(found)] @ found)
    scale = np.sqrt(light.sum() / (light / field**2).sum())
    result: FloatArray = coefficients / scale
    return result


def _fitted(values: FloatArray, weights: FloatArray, design: FloatArray, counts: list[int]) -> FloatArray:
    """Return coefficients of the polynomials that stand out, zeros if none do.

    Parameters
    ----------
    values, weights
        (n,) values of the cells; the mean is 1.
    design
        (n, k): the polynomials' values there, by degree.
    counts
        The number of polynomials for the light, and the numbers up to which the texture is measured.
    """
    low, *bands = counts
    root = np.sqrt(weights)
    # Made orthogonal in order of degree: each polynomial keeps only the part that lower ones lack.
    ortho = np.linalg.qr(design * root[:, None]).Q
    total = np.zeros(low)
    field = np.ones_like(values)
    for _ in range(_ROUNDS):
        found = ortho.T @ ((values / field) * root)
        powers = [np.mean(found[low:stop] ** 2) for stop in bands]
        noise = _LEAST * max(*powers, _SMALLEST**2 * weights.sum())
        kept = found[:low] * np.maximum(0.0, 1.0 - noise / np.maximum(found[:low] ** 2, 1e-30))
        kept[0] = 0.0
        if not kept.any():
            break
        # The light found so far times the remaining light, as polynomials again.
        product = field * (1.0 + (ortho[:, :low] @ kept) / root)
        total = np.linalg.lstsq(design[:, :low] * root[:, None], product * root, rcond=None)[0]
        field = _clipped(design[:, :low] @ total)
    return total


def _clipped(field: FloatArray) -> FloatArray:
    return np.clip(field, _RANGE**-0.5, _RANGE**0.5)


def _cell_means(pixels: PixelArray) -> tuple[FloatArray, FloatArray]:
    """Return, for each cell of a grid, the mean square root of the light, and its opaque pixels.

    The root is a compromise between the light itself, which a few bright spots would dominate, and its
    logarithm, which dark joints would dominate.
    """
    height, width, channels = pixels.shape
    alpha = alpha_channel(channels)
    tall, wide = (np.linspace(0, side, min(_GRID, side) + 1).astype(int) for side in (height, width))
    sums = np.zeros((2, len(tall) - 1, len(wide) - 1))
    for row, (start, stop) in enumerate(pairwise(tall.tolist())):
        linear = to_linear(pixels[start:stop])
        colors = linear[:, :, :alpha]
        light = colors[:, :, 0] if colors.shape[2] == 1 else colors @ _LUMINANCE.astype(np.float32)
        cover = np.ones_like(light) if alpha is None else np.clip(linear[:, :, alpha], 0, 1)
        for n, part in enumerate((np.sqrt(np.maximum(light, 0)) * cover, cover)):
            sums[n, row] = np.add.reduceat(part.sum(axis=0, dtype=np.float64), wide[:-1])
    cells = np.outer(np.diff(tall), np.diff(wide))
    # Cells that are hardly covered are unreliable.
    weights = np.where(sums[1] > 0.05 * cells, sums[1], 0.0)
    return sums[0] / np.maximum(sums[1], 1e-9), weights


def _legendre(count: int, degree: int) -> FloatArray:
    places = (2 * np.arange(count) + 1) / count - 1
    return np.asarray(legvander(places, degree), np.float64)


def _at_pixels(field: FloatArray, start: int, stop: int, height: int, width: int) -> FloatArray:
    """Return the light in rows `start` to `stop`."""
    rows, columns = _legendre(height, _DEGREE)[start:stop], _legendre(width, _DEGREE)
    light: FloatArray = np.maximum(rows @ field @ columns.T, 1e-3) ** 2
    return light
