"""What a level direction, or vectors in space, are on the smooth surface that a mesh's triangles stand for.

Facets are flat, and what is asked for on each alone jumps from one to the next. What is drawn smooth, with
normals that are interpolated, is asked for by the same normals; over sharp edges it jumps.
"""

import numpy as np

from upholster.charts.directions.direction import Direction, TriangleVectors, Vectors, called
from upholster.charts.directions.on_coordinates import told_on_coordinates
from upholster.errors import InputError
from upholster.geometry import TriangleMesh
from upholster.geometry.corner_normals import corner_normals
from upholster.types import FloatArray

__all__ = ["SMOOTH", "asked_at_corners", "laid_over", "shading_normals", "vectors_at"]

SMOOTH = 60.0
"""Degrees: what is asked for goes on smoothly over edges that bend by less, where the file has no normals.

Models are drawn smooth over edges of less (`corner_normals`). But where a leg or an ear has few facets, each
would ask for a direction of its own, and the texture would be cut at every other edge.
"""

_TURNED_OVER = 0.2
"""Cosine of the angle to its triangle's normal below which one of a file is not believed."""


def asked_at_corners(
    mesh: TriangleMesh,
    direction: Direction,
    crease: float | None = None,
    *,
    normals: FloatArray | None = None,
) -> FloatArray | None:
    """Return what is asked for at the triangles' corners, in their planes, to be interpolated over them.

    Parameters
    ----------
    mesh, direction, crease
        As of `direction_field`.
    normals
        (T, 3, 3) what `shading_normals` returns for these, where that is known.

    Returns
    -------
    ndarray or None
        (T, 3, 3); lengths are the sine of the angle between what is asked for and the normal, times how much
        it counts. None for ``smooth``, ``curvature`` and ``edges``, which only a field can tell.

    Raises
    ------
    InputError
        If vectors are not finite, or of another shape.
    """
    direction = told_on_coordinates(mesh, direction)
    if direction.kind not in ("level", "vectors"):
        return None
    if normals is None:
        normals = shading_normals(mesh, crease)
    if direction.kind == "level":
        along = np.cross((0.0, 0.0, 1.0), normals)
    else:
        given = _vectors_at_corners(mesh, direction.vectors)
        if direction.weighted:  # in the triangles' planes already
            return given
        length = np.linalg.norm(given, axis=2, keepdims=True)
        unit = given / np.where(length > 0, length, 1.0)
        along = unit - (unit * normals).sum(axis=2, keepdims=True) * normals
    flat = np.broadcast_to(mesh.flat_normals[:, None], normals.shape)
    laid, angle = laid_over(along, normals, flat), np.radians(direction.angle)
    turned: FloatArray = np.cos(angle) * laid + np.sin(angle) * np.cross(laid, flat)
    return turned


def shading_normals(mesh: TriangleMesh, crease: float | None = None) -> FloatArray:
    """Return unit normals at the triangles' corners, (T, 3, 3), of the smooth surface: see `corner_normals`.

    They are smooth over edges of less than `SMOOTH` degrees, or than `crease` if that is less. A normal of a
    file that is turned over, or nearly, is its triangle's.
    """
    found = corner_normals(mesh, SMOOTH if crease is None else min(crease, SMOOTH))
    flat = mesh.flat_normals[:, None]
    upright = (found * flat).sum(axis=2, keepdims=True) > _TURNED_OVER
    out: FloatArray = np.where(upright, found, flat)
    return out


def laid_over(vectors: FloatArray, normals: FloatArray, others: FloatArray) -> FloatArray:
    """Return tangent vectors (…, 3) turned by the least rotation that takes unit normals to others."""
    axis, cosine = np.cross(normals, others), (normals * others).sum(axis=-1, keepdims=True)
    along = (axis * vectors).sum(axis=-1, keepdims=True) / np.maximum(1 + cosine, 1e-3)
    turned: FloatArray = cosine * vectors + np.cross(axis, vectors) + along * axis
    return turned


def vectors_at(mesh: TriangleMesh, vectors: Vectors | FloatArray | None) -> FloatArray:
    """Return vectors at the triangles' centres, (T, 3), checked.

    Raises
    ------
    InputError
        If they are not finite, or of another shape.
    """
    if isinstance(vectors, np.ndarray):
        centres: FloatArray = _of_array(mesh, vectors).mean(axis=1)
        return centres
    assert vectors is not None
    return _values(vectors, mesh.corners.mean(axis=1))


def _vectors_at_corners(mesh: TriangleMesh, vectors: Vectors | FloatArray | None) -> FloatArray:
    # (T, 3, 3): of what is known for triangles alone the same at all three corners.
    if isinstance(vectors, np.ndarray):
        return _of_array(mesh, vectors)
    assert vectors is not None
    if isinstance(vectors, TriangleVectors):
        return np.repeat(vectors_at(mesh, vectors)[:, None], 3, axis=1)
    return _values(vectors, mesh.corners.reshape(-1, 3)).reshape(-1, 3, 3)


def _of_array(mesh: TriangleMesh, vectors: FloatArray) -> FloatArray:
    # (T, 3, 3), of an array that knows vertices or corners.
    if vectors.shape not in (mesh.positions.shape, mesh.corners.shape):
        raise InputError(f"direction: vectors have shape {vectors.shape}; allowed: {mesh.positions.shape}")
    corners: FloatArray = vectors if vectors.ndim == 3 else vectors[mesh.triangles]
    return corners


def _values(vectors: Vectors, points: FloatArray) -> FloatArray:
    """Return what a function says at points (n, 3), checked, and made shorter alike where it is long."""
    found = called(vectors, points)
    # Their lengths do not matter, and must not overflow.
    unit: FloatArray = found / np.maximum(np.abs(found).max(), 1e-300)
    return unit
