"""The rows of a sample that repeats in one direction only, such as planks, from its autocorrelation."""

import math
from typing import NamedTuple

import numpy as np

from upholster.base.types import FloatArray
from upholster.image.elements.autocorrelation import ALIKE, Correlation
from upholster.image.elements.planes import Plane

__all__ = ["EvenRows", "even_rows"]

_UNIT = 4096
"""Directions are whole numbers of this length."""

_NEAR = 12
"""Shifts of less than this part of the reach say nothing about rows."""

_COARSE, _FINE = (-6, -4, -2, -1, 0, 1, 2, 4, 6), (-0.6, -0.3, 0, 0.3, 0.6)
"""Degrees by which a direction is turned to find the best."""

_SHORTEST = 8
"""Least distance of rows, in half pixels."""

_FITTED = (2, 3, 4, 6)
"""A distance is fitted to its multiples, one after the other."""

_ROWS = 2.5
"""Rows on either side that are compared along their length."""


class EvenRows(NamedTuple):
    """Rows at even distances.

    Attributes
    ----------
    wave
        (2,) cycles per pixel, rows and columns.
    share
        The share of the correlation's variance that is constant along rows.
    near, far
        How much of the wave the correlation contains: at shifts along the rows by less than a quarter of the
        reach, and by more than half of it. Where stripes meander, it falls off.
    contrast
        How much the mean correlation at multiples of the distance exceeds that half way between them.
    chance
        Standard deviation of such a mean in rows of random distances.
    """

    wave: FloatArray
    share: float
    near: float
    far: float
    contrast: float
    chance: float


def even_rows(found: Correlation) -> EvenRows | None:
    """Find the direction in which the correlation varies most, and the distance at which it repeats there.

    Of the peaks of its profile, the one whose wave the correlation contains most, near and far, wins.
    """
    direction = _direction(found)
    share, profile = _profile(found, direction, 1)
    best: tuple[float, float, float] | None = None
    for distance in _distances(profile):
        near, far = _strength(found, direction, distance)
        if best is None or min(near, far) > min(best[1:]):
            best = distance, near, far
    if best is None:
        return None
    wave = np.array(direction) / (_UNIT * best[0])
    return EvenRows(wave, share, *best[1:], *_contrast(found, direction, profile, best[0]))


def _direction(found: Correlation) -> tuple[int, int]:
    # The main direction of the correlation's gradients, turned to where the profile varies most.
    heights, (rows, columns) = found.heights >> 4, found.reach
    down = heights[2:, 1:-1] - heights[:-2, 1:-1]
    right = heights[1:-1, 2:] - heights[1:-1, :-2]
    square = np.arange(1 - rows, rows)[:, None] ** 2 + np.arange(1 - columns, columns) ** 2
    weights = (found.overlaps[1:-1, 1:-1] >> 4) * (square > (rows // _NEAR) ** 2)
    upright, level, mixed = (
        int((weights * part).sum()) for part in (down * down, right * right, down * right)
    )
    angle = math.atan2(2 * mixed, upright - level) / 2
    for turns, step in ((_COARSE, 2), (_FINE, 1)):
        angle = max(
            (angle + math.radians(turn) for turn in turns),
            key=lambda one, step=step: _profile(found, _whole(one), step)[0],  # type: ignore[misc]
        )
    return _whole(angle)


def _whole(angle: float) -> tuple[int, int]:
    return round(_UNIT * math.cos(angle)), round(_UNIT * math.sin(angle))


def _lower(found: Correlation, step: int) -> tuple[Plane, Plane, Plane, Plane]:
    # Every so many rows and columns of the lower half: shifts down and right, heights, overlaps.
    rows, columns = found.reach
    down, right = (
        np.arange(0, rows + 1, step)[:, None],
        np.arange(columns % step - columns, columns + 1, step),
    )
    part = np.s_[rows::step, columns % step :: step]
    return down, right, found.heights[part], found.overlaps[part]


def _profile(found: Correlation, direction: tuple[int, int], step: int) -> tuple[float, FloatArray]:
    # The mean correlation at every half pixel in a direction, and its variance's share of all variance.
    down, right, heights, overlaps = _lower(found, step)
    rows, columns = found.reach
    place = (2 * np.abs(down * direction[0] + right * direction[1]) + _UNIT // 2) // _UNIT
    count = 2 * int(0.9 * (rows * abs(direction[0]) + columns * abs(direction[1]))) // _UNIT
    used = (down * down + right * right > (rows // _NEAR) ** 2) & (place < count)
    place, heights, overlaps = place[used], heights[used], overlaps[used]
    sums, weights = (np.bincount(place, part, count) for part in (overlaps * heights, overlaps))
    total = max(float(weights.sum()), 1.0)
    mean = float(sums.sum()) / total
    profile = sums / np.maximum(weights, 1)
    squares = float((overlaps * heights * heights).sum()) / total - mean * mean
    varied = float((np.rint(profile) ** 2 * weights).sum()) / total - mean * mean
    return _steady(varied / squares) if squares > 0 else 0.0, profile / ALIKE


def _distances(profile: FloatArray) -> list[float]:
    # Distances, in pixels, at which nothing is higher within a third of the way.
    padded = np.pad(profile, 1, mode="edge")
    profile = (padded[:-2] + 2 * padded[1:-1] + padded[2:]) / 4
    last, found = len(profile) - 1, []
    for place in range(_SHORTEST, last - 1):
        near = profile[place - place // 3 : place + place // 3 + 1]
        if profile[place] < near.max():
            continue
        distance = float(place)
        for times in _FITTED:
            middle, reach = round(times * distance), max(2, int(distance / 10))
            if middle + reach > last:
                break
            distance = (middle - reach + int(profile[middle - reach : middle + reach + 1].argmax())) / times
        found.append(distance / 2)
    return found


def _strength(found: Correlation, direction: tuple[int, int], distance: float) -> tuple[float, float]:
    down, right, heights, overlaps = _lower(found, 1)
    across = np.abs(down * direction[0] + right * direction[1]) / (_UNIT * distance)
    along = np.abs(right * direction[0] - down * direction[1])
    used = (across > 0.5) & (across < _ROWS)
    if not used.any():
        return 0.0, 0.0
    across, along, heights, overlaps = across[used], along[used], heights[used], overlaps[used]
    waves = np.rint(overlaps * heights * np.cos(2 * np.pi * across))
    reach = int(along.max())
    near, far = (
        _steady(float(waves[part].sum()) / max(int(overlaps[part].sum()), 1) / ALIKE)
        for part in (4 * along < reach, 2 * along > reach)
    )
    return near, far


def _steady(value: float) -> float:
    # Without the last bits, which differ between machines.
    return round(value * 2**20) / 2**20


def _contrast(
    found: Correlation, direction: tuple[int, int], profile: FloatArray, distance: float
) -> tuple[float, float]:
    rows, columns = found.size
    length = (rows * abs(direction[0]) + columns * abs(direction[1])) / _UNIT
    times = np.arange(1, int((len(profile) - 2) / (2 * distance)) + 1)
    if not len(times):
        return 0.0, 1.0
    on, off = (
        np.stack([profile[np.rint(2 * distance * part).astype(np.int64) + k] for k in (-1, 0, 1)]).max(axis=0)
        for part in (times, times - 0.5)
    )
    weights = length - times * distance
    square = float((profile[: round(2 * distance)] ** 2).sum()) / 2
    contrast = float((weights * (on - off)).sum()) / float(weights.sum())
    return contrast, math.sqrt(square / float(weights.sum()))
