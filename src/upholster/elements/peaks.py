"""Peaks of a plane's spectrum, and how far they stand out."""

from typing import NamedTuple

import numpy as np

from upholster.elements.planes import Plane
from upholster.types import FloatArray

__all__ = ["LEAST_PERIODS", "SpectrumPeak", "periods", "spectrum_peaks"]

LEAST_PERIODS = 2.8
"""Least number of periods in the sample: three, with a margin for partial periods at the edges."""

_HIGHEST = 0.3
"""Highest frequency in cycles per pixel."""

_NEAR, _FAR = 3, 10
"""A peak is compared with its surroundings between these distances, in steps of the spectrum."""

_STEADY = 2.0**40
"""Powers are rounded to this part of the highest: the last bits of a transform differ between machines."""

_GRAIN = 2.0**-20
"""Surroundings have at least this part of the highest power. Those of a drawing, which has no grain, would
have none, and everything would stand out."""


class SpectrumPeak(NamedTuple):
    """A peak of a spectrum.

    Attributes
    ----------
    wave
        (2,) cycles per pixel, rows and columns.
    prominence
        Its power over the mean power around it. In noise it is seldom above 20.
    plane
        Index of the plane that contains it.
    """

    wave: FloatArray
    prominence: float
    plane: int


def periods(wave: FloatArray, shape: tuple[int, int]) -> float:
    """Return how often a wave repeats in an image, from corner to corner."""
    return float(abs(wave[0]) * shape[0] + abs(wave[1]) * shape[1])


def spectrum_peaks(plane: Plane, index: int, least: float) -> list[SpectrumPeak]:
    """Return peaks of a plane's spectrum, of at least `least` prominence, the most prominent first.

    Power is multiplied by the squared frequency before it is compared, because it falls with frequency in
    photographs.
    """
    height, width = plane.shape
    window = np.hanning(height + 2)[1:-1, None] * np.hanning(width + 2)[1:-1]
    mean = float((plane * window).sum() / window.sum())
    sizes = 2 * height, 2 * width
    power = np.abs(np.fft.rfft2((plane - mean) * window, sizes)) ** 2
    if not power.max() > 0:
        return []
    power = np.rint(power * (_STEADY / power.max()))
    # Columns of negative frequency before those of positive.
    mirrored = np.roll(power[::-1, _FAR:0:-1], 1, axis=0)
    power = np.concatenate([mirrored, power], axis=1)
    down = np.fft.fftfreq(sizes[0])[:, None]
    right = np.arange(-_FAR, power.shape[1] - _FAR) / sizes[1]
    steep = power * (down * down + right * right)
    allowed = (right > 0) | ((right == 0) & (down > 0))
    allowed &= np.abs(down) * height + np.abs(right) * width >= 1.5
    allowed &= (down * down + right * right <= _HIGHEST**2) & (right <= 0.5 - _FAR / sizes[1])
    i, j = np.nonzero(allowed & (power == _highest_near(power)))
    # Every second step is enough: the spectrum is that of a plane of twice the size.
    reach = np.arange(-_FAR, _FAR + 1, 2)
    far = np.maximum(np.abs(reach)[:, None], np.abs(reach)) > _NEAR
    around = steep[((i[:, None] + reach) % sizes[0])[:, :, None], (j[:, None] + reach)[:, None, :]][:, far]
    # The median of noise is ln 2 of its mean.
    usual = np.median(around, axis=1) / np.log(2)
    prominence = steep[i, j] / np.maximum(usual, _GRAIN * steep.max())
    return [
        SpectrumPeak(np.array([down[i[n], 0], right[j[n]]]), float(prominence[n]), index)
        for n in np.argsort(-prominence, kind="stable")
        if prominence[n] >= least
    ]


def _highest_near(power: FloatArray) -> FloatArray:
    # The highest value within 2 steps each way; down the rows it wraps.
    down: FloatArray = np.maximum.reduce([np.roll(power, k, axis=0) for k in range(-2, 3)])
    out = down.copy()
    for k in (1, 2):
        out[:, k:] = np.maximum(out[:, k:], down[:, :-k])
        out[:, :-k] = np.maximum(out[:, :-k], down[:, k:])
    return out
