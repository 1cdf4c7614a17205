"""Ear clipping of polygons."""

from numpy.typing import NDArray

from upholster.base.types import FloatArray, int64
from upholster.runtime.jit import inline, kernel

__all__ = ["cut_ears"]


@kernel
def cut_ears(points: FloatArray, links: NDArray[int64], triangles: NDArray[int64]) -> None:
    """Cut a counter-clockwise polygon (n, 2) into n - 2 triangles.

    If no ear is left because the polygon crosses itself, the next corner is cut off.

    Parameters
    ----------
    points
        (n, 2).
    links
        (2, n), working space: the corners before and after each.
    triangles
        (n - 2, 3), filled with numbers of corners.
    """
    n = len(points)
    before, after = links[0], links[1]
    for corner in range(n):
        before[corner] = (corner + n - 1) % n
        after[corner] = (corner + 1) % n
    left = n
    corner = 0
    missed = 0
    done = 0
    while left > 3:
        a, c = before[corner], after[corner]
        if missed < left and not _is_ear(points, after, a, corner, c):
            corner = c
            missed += 1
            continue
        triangles[done, 0] = a
        triangles[done, 1] = corner
        triangles[done, 2] = c
        done += 1
        after[a] = c
        before[c] = a
        corner = c
        left -= 1
        missed = 0
    triangles[done, 0] = before[corner]
    triangles[done, 1] = corner
    triangles[done, 2] = after[corner]


@inline
def _is_ear(points: FloatArray, after: NDArray[int64], a: int, b: int, c: int) -> bool:
    """Return whether triangle a, b, c is counter-clockwise and contains no other corner."""
    if _turn(points, a, b, c) <= 0.0:
        return False
    other = after[c]
    while other != a:
        if (
            _turn(points, a, b, other) >= 0.0
            and _turn(points, b, c, other) >= 0.0
            and _turn(points, c, a, other) >= 0.0
            and not _same(points, other, a)
            and not _same(points, other, b)
            and not _same(points, other, c)
        ):
            return False
        other = after[other]
    return True


@inline
def _turn(points: FloatArray, a: int, b: int, c: int) -> float:
    turn: float = (points[b, 0] - points[a, 0]) * (points[c, 1] - points[a, 1]) - (
        points[b, 1] - points[a, 1]
    ) * (points[c, 0] - points[a, 0])
    return turn


@inline
def _same(points: FloatArray, a: int, b: int) -> bool:
    same: bool = points[a, 0] == points[b, 0] and points[a, 1] == points[b, 1]
    return same
