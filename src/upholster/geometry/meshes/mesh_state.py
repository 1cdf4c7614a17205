"""The state of a mesh, part by part: holes, edges of several triangles, slivers, texture coordinates."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.geometry.components import connected
from upholster.geometry.meshes._mesh_state_kernels import count_covers
from upholster.geometry.meshes.triangle_mesh import TriangleMesh

__all__ = ["PartState", "UvState", "inside_out_parts", "mesh_states", "uv_state"]

SLIVER = 50.0
"""A sliver's longest edge is more than this many times its height."""

_NO_AREA = 1e6
_SAMPLES = 64
"""Cells per triangle in the raster on which overlaps are counted."""

_SIDES = (256, 2048)


@dataclass(frozen=True)
class UvState:
    """Texture coordinates of some triangles.

    Attributes
    ----------
    overlapping
        Share of the covered area that more than one triangle covers; sampled.
    mirrored
        Share of their area that is mirrored when seen from outside.
    outside
        Share of triangles with a corner outside 0 to 1.
    collapsed
        Share of triangles that have an area in space but none here.
    """

    overlapping: float
    mirrored: float
    outside: float
    collapsed: float


@dataclass(frozen=True, eq=False)
class PartState:
    """One part of a mesh.

    Attributes
    ----------
    triangles, vertices
        Their numbers.
    area
        Area in square model units.
    box
        (2, 3) least and greatest coordinates.
    components
        Number of pieces connected by edges.
    holes, border_edges
        Numbers of loops of edges that have a single triangle in the complete mesh, and of those edges.
    crowded_edges
        Number of edges with more than two triangles.
    turned_edges
        Number of edges whose two triangles have opposite orientations.
    inside_out
        As `inside_out_parts`.
    degenerate, slivers
        Numbers of triangles without area, and of others whose longest edge is more than 50 times their
        height.
    uv
        State of its texture coordinates; None without any.
    """

    triangles: int
    vertices: int
    area: float
    box: FloatArray
    components: int
    holes: int
    border_edges: int
    crowded_edges: int
    turned_edges: int
    inside_out: bool
    degenerate: int
    slivers: int
    uv: UvState | None


@dataclass(frozen=True, eq=False)
class _Edges:
    """Edges of a mesh with the triangles that have them.

    Attributes
    ----------
    order
        (3T,) triangle · 3 + edge, grouped by edge.
    edge
        (3T,) the number of each one's edge.
    uses
        Number of triangles at each edge.
    rising
        (3T,) whether the triangle traverses it towards the higher vertex.
    """

    order: NDArray[np.int64]
    edge: NDArray[np.int64]
    uses: NDArray[np.int64]
    rising: NDArray[np.bool_]

    @property
    def along(self) -> NDArray[np.int64]:
        """How many triangles traverse each edge towards the higher vertex."""
        return np.bincount(self.edge[self.rising], minlength=len(self.uses))

    @property
    def pairs(self) -> NDArray[np.int64]:
        """Triangles with a common edge, (P, 2)."""
        triangle = self.order // 3
        both = np.stack([triangle[:-1], triangle[1:]], axis=1)
        found: NDArray[np.int64] = both[self.edge[1:] == self.edge[:-1]]
        return found


def mesh_states(mesh: TriangleMesh, uv: FloatArray | None = None) -> list[PartState]:
    """Return the state of each part of a mesh.

    Parameters
    ----------
    mesh
        The mesh.
    uv
        Texture coordinates (T, 3, 2), with NaN for parts that have none; by default those of the mesh.
    """
    uv = mesh.uv if uv is None else uv
    edges = _edges_of(mesh)
    parts = len(mesh.parts)
    owner = mesh.part[edges.order // 3]
    uses = edges.uses[edges.edge]
    border = uses == 1
    # Two triangles that traverse an edge in the same direction.
    turned = (edges.uses == 2) & (edges.along != 1)
    firsts = np.flatnonzero(np.diff(edges.edge, prepend=-1))
    of_edge = mesh.part[edges.order[firsts] // 3]
    pieces_of = _pieces(mesh, edges)
    holes = _loops(mesh, edges.order[border])
    longest, height = _shape(mesh)
    flat = ~(longest < _NO_AREA * height)
    thin = ~flat & (longest > SLIVER * height)
    inside_out = _inside_out(mesh, edges)
    counts = [
        np.bincount(array, minlength=parts)
        for array in (
            mesh.part[pieces_of],
            mesh.part[holes],
            owner[border],
            of_edge[edges.uses > 2],
            of_edge[turned],
            mesh.part[flat],
            mesh.part[thin],
        )
    ]
    starts = np.argsort(mesh.part, kind="stable")
    groups = np.split(starts, np.cumsum(np.bincount(mesh.part, minlength=parts))[:-1])
    out = []
    for part, mine in enumerate(groups):
        pieces, loops, borders, crowded, against, degenerate, slivers = (int(each[part]) for each in counts)
        points = mesh.corners[mine].reshape(-1, 3)
        out.append(
            PartState(
                len(mine),
                len(np.unique(mesh.triangles[mine])),
                float(mesh.areas[mine].sum()),
                np.stack([points.min(axis=0), points.max(axis=0)]),
                pieces,
                loops,
                borders,
                crowded,
                against,
                bool(inside_out[part]),
                degenerate,
                slivers,
                None if uv is None or not np.isfinite(uv[mine]).all() else uv_state(uv[mine], flat[mine]),
            )
        )
    return out


def inside_out_parts(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """Return for each part of a mesh whether it is closed and its triangles face inward, (parts,).

    Parts that share edges are one body. It is closed if its triangles traverse every edge as often in one
    direction as in the other, and faces inward if its volume is negative.
    """
    return _inside_out(mesh, _edges_of(mesh))


def _inside_out(mesh: TriangleMesh, edges: _Edges) -> NDArray[np.bool_]:
    body = connected(len(mesh.parts), mesh.part[edges.pairs])
    at_border = (2 * edges.along != edges.uses)[edges.edge]
    is_open = np.bincount(body[mesh.part[edges.order // 3][at_border]], minlength=len(body)) > 0
    a, b, c = mesh.corners.transpose(1, 0, 2) - mesh.box.mean(axis=0)
    volume = np.bincount(body[mesh.part], (a * np.cross(b, c)).sum(axis=1), len(body))
    found: NDArray[np.bool_] = (~is_open & (volume < 0))[body]
    return found


def uv_state(uv: FloatArray, flat: NDArray[np.bool_] | None = None) -> UvState:
    """Return the state of texture coordinates.

    Parameters
    ----------
    uv
        (T, 3, 2) at triangles' corners, v downward; seen from outside, triangles are counter-clockwise.
    flat
        (T,) triangles without area in space.
    """
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    with np.errstate(over="ignore", invalid="ignore"):
        turn = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area = float(np.abs(turn).sum())
    outside = ((uv < -1e-6) | (uv > 1 + 1e-6)).any(axis=(1, 2))
    solid = np.ones(len(uv), bool) if flat is None else ~flat
    return UvState(
        _overlapping(uv),
        float(turn[turn > 0].sum() / area) if area > 0 else 0.0,
        float(outside.mean()),
        float((turn[solid] == 0).mean()) if solid.any() else 0.0,
    )


def _overlapping(uv: FloatArray) -> float:
    """Return the share of covered cells that several triangles cover."""
    low, high = uv.min(axis=(0, 1)), uv.max(axis=(0, 1))
    span = float((high - low).max())
    if not 0 < span < 1e12:
        return 0.0
    side = int(np.clip((_SAMPLES * len(uv)) ** 0.5, *_SIDES))
    counts = np.zeros((side, side), np.uint8)
    count_covers(np.ascontiguousarray((uv - low) * (side / span)), counts)
    covered = int((counts > 0).sum())
    return int((counts > 1).sum()) / covered if covered else 0.0


def _edges_of(mesh: TriangleMesh) -> _Edges:
    first = mesh.triangles.astype(np.int64)
    last = np.roll(first, -1, axis=1)
    keys = (np.minimum(first, last) * len(mesh.positions) + np.maximum(first, last)).reshape(-1)
    real = np.flatnonzero((first != last).reshape(-1))
    order = real[np.argsort(keys[real], kind="stable")]
    ranked = keys[order]
    new = np.diff(ranked, prepend=-1) != 0
    edge = np.cumsum(new) - 1
    return _Edges(order, edge, np.bincount(edge), (first < last).reshape(-1)[order])


def _pieces(mesh: TriangleMesh, edges: _Edges) -> NDArray[np.int64]:
    """Return one triangle of each piece; pieces do not extend over several parts."""
    pairs = edges.pairs[np.ptp(mesh.part[edges.pairs], axis=1) == 0]
    count = len(mesh.triangles)
    return np.flatnonzero(connected(count, pairs) == np.arange(count))


def _loops(mesh: TriangleMesh, border: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return one triangle of each loop of edges, given as triangle · 3 + edge."""
    triangle, edge = border // 3, border % 3
    ends = np.stack([mesh.triangles[triangle, edge], mesh.triangles[triangle, (edge + 1) % 3]], axis=1)
    root = connected(len(mesh.positions), ends)
    _, first = np.unique(root[ends[:, 0]], return_index=True)
    return triangle[first]


def _shape(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """Return each triangle's longest edge, and its height over it."""
    sides = np.roll(mesh.corners, -1, axis=1) - mesh.corners
    longest = np.sqrt((sides**2).sum(axis=2).max(axis=1))
    height = np.divide(2 * mesh.areas, longest, out=np.zeros_like(longest), where=longest > 0)
    return longest, height
