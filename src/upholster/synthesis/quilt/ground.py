"""The ground of blocks: a charted surface and its warp fields in the kernels' form, with charts' canvases."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts._mesh_sampling_kernels import corner_lists
from upholster.charts._step_kernels import StepGrid, locate_steps
from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.directions._kernels import corner_fans
from upholster.charts.mesh_warp_fields import triangle_frames
from upholster.charts.subdivision import Subdivided, subdivided
from upholster.quilt.warp_field import FIELD_STEP, UNIT, WarpField
from upholster.runtime.parallel import check_cancelled, run_tasks, thread_count
from upholster.runtime.stages import stage
from upholster.synthesis.quilt.kernels._frame_kernels import KEPT_SHEET, Canvases, bound_places
from upholster.synthesis.quilt.kernels._lay_kernels import Ground
from upholster.synthesis.quilt.kernels._sheet_kernels import FieldArrays
from upholster.synthesis.quilt.kernels._unfold_kernels import MeshArrays
from upholster.synthesis.quilt.kernels._whole_kernels import CLEAR_CELL, ClearCells, mark_edges

__all__ = ["PlacedGround", "field_arrays", "ground_of", "whole_ground"]

_ALIGNED = 24
"""Windows of charts begin at a multiple of this many steps, where a label cell and a clear cell begin too."""

_MARGIN = 8
"""Steps by which a window extends beyond its triangles, because labels extend a little beyond seams."""


@dataclass(frozen=True, eq=False, slots=True)
class PlacedGround:
    """Ground of a part of a surface, on windows of its charts.

    Attributes
    ----------
    ground
        The ground of blocks. Its places are relative to the windows.
    corners
        (charts, 2) the first step of each window on its chart.
    sizes
        (charts, 2) rows and columns of the charts.
    parent
        (T,) int32: the triangle of the complete surface that contains each triangle.
    """

    ground: Ground
    corners: NDArray[np.int64]
    sizes: NDArray[np.int64]
    parent: IntArray

    def bare(
        self,
        wanted: Sequence[NDArray[np.uint8]] = (),
        zones: Sequence[NDArray[np.uint8]] = (),
        kept: Sequence[IntArray] = (),
    ) -> "PlacedGround":
        """Return the same with new canvases, which are bare except for the kept steps, shown as block 0.

        Parameters
        ----------
        wanted, zones
            As in `Steering`.
        kept
            As from `Steering.places`.
        """
        canvases = self.ground.canvases
        count = len(canvases.triangles)
        canvases = canvases._replace(
            owners=np.full(count, -1, np.int32),
            sheets=np.zeros(count, np.uint8),
            sources=np.full(count, -1, np.int32),
        )
        if wanted:
            windows = [one.reshape(len(one), math.prod(one.shape[1:])) for one in self._windows(wanted)]
            canvases = canvases._replace(wanted=np.concatenate(windows, axis=1))
        if zones:
            canvases = canvases._replace(zones=np.concatenate([one.ravel() for one in self._windows(zones)]))
        if kept:
            shown = np.concatenate([one.ravel() for one in self._windows(kept)])
            here = (shown >= 0) & (canvases.triangles >= 0)
            canvases.owners[here], canvases.sheets[here] = 0, KEPT_SHEET
            canvases.sources[:] = np.where(shown >= 0, shown, np.where(shown < -1, -1 - shown, -1))
            canvases = canvases._replace(fixed=1)
        return replace(self, ground=self.ground._replace(canvases=canvases))

    def _windows(self, arrays: Sequence[NDArray[Any]]) -> list[NDArray[Any]]:
        # Crops arrays over complete charts (…, height, width) to the windows.
        canvases = self.ground.canvases
        return [
            array[..., row : row + height, column : column + width]
            for array, (row, column), height, width in zip(
                arrays,
                self.corners.tolist(),
                canvases.heights.tolist(),
                canvases.widths.tolist(),
                strict=True,
            )
        ]


@stage
def whole_ground(
    surface: ChartedSurface,
    vectors: FloatArray,
    field: FieldArrays,
    longest: float,
    **how: Any,
) -> PlacedGround:
    """Return the ground of a complete surface.

    `longest` is the maximum length of a triangle's edge; `how` are arguments of `ground_of`.
    """
    return ground_of(subdivided(surface, vectors, longest), field, **how)


def ground_of(
    fine: Subdivided,
    field: FieldArrays,
    *,
    crease: float | None,
    fold: int,
    turns: IntArray,
) -> PlacedGround:
    """Return the ground on which blocks are laid; `PlacedGround.bare` makes the arrays of its canvases.

    Parameters
    ----------
    fine
        A charted surface, or a part of it, with short edges.
    field
        All charts' warp fields, see `field_arrays`.
    crease
        Degrees: blocks end at edges where the surface bends by this angle or more. None: blocks cross all
        edges.
    fold
        1, 2 or 4: this many evenly rotated directions count as one.
    turns
        Quarter turns from the warp fields to the directions, for each triangle of the complete surface: see
        `upholster.charts.turns`.
    """
    corners, shapes, sizes = _windows(fine.surface)
    check_cancelled()
    mesh = _mesh_arrays(fine, corners, crease, fold, turns[fine.parent])
    canvases = _canvases(shapes)
    away, parts = np.full(len(canvases.triangles), np.inf, np.float32), thread_count()
    grid = StepGrid(canvases.firsts, canvases.heights, canvases.widths)
    located = mesh.places, mesh.chart, grid, canvases.triangles
    tasks = [partial(locate_steps, *located, (n, parts), away) for n in range(parts)]
    run_tasks(tasks)
    clear = _clear_cells(shapes)
    mark_edges(mesh, corners, sizes, clear)
    own = field._replace(origins=np.ascontiguousarray(field.origins - corners))
    return PlacedGround(Ground(mesh, own, clear, canvases), corners, sizes, fine.parent)


@stage
def field_arrays(fields: Sequence[WarpField], level: int) -> FieldArrays:
    """Return charts' warp fields in the kernels' form, in pixels of a level of the exemplar."""
    nodes = [field.matrices.reshape(-1, 4) / (UNIT << level) for field in fields]
    firsts = np.cumsum([0, *(len(part) for part in nodes)])
    shapes = np.array(
        [(first, *field.matrices.shape[:2]) for first, field in zip(firsts, fields, strict=False)]
    )
    origins = np.zeros((len(fields), 2))
    return FieldArrays(np.concatenate(nodes), shapes.astype(np.int64), float(FIELD_STEP), origins)


def _windows(surface: ChartedSurface) -> tuple[NDArray[np.int64], ...]:
    # For each chart: the first step of the window that contains its triangles, the window's size, and the
    # chart's size.
    sizes = np.array([(chart.height, chart.width) for chart in surface.charts], np.int64)
    low, high = np.empty(sizes.shape), np.empty(sizes.shape)
    bound_places(surface.chart, surface.places, low, high)
    empty: NDArray[np.bool_] = ~np.isfinite(low)
    low[empty] = high[empty] = 0.0
    first = np.floor((low - _MARGIN) / _ALIGNED).astype(np.int64) * _ALIGNED
    last = np.ceil((high + _MARGIN) / _ALIGNED).astype(np.int64) * _ALIGNED
    first, last = np.clip(first, 0, sizes), np.clip(last, 0, sizes)
    shapes = np.where(empty, 0, last - first)
    return first, shapes, sizes


def _mesh_arrays(
    fine: Subdivided, corners: NDArray[np.int64], crease: float | None, fold: int, turns: IntArray
) -> MeshArrays:
    surface, mesh = fine.surface, fine.surface.mesh
    along, down = triangle_frames(mesh, fine.vectors)
    across = surface.across.copy()
    if crease is not None:
        normals = mesh.flat_normals
        across[(normals[:, None] * normals[across // 3]).sum(axis=2) <= np.cos(np.radians(crease))] = -1
    # Unconnected fans of triangles around a vertex get separate vertices, because blocks are unfolded from
    # vertex to vertex.
    vertices = np.empty(mesh.triangles.shape, np.int32)
    count = corner_fans(across, vertices)
    first, listed = np.empty(count + 1, np.int64), np.empty(vertices.size, np.int32)
    corner_lists(vertices, first, listed)
    places = np.ascontiguousarray(surface.places - 0.5 - corners[surface.chart][:, None])
    seam, crossing = _crossings(surface)
    seam[across < 0] = -1
    return MeshArrays(
        corners=np.ascontiguousarray(mesh.corners),
        triangles=vertices,
        neighbours=across,
        first=first,
        around=listed,
        vectors=np.ascontiguousarray(fine.vectors),
        normals=np.ascontiguousarray(mesh.flat_normals),
        along=along,
        down=down,
        places=places,
        chart=np.ascontiguousarray(surface.chart),
        seam=seam,
        crossing=crossing,
        spread=np.bincount(vertices.ravel(), np.repeat(mesh.areas / 3, 3), count).astype(np.float64),
        fold=fold,
        turns=np.ascontiguousarray(turns, np.int32),
    )


def _crossings(surface: ChartedSurface) -> tuple[IntArray, FloatArray]:
    # Numbers of the edges on seams, −1 for other edges; and the transition over each: from steps on the
    # triangle's chart to steps on the chart across, with both planes unfolded around the edge.
    triangle, edge = np.nonzero(surface.is_seam)
    seam = np.full((len(surface.chart), 3), -1, np.int32)
    seam[triangle, edge] = np.arange(len(triangle))
    other, met = np.divmod(surface.across[triangle, edge], 3)
    here, there = surface.beside(triangle, edge), surface.beside(other, met)
    sound = (np.linalg.det(here) != 0) & (np.linalg.det(there) != 0)
    crossing = np.tile(np.eye(2), (len(sound), 1, 1))
    crossing[sound] = -np.linalg.solve(there[sound], here[sound])
    return seam, crossing


def _canvases(shapes: NDArray[np.int64]) -> Canvases:
    heights, widths = shapes.T
    firsts = np.cumsum([0, *(heights * widths).tolist()])
    count = int(firsts[-1])
    return Canvases(
        np.zeros(0, np.int32),
        np.zeros(0, np.uint8),
        np.zeros(0, np.int32),
        np.full(count, -1, np.int32),
        firsts[:-1].astype(np.int64),
        heights.copy(),
        widths.copy(),
        0,
        np.zeros((0, 0), np.uint8),
        np.zeros(0, np.uint8),
    )


def _clear_cells(sizes: NDArray[np.int64]) -> ClearCells:
    shapes = -(-sizes // CLEAR_CELL)
    firsts = np.cumsum([0, *(shapes[:, 0] * shapes[:, 1]).tolist()])
    return ClearCells(np.zeros(int(firsts[-1]), np.uint8), firsts[:-1].astype(np.int64), shapes)
