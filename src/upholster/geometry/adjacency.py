"""Which edges of a surface's patches meet: whole edges, then parts of edges, found by position."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.geometry.edges import Edges
from upholster.geometry.overlaps import overlapping_parts
from upholster.geometry.patch import RationalPatch
from upholster.types import FloatArray

__all__ = ["Adjacency", "BorderInterval", "SharedEdge", "find_adjacency"]

CHECKS = np.linspace(0.0, 1.0, 9)
"""Parameters at which two edges are compared."""

EPS = 1e-6
"""Parts of an edge shorter than this, in its parameter, are neither border nor overlap."""


@dataclass(frozen=True, slots=True)
class SharedEdge:
    """An interval of an edge, and the interval of another edge (or of the same patch's) that meets it.

    The map between the two is linear. Edge numbers and edge parameters: CONVENTIONS.md.

    Attributes
    ----------
    patch, edge
        Whose interval it is.
    start, stop
        The interval, 0 ≤ start < stop ≤ 1, in the edge's own parameter.
    other_patch, other_edge
        Who is on the other side.
    other_start, other_stop
        Parameters on the other edge that meet `start` and `stop`: other_start > other_stop where the two
        edges run in opposite directions.
    """

    patch: int
    edge: int
    start: float
    stop: float
    other_patch: int
    other_edge: int
    other_start: float
    other_stop: float

    @property
    def whole(self) -> bool:
        """Whether both edges meet over their whole length."""
        ends = {self.other_start, self.other_stop}
        return (self.start, self.stop) == (0.0, 1.0) and ends == {0.0, 1.0}

    @property
    def opposed(self) -> bool:
        """Whether the two edges run in opposite directions."""
        return self.other_start > self.other_stop

    def flipped(self) -> "SharedEdge":
        """Return the same meeting seen from the other side."""
        ends = [(self.other_start, self.start), (self.other_stop, self.stop)]
        (start, other_start), (stop, other_stop) = sorted(ends)
        return SharedEdge(
            self.other_patch, self.other_edge, start, stop, self.patch, self.edge, other_start, other_stop
        )


@dataclass(frozen=True, slots=True)
class BorderInterval:
    """An interval of an edge that nothing meets: 0 ≤ start < stop ≤ 1 in the edge's own parameter."""

    patch: int
    edge: int
    start: float
    stop: float


@dataclass(frozen=True, slots=True)
class Adjacency:
    """How the edges of a surface meet.

    Attributes
    ----------
    shared
        Each shared interval once, (patch, edge) ≤ (other_patch, other_edge), sorted.
    border
        Intervals that nothing meets, sorted.
    degenerate
        (patch, edge) of the edges that are a point.
    """

    shared: tuple[SharedEdge, ...]
    border: tuple[BorderInterval, ...]
    degenerate: frozenset[tuple[int, int]]


def find_adjacency(patches: Sequence[RationalPatch], tolerance: float) -> Adjacency:
    """Find which edges meet.

    Two edges, or parts of them, meet if their points at corresponding parameters, the map linear, are nowhere
    farther apart than the tolerance. An edge whose control points are all that close is a point: degenerate,
    without neighbours.

    Parameters
    ----------
    patches
        The patches.
    tolerance
        In the model's units.

    Raises
    ------
    InputError
        If more than two edges claim one interval: names them.
    """
    edges = Edges(patches)
    degenerate = edges.degenerate(tolerance)
    live = np.flatnonzero(~degenerate)
    shared = _whole_edges(edges, live, tolerance)
    met = np.zeros(len(edges), dtype=np.bool_)
    for one in shared:
        met[4 * one.patch + one.edge] = met[4 * one.other_patch + one.other_edge] = True
    lone = ~met & ~degenerate
    if lone.any():
        for a, b, ends in overlapping_parts(edges, live, lone, tolerance):
            meeting = SharedEdge(a // 4, a % 4, ends[0], ends[1], b // 4, b % 4, ends[2], ends[3])
            flipped = meeting.flipped()
            shared.append(min(meeting, flipped, key=lambda m: (m.patch, m.edge, m.start)))
    shared.sort(key=lambda m: (m.patch, m.edge, m.start))
    border = _border(edges, live, shared, tolerance)
    points = frozenset((int(e) // 4, int(e) % 4) for e in np.flatnonzero(degenerate))
    return Adjacency(tuple(shared), tuple(border), points)


def _whole_edges(edges: Edges, live: NDArray[np.int64], tolerance: float) -> list[SharedEdge]:
    """Pair up the edges that coincide over their whole length."""
    if len(live) == 0:
        return []
    samples = edges.points(live, np.broadcast_to(CHECKS, (len(live), len(CHECKS))))
    ids = _position_ids(samples.reshape(-1, 3), tolerance).reshape(len(live), -1)
    # the same key for both directions: sums over mirrored places
    folded = np.sort(np.stack([ids, ids[:, ::-1]]), axis=0)
    weights = np.random.default_rng(0).integers(1, 2**62, size=(2, len(CHECKS)), dtype=np.int64)
    keys = (folded[0] * weights[0] + folded[1] * weights[1]).sum(axis=1)
    order = np.argsort(keys, kind="stable")
    starts = np.flatnonzero(np.diff(keys[order], prepend=keys[order[0]] - 1))
    sizes = np.diff(starts, append=len(order))

    firsts = order[starts[sizes == 2]]
    seconds = order[starts[sizes == 2] + 1]
    straight, opposed = _gaps(samples[firsts], samples[seconds])
    near = np.minimum(straight, opposed) <= tolerance
    shared = []
    for a, b, turned in zip(
        live[firsts[near]].tolist(),
        live[seconds[near]].tolist(),
        (opposed < straight)[near].tolist(),
        strict=True,
    ):
        ends = (1.0, 0.0) if turned else (0.0, 1.0)
        shared.append(SharedEdge(a // 4, a % 4, 0.0, 1.0, b // 4, b % 4, *ends))

    # three and more in one place: an error, unless only their keys agree; the second search sees to those
    for first, size in zip(starts[sizes > 2].tolist(), sizes[sizes > 2].tolist(), strict=True):
        group = order[first : first + size]
        same = np.minimum(*_gaps(samples[group], samples[group[:1]])) <= tolerance
        if same.sum() > 2:
            raise _too_many(live[group[same]][:3].tolist())
    return shared


def _gaps(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the greatest distances between edges (N, K, 3), run alike and run in opposite directions."""
    straight = np.linalg.norm(a - b, axis=2).max(axis=1)
    opposed = np.linalg.norm(a - b[:, ::-1], axis=2).max(axis=1)
    return straight, opposed


def _position_ids(points: FloatArray, tolerance: float) -> NDArray[np.int64]:
    """Give points (N, 3) numbers, the same to those within the tolerance of each other.

    Distant points may share a number (where coordinates chain up), so equal numbers are a hint, not a proof.
    """
    key = np.zeros(len(points), dtype=np.int64)
    for axis in range(3):
        order = np.argsort(points[:, axis], kind="stable")
        steps = np.diff(points[order, axis], prepend=points[order[0], axis]) > tolerance
        rank = np.empty(len(points), dtype=np.int64)
        rank[order] = np.cumsum(steps)
        # renumbering after each axis keeps the product below (number of points)², far inside 64 bits
        _, key = np.unique(key * len(points) + rank, return_inverse=True)
    return key


def _border(
    edges: Edges, live: NDArray[np.int64], shared: list[SharedEdge], tolerance: float
) -> list[BorderInterval]:
    """Return what no meeting covers; raise if two meetings cover the same part of an edge."""
    parts: dict[int, list[SharedEdge]] = defaultdict(list)
    for meeting in shared:
        for one in (meeting, meeting.flipped()):
            parts[4 * one.patch + one.edge].append(one)
    border = []
    for e in live.tolist():
        covered = 0.0
        before: SharedEdge | None = None
        for one in sorted(parts[e], key=lambda m: m.start):
            if before is not None and covered - one.start > EPS:
                # a loose tolerance lets neighbours overlap by about as much
                ends = edges.points(np.array([e]), np.array([[one.start, covered]]))[0]
                if np.linalg.norm(ends[0] - ends[1]) > 4.0 * tolerance:
                    claims = [
                        e,
                        4 * before.other_patch + before.other_edge,
                        4 * one.other_patch + one.other_edge,
                    ]
                    raise _too_many(claims)
            if one.start - covered > EPS:
                border.append(BorderInterval(e // 4, e % 4, covered, one.start))
            if one.stop > covered:
                covered, before = one.stop, one
        if 1.0 - covered > EPS:
            border.append(BorderInterval(e // 4, e % 4, covered, 1.0))
    return border


def _too_many(claims: list[int]) -> InputError:
    """Say which edges lie in one place."""
    names = ", ".join(f"patch {e // 4} edge {e % 4}" for e in claims)
    return InputError(
        f"more than two edges meet in one place ({names}); allowed: at most two edges along any line"
    )
