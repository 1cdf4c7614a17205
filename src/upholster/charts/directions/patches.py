"""How directions go on from patch to patch: their signs, and which direction suits a surface."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from upholster.charts.directions.direction import Direction, Vectors, called, parse_direction
from upholster.charts.tangents import Frames, aligned, dot, patch_frames, within
from upholster.geometry import SharedEdge, Surface
from upholster.types import FloatArray

__all__ = ["NODES", "default_direction", "signed_lines"]

Nodes = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]
"""Indices of nodes on patches: patches, rows, columns."""

NODES = 9
"""Nodes of the coarse grid over each patch, each way."""

AGREED = np.cos(np.radians(15))
"""Cosine of the angle up to which directions on both sides of an edge count as one."""


def default_direction(surface: Surface) -> Direction:
    """Return a direction that suits a surface: ``u`` if it goes on from face to face, else ``level``.

    On a ring that is closed both ways, rows run the longer way round: ``u`` or ``v``.

    Raises
    ------
    InputError
        If more than two edges claim one interval: names them.
    """
    outer = surface.outer_shared
    # Only the patches there, renumbered.
    members = sorted({patch for seam in outer for patch in (seam.patch, seam.other_patch)})
    if not members:
        return parse_direction("u")
    if _is_longer_down(surface):
        return parse_direction("v")
    number = {patch: n for n, patch in enumerate(members)}
    seams = [replace(m, patch=number[m.patch], other_patch=number[m.other_patch]) for m in outer]
    frames = patch_frames([surface.patches[patch] for patch in members], NODES)
    agreement = _agreement(seams, frames, frames.right, (0.25, 0.5, 0.75))[2]
    return parse_direction("u" if np.mean(agreement > AGREED) >= 0.95 else "level")


def _is_longer_down(surface: Surface) -> bool:
    """Whether the surface is one face that is closed both ways, and is longer along s than along t."""
    closed = {seam.edge & 1 for seam in surface.face_shared if (seam.edge - seam.other_edge) % 4 == 2}
    if len(surface.faces) != 1 or closed != {0, 1}:
        return False
    face = surface.faces[0]
    down, right = (np.arange(NODES * count) / NODES for count in (face.rows, face.columns))
    _, by_s, by_t = face.derivatives_grid(down, right)
    lengths = [np.linalg.norm(by, axis=2).mean() for by in (by_s, by_t)]
    return bool(lengths[0] * face.rows > 1.01 * lengths[1] * face.columns)


def signed_lines(surface: Surface, vectors: Vectors) -> FloatArray:
    """Return e1 on a coarse grid over each patch, (patches, nodes, nodes, 3), of one sign where possible.

    Signs spread over the patches from the strongest one, through the edges where the least is lost first.
    """
    frames = patch_frames(surface.patches, NODES)
    tangents, left = within(frames, called(vectors, frames.points, lambda patch: f"patch {patch}"))
    tangents = aligned(tangents, left)
    ends, nodes, agreement = _agreement(surface.shared, frames, tangents, (0.5,))
    strength = np.minimum(left[nodes[0]], left[nodes[1]]) * np.abs(agreement)
    beside: dict[int, list[tuple[float, int, float]]] = defaultdict(list)
    for (a, b), strong, sign in zip(ends.tolist(), strength.tolist(), agreement.tolist(), strict=True):
        beside[a].append((-strong, b, sign))
        beside[b].append((-strong, a, sign))
    signs = np.zeros(len(tangents))
    for start in np.argsort(-left.max(axis=(1, 2)), kind="stable").tolist():
        queue = [(0.0, start, 1.0)] if not signs[start] else []
        while queue:
            _, patch, sign = heappop(queue)
            if not signs[patch]:
                signs[patch] = sign
                for weight, other, turned in beside[patch]:
                    heappush(queue, (weight, other, -sign if turned < 0 else sign))
    return signs[:, None, None, None] * tangents


def _agreement(
    seams: Sequence[SharedEdge], frames: Frames, tangents: FloatArray, along: Sequence[float]
) -> tuple[NDArray[np.int64], tuple[Nodes, Nodes], FloatArray]:
    """Compare tangents on both sides of shared edges, the surface unfolded along them.

    Returns
    -------
    ndarray
        (N, 2) int64: the patches; each shared interval once for every share of it in `along`.
    tuple
        The nodes that stand for its two sides.
    ndarray
        (N,) float64: cosines of the angles between their tangents.
    """
    found = []
    for one in seams:
        for share in along:
            mine = one.start + share * (one.stop - one.start)
            theirs = one.other_start + share * (one.other_stop - one.other_start)
            found.append(
                (one.patch, one.edge, mine, one.other_patch, one.other_edge, theirs, 1 - 2 * one.opposed)
            )
    table = np.array(found, np.float64).reshape(-1, 7)
    sides, parts = [], []
    for first, symmetry in ((0, np.ones(len(table))), (3, table[:, 6])):
        patch, edge = table[:, first].astype(int), table[:, first + 1].astype(int)
        node = np.rint((NODES - 1) * table[:, first + 2]).astype(int)
        last = np.full(len(table), NODES - 1)
        rows, columns = (
            np.choose(edge, (0 * last, node, last, node)),
            np.choose(edge, (node, last, node, 0 * last)),
        )
        nodes = (patch, rows, columns)
        # A step along edges 0 and 2 is one by columns, along edges 1 and 3 one by rows; by (right, across).
        x = np.where(edge % 2 == 0, 1.0, frames.shift[nodes])
        y = np.where(edge % 2 == 0, 0.0, frames.height[nodes])
        size = symmetry * np.hypot(x, y)
        cosine, sine = dot(tangents[nodes], frames.right[nodes]), dot(tangents[nodes], frames.across[nodes])
        parts.append(((cosine * x + sine * y) / size, (sine * x - cosine * y) / size))
        sides.append(nodes)
    (a, b), (c, d) = parts
    return table[:, [0, 3]].astype(np.int64), (sides[0], sides[1]), a * c + b * d
