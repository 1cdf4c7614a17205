"""Cutting triangles at the middles of their long edges."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.runtime.jit import inline, kernel

__all__ = ["PARTS", "Pieces", "count_parts", "cut_triangles", "measure_lengths", "order_pieces"]

PARTS = 23
"""Kinds of parts that triangles are cut into, in the order in which parts are listed: see `cut_triangles`."""

_WHOLE, _ONE, _TWO, _NARROW, _THREE = range(5)
"""How a triangle is cut: not at all; at one edge; at two, the third one short or not; at three."""


class Pieces(NamedTuple):
    """Triangles (k = 3) or strips (k = 4), cut out of triangles.

    A strip has long sides from corner 0 to 1 and from 2 to 3, and short ends. `vertices` (N, k); `values`
    (N, k, 5) are parameters and vectors at the corners; `parent` (N,) is the triangle each was cut from.
    """

    vertices: IntArray
    values: FloatArray
    parent: IntArray

    @classmethod
    def of(cls, count: int, corners: int) -> "Pieces":
        """Return uninitialized room for this many pieces."""
        return cls(
            np.empty((count, corners), np.int32), np.empty((count, corners, 5)), np.empty(count, np.int32)
        )


@kernel
def measure_lengths(vertices: IntArray, positions: FloatArray, lengths: FloatArray) -> None:
    """Write the lengths of pieces' edges (N, k), each from a corner to the next one."""
    corners = vertices.shape[1]
    for n in range(vertices.shape[0]):
        for k in range(corners):
            a, b = vertices[n, k], vertices[n, k + 1 if k + 1 < corners else 0]
            x, y = positions[b, 0] - positions[a, 0], positions[b, 1] - positions[a, 1]
            z = positions[b, 2] - positions[a, 2]
            lengths[n, k] = np.sqrt(x * x + y * y + z * z)


@inline
def _pattern(middles: IntArray, lengths: FloatArray, narrow: float, n: int) -> tuple[Any, Any]:
    # How a triangle is cut, and by how many corners the pattern is turned.
    a, b, c = middles[n, 0] >= 0, middles[n, 1] >= 0, middles[n, 2] >= 0
    cut = int64(a) + int64(b) + int64(c)
    if cut == 0:
        return int64(_WHOLE), int64(0)
    if cut == 3:
        return int64(_THREE), int64(0)
    if cut == 1:
        return int64(_ONE), int64(0 if a else 1 if b else 2)
    left = 0 if not a else 1 if not b else 2
    return int64(_NARROW if lengths[n, left] < narrow else _TWO), int64((left + 1) % 3)


@inline
def _first_part(pattern: int, turn: int) -> Any:
    # The number of the first part that a pattern makes.
    if pattern == _WHOLE:
        return int64(0)
    if pattern == _THREE:
        return int64(19)
    return 1 + 6 * turn + (0 if pattern == _ONE else 2 if pattern == _TWO else 5)


@kernel
def count_parts(
    middles: IntArray,
    lengths: FloatArray,
    narrow: float,
    counts: NDArray[np.int64],
    strips: NDArray[np.int64],
) -> None:
    """Count the triangles of each kind of part, (`PARTS`,), and the strips (3,)."""
    counts[:], strips[:] = 0, 0
    for n in range(middles.shape[0]):
        pattern, turn = _pattern(middles, lengths, narrow, n)
        first = _first_part(pattern, turn)
        size = pattern + 1 if pattern in (_ONE, _TWO) else 4 if pattern == _THREE else 1
        for k in range(size):
            counts[first + k] += 1
        if pattern == _NARROW:
            strips[turn] += 1


@inline
def _enter_middle(
    pieces: Pieces, middles: IntArray, n: int, k: int, vertices: IntArray, values: FloatArray
) -> None:
    # Enters the midpoint of edge k after the corners.
    last = (k + 1) % 3
    a, b, out = pieces.values[n, k], pieces.values[n, last], values[3 + k]
    vertices[3 + k] = middles[n, k]
    for m in range(5):
        out[m] = 0.5 * (a[m] + b[m])
    # Normalized; where the ends' vectors cancel, the vector at the edge's start.
    length = np.sqrt(out[2] * out[2] + out[3] * out[3] + out[4] * out[4])
    for m in range(2, 5):
        out[m] = out[m] / length if length > 1e-3 else a[m]


@inline
def _put(
    out: Pieces,
    places: NDArray[np.int64],
    part: int,
    parent: int,
    corners: tuple[int, int, int],
    vertices: IntArray,
    values: FloatArray,
) -> None:
    at = places[part]
    places[part] += 1
    out.parent[at] = parent
    for k in range(3):
        out.vertices[at, k] = vertices[corners[k]]
        for m in range(5):
            out.values[at, k, m] = values[corners[k], m]


@kernel
def cut_triangles(
    pieces: Pieces,
    middles: IntArray,
    lengths: FloatArray,
    narrow: float,
    places: NDArray[np.int64],
    strip_places: NDArray[np.int64],
    out: Pieces,
    strips: Pieces,
    room: Pieces,
) -> None:
    """Cut triangles at the midpoints of one, two or three edges.

    A triangle with two cut edges and a short third one leaves a strip. `middles` (N, 3) are the vertices at
    the midpoints, −1 where an edge is not cut. `lengths` (N, 3) are the edges' lengths; edges up to `narrow`
    are short. `places` (`PARTS`,) and `strip_places` (3,) give the position of each part's first piece in
    `out` and `strips`, see `count_parts`; they are incremented. `room` has space for one piece of six
    corners.
    """
    vertices, values = room.vertices[0], room.values[0]
    for n in range(middles.shape[0]):
        pattern, turn = _pattern(middles, lengths, narrow, n)
        part, parent = _first_part(pattern, turn), pieces.parent[n]
        for k in range(3):
            vertices[k] = pieces.vertices[n, k]
            for m in range(5):
                values[k, m] = pieces.values[n, k, m]
        for k in range(3):
            if middles[n, k] >= 0:
                _enter_middle(pieces, middles, n, k, vertices, values)
        a, b, c = turn, (turn + 1) % 3, (turn + 2) % 3
        ab, bc = 3 + a, 3 + b
        if pattern == _WHOLE:
            _put(out, places, part, parent, (a, b, c), vertices, values)
        elif pattern == _ONE:
            _put(out, places, part, parent, (a, ab, c), vertices, values)
            _put(out, places, part + 1, parent, (ab, b, c), vertices, values)
        elif pattern == _TWO:
            _put(out, places, part, parent, (ab, b, bc), vertices, values)
            _put(out, places, part + 1, parent, (a, ab, bc), vertices, values)
            _put(out, places, part + 2, parent, (a, bc, c), vertices, values)
        elif pattern == _NARROW:
            _put(out, places, part, parent, (ab, b, bc), vertices, values)
            at = strip_places[turn]
            _put(strips, strip_places, turn, parent, (a, ab, bc), vertices, values)
            strips.vertices[at, 3] = vertices[c]
            for m in range(5):
                strips.values[at, 3, m] = values[c, m]
        else:
            _put(out, places, part, parent, (0, 3, 5), vertices, values)
            _put(out, places, part + 1, parent, (3, 1, 4), vertices, values)
            _put(out, places, part + 2, parent, (5, 4, 2), vertices, values)
            _put(out, places, part + 3, parent, (3, 4, 5), vertices, values)


@kernel
def order_pieces(
    one: Pieces,
    other: Pieces,
    firsts: NDArray[np.int64],
    vertices: IntArray,
    parent: IntArray,
    places: FloatArray,
    vectors: FloatArray,
) -> None:
    """Merge two lists of triangles in the order of their parents; each list keeps its order within a parent.

    `vertices` (N, 3) and `parent` (N,) receive theirs, `places` (N, 3, 2) the first two of their values, and
    `vectors` (N, 3, 3) the other three; `firsts` (parents + 1,) receives where each parent's triangles begin.
    """
    firsts[:] = 0
    for t in range(len(one.parent)):
        firsts[one.parent[t]] += 1
    for t in range(len(other.parent)):
        firsts[other.parent[t]] += 1
    total = int64(0)
    for n in range(len(firsts)):
        total += firsts[n]
        firsts[n] = total  # where they end: the list is filled backwards
    for m in range(len(one.parent) + len(other.parent) - 1, -1, -1):
        t = m - len(one.parent)
        pieces = other
        if t < 0:
            t, pieces = m, one
        n = pieces.parent[t]
        firsts[n] -= 1
        at = firsts[n]
        parent[at] = n
        for k in range(3):
            vertices[at, k] = pieces.vertices[t, k]
            places[at, k, 0], places[at, k, 1] = pieces.values[t, k, 0], pieces.values[t, k, 1]
            for axis in range(3):
                vectors[at, k, axis] = pieces.values[t, k, 2 + axis]
