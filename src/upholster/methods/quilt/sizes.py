"""How large blocks are: one side for a whole surface."""

import numpy as np

from upholster.charts.phases import PhaseField
from upholster.methods.quilt.structure import block_size
from upholster.types import PixelArray

__all__ = ["block_side"]

_LEAST = 20
"""Pixels of a block, where its sample allows: smaller ones take more bytes, and nobody sees them."""

_ACROSS = 24
"""Blocks across a surface, about: fewer can not follow its curves."""

_SHARE = 0.96
"""Of the surface, on which blocks stay in step. On the rest are the ends of courses, where none can be."""

_LEAST_PERIODS = 0.75
"""Periods of a block at least, of the fastest wave."""


def block_side(exemplar: PixelArray, across: float, phases: PhaseField | None) -> int:
    """Return the side of a surface's blocks.

    It suits the sample's structure, is no larger than a 24th of the surface, and small enough for blocks
    to keep a repeating texture in step: inside a block it has its true scale, and from one to the next the
    wanted phase makes up for what courses are stretched by, less than a quarter of a turn.

    Parameters
    ----------
    exemplar
        (H, W, C), any number of channels; uint8, uint16 or float32.
    across
        Root of the surface's area, in exemplar pixels.
    phases
        Those that the surface wants; None: the sample does not repeat.

    Returns
    -------
    int
        In exemplar pixels, a multiple of 4.
    """
    most = across / _ACROSS
    if phases is not None:
        period = 1 / float(np.sqrt((phases.waves**2).sum(axis=1).max()))
        in_step = 0.25 / max(phases.strain(_SHARE), 1e-9)
        most = min(most, max(in_step, _LEAST_PERIODS * period))
    return min(block_size(exemplar), 4 * int(max(most, _LEAST) / 4))
