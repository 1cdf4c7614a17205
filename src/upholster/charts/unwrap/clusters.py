"""Groups of triangles for islands: triangles with similar normals, with borders at creases."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts.unwrap._cluster_kernels import cluster, straighten
from upholster.charts.unwrap.pieces import Piece, halves

__all__ = ["Triangles", "clusters", "divided"]


class _Limit(NamedTuple):
    variance: float  # of unit normals; a spherical cap of 65 degrees has 0.3
    cosine: float  # between the mean normals of the clusters joined
    tiny: float  # share of the area below which a cluster is joined regardless


_LIMITS = (
    _Limit(0.3, 0.3, 2e-4),
    _Limit(0.2, 0.2, 2e-3),
    _Limit(0.1, 0.5, 2e-3),
    _Limit(0.05, 0.8, 5e-4),
    _Limit(0.01, 0.97, 0.0),
)
"""Limits for clusters: at first, and for dividing clusters that could not be flattened."""
_SWEEPS = 30
_LEAST_COST = 0.02
"""Cost of a border at the sharpest crease, as a share of its length."""


class Triangles:
    """The properties of triangles that clustering uses.

    Attributes
    ----------
    areas, normals, centres
        (T,), (T, 3) unit normals, (T, 3).
    costs
        (T, 3): costs of cutting at their edges, in model units: less at creases.
    """

    def __init__(self, corners: FloatArray, areas: FloatArray, normals: FloatArray, across: IntArray) -> None:
        self.areas, self.normals = areas, normals
        self.centres = corners.mean(axis=1)
        bend = (normals[across // 3] * normals[:, None]).sum(axis=2)
        lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        self.costs = lengths * np.clip(bend, _LEAST_COST, 1.0)


def clusters(across: IntArray, triangles: Triangles) -> IntArray:
    """Return the cluster of each triangle, (T,) int32.

    Parameters
    ----------
    across
        (T, 3) as `TriangleMesh.neighbours`; edges with −1 are not joined.
    triangles
        All of them.
    """
    return _clustered(across, triangles, np.arange(len(across)), _LIMITS[0])


def divided(piece: Piece, triangles: Triangles, times: int) -> tuple[IntArray, int]:
    """Divide a piece: into clusters of more similar triangles, in the end into two halves.

    Parameters
    ----------
    piece
        With two triangles or more.
    triangles
        All triangles of the mesh.
    times
        How often the piece was divided already.

    Returns
    -------
    ndarray
        (N,) int32: labels, of two values or more.
    int
        How often its parts have been divided after this.
    """
    for level in range(times + 1, len(_LIMITS)):
        label = _clustered(piece.across, triangles, piece.triangles, _LIMITS[level])
        if (label != label[0]).any():
            return label, level
    label = halves(piece, triangles.centres[piece.triangles]).astype(np.int32)
    if (label == label[0]).all():  # triangles back to back have the same centroid: separate them
        label = np.arange(len(label), dtype=np.int32)
    return label, len(_LIMITS)


def _clustered(across: IntArray, triangles: Triangles, own: NDArray[np.integer], limit: _Limit) -> IntArray:
    areas = triangles.areas[own]
    label = np.empty(len(own), np.int32)
    facing = triangles.normals[own] * areas[:, None]
    tiny = limit.tiny * float(areas.sum())
    cluster(across, facing, areas, limit.variance, limit.cosine, tiny, label)
    straighten(across, triangles.costs[own], label, _SWEEPS)
    return label
