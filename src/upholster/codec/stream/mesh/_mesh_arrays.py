"""Data of the kernels of a mesh's code: the coded part of the mesh, and an encoder's mesh."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "BORDER",
    "LACKING",
    "LAST_ISLAND",
    "LAST_PART",
    "MOST_PARAMETER",
    "OPEN",
    "STACKED",
    "STATUS",
    "TRIANGLES",
    "VERTICES",
    "WRONG",
    "CodedMesh",
    "Origin",
]

LACKING, WRONG = -1, -2
"""Bytes are missing; a number is not allowed."""

MOST_PARAMETER = 2**28
"""Largest magnitude of a parameter, in steps."""

STATUS, TRIANGLES, VERTICES, STACKED, LAST_ISLAND, LAST_PART = range(6)
"""Places in `CodedMesh.counts`: 0, or `LACKING` or `WRONG`; numbers of coded elements; edges on the stack;
the island and the part that were coded last."""

OPEN, BORDER = -1, -2
"""In place of a twin: an edge of the front; an edge without an adjacent triangle."""


class CodedMesh(NamedTuple):
    """The coded part of a mesh, in coded order; corner 3·t + k is corner k of triangle t.

    An edge is named by the corner of a coded triangle that begins it. Edges without a coded triangle on the
    other side are the *front*; there edge e runs from its tail, the vertex of the next corner, to its head,
    the vertex of e.

    vertices
        (3T,): the vertex of each corner.
    twins
        (3T,): the same edge in the adjacent triangle; `OPEN` or `BORDER`.
    before, after
        (3T,): the edges of the front that end at an edge's tail and begin at its head.
    stack
        (3T,): edges of the front, processed from the last one on.
    leaving
        (V,): the edge of the front that was the last to begin at each vertex, −1 for none.
    degrees
        (V,): the number of triangles at each vertex, up to 7.
    positions, position_leftovers
        (V, 3): coordinates, and the residuals of their predictions.
    pieces, wedges
        (T,), (3T,): links across edges that are no seams, to an earlier triangle or corner, or to itself.
    groups
        (T, 2): the island, −1 on a plain triangle, and the part of each triangle.
    parameters, parameter_leftovers
        (3T, 2): parameters of each corner, and their residuals.
    counts
        See `STATUS`.
    limits
        Largest coordinate; number of islands and of parts.
    """

    vertices: NDArray[np.int32]
    twins: NDArray[np.int32]
    before: NDArray[np.int32]
    after: NDArray[np.int32]
    stack: NDArray[np.int32]
    leaving: NDArray[np.int32]
    degrees: NDArray[np.uint8]
    positions: NDArray[np.int32]
    position_leftovers: NDArray[np.int32]
    pieces: NDArray[np.int32]
    wedges: NDArray[np.int32]
    groups: NDArray[np.int32]
    parameters: NDArray[np.int32]
    parameter_leftovers: NDArray[np.int32]
    counts: NDArray[np.int64]
    limits: NDArray[np.int64]


class Origin(NamedTuple):
    """An encoder's mesh, with integers only, and its progress; empty for a decoder.

    triangles, neighbours
        (T, 3), as `TriangleMesh` has them.
    positions, parameters, groups
        (V, 3), (T, 3, 2), (T, 2).
    number
        (V,): number of each vertex in coded order, −1 before it is coded.
    corners
        (T,): the first corner of each triangle in coded order.
    done
        (T,): whether a triangle is coded.
    first
        (1,): all triangles before this one are coded.
    """

    triangles: NDArray[np.int32]
    neighbours: NDArray[np.int32]
    positions: NDArray[np.int32]
    parameters: NDArray[np.int32]
    groups: NDArray[np.int32]
    number: NDArray[np.int32]
    corners: NDArray[np.int32]
    done: NDArray[np.uint8]
    first: NDArray[np.int64]
