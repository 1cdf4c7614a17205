"""Edges of a mesh over which directions start anew."""

import numpy as np
from numpy.typing import NDArray

from upholster.geometry import TriangleMesh
from upholster.stages import stage
from upholster.types import FloatArray

__all__ = ["CREASE", "bend_cosines", "default_crease"]

Index = NDArray[np.integer]

CREASE = 75.0
"""Degrees: over edges that bend more directions start anew, so that a box's lid runs straight.
Models of few triangles bend less at edges that stand for something smooth."""

_CHAMFERED = 30.0
"""The same of a model with chamfers."""

_ROUND, _CHAMFER = 20.0, 40.0
"""Degrees: edges that stand for something round bend by less than the first in what comes from CAD; those of
chamfers bend by more than the second."""

_BETWEEN = 0.05
"""Length of the edges that bend by angles between, over those of chamfers, up to which a model has such."""


@stage
def default_crease(mesh: TriangleMesh) -> float:
    """Return from how many degrees on directions start anew over edges where nobody says: 75, or 30.

    A chamfer takes an edge of 90° in two steps of 45°. Over these a countersunk hole would go on from its
    rim, and turn; flat faces have directions of their own. But models of few triangles bend by as much where
    they stand for something smooth. They bend by every other angle as well; what has chamfers, and edges that
    bend by less than 20°, has hardly any between.
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
    """Return the cosines of how much a mesh bends over edges, (n,).

    By the file's normals, where it has some and not told otherwise: at whichever end it bends more.

    Parameters
    ----------
    mesh
        The triangles.
    triangle, edge, across
        (n,) each: edges of triangles, and what lies across, as of `TriangleMesh.neighbours`.
    by_normals
        Whether normals of the file count.
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
