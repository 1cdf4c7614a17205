"""Numbering the edges of triangles, and finding the two triangles that meet at each."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.runtime.jit import kernel

__all__ = ["EdgeScratch", "mark_seams", "number_edges", "pair_sides"]


class EdgeScratch(NamedTuple):
    """Scratch space of `number_edges` for a number of edges and vertices."""

    starts: IntArray
    listed: IntArray
    stamps: IntArray
    numbers: IntArray

    @classmethod
    def of(cls, edges: int, vertices: int) -> "EdgeScratch":
        """Return scratch space of that size."""
        return cls(
            np.empty(vertices + 1, np.int32),
            np.empty(edges, np.int32),
            np.empty(vertices, np.int32),
            np.empty(vertices, np.int32),
        )


@kernel
def number_edges(
    first: IntArray, last: IntArray, scratch: EdgeScratch, numbers: IntArray, examples: IntArray
) -> Any:
    """Assign one number to all edges between the same two vertices; return how many numbers there are.

    `first` and `last` (E,) are the vertices at their ends; edges whose `first` is negative get −1. `numbers`
    (E,) receives the numbers, which increase with the lower vertex, then in the order of edges. `examples`
    (E,) receives the first edge of each number.
    """
    edges, vertices = len(first), len(scratch.stamps)
    starts, listed = scratch.starts, scratch.listed
    starts[:], scratch.stamps[:] = 0, -1
    for e in range(edges):
        if first[e] >= 0:
            starts[min(first[e], last[e]) + 1] += 1
    for v in range(vertices):
        starts[v + 1] += starts[v]
    for e in range(edges):
        numbers[e] = -1
        if first[e] >= 0:
            low = min(first[e], last[e])
            listed[starts[low]] = e
            starts[low] += 1  # ends where the next one's list begins
    count, begin = int64(0), int64(0)
    for low in range(vertices):
        for k in range(begin, starts[low]):
            e = listed[k]
            high = max(first[e], last[e])
            if scratch.stamps[high] != low:
                scratch.stamps[high], scratch.numbers[high] = low, count
                examples[count] = e
                count += 1
            numbers[e] = scratch.numbers[high]
        begin = starts[low]
    return count


@kernel
def pair_sides(
    numbers: IntArray, first: IntArray, last: IntArray, sides: IntArray, counts: IntArray, across: IntArray
) -> Any:
    """Write the other side of each edge to `across` (E,) if it has two sides in opposite directions; else −1.

    `numbers`, `first` and `last` (E,) are those of `number_edges`; `sides` (edges, 2) is scratch space.
    `counts` (edges,) receives the number of sides of each edge; the largest one is returned.
    """
    counts[:], across[:] = 0, -1
    most = int64(0)
    for e in range(len(numbers)):
        n = numbers[e]
        if n >= 0:
            if counts[n] < 2:
                sides[n, counts[n]] = e
            counts[n] += 1
            most = max(most, int64(counts[n]))
    for n in range(len(counts)):
        if counts[n] == 2:
            a, b = sides[n, 0], sides[n, 1]
            if first[a] == last[b]:
                across[a], across[b] = b, a
    return most


@kernel
def mark_seams(across: IntArray, places: FloatArray, part: IntArray, seams: NDArray[np.bool_]) -> None:
    """Mark edges of triangles, (T, 3), whose neighbour across is at another place in the plane.

    `across` (T, 3) is the result of `edge_pairs`; `places` (T, 3, 2) are the corners' places in the plane,
    and `part` (T,) is the plane of each triangle: −1 for none, whose edges are not marked.
    """
    for t in range(across.shape[0]):
        for k in range(3):
            seams[t, k] = False
            met = across[t, k]
            if met < 0 or part[t] < 0 or part[met // 3] < 0:
                continue
            other, last, first, here = met // 3, met % 3, (met % 3 + 1) % 3, (k + 1) % 3
            seams[t, k] = part[other] != part[t] or not (
                places[t, k, 0] == places[other, first, 0]
                and places[t, k, 1] == places[other, first, 1]
                and places[t, here, 0] == places[other, last, 0]
                and places[t, here, 1] == places[other, last, 1]
            )
