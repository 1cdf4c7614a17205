"""The number of quarter turns between each chart's matrices and the direction field.

A field of lines has no consistent sense over a chart: over a ridge, "to the right" reverses, and along a loop
round some singular points it comes back upside down. A chart's matrices must be continuous, because they are
bilinear between nodes. So they follow the lines, and blocks are turned by quarters wherever the lines' sense
is not the one asked for.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts._mesh_sampling_kernels import distances_over_edges, join_turns
from upholster.charts.charted_surface import ChartedSurface
from upholster.runtime.stages import stage

__all__ = ["chart_turns"]


@stage
def chart_turns(surface: ChartedSurface, along: FloatArray, fold: int) -> IntArray:
    """Return for each triangle the quarter turns, (T,) 0 to 3, from its chart's matrix to the field's.

    They are chosen so that a chart's matrices jump over few and short edges. These edges lie between singular
    points, or between a singular point and the chart's border.

    Parameters
    ----------
    surface
        The islands.
    along
        (T, 3) the field's first axis in each triangle's plane.
    fold
        1, 2 or 4: the field's fold. With fold 1 it is continuous everywhere.
    """
    mesh, count = surface.mesh, len(surface.chart)
    turns = np.zeros(count, np.int32)
    jumps, inside = _jumps(surface, along, fold)
    if fold == 1 or not jumps.any():
        return turns
    # Vertices where the jumps do not add up to full turns, and those on the islands' borders: edges near
    # these are left open.
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
    return _with_islands_turned(surface, turns)


def _jumps(surface: ChartedSurface, along: FloatArray, fold: int) -> tuple[IntArray, NDArray[np.bool_]]:
    # The quarters by which the turns increase over each edge within an island, (T, 3): the field's
    # counter-clockwise rotation beyond parallel transport; 0 over other edges. And which edges are within
    # one.
    mesh, across = surface.mesh, surface.across
    other = across // 3
    inside = (across >= 0) & ~surface.is_seam & (surface.chart >= 0)[:, None]
    edges = np.roll(mesh.corners, -1, axis=1) - mesh.corners
    inward = np.cross(mesh.flat_normals[:, None], edges)
    angle = np.arctan2((along[:, None] * inward).sum(axis=2), (along[:, None] * edges).sum(axis=2))
    # Seen from the other triangle, the same edge runs the other way.
    beyond = np.pi + angle[other, across % 3]
    part = np.rint((beyond - angle) * fold / (2 * np.pi)).astype(np.int32) % fold
    part = np.where(inside, part * (4 // fold), 0).astype(np.int32)
    # Rounding may differ between the sides: the lower triangle's result counts.
    upper = inside & (across < 3 * np.arange(len(part))[:, None])
    part[upper] = -part[other[upper], across[upper] % 3] % 4
    return part, inside


def _with_islands_turned(surface: ChartedSurface, turns: IntArray) -> IntArray:
    # Turns each island so that most of its area agrees with the field.
    kept = surface.chart >= 0
    islands = int(surface.chart.max()) + 1
    share = np.zeros((islands, 4))
    np.add.at(share, (surface.chart[kept], turns[kept]), surface.mesh.areas[kept])
    turned = turns - share.argmax(axis=1).astype(np.int32)[surface.chart]
    return np.where(kept, turned % 4, 0).astype(np.int32)
