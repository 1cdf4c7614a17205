"""Parts of edges that coincide: T-junctions, as in split patches and CAD files."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.geometry.patches.edges import Edges

__all__ = ["overlapping_parts"]

COARSE = np.linspace(0.0, 1.0, 33)
CHECKS = np.linspace(0.0, 1.0, 9)
SHORTEST = 1e-6
"""Shorter overlaps, in the parameter of either edge, are ignored."""

CHUNK = 4096
SWEPT = 1_000_000
MAX_PAIRS = 10_000_000
NEWTON_STEPS = 8

Part = tuple[int, int, tuple[float, float, float, float]]
"""Edge a, edge b, and (start, stop, other_start, other_stop) on a and on b, start < stop."""


def overlapping_parts(
    edges: Edges, live: NDArray[np.int64], lone: NDArray[np.bool_], tolerance: float
) -> Iterator[Part]:
    """Find the pairs of edges, at least one of them lone, that coincide over a part under a linear map.

    A part must be several tolerances long, and two edges of one patch with a common corner have none: edges
    that only share an end are not a seam.

    The ends of the common part are ends of one edge or the other. So the ends of each edge are projected onto
    the other, every pair of hits proposes a part, and the part is then compared at several points.

    Parameters
    ----------
    edges
        All edges.
    live
        Numbers of the edges that are not points.
    lone
        For each edge, whether it has no partner over its complete length.
    tolerance
        In the model's units.

    Raises
    ------
    InputError
        If more than ten million pairs would have to be compared.
    """
    pairs = _near_pairs(edges, live, lone, tolerance)
    adjacent = (pairs[:, 0] // 4 == pairs[:, 1] // 4) & ((pairs[:, 0] + pairs[:, 1]) % 2 == 1)
    pairs = pairs[~adjacent]
    for first in range(0, len(pairs), CHUNK):
        yield from _compare(edges, pairs[first : first + CHUNK], tolerance)


def _near_pairs(
    edges: Edges, live: NDArray[np.int64], lone: NDArray[np.bool_], tolerance: float
) -> NDArray[np.int64]:
    """Return the pairs (N, 2), each once, sorted, that may share a part; at least one of each is lone."""
    low, high = edges.low[live] - tolerance, edges.high[live] + tolerance
    ends = edges.points(live, np.tile([0.0, 1.0], (len(live), 1)))
    found, total = [np.empty((0, 2), dtype=np.int64)], 0
    for a, b in _sweep(low, high, lone[live]):
        meet = (a != b) & (low[a] <= high[b]).all(axis=1) & (low[b] <= high[a]).all(axis=1)
        a, b = a[meet], b[meet]
        # Both ends of a common part are ends of an edge inside the other's box.
        hits = _inside(low[b], high[b], ends[a]).sum(axis=1) + _inside(low[a], high[a], ends[b]).sum(axis=1)
        pairs = np.sort(np.stack([a, b], axis=1)[hits >= 2], axis=1)
        found.append(pairs)
        total += len(pairs)
        if total > MAX_PAIRS:
            raise InputError(
                f"{int(lone.sum())} edges without a complete partner are too close together to be joined; "
                f"allowed: {MAX_PAIRS} pairs of them that nearly touch"
            )
    return live[np.unique(np.concatenate(found), axis=0)]


def _sweep(
    low: FloatArray, high: FloatArray, alone: NDArray[np.bool_]
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Yield, in batches, the pairs whose boxes overlap along one axis, the one with the fewest pairs."""
    every, single, paired = np.arange(len(alone)), np.flatnonzero(alone), np.flatnonzero(~alone)
    best: list[tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]] = []
    fewest = -1
    for axis in range(3):
        # An edge is compared with those that begin within its extent.
        sweeps = []
        for left, right in ((single, every), (paired, single)):
            right = right[np.argsort(low[right, axis], kind="stable")]
            begin = np.searchsorted(low[right, axis], low[left, axis], side="left")
            end = np.searchsorted(low[right, axis], high[left, axis], side="right")
            sweeps.append((left, right, begin, end - begin))
        total = sum(int(count.sum()) for _, _, _, count in sweeps)
        if fewest < 0 or total < fewest:
            fewest, best = total, sweeps
    for left, right, begin, count in best:
        upto = np.cumsum(count)
        at = 0
        while at < len(left):
            stop = max(at + 1, int(np.searchsorted(upto, (upto[at - 1] if at else 0) + SWEPT)))
            part = count[at:stop]
            a = np.repeat(left[at:stop], part)
            offset = np.arange(len(a)) - np.repeat(np.cumsum(part) - part, part)
            yield a, right[np.repeat(begin[at:stop], part) + offset]
            at = stop


def _inside(low: FloatArray, high: FloatArray, points: FloatArray) -> NDArray[np.bool_]:
    """Return whether points (N, K, 3) are in boxes (N, 3): (N, K)."""
    inside: NDArray[np.bool_] = np.all((points >= low[:, None]) & (points <= high[:, None]), axis=2)
    return inside


def _compare(edges: Edges, pairs: NDArray[np.int64], tolerance: float) -> Iterator[Part]:
    """Yield the longest common part of each pair (N, 2) that has one."""
    ends = np.tile([0.0, 1.0], (len(pairs), 1))
    hits_a, near_b = _project(edges, pairs[:, 0], edges.points(pairs[:, 1], ends), tolerance)
    hits_b, near_a = _project(edges, pairs[:, 1], edges.points(pairs[:, 0], ends), tolerance)
    # Four places where an end of one edge may be on the other: parameters on a, on b, and whether it is.
    on_a = np.concatenate([hits_a, ends], axis=1)
    on_b = np.concatenate([ends, hits_b], axis=1)
    hit = np.concatenate([near_b, near_a], axis=1)
    enough = hit.sum(axis=1) >= 2
    pairs, on_a, on_b, hit = pairs[enough], on_a[enough], on_b[enough], hit[enough]
    parts, lengths = np.zeros((len(pairs), 4)), np.zeros(len(pairs))
    for i in range(4):
        for j in range(i):
            a0, a1, b0, b1 = on_a[:, i], on_a[:, j], on_b[:, i], on_b[:, j]
            length = np.abs(a1 - a0)
            possible = hit[:, i] & hit[:, j] & (np.minimum(length, np.abs(b1 - b0)) > SHORTEST)
            better = np.flatnonzero(possible & (length > lengths))
            if len(better) == 0:
                continue
            a = edges.points(pairs[better, 0], _between(a0[better], a1[better]))
            b = edges.points(pairs[better, 1], _between(b0[better], b1[better]))
            near = np.linalg.norm(a - b, axis=2).max(axis=1) <= tolerance
            whole = np.maximum(length, np.abs(b1 - b0))[better] >= 1.0 - SHORTEST
            long = np.linalg.norm(np.diff(a, axis=1), axis=2).sum(axis=1)
            better = better[near & (long > np.where(whole, 2.0, 8.0) * tolerance)]
            parts[better] = np.stack([a0, a1, b0, b1], axis=1)[better]
            lengths[better] = length[better]
    for k in np.flatnonzero(lengths > 0.0).tolist():
        a0, a1, b0, b1 = parts[k].tolist()
        yield int(pairs[k, 0]), int(pairs[k, 1]), (a0, a1, b0, b1) if a0 < a1 else (a1, a0, b1, b0)


def _between(start: FloatArray, stop: FloatArray) -> FloatArray:
    """Return parameters from start to stop, (N, 9)."""
    return start[:, None] + (stop - start)[:, None] * CHECKS


def _project(
    edges: Edges, index: NDArray[np.int64], points: FloatArray, tolerance: float
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return parameters of points (N, K, 3) on edges `index` (N,), and whether they are on them: (N, K)."""
    inside = _inside(edges.low[index] - tolerance, edges.high[index] + tolerance, points)
    u, near = np.zeros(inside.shape), np.zeros(inside.shape, dtype=np.bool_)
    row, column = np.nonzero(inside)
    used, place = np.unique(index[row], return_inverse=True)
    samples = edges.points(used, np.broadcast_to(COARSE, (len(used), len(COARSE))))
    spacing = np.linalg.norm(np.diff(samples, axis=1), axis=2).max(axis=1)
    distances = np.linalg.norm(points[row, column, None] - samples[place], axis=2)
    nearest = distances.argmin(axis=1)
    # A point on the edge is near a sample; the others, nearly all, need no further check.
    maybe = np.flatnonzero(distances[np.arange(len(row)), nearest] <= 2.0 * spacing[place] + tolerance)
    row, column = row[maybe], column[maybe]
    edge, target, v = index[row], points[row, column][:, None], COARSE[nearest[maybe]][:, None]
    for _ in range(NEWTON_STEPS):
        at, slope = edges.derivatives(edge, v)
        length = np.einsum("nkc,nkc->nk", slope, slope)
        step = np.einsum("nkc,nkc->nk", target - at, slope) / np.where(length > 0.0, length, 1.0)
        v = np.clip(v + step, 0.0, 1.0)
    # Restore halves and similar fractions exactly, so that breaks of both sides can agree.
    plain = np.round(v * 2.0**20) / 2.0**20
    v = np.where(np.abs(v - plain) < 1e-10, plain, v)
    u[row, column] = v[:, 0]
    near[row, column] = np.linalg.norm(target - edges.points(edge, v), axis=2)[:, 0] <= tolerance
    return u, near
