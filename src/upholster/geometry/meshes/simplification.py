"""Coarse versions of a mesh with few triangles: quadric edge collapse, by fast-simplification.

Slivers, edges that many triangles share and gaps stop edge collapse, and it removes small pieces first. So
vertices are merged on a grid before it; of several grids, the one is taken that leaves the smallest error.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.geometry.meshes.triangle_mesh import welded

__all__ = ["simplified"]

_GRIDS = (4096, 256, 128, 96, 64, 48, 32, 24, 16, 8)
"""Cells along the longest side of the mesh's box. Coarser ones are tried while the error falls."""

_FEWEST = 16

_SQUARES = 32
"""A result has at most 4^bits / this number of triangles: rounding makes folds of smaller ones visible."""

_POINTS, _POINTS_AT_ONCE = 256, 32

Number = TypeVar("Number", bound=np.generic)

Coarse = tuple[IntArray, IntArray]
"""Positions (V, 3) int32, from 0 to 2^bits − 1, and triangles (T, 3) int32."""

Fits = Callable[[IntArray, IntArray], bool]
"""Whether a coarse mesh is small enough."""


def simplified(corners: FloatArray, bits: int, fits: Fits) -> Coarse | None:
    """Return a coarse version of a mesh with as many triangles as fit; None if there is none.

    Parameters
    ----------
    corners
        (T, 3, 3) corners of its triangles, within 0 to 1.
    bits
        Bits of a coordinate of the result.
    fits
        Whether a result is small enough.
    """
    best: Coarse | None = None
    least = np.inf
    points, most = _points_on(corners), (1 << bits) - 1
    for cells in _GRIDS:
        grid_points, triangles = _merged(corners.reshape(-1, 3), cells)
        found = _largest(grid_points * most, triangles, most, fits)
        if found is None:
            continue
        error = float(_distances(points, found[0][found[1]] / most).mean())
        if error > least:
            break
        best, least = found, error
    return best


def _largest(points: FloatArray, triangles: IntArray, most: int, fits: Fits) -> Coarse | None:
    """Return the version with the most triangles that fits, about; None if none does."""
    low, high = _FEWEST, min(len(triangles), (most + 1) ** 2 // _SQUARES)
    best = _collapsed(points, triangles, low, most)
    if not len(best[1]) or not fits(*best):
        return None
    while high - low > max(1, low // 50):
        middle = (low + high) // 2
        found = _collapsed(points, triangles, middle, most)
        if fits(*found):
            low, best = middle, found
        else:
            high = middle
    return best


def _collapsed(points: FloatArray, triangles: IntArray, count: int, most: int) -> Coarse:
    """Return at most about `count` triangles, with whole coordinates."""
    if count < len(triangles):
        import fast_simplification

        points, triangles = fast_simplification.simplify(points, triangles, target_count=count)
    whole = np.rint(np.clip(points, 0, most))
    merged, vertex = welded(whole)
    return _without_degenerate(merged.astype(np.int32), vertex[triangles])


def _merged(points: FloatArray, cells: int) -> tuple[FloatArray, IntArray]:
    """Merge corners (3T, 3) in the same cell of a grid to their mean; return vertices and triangles."""
    _, vertex = welded(np.rint(points * cells))
    counts = np.bincount(vertex)
    means = np.stack([np.bincount(vertex, column) / counts for column in points.T], axis=1)
    return _without_degenerate(means, vertex.reshape(-1, 3))


def _without_degenerate(points: NDArray[Number], triangles: IntArray) -> tuple[NDArray[Number], IntArray]:
    one, two, three = triangles.T
    kept = triangles[(one != two) & (two != three) & (three != one)]
    used, numbers = np.unique(kept, return_inverse=True)
    return points[used], numbers.reshape(-1, 3).astype(np.int32)


def _points_on(corners: FloatArray) -> FloatArray:
    """Return random points on triangles (T, 3, 3), evenly by area: (_POINTS, 3)."""
    rng = np.random.default_rng(0)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    share = areas / areas.sum() if areas.sum() > 0 else None
    chosen = corners[rng.choice(len(corners), _POINTS, p=share)]
    root, along = np.sqrt(rng.random((_POINTS, 1))), rng.random((_POINTS, 1))
    found: FloatArray = chosen[:, 0] + root * (
        chosen[:, 1] - chosen[:, 0] + along * (chosen[:, 2] - chosen[:, 1])
    )
    return found


def _distances(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the distance from each of some points (n, 3) to the nearest of triangles (T, 3, 3)."""
    parts = np.split(points, range(_POINTS_AT_ONCE, len(points), _POINTS_AT_ONCE))
    return np.concatenate([np.sqrt(_squares(part[:, None], corners).min(axis=1)) for part in parts])


def _squares(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Return squared distances from points (n, 1, 3) to triangles (T, 3, 3), (n, T)."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    heights = ((points - corners[:, 0]) * normals).sum(axis=2)
    is_inside = normals.any(axis=1)
    squares = np.full(heights.shape, np.inf)
    for start, end in pairwise((0, 1, 2, 0)):
        edge, offset = corners[:, end] - corners[:, start], points - corners[:, start]
        is_inside = is_inside & ((np.cross(normals, edge) * offset).sum(axis=2) >= 0)
        along = (offset * edge).sum(axis=2) / np.maximum((edge * edge).sum(axis=1), 1e-300)
        away = offset - np.clip(along, 0, 1)[..., None] * edge
        squares = np.minimum(squares, (away * away).sum(axis=2))
    found: FloatArray = np.where(is_inside, heights * heights, squares)
    return found
