"""Tangents of meshes: along the texel columns of each chart, for normal maps."""

from collections.abc import Sequence

import numpy as np

from upholster.base.types import FloatArray, IntArray
from upholster.charts.tessellation.mesh import Mesh, face_parameters, own_patches
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart

__all__ = ["mesh_tangents", "unit_across", "vertex_tangents"]

_FLAT = 1e-5
"""A derivative shorter than this share of the chart's longest has no direction."""

_INWARD = 1 / 1024
"""Distance inward, as a share of the chart, at which the direction is then taken."""


def vertex_tangents(surface: Surface, charts: Sequence[Chart], mesh: Mesh) -> FloatArray:
    """Return the direction in which t, and u of the texture, increases at every vertex.

    Parameters
    ----------
    surface, charts
        The surface and the charts that the mesh was made from.
    mesh
        Its vertices' charts and places.

    Returns
    -------
    FloatArray
        (V, 3) float64: S_t, made perpendicular to the vertex's normal, with length 1. At a degenerate edge,
        the direction just inside the chart.
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
    """Project vectors (V, 3) perpendicular to unit normals, and normalize them."""
    tangents = tangents - np.einsum("ij,ij->i", tangents, normals)[:, None] * normals
    length = np.linalg.norm(tangents, axis=1)
    bad = np.flatnonzero(~(length > 0))
    if len(bad):
        # The surface is degenerate there: any direction perpendicular to the normal will do.
        axis = np.eye(3)[np.abs(normals[bad]).argmin(axis=1)]
        tangents[bad] = np.cross(normals[bad], axis)
        length[bad] = np.linalg.norm(tangents[bad], axis=1)
    unit: FloatArray = tangents / length[:, None]
    return unit


def mesh_tangents(
    positions: FloatArray, normals: FloatArray, triangles: IntArray, uv: FloatArray
) -> FloatArray:
    """Return tangents of a mesh of triangles, along which u of its texture grows.

    Parameters
    ----------
    positions, normals
        (V, 3), normals of length 1.
    triangles
        (T, 3) vertices.
    uv
        (T, 3, 2) texture coordinates of their corners, v downward.

    Returns
    -------
    FloatArray
        (V, 4) float64 as in glTF: perpendicular to the normal, of length 1; and 1, or -1 where the texture is
        mirrored. A vertex's triangles are weighted by their angles there.

    References
    ----------
    M. S. Mikkelsen: Simulation of wrinkled surfaces revisited, 2008.
    """
    corners = positions[triangles]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    (u1, v1), (u2, v2) = (uv[:, 1] - uv[:, 0]).T, (uv[:, 2] - uv[:, 0]).T
    turn = u1 * v2 - u2 * v1
    along = np.sign(turn)[:, None] * (a * v2[:, None] - b * v1[:, None])
    upward = -np.sign(turn)  # for normals on the side from which the triangle is counter-clockwise
    facing = (np.cross(a, b) * normals[triangles].sum(axis=1)).sum(axis=1)
    upward = np.where(facing < 0, -upward, upward)
    total = np.zeros((len(positions), 4))
    for corner in range(3):
        at = triangles[:, corner]
        share = _corner_angle(corners, corner)[:, None] * _flat_unit(along, normals[at])
        np.add.at(total, at, np.concatenate([share, (upward * (share != 0).any(axis=1))[:, None]], axis=1))
    out = np.empty((len(positions), 4))
    out[:, :3] = unit_across(total[:, :3], normals)
    out[:, 3] = np.where(total[:, 3] < 0, -1.0, 1.0)
    return out


def _corner_angle(corners: FloatArray, corner: int) -> FloatArray:
    """Return the angle of triangles (T, 3, 3) at one of their corners."""
    first = corners[:, (corner + 1) % 3] - corners[:, corner]
    last = corners[:, (corner + 2) % 3] - corners[:, corner]
    crossed = np.linalg.norm(np.cross(first, last), axis=1)
    angle: FloatArray = np.arctan2(crossed, (first * last).sum(axis=1))
    return angle


def _flat_unit(vectors: FloatArray, normals: FloatArray) -> FloatArray:
    """Project vectors perpendicular to normals, and normalize them; 0 where nothing is left."""
    vectors = vectors - (vectors * normals).sum(axis=1, keepdims=True) * normals
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: FloatArray = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
    return unit
