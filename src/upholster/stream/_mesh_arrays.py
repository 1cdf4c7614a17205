"""What the kernels of a mesh's code share: the mesh as far as it is coded, and an encoder's mesh."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "LACKING",
    "LAST_GROUPS",
    "MOST_PARAMETER",
    "TRIANGLES",
    "VERTICES",
    "WEDGES",
    "WRONG",
    "Mesh",
    "Origin",
]

LACKING, WRONG = -1, -2
"""Bytes are missing; a number is outside what is allowed."""

MOST_PARAMETER = 2**28
"""Steps of a parameter, either way."""

TRIANGLES, VERTICES, WEDGES, LAST_GROUPS = 0, 1, 2, 3
"""Places in `Mesh.counts`: how many are coded; from the last on the last island and part told."""


class Mesh(NamedTuple):
    """A mesh as far as it is coded, in coded order.

    triangles
        (T, 3): the vertices of each.
    twins
        (3T,): corner 3·t + k begins edge k of triangle t; here the corner that begins the same edge the other
        way round, −1 where there is none.
    earlier_corners, latest_corner
        (3T,), (V,): the corners of a vertex, from the latest on; −1 ends the list.
    groups
        (T, 2): each triangle's island, −1 on a plain one, and part.
    corner_wedges
        (3T,): each corner's wedge, −1 on plain triangles. A *wedge* is what corners of one island at one
        vertex share: their parameters.
    positions, position_leftovers
        (V, 3): coordinates, and what their guesses left over.
    latest_wedge, earlier_wedges, wedge_island
        (V,), (W,), (W,): the wedges of a vertex, from the latest on, and their islands.
    wedge_corners, wedge_next
        (W,), (3T,): the corners of a wedge.
    parameters, parameter_leftovers
        (W, 2).
    counts
        See `TRIANGLES`.
    limits
        Largest coordinate; how many islands and parts there are.
    """

    triangles: NDArray[np.int32]
    twins: NDArray[np.int32]
    earlier_corners: NDArray[np.int32]
    latest_corner: NDArray[np.int32]
    groups: NDArray[np.int32]
    corner_wedges: NDArray[np.int32]
    positions: NDArray[np.int32]
    position_leftovers: NDArray[np.int32]
    latest_wedge: NDArray[np.int32]
    earlier_wedges: NDArray[np.int32]
    wedge_island: NDArray[np.int32]
    wedge_corners: NDArray[np.int32]
    wedge_next: NDArray[np.int32]
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
    number, vertices
        (V,): of each vertex in coded order, −1 before it is coded; and the other way round.
    corners
        (T,): the corner that is the first of each triangle in coded order.
    done
        (T,): whether a triangle is coded.
    leaving
        (V,): an edge of the front that begins at a vertex, in coded order.
    delayed_at
        (3T,): how many triangles were coded when an edge was delayed.
    first
        (1,): no triangle before this one is left.
    """

    triangles: NDArray[np.int32]
    neighbours: NDArray[np.int32]
    positions: NDArray[np.int32]
    parameters: NDArray[np.int32]
    groups: NDArray[np.int32]
    number: NDArray[np.int32]
    vertices: NDArray[np.int32]
    corners: NDArray[np.int32]
    done: NDArray[np.uint8]
    leaving: NDArray[np.int32]
    delayed_at: NDArray[np.int32]
    first: NDArray[np.int64]
