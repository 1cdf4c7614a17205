"""The connected pieces into which a mesh is cut, with vertices of their own."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts.unwrap._piece_kernels import count_loops, halve, number_corners, number_pieces

__all__ = ["Piece", "halves", "pieces_of"]


class Piece(NamedTuple):
    """A single piece, with its triangles and vertices numbered from 0.

    Attributes
    ----------
    triangles
        (N,) int32: their numbers in the mesh.
    across
        (N, 3) int32, as `TriangleMesh.neighbours`.
    vertex
        (N, 3) int32.
    vertices
        Number of its vertices.
    loops
        Number of loops of its border.
    """

    triangles: IntArray
    across: IntArray
    vertex: IntArray
    vertices: int
    loops: int

    @property
    def handles(self) -> int:
        """Number of its handles; without handles, and with a border, it can be flattened."""
        count = len(self.across)
        edges = (3 * count + int((self.across < 0).sum())) // 2
        return (2 - self.loops - (self.vertices - edges + count)) // 2

    def border(self) -> IntArray:
        """Return the ends of the edges on its border, (E, 2)."""
        row, edge = np.nonzero(self.across < 0)
        return np.stack([self.vertex[row, edge], self.vertex[row, (edge + 1) % 3]], axis=1).astype(np.int32)


def pieces_of(across: IntArray, used: NDArray[np.bool_]) -> Iterator[Piece]:
    """Yield the connected pieces of the triangles used, in the order of their first triangles.

    Parameters
    ----------
    across
        (T, 3) int32, as `TriangleMesh.neighbours`; −1 also where it is cut.
    used
        (T,): neighbours of a used triangle are used as well.
    """
    piece, order = np.empty(len(across), np.int32), np.empty(len(across), np.int32)
    count = number_pieces(across, used, piece, order)
    order = order[: int(used.sum())]
    vertex = np.empty(across.shape, np.int32)
    number_corners(across, order, vertex)
    rank = np.empty(len(across), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    first = np.searchsorted(piece[order], np.arange(count + 1))
    lowest = np.minimum.reduceat(vertex[order].min(axis=1), first[:-1]) if count else np.zeros(0, np.int32)
    ends = np.append(lowest[1:], vertex.max() + 1)
    far = np.where(across >= 0, 3 * rank[across // 3] + across % 3, -1).astype(np.int32)
    for number in range(count):
        members = order[first[number] : first[number + 1]]
        own = far[members]
        local = np.where(own >= 0, own - 3 * np.int32(first[number]), -1).astype(np.int32)
        corners = vertex[members] - np.int32(lowest[number])
        vertices = int(ends[number] - lowest[number])
        yield Piece(members, local, corners, vertices, count_loops(local, corners, vertices))


def halves(piece: Piece, centres: FloatArray) -> NDArray[np.bool_]:
    """Return which triangles of a piece form one half of it, (N,): both halves are connected.

    Parameters
    ----------
    piece
        A piece with two triangles or more.
    centres
        (N, 3): their centroids in space.
    """
    side = np.empty(len(piece.triangles), np.int32)
    halve(piece.across, centres, np.arange(len(side), dtype=np.int32), side)
    return np.equal(side, 1)
