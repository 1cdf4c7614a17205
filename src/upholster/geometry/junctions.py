"""Where the vertices of neighbouring patches coincide, and the extra vertices that T-junctions need."""

from bisect import bisect_left, insort
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from upholster.geometry.adjacency import SharedEdge
from upholster.geometry.surface import Surface
from upholster.types import FloatArray, IntArray

__all__ = ["Fans", "Junctions", "cell_fans", "find_junctions", "weld"]

MERGE = 1e-9
"""Breaks closer than this, in the edge's parameter, are one."""


@dataclass
class Junctions:
    """Vertices that coincide, and vertices that the uniform grids lack.

    Attributes
    ----------
    pairs
        (N, 2): vertices at one position.
    patch, parameters
        Of the extra vertices, which are numbered from `first` on: (M,), (M, 2).
    sides
        Per (patch, edge), the extra vertices along it: (parameter of the edge, vertex), sorted.
    """

    first: int
    pairs: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))
    patch: list[int] = field(default_factory=list)
    parameters: list[tuple[float, float]] = field(default_factory=list)
    sides: dict[tuple[int, int], list[tuple[float, int]]] = field(default_factory=lambda: defaultdict(list))

    def add(self, patch: int, s: float, t: float) -> int:
        """Make another vertex and return its number."""
        self.patch.append(patch)
        self.parameters.append((s, t))
        return self.first + len(self.patch) - 1

    def on_edge(self, patch: int, edge: int, u: float) -> int:
        """Return the extra vertex at parameter u of an edge, made if it is new."""
        side = self.sides[patch, edge]
        at = bisect_left(side, (u - MERGE, -1))
        if at < len(side) and side[at][0] <= u + MERGE:
            return side[at][1]
        vertex = self.add(patch, *((0.0, u), (u, 1.0), (1.0, u), (u, 0.0))[edge])
        insort(side, (u, vertex))
        return vertex


@dataclass(frozen=True, slots=True)
class Fans:
    """Cells cut into triangles: their numbers (C,) among the quadrilaterals, and the triangles (T, 3)."""

    cells: NDArray[np.int64]
    triangles: IntArray


def find_junctions(surface: Surface, k: int) -> Junctions:
    """Find what coincides when every patch has a uniform grid of (k + 1)² vertices, numbered row by row.

    At partial meetings the breaks of both sides are united.
    """
    size = (k + 1) ** 2
    along = np.arange(k + 1)
    # vertices along edges 0 to 3 of a patch
    ring = np.stack([along, along * (k + 1) + k, k * (k + 1) + along, along * (k + 1)])
    found = Junctions(first=size * len(surface.patches))
    pairs = [found.pairs]
    for patch, edge in surface.degenerate:
        line = patch * size + ring[edge]
        pairs.append(np.stack([line[:-1], line[1:]], axis=1))
    whole = [m for m in surface.shared if m.whole]
    if whole:
        p, e, q, f = np.array([(m.patch, m.edge, m.other_patch, m.other_edge) for m in whole]).T
        opposed = np.array([m.opposed for m in whole])
        other = np.where(opposed[:, None], ring[f][:, ::-1], ring[f]) + (q * size)[:, None]
        pairs.append(np.stack([(ring[e] + (p * size)[:, None]).ravel(), other.ravel()], axis=1))
    extra = [_unite(m, k, ring, found) for m in surface.shared if not m.whole]
    found.pairs = np.concatenate([*pairs, *extra])
    return found


def _unite(meeting: SharedEdge, k: int, ring: NDArray[np.int64], found: Junctions) -> NDArray[np.int64]:
    """Give both sides of a partial meeting the breaks of either; return which vertices coincide."""
    start, stop, other_start, other_stop = (
        meeting.start,
        meeting.stop,
        meeting.other_start,
        meeting.other_stop,
    )
    grid = np.arange(k + 1) / k
    # 0 … 1 along the meeting
    breaks = np.concatenate(
        [[0.0, 1.0], (grid - start) / (stop - start), (grid - other_start) / (other_stop - other_start)]
    )
    breaks = np.sort(breaks[(breaks >= 0.0) & (breaks <= 1.0)])
    breaks = breaks[np.diff(breaks, prepend=-1.0) > MERGE]
    sides = []
    for patch, edge, u in (
        (meeting.patch, meeting.edge, start + breaks * (stop - start)),
        (meeting.other_patch, meeting.other_edge, other_start + breaks * (other_stop - other_start)),
    ):
        nearest = np.rint(u * k).astype(np.int64)
        vertices = ring[edge][nearest] + patch * (k + 1) ** 2
        for i in np.flatnonzero(np.abs(u - nearest / k) > MERGE).tolist():
            vertices[i] = found.on_edge(patch, edge, float(u[i]))
        sides.append(vertices)
    return np.stack(sides, axis=1)


def cell_fans(found: Junctions, k: int) -> Fans:
    """Cut cells with extra vertices on their sides into triangles round a new vertex in the middle."""
    extras: dict[tuple[int, int, int], list[list[tuple[float, int]]]] = defaultdict(lambda: [[], [], [], []])
    for (patch, edge), side in found.sides.items():
        for u, vertex in side:
            at = min(int(u * k), k - 1)
            i, j = ((0, at), (at, k - 1), (k - 1, at), (at, 0))[edge]
            extras[patch, i, j][edge].append((u, vertex))
    cells, triangles = [], []
    for (patch, i, j), (top, right, bottom, left) in extras.items():
        a = patch * (k + 1) ** 2 + i * (k + 1) + j
        b, c, d = a + (k + 1), a + (k + 2), a + 1
        # counter-clockwise: down the left side, along the bottom, up the right side, back along the top
        outline = [a, *_vertices(left), b, *_vertices(bottom), c]
        outline += [*_vertices(right)[::-1], d, *_vertices(top)[::-1]]
        middle = found.add(patch, (i + 0.5) / k, (j + 0.5) / k)
        triangles += [(middle, v, w) for v, w in zip(outline, outline[1:] + outline[:1], strict=True)]
        cells.append((patch * k + i) * k + j)
    return Fans(np.array(cells, dtype=np.int64), np.array(triangles, dtype=np.int32).reshape(-1, 3))


def _vertices(side: list[tuple[float, int]]) -> list[int]:
    """Return the vertices of a side in the order of their parameters."""
    return [vertex for _, vertex in side]


def weld(positions: FloatArray, pairs: NDArray[np.int64]) -> None:
    """Move all vertices that pairs (N, 2) connect to the position of the lowest of them, in place."""
    vertices, index = np.unique(pairs, return_inverse=True)
    a, b = index.reshape(-1, 2).T
    label = np.arange(len(vertices))
    while True:
        before = label
        lowest = np.minimum(label[a], label[b])
        label = label.copy()
        np.minimum.at(label, a, lowest)
        np.minimum.at(label, b, lowest)
        label = label[label]
        if np.array_equal(label, before):
            break
    positions[vertices] = positions[vertices[label]]
