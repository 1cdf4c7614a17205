"""Which triangles go on from each other over the edges of a mesh, also where several share an edge."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from upholster.geometry._edge_kernels import EdgeScratch, mark_seams, number_edges, pair_sides
from upholster.types import FloatArray, IntArray

__all__ = ["edge_pairs", "numbered_edges", "seams_of"]

_MOST = 64
"""Triangles at one edge up to which they are paired; more are no surface, and would take long."""

_STEP = 1e-6
"""Radians: bends that differ by less count as equal."""

_TURN = 2 * np.pi


def edge_pairs(positions: FloatArray, triangles: IntArray) -> IntArray:
    """Return what lies across each triangle's edges, (T, 3) int32: triangle · 3 + its edge, or −1.

    Edge k runs from corner k to corner (k + 1) mod 3. Across is a triangle that has the same edge the other
    way round. Where an edge has three triangles or more, those two are paired first that lie most nearly in
    one plane, so that a surface goes through another one that meets it there; of two pairs that bend alike
    the one that bends outward, which stays on its own solid. What is left over lies at a border there.
    Triangles that name a vertex twice count as if they were not there.

    Parameters
    ----------
    positions
        (V, 3).
    triangles
        (T, 3).
    """
    start, stop = triangles, np.roll(triangles, -1, axis=1)
    # A line or a point parts nothing.
    sound = ~(start == stop).any(axis=1, keepdims=True)
    first, last = np.where(sound, start, -1).astype(np.int32).ravel(), stop.astype(np.int32).ravel()
    numbers, examples = numbered_edges(first, last, len(positions))
    counts, out = np.empty(len(examples), np.int32), np.empty(len(first), np.int32)
    if pair_sides(numbers, first, last, np.empty((len(examples), 2), np.int32), counts, out) > 2:
        for a, b in _crowded(positions, triangles, numbers, counts, first < last):
            out[a], out[b] = b, a
    return out.reshape(-1, 3)


def numbered_edges(first: IntArray, last: IntArray, vertices: int) -> tuple[IntArray, IntArray]:
    """Give edges between the same two vertices one number.

    Parameters
    ----------
    first, last
        (E,) int32, the vertices at their ends; −1 for `first`: an edge that does not count.
    vertices
        How many there are.

    Returns
    -------
    numbers
        (E,) int32: 0 to n − 1, −1 for those that do not count.
    examples
        (n,) int32: the first edge of each number.
    """
    numbers, examples = np.empty(len(first), np.int32), np.empty(len(first), np.int32)
    count = number_edges(first, last, EdgeScratch.of(len(first), vertices), numbers, examples)
    return numbers, examples[:count]


def seams_of(across: IntArray, places: FloatArray, part: IntArray) -> NDArray[np.bool_]:
    """Return over which edges of triangles, (T, 3), something lies that is at another place in the plane.

    Parameters
    ----------
    across
        (T, 3) what lies across edges, as `edge_pairs` tells it.
    places
        (T, 3, 2) of corners in the plane.
    part
        (T,) which plane each triangle lies in, −1 for none: at its edges is no seam.
    """
    seams = np.empty(across.shape, np.bool_)
    mark_seams(across.copy(), places.copy(), part.copy(), seams)  # some can not be written to, some can
    return seams


def _crowded(
    positions: FloatArray,
    triangles: IntArray,
    numbers: IntArray,
    counts: IntArray,
    rising: NDArray[np.bool_],
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    # Pairs of sides of edges, by number, that have more than two.
    some = np.flatnonzero(np.append(counts, 0)[numbers] > 2)
    order = some[np.argsort(numbers[some], kind="stable")]
    starts = np.flatnonzero(np.diff(numbers[order], prepend=-1))
    sizes = counts[numbers[order[starts]]]
    for count in np.unique(sizes[sizes <= _MOST]).tolist():
        sides = order[starts[sizes == count][:, None] + np.arange(count)]
        a, b = _paired(positions, triangles, sides, rising[sides]).T
        yield a, b


def _paired(
    positions: FloatArray, triangles: IntArray, sides: NDArray[np.int64], rising: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Return pairs (P, 2) of the sides (E, n) of E edges that n triangles share each: the flattest first."""
    count = sides.shape[1]
    angle = _angles(positions, triangles, sides, rising)
    # A rising side has its inside at smaller angles, a falling one at greater: from this to that through the
    # solid is half a turn where both lie in a plane.
    inside = (angle[:, :, None] - angle[:, None, :]) % _TURN
    bend = np.rint(np.abs(inside - np.pi) / _STEP) + np.where(inside < np.pi, 0.0, 0.5)
    bend[~(rising[:, :, None] & ~rising[:, None, :])] = np.inf
    out = []
    for _ in range(count // 2):
        best = bend.reshape(len(sides), -1).argmin(axis=1)
        edge = np.arange(len(sides))
        up, down = best // count, best % count
        found = np.isfinite(bend[edge, up, down])
        edge, up, down = edge[found], up[found], down[found]
        out.append(np.stack([sides[edge, up], sides[edge, down]], axis=1))
        bend[edge, up], bend[edge, :, down] = np.inf, np.inf
    return np.concatenate(out)


def _angles(
    positions: FloatArray, triangles: IntArray, sides: NDArray[np.int64], rising: NDArray[np.bool_]
) -> FloatArray:
    """Return the angles (E, n), in radians, at which triangles stand round their edges, seen along them."""
    triangle, edge = sides // 3, sides % 3
    corners = [triangles[triangle, (edge + k) % 3] for k in range(3)]
    low, high = (np.where(rising, corners[k], corners[1 - k])[:, :1] for k in (0, 1))
    axis = positions[high] - positions[low]
    axis = axis / np.maximum(np.linalg.norm(axis, axis=2, keepdims=True), 1e-300)
    least = np.eye(3)[np.abs(axis[:, 0]).argmin(axis=1)]
    right = np.cross(axis[:, 0], least)
    right /= np.maximum(np.linalg.norm(right, axis=1, keepdims=True), 1e-300)
    up = np.cross(axis[:, 0], right)
    away = positions[corners[2]] - positions[low]
    across = np.einsum("eni,ei->en", away, right)
    found: FloatArray = np.arctan2(np.einsum("eni,ei->en", away, up), across)
    return found
