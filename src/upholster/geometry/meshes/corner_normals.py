"""Normals of a mesh's corners: shared where the mesh is smooth, separate on the two sides of a crease."""

import numpy as np

from upholster.base.types import FloatArray, IntArray, frozen_array
from upholster.base.vectors import unit_vectors
from upholster.geometry.components import connected
from upholster.geometry.meshes.triangle_mesh import TriangleMesh

__all__ = ["CREASE", "corner_normals", "smooth_corners"]

CREASE = 40.0
"""Degrees between two triangles' normals from which their edge is a crease."""


def smooth_corners(mesh: TriangleMesh, crease: float = CREASE) -> IntArray:
    """Return which corners share a normal: those of one vertex that are connected without crossing a crease.

    Parameters
    ----------
    mesh
        The triangles.
    crease
        Degrees between normals from which an edge is a crease.

    Returns
    -------
    ndarray
        (T, 3) int32: a number for each group.
    """
    normals, across = mesh.flat_normals, mesh.neighbours
    triangle, edge = np.nonzero(across >= 0)
    other, met = across[triangle, edge] // 3, across[triangle, edge] % 3
    alike = (normals[triangle] * normals[other]).sum(axis=1) > np.cos(np.radians(crease))
    alike |= (mesh.areas[triangle] == 0) | (mesh.areas[other] == 0)
    triangle, edge, other, met = (part[alike].astype(np.int64) for part in (triangle, edge, other, met))
    pairs = np.concatenate(
        [
            np.stack([3 * triangle + edge, 3 * other + (met + 1) % 3], axis=1),
            np.stack([3 * triangle + (edge + 1) % 3, 3 * other + met], axis=1),
        ]
    )
    return connected(3 * len(across), pairs).reshape(-1, 3)


def corner_normals(mesh: TriangleMesh, crease: float = CREASE) -> FloatArray:
    """Return unit normals of the triangles' corners, (T, 3, 3): the file's, or else those of smooth parts.

    For a smooth part at a vertex it is the mean of the triangles' normals, weighted by their angles there.
    """
    if mesh.normals is not None:
        return _normalized(mesh.normals, mesh)
    group = smooth_corners(mesh, crease).ravel()
    sides = unit_vectors(np.roll(mesh.corners, -1, axis=1) - mesh.corners)
    cosine = -(sides * np.roll(sides, 1, axis=1)).sum(axis=2)
    weighted = np.arccos(np.clip(cosine, -1, 1))[..., None] * mesh.flat_normals[:, None]
    sums = np.zeros((len(group), 3))
    for axis in range(3):
        sums[:, axis] = np.bincount(group, weighted[..., axis].ravel(), len(group))
    return _normalized(sums[group].reshape(-1, 3, 3), mesh)


def _normalized(normals: FloatArray, mesh: TriangleMesh) -> FloatArray:
    flat = np.where(mesh.areas[:, None, None] > 0, mesh.flat_normals[:, None], np.array([0.0, 0.0, 1.0]))
    return frozen_array(unit_vectors(normals, least=1e-12, instead=flat))
