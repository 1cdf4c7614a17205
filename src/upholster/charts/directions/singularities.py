"""Where a direction field has no direction: singular points, and branches that do not meet."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import ComplexArray, FloatArray
from upholster.charts.directions._kernels import around_vertices
from upholster.charts.directions.frames import PlaneFrames, power
from upholster.geometry.meshes.triangle_mesh import TriangleMesh

__all__ = ["indices_at_vertices", "jumps_over_edges", "vertices_at_creases"]


def indices_at_vertices(
    mesh: TriangleMesh, frames: PlaneFrames, z: ComplexArray, fold: int
) -> NDArray[np.int8]:
    """Return each vertex's index, (V,), in parts 1/fold of a turn.

    This is the number of times the field turns along a counter-clockwise loop around the vertex, 0 at most
    vertices. On a closed mesh the indices add up to fold times the Euler characteristic. Vertices at borders
    have 0.

    References
    ----------
    K. Crane, M. Desbrun, P. Schröder: Trivial connections on discrete surfaces, Computer Graphics Forum 29,
    2010, section 2.2.
    """
    before = np.roll(frames.along, 1, axis=1)
    corners = np.pi - _angle(frames.along * np.conj(before))
    total = np.empty(len(mesh.positions))
    turned = _turned(mesh, frames, power(z, fold), fold) / fold
    around_vertices(mesh.triangles, mesh.neighbours, corners, turned, total)
    return np.rint(total * fold / (2 * np.pi)).astype(np.int8)


def jumps_over_edges(mesh: TriangleMesh, frames: PlaneFrames, z: ComplexArray, fold: int) -> NDArray[np.int8]:
    """Return the quarter turns, 0 to 3 counter-clockwise, by which the field jumps over each edge, (T, 3).

    0 where it is continuous, at creases and at borders.
    """
    parts = np.rint(_turned(mesh, frames, z, 1) * fold / (2 * np.pi)).astype(np.int64) % fold
    return np.where(frames.across >= 0, parts * (4 // fold), 0).astype(np.int8)


def vertices_at_creases(mesh: TriangleMesh, frames: PlaneFrames) -> NDArray[np.bool_]:
    """Return which vertices are at an edge over which the field is not continuous, (V,)."""
    triangle, edge = np.nonzero(frames.across < 0)
    found = np.zeros(len(mesh.positions), np.bool_)
    found[mesh.triangles[triangle, edge]] = True
    found[mesh.triangles[triangle, (edge + 1) % 3]] = True
    return found


def _turned(mesh: TriangleMesh, frames: PlaneFrames, z: ComplexArray, symmetry: int) -> FloatArray:
    """Return the angle (T, 3) from z, carried over each edge, to z there; the way back is its negative."""
    beyond, edge = mesh.neighbours // 3, mesh.neighbours % 3
    turned = np.zeros(beyond.shape)
    up = np.nonzero(mesh.neighbours > 3 * np.arange(len(beyond))[:, None] + 2)
    other, met = beyond[up], edge[up]
    carried = power(-frames.along[other, met] * np.conj(frames.along[up]), symmetry)
    turned[up] = _angle(z[other] * np.conj(z[up[0]] * carried))
    turned[other, met] = -turned[up]
    return turned


def _angle(z: ComplexArray) -> FloatArray:
    found: FloatArray = np.arctan2(z.imag, z.real)
    return found
