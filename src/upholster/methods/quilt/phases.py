"""What keeps a repeating texture in step: the sample's phases, and those wanted on the surface."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from upholster.charts.phases import TURN, PhaseField
from upholster.lattice import Lattice
from upholster.quilt.placement import SYMMETRIES
from upholster.types import FloatArray

__all__ = [
    "Phases",
    "WantedPhases",
    "better_tile",
    "in_step",
    "level_phases",
    "shown_waves",
    "side_at_ends",
    "stretched_by",
    "whole_waves",
]

_NEAR = 0.05
"""Of a wave's length: a symmetry shows another wave in its place if the two differ by no more."""


OVERLAP = 0.3
"""Of a block, with the one before."""

_STRAINED, _ENDS = 0.03, 0.02
"""Of a chart's area that is not looked at: round the end of a course blocks fall out of step, however small
they are. A chart with one end among many cells keeps its blocks, for smaller ones take more bytes."""

_LEAST_BLOCK, _LEAST_PERIODS = 16, 0.75
"""Pixels and periods of a block at least: smaller ones show as pieces of elements in several colours."""

_END_BLOCK, _END_PERIODS = 24, 1.3
"""Pixels and periods, whichever is less, of blocks where courses end: what breaks there is as long as
one or two of their sides."""

_NEAR_ENDS = ((1.7, 0.2), (2.2, 0.03))
"""Periods of blocks, if that is more than `_END_BLOCK`, where any course ends: a fault is about as long as a
block, or somewhat longer. Beside them the share of a chart that must lie near such ends, within a block's
side, for it to have such blocks: on large charts they would be many for little."""


class Phases(Protocol):
    """Wanted phases over charts, such as `upholster.charts.phases.PhaseField`."""

    def at(self, chart: int, rows: FloatArray, columns: FloatArray) -> NDArray[np.int16]:
        """Return them at places (m,) on a chart, (n, m), in 1/65536 turn."""


@dataclass(frozen=True, eq=False, slots=True)
class WantedPhases:
    """Where in its periods a texture shall be.

    Attributes
    ----------
    lattice
        The sample's waves and its own phases.
    surface
        The phases that the surface wants; None on meshes, where they are found when it is laid out finely.
    weight
        What a source costs whose phases do not fit, in parts of the sample's variance.
    blocks
        Sides of each chart's blocks in pixels; none: as the options have it.
    """

    lattice: Lattice
    surface: Phases | None
    weight: float
    blocks: tuple[int, ...] = ()


def in_step(block: int, field: Phases | None) -> tuple[int, ...]:
    """Return the sides of each chart's blocks, in pixels, that keep neighbours in step.

    Inside a block the texture has its true scale; from one to the next the wanted phase makes up for what
    courses are stretched by, a quarter of a turn at most. Blocks are three quarters of the shortest period at
    least. Where a course ends and the chart is not large they are about two periods at most, and about one
    where several do: there the stretch grows beyond all bounds.

    Parameters
    ----------
    block
        The side that suits the sample.
    field
        The wanted phases.

    Returns
    -------
    tuple of int
        One for each chart; none where phases need nothing smaller anywhere.
    """
    if not isinstance(field, PhaseField):
        return ()
    periods = 1 / np.sqrt((field.waves**2).sum(axis=1))
    least = _least_side(float(periods.min()))
    at_ends = side_at_ends(field)
    found = []
    for chart in range(len(field.grids)):
        most, common = field.strain(chart, (1 - _ENDS, 1 - _STRAINED))
        sides = [
            max(floor, 0.25 / max(strain, 1e-9) / (1 - OVERLAP))
            for floor, strain in ((at_ends, most), (least, common))
        ]
        texels = field.grids[chart].chart.height * field.grids[chart].chart.width
        for one_end, share in _NEAR_ENDS:
            side = np.maximum(_END_BLOCK, one_end * periods)
            sides += side[field.ends_on(chart) * (2 * side) ** 2 > share * texels].tolist()
        found.append(min(block, 4 * round(min(sides) / 4)))
    return tuple(found)


def side_at_ends(field: PhaseField) -> float:
    """Return the side in pixels of blocks where courses end."""
    period = 1 / float(np.sqrt((field.waves**2).sum(axis=1)).max())
    return max(min(_END_BLOCK, _END_PERIODS * period), _least_side(period))


def _least_side(period: float) -> float:
    return max(_LEAST_BLOCK, _LEAST_PERIODS * period)


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
