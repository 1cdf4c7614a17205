"""Level directions, or vectors in space, on the smooth surface that a mesh's triangles approximate.

Facets are flat, and a direction evaluated on each one separately jumps from one to the next. Where a surface
is drawn smooth, with interpolated normals, directions use the same normals; over sharp edges they jump.
"""

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.charts.directions.coordinate_directions import vectors_on_coordinates
from upholster.charts.directions.direction import Direction, TriangleVectors, Vectors, called
from upholster.geometry.meshes.corner_normals import corner_normals
from upholster.geometry.meshes.triangle_mesh import TriangleMesh

__all__ = ["SMOOTH", "laid_over", "requested_at_corners", "shading_normals", "vectors_at"]

SMOOTH = 60.0
"""Degrees: where the file has no normals, directions are smooth over edges that bend by less.

The limit for drawing models smooth is lower (`corner_normals`). But a leg or an ear with few facets would get
a separate direction on each, and the texture would be cut at every other edge.
"""

_TURNED_OVER = 0.2
"""A file's normal is ignored if the cosine of its angle to its triangle's normal is below this."""


def requested_at_corners(
    mesh: TriangleMesh,
    direction: Direction,
    crease: float | None = None,
    *,
    normals: FloatArray | None = None,
) -> FloatArray | None:
    """Return the directions asked for at the triangles' corners, in their planes, for interpolation.

    Parameters
    ----------
    mesh, direction, crease
        As of `direction_field`.
    normals
        (T, 3, 3) the result of `shading_normals` for these, if it is already known.

    Returns
    -------
    ndarray or None
        (T, 3, 3); lengths are the sine of the angle between the direction asked for and the normal, times its
        weight. None for other words of `direction_words.DIRECTIONS`, which only a field can determine.

    Raises
    ------
    InputError
        If vectors are not finite, or of another shape.
    """
    direction = vectors_on_coordinates(mesh, direction)
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
    """Return unit normals of the smooth surface at the triangles' corners, (T, 3, 3): see `corner_normals`.

    They are smooth over edges of less than `SMOOTH` degrees, or than `crease` if that is less. A file's
    normal that is turned over, or nearly, is replaced by its triangle's.
    """
    found = corner_normals(mesh, SMOOTH if crease is None else min(crease, SMOOTH))
    flat = mesh.flat_normals[:, None]
    upright = (found * flat).sum(axis=2, keepdims=True) > _TURNED_OVER
    out: FloatArray = np.where(upright, found, flat)
    return out


def laid_over(vectors: FloatArray, normals: FloatArray, others: FloatArray) -> FloatArray:
    """Return tangent vectors (…, 3) turned by the smallest rotation that takes unit normals to others."""
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
    # (T, 3, 3): values known only for triangles are repeated at all three corners.
    if isinstance(vectors, np.ndarray):
        return _of_array(mesh, vectors)
    assert vectors is not None
    if isinstance(vectors, TriangleVectors):
        return np.repeat(vectors_at(mesh, vectors)[:, None], 3, axis=1)
    return _values(vectors, mesh.corners.reshape(-1, 3)).reshape(-1, 3, 3)


def _of_array(mesh: TriangleMesh, vectors: FloatArray) -> FloatArray:
    # (T, 3, 3), from an array of values at vertices or corners.
    if vectors.shape not in (mesh.positions.shape, mesh.corners.shape):
        raise InputError(f"direction: vectors have shape {vectors.shape}; allowed: {mesh.positions.shape}")
    corners: FloatArray = vectors if vectors.ndim == 3 else vectors[mesh.triangles]
    return corners


def _values(vectors: Vectors, points: FloatArray) -> FloatArray:
    """Return a function's values at points (n, 3), checked; scaled down together where they are long."""
    found = called(vectors, points)
    # Their lengths do not matter, and must not overflow.
    unit: FloatArray = found / np.maximum(np.abs(found).max(), 1e-300)
    return unit
