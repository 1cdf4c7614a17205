"""Where blocks lie on a mesh: their footprints, and how each sheet of them reads the exemplar."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.charts.charted import ChartedSurface
from upholster.charts.directions._kernels import corner_fans
from upholster.charts.subdivision import Subdivided
from upholster.charts.warp_fields import triangle_frames
from upholster.geometry import TriangleMesh
from upholster.methods.quilt.mesh._sheet_kernels import (
    FIT,
    MOST_SHEETS,
    FieldArrays,
    SheetScratch,
    fit_sheets,
)
from upholster.methods.quilt.mesh._unfold_kernels import MeshArrays, UnfoldScratch, unfold_blocks
from upholster.parallel import run_tasks
from upholster.quilt.warp_field import FIELD_STEP, UNIT, WarpField
from upholster.types import FloatArray, IntArray, frozen_array

__all__ = ["Centres", "Footprints", "field_arrays", "find_footprints", "mesh_arrays"]

_BLOCKS_PER_TASK = 64
_ROOM = 1 << 16


@dataclass(frozen=True, eq=False, slots=True)
class Centres:
    """Blocks' centres, n of them.

    Attributes
    ----------
    triangles, shares
        (n,) int32 and (n, 3) float64: where on the mesh, in barycentric coordinates.
    roots
        (n, 6): the chart, the place of the nearest final texel there, in working texels, where that one
        reads, less the block's source, in frame pixels, and the quarter turns from the chart's matrix there
        to the block's.
    """

    triangles: IntArray
    shares: FloatArray
    roots: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Footprints:
    """What `_unfold_kernels` and `_sheet_kernels` find of some blocks."""

    firsts: NDArray[np.int64]
    triangles: IntArray
    maps: NDArray[np.float32]
    sheets: IntArray
    fits: FloatArray
    misfits: NDArray[np.uint8]

    def tuple(
        self,
    ) -> tuple[NDArray[np.int64], IntArray, NDArray[np.float32], IntArray, NDArray[np.uint8]]:
        """Return them as kernels take them."""
        return self.firsts, self.triangles, self.maps, self.sheets, self.misfits


def mesh_arrays(
    fine: Subdivided,
    texels: float = 1.0,
    crease: float | None = None,
    fold: int = 1,
    turns: IntArray | None = None,
) -> MeshArrays:
    """Return a subdivided surface as kernels take it, with its places on working charts.

    Blocks do not go on over edges at which the surface turns by `crease` degrees or more. What does not hang
    together round a vertex gets vertices of its own: blocks are unfolded from vertex to vertex.
    `fold` is that of the field of directions, and `turns` (T,) are the quarter turns that take the charts'
    warp fields to it, by default none.
    """
    surface, mesh = fine.surface, fine.surface.mesh
    along, down = triangle_frames(surface.mesh, fine.vectors)
    across = surface.across.copy()
    if crease is not None:
        normals = mesh.flat_normals
        across[(normals[:, None] * normals[across // 3]).sum(axis=2) <= np.cos(np.radians(crease))] = -1
    positions, triangles = _parted(mesh, across)
    owner = np.argsort(triangles.ravel(), kind="stable")
    first = np.searchsorted(triangles.ravel()[owner], np.arange(len(positions) + 1))
    places = surface.places / texels - 0.5
    seam, crossing = _crossings(surface, places)
    seam[across < 0] = -1
    return MeshArrays(
        positions,
        triangles,
        across,
        first.astype(np.int64),
        (owner // 3).astype(np.int32),
        np.ascontiguousarray(fine.vectors),
        mesh.flat_normals,
        along,
        down,
        places,
        surface.chart,
        seam,
        crossing,
        np.bincount(triangles.ravel(), np.repeat(mesh.areas / 3, 3), len(positions)).astype(np.float64),
        fold,
        np.zeros(len(mesh.triangles), np.int32) if turns is None else turns,
    )


def _parted(mesh: TriangleMesh, across: IntArray) -> tuple[FloatArray, IntArray]:
    """Return positions and triangles, with a vertex for each fan of triangles that hangs together round one.

    `across` (T, 3) is as `TriangleMesh.neighbours`, −1 where blocks end as well. Where all of a vertex hang
    together nothing changes.
    """
    fan = np.empty(mesh.triangles.shape, np.int32)
    count = corner_fans(across, fan)
    vertex = np.empty(count, np.int32)  # of each fan
    vertex[fan.ravel()] = mesh.triangles.ravel()
    is_more = np.ones(count, np.bool_)
    is_more[np.unique(vertex, return_index=True)[1]] = False  # the first fan of each keeps its number
    number = np.where(is_more, len(mesh.positions) - 1 + np.cumsum(is_more), vertex).astype(np.int32)
    positions = np.concatenate([mesh.positions, mesh.positions[vertex[is_more]]])
    return frozen_array(positions), frozen_array(number[fan])


def _crossings(surface: ChartedSurface, places: FloatArray) -> tuple[IntArray, FloatArray]:
    # The seams' edges by number, −1 elsewhere, and the transition over each: texel steps on its triangle's
    # chart to such steps beyond, both planes unfolded about the edge.
    mesh = surface.mesh
    triangle, edge = np.nonzero(surface.is_seam)
    seam = np.full((len(mesh.triangles), 3), -1, np.int32)
    seam[triangle, edge] = np.arange(len(triangle))
    other = surface.across[triangle, edge] // 3
    tangent = mesh.corners[triangle, (edge + 1) % 3] - mesh.corners[triangle, edge]
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1), 1e-300)[:, None]

    def flat(of: NDArray[np.intp]) -> FloatArray:
        # Lengths along the edge and across it, per texel step on the triangle's chart.
        axes = np.stack([tangent, np.cross(mesh.flat_normals[of], tangent)], axis=1)
        edges = (mesh.corners[of, 1:] - mesh.corners[of, :1]).transpose(0, 2, 1)
        steps = (places[of, 1:] - places[of, :1]).transpose(0, 2, 1)
        with np.errstate(invalid="ignore"):  # of triangles without area
            return axes @ edges @ _inverse(steps)

    here, there = flat(triangle), flat(other.astype(np.intp))
    with np.errstate(invalid="ignore"):
        crossing = _inverse(there) @ here
    return seam, np.ascontiguousarray(np.where(np.isfinite(crossing), crossing, np.eye(2)))


def _inverse(m: FloatArray) -> FloatArray:
    determinant = m[:, 0, 0] * m[:, 1, 1] - m[:, 0, 1] * m[:, 1, 0]
    adjoint = np.stack([m[:, 1, 1], -m[:, 0, 1], -m[:, 1, 0], m[:, 0, 0]], axis=1).reshape(-1, 2, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        out: FloatArray = adjoint / determinant[:, None, None]
    return out


def field_arrays(fields: Sequence[WarpField], texels: float, level: int) -> FieldArrays:
    """Return warp fields as kernels take them: in frame pixels of a level per working texel.

    `texels` are final texels per working texel.
    """
    nodes = [field.matrices.reshape(-1, 4) * (texels / (UNIT << level)) for field in fields]
    firsts = np.cumsum([0, *(len(part) for part in nodes)])
    shapes = np.array(
        [(first, *field.matrices.shape[:2]) for first, field in zip(firsts, fields, strict=False)]
    )
    return FieldArrays(
        np.concatenate(nodes), shapes.astype(np.int64), FIELD_STEP / texels, 0.5 / texels - 0.5
    )


def find_footprints(
    mesh: MeshArrays,
    field: FieldArrays,
    centres: Centres,
    half: float,
    scale: float,
    *,
    threads: int | None,
) -> Footprints:
    """Find the footprints of blocks, and fit their sheets.

    Parameters
    ----------
    mesh, field, centres
        The mesh, its warp fields and the blocks.
    half
        Half a block's side in frame pixels.
    scale
        Frame pixels per model unit.
    threads
        As in `upholster.parallel.run_tasks`.
    """
    count = len(centres.triangles)
    starts = range(0, count, _BLOCKS_PER_TASK)
    found: list[Footprints | None] = [None] * len(starts)
    free: list[tuple[UnfoldScratch, SheetScratch]] = []

    def find(k: int) -> None:
        scratch = free.pop() if free else _scratch(mesh)
        part = slice(starts[k], min(starts[k] + _BLOCKS_PER_TASK, count))
        found[k] = _find(mesh, field, centres, part, half, scale, scratch)
        free.append(scratch)

    run_tasks([partial(find, k) for k in range(len(starts))], threads=threads)
    return _joined([part for part in found if part is not None])


def _scratch(mesh: MeshArrays) -> tuple[UnfoldScratch, SheetScratch]:
    return UnfoldScratch.of(len(mesh.positions), len(mesh.triangles)), SheetScratch.of(len(mesh.triangles))


def _find(
    mesh: MeshArrays,
    field: FieldArrays,
    centres: Centres,
    part: slice,
    half: float,
    scale: float,
    scratch: tuple[UnfoldScratch, SheetScratch],
) -> Footprints:
    triangles, shares, roots = centres.triangles[part], centres.shares[part], centres.roots[part]
    count, room = len(triangles), _ROOM
    firsts, counts = np.zeros(count + 1, np.int64), np.zeros(count, np.int32)
    listed, sheets = np.empty(room, np.int32), np.empty(room, np.int32)
    maps = np.empty((room, 3, 2), np.float32)
    done = 0
    while True:
        done = unfold_blocks(
            mesh,
            triangles,
            shares,
            (done, count),
            half,
            scale,
            scratch[0],
            firsts,
            listed,
            maps,
            sheets,
            counts,
        )
        if done == count:
            break
        room *= 2
        listed, sheets = (np.concatenate([array, np.empty_like(array)]) for array in (listed, sheets))
        maps = np.concatenate([maps, np.empty_like(maps)])
    end = int(firsts[-1])
    listed, sheets, maps = listed[:end].copy(), sheets[:end].copy(), maps[:end].copy()
    fits = np.zeros((count, MOST_SHEETS, FIT))
    misfits = np.zeros(end, np.uint8)
    fit_sheets(
        *(mesh, field, roots, (0, count), half, firsts, listed, maps, sheets, counts, scratch[1]),
        *(scale, fits, misfits),
    )
    return Footprints(firsts, listed, maps, sheets, fits, misfits)


def _joined(parts: list[Footprints]) -> Footprints:
    if not parts:
        return Footprints(
            np.zeros(1, np.int64),
            np.zeros(0, np.int32),
            np.zeros((0, 3, 2), np.float32),
            np.zeros(0, np.int32),
            np.zeros((0, MOST_SHEETS, FIT)),
            np.zeros(0, np.uint8),
        )
    ends = np.cumsum([0, *(int(part.firsts[-1]) for part in parts)])
    firsts = [part.firsts[:-1] + end for part, end in zip(parts, ends, strict=False)]
    return Footprints(
        np.concatenate([*firsts, ends[-1:]]),
        np.concatenate([part.triangles for part in parts]),
        np.concatenate([part.maps for part in parts]),
        np.concatenate([part.sheets for part in parts]),
        np.concatenate([part.fits for part in parts]),
        np.concatenate([part.misfits for part in parts]),
    )
