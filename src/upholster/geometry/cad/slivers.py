"""Removing slivers from a face's triangles where possible.

A mesher that halves long triangles along a straight edge again and again leaves some whose height is a
thousandth of their length. Anything computed from such a triangle, its normal or a texture's map, is random.
"""

import numpy as np

from upholster.base.types import FloatArray, IntArray
from upholster.geometry.cad._sliver_kernels import MOST_ROUND, Corners, flip_slivers, remove_slivers
from upholster.geometry.meshes.edge_pairs import edge_pairs

__all__ = ["without_slivers"]

_LEAST = 0.1
"""Height over longest edge below which a triangle is repaired."""

_FEW = 0.02
"""Faces whose triangles are all higher than this are left as they are."""

_ROUNDS = 30


def without_slivers(
    positions: FloatArray, normals: FloatArray, uv: FloatArray, triangles: IntArray, deviation: float
) -> IntArray:
    """Return a face's triangles with edges flipped and inner vertices removed, so that few slivers remain.

    The face's border does not change.

    Parameters
    ----------
    positions, normals, uv
        (n, 3), (n, 3) and (n, 2): vertices, the face's unit normals there, and their parameters.
    triangles
        (t, 3) indices into these; they cover the face once in its parameters.
    deviation
        Greatest distance of the result from what it replaces, in units of the positions.
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
