"""Which edges of a surface's patches meet: from the face's grid inside a face, otherwise by position."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.geometry.patches.edges import Edges
from upholster.geometry.patches.face import Face
from upholster.geometry.patches.overlaps import overlapping_parts

__all__ = ["Adjacency", "BorderInterval", "FaceEdges", "SharedEdge", "find_adjacency", "nearly_meeting"]

CHECKS = np.linspace(0.0, 1.0, 9)
"""Parameters at which two edges are compared."""

LOOSEST = -3
"""Greatest tolerance, as a power of ten relative to the surface's size, at which edges nearly meet."""

LOOSE_GRID = 1e-6
"""Gaps inside a face are accepted up to this share of the size, whatever the tolerance."""

EPS = 1e-6
"""Shorter parts of an edge, in its parameter, count neither as border nor as overlap."""


@dataclass(frozen=True, slots=True)
class SharedEdge:
    """An interval of an edge, and the interval of another edge (or of the same patch's) that meets it.

    The map between the two is linear. Edge numbers and edge parameters: CONVENTIONS.md.

    Attributes
    ----------
    patch, edge
        The patch and edge that the interval is on.
    start, stop
        The interval, 0 ≤ start < stop ≤ 1, in the edge's own parameter.
    other_patch, other_edge
        The patch and edge on the other side.
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
        """Whether both edges meet over their full length."""
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
    """The adjacency of a surface's edges.

    Attributes
    ----------
    shared
        Each shared interval once, with (patch, edge) ≤ (other_patch, other_edge), sorted.
    border
        Intervals without a neighbour, sorted.
    degenerate
        (patch, edge) of the edges that are points.
    """

    shared: tuple[SharedEdge, ...]
    border: tuple[BorderInterval, ...]
    degenerate: frozenset[tuple[int, int]]


@dataclass(frozen=True, slots=True, eq=False)
class FaceEdges:
    """All edges of the faces' patches, and the connections inside faces.

    Attributes
    ----------
    edges
        Every patch's edges: number 4·patch + edge.
    inner
        (N, 2): pairs of edges that are one line inside a face, in the same direction.
    rim
        Whether an edge is on its face's edge.
    """

    edges: Edges
    inner: NDArray[np.int64]
    rim: NDArray[np.bool_]

    @classmethod
    def of(cls, faces: Sequence[Face]) -> "FaceEdges":
        """Return the edges of all faces, numbered patch by patch."""
        edges = Edges([patch for face in faces for row in face.patches for patch in row])
        pairs, first = [np.zeros((0, 2), np.int64)], 0
        for face in faces:
            number = first + np.arange(face.rows * face.columns).reshape(face.rows, face.columns)
            first += number.size
            pairs.append(4 * np.stack([number[:, :-1], number[:, 1:]], axis=-1).reshape(-1, 2) + (1, 3))
            pairs.append(4 * np.stack([number[:-1], number[1:]], axis=-1).reshape(-1, 2) + (2, 0))
        inner = np.concatenate(pairs)
        rim = np.ones(len(edges), dtype=np.bool_)
        rim[inner] = False
        return cls(edges, inner, rim)


_NEIGHBOURS = 8
"""Number of candidates with which an edge is compared, among edges between the same junctions."""


def find_adjacency(parts: FaceEdges, tolerance: float) -> Adjacency:
    """Find which edges of patches meet.

    Inside a face the grid defines this. Elsewhere two edges, or parts of them, meet if their points at
    corresponding parameters, under a linear map, are nowhere farther apart than the tolerance. Complete edges
    whose ends are at the same two junctions are matched first, then parts. An edge whose control points are
    all within the tolerance is a point: degenerate, without neighbours.

    Parameters
    ----------
    parts
        All edges.
    tolerance
        In the model's units.

    Raises
    ------
    InputError
        If more than two edges claim one interval (the message names them), or patches of one face do not
        join.
    """
    degenerate = parts.edges.degenerate(tolerance)
    shared = _inside_faces(parts, degenerate, tolerance)
    live = np.flatnonzero(~degenerate & parts.rim)
    shared += _meetings(parts.edges, live, tolerance)
    shared.sort(key=_order)
    border = _border(parts.edges, live, shared, tolerance)
    points = frozenset((int(e) // 4, int(e) % 4) for e in np.flatnonzero(degenerate))
    return Adjacency(tuple(shared), tuple(border), points)


def nearly_meeting(parts: FaceEdges, found: Adjacency, tolerance: float, size: float) -> tuple[int, float]:
    """Return how many more edges would meet with a larger tolerance, and that tolerance.

    Tries the powers of ten above the tolerance, up to a thousandth of the size. Returns the smallest of those
    that join most edges.

    Parameters
    ----------
    parts
        All edges.
    found
        The result of `find_adjacency`.
    tolerance
        The tolerance that it used, relative to the size.
    size
        The surface's size, in the model's units.

    Returns
    -------
    int
        Number of edges, counted once for both sides: 0 if no tolerance joins more.
    float
        The tolerance, relative to the size; the given one if the number is 0.
    """
    met = {(one.patch, one.edge) for seam in found.shared for one in (seam, seam.flipped())}
    lone = [(one.patch, one.edge) for one in found.border if (one.patch, one.edge) not in met]
    best = (0, tolerance)
    if not lone:
        return best
    edges = parts.edges
    live = np.array([4 * patch + edge for patch, edge in lone], np.int64)
    for power in range(-12, LOOSEST + 1):
        if 10.0**power <= tolerance:
            continue
        try:
            joined = _meetings(edges, live[~edges.degenerate(10.0**power * size)[live]], 10.0**power * size)
        except InputError:
            break
        if len(joined) > best[0]:
            best = (len(joined), 10.0**power)
    return best


def _inside_faces(parts: FaceEdges, degenerate: NDArray[np.bool_], tolerance: float) -> list[SharedEdge]:
    """Return the shared edges inside faces; raise where patches do not join."""
    inner = parts.inner
    if not len(inner):
        return []
    u = np.broadcast_to(CHECKS, (len(inner), len(CHECKS)))
    gaps = np.linalg.norm(parts.edges.points(inner[:, 0], u) - parts.edges.points(inner[:, 1], u), axis=2)
    torn = gaps.max(axis=1) > max(tolerance, LOOSE_GRID * _extent(parts.edges))
    if torn.any():
        a, b = inner[int(torn.argmax())].tolist()
        raise InputError(
            f"patches {a // 4} and {b // 4} lie side by side in a face, but do not join (edges {a % 4} and "
            f"{b % 4}); allowed: gaps up to the tolerance"
        )
    whole = inner[~degenerate[inner].any(axis=1)]
    return [SharedEdge(a // 4, a % 4, 0.0, 1.0, b // 4, b % 4, 0.0, 1.0) for a, b in whole.tolist()]


def _extent(edges: Edges) -> float:
    return float(np.linalg.norm(edges.high.max(axis=0) - edges.low.min(axis=0)))


def _order(seam: SharedEdge) -> tuple[int, int, float]:
    return seam.patch, seam.edge, seam.start


def _meetings(edges: Edges, live: NDArray[np.int64], tolerance: float) -> list[SharedEdge]:
    """Return which of the edges `live` meet, by position: complete ones, then parts of the remaining ones."""
    shared = _whole_edges(edges, live, tolerance)
    lone = np.zeros(len(edges), dtype=np.bool_)
    lone[live] = True
    for one in shared:
        lone[[4 * one.patch + one.edge, 4 * one.other_patch + one.other_edge]] = False
    if lone.any():
        covered: dict[int, tuple[float, int]] = {}  # covered length of an edge, and the last cover
        for a, b, ends in overlapping_parts(edges, live, lone, tolerance):
            meeting = SharedEdge(a // 4, a % 4, ends[0], ends[1], b // 4, b % 4, ends[2], ends[3])
            shared.append(min(meeting, meeting.flipped(), key=_order))
            for edge, other, length in ((a, b, ends[1] - ends[0]), (b, a, abs(ends[3] - ends[2]))):
                before, last = covered.get(edge, (0.0, other))
                if before + length > 2.0:  # at least three edges claim some place
                    raise _too_many([edge, last, other])
                covered[edge] = before + length, other
    return shared


def _whole_edges(edges: Edges, live: NDArray[np.int64], tolerance: float) -> list[SharedEdge]:
    """Pair up the edges that coincide completely: their ends are at the same two junctions."""
    if len(live) == 0:
        return []
    samples = edges.points(live, np.broadcast_to(CHECKS, (len(live), len(CHECKS))))
    # Midpoints distinguish edges between the same junctions, such as meridians between two poles.
    places = samples[:, [0, len(CHECKS) // 2, -1]]
    first, middle, last = _junctions(places.reshape(-1, 3), tolerance).reshape(-1, 3).T
    keys = np.stack([np.minimum(first, last), np.maximum(first, last), middle], axis=1)
    number = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
    order = np.argsort(number, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(number[order])) + 1)
    pairs = [group for group in groups if len(group) == 2]
    shared = []
    if pairs:
        a, b = np.array(pairs).T
        straight, opposed = _gaps(samples[a], samples[b])
        near = np.minimum(straight, opposed) <= tolerance
        for one, other, turned in zip(
            live[a[near]].tolist(), live[b[near]].tolist(), (opposed < straight)[near].tolist(), strict=True
        ):
            shared.append(_whole(one, other, turned))
    for group in groups:
        if len(group) > 2:
            shared += _crowd(live[group], samples[group], tolerance)
    return shared


def _whole(a: int, b: int, turned: bool) -> SharedEdge:
    return SharedEdge(a // 4, a % 4, 0.0, 1.0, b // 4, b % 4, *((1.0, 0.0) if turned else (0.0, 1.0)))


def _crowd(index: NDArray[np.int64], samples: FloatArray, tolerance: float) -> list[SharedEdge]:
    """Pair up edges between the same junctions, nearest first; raise if a third edge is as near."""
    _, number, copies = np.unique(
        samples.reshape(len(index), -1), axis=0, return_inverse=True, return_counts=True
    )
    if copies.max() > 2:  # checked early, because a file may have very many copies
        raise _too_many(index[np.flatnonzero(number.reshape(-1) == copies.argmax())[:3]].tolist())
    a, b = _near_pairs(samples)
    straight, opposed = _gaps(samples[a], samples[b])
    gaps = np.minimum(straight, opposed)
    rounding = 1e-12 * float(np.abs(samples).max())
    partner: dict[int, tuple[int, float]] = {}
    shared = []
    for n in np.argsort(gaps, kind="stable").tolist():
        if gaps[n] > tolerance:
            break
        one, other = int(a[n]), int(b[n])
        claimed = [(mine, partner[mine]) for mine in (one, other) if mine in partner]
        if not claimed:
            partner[one], partner[other] = (other, float(gaps[n])), (one, float(gaps[n]))
            shared.append(_whole(int(index[one]), int(index[other]), bool(opposed[n] < straight[n])))
        for mine, (before, gap) in claimed:
            # Two edges that almost coincide are a pair, even if the tolerance reaches more edges.
            if gaps[n] <= 10.0 * gap + rounding:
                raise _too_many(index[[mine, before, other if mine == one else one]].tolist())
    return shared


def _near_pairs(samples: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return pairs of edges that are close in an order in which coincident edges are neighbours.

    The order is by a mean of an edge's points that does not depend on the edge's direction.
    """
    count = len(samples)
    either_way = (samples + samples[:, ::-1]).reshape(count, -1)
    order = np.argsort(either_way @ np.random.default_rng(0).random(either_way.shape[1]), kind="stable")
    pairs = [
        np.stack([order[:-step], order[step:]], axis=1) for step in range(1, min(count, 1 + _NEIGHBOURS))
    ]
    found = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)
    return found[:, 0], found[:, 1]


def _gaps(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the greatest distances between edges (N, K, 3), in the same and in opposite directions."""
    straight = np.linalg.norm(a - b, axis=2).max(axis=1)
    opposed = np.linalg.norm(a - b[:, ::-1], axis=2).max(axis=1)
    return straight, opposed


def _junctions(points: FloatArray, tolerance: float) -> NDArray[np.int64]:
    """Merge points (N, 3) within the tolerance of each other: points of one junction get equal numbers.

    Points up to a few tolerances apart may be merged too, so edges have to be compared afterwards.
    """
    cell = 2.0 * max(tolerance, 1e-300)
    scaled = (points - points.min(axis=0)) / max(cell, 1e-15 * float(np.ptp(points, axis=0).max()))
    primes = np.array([73_856_093, 19_349_663_000_003, 83_492_791_000_000_027], dtype=np.int64)
    groups = []
    # Eight grids, shifted by half a cell each way: two points this close share a cell in one of them.
    for shift in product((0.0, 0.5), repeat=3):
        cells = np.floor(scaled + shift).astype(np.int64)
        groups.append(np.unique((cells * primes).sum(axis=1), return_inverse=True)[1].reshape(-1))
    number = np.arange(len(points), dtype=np.int64)
    while True:
        before = number
        for group in groups:
            least = np.full(group.max() + 1, len(points), dtype=np.int64)
            np.minimum.at(least, group, number)
            number = least[group]
        if (number == before).all():
            return number


def _border(
    edges: Edges, live: NDArray[np.int64], shared: list[SharedEdge], tolerance: float
) -> list[BorderInterval]:
    """Return the intervals that no shared edge covers; raise if two cover the same part of an edge."""
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
                # with a loose tolerance, neighbours overlap by about that much
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
    """Name the edges that share one place."""
    names = ", ".join(f"patch {e // 4} edge {e % 4}" for e in claims)
    return InputError(
        f"more than two edges meet in one place ({names}); allowed: at most two edges along any line"
    )
