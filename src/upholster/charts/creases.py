"""Creases: edges of a mesh where directions do not continue from one face to the next."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.runtime.stages import stage

__all__ = ["CREASE", "bend_cosines", "default_crease"]

Index = NDArray[np.integer]

CREASE = 75.0
"""Degrees: directions do not continue over edges that bend more, so that a box's lid runs straight.
Models with few triangles bend less at edges that approximate a smooth surface."""

_CHAMFERED = 30.0
"""The same for a model with chamfers."""

_ROUND, _CHAMFER = 20.0, 40.0
"""Degrees, for models from CAD: edges that approximate a curved surface bend by less than the first, edges of
chamfers by more than the second."""

_BETWEEN = 0.05
"""A model has chamfers if its edges at angles between these two are at most this share of its chamfers'
edges, by length."""


@stage
def default_crease(mesh: TriangleMesh) -> float:
    """Return the default angle, in degrees, above which directions do not continue over an edge: 75 or 30.

    A chamfer turns a 90° edge into two of 45°. If directions continued over these, a countersunk hole would
    set the direction beyond its rim, and turn it; flat faces have directions of their own. Models with few
    triangles bend as much where they approximate a smooth surface, but they also bend by every other angle.
    A model with chamfers, and edges that bend by less than 20°, has hardly any edges in between.
    """
    triangle, edge = np.nonzero(mesh.neighbours >= 0)
    cosines = bend_cosines(mesh, triangle, edge, mesh.neighbours[triangle, edge])
    corners = mesh.corners
    lengths = np.linalg.norm(corners[triangle, (edge + 1) % 3] - corners[triangle, edge], axis=1)
    slight, bent, sharp = np.cos(np.radians((_ROUND, _CHAMFER, CREASE)))
    chamfers = float(lengths[(cosines <= bent) & (cosines > sharp)].sum())
    between = float(lengths[(cosines <= slight) & (cosines > bent)].sum())
    return _CHAMFERED if chamfers > 0 and between <= _BETWEEN * chamfers else CREASE


def bend_cosines(
    mesh: TriangleMesh, triangle: Index, edge: Index, across: Index, *, by_normals: bool = True
) -> FloatArray:
    """Return the cosines of the angles by which a mesh bends over edges, (n,).

    Uses the file's normals, if it has some and `by_normals` allows it: the end where the edge bends more.

    Parameters
    ----------
    mesh
        The triangles.
    triangle, edge, across
        (n,) each: edges of triangles, and their neighbours across, as in `TriangleMesh.neighbours`.
    by_normals
        Whether to use the file's normals.
    """
    other, met = np.divmod(across, 3)
    if mesh.normals is None or not by_normals:
        flat = mesh.flat_normals
        facing: FloatArray = np.einsum("ij,ij->i", flat[triangle], flat[other])
        return facing
    own, far = mesh.normals[triangle], mesh.normals[other]
    row = np.arange(len(triangle))
    first: FloatArray = np.einsum("ij,ij->i", own[row, edge], far[row, (met + 1) % 3])
    last: FloatArray = np.einsum("ij,ij->i", own[row, (edge + 1) % 3], far[row, met])
    return np.minimum(first, last)
