"""The lattice of a sample: the waves at which it repeats, and their phases at every pixel."""

from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.elements.choice import TOLERANCE, chosen_waves
from upholster.elements.following import Followed, follow, pixel_phases
from upholster.elements.peaks import LEAST_PERIODS, SpectrumPeak, periods, spectrum_peaks
from upholster.elements.planes import Plane, planes, reduced
from upholster.stages import stage
from upholster.types import FloatArray, PixelArray, frozen_array

__all__ = ["Lattice", "find_lattice"]

_LOOKED_AT = 160
"""The shorter side is examined at this many pixels, up to twice as many: larger samples are reduced."""

_LEAST_SIDE = 32

_MOST_STEPS, _LEVEL = 4, 0.1
"""Of an element: the most periods in its width, and how far from level it may run, as a slope."""

_LEAST_PROMINENCE = 16.0
"""Least prominence of a peak that counts."""

_CANDIDATES = 12
"""The most waves that are followed."""

_COMBINED = 6
"""Sums and differences of this many of them, the most prominent, are examined too."""

_MULTIPLES = np.array([-5, -4, -3, -2, -1, 1, 2, 3, 4, 5])
"""Multiples of a wave, which add nothing to the wave itself."""

_SURE = 0.6
"""Certainty below which a wave is left out."""


@dataclass(frozen=True, eq=False)
class Lattice:
    """One or two waves at which a sample repeats with certainty.

    Attributes
    ----------
    waves
        (n, 2) float64, n = 1 or 2: wave vectors, in cycles per pixel of the sample (row,
        column). Every wave at which the sample repeats is nearly a sum of whole multiples of these.
    phases
        (n, H, W) int16: the sample's own phase at each pixel, in units of a 65,536th of a turn; it wraps as
        int16 does. It grows by `waves` on average, and follows the sample where that is irregular.
    certainty
        (n,) 0 to 1: how certain it is that the sample repeats. Uncertain waves are left out.
    """

    waves: FloatArray
    phases: NDArray[np.int16]
    certainty: FloatArray

    def __post_init__(self) -> None:
        for array in (self.waves, self.phases, self.certainty):
            frozen_array(array)

    @property
    def element(self) -> tuple[float, ...]:
        """Width and height, in pixels, of the repeating element, such as a brick; for one wave, its period.

        The width is the shortest way along the rows after which both phases are as before; cells of this
        width tile the plane at this height.
        """
        if len(self.waves) == 1:
            return (1.0 / float(np.hypot(*self.waves[0])),)
        (a, b), (c, d) = self.waves.tolist()
        area = a * d - b * c
        one, other = np.array([d, -c]) / area, np.array([-b, a]) / area
        steps = np.arange(-_MOST_STEPS, _MOST_STEPS + 1)
        ways = (steps[:, None, None] * one + steps[:, None] * other).reshape(-1, 2)
        level = np.abs(ways[:, 0]) <= _LEVEL * np.abs(ways[:, 1])
        ways = ways[level & (ways[:, 1] > 0)]
        width = float(np.hypot(*ways.T).min()) if len(ways) else float(min(np.hypot(*one), np.hypot(*other)))
        return width, 1.0 / (abs(area) * width)

    @property
    def cell(self) -> float:
        """Side, in pixels, of the least upright square that holds a whole cell; of one wave, its period."""
        if len(self.waves) == 1:
            return 1.0 / float(np.hypot(*self.waves[0]))
        (a, b), (c, d) = self.waves.tolist()
        area = a * d - b * c
        # The shortest two shifts that keep both phases (Gauss's reduction).
        short, long = np.array([d, -c]) / area, np.array([-b, a]) / area
        while True:
            if short @ short > long @ long:
                short, long = long, short
            steps = round(float(short @ long / (short @ short)))
            if steps == 0:
                return float((np.abs(short) + np.abs(long)).max())
            long = long - steps * short


@stage
def find_lattice(exemplar: PixelArray) -> Lattice | None:
    """Find the one or two waves at which a sample repeats.

    Peaks that stand out of the spectrum of its brightness, or of its edges, are followed over the sample.
    Among the steady ones, two are taken whose whole multiples, or sums of these, give all other peaks; or
    one if there are no two. Arithmetic is on whole numbers or in a fixed order: the same sample gives the
    same lattice on every machine.

    Parameters
    ----------
    exemplar
        (H, W, C), any number of channels; uint8, uint16 or float32.

    Returns
    -------
    Lattice or None
        None if nothing repeats with certainty, at least three times.
    """
    if min(exemplar.shape[:2]) < _LEAST_SIDE:
        return None
    height, width = exemplar.shape[:2]
    by = max(1, min(height, width) // _LOOKED_AT)
    looked_at = planes(reduced(exemplar, by))
    peaks = [
        peak
        for index, plane in enumerate(looked_at)
        for peak in spectrum_peaks(plane, index, _LEAST_PROMINENCE)
    ]
    shape = looked_at[0].shape
    sure = _sure_waves(looked_at, peaks)
    sure += _differences(sure, shape)
    waves = np.array([wave.wave for wave in sure]).reshape(-1, 2)
    chosen = chosen_waves(waves, np.array([wave.prominence for wave in sure]), peaks, shape)
    if not chosen:
        return None
    return Lattice(
        waves[chosen] / by,
        np.stack([_pixel_phases(sure[n], by, (height, width)) for n in chosen]),
        np.array([sure[n].certainty for n in chosen]),
    )


class _Wave(NamedTuple):
    # A certain wave: one that was followed, or a sum or difference of two.
    wave: FloatArray
    prominence: float
    certainty: float
    parts: tuple[tuple[int, Followed], ...]  # signs and waves


def _sure_waves(looked_at: list[Plane], peaks: list[SpectrumPeak]) -> list[_Wave]:
    # The most prominent peaks, each followed on the plane that shows it best; no repeats, and no multiples.
    shape = looked_at[0].shape
    taken: list[SpectrumPeak] = []
    for peak in sorted(peaks, key=lambda peak: -peak.prominence):
        if len(taken) < _CANDIDATES and not _repeats(peak.wave, [other.wave for other in taken], shape):
            taken.append(peak)
    found = []
    for peak in taken:
        followed = follow(looked_at[peak.plane], peak.wave)
        certainty = _certainty(peak, followed)
        if certainty >= _SURE and periods(followed.wave, shape) >= LEAST_PERIODS:
            found.append(_Wave(followed.wave, peak.prominence, certainty, ((1, followed),)))
    return found


def _repeats(wave: FloatArray, others: list[FloatArray], shape: tuple[int, int]) -> bool:
    # Whether a wave equals one of the others, or a multiple of one.
    if not others:
        return False
    away = wave * shape - _MULTIPLES[:, None, None] * (np.array(others) * shape)
    return bool(((away * away).sum(axis=2) <= (2 * TOLERANCE) ** 2).any())


def _differences(sure: list[_Wave], shape: tuple[int, int]) -> list[_Wave]:
    # The lattice's slowest waves are often weak, but are the difference of two strong ones.
    found: list[_Wave] = []
    for a, b in combinations(sure[:_COMBINED], 2):
        for sign in (-1, 1):
            wave = a.wave + sign * b.wave
            if periods(wave, shape) < LEAST_PERIODS:
                continue
            if _repeats(wave, [other.wave for other in sure + found], shape):
                continue
            prominence = min(a.prominence, b.prominence) / 2
            parts = (a.parts[0], (sign, b.parts[0][1]))
            found.append(_Wave(wave, prominence, min(a.certainty, b.certainty), parts))
    return found


def _pixel_phases(wave: _Wave, by: int, shape: tuple[int, int]) -> NDArray[np.int16]:
    total = np.zeros(shape, np.int16)
    for sign, followed in wave.parts:
        total += np.int16(sign) * pixel_phases(followed, by, shape)  # wraps, as phases do
    return total


def _certainty(peak: SpectrumPeak, followed: Followed) -> float:
    # Noise has a prominence of up to 20, a steadiness of 0.79 and 0.07 residues.
    stands_out = min(1.0, peak.prominence / 80)
    steady = min(1.0, max(0.0, (followed.steadiness - 0.6) / 0.3))
    whole = max(0.0, 1 - followed.residues / 0.04)
    return round(stands_out * steady * whole * 1024) / 1024
