"""Lines over a model that show how it is covered."""

import numpy as np

from upholster.coverings import Covering
from upholster.errors import InputError
from upholster.types import FloatArray

__all__ = ["KINDS", "segments"]

KINDS = ("seams", "direction")

_ARROWS = 3000
"""Lines that show directions, about."""

_RAISED = 0.002
"""Of the model's size: so far lines lie over the surface."""


def segments(covering: Covering, kind: str) -> FloatArray:
    """Return line segments (n, 2, 3) of one covering.

    Parameters
    ----------
    covering
        Prepared, or it is now.
    kind
        "seams": where charts meet; "direction": which way the sample's rows run, from the thick end on.

    Raises
    ------
    InputError
        For another kind, or where the method knows nothing of it.
    """
    if kind not in KINDS:
        raise InputError(f"overlay is {kind!r}; allowed: {', '.join(KINDS)}")
    prepared = covering.prepared
    charted = prepared.charted
    if charted is None or prepared.vectors is None:
        raise InputError(f"overlay {kind} is for method quilt on a surface")
    mesh = charted.mesh
    raised = _RAISED * mesh.size * mesh.flat_normals
    if kind == "seams":
        triangle, edge = charted.seams[:, :2].T
        ends = np.stack([edge, (edge + 1) % 3], axis=1)
        found: FloatArray = mesh.corners[triangle[:, None], ends] + raised[triangle][:, None]
        return found
    covered = np.flatnonzero(charted.chart >= 0)
    areas = mesh.areas[covered]
    total = float(areas.sum())
    # As many per area everywhere: where the sum of areas passes a multiple, a triangle has a line.
    passed = np.floor(np.cumsum(areas) / total * _ARROWS).astype(np.int64)
    chosen = covered[np.diff(passed, prepend=-1) > 0]
    along = prepared.vectors[chosen].mean(axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    half = 0.35 * np.sqrt(total / _ARROWS)
    middle = mesh.corners[chosen].mean(axis=1) + raised[chosen]
    out: FloatArray = np.stack([middle - half * along, middle + half * along], axis=1)
    return out
