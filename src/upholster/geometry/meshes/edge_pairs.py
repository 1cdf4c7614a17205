"""Pairing triangles across the edges of a mesh, also where several share an edge."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.base.vectors import unit_vectors
from upholster.geometry.meshes._edge_kernels import EdgeScratch, mark_seams, number_edges, pair_sides

__all__ = ["edge_pairs", "numbered_edges", "seams_of"]

_MOST = 64
"""Greatest number of triangles at an edge that are paired; more do not form a surface and would take long."""

_STEP = 1e-6
"""Radians: bends that differ by less count as equal."""

_TURN = 2 * np.pi


def edge_pairs(positions: FloatArray, triangles: IntArray) -> IntArray:
    """Return the neighbour across each triangle's edges, (T, 3) int32: triangle · 3 + its edge, or −1.

    Edge k runs from corner k to corner (k + 1) mod 3. The neighbour has the same edge in the opposite
    direction. Where three or more triangles share an edge, the two most nearly coplanar ones are paired
    first, so that a surface continues through another one that meets it there. Of two pairs that bend alike,
    the one that bends outward is chosen, which stays on its own solid. Triangles left over have a border
    there. Triangles that name a vertex twice are ignored.

    Parameters
    ----------
    positions
        (V, 3).
    triangles
        (T, 3).
    """
    start, stop = triangles, np.roll(triangles, -1, axis=1)
    # Triangles collapsed to a line or a point separate nothing.
    sound = ~(start == stop).any(axis=1, keepdims=True)
    first, last = np.where(sound, start, -1).astype(np.int32).ravel(), stop.astype(np.int32).ravel()
    numbers, examples = numbered_edges(first, last, len(positions))
    counts, out = np.empty(len(examples), np.int32), np.empty(len(first), np.int32)
    if pair_sides(numbers, first, last, np.empty((len(examples), 2), np.int32), counts, out) > 2:
        for a, b in _crowded(positions, triangles, numbers, counts, first < last):
            out[a], out[b] = b, a
    return out.reshape(-1, 3)


def numbered_edges(first: IntArray, last: IntArray, vertices: int) -> tuple[IntArray, IntArray]:
    """Assign one number to all edges between the same two vertices.

    Parameters
    ----------
    first, last
        (E,) int32, the vertices at their ends; −1 in `first` marks an edge to ignore.
    vertices
        Number of vertices.

    Returns
    -------
    numbers
        (E,) int32: 0 to n − 1, −1 for ignored edges.
    examples
        (n,) int32: the first edge of each number.
    """
    numbers, examples = np.empty(len(first), np.int32), np.empty(len(first), np.int32)
    count = number_edges(first, last, EdgeScratch.of(len(first), vertices), numbers, examples)
    return numbers, examples[:count]


def seams_of(across: IntArray, places: FloatArray, part: IntArray) -> NDArray[np.bool_]:
    """Return the edges of triangles, (T, 3), whose neighbour is at another place in the plane.

    Parameters
    ----------
    across
        (T, 3) the neighbours across edges, from `edge_pairs`.
    places
        (T, 3, 2) of corners in the plane.
    part
        (T,) the plane of each triangle, −1 for none: its edges are not seams.
    """
    seams = np.empty(across.shape, np.bool_)
    mark_seams(across.copy(), places.copy(), part.copy(), seams)  # some are read-only, some are not
    return seams


def _crowded(
    positions: FloatArray,
    triangles: IntArray,
    numbers: IntArray,
    counts: IntArray,
    rising: NDArray[np.bool_],
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    # Pairs of sides, by number, at edges that have more than two sides.
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
    # A rising side has its inside at smaller angles, a falling one at greater: from the former to the latter,
    # through the solid, is half a turn where both are in a plane.
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
    """Return the angles (E, n), in radians, of triangles around their edges, seen along the edges."""
    triangle, edge = sides // 3, sides % 3
    corners = [triangles[triangle, (edge + k) % 3] for k in range(3)]
    low, high = (np.where(rising, corners[k], corners[1 - k])[:, :1] for k in (0, 1))
    axis = unit_vectors(positions[high] - positions[low])
    least = np.eye(3)[np.abs(axis[:, 0]).argmin(axis=1)]
    right = unit_vectors(np.cross(axis[:, 0], least))
    up = np.cross(axis[:, 0], right)
    away = positions[corners[2]] - positions[low]
    across = np.einsum("eni,ei->en", away, right)
    found: FloatArray = np.arctan2(np.einsum("eni,ei->en", away, up), across)
    return found
