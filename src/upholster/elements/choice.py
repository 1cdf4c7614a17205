"""Choosing one or two waves of which all other waves of a sample's repetition are sums."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.elements.peaks import SpectrumPeak
from upholster.types import FloatArray

__all__ = ["TOLERANCE", "chosen_waves"]

TOLERANCE = 0.75
"""The farthest that a peak may be from a multiple, in cycles per sample."""

_NOISE = 10.0
"""Prominence at which a peak has no weight; each doubling adds 1 to it."""

_MULTIPLES = 12
"""The most multiples of a wave that are tried."""

_LEAST_SINE = 0.12
"""Least sine of the angle between two waves."""

_AS_GOOD = 0.02
"""Choices within this share of all weight of the best count as equal; the strongest among them wins."""

_AS_LARGE = 1.4
"""Ratio to the smallest area that two waves span in the spectrum; a ratio of 2 makes every second wave."""

_BETTER = 1.1
"""Two waves must explain this many times as much as one."""

_LEAST_SHARE = 0.3
"""Share of all peaks' weight that the chosen waves must explain; else the sample repeats differently."""

_ALONE = 200.0
"""A wave of this prominence counts however little else it explains, for example that of unequal planks."""


def chosen_waves(
    waves: FloatArray, prominences: FloatArray, peaks: Sequence[SpectrumPeak], shape: tuple[int, int]
) -> list[int]:
    """Choose the one or two waves of which all peaks are whole multiples, or sums of whole multiples.

    Two waves that generate only some of the peaks belong to a lattice that is too fine: places that agree in
    both phases would look alike in some respects only. So the chosen waves explain most peaks, each weighted
    with the logarithm of its prominence. What they would explain by chance is subtracted, because the many
    multiples of slow waves are near everything. Among choices that explain equally much, pairs whose lattice
    has the largest cell win, because they explain the other waves as well; among these, prominent and slow
    ones: a slow wave distinguishes places that are farther apart.

    Parameters
    ----------
    waves
        (n, 2) to choose from, in cycles per pixel.
    prominences
        (n,).
    peaks
        The peaks of all planes.
    shape
        (height, width) of the planes.

    Returns
    -------
    list of int
        Indices of one or two waves; none if too little is explained.
    """
    if not len(waves):
        return []
    cycles = waves * shape
    places = np.array([peak.wave * shape for peak in peaks])
    weights = np.log2(np.maximum([peak.prominence / _NOISE for peak in peaks], 1.0))
    strength = np.log2(prominences / (waves * waves).sum(axis=1))
    single = _explained_by_one(cycles, places, weights)
    pairs = np.argwhere(_sines(cycles) >= _LEAST_SINE)
    double = _explained_by_two(cycles[pairs], places, weights)
    least, nearly = _LEAST_SHARE * weights.sum(), _AS_GOOD * weights.sum()
    if len(pairs) and double.max() > max(least, _BETTER * single.max()):
        good = pairs[double >= double.max() - nearly]
        areas = _areas(cycles[good])
        good = good[areas <= _AS_LARGE * areas.min()]
        chosen: list[int] = good[strength[good].sum(axis=1).argmax()].tolist()
        return chosen
    lone = np.flatnonzero(single >= single.max() - nearly)
    best = int(lone[strength[lone].argmax()])
    return [best] if single[best] >= least or prominences[best] >= _ALONE else []


def _explained_by_one(cycles: FloatArray, places: FloatArray, weights: FloatArray) -> FloatArray:
    square = (cycles * cycles).sum(axis=1)
    multiples = (cycles[:, None] * places).sum(axis=2) / square[:, None]
    nearest = np.clip(np.rint(multiples), -_MULTIPLES, _MULTIPLES)
    away = places - nearest[:, :, None] * cycles[:, None]
    chance = np.minimum(1.0, 2 * TOLERANCE / np.sqrt(square))
    return _found(away, chance, weights)


def _explained_by_two(pairs: FloatArray, places: FloatArray, weights: FloatArray) -> FloatArray:
    (a, b), (c, d) = pairs[:, 0].T, pairs[:, 1].T
    area = a * d - b * c
    rows, columns = places.T
    first = np.rint((rows * d[:, None] - columns * c[:, None]) / area[:, None])
    second = np.rint((columns * a[:, None] - rows * b[:, None]) / area[:, None])
    multiples = np.clip(np.stack([first, second], axis=2), -_MULTIPLES, _MULTIPLES)
    made = multiples[:, :, :1] * pairs[:, None, 0] + multiples[:, :, 1:] * pairs[:, None, 1]
    return _found(places - made, np.minimum(1.0, np.pi * TOLERANCE**2 / np.abs(area)), weights)


def _found(away: FloatArray, chance: FloatArray, weights: FloatArray) -> FloatArray:
    # Weight of the peaks that are where they should be, minus the weight expected there by chance.
    near: NDArray[np.bool_] = (away * away).sum(axis=2) <= TOLERANCE**2
    found: FloatArray = (near * weights).sum(axis=1) - chance * weights.sum()
    return found


def _areas(pairs: FloatArray) -> FloatArray:
    # (n,): areas of the cells of the spectrum that pairs of waves (n, 2, 2) span.
    areas: FloatArray = np.abs(pairs[:, 0, 0] * pairs[:, 1, 1] - pairs[:, 0, 1] * pairs[:, 1, 0])
    return areas


def _sines(cycles: FloatArray) -> FloatArray:
    # (n, n): sines of the angles between all waves, 0 below the diagonal.
    unit = cycles / np.sqrt((cycles * cycles).sum(axis=1))[:, None]
    return np.triu(np.abs(unit[:, None, 0] * unit[:, 1] - unit[:, None, 1] * unit[:, 0]), 1)
