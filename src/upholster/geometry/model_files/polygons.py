"""Cutting quadrilaterals and polygons into triangles, including concave ones."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.geometry.model_files._polygon_kernels import cut_ears

__all__ = ["MAX_CORNERS", "cut_polygons"]

MAX_CORNERS = 4096
"""Greatest number of corners of a polygon."""


def cut_polygons(positions: FloatArray, corners: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cut polygons with the same number of corners into triangles.

    Parameters
    ----------
    positions
        (V, 3).
    corners
        (P, n) vertices of each, n ≥ 3.

    Returns
    -------
    ndarray
        (P, n - 2, 3) int64: the corners of each triangle, 0 to n - 1. A convex polygon becomes a fan. A
        quadrilateral is cut so that both halves face its side. Other polygons are cut by ear clipping.

    References
    ----------
    G. H. Meisters: Polygons have ears, American Mathematical Monthly 82, 1975.
    """
    count, sides = corners.shape
    n = np.arange(sides - 2)
    fan = np.stack([np.zeros_like(n), n + 1, n + 2], axis=1)
    out = np.repeat(fan[None], count, axis=0)
    if sides == 3:
        return out
    points = positions[corners]
    _cut_concave(points, out)
    return out


def _cut_concave(points: FloatArray, out: NDArray[np.int64]) -> None:
    """Cut polygons that are not valid as fans in another way."""
    fan = out[0].copy()
    normals = _newell(points)
    concave = np.flatnonzero(~_all_face(points, fan, normals))
    if points.shape[1] == 4:
        other = np.array([(1, 2, 3), (1, 3, 0)])
        better = _all_face(points[concave], other, normals[concave])
        out[concave[better]] = other
    else:
        for polygon in concave:
            out[polygon] = _ears(points[polygon], normals[polygon])


def _newell(points: FloatArray) -> FloatArray:
    """Return normals of polygons (P, n, 3), twice as long as their area."""
    moved = points - points[:, :1]
    total: FloatArray = np.cross(moved, np.roll(moved, -1, axis=1)).sum(axis=1)
    return total


def _all_face(points: FloatArray, triangles: NDArray[np.int64], normals: FloatArray) -> NDArray[np.bool_]:
    """Return which polygons have no triangle with a reversed normal."""
    a, b, c = (points[:, triangles[:, k]] for k in range(3))
    against = (np.cross(b - a, c - a) * normals[:, None]).sum(axis=2)
    result: NDArray[np.bool_] = (against >= 0).all(axis=1)
    return result


def _ears(points: FloatArray, normal: FloatArray) -> NDArray[np.int64]:
    """Cut one polygon by ear clipping, projected along its normal."""
    drop = int(np.abs(normal).argmax())
    kept: Sequence[int] = [(drop + 1) % 3, (drop + 2) % 3]
    flat = np.ascontiguousarray(points[:, kept])
    if normal[drop] < 0:
        flat[:, 0] *= -1.0
    triangles = np.empty((len(points) - 2, 3), np.int64)
    cut_ears(flat, np.empty((2, len(points)), np.int64), triangles)
    return triangles
