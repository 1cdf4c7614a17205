"""Directions from an image on triangles, by their texture coordinates."""

from dataclasses import replace

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.charts.directions.direction import Direction
from upholster.geometry.meshes.triangle_mesh import TriangleMesh

__all__ = ["vectors_on_coordinates"]


def vectors_on_coordinates(
    mesh: TriangleMesh, direction: Direction, uv: FloatArray | None = None
) -> Direction:
    """Convert a direction from an image to vectors at the triangles' corners; return others unchanged.

    Parameters
    ----------
    mesh, direction
        The triangles, and any direction.
    uv
        (T, 3, 2) texture coordinates of the triangles' corners, v downward; by default the mesh's own.

    Raises
    ------
    InputError
        If there are no texture coordinates.
    """
    if direction.image is None:
        return direction
    uv = mesh.uv if uv is None else uv
    if uv is None:
        raise InputError(
            f"direction {direction.text!r} is an image, and the model has no texture coordinates; "
            "allowed: on models that have some, and on patches"
        )
    right, up = _tangents(mesh, uv)
    asked = direction.image.at(uv)
    vectors = asked[..., :1] * right[:, None] + asked[..., 1:] * up[:, None]
    return replace(direction, kind="vectors", vectors=vectors, image=None, weighted=True)


def _tangents(mesh: TriangleMesh, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return unit vectors in triangles' planes, (T, 3) each: along u, and at right angles to it, against v.

    Both are 0 where the coordinates are degenerate. If a texture is mirrored, upward is to the right of u.
    """
    edges, flat = mesh.corners[:, 1:] - mesh.corners[:, :1], uv[:, 1:] - uv[:, :1]
    area = flat[:, 0, 0] * flat[:, 1, 1] - flat[:, 0, 1] * flat[:, 1, 0]
    # The derivative by u, times the area: its length does not count.
    right = flat[:, 1, 1:] * edges[:, 0] - flat[:, 0, 1:] * edges[:, 1]
    right *= np.sign(area)[:, None]
    length = np.sqrt((right**2).sum(axis=1, keepdims=True))
    right = np.where(length > 0, right / np.where(length > 0, length, 1.0), 0.0)
    up: FloatArray = np.cross(mesh.flat_normals, right) * -np.sign(area)[:, None]
    return right, up
