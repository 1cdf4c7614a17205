"""Where a surface that was moved folds over: its triangles turn away from where they faced before."""

import numpy as np
from numpy.typing import NDArray

from upholster.types import FloatArray, IntArray

__all__ = ["crossed", "folds", "held_back", "vertex_normals"]

_ROUNDS = 24


def crossed(positions: FloatArray, triangles: IntArray) -> FloatArray:
    """Return normals of triangles, (T, 3), as long as twice their area."""
    a, b, c = positions[triangles].transpose(1, 0, 2)
    return np.asarray(np.cross(b - a, c - a))


def vertex_normals(positions: FloatArray, triangles: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return unit normals of vertices, (V, 3), means over triangles by area; and how well these agree, (V,).

    They agree by 1 where the surface is flat, by less at an edge. Where there is no area both are zero.
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
    """Tell which triangles face away from where their vertices' normals, (V, 3), pointed before."""
    return np.asarray((crossed(positions, triangles) * normals[triangles].sum(axis=1)).sum(axis=1) < 0)


def held_back(
    positions: FloatArray, before: FloatArray, triangles: IntArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Take vertices back toward where they were, until no triangle folds over, or little can be done.

    In a concave corner both sides move toward each other, and through each other where they are nearer than
    they move. There vertices go only part of their way: halves of it for a fold's own vertices, three
    quarters for those next to them, again and again.

    Parameters
    ----------
    positions, before
        (V, 3): where vertices are, and were.
    triangles
        (T, 3).

    Returns
    -------
    positions
        (V, 3): where they are to be.
    held
        (V,): which were taken back.
    """
    normals, _ = vertex_normals(before, triangles)
    share = np.ones(len(positions))
    out = positions.copy()
    near = triangles  # triangles that may fold
    for _ in range(_ROUNDS):
        folded = near[folds(out, near, normals)]
        if not len(folded):
            break
        own, beside = (np.zeros(len(positions), np.bool_) for _ in range(2))
        own[folded] = True
        beside[triangles[own[triangles].any(axis=1)]] = True
        share[own] *= 0.5
        share[beside & ~own] *= 0.75
        out[beside] = before[beside] + share[beside, None] * (positions[beside] - before[beside])
        near = triangles[beside[triangles].any(axis=1)]
    return out, share < 1
