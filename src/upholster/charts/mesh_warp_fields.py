"""The direction field's axes on triangles, and the charts' warp fields that follow from them.

On a triangle, let J = [J_r, J_c] map steps down and to the right on the chart to space. Let e1 be the
direction field's axis in its plane and e2 = e1 × n, clockwise from e1 seen from outside. Then ``M = ρ·[e2ᵀ;
e1ᵀ]·J`` maps steps to exemplar pixels so that the texture is undistorted on the surface; ρ is in pixels per
unit of length.
"""

import numpy as np

from upholster.base.types import FloatArray, IntArray
from upholster.charts._mesh_sampling_kernels import fill_nodes, splat_matrices, square_axes
from upholster.charts.charted_surface import ChartedSurface
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.quilt.placement import SYMMETRIES
from upholster.quilt.warp_field import FIELD_STEP, WarpField, node_count, polar_nodes
from upholster.runtime.stages import stage

__all__ = ["triangle_frames", "warp_fields"]

_ROUNDS = 2
"""Rounds in which nodes' matrices are scaled so that the size between nodes is right."""

_MOST_LARGER = 1.3
"""Greatest factor in each round."""

_SPACING = 8.0
"""Texels between two samples of a triangle's matrix."""


@stage
def triangle_frames(mesh: TriangleMesh, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the direction field's axes in each triangle's plane, (T, 3) each: along the rows, and down.

    `vectors` (T, 3, 3) is the field at the triangles' corners. A triangle whose field has no component in its
    plane takes its first edge.
    """
    along = (vectors[:, 0] + vectors[:, 1] + vectors[:, 2]) / 3
    down = np.empty_like(along)
    square_axes(along, mesh.flat_normals, mesh.positions, mesh.triangles, down)
    return along, down


@stage
def warp_fields(
    surface: ChartedSurface,
    along: FloatArray,
    down: FloatArray,
    scale: float,
    turns: IntArray | None = None,
    corners: FloatArray | None = None,
    factors: FloatArray | None = None,
) -> tuple[WarpField, ...]:
    """Return each chart's warp field: its triangles' matrices, smoothed to the nodes and extended beyond.

    Parameters
    ----------
    surface
        The charts.
    along, down
        (T, 3) the field's axes, see `triangle_frames`.
    scale
        Exemplar pixels per model unit.
    turns
        (T,) quarter turns from the charts' matrices to the field's, see `upholster.charts.turns`; by default
        none.
    corners
        (T, 3, 3) the field at the triangles' corners, by default `along`.
    factors
        (T, 3) factors of the sample's size at the triangles' corners, by default 1.
    """
    places, charts = surface.places - 0.5, surface.charts
    matrices = _matrices(surface, along, down, scale)
    if turns is not None:
        back = SYMMETRIES.reshape(-1, 2, 2)[(4 - turns) % 4]
        matrices = (back @ matrices.reshape(-1, 2, 2)).reshape(-1, 4)
    if corners is None:
        corners = np.repeat(along[:, None], 3, axis=1)
    matrices = _turned(matrices, corners, along, down)
    if factors is not None:
        matrices /= factors[:, :, None]
    counts = [(node_count(chart.height, 1), node_count(chart.width, 1)) for chart in charts]
    firsts = np.cumsum([0, *(rows * columns for rows, columns in counts)])
    shapes = np.array([(first, *count) for first, count in zip(firsts, counts, strict=False)], np.int64)
    nodes, rounds = np.zeros((firsts[-1], 4)), np.empty(firsts[-1], np.int32)

    def summed() -> FloatArray:
        sums = np.zeros((len(nodes), 7))
        splat_matrices(places, surface.chart, matrices, _SPACING, float(FIELD_STEP), shapes, nodes, sums)
        return sums

    sizes = scale * np.array([(chart.s1 - chart.s0) / chart.height for chart in charts])
    sizes /= 1.0 if factors is None else float(factors.max())
    fill_nodes(summed(), shapes, sizes, nodes, rounds)
    for _ in range(_ROUNDS):
        # The size is too small between matrices that differ by a rotation: nearby samples make a node larger.
        sums = summed()
        larger = np.sqrt(sums[:, 5] / np.maximum(sums[:, 6], 1e-300))
        nodes *= np.where(rounds == 0, np.clip(larger, 1 / _MOST_LARGER, _MOST_LARGER), 1.0)[:, None]
    polar = polar_nodes(nodes.reshape(-1, 2, 2))
    return tuple(
        WarpField(polar[first : first + rows * columns].reshape(rows, columns, 4), margin=1)
        for first, rows, columns in shapes.tolist()
    )


def _matrices(surface: ChartedSurface, along: FloatArray, down: FloatArray, scale: float) -> FloatArray:
    # M of each triangle, (T, 4): from its edges on the chart and in space.
    corners, flat = surface.mesh.corners, surface.places
    edges, texels = corners[:, 1:] - corners[:, :1], flat[:, 1:] - flat[:, :1]
    determinant = texels[:, 0, 0] * texels[:, 1, 1] - texels[:, 0, 1] * texels[:, 1, 0]
    sound = determinant > 0
    inverse = (
        np.stack([texels[:, 1, 1], -texels[:, 1, 0], -texels[:, 0, 1], texels[:, 0, 0]], axis=1)
        / np.where(sound, determinant, 1.0)[:, None]
    )
    # Two edges in the field's axes, as columns, times the inverse of the same edges on the chart.
    shown = np.stack([(edges * axis[:, None]).sum(axis=2) for axis in (down, along)], axis=1)
    out: FloatArray = scale * np.einsum("tae,teb->tab", shown, inverse.reshape(-1, 2, 2)).reshape(-1, 4)
    out[~sound] = 0.0
    return out


def _turned(matrices: FloatArray, corners: FloatArray, along: FloatArray, down: FloatArray) -> FloatArray:
    # Matrices (T, 4) at the corners, (T, 3, 4): rotated by the field's angle there to its triangle's axes.
    x, y = (np.einsum("tki,ti->tk", corners, axis) for axis in (along, down))
    length = np.hypot(x, y)
    known = length > 1e-6
    x = np.where(known, x / np.where(known, length, 1.0), 1.0)
    y = np.where(known, y / np.where(known, length, 1.0), 0.0)
    x, y = x[..., None], y[..., None]
    below, across = matrices[:, None, :2], matrices[:, None, 2:]  # the sample's rows (down), and columns
    return np.concatenate([x * below - y * across, x * across + y * below], axis=2)
