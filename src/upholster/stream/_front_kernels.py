"""The front of a mesh that is being coded: the edges beyond which triangles may lie (SPEC.md, section 5.4).

An edge of the front runs from `TAIL` to `HEAD` as the missing triangle has it; the known one has it the other
way round. Edges are linked in loops, each to the one before its tail and the one after its head.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline

__all__ = [
    "AFTER",
    "BEFORE",
    "BEHIND",
    "BORDER",
    "EDGES",
    "EDGE_SIZE",
    "GONE",
    "HEAD",
    "JOINED",
    "MOST_DELAYS",
    "OPEN",
    "OPERATIONS",
    "SOURCE",
    "STATE",
    "TAIL",
    "Front",
    "add_edge",
    "can_close",
    "delay",
    "is_open",
    "link",
    "next_gate",
]

TAIL, HEAD, BEFORE, AFTER, BEHIND, STATE, SOURCE = 0, 1, 2, 3, 4, 5, 6
"""Columns of the table of edges. `BEHIND` is 3·t + k where corner k of the known triangle t is `HEAD`, its
corner k + 1 `TAIL`; `SOURCE`, which only an encoder has, the same of the missing triangle in its own mesh, −1
where there is none."""

EDGE_SIZE = 7

OPEN, BORDER, GONE = 0, 1, 2

MOST_DELAYS = 3
"""How often an edge may be put back."""

EDGES, _STACKED, _FIRST, _LAST, JOINED, OPERATIONS = 0, 1, 2, 3, 4, 5
"""Places in `Front.counts`: of edges, of stacked ones, of delayed ones taken and put; the edge joined; the
last three operations, in octal digits."""


class Front(NamedTuple):
    """A front.

    edges
        (n, EDGE_SIZE).
    stack, queue
        Those to look at: new ones, and delayed ones.
    delays
        How often each was delayed.
    degrees
        How many triangles each vertex has, to 255.
    counts
        See `EDGES`.
    """

    edges: NDArray[np.int32]
    stack: NDArray[np.int32]
    queue: NDArray[np.int32]
    delays: NDArray[np.uint8]
    degrees: NDArray[np.uint8]
    counts: NDArray[np.int64]


@inline
def is_open(front: Front, edge: int) -> bool:
    """Return whether the edge is in the front, and no border."""
    return bool(front.edges[edge, STATE] == OPEN)


@inline
def can_close(front: Front, gate: int, side: int) -> bool:
    """Return whether one triangle can close the gate and the edge on a side of it, `BEFORE` or `AFTER`."""
    edges = front.edges
    beside = edges[gate, side]
    return bool(edges[beside, STATE] == OPEN and beside != gate and edges[beside, side] != gate)


@inline
def add_edge(front: Front, tail: int, head: int, behind: int, source: int) -> int:
    """Add an edge, on top of the stack; it is linked to none."""
    edges, counts = front.edges, front.counts
    n = counts[EDGES]
    counts[EDGES] = n + 1
    edges[n, TAIL], edges[n, HEAD], edges[n, BEHIND], edges[n, SOURCE] = tail, head, behind, source
    edges[n, STATE] = OPEN
    front.stack[counts[_STACKED]] = n
    counts[_STACKED] += 1
    return int(n)


@inline
def link(front: Front, before: int, after: int) -> None:
    """Link two edges, of which one ends where the other begins."""
    front.edges[before, AFTER], front.edges[after, BEFORE] = after, before


@inline
def delay(front: Front, gate: int) -> None:
    """Put an edge back, behind all others."""
    counts = front.counts
    front.delays[gate] += 1
    front.queue[counts[_LAST] % front.queue.shape[0]] = gate
    counts[_LAST] += 1


@inline
def next_gate(front: Front) -> int:
    """Take the open edge that was added last, else the one delayed first; −1 if there is none."""
    counts = front.counts
    while counts[_STACKED] > 0:
        counts[_STACKED] -= 1
        edge = front.stack[counts[_STACKED]]
        if is_open(front, edge):
            return int(edge)
    while counts[_FIRST] < counts[_LAST]:
        edge = front.queue[counts[_FIRST] % front.queue.shape[0]]
        counts[_FIRST] += 1
        if is_open(front, edge):
            return int(edge)
    return -1
