"""The lattice of a sample: the waves at which it repeats, and their phases at every pixel."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, PixelArray, frozen_array
from upholster.image.elements.autocorrelation import Correlation, correlation
from upholster.image.elements.bases import shortest_pair
from upholster.image.elements.planes import Plane, balanced, reduced
from upholster.image.elements.rows import even_rows
from upholster.image.elements.translations import two_translations
from upholster.image.elements.wave_phases import follow, pixel_phases, strength
from upholster.runtime.stages import stage

__all__ = ["Lattice", "element_of", "find_lattice"]

_LOOKED_AT, _LONGEST = 256, 512
"""The most pixels of the shorter side, to which larger samples are reduced, and of the longer one."""

_LEAST_SIDE = 32

_REACH = 2 / 3
"""Share of the sample by which it is shifted at most: one and a half periods are enough."""

_MOST_STEPS, _LEVEL = 4, 0.1
"""Of an element: the most periods in its width, and how far from level it may run, as a slope."""

_SURE = 0.5
"""Certainty below which there is no lattice."""

_CHANCE, _CONTRAST = 6.0, 0.05
"""What repeats is certain if the correlation at its places exceeds that between them by this many standard
deviations, and by this much."""

_ALIKE, _LARGE = 0.8, 0.25
"""The correlation must also be this high, if a cell covers the second share of the sample or more; if less,
it may be as much lower. A small cell repeats often, with more irregularity between the farthest places."""

_MEANDERING = 0.6
"""Share of the correlation that is kept from near to far places, at which nothing is certain: stripes meander
and fork."""

_STRONG = 0.03
"""Rows are certain if the correlation contains their wave to this extent."""

_SIMPLE = 2
"""Sums of up to this many of each wave are followed."""

_SPARE = 14
"""Bits of products of correlation and overlap that are dropped, so that sums of their squares fit 64 bits."""


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
        """Width and height, in pixels, of the repeating element: see `element_of`."""
        return element_of(self.waves)

    @property
    def cell(self) -> float:
        """Side, in pixels, of the least upright square that holds a whole cell; of one wave, its period."""
        if len(self.waves) == 1:
            return 1.0 / float(np.hypot(*self.waves[0]))
        (a, b), (c, d) = self.waves.tolist()
        area = a * d - b * c
        # The shortest two shifts that keep both phases.
        short, long = np.abs(shortest_pair((d / area, -c / area), (-b / area, a / area)))
        return float((short + long).max())


def element_of(waves: FloatArray) -> tuple[float, ...]:
    """Return the width and height, in pixels, of the element that repeats, a brick; of one wave its period.

    The width is the shortest way along the rows after which both phases are as before; cells of this width
    tile the plane at this height.
    """
    if len(waves) == 1:
        return (1.0 / float(np.hypot(*waves[0])),)
    (a, b), (c, d) = waves.tolist()
    area = a * d - b * c
    one, other = np.array([d, -c]) / area, np.array([-b, a]) / area
    steps = np.arange(-_MOST_STEPS, _MOST_STEPS + 1)
    ways = (steps[:, None, None] * one + steps[:, None] * other).reshape(-1, 2)
    level = np.abs(ways[:, 0]) <= _LEVEL * np.abs(ways[:, 1])
    ways = ways[level & (ways[:, 1] > 0)]
    width = float(np.hypot(*ways.T).min()) if len(ways) else float(min(np.hypot(*one), np.hypot(*other)))
    return width, 1.0 / (abs(area) * width)


@stage
def find_lattice(exemplar: PixelArray) -> Lattice | None:
    """Find the one or two waves at which a sample repeats.

    They are found in the autocorrelation of colours and edges: two translations at all of whose multiples
    the sample and its shifted copy are alike, and between them less; or rows at even distances, if these
    alone determine the autocorrelation. Arithmetic is on whole numbers or in a fixed order: the same sample
    gives the same lattice on every machine.

    Parameters
    ----------
    exemplar
        (H, W, C), any number of channels; uint8, uint16 or float32.

    Returns
    -------
    Lattice or None
        None if nothing repeats with certainty, at least one and a half times.

    References
    ----------
    Liu, Collins, Tsin: A computational model for periodic pattern perception based on frieze and wallpaper
    groups, PAMI 26 (2004), on finding a lattice by the autocorrelation's peaks.
    """
    height, width = exemplar.shape[:2]
    if min(height, width) < _LEAST_SIDE:
        return None
    by = -(-min(height, width) // _LOOKED_AT)
    looked_at = balanced(reduced(exemplar, by))
    if not looked_at:  # nothing varies
        return None
    parts = [plane[:_LONGEST, :_LONGEST] for plane in looked_at]
    rows, columns = parts[0].shape
    found = correlation(parts, (int(_REACH * rows), int(_REACH * columns)))
    waves, certainty = _two_waves(found, rows * columns)
    if certainty < _SURE:
        waves, certainty = _one_wave(found)
    if certainty < _SURE:
        return None
    phases = _phases(found, looked_at, waves, by, (height, width))
    return Lattice(waves / by, phases, np.full(len(waves), certainty))


def _two_waves(found: Correlation, pixels: int) -> tuple[FloatArray, float]:
    translations = two_translations(found)
    if translations is None:
        return np.zeros((0, 2)), 0.0
    (a, b), (c, d) = translations.shifts.tolist()
    area = a * d - b * c
    if abs(area) > _REACH**2 * pixels:  # fewer than one and a half cells each way
        return np.zeros((0, 2)), 0.0
    contrast = translations.alike - translations.between
    needed = _ALIKE * min(1.0, abs(area) / pixels / _LARGE)
    certainty = _certainty(
        contrast / (_CHANCE * translations.chance),
        contrast / _CONTRAST,
        translations.alike / needed,
        _kept(translations.alike / max(translations.first, 1e-9)),
    )
    return np.array(shortest_pair((d / area, -c / area), (-b / area, a / area))), certainty


def _kept(share: float) -> float:
    return (min(share, 1.0) - _MEANDERING) / (1 - _MEANDERING)


def _certainty(*parts: float) -> float:
    return round(min(1.0, max(0.0, min(parts))) * 1024) / 1024


def _one_wave(found: Correlation) -> tuple[FloatArray, float]:
    rows = even_rows(found)
    if rows is None or rows.near <= 0:
        return np.zeros((0, 2)), 0.0
    certainty = _certainty(
        rows.contrast / max(_CHANCE * rows.chance, 1e-9),
        rows.near / _STRONG,
        _kept(rows.share * min(1.0, rows.far / rows.near)),
    )
    return rows.wave[None], certainty


def _phases(
    found: Correlation, looked_at: list[Plane], waves: FloatArray, by: int, shape: tuple[int, int]
) -> NDArray[np.int16]:
    # A slow wave is often weak, such as that of every second brick. So the strongest sums of the waves are
    # followed, each on the plane that contains most of it; the waves are sums of these.
    whole = _strongest(found, waves)
    followed = []
    for wave in (whole[:, :, None] * waves).sum(axis=1):
        plane = max(looked_at, key=lambda plane, wave=wave: strength(plane, wave))  # type: ignore[misc]
        followed.append(pixel_phases(follow(plane, wave), by, shape))
    out = np.zeros((len(waves), *shape), np.int16)
    back = np.rint(np.linalg.inv(whole)).astype(np.int16)
    for total, row in zip(out, back, strict=True):
        for times, phases in zip(row, followed, strict=True):
            total += times * phases  # wraps, as phases do
    return out


def _strongest(found: Correlation, waves: FloatArray) -> Plane:
    # (n, n) whole numbers of determinant 1 or -1: how the strongest waves are made of the given ones. Of two
    # equally strong ones the slower counts.
    if len(waves) == 1:
        return np.ones((1, 1), np.int64)
    weighted = found.heights * found.overlaps >> _SPARE
    steps = range(-_SIMPLE, _SIMPLE + 1)
    sums = [np.array([m, n]) for m in steps for n in steps if (m, n) > (0, 0) and math.gcd(m, n) == 1]
    worth = []
    for one in sums:
        wave = (one[:, None] * waves).sum(axis=0)
        worth.append(strength(weighted, wave) / float((wave * wave).sum()))
    best, chosen = -1.0, (0, 0)
    for k, one in enumerate(sums):
        for j, other in enumerate(sums[:k]):
            both = min(worth[k], worth[j])
            if both > best and abs(one[0] * other[1] - one[1] * other[0]) == 1:
                best, chosen = both, (j, k)
    return np.stack([sums[k] for k in chosen])
