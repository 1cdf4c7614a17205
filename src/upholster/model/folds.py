"""Finding and undoing folds of a moved surface: triangles that face away from their original normals."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray

__all__ = ["crossed", "folds", "held_back", "vertex_normals"]

_ROUNDS = 24


def crossed(positions: FloatArray, triangles: IntArray) -> FloatArray:
    """Return normals of triangles, (T, 3), with twice their area as length."""
    a, b, c = positions[triangles].transpose(1, 0, 2)
    return np.asarray(np.cross(b - a, c - a))


def vertex_normals(positions: FloatArray, triangles: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return unit normals of vertices, (V, 3), area-weighted means over triangles; and their agreement, (V,).

    The agreement is 1 where the surface is flat, and less at an edge. Without area both are zero.
    """
    own = crossed(positions, triangles)
    corners = triangles.ravel()
    sums = np.stack(
        [np.bincount(corners, np.repeat(own[:, axis], 3), len(positions)) for axis in range(3)], axis=1
    )
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    area = np.bincount(corners, np.repeat(np.linalg.norm(own, axis=1), 3), len(positions))
    evenness = np.divide(length[:, 0], area, out=np.zeros(len(positions)), where=area > 0)
    return np.divide(sums, length, out=sums, where=length > 0), evenness


def folds(positions: FloatArray, triangles: IntArray, normals: FloatArray) -> NDArray[np.bool_]:
    """Return which triangles face away from the original normals of their vertices, (V, 3)."""
    return np.asarray((crossed(positions, triangles) * normals[triangles].sum(axis=1)).sum(axis=1) < 0)


def held_back(
    positions: FloatArray, before: FloatArray, triangles: IntArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Move vertices back toward their original positions until no triangle folds over, as far as possible.

    In a concave corner both sides move toward each other, and through each other where the gap is smaller
    than the displacement. There vertices move only part of their way. In each round, a fold's own vertices
    keep half of it, those next to them three quarters.

    Parameters
    ----------
    positions, before
        (V, 3): the vertices' present and original positions.
    triangles
        (T, 3).

    Returns
    -------
    positions
        (V, 3): the vertices' new positions.
    held
        (V,): which vertices were moved back.
    """
    normals, _ = vertex_normals(before, triangles)
    share = np.ones(len(positions))
    out = positions.copy()
    near = triangles  # triangles that may fold
    for _ in range(_ROUNDS):
        folded = near[folds(out, near, normals)]
        if not len(folded):
            break
        own, around = (np.zeros(len(positions), np.bool_) for _ in range(2))
        own[folded] = True
        around[triangles[own[triangles].any(axis=1)]] = True
        share[own] *= 0.5
        share[around & ~own] *= 0.75
        out[around] = before[around] + share[around, None] * (positions[around] - before[around])
        near = triangles[around[triangles].any(axis=1)]
    return out, share < 1
