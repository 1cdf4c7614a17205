"""The size of blocks: one side for a complete surface."""

import numpy as np

from upholster.charts.phases.course_phases import CourseField
from upholster.charts.phases.phase_cells import PhaseField
from upholster.runtime.stages import stage

__all__ = ["LARGEST_SIDE", "LEAST_SIDE", "block_side", "suiting_side"]

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
def block_side(shape: tuple[int, ...], across: float, phases: PhaseField | CourseField | None) -> int:
    """Return the side of a surface's blocks.

    It suits the sample's size, and is at most an eighth of the surface. A repeating texture stays in step:
    inside a block it has its true scale; from block to block the requested phase compensates for the stretch
    of courses, less than a quarter turn.

    Parameters
    ----------
    shape
        (H, W, …) of the exemplar.
    across
        Square root of the surface's area, in exemplar pixels.
    phases
        The phases that the surface requests; None: the sample does not repeat.

    Returns
    -------
    int
        In exemplar pixels, a multiple of 4.
    """
    most = across / _ACROSS
    if phases is not None:
        period = 1 / float(np.sqrt((phases.waves**2).sum(axis=1).max()))
        in_step = 0.25 / max(phases.strain(_IN_STEP), 1e-9)
        most = min(most, max(in_step, _LEAST_PERIODS * period))
    repeats = phases is not None and len(phases.waves) > 1
    return min(suiting_side(shape, repeats=repeats), 4 * int(max(most, LEAST_SIDE) / 4))
