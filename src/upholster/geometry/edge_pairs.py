"""Which triangles go on from each other over the edges of a mesh, also where several share an edge."""

import numpy as np
from numpy.typing import NDArray

from upholster.types import FloatArray, IntArray

__all__ = ["edge_pairs"]

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
    first = triangles.astype(np.int64)
    last = np.roll(first, -1, axis=1)
    low, high = np.minimum(first, last).ravel(), np.maximum(first, last).ravel()
    keys = low * len(positions) + high
    keys[np.repeat((first == last).any(axis=1), 3)] = -1  # a line or a point parts nothing
    order = np.argsort(keys, kind="stable")
    ranked = keys[order]
    starts = np.flatnonzero(np.concatenate([[True], ranked[1:] != ranked[:-1]]))
    counts = np.diff(np.concatenate([starts, [len(ranked)]]))
    counts[ranked[starts] < 0] = 0
    rising = (first < last).ravel()
    a, b = order[starts[counts == 2]], order[starts[counts == 2] + 1]
    pairs = [np.stack([a, b], axis=1)[rising[a] != rising[b]]]
    for count in np.unique(counts[(counts > 2) & (counts <= _MOST)]).tolist():
        sides = order[starts[counts == count][:, None] + np.arange(count)]
        pairs.append(_paired(positions, triangles, sides, rising[sides]))
    a, b = np.concatenate(pairs).T
    out = np.full(3 * len(triangles), -1, np.int32)
    out[a], out[b] = b, a
    return out.reshape(-1, 3)


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
