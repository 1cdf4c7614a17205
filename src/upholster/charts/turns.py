"""By how many quarters each chart's matrices are turned against the field of directions.

A field of lines has no sense of its own that goes on over a whole chart: over a ridge what runs to the right
turns about, and round some singular points one comes back upside down. The matrices of a chart have to go on,
as they are bilinear between nodes. So they follow the lines, and blocks are turned by quarters where that is
not the sense that was asked for.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.charts._mesh_sampling_kernels import distances_over_edges, join_turns
from upholster.charts.charted import ChartedSurface
from upholster.stages import stage
from upholster.types import FloatArray, IntArray

__all__ = ["chart_turns"]


@stage
def chart_turns(surface: ChartedSurface, along: FloatArray, fold: int) -> IntArray:
    """Return for each triangle the quarter turns, (T,) 0 to 3, that take its chart's matrix to the field's.

    They are chosen such that few and short edges are left over which a chart's matrices jump: those lie
    between singular points, or between such a point and the chart's border.

    Parameters
    ----------
    surface
        The islands.
    along
        (T, 3) the field's first axis in each triangle's plane.
    fold
        1, 2 or 4: of the field. Of fold 1 it goes on everywhere.
    """
    mesh, count = surface.mesh, len(surface.chart)
    turns = np.zeros(count, np.int32)
    jumps, inside = _jumps(surface, along, fold)
    if fold == 1 or not jumps.any():
        return turns
    # Vertices round which the jumps do not sum up to whole turns, and those of the islands' borders: edges
    # are left open near these.
    around = np.zeros(len(mesh.positions), np.int64)
    for k in range(3):
        np.add.at(around, mesh.triangles[:, k], jumps[:, (k + 2) % 3])
    away = np.where(around % 4 != 0, 0.0, np.inf)
    ends = np.stack([mesh.triangles, np.roll(mesh.triangles, -1, axis=1)], axis=2)
    away[ends[~inside]] = 0.0
    lengths = np.linalg.norm(mesh.positions[ends[..., 0]] - mesh.positions[ends[..., 1]], axis=2)
    distances_over_edges(mesh.triangles, lengths, away)
    triangle, edge = np.nonzero(inside & (surface.across > 3 * np.arange(count)[:, None] + 2))
    first, last = ends[triangle, edge].T
    open_last = np.argsort(-(away[first] + lengths[triangle, edge] + away[last]), kind="stable")
    triangle, edge = triangle[open_last], edge[open_last]
    other = surface.across[triangle, edge] // 3
    join_turns(triangle.astype(np.int32), other.astype(np.int32), jumps[triangle, edge], turns)
    return _settled(surface, turns)


def _jumps(surface: ChartedSurface, along: FloatArray, fold: int) -> tuple[IntArray, NDArray[np.bool_]]:
    # By how many quarters the turns grow over each edge within an island, (T, 3): as many as the field is
    # turned counter-clockwise there, beside being carried; 0 over others. And which edges lie within.
    mesh, across = surface.mesh, surface.across
    other = across // 3
    inside = (across >= 0) & ~surface.is_seam & (surface.chart >= 0)[:, None]
    edges = np.roll(mesh.corners, -1, axis=1) - mesh.corners
    beside = np.cross(mesh.flat_normals[:, None], edges)
    angle = np.arctan2((along[:, None] * beside).sum(axis=2), (along[:, None] * edges).sum(axis=2))
    # The same edge seen from beyond runs the other way.
    beyond = np.pi + angle[other, across % 3]
    part = np.rint((beyond - angle) * fold / (2 * np.pi)).astype(np.int32) % fold
    part = np.where(inside, part * (4 // fold), 0).astype(np.int32)
    # Rounding may differ from either side: the lower triangle's counts.
    upper = inside & (across < 3 * np.arange(len(part))[:, None])
    part[upper] = -part[other[upper], across[upper] % 3] % 4
    return part, inside


def _settled(surface: ChartedSurface, turns: IntArray) -> IntArray:
    # Turned as a whole, most of each island lies as the field does.
    kept = surface.chart >= 0
    islands = int(surface.chart.max()) + 1
    share = np.zeros((islands, 4))
    np.add.at(share, (surface.chart[kept], turns[kept]), surface.mesh.areas[kept])
    turned = turns - share.argmax(axis=1).astype(np.int32)[surface.chart]
    return np.where(kept, turned % 4, 0).astype(np.int32)
