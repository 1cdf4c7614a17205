"""A watertight mesh of quadrilaterals over a surface."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray, frozen_array
from upholster.charts.chart_seams import ChartSeam, find_seams
from upholster.charts.tessellation.grids import EPS, VertexGrid, bent_counts, chart_grids, even_counts
from upholster.charts.tessellation.junctions import Junctions, cell_fans, find_junctions, weld
from upholster.geometry.components import connected
from upholster.geometry.patches.face import Face
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart

__all__ = ["MAX_QUADS", "Mesh", "face_parameters", "own_patches", "tessellate", "tessellate_by_bends"]

MAX_QUADS = 10_000_000

_SPARE, _EACH_PATCH, _EACH_STEP = 2**13, 64, 1 / 8
"""Quadrilaterals that a surface's bends may ask for, and so many more for each patch and step. Only patches
that are much longer at one place than at others, as towards a stray control point, ask for more."""

Numbers = NDArray[np.floating[Any]]


@dataclass(frozen=True, slots=True)
class Mesh:
    """Quadrilaterals over each chart, and triangles where another chart's vertices are on a side.

    Each vertex belongs to one chart. Where charts meet, their vertices have exactly the same position, so a
    closed surface gives a mesh without gaps. Polygons run counter-clockwise seen from outside.

    Attributes
    ----------
    positions
        (V, 3) float64, in the model's units.
    normals
        (V, 3) float64, unit length: the surface's exact normals.
    places
        (V, 2) float64: (row, column) on the chart in texels, from 0 to its height and width; texel (r, c) has
        its centre at (r + ½, c + ½).
    chart
        (V,) int32: the chart of each vertex.
    quads
        (Q, 4) int32: vertices of a quadrilateral; two may coincide at a degenerate edge.
    triangles
        (T, 3) int32: only where vertices of two charts that meet do not match.
    """

    positions: FloatArray
    normals: FloatArray
    places: FloatArray
    chart: IntArray
    quads: IntArray
    triangles: IntArray

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name in ("positions", "normals", "places", "chart", "quads", "triangles"):
            frozen_array(getattr(self, name))

    def all_triangles(self) -> IntArray:
        """Return all polygons as triangles (N, 3) int32; quadrilaterals are cut from first to third vertex.

        Triangles with two corners at one position are left out.
        """
        halves = self.quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
        corners = np.concatenate([halves, self.triangles])
        # only quadrilaterals at degenerate edges collapse: check only those whose corners coincide in x
        x = self.positions[:, 0]
        a, b, c = x[corners[:, 0]], x[corners[:, 1]], x[corners[:, 2]]
        maybe = np.flatnonzero((a == b) | (b == c) | (c == a))
        positions = self.positions[corners[maybe]]
        same = (positions == positions[:, [1, 2, 0]]).all(axis=2).any(axis=1)
        return np.delete(corners, maybe[same], axis=0)


def tessellate(
    surface: Surface,
    charts: Sequence[Chart] | None = None,
    seams: Sequence[ChartSeam] | None = None,
    *,
    quads: int = 50_000,
) -> Mesh:
    """Cover a surface with about `quads` quadrilaterals.

    They are distributed by texels: each is about as many texels high and wide as any other, so charts of one
    size have equal numbers. Complete sides that meet get equal numbers. A patch gets at least a quarter of an
    even share each way, unless there are too many patches; its borders are borders of quadrilaterals.

    Parameters
    ----------
    surface
        The surface to cover.
    charts
        The charts on it; by default one per face, with one texel per patch.
    seams
        Where they meet, see `upholster.charts.chart_seams.find_seams`; found by default.
    quads
        Wanted number over the complete surface: 1 to 10,000,000.

    Returns
    -------
    Mesh
        Watertight where charts meet. Each chart's vertices are consecutive, row by row, from chart 0 on;
        vertices that only T-junctions need are at the end.

    Raises
    ------
    InputError
        If quads is outside its range; and as for `find_seams`.
    """
    if not (isinstance(quads, int) and 1 <= quads <= MAX_QUADS):
        raise InputError(f"quads is {quads}; allowed: 1 to {MAX_QUADS}")
    if charts is None:
        charts = [
            Chart(n, face.rows, face.columns, 0.0, float(face.rows), 0.0, float(face.columns))
            for n, face in enumerate(surface.faces)
        ]
    if seams is None:
        seams = find_seams(surface, charts)
    grids = chart_grids(surface, charts, *even_counts(surface, charts, seams, quads))
    return _on_grids(surface, charts, seams, grids)[0]


def tessellate_by_bends(
    surface: Surface, charts: Sequence[Chart], *, finer: int = 1
) -> tuple[Mesh, IntArray]:
    """Cover charts with as few quadrilaterals as their bends allow, see `bent_counts`.

    Each of these is then cut into `finer` parts, each way.

    Returns
    -------
    Mesh
        As for `tessellate`.
    ndarray
        (V,) a number for each vertex, equal for vertices that meet.

    Raises
    ------
    InputError
        If there would be far more quadrilaterals than the charts' steps explain.
    """
    seams = find_seams(surface, charts)
    counts, least = bent_counts(surface, charts, seams)
    quads = counts.prod(axis=1)
    steps = sum(chart.height * chart.width for chart in charts)
    most = _SPARE + _EACH_PATCH * len(surface.patches) + _EACH_STEP * steps
    if quads.sum() > most:
        chart = charts[int(quads.argmax())]
        raise InputError(
            f"face {chart.face} is bent so unevenly that {quads.sum():,.0f} quadrilaterals would stand for "
            f"{steps:,} steps on the surface; allowed: {most:,.0f}, as with more texels or "
            "without stray control points"
        )
    grids = chart_grids(surface, charts, finer * counts, least, tips=True)
    mesh, pairs = _on_grids(surface, charts, seams, grids)
    return mesh, connected(len(mesh.chart), pairs)


def _on_grids(
    surface: Surface, charts: Sequence[Chart], seams: Sequence[ChartSeam], grids: Sequence[VertexGrid]
) -> tuple[Mesh, NDArray[np.int64]]:
    # The mesh, and which of its vertices coincide, (N, 2).
    found = find_junctions(surface, charts, seams, grids)
    fans = cell_fans(found, grids)
    parts = [_grid_vertices(surface, chart, grid) for chart, grid in zip(charts, grids, strict=True)]
    if found.chart:
        parts.append(_extra_vertices(surface, charts, found))
    positions, normals, places = (np.concatenate(part) for part in zip(*parts, strict=True))
    owner = np.repeat(np.arange(len(charts), dtype=np.int32), [grid.vertices for grid in grids])
    polygons = np.concatenate([_polygons(grid) for grid in grids])
    weld(positions, found.pairs)
    mesh = Mesh(
        positions,
        normals,
        places,
        np.concatenate([owner, np.array(found.chart, np.int32)]),
        np.delete(polygons, fans.cells, axis=0),
        fans.triangles,
    )
    return mesh, found.pairs


def face_parameters(chart: Chart, rows: Numbers, columns: Numbers) -> tuple[FloatArray, FloatArray]:
    """Return the face's parameters (s, t) at places on a chart, in texels: exact at its borders."""
    u, v = rows / chart.height, columns / chart.width
    return chart.s0 * (1.0 - u) + chart.s1 * u, chart.t0 * (1.0 - v) + chart.t1 * v


def own_patches(surface: Surface, chart: Chart) -> tuple[Face, Chart]:
    """Return the patches under a chart, as a face, and the chart on that face.

    The chart's borders are then evaluated on these patches. At a crease, the complete face may use the
    patches beyond it instead.
    """
    face = surface.faces[chart.face]
    top, left = int(chart.s0 + EPS), int(chart.t0 + EPS)
    rows, columns = slice(top, math.ceil(chart.s1 - EPS)), slice(left, math.ceil(chart.t1 - EPS))
    part = Face([row[columns] for row in face.patches[rows]])
    s0, s1, t0, t1 = chart.s0 - top, chart.s1 - top, chart.t0 - left, chart.t1 - left
    return part, Chart(0, chart.height, chart.width, s0, s1, t0, t1)


def _grid_vertices(surface: Surface, chart: Chart, grid: VertexGrid) -> tuple[FloatArray, ...]:
    """Return positions, normals and places of a chart's uniform grid, row by row."""
    face, chart = own_patches(surface, chart)
    positions, normals = face.frames_grid(*face_parameters(chart, grid.rows, grid.columns))
    places = np.stack(np.meshgrid(grid.rows, grid.columns, indexing="ij"), axis=-1)
    return positions.reshape(-1, 3), normals.reshape(-1, 3), places.reshape(-1, 2)


def _polygons(grid: VertexGrid) -> IntArray:
    """Return a chart's quadrilaterals, row by row, (Q, 4)."""
    width = len(grid.columns)
    down, right = np.arange(len(grid.rows) - 1)[:, None], np.arange(width - 1)
    corner = (grid.first + down * width + right).ravel()
    return np.stack([corner, corner + width, corner + width + 1, corner + 1], axis=1).astype(np.int32)


def _extra_vertices(surface: Surface, charts: Sequence[Chart], found: Junctions) -> tuple[FloatArray, ...]:
    """Return positions, normals and places of the vertices outside the charts' grids."""
    owner, places = np.array(found.chart), np.array(found.places)
    positions, normals = np.empty((len(owner), 3)), np.empty((len(owner), 3))
    order = np.argsort(owner, kind="stable")
    for mine in np.split(order, np.flatnonzero(np.diff(owner[order])) + 1):
        face, chart = own_patches(surface, charts[owner[mine[0]]])
        positions[mine], normals[mine] = face.frames(*face_parameters(chart, *places[mine].T))
    return positions, normals, places
