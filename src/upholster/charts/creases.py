"""Edges of a mesh over which directions start anew."""

import numpy as np

from upholster.geometry import TriangleMesh
from upholster.stages import stage
from upholster.types import FloatArray

__all__ = ["CREASE", "default_crease"]

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
    cosines, lengths = _bends(mesh)
    slight, bent, sharp = np.cos(np.radians((_ROUND, _CHAMFER, CREASE)))
    chamfers = float(lengths[(cosines <= bent) & (cosines > sharp)].sum())
    between = float(lengths[(cosines <= slight) & (cosines > bent)].sum())
    return _CHAMFERED if chamfers > 0 and between <= _BETWEEN * chamfers else CREASE


def _bends(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """Return of each edge between two triangles, from either, the cosine of its bend and its length.

    By the file's normals, where it has some: at whichever end it bends more.
    """
    triangle, edge = np.nonzero(mesh.neighbours >= 0)
    other, met = np.divmod(mesh.neighbours[triangle, edge], 3)
    after = (edge + 1) % 3
    corners = mesh.corners
    lengths = np.linalg.norm(corners[triangle, after] - corners[triangle, edge], axis=1)
    if mesh.normals is None:
        flat = mesh.flat_normals
        return np.einsum("ij,ij->i", flat[triangle], flat[other]), lengths
    own, far = mesh.normals[triangle], mesh.normals[other]
    row = np.arange(len(triangle))
    first = np.einsum("ij,ij->i", own[row, edge], far[row, (met + 1) % 3])
    last = np.einsum("ij,ij->i", own[row, after], far[row, met])
    return np.minimum(first, last), lengths
