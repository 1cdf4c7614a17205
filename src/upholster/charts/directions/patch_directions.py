"""Directions along the rows and columns of charts on patches, and the default for a surface of patches."""

from dataclasses import replace

import numpy as np

from upholster.base.types import FloatArray
from upholster.base.vectors import unit_vectors
from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.directions.coordinate_directions import vectors_on_coordinates
from upholster.charts.directions.direction import Direction
from upholster.charts.tessellation.mesh import face_parameters, own_patches
from upholster.geometry.patches.surface import Surface
from upholster.runtime.stages import stage

__all__ = ["default_on_patches", "vectors_on_patches"]

_AGREED = np.cos(np.radians(15))
"""Cosine of the angle up to which directions on both sides of a seam count as one."""

_MOST_AGREE = 0.95
"""Share of the seams, by length, along which rows must continue for ``u`` to be the default."""


@stage
def vectors_on_patches(surface: Surface, charted: ChartedSurface, direction: Direction) -> Direction:
    """Convert a direction to that of a mesh: ``u`` and ``v`` become the surface's derivatives at corners.

    An image covers each face's parameters, its rows along t and its columns along s.

    Parameters
    ----------
    surface, charted
        A surface of patches, and its result of `charted_patches`.
    direction
        Any direction; others are returned as they are.
    """
    if direction.kind == "image":
        return vectors_on_coordinates(charted.mesh, direction, _parameters(surface, charted))
    if direction.kind not in ("u", "v"):
        return direction
    return replace(direction, kind="vectors", vectors=_derivatives(surface, charted, direction.kind))


@stage
def default_on_patches(surface: Surface, charted: ChartedSurface) -> str:
    """Return ``u`` if rows continue from chart to chart, else ``level``.

    On a ring that is closed both ways, rows run the longer way round: ``u`` or ``v``.
    """
    if _is_longer_down(surface):
        return "v"
    triangle, edge = np.nonzero(charted.is_seam)
    if not len(triangle):
        return "u"
    mesh = charted.mesh
    along = _derivatives(surface, charted, "u")
    other, met = np.divmod(charted.across[triangle, edge], 3)
    tangent = mesh.corners[triangle, (edge + 1) % 3] - mesh.corners[triangle, edge]
    length = np.linalg.norm(tangent, axis=1)
    sides = []
    for of, k in ((triangle, edge), (other, (met + 1) % 3)):
        # Along the edge and across it, in each triangle's plane.
        inward = np.cross(mesh.flat_normals[of], tangent)
        one = np.stack([(along[of, k] * axis).sum(axis=1) for axis in (tangent, inward)], axis=1)
        sides.append(unit_vectors(one))
    agree = (sides[0] * sides[1]).sum(axis=1) > _AGREED
    return "u" if length[agree].sum() >= _MOST_AGREE * length.sum() else "level"


def _parameters(surface: Surface, charted: ChartedSurface) -> FloatArray:
    # (T, 3, 2) at the triangles' corners: the share of the face's width to the left, and of its height above.
    out = np.empty((len(charted.chart), 3, 2))
    for number, chart in enumerate(charted.charts):
        own = np.flatnonzero(charted.chart == number)
        face = surface.faces[chart.face]
        s, t = face_parameters(chart, *charted.places[own].transpose(2, 0, 1))
        out[own] = np.stack([t / face.columns, s / face.rows], axis=-1)
    return out


def _derivatives(surface: Surface, charted: ChartedSurface, along: str) -> FloatArray:
    # (T, 3, 3) at the triangles' corners: along rows of texels for u, down columns for v.
    out = np.empty((len(charted.chart), 3, 3))
    for number, chart in enumerate(charted.charts):
        own = np.flatnonzero(charted.chart == number)
        part, within = own_patches(surface, chart)
        s, t = face_parameters(within, *charted.places[own].transpose(2, 0, 1))
        out[own] = part.derivatives(s, t)[2 if along == "u" else 1]
        # There is none at a pole: use the derivative at the triangle's other corners.
    length = np.linalg.norm(out, axis=2, keepdims=True)
    nothing = length <= 1e-9 * length.max()
    return np.where(nothing, out.sum(axis=1, keepdims=True), out)


def _is_longer_down(surface: Surface) -> bool:
    # Whether it is a single face, closed both ways, and longer along s than along t.
    closed = {seam.edge & 1 for seam in surface.face_shared if (seam.edge - seam.other_edge) % 4 == 2}
    if len(surface.faces) != 1 or closed != {0, 1}:
        return False
    face = surface.faces[0]
    down, right = (np.arange(8 * count) / 8 for count in (face.rows, face.columns))
    _, by_s, by_t = face.derivatives_grid(down, right)
    lengths = [np.linalg.norm(by, axis=2).mean() for by in (by_s, by_t)]
    return bool(lengths[0] * face.rows > 1.01 * lengths[1] * face.columns)
