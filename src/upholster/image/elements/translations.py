"""The two shortest translations after which a sample looks the same, from its autocorrelation."""

import math
from typing import NamedTuple

import numpy as np

from upholster.base.types import FloatArray
from upholster.image.elements.autocorrelation import ALIKE, Correlation, highest
from upholster.image.elements.bases import Vector, shortest_pair
from upholster.image.elements.planes import Plane

__all__ = ["Translations", "two_translations"]

_SHORTEST = 4
"""Pixels of the shortest translation."""

_TRIED = 20
"""Peaks of the autocorrelation of which pairs are tried."""

_NEAR = 2
"""A sample's own irregularity moves peaks by at most about this many pixels."""

_LOOSE = 8
"""Pixels of the shortest translation for each pixel of such a movement."""

_AS_HIGH = 0.8
"""Pairs with at least this share of the highest mean count as equal; the one with the smallest cell wins."""

_AS_SMALL = 1.25
"""Ratio to the smallest cell of cells that count as equally small."""

_SLANTED = 0.25
"""Least sine of the angle between two translations."""

_DIVIDED = 0.85
"""A translation is divided if the mean correlation on the way is at least this share of that at its ends."""

_SMALLER = 0.75
"""Ratio of the cells after and before a division, at most: the fit must not undo it."""

_PARTS = (2, 3, 5)
"""Into so many parts."""

_WAYS = np.array([[1, 0], [0, 1], [1, 1], [1, -1]])
"""Ways between places of a lattice, in multiples of its translations."""

_FITTED = (1, 2, 3, 5, 8)
"""Translations are fitted to places of up to these multiples, one after the other."""


class Translations(NamedTuple):
    """Two translations, and how alike a sample and its shifted copies are.

    Attributes
    ----------
    shifts
        (2, 2) pixels, rows and columns; the shortest two of their lattice.
    alike
        Mean correlation at all sums of multiples within reach; of those of one translation, if it is lower.
    first
        The correlation at one translation; where stripes meander, it is much higher than elsewhere.
    between
        The highest mean correlation at places half way or a third of the way between them.
    chance
        Standard deviation of the mean at places of a lattice that has nothing to do with the sample.
    """

    shifts: FloatArray
    alike: float
    first: float
    between: float
    chance: float


def two_translations(found: Correlation) -> Translations | None:
    """Find two translations at whose multiples the correlation is high, and between them lower.

    The highest peaks are tried in pairs. A pair counts by the mean correlation at the sums of its first
    multiples. The smallest cell of the best wins. It is fitted to all peaks within reach, and divided while
    places half way, or a third of it, are about as high.
    """
    near = [highest(found.heights, reach) for reach in range(_NEAR + 1)]
    pairs = _pairs(_peaks(found))
    if not len(pairs):
        return None
    weights, heights = _places(found, near[-1], pairs, 2)
    usual = (near[-1] * found.overlaps).sum() / found.overlaps.sum()
    above = (weights * heights).sum(axis=1) / np.maximum(weights.sum(axis=1), 1) - usual
    good = np.flatnonzero((above >= _AS_HIGH * above.max()) & (above > 0))
    if not len(good):
        return None
    areas = np.abs(_areas(pairs[good]))
    good = good[areas <= _AS_SMALL * areas.min()]
    shifts = _fitted(found, pairs[good[above[good].argmax()]])
    while (smaller := _divided(found, near, shifts)) is not None:
        fitted = _fitted(found, smaller)
        if abs(_areas(fitted)) > _SMALLER * abs(_areas(shifts)):
            break
        shifts = fitted
    (a, b), (c, d) = shifts.tolist()
    return _judged(found, near[_tolerance(shifts)], shifts) if _wide(((a, b), (c, d))) else None


def _peaks(found: Correlation) -> Plane:
    # (n, 2): shifts at which nothing is higher within a third of the way, the highest first.
    heights, (rows, columns) = found.heights, found.reach
    at = np.argwhere(heights == highest(heights, 2)) - found.reach
    at = at[(at[:, 0] > 0) | ((at[:, 0] == 0) & (at[:, 1] > 0))]
    at = at[(at[:, 0] < rows) & (np.abs(at[:, 1]) < columns)]
    square = (at * at).sum(axis=1)
    at, square = at[square >= _SHORTEST**2], square[square >= _SHORTEST**2]
    kept = np.zeros(len(at), bool)
    reach, below = 2, 0
    while below < square.max(initial=0):
        # A peak is compared within a third of its distance, down to a power of two.
        upto = (6 * reach) ** 2
        group = np.flatnonzero((square >= below) & (square < upto))
        here = at[group]
        # Peaks are in the lower half.
        near = highest(heights[max(0, rows - reach) :], reach)[-rows - 1 :]
        kept[group] = near[here[:, 0], here[:, 1] + columns] <= found.at(heights, here)
        reach, below = 2 * reach, upto
    at = at[kept]
    strength = found.at(heights, at) * np.sqrt(found.at(found.overlaps, at))
    tried: Plane = at[np.argsort(-strength, kind="stable")[:_TRIED]]
    return tried


def _pairs(peaks: Plane) -> FloatArray:
    # (n, 2, 2): the shortest translations of the lattices that two of the peaks generate.
    found: dict[tuple[Vector, Vector], None] = {}
    for n, one in enumerate(peaks.tolist()):
        for other in peaks[:n].tolist():
            pair = shortest_pair((one[0], one[1]), (other[0], other[1]))
            if _wide(pair):
                # The same lattice is always the same pair.
                short, long = ((-x, -y) if (x, y) < (0, 0) else (x, y) for x, y in pair)
                found[short, long] = None
    return np.array(list(found), np.float64).reshape(-1, 2, 2)


def _wide(pair: tuple[Vector, Vector]) -> bool:
    # Whether translations are long enough, and not nearly parallel.
    (a, b), (c, d) = pair
    square, other, area = a * a + b * b, c * c + d * d, a * d - b * c
    return square >= _SHORTEST**2 and area * area >= _SLANTED**2 * square * other


def _multiples(most: int) -> Plane:
    # (n, 2): multiples of two translations whose sums are in the half plane; the other half mirrors it.
    steps = np.arange(-most, most + 1)
    whole: Plane = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    return whole[len(whole) // 2 + 1 :]


def _places(found: Correlation, values: Plane, pairs: FloatArray, most: int) -> tuple[Plane, Plane]:
    # (p, n) overlaps and values at the sums of multiples of p pairs; an overlap of 0 is out of reach.
    places = np.rint((_multiples(most)[:, :, None] * pairs[:, None]).sum(axis=2)).astype(np.int64)
    return np.where(found.within(places), found.at(found.overlaps, places), 0), found.at(values, places)


def _areas(pairs: FloatArray) -> FloatArray:
    areas: FloatArray = pairs[..., 0, 0] * pairs[..., 1, 1] - pairs[..., 0, 1] * pairs[..., 1, 0]
    return areas


def _fitted(found: Correlation, shifts: FloatArray) -> FloatArray:
    # The pair that is nearest to the peaks at its multiples, near ones first: a small error adds up.
    for most in _FITTED:
        whole = _multiples(most)
        places = np.rint((whole[:, :, None] * shifts).sum(axis=1)).astype(np.int64)
        reach = min(_NEAR + (most == 1), max(1, int(np.sqrt((shifts[0] ** 2).sum()) / 4)))
        inside = found.within(np.abs(places) + reach)
        whole, places = whole[inside], places[inside]
        steps = np.arange(-reach, reach + 1)
        around = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
        heights = found.at(found.heights, places[:, None] + around)
        weights = np.maximum(heights.max(axis=1, initial=0), 1) * found.at(found.overlaps, places)
        places = places + around[heights.argmax(axis=1)]
        i, j = whole.T
        ii, ij, jj = (int((weights * part).sum()) for part in (i * i, i * j, j * j))
        ends = [[int((weights * part * places[:, axis]).sum()) for axis in (0, 1)] for part in (i, j)]
        area = ii * jj - ij * ij
        if area <= 0:
            break
        shifts = np.array(
            [
                [(jj * ends[0][k] - ij * ends[1][k]) / area for k in (0, 1)],
                [(ii * ends[1][k] - ij * ends[0][k]) / area for k in (0, 1)],
            ]
        )
    return shifts


def _mean(found: Correlation, values: Plane, places: FloatArray) -> tuple[float, int]:
    # The mean of values at all places within reach, and the sum of their overlaps.
    whole = np.rint(places).astype(np.int64)
    whole = whole[found.within(whole)]
    weights = found.at(found.overlaps, whole)
    total = int(weights.sum())
    return float((weights * found.at(values, whole)).sum()) / max(total, 1) / ALIKE, total


def _lattice(shifts: FloatArray, away: FloatArray | float = 0.0) -> FloatArray:
    # Places of a lattice that is moved by `away`, and by as much the other way.
    places: FloatArray = (_multiples(_FITTED[-1])[:, :, None] * shifts).sum(axis=1)
    return np.concatenate([places + away, places - away])


def _tolerance(shifts: FloatArray) -> int:
    # The reach of irregularity, which is small if translations are short.
    return min(_NEAR, int(math.sqrt(float((shifts[0] ** 2).sum())) / _LOOSE))


def _divided(found: Correlation, near: list[Plane], shifts: FloatArray) -> FloatArray | None:
    # The lattice with places added at a half, a third, … of the way, if the correlation is as high there.
    for parts in _PARTS:
        for j in range(parts + 1):
            # Every lattice that is so many times as fine has one of these translations.
            way = shifts[1] if j == parts else shifts[0] + j * shifts[1]
            (a, b), (c, d) = (way / parts).tolist(), shifts[0 if j == parts else 1].tolist()
            pair = shortest_pair((a, b), (c, d))
            if not _wide(pair):
                continue
            heights = near[_tolerance(np.array(pair))]
            ends, between = (_mean(found, heights, _lattice(shifts, away))[0] for away in (0.0, way / parts))
            if between >= _DIVIDED * ends > 0:
                return np.array(pair)
    return None


def _judged(found: Correlation, near: Plane, shifts: FloatArray) -> Translations:
    alike, overlaps = _mean(found, near, _lattice(shifts))
    steps = np.arange(1, _FITTED[-1] + 1)[:, None]
    alike = min(alike, *(_mean(found, near, steps * shift)[0] for shift in shifts))
    between = 0.0
    for way in _WAYS:
        whole = (way[:, None] * shifts).sum(axis=0)
        quarter, half = (_mean(found, near, _lattice(shifts, whole * part))[0] for part in (0.25, 0.5))
        between = max(between, (2 * quarter + half) / 3)
    (a, b), (c, d) = shifts.tolist()
    rows, columns = found.reach
    down, right = np.arange(-rows, rows + 1)[:, None], np.arange(-columns, columns + 1)
    area = abs(a * d - b * c)
    cell = (np.abs(down * d - right * c) <= area / 2) & (np.abs(right * a - down * b) <= area / 2)
    square = float((found.heights[cell] ** 2).sum()) / ALIKE**2
    chance = math.sqrt(square / max(overlaps / 2, 1))
    first = int(found.at(near, np.rint(shifts).astype(np.int64)).max()) / ALIKE
    return Translations(shifts, alike, first, between, chance)
