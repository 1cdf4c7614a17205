"""Coarse versions of a mesh with few triangles: quadric edge collapse, by fast-simplification.

Edges that many triangles share, long slivers and gaps stop edge collapse. So vertices are merged on a grid
first, and the finest grid is taken that lets the mesh get small enough.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.geometry.meshes.triangle_mesh import welded

__all__ = ["simplified"]

_GRIDS = (4096, 256, 128, 64, 32, 16, 8)
"""Cells along the longest side of the mesh's box, to try from the first on."""

_FEWEST = 16


def simplified(
    positions: FloatArray, triangles: IntArray, bits: int, fits: Callable[[IntArray, IntArray], bool]
) -> tuple[IntArray, IntArray]:
    """Return a version of a mesh with as many triangles as fit.

    Parameters
    ----------
    positions, triangles
        (V, 3) within 0 to 1, and (T, 3).
    bits
        Bits of a coordinate of the result.
    fits
        Whether a version is small enough.

    Returns
    -------
    positions, triangles
        (W, 3) int32 from 0 to 2^bits − 1, and (U, 3) int32.
    """
    best = None
    for cells in _GRIDS:
        merged, kept = _merged(positions * cells, triangles)
        points = merged * (((1 << bits) - 1) / cells)
        if len(kept) < 1:
            break
        best = _collapsed(points, kept, bits, _FEWEST)
        if fits(*best):
            return _largest(points, kept, bits, fits)
    assert best is not None
    return best


def _largest(
    points: FloatArray, triangles: IntArray, bits: int, fits: Callable[[IntArray, IntArray], bool]
) -> tuple[IntArray, IntArray]:
    low, high = _FEWEST, len(triangles)
    best = _collapsed(points, triangles, bits, low)
    while high - low > max(1, low // 50):
        middle = (low + high) // 2
        found = _collapsed(points, triangles, bits, middle)
        if fits(*found):
            low, best = middle, found
        else:
            high = middle
    return best


def _collapsed(points: FloatArray, triangles: IntArray, bits: int, count: int) -> tuple[IntArray, IntArray]:
    # At most about `count` triangles, with whole coordinates.
    if count < len(triangles):
        import fast_simplification

        points, triangles = fast_simplification.simplify(points, triangles, target_count=count)
    return _merged(np.clip(points, 0, (1 << bits) - 1), triangles)


def _merged(points: NDArray[np.floating], triangles: IntArray) -> tuple[IntArray, IntArray]:
    # Vertices with the same whole coordinates merged; triangles of fewer than three vertices left out.
    merged, vertex = welded(np.rint(points))
    one, two, three = found = vertex[triangles].T
    kept = found.T[(one != two) & (two != three) & (three != one)]
    used, numbers = np.unique(kept, return_inverse=True)
    return merged[used].astype(np.int32), numbers.reshape(-1, 3).astype(np.int32)
