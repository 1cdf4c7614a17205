"""Tangents of a mesh: along the texel columns of each patch, for normal maps."""

import numpy as np

from upholster.geometry.mesh import Mesh
from upholster.geometry.surface import Surface
from upholster.types import FloatArray

__all__ = ["vertex_tangents"]

_FLAT = 1e-5
"""A derivative this much shorter than the patch's longest has no direction."""

_INWARD = 1 / 1024
"""How far inside, in parameter, the direction is taken then."""


def vertex_tangents(surface: Surface, mesh: Mesh) -> FloatArray:
    """Return the direction in which t, and u of the texture, grows at every vertex.

    Parameters
    ----------
    surface
        What the mesh was made of.
    mesh
        Its vertices' patches and parameters.

    Returns
    -------
    FloatArray
        (V, 3) float64: S_t, perpendicular to the vertex's normal, of length 1. At a degenerate edge the
        direction just inside the patch.
    """
    tangents = np.empty_like(mesh.positions)
    order = np.argsort(mesh.patch, kind="stable")
    for mine in np.split(order, np.flatnonzero(np.diff(mesh.patch[order])) + 1):
        patch = surface.patches[mesh.patch[mine[0]]]
        s, t = mesh.parameters[mine].T
        along = patch.derivatives(s, t)[2]
        length = np.linalg.norm(along, axis=1)
        bad = np.flatnonzero(length <= _FLAT * length.max(initial=0.0))
        if len(bad):
            inside = [p[bad] + np.where(p[bad] <= 0.5, _INWARD, -_INWARD) for p in (s, t)]
            along[bad] = patch.derivatives(*inside)[2]
        tangents[mine] = along
    normals = mesh.normals
    tangents -= np.einsum("ij,ij->i", tangents, normals)[:, None] * normals
    length = np.linalg.norm(tangents, axis=1)
    bad = np.flatnonzero(~(length > 0))
    if len(bad):
        # A patch without area there: any direction across the normal does.
        axis = np.eye(3)[np.abs(normals[bad]).argmin(axis=1)]
        tangents[bad] = np.cross(normals[bad], axis)
        length[bad] = np.linalg.norm(tangents[bad], axis=1)
    tangents /= length[:, None]
    return tangents
