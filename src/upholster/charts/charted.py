"""The charted surface: triangles with, at each corner, a position, a chart and a place on it.

All synthesis works on it, wherever it came from: patches, meshes, CAD, a plane, a tile. Only what builds one
compares positions; behind it, triangles meet where `across` says so.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.charts.mesh_layout import chart_places
from upholster.charts.tessellation import tessellate_by_bends
from upholster.geometry import MeshSurface, Surface, TriangleMesh
from upholster.geometry.edge_pairs import edge_pairs, seams_of
from upholster.quilt.chart import Chart
from upholster.stages import stage
from upholster.types import FloatArray, IntArray

__all__ = ["ChartedSurface", "charted_mesh", "charted_patches", "charted_plane", "on_longer_steps"]

_TILE = 3
"""A tile is so many rectangles high and wide: with fewer, two edges would join the same two vertices."""


@dataclass(frozen=True, eq=False)
class ChartedSurface:
    """Triangles on charts.

    Attributes
    ----------
    mesh
        The triangles in space; two that share an edge meet there.
    chart
        (T,) int32: the chart that each lies on, −1 for none.
    places
        (T, 3, 2) float64: row and column of each corner on its chart in steps, step (r, c) has its middle at
        (r + ½, c + ½). Triangles turn the same way there as seen from outside in space.
    charts
        The charts.
    across
        (T, 3) int32: what lies across each edge, triangle · 3 + its edge, or −1, as
        `TriangleMesh.neighbours`. Positions may differ on both sides: a tile goes on at its other end.
    """

    mesh: TriangleMesh
    chart: IntArray
    places: FloatArray
    charts: tuple[Chart, ...]
    across: IntArray

    @cached_property
    def is_tile(self) -> bool:
        """Whether it goes on at another place in space, as a tile does."""
        triangle, edge = np.nonzero(self.across >= 0)
        other, met = np.divmod(self.across[triangle, edge], 3)
        corners = self.mesh.triangles
        return bool((corners[triangle, edge] != corners[other, (met + 1) % 3]).any())

    @cached_property
    def is_seam(self) -> NDArray[np.bool_]:
        """Which edges of triangles are seams, (T, 3): something meets there, at another place of a chart."""
        return seams_of(self.across, self.places, self.chart)


@stage
def charted_mesh(surface: MeshSurface, charts: Sequence[Chart]) -> ChartedSurface:
    """Return a mesh's islands with a chart on each."""
    return ChartedSurface(
        surface.mesh, surface.island, chart_places(surface, charts), tuple(charts), surface.mesh.neighbours
    )


@stage
def charted_patches(surface: Surface, charts: Sequence[Chart]) -> ChartedSurface:
    """Return a surface of patches, tessellated chart by chart: vertices lie on it.

    Triangles are as large as the surface, and the steps on it, are nearly linear.
    """
    mesh, vertex = tessellate_by_bends(surface, charts)
    corners = mesh.all_triangles()
    used, triangles = np.unique(vertex[corners], return_inverse=True)
    triangles = triangles.reshape(-1, 3).astype(np.int32)
    a, b, c = triangles.T
    sound = (a != b) & (b != c) & (c != a)
    corners, triangles = corners[sound], triangles[sound]
    own = TriangleMesh(mesh.positions[used], triangles, normals=mesh.normals[corners], name=surface.name)
    places = np.ascontiguousarray(mesh.places[corners])
    return ChartedSurface(own, mesh.chart[corners[:, 0]], places, tuple(charts), own.neighbours)


@stage
def charted_plane(chart: Chart, *, tile: bool = False) -> ChartedSurface:
    """Return a flat texture: a rectangle in space with a step a unit of length, or a tile.

    Rows run to −y and columns to x, seen from +z.

    Parameters
    ----------
    chart
        How many steps it is high and wide.
    tile
        Opposite edges are neighbours: what leaves the chart at one comes back at the other.
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
    """Return the same surface with charts of longer steps, by so many powers of two."""
    charts = tuple(
        replace(chart, height=max(1, chart.height >> octaves), width=max(1, chart.width >> octaves))
        for chart in surface.charts
    )
    before, after = (np.array([(one.height, one.width) for one in of]) for of in (surface.charts, charts))
    return replace(surface, charts=charts, places=surface.places * (after / before)[surface.chart][:, None])
