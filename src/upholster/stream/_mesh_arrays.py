"""What the kernels of a mesh's code share: the mesh as far as it is coded, and an encoder's mesh."""

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
"""Bytes are missing; a number is outside what is allowed."""

MOST_PARAMETER = 2**28
"""Steps of a parameter, either way."""

STATUS, TRIANGLES, VERTICES, STACKED, LAST_ISLAND, LAST_PART = range(6)
"""Places in `Mesh.counts`: 0, or `LACKING` or `WRONG`; how many are coded; edges on the stack; the
island and the part told last."""

OPEN, BORDER = -1, -2
"""In place of a twin: an edge of the front; one without a triangle beyond."""


class CodedMesh(NamedTuple):
    """A mesh as far as it is coded, in coded order; corner 3·t + k is corner k of triangle t.

    An edge is named by the corner of a coded triangle that begins it. Those with no triangle beyond are the
    *front*; there edge e runs from its tail, the vertex of the next corner, to its head, the vertex of e.

    vertices
        (3T,): of each corner.
    twins
        (3T,): the same edge, as the triangle beyond has it; `OPEN` or `BORDER`.
    before, after
        (3T,): the edges of the front that end at an edge's tail and begin at its head.
    stack
        (3T,): edges of the front, to look at from the last one on.
    leaving
        (V,): the edge of the front that was the last to begin at each vertex, −1 for none.
    degrees
        (V,): how many triangles each vertex has, to 7.
    positions, position_leftovers
        (V, 3): coordinates, and what their guesses left over.
    pieces, wedges
        (T,), (3T,): of what edges that are no seams join, an earlier triangle or corner, or itself.
    groups
        (T, 2): each triangle's island, −1 on a plain one, and part.
    parameters, parameter_leftovers
        (3T, 2): of each corner.
    counts
        See `STATUS`.
    limits
        Largest coordinate; how many islands and parts there are.
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
    """What an encoder knows: its mesh, with all numbers whole, and how far it is; empty for a decoder.

    triangles, neighbours
        (T, 3), as `TriangleMesh` has them.
    positions, parameters, groups
        (V, 3), (T, 3, 2), (T, 2).
    number
        (V,): of each vertex in coded order, −1 before it is coded.
    corners
        (T,): the corner that is the first of each triangle in coded order.
    done
        (T,): whether a triangle is coded.
    first
        (1,): no triangle before this one is left.
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
