"""Triangles small enough for an image of directions: a wall's two would have one direction each."""

from dataclasses import replace

import numpy as np

from upholster.base.types import FloatArray, IntArray
from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.subdivision import subdivided
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.runtime.stages import stage

__all__ = ["in_detail"]

_LONGEST = 0.02
"""Longest edge of a triangle, as a share of the model's size."""


@stage
def in_detail(surface: ChartedSurface, uv: FloatArray | None = None) -> ChartedSurface:
    """Return the same surface with shorter edges; triangles on no chart are left out.

    Its mesh's texture coordinates and normals are linear over each original triangle.

    Parameters
    ----------
    surface
        The surface.
    uv
        (T, 3, 2) texture coordinates, by default the mesh's own. Triangles that have none (NaN) get a single
        place.
    """
    mesh = surface.mesh
    uv = mesh.uv if uv is None else np.where(np.isfinite(uv).all(axis=(1, 2), keepdims=True), uv, 0.0)
    flat = np.repeat(mesh.flat_normals[:, None], 3, axis=1)
    fine = subdivided(surface, flat if mesh.normals is None else mesh.normals, _LONGEST * mesh.size)
    own, parent = fine.surface.mesh, fine.parent
    uv = None if uv is None else _carried(uv, surface.places, fine.surface.places, parent)
    found = TriangleMesh(
        own.positions,
        own.triangles,
        mesh.part[parent],
        mesh.parts,
        uv,
        None if mesh.normals is None else fine.vectors,
        mesh.name,
        mesh.metres,
    )
    return replace(fine.surface, mesh=found)


def _carried(values: FloatArray, places: FloatArray, within: FloatArray, parent: IntArray) -> FloatArray:
    """Interpolate corner values (T, 3, k), given at places (T, 3, 2), at (n, 3, 2) within triangles (n,)."""
    first, second = places[parent, 1] - places[parent, 0], places[parent, 2] - places[parent, 0]
    to = within - places[parent, :1]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    area = np.where(area > 0, area, 1.0)[:, None]
    b = (to[..., 0] * second[:, None, 1] - to[..., 1] * second[:, None, 0]) / area
    c = (first[:, None, 0] * to[..., 1] - first[:, None, 1] * to[..., 0]) / area
    shares = np.stack([1 - b - c, b, c], axis=2)
    return np.asarray(shares @ values[parent], np.float64)
