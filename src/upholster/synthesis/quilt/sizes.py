"""The size of blocks: one side for a complete surface."""

import numpy as np

from upholster.base.types import FloatArray
from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.phases.phase_cells import PhaseField
from upholster.runtime.stages import stage

__all__ = ["LARGEST_SIDE", "LEAST_SIDE", "block_side", "suiting_side", "turning_of"]

_SHARE, _REPEATING_SHARE = 3 / 8, 5 / 16
"""Side of a block as a fraction of the sample's shorter side, also for a sample that repeats in two
directions. Smaller blocks break more elements. Larger ones repeat the middle of the sample and leave out its
rim, because blocks hardly reach beyond the sample."""

LARGEST_SIDE = 512
"""Maximum side of a block, in pixels."""

LEAST_SIDE = 20
"""Minimum side of a block in pixels, if its sample is large enough: smaller blocks take more bytes without a
visible gain."""

_ACROSS = 8
"""Minimum number of blocks across a surface: with fewer, little texture continues from block to block."""

_TURN, _STRAIGHT = 0.5, 0.9
"""Maximum turn of directions over a block's side, in radians, and the fraction of the surface that must
satisfy it. Blocks that turn more are trimmed and fit their neighbours worse."""

_IN_STEP = 0.94
"""Fraction of the surface on which blocks stay in step. They cannot in the rest, where courses end."""

_LEAST_PERIODS = 0.75
"""Minimum side of a block, in periods of the fastest wave."""


def suiting_side(shape: tuple[int, ...], *, repeats: bool) -> int:
    """Return the side of a block, in pixels, that suits a sample (H, W): a multiple of 4, 8 to 512.

    `repeats`: in two directions.
    """
    share = _REPEATING_SHARE if repeats else _SHARE
    return max(8, min(LARGEST_SIDE, 4 * round(share * min(shape[:2]) / 4)))


@stage
def block_side(shape: tuple[int, ...], across: float, turning: float, phases: PhaseField | None) -> int:
    """Return the side of a surface's blocks.

    It suits the sample's size, and is at most an eighth of the surface. Directions turn little inside
    such a block, and a repeating texture stays in step. Inside a block the texture has its true scale; from
    block to block the requested phase compensates for the stretch of courses, less than a quarter turn.

    Parameters
    ----------
    shape
        (H, W, …) of the exemplar.
    across
        Square root of the surface's area, in exemplar pixels.
    turning
        Turn of directions in radians per exemplar pixel, see `turning_of`.
    phases
        The phases that the surface requests; None: the sample does not repeat.

    Returns
    -------
    int
        In exemplar pixels, a multiple of 4.
    """
    most = min(across / _ACROSS, _TURN / max(turning, 1e-9))
    if phases is not None:
        period = 1 / float(np.sqrt((phases.waves**2).sum(axis=1).max()))
        in_step = 0.25 / max(phases.strain(_IN_STEP), 1e-9)
        most = min(most, max(in_step, _LEAST_PERIODS * period))
    repeats = phases is not None and len(phases.waves) > 1
    return min(suiting_side(shape, repeats=repeats), 4 * int(max(most, LEAST_SIDE) / 4))


@stage
def turning_of(surface: ChartedSurface, vectors: FloatArray, fold: int) -> float:
    """Return the maximum turn of directions on nine tenths of a surface, in radians per model unit.

    Parameters
    ----------
    surface, vectors
        As for `upholster.charts.phases.phase_cells.phase_field`.
    fold
        1, 2 or 4: this many evenly rotated directions count as one.
    """
    own = np.flatnonzero((surface.chart >= 0) & (surface.mesh.areas > 0))
    corners, vectors = surface.mesh.corners[own], vectors[own]
    along = corners[:, 1] - corners[:, 0]
    length = np.linalg.norm(along, axis=1)
    x: FloatArray = along / length[:, None]
    y = np.cross(surface.mesh.flat_normals[own], x)
    angles = np.arctan2(np.einsum("tki,ti->tk", vectors, y), np.einsum("tki,ti->tk", vectors, x))
    turns = angles[:, 1:] - angles[:, :1]
    turns -= 2 * np.pi / fold * np.rint(turns * fold / (2 * np.pi))
    other = corners[:, 2] - corners[:, 0]
    by_x = turns[:, 0] / length
    by_y = (turns[:, 1] - by_x * (other * x).sum(axis=1)) / (other * y).sum(axis=1)
    rates = np.hypot(by_x, by_y)
    order = np.argsort(rates, kind="stable")
    below = np.cumsum(surface.mesh.areas[own][order])
    return float(rates[order[np.searchsorted(below, _STRAIGHT * below[-1])]])
