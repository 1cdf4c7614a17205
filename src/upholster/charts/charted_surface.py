"""The charted surface: triangles with, at each corner, a position, a chart and a place on it.

Method "quilt" and the measures work on it, whatever it was made from: patches, meshes, CAD, a plane, a tile.
Only the functions that build one compare positions; after that, triangles meet where `across` says so.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.base.vectors import unit_vectors
from upholster.charts.mesh_layout import chart_places
from upholster.charts.tessellation.mesh import tessellate_by_bends
from upholster.charts.unwrap._raster_kernels import coverage
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.edge_pairs import edge_pairs, seams_of
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart
from upholster.runtime.stages import stage

__all__ = [
    "ChartedSurface",
    "charted_mesh",
    "charted_patches",
    "charted_plane",
    "charted_surface",
    "on_longer_steps",
    "steps_per_unit",
]

_ASIDE = (0.00071, 0.00131)
"""Offset of triangles, in steps. Without it, no triangle covers step centres on edges along rows or
columns."""

_TILE = 3
"""A tile is this many rectangles high and wide: with fewer, two edges would join the same two vertices."""


@dataclass(frozen=True, eq=False)
class ChartedSurface:
    """Triangles on charts.

    Attributes
    ----------
    mesh
        The triangles in space; two that share an edge are adjacent.
    chart
        (T,) int32: the chart of each triangle, −1 for none.
    places
        (T, 3, 2) float64: row and column of each corner on its chart, in steps; step (r, c) has its centre at
        (r + ½, c + ½). Triangles have the same orientation there as in space seen from outside.
    charts
        The charts.
    across
        (T, 3) int32: the neighbour across each edge, triangle · 3 + its edge, or −1, as in
        `TriangleMesh.neighbours`. Positions may differ on both sides: a tile continues at its opposite edge.
    """

    mesh: TriangleMesh
    chart: IntArray
    places: FloatArray
    charts: tuple[Chart, ...]
    across: IntArray

    @cached_property
    def is_tile(self) -> bool:
        """Whether some neighbours across an edge are at another place in space, as on a tile."""
        triangle, edge = np.nonzero(self.across >= 0)
        other, met = np.divmod(self.across[triangle, edge], 3)
        corners = self.mesh.triangles
        return bool((corners[triangle, edge] != corners[other, (met + 1) % 3]).any())

    @cached_property
    def is_seam(self) -> NDArray[np.bool_]:
        """Which edges of triangles are seams, (T, 3), where the neighbour is at another place of a chart."""
        return seams_of(self.across, self.places, self.chart)

    @cached_property
    def seams(self) -> NDArray[np.int64]:
        """The seams, each from one side, (n, 4), as triangle and edge, then the triangle and edge across.

        Triangles of one chart that meet at a pole each have their own place for that corner. Such edges, a
        step long, are left out: no texture shows between them.
        """
        triangle, edge = np.nonzero(
            self.is_seam & (self.across > 3 * np.arange(len(self.chart))[:, None] + 2)
        )
        other, met = np.divmod(self.across[triangle, edge], 3)
        here = self.places[triangle, edge], self.places[triangle, (edge + 1) % 3]
        there = self.places[other, (met + 1) % 3], self.places[other, met]
        joined = [(a == b).all(axis=1) for a, b in zip(here, there, strict=True)]
        short = [np.hypot(*(b - a).T) < 1.0 + 1e-9 for a, b in (here, there)]
        slit = (self.chart[triangle] == self.chart[other]) & np.any(joined, axis=0) & np.any(short, axis=0)
        found: NDArray[np.int64] = np.stack([triangle, edge, other, met], axis=1)[~slit]
        return found

    @cached_property
    def steps(self) -> FloatArray:
        """A step down and a step to the right, in space, (T, 3, 2); 0 for degenerate triangles."""
        return self._steps_of(np.arange(len(self.chart)))

    def _steps_of(self, triangle: NDArray[np.integer]) -> FloatArray:
        corners, places = self.mesh.corners[triangle], self.places[triangle]
        edges, steps = corners[:, 1:] - corners[:, :1], places[:, 1:] - places[:, :1]
        area = steps[:, 0, 0] * steps[:, 1, 1] - steps[:, 0, 1] * steps[:, 1, 0]
        sound = (area > 0) & (self.chart[triangle] >= 0)
        inverse = np.stack([steps[:, 1, 1], -steps[:, 1, 0], -steps[:, 0, 1], steps[:, 0, 0]], axis=1)
        inverse = inverse.reshape(-1, 2, 2) / np.where(sound, area, 1.0)[:, None, None]
        out: FloatArray = np.where(sound[:, None, None], np.einsum("tex,tef->txf", edges, inverse), 0.0)
        return out

    def beside(self, triangle: NDArray[np.integer], edge: NDArray[np.integer]) -> FloatArray:
        """Return steps in components along edges and inward from them, (n, 2, 2), in units of length.

        For the triangle across the edge both directions are reversed. This unfolds the two planes about the
        edge they share.
        """
        corners = self.mesh.corners
        along = unit_vectors(corners[triangle, (edge + 1) % 3] - corners[triangle, edge])
        inward = np.cross(self.mesh.flat_normals[triangle], along)
        out: FloatArray = np.stack([along, inward], axis=1) @ self._steps_of(triangle)
        return out

    def lies_on(self, index: int, corner: tuple[int, int], shape: tuple[int, int]) -> NDArray[np.bool_]:
        """Return which steps of a window of a chart are on triangles; `corner` is its first (row, column)."""
        times = np.zeros(shape, np.int32)
        coverage(self.places[self.chart == index] - corner + _ASIDE, times)
        return times > 0


def charted_surface(surface: AnySurface, charts: Sequence[Chart], *, finer: int = 1) -> ChartedSurface:
    """Return any surface with charts on it; `finer` is as in `charted_patches`, and ignored for a mesh.

    Raises
    ------
    InputError
        If a chart is not on the surface's faces, or the surface has no area.
    """
    if isinstance(surface, MeshSurface):
        return charted_mesh(surface, charts)
    return charted_patches(surface, charts, finer=finer)


@stage
def charted_mesh(surface: MeshSurface, charts: Sequence[Chart]) -> ChartedSurface:
    """Return a mesh's islands with a chart on each."""
    return ChartedSurface(
        surface.mesh, surface.island, chart_places(surface, charts), tuple(charts), surface.mesh.neighbours
    )


@stage
def charted_patches(surface: Surface, charts: Sequence[Chart], *, finer: int = 1) -> ChartedSurface:
    """Return a surface of patches, tessellated chart by chart, with its vertices on the surface.

    Triangles are so small that the surface, and the steps on it, are nearly linear on each; `finer` is the
    factor of further subdivision.
    """
    mesh, vertex = tessellate_by_bends(surface, charts, finer=finer)
    corners = mesh.all_triangles()
    used, triangles = np.unique(vertex[corners], return_inverse=True)
    triangles = triangles.reshape(-1, 3).astype(np.int32)
    a, b, c = triangles.T
    sound = (a != b) & (b != c) & (c != a)
    corners, triangles = corners[sound], triangles[sound]
    if not len(triangles):
        raise InputError("surface has no area; allowed: patches that are more than points and lines")
    own = TriangleMesh(mesh.positions[used], triangles, normals=mesh.normals[corners], name=surface.name)
    places = np.ascontiguousarray(mesh.places[corners])
    return ChartedSurface(own, mesh.chart[corners[:, 0]], places, tuple(charts), own.neighbours)


@stage
def charted_plane(chart: Chart, *, tile: bool = False) -> ChartedSurface:
    """Return a flat texture: a rectangle in space where a step is a unit of length, or a tile.

    Seen from +z, rows run to −y and columns to x.

    Parameters
    ----------
    chart
        Its height and width give the number of steps.
    tile
        Opposite edges are neighbours: a block that leaves the chart at one edge continues at the opposite
        one.
    """
    cells = _TILE if tile else 1
    rows, columns = (np.linspace(0.0, side, cells + 1) for side in (chart.height, chart.width))
    grid = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).reshape(-1, 2)
    row, column = (part.ravel() for part in np.indices((cells, cells)))
    a = row * (cells + 1) + column
    b, c, d = a + cells + 1, a + cells + 2, a + 1
    triangles = np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3).astype(np.int32)
    positions = np.stack([grid[:, 1], -grid[:, 0], np.zeros(len(grid))], axis=1)
    mesh = TriangleMesh(positions, triangles, name="plane")
    across = mesh.neighbours
    if tile:
        down, right = np.divmod(np.arange(len(grid)), cells + 1)
        met = ((down % cells) * cells + right % cells).astype(np.int32)
        across = edge_pairs(positions, met[triangles])
    return ChartedSurface(mesh, np.zeros(len(triangles), np.int32), grid[triangles], (chart,), across)


@stage
def on_longer_steps(surface: ChartedSurface, octaves: int) -> ChartedSurface:
    """Return the same surface with charts whose steps are longer, by this many powers of two."""
    charts = tuple(
        replace(chart, height=max(1, chart.height >> octaves), width=max(1, chart.width >> octaves))
        for chart in surface.charts
    )
    before, after = (np.array([(one.height, one.width) for one in of]) for of in (surface.charts, charts))
    return replace(surface, charts=charts, places=surface.places * (after / before)[surface.chart][:, None])


@stage
def steps_per_unit(surface: ChartedSurface) -> float:
    """Return the mean number of steps per model unit over the charts."""
    flat = surface.places[:, 1:] - surface.places[:, :1]
    steps = 0.5 * np.abs(flat[:, 0, 0] * flat[:, 1, 1] - flat[:, 0, 1] * flat[:, 1, 0])
    kept = surface.chart >= 0
    return float(np.sqrt(steps[kept].sum() / surface.mesh.areas[kept].sum()))
