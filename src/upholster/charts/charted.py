"""The charted surface: triangles with, at each corner, a position, a chart and a place on it.

All synthesis works on it, wherever it came from: patches, meshes, CAD, a plane, a tile. Only what builds one
compares positions; behind it, triangles meet where `across` says so.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.charts.mesh_layout import chart_places
from upholster.charts.seams import find_seams
from upholster.charts.tessellation import tessellate
from upholster.geometry import MeshSurface, Surface, TriangleMesh
from upholster.geometry.triangle_mesh import welded
from upholster.quilt.chart import Chart
from upholster.types import FloatArray, IntArray

__all__ = ["ChartedSurface", "charted_mesh", "charted_patches"]


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
    """

    mesh: TriangleMesh
    chart: IntArray
    places: FloatArray
    charts: tuple[Chart, ...]

    @cached_property
    def is_seam(self) -> NDArray[np.bool_]:
        """Which edges of triangles are seams, (T, 3): something meets there, at another place of a chart."""
        across = self.mesh.neighbours
        other, edge = across // 3, across % 3
        here, there = self.places, self.places[other]
        rows = np.arange(len(other))[:, None].repeat(3, axis=1)
        met_last = there[rows, np.arange(3), edge]
        met_first = there[rows, np.arange(3), (edge + 1) % 3]
        same = (here == met_first).all(axis=2) & (np.roll(here, -1, axis=1) == met_last).all(axis=2)
        same &= self.chart[other] == self.chart[:, None]
        found: NDArray[np.bool_] = (
            (across >= 0) & ~same & (self.chart[:, None] >= 0) & (self.chart[other] >= 0)
        )
        return found


def charted_mesh(surface: MeshSurface, charts: Sequence[Chart]) -> ChartedSurface:
    """Return a mesh's islands with a chart on each."""
    return ChartedSurface(surface.mesh, surface.island, chart_places(surface, charts), tuple(charts))


def charted_patches(surface: Surface, charts: Sequence[Chart]) -> ChartedSurface:
    """Return a surface of patches, tessellated chart by chart: vertices lie on it."""
    steps = sum(chart.height * chart.width for chart in charts)
    quads = int(np.clip(steps / 16**2, 64 * len(charts), 40_000))
    mesh = tessellate(surface, charts, find_seams(surface, charts), quads=quads)
    corners = mesh.all_triangles()
    positions, vertex = welded(mesh.positions)
    triangles = vertex[corners]
    a, b, c = triangles.T
    sound = (a != b) & (b != c) & (c != a)
    corners, triangles = corners[sound], triangles[sound]
    own = TriangleMesh(positions, triangles, normals=mesh.normals[corners], name=surface.name)
    return ChartedSurface(
        own, mesh.chart[corners[:, 0]], np.ascontiguousarray(mesh.places[corners]), tuple(charts)
    )
