"""Flattening a mesh into islands that preserve lengths as well as possible."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.base.display import number_of
from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.charts.far_vertices import far_vertices
from upholster.charts.unwrap.clusters import Triangles, clusters, divided
from upholster.charts.unwrap.file_islands import kept_islands
from upholster.charts.unwrap.flat_piece import Flat, flatten, percentile, shapes_of, signed_areas, stretches
from upholster.charts.unwrap.island_merge import Layout, join_islands
from upholster.charts.unwrap.pieces import Piece, pieces_of
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.runtime.parallel import quietly, report_progress, run_tasks

__all__ = ["UnwrapReport", "unwrap"]

_STAGE = "unwrap"


@dataclass(frozen=True)
class UnwrapReport:
    """The quality of a flattened mesh.

    Attributes
    ----------
    islands
        Number of islands.
    plain
        Number of triangles with an area that are on no island because they were not chosen.
    flat
        Number of chosen triangles that are on no island because they have no area.
    density
        1st, 5th, 50th, 95th and 99th percentile, by area, of (flattened area)/(area in space).
    stretch
        The same percentiles of the ratio of a triangle's longest to its shortest stretch.
    notes
        Sentences for the user.
    """

    islands: int
    plain: int
    flat: int
    density: tuple[float, ...]
    stretch: tuple[float, ...]
    notes: list[str] = field(default_factory=list)

    @property
    def spread(self) -> float:
        """99th percentile of the density over the 1st percentile."""
        return self.density[-1] / self.density[0]


def unwrap(
    mesh: TriangleMesh,
    *,
    keep_uv: bool = False,
    crease: float | None = None,
    chosen: NDArray[np.bool_] | None = None,
) -> tuple[MeshSurface, UnwrapReport]:
    """Flatten a mesh: few islands without overlaps, with areas and lengths nearly as in space.

    Islands are clusters of triangles with similar normals, each flattened as rigidly as possible; those that
    do not flatten well are divided. Each has its area in space, and is rotated for the smallest rectangle.
    The result does not depend on the number of threads. Progress has the stage "unwrap", in triangles.

    Parameters
    ----------
    mesh
        Its triangles meet at common vertices: see `upholster.geometry.meshes.triangle_mesh.welded`.
    keep_uv
        Whether to use the islands of its own texture coordinates. They must not overlap.
    crease
        Edges where the surface bends by more than this many degrees, 0 to 180, are seams.
    chosen
        (T,): the triangles to flatten; by default all.

    Raises
    ------
    InputError
        If no triangle has an area. With ``keep_uv``: if there are no texture coordinates, or they overlap, or
        are stretched unevenly on more than 1 % of the area.
    """
    wanted = _wanted(mesh, crease, chosen)
    rows = np.flatnonzero(wanted & _extended(mesh))
    if not (mesh.areas[rows] > 0).any():
        raise InputError("no triangle has an area; allowed: a mesh with a surface")
    low, high = mesh.corners[rows].min(axis=(0, 1)), mesh.corners[rows].max(axis=(0, 1))
    size = float((high - low).max())
    used, compact = np.unique(mesh.triangles[rows], return_inverse=True)
    uv = None if mesh.uv is None else mesh.uv[rows]
    scaled = TriangleMesh((mesh.positions[used] - low) / size, compact.reshape(-1, 3).astype(np.int32), uv=uv)
    across = _cut_at_creases(scaled, crease)
    far = far_vertices(TriangleMesh(mesh.positions, mesh.triangles[rows]))
    notes = [*_notes(scaled), *([] if far is None else [far.words])]
    own, corners = _kept(scaled, across, crease, notes) if keep_uv else _laid_out(scaled, across)
    island = np.full(len(mesh.triangles), -1, np.int32)
    parameters = np.zeros((len(mesh.triangles), 3, 2))
    island[rows], parameters[rows] = own, corners * size
    surface = MeshSurface(mesh, island, parameters)
    return surface, _report(surface, notes, wanted)


def _wanted(mesh: TriangleMesh, crease: float | None, chosen: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    count = len(mesh.triangles)
    if crease is not None and not 0 <= crease <= 180:
        raise InputError(f"crease is {crease!r}; allowed: 0 to 180 degrees")
    if chosen is None:
        return np.ones(count, bool)
    if np.shape(chosen) != (count,) or np.asarray(chosen).dtype != bool:
        raise InputError(f"chosen has shape {np.shape(chosen)}; allowed: ({count},) of true or false")
    return np.asarray(chosen)


def _extended(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """Return which triangles, (T,), name three vertices and are more than a point."""
    a, b, c = mesh.triangles.T
    edges = (np.roll(mesh.corners, -1, axis=1) - mesh.corners) / (mesh.size or 1.0)
    long = np.einsum("tki,tki->tk", edges, edges).max(axis=1, initial=0.0) > 0
    return np.asarray((a != b) & (b != c) & (c != a) & long)


def _cut_at_creases(mesh: TriangleMesh, crease: float | None) -> IntArray:
    across = mesh.neighbours.copy()
    if crease is not None:
        bend = (mesh.flat_normals[across // 3] * mesh.flat_normals[:, None]).sum(axis=2)
        real = (mesh.areas > 0)[:, None] & (mesh.areas > 0)[across // 3]
        across[real & (bend < np.cos(np.radians(crease)))] = -1
    return across


def _kept(
    mesh: TriangleMesh, across: IntArray, crease: float | None, notes: list[str]
) -> tuple[IntArray, FloatArray]:
    """Take the islands of the mesh's own texture coordinates, and flatten again the few uneven ones."""
    island, corners = kept_islands(mesh, across)
    rest = np.flatnonzero(island < 0)
    if len(rest):
        part = TriangleMesh(mesh.positions, mesh.triangles[rest])
        with quietly():
            own, corners[rest] = _laid_out(part, _cut_at_creases(part, crease))
        island[rest] = own + island.max() + 1
        notes.append(
            f"the texture coordinates of {number_of(len(rest), 'triangle')} are too uneven to keep: "
            "flattened again"
        )
    return island, corners


def _laid_out(mesh: TriangleMesh, across: IntArray) -> tuple[IntArray, FloatArray]:
    """Flatten all pieces, divide those that do not flatten well until they do, and join those that unroll."""
    linked, across = across, across.copy()
    triangles = Triangles(mesh.corners, mesh.areas, mesh.flat_normals, across)
    label = clusters(across, triangles)
    across[label[across // 3] != label[:, None]] = -1
    island, parameters = np.full(len(across), -1, np.int32), np.zeros((len(across), 3, 2))
    waiting, times = np.ones(len(across), bool), np.zeros(len(across), np.int32)
    count = 0
    while waiting.any():
        pieces = list(pieces_of(across, waiting))
        waiting[:] = False
        for piece, flat in zip(pieces, _flattened(mesh, pieces), strict=True):
            own = piece.triangles
            if flat is not None and (flat.good or len(own) == 1):
                island[own], parameters[own] = count, flat.parameters
                count += 1
                continue
            label[own], times[own] = divided(piece, triangles, int(times[own[0]]))
            across[own] = np.where(label[across[own] // 3] == label[own, None], across[own], -1)
            waiting[own] = True
        report_progress(_STAGE, len(across) - int(waiting.sum()), len(across))
    join_islands(mesh, linked, Layout(across, island, parameters))
    return island, parameters


def _flattened(mesh: TriangleMesh, pieces: list[Piece]) -> list[Flat | None]:
    """Flatten pieces in parallel; None for those with handles or without a border."""
    out: list[Flat | None] = [None] * len(pieces)

    def lay(number: int) -> None:
        own = pieces[number].triangles
        out[number] = flatten(pieces[number], mesh.corners[own], mesh.areas[own], mesh.flat_normals[own])

    able = [number for number, piece in enumerate(pieces) if piece.handles == 0 and piece.loops > 0]
    able.sort(key=lambda number: -len(pieces[number].triangles))  # the longest first: threads end together
    tasks: list[Callable[[], object]] = [partial(lay, number) for number in able]
    run_tasks(tasks)
    return out


def _report(surface: MeshSurface, notes: list[str], wanted: NDArray[np.bool_]) -> UnwrapReport:
    mesh = surface.mesh
    real = (surface.island >= 0) & (mesh.areas > 0)
    shares = (0.01, 0.05, 0.5, 0.95, 0.99)
    areas, corners = mesh.areas[real], surface.parameters[real]
    density = percentile(signed_areas(corners) / areas, areas, shares)
    stretch = percentile(stretches(shapes_of(mesh.corners[real]), corners), areas, shares)
    return UnwrapReport(
        surface.islands,
        int((~wanted & (mesh.areas > 0)).sum()),
        int((wanted & (surface.island < 0)).sum()),
        tuple(density),
        tuple(stretch),
        notes,
    )


def _notes(mesh: TriangleMesh) -> list[str]:
    """Describe what is odd about a mesh and may cause seams."""
    ends = np.sort(np.stack([mesh.triangles, np.roll(mesh.triangles, -1, axis=1)], axis=-1), axis=-1)
    keys = (ends[..., 0].astype(np.int64) * len(mesh.positions) + ends[..., 1]).ravel()
    _, edge, uses = np.unique(keys, return_inverse=True, return_counts=True)
    alone = np.bincount(edge.ravel(), mesh.neighbours.ravel() < 0)
    several, turned = int((uses > 2).sum()), int(((uses == 2) & (alone == 2)).sum())
    notes = []
    if several:
        notes.append(
            f"{number_of(several, 'edge belongs', 'edges belong')} to three or more triangles: those nearest "
            "to one plane continue there"
        )
    if turned:
        notes.append(f"at {number_of(turned, 'edge')} triangles have opposite orientations: a seam there")
    return notes
