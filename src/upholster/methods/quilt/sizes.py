"""How large blocks are: one side for a whole surface."""

import numpy as np

from upholster.charts.charted import ChartedSurface
from upholster.charts.phases import PhaseField
from upholster.methods.quilt.exemplar_structure import block_size
from upholster.stages import stage
from upholster.types import FloatArray, PixelArray

__all__ = ["block_side", "turning_of"]

_LEAST = 20
"""Pixels of a block, where its sample allows: smaller ones take more bytes, and nobody sees them."""

_ACROSS = 8
"""Blocks across a surface, at least: else there is nothing that goes on from one to the next."""

_TURN, _STRAIGHT = 0.5, 0.9
"""Radians by which directions turn over a block's side at most, and on what share of the surface: blocks that
turn more are trimmed, and fit their neighbours less."""

_SHARE = 0.94
"""Of the surface, on which blocks stay in step. On the rest are the ends of courses, where none can be."""

_LEAST_PERIODS = 0.75
"""Periods of a block at least, of the fastest wave."""


@stage
def block_side(exemplar: PixelArray, across: float, turning: float, phases: PhaseField | None) -> int:
    """Return the side of a surface's blocks.

    It suits the sample's structure, and is no larger than an eighth of the surface. It is small enough for
    directions to turn little inside a block, and to keep a repeating texture in step: inside a block it has
    its true scale, and from one to the next the wanted phase makes up for what courses are stretched by, less
    than a quarter of a turn.

    Parameters
    ----------
    exemplar
        (H, W, C), any number of channels; uint8, uint16 or float32.
    across
        Root of the surface's area, in exemplar pixels.
    turning
        Radians by which directions turn in an exemplar pixel, see `turning_of`.
    phases
        Those that the surface wants; None: the sample does not repeat.

    Returns
    -------
    int
        In exemplar pixels, a multiple of 4.
    """
    most = min(across / _ACROSS, _TURN / max(turning, 1e-9))
    if phases is not None:
        period = 1 / float(np.sqrt((phases.waves**2).sum(axis=1).max()))
        in_step = 0.25 / max(phases.strain(_SHARE), 1e-9)
        most = min(most, max(in_step, _LEAST_PERIODS * period))
    return min(block_size(exemplar), 4 * int(max(most, _LEAST) / 4))


@stage
def turning_of(surface: ChartedSurface, vectors: FloatArray, fold: int) -> float:
    """Return by how many radians directions turn in a model unit at most, on nine tenths of a surface.

    Parameters
    ----------
    surface
        What they lie on; triangles on no chart are left out.
    vectors
        (T, 3, 3), unit vectors at the triangles' corners: which way the exemplar's rows run.
    fold
        1, 2 or 4: so many directions, turned evenly, count as one.
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
