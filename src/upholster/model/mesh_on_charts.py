"""A mesh with places on its charts: its own triangles, vertices split where normals or places differ."""

from collections.abc import Sequence

import numpy as np

from upholster.base.types import FloatArray
from upholster.charts.mesh_layout import chart_places
from upholster.charts.tessellation.mesh import Mesh
from upholster.geometry.meshes.corner_normals import corner_normals
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.model.tangents import unit_across
from upholster.quilt.chart import Chart

__all__ = ["charted_tangents", "mesh_on_charts"]


def mesh_on_charts(surface: MeshSurface, charts: Sequence[Chart]) -> Mesh:
    """Return a mesh's own triangles, with places on its charts.

    Parameters
    ----------
    surface
        The mesh; triangles on no island show a texel of the first one.
    charts
        One for each island, see `upholster.charts.mesh_layout.mesh_charts`.
    """
    mesh = surface.mesh
    shown = chart_places(surface, charts)
    shown[surface.island < 0] = shown[np.argmax(surface.island == 0)].mean(axis=0)
    normals, places = corner_normals(mesh).reshape(-1, 3), shown.reshape(-1, 2)
    chart = np.repeat(np.maximum(surface.island, 0), 3)
    vertex = mesh.triangles.reshape(-1)
    keys = np.concatenate(
        [vertex[:, None], chart[:, None], np.rint(normals * 2.0**20), np.rint(places * 2.0**20)], axis=1
    ).astype(np.int64)
    rows = keys.view(np.dtype((np.void, keys.shape[1] * 8))).reshape(-1)
    _, first, inverse = np.unique(rows, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    kept = first[order]
    return Mesh(
        mesh.positions[vertex[kept]],
        normals[kept],
        places[kept],
        chart[kept].astype(np.int32),
        np.zeros((0, 4), np.int32),
        rank[inverse.reshape(-1)].reshape(-1, 3),
    )


def charted_tangents(mesh: Mesh) -> FloatArray:
    """Return the direction in which the texture's u increases at every vertex, (V, 3): see `vertex_tangents`.

    It is the area-weighted mean over the vertex's triangles.
    """
    corners, flat = mesh.positions[mesh.triangles], mesh.places[mesh.triangles]
    edges, steps = corners[:, 1:] - corners[:, :1], flat[:, 1:] - flat[:, :1]
    # The derivative by columns, times twice the area in texels.
    along = steps[:, 0, 0, None] * edges[:, 1] - steps[:, 1, 0, None] * edges[:, 0]
    sums = np.zeros_like(mesh.positions)
    for axis in range(3):
        sums[:, axis] = np.bincount(
            mesh.triangles.ravel(), np.repeat(along[:, axis], 3), minlength=len(mesh.positions)
        )
    return unit_across(sums, mesh.normals)
