"""The first triangle that a ray hits."""

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray

__all__ = ["first_hit"]


def first_hit(
    positions: FloatArray, triangles: IntArray, origin: FloatArray, direction: FloatArray
) -> tuple[int, FloatArray] | None:
    """Return the triangle that a ray hits first, from either side, and the point (Möller and Trumbore 1997).

    Parameters
    ----------
    positions, triangles
        (V, 3) and (T, 3), as in `upholster.geometry.meshes.triangle_mesh.TriangleMesh`.
    origin, direction
        (3,) finite; hits in the opposite direction do not count.

    Raises
    ------
    InputError
        If either is not three finite numbers.
    """
    for name, vector in (("origin", origin), ("direction", direction)):
        if vector.shape != (3,) or not np.isfinite(vector).all():
            raise InputError(f"{name} is {vector.tolist()}; allowed: three finite numbers")
    a, b, c = np.moveaxis(positions[triangles], 1, 0)
    across, down = b - a, c - a
    normal = np.cross(across, down)
    away = origin - a
    slope = -(normal @ direction)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (away * normal).sum(axis=1) / slope
        turned = np.cross(away, direction)
        u = (down * turned).sum(axis=1) / slope
        v = -(across * turned).sum(axis=1) / slope
        hit = (distance > 0) & (u >= 0) & (v >= 0) & (u + v <= 1)
    if not hit.any():
        return None
    nearest = int(np.argmin(np.where(hit, distance, np.inf)))
    return nearest, origin + distance[nearest] * direction
