"""Triangles of a face without slivers, where they can be avoided.

A mesher that halves long triangles beside a straight edge again and again leaves some that are a thousandth
as high as they are long. What is asked of such a triangle, its normal or how a texture lies on it, is chance.
"""

import numpy as np

from upholster.geometry.cad._sliver_kernels import MOST_ROUND, Corners, flip_slivers, remove_slivers
from upholster.geometry.edge_pairs import edge_pairs
from upholster.types import FloatArray, IntArray

__all__ = ["without_slivers"]

_LEAST = 0.1
"""Height over longest edge, below which a triangle is mended."""

_FEW = 0.02
"""Faces whose triangles are all higher than that stay as they are."""

_ROUNDS = 30


def without_slivers(
    positions: FloatArray, normals: FloatArray, uv: FloatArray, triangles: IntArray, deviation: float
) -> IntArray:
    """Return a face's triangles with edges turned and vertices inside left out, so that few are slivers.

    Its border stays as it is.

    Parameters
    ----------
    positions, normals, uv
        (n, 3), (n, 3) and (n, 2): vertices, the face's unit normals there, and their parameters.
    triangles
        (t, 3) into these; they cover the face in its parameters once.
    deviation
        How far the result may lie from what it replaces, in units of the positions.
    """
    out = np.ascontiguousarray(triangles, np.int32)
    if _heights(positions, out).min(initial=1.0) >= _FEW:
        return out
    corners = Corners(*(np.ascontiguousarray(array, np.float64) for array in (positions, normals, uv)))
    out, ring = out.copy(), np.empty((6, MOST_ROUND), np.int32)
    for _ in range(_ROUNDS):
        neighbours, changed = edge_pairs(positions, out), np.zeros(len(out), np.bool_)
        done = flip_slivers(corners, out, neighbours, _LEAST, deviation, changed)
        done += remove_slivers(corners, out, neighbours, _LEAST, deviation, changed, ring)
        if not done:
            break
        out = np.ascontiguousarray(out[out[:, 0] >= 0])
    return out


def _heights(positions: FloatArray, triangles: IntArray) -> FloatArray:
    corners = positions[triangles]
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    return np.asarray(doubled / np.maximum(longest, 1e-300) ** 2, np.float64)
