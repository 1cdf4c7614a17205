"""Tangents of meshes: along the texel columns of each chart, for normal maps."""

from collections.abc import Sequence

import numpy as np

from upholster.geometry import Surface
from upholster.model.mesh import Mesh, face_parameters, own_patches
from upholster.quilt.chart import Chart
from upholster.types import FloatArray

__all__ = ["unit_across", "vertex_tangents"]

_FLAT = 1e-5
"""A derivative this much shorter than the chart's longest has no direction."""

_INWARD = 1 / 1024
"""How far inside, in shares of the chart, the direction is taken then."""


def vertex_tangents(surface: Surface, charts: Sequence[Chart], mesh: Mesh) -> FloatArray:
    """Return the direction in which t, and u of the texture, grows at every vertex.

    Parameters
    ----------
    surface, charts
        What the mesh was made of.
    mesh
        Its vertices' charts and places.

    Returns
    -------
    FloatArray
        (V, 3) float64: S_t, perpendicular to the vertex's normal, of length 1. At a degenerate edge the
        direction just inside the chart.
    """
    tangents = np.empty_like(mesh.positions)
    order = np.argsort(mesh.chart, kind="stable")
    for mine in np.split(order, np.flatnonzero(np.diff(mesh.chart[order])) + 1):
        face, chart = own_patches(surface, charts[mesh.chart[mine[0]]])
        places = mesh.places[mine]
        along = face.derivatives(*face_parameters(chart, *places.T))[2]
        length = np.linalg.norm(along, axis=1)
        bad = np.flatnonzero(length <= _FLAT * length.max(initial=0.0))
        if len(bad):
            size = np.array([chart.height, chart.width])
            inward = np.where(places[bad] <= 0.5 * size, _INWARD, -_INWARD) * size
            along[bad] = face.derivatives(*face_parameters(chart, *(places[bad] + inward).T))[2]
        tangents[mine] = along
    return unit_across(tangents, mesh.normals)


def unit_across(tangents: FloatArray, normals: FloatArray) -> FloatArray:
    """Return vectors (V, 3) turned across unit normals, with length 1."""
    tangents = tangents - np.einsum("ij,ij->i", tangents, normals)[:, None] * normals
    length = np.linalg.norm(tangents, axis=1)
    bad = np.flatnonzero(~(length > 0))
    if len(bad):
        # A surface without area there: any direction across the normal does.
        axis = np.eye(3)[np.abs(normals[bad]).argmin(axis=1)]
        tangents[bad] = np.cross(normals[bad], axis)
        length[bad] = np.linalg.norm(tangents[bad], axis=1)
    unit: FloatArray = tangents / length[:, None]
    return unit
