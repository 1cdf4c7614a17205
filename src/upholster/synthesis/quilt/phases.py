"""Phases, which keep a repeating texture in step: those of the sample, and those requested on the surface."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts.phases.phase_cells import TURN
from upholster.image.elements.lattice import Lattice
from upholster.quilt.placement import SYMMETRIES

__all__ = [
    "SurfacePhases",
    "better_tile",
    "level_phases",
    "shown_waves",
    "stretched_by",
    "whole_waves",
]

_NEAR = 0.05
"""A symmetry shows a wave as another one if their frequencies differ by at most this fraction."""


class SurfacePhases(Protocol):
    """The phases that a surface requests, as a `PhaseField` returns them."""

    @property
    def waves(self) -> FloatArray:
        """(n, 2) the sample's waves, in cycles per pixel."""
        ...

    def at(self, triangles: IntArray, points: FloatArray, /) -> NDArray[np.int16]:
        """Return the phases at points (m, 3) in triangles (m,): (n, m), in 1/65536 turn."""
        ...


def level_phases(lattice: Lattice | None, level: int, height: int, width: int) -> NDArray[np.int16]:
    """Return the sample's phases at the centres of a level's pixels, (n, height · width); n = 0 for None.

    Parameters
    ----------
    lattice
        The lattice of the sample.
    level, height, width
        The level of its pyramid, and the level's size in pixels.
    """
    if lattice is None:
        return np.zeros((0, height * width), np.int16)
    # The centre of an even number of pixels is half a pixel before the pixel whose phase is read.
    place, back = (1 << level) >> 1, 0.5 if level else 0.0
    rows = np.minimum((np.arange(height) << level) + place, lattice.phases.shape[1] - 1)
    columns = np.minimum((np.arange(width) << level) + place, lattice.phases.shape[2] - 1)
    # The conversion to int16 drops whole turns.
    moved = np.rint(TURN * back * lattice.waves.sum(axis=1)).astype(np.int64).astype(np.int16)
    found = lattice.phases.take(rows, axis=1).take(columns, axis=2).astype(np.int16)
    return np.ascontiguousarray((found - moved[:, None, None]).reshape(len(moved), -1))


def shown_waves(lattice: Lattice | None) -> NDArray[np.int8]:
    """Return the wave that each symmetry shows in place of each wave, (8, n): see `MatchImage.shown`."""
    waves = np.zeros((0, 2)) if lattice is None else lattice.waves
    found = np.zeros((8, len(waves)), np.int8)
    both = np.concatenate([waves, -waves])
    for symmetry, turn in enumerate(SYMMETRIES):
        # Reading the sample at T·x shows its wave f as Tᵀf.
        away = np.sqrt((((both @ turn.reshape(2, 2))[None] - waves[:, None]) ** 2).sum(axis=2))
        for k, wave in enumerate(waves):
            best = int(away[k].argmin())
            if away[k, best] <= _NEAR * np.sqrt((wave**2).sum()):
                found[symmetry, k] = best + 1 if best < len(waves) else len(waves) - best - 1
    return found


def stretched_by(waves: FloatArray, height: int, width: int) -> float:
    """Return the largest relative change of a wave that gives a tile whole periods of every wave."""
    changed = whole_waves(waves, height, width) - waves
    return float(np.sqrt(((changed**2).sum(axis=1) / (waves**2).sum(axis=1)).max()))


def better_tile(waves: FloatArray, height: int, width: int) -> tuple[int, int]:
    """Return the height and width in texels, within 20 % of the given ones, that stretch waves least."""
    best = []
    for axis, size in enumerate((height, width)):
        sizes = np.arange(max(8, int(0.8 * size)), int(1.2 * size) + 1)
        periods = sizes[:, None] * waves[:, axis]
        off = np.abs(periods - np.rint(periods)).max(axis=1) / sizes
        best.append(int(sizes[np.lexsort((np.abs(sizes - size), np.round(off, 6)))[0]]))
    return best[0], best[1]


def whole_waves(waves: FloatArray, height: int, width: int) -> FloatArray:
    """Return the nearest waves to `waves` (n, 2) with whole periods in a tile of height × width texels."""
    size = np.array([height, width])
    found: FloatArray = np.rint(waves * size) / size
    return found
