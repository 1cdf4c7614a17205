"""What keeps a repeating texture in step: the sample's phases, and those wanted on the surface."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from upholster.charts.phases import TURN
from upholster.elements import Lattice
from upholster.quilt.placement import SYMMETRIES
from upholster.types import FloatArray, IntArray

__all__ = [
    "SurfacePhases",
    "WantedPhases",
    "better_tile",
    "level_phases",
    "shown_waves",
    "stretched_by",
    "whole_waves",
]

_NEAR = 0.05
"""Of a wave's length: a symmetry shows another wave in its place if the two differ by no more."""


class SurfacePhases(Protocol):
    """Phases that are wanted somewhere: as `upholster.charts.phases.PhaseField` tells them."""

    def at(self, triangles: IntArray, points: FloatArray, /) -> NDArray[np.int16]:
        """Return the phases at points (m, 3) in triangles (m,): (n, m), in 1/65536 turn."""
        ...


@dataclass(frozen=True, eq=False, slots=True)
class WantedPhases:
    """Where in its periods a texture shall be.

    Attributes
    ----------
    lattice
        The sample's waves and its own phases.
    surface
        The phases that the surface wants.
    weight
        What a source costs whose phases do not fit, in parts of the sample's variance.
    """

    lattice: Lattice
    surface: SurfacePhases
    weight: float


def level_phases(lattice: Lattice | None, level: int, height: int, width: int) -> NDArray[np.int16]:
    """Return the sample's phases at the middles of a level's pixels, (n, height · width); n = 0 for None.

    Parameters
    ----------
    lattice
        Of the sample.
    level, height, width
        Which level of its pyramid, and the level's size in pixels.
    """
    if lattice is None:
        return np.zeros((0, height * width), np.int16)
    # The middle of an even number of pixels lies half a pixel before the one that is looked at.
    place, back = (1 << level) >> 1, 0.5 if level else 0.0
    rows = np.minimum((np.arange(height) << level) + place, lattice.phases.shape[1] - 1)
    columns = np.minimum((np.arange(width) << level) + place, lattice.phases.shape[2] - 1)
    # Whole turns fall away.
    moved = np.rint(TURN * back * lattice.waves.sum(axis=1)).astype(np.int64).astype(np.int16)
    found = lattice.phases.take(rows, axis=1).take(columns, axis=2).astype(np.int16)
    return np.ascontiguousarray((found - moved[:, None, None]).reshape(len(moved), -1))


def shown_waves(lattice: Lattice | None) -> NDArray[np.int8]:
    """Return which wave each symmetry shows in each one's place, (8, n): see `MatchImage.shown`."""
    waves = np.zeros((0, 2)) if lattice is None else lattice.waves
    found = np.zeros((8, len(waves)), np.int8)
    both = np.concatenate([waves, -waves])
    for symmetry, turn in enumerate(SYMMETRIES):
        # What reads T·x of the sample shows the wave Tᵀf.
        away = np.sqrt((((both @ turn.reshape(2, 2))[None] - waves[:, None]) ** 2).sum(axis=2))
        for k, wave in enumerate(waves):
            best = int(away[k].argmin())
            if away[k, best] <= _NEAR * np.sqrt((wave**2).sum()):
                found[symmetry, k] = best + 1 if best < len(waves) else len(waves) - best - 1
    return found


def stretched_by(waves: FloatArray, height: int, width: int) -> float:
    """Return by what part of itself a wave is changed at most, so that a tile has whole periods of it."""
    changed = whole_waves(waves, height, width) - waves
    return float(np.sqrt(((changed**2).sum(axis=1) / (waves**2).sum(axis=1)).max()))


def better_tile(waves: FloatArray, height: int, width: int) -> tuple[int, int]:
    """Return a height and width near given ones, in texels, that stretch waves least."""
    best = []
    for axis, size in enumerate((height, width)):
        sizes = np.arange(max(8, int(0.8 * size)), int(1.2 * size) + 1)
        periods = sizes[:, None] * waves[:, axis]
        off = np.abs(periods - np.rint(periods)).max(axis=1) / sizes
        best.append(int(sizes[np.lexsort((np.abs(sizes - size), np.round(off, 6)))[0]]))
    return best[0], best[1]


def whole_waves(waves: FloatArray, height: int, width: int) -> FloatArray:
    """Return the waves nearest to some, (n, 2), with whole periods in a tile of height × width texels."""
    size = np.array([height, width])
    found: FloatArray = np.rint(waves * size) / size
    return found
