"""Refining a mesh that is laid: where blocks' cuts cost most, larger ones are laid over them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._block_kernels import LayNumbers, LayScratch, LayWeights, MatchImage
from upholster.methods.quilt._expansion_kernels import CellLattice, ChartCells, ExpansionScratch
from upholster.methods.quilt._landmark_kernels import LandmarkUses
from upholster.methods.quilt._refine_kernels import RefineScratch, RefineWeights
from upholster.methods.quilt.masked import LARGEST_BLOCK
from upholster.methods.quilt.mesh._frame_kernels import COST, Canvases
from upholster.methods.quilt.mesh._refine_frame_kernels import refine_frames
from upholster.methods.quilt.mesh._unfold_kernels import MeshArrays
from upholster.methods.quilt.mesh.frames import Frame, Lot, enter_frame, frame_numbers, frame_span
from upholster.types import FloatArray, IntArray, Progress

__all__ = ["RefinedMesh", "dearest", "larger_frame", "refine_lot"]

_REGION = 2.0
"""Side of a region, in blocks: the cut needs room between what does not fit and the region's rim."""

_LEAST = (1.4, 0.7)
"""A block's region is tried if its cut costs so many times the average: with an effort of 2; with more."""

_SAVING = 13
"""A move is taken if it saves so many 64ths of what cuts in the region's middle cost."""

_SHORTLIST, _TRIES = 12, 2
_SHARE = 0.02
_TOLERANCE = 1.5
_LARGEST_SHARE = 0.75
"""As in `upholster.methods.quilt.refinement`."""

_FRAMES_PER_CALL = 64


@dataclass(frozen=True, eq=False, slots=True)
class RefinedMesh:
    """What `lay_frames` leaves, see there; all but the mesh goes on."""

    mesh: MeshArrays
    canvases: Canvases
    match: MatchImage
    weights: LayWeights
    usage: FloatArray
    uses: LandmarkUses
    state: NDArray[np.uint64]


def dearest(blocks: IntArray, effort: int) -> NDArray[np.intp]:
    """Return which blocks are looked at: those whose cuts cost most, first; none with an effort below 2.

    A block here is several sheets, each with a mask: a tenth of a stream would go for cuts that cost a
    thirtieth less.
    """
    if effort < 2:
        return np.zeros(0, np.intp)
    costs = np.where(blocks[:, 2] == 1, blocks[:, COST], 0).astype(np.int64)
    average = int(costs.sum()) / max(1, int((costs > 0).sum()))
    order = np.argsort(-costs, kind="stable")
    return order[costs[order] > _LEAST[min(effort, 3) - 2] * average]


def larger_frame(frame: Frame, height: int, width: int) -> Frame:
    """Return the frame of a region; `height` and `width` are the exemplar's on the frame's level."""
    most = min(_LARGEST_SHARE * min(height, width), 0.5 * LARGEST_BLOCK / frame.texels)
    size = 2 * frame.cell * int(min(_REGION * frame.size, most) / (2 * frame.cell))
    return Frame(max(frame.size, size), frame.cell, frame.level, frame.scale, frame.texels)


def refine_lot(
    lot: Lot, mesh: RefinedMesh, laid: int, numbers: LayNumbers, progress: Progress | None
) -> None:
    """Lay blocks of larger frames as far as cuts get cheaper.

    Parameters
    ----------
    lot
        The frames, in order; blocks and masks receive what is laid.
    mesh
        What is laid, which changes.
    laid
        How many blocks there are before.
    numbers
        Of the blocks that are laid.
    progress
        As in `upholster.parallel.run_tasks`; stage "blocks".
    """
    size, cell, count = lot.frame.size, lot.frame.cell, len(lot.blocks)
    own = frame_numbers(numbers, size)._replace(shortlist=min(_SHORTLIST, numbers.shortlist))
    across = size // cell
    lattice = CellLattice(across, across, cell, 0, 0, across, across)
    cells = ChartCells(
        np.empty((across, across), np.int32),
        np.empty((across, across), np.uint8),
        np.zeros((2, across, across), np.int32),
    )
    scratch, expansion = LayScratch.of(own, mesh.usage), ExpansionScratch.of(lattice)
    enter_frame(scratch.texels)
    refine = RefineScratch.of(lattice, _TRIES, 0)
    area = (numbers.block_height // cell) ** 2
    weights = RefineWeights(1, _SAVING, 0, _TRIES, float(area), _SHARE, 0.0)
    covered, sources = np.zeros((size + 2, size + 2), np.uint8), np.zeros((size, size), np.int32)
    inside = np.zeros(len(mesh.mesh.triangles), np.uint8)
    for start in range(0, count, _FRAMES_PER_CALL):
        # Few frames a call: between two calls, Python can be interrupted.
        stop = min(start + _FRAMES_PER_CALL, count)
        refine_frames(
            mesh.mesh,
            mesh.canvases,
            mesh.match,
            own,
            mesh.weights._replace(tolerance=_TOLERANCE),
            weights,
            frame_span(own),
            mesh.usage,
            mesh.uses,
            mesh.state,
            laid,
            (start, stop),
            lot.footprints.tuple(),
            lot.blocks,
            lot.masks,
            lattice,
            cells,
            covered,
            sources,
            inside,
            scratch,
            expansion,
            refine,
        )
        if progress is not None:
            progress("blocks", stop, count)
