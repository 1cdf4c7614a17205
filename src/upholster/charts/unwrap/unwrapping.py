"""A mesh laid out flat, in islands that keep lengths as well as they can."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from upholster.charts.unwrap.atlas import atlas_charts
from upholster.errors import InputError
from upholster.geometry.triangle_mesh import MeshSurface, TriangleMesh
from upholster.types import FloatArray, IntArray

__all__ = ["UnwrapReport", "unwrap"]


@dataclass
class UnwrapReport:
    """What unwrapping tells.

    Attributes
    ----------
    islands
        How many there are.
    plain
        How many of the chosen triangles lie on none.
    notes
        Sentences for the user.
    """

    islands: int = 0
    plain: int = 0
    notes: list[str] = field(default_factory=list)


def unwrap(
    mesh: TriangleMesh,
    *,
    chosen: NDArray[np.bool_] | None = None,
) -> tuple[MeshSurface, UnwrapReport]:
    """Lay a mesh out flat.

    Parameters
    ----------
    mesh
        Its triangles meet at common vertices.
    chosen
        (T,): the triangles to lay out; by default all.

    Raises
    ------
    InputError
        If no triangle can be laid out, or xatlas is missing.
    """
    wanted = np.ones(len(mesh.triangles), bool) if chosen is None else chosen
    rows = np.flatnonzero(wanted & (mesh.areas > 0))
    if not len(rows):
        raise InputError("no triangle has an area; allowed: a mesh with a surface")
    low, high = mesh.corners[rows].min(axis=(0, 1)), mesh.corners[rows].max(axis=(0, 1))
    used, compact = np.unique(mesh.triangles[rows], return_inverse=True)
    scaled = (mesh.positions[used] - low) / (high - low).max()
    chart, corners = atlas_charts(scaled, compact.reshape(-1, 3).astype(np.int32))
    island = np.full(len(mesh.triangles), -1, np.int32)
    parameters = np.zeros((len(mesh.triangles), 3, 2))
    chart, corners = _true_to_size(chart, corners, mesh.areas[rows])
    island[rows], parameters[rows] = chart, corners
    surface = MeshSurface(mesh, island, parameters)
    return surface, UnwrapReport(surface.islands, int((wanted & (island < 0)).sum()))


def _true_to_size(chart: IntArray, corners: FloatArray, areas: FloatArray) -> tuple[IntArray, FloatArray]:
    """Turn charts the right way round and give them their areas in space; number them anew."""
    out = corners[:, :, ::-1].copy()
    turned = _signed_areas(out)
    used = chart >= 0
    count = int(chart.max()) + 1
    flat = np.bincount(chart[used], turned[used], count)
    true = np.bincount(chart[used], areas[used], count)
    good = np.abs(flat) > 0
    scale = np.sqrt(true / np.where(good, np.abs(flat), 1.0))
    out *= np.where(used, scale[chart], 1.0)[:, None, None]
    out[:, :, 1] *= np.where(flat[chart] < 0, -1.0, 1.0)[:, None]
    number = np.where(good, np.cumsum(good) - 1, -1)
    return np.where(used, number[chart], -1).astype(np.int32), out


def _signed_areas(corners: FloatArray) -> FloatArray:
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    out: FloatArray = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    return out
