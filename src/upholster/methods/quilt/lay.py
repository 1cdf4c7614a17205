"""One chart of a quilt: the blocks transferred from finished charts, then its own blocks."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._block_kernels import (
    COLUMN,
    LAID,
    LEFT,
    PHASE,
    ROW,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
    TOP,
    ChartCanvas,
    LayNumbers,
    LayScratch,
    LayWeights,
)
from upholster.methods.quilt._landmark_kernels import LandmarkUses
from upholster.methods.quilt._lay_kernels import lay_blocks
from upholster.methods.quilt._transfer_kernels import lay_transferred
from upholster.methods.quilt.emit import LABEL_CELL
from upholster.methods.quilt.grid import BlockGrid
from upholster.methods.quilt.landmarks import LandmarkRules, ShownBlocks
from upholster.methods.quilt.masked import BLOCK, step_matrices
from upholster.methods.quilt.match_pyramid import MatchLevel, MatchPyramid
from upholster.methods.quilt.phases import Phases
from upholster.methods.quilt.refinement import LaidChart, refine_chart
from upholster.methods.quilt.tile import refine_tile, wrapped
from upholster.methods.quilt.transfer import BlockTransfer, ChartPlacements, joined
from upholster.quilt.chart import Chart
from upholster.types import FloatArray, IntArray

__all__ = ["lay_chart"]

_BLOCKS_PER_CALL = 256
_TRANSFERRED = ("row", "column", "height", "width", "source_row", "source_column", "symmetry", "first_cell")


def lay_chart(
    index: int,
    grid: BlockGrid,
    transfer: BlockTransfer,
    finished: Sequence[ChartPlacements | None],
    match_pyramid: MatchPyramid,
    usage: FloatArray,
    weights: FloatArray,
    *,
    phases: Phases | None,
    landmarks: LandmarkRules,
    shown: Sequence[ShownBlocks | None],
    shortlist: int,
    symmetries: int,
    wrap: bool,
    seed: int,
    number: int,
    effort: int,
) -> tuple[ChartPlacements, FloatArray, ShownBlocks]:
    """Lay a chart's blocks.

    A chart that meets itself is laid in parts: blocks of the first half, these once more beyond the edge that
    they reach over, then those of the other half, which match both.

    Parameters
    ----------
    index, grid
        The chart, and where its blocks lie.
    transfer, finished
        How blocks get from chart to chart, and the overhangs of finished charts, None elsewhere.
    match_pyramid, usage, weights, shortlist
        What blocks are compared by; how much of the exemplar has been used; evenness, variety, tolerance and
        phase; how many candidates are judged at full resolution.
    phases
        Those that the surface wants, None where none are looked at.
    landmarks, shown
        The sample's landmarks, and where finished charts show them, None elsewhere.
    symmetries
        Which symmetries its own blocks may have, a bit for each.
    wrap
        Whether its opposite edges meet as a tile's do.
    seed
        Of its own random numbers.
    number
        Its first block's origin, see `ChartPlacements`.
    effort
        How much is revisited where cuts cost most, 0 for nothing.

    Returns
    -------
    placements
        All its placements.
    usage
        How much of the exemplar has been used, its own blocks included.
    shown
        Where it shows landmarks.
    """
    around = transfer.closed_around(index)
    opened = grid.opened({edge for edge, *_ in around})
    need = grid.need(transfer.open_sides(index, finished) | opened)
    parts = grid.parts(need, opened)
    blocks = grid.blocks(need)
    if phases is not None:
        wanted = phases.at(index, blocks[:, ROW].astype(np.float64), blocks[:, COLUMN].astype(np.float64))
        blocks[:, PHASE : PHASE + len(wanted)] = wanted.T
    blocks = _in_order(blocks, np.concatenate([part.blocks for part in parts]))
    uses = landmarks.uses(index, blocks, grid.level, grid.across(need), shown)
    layer = _ChartLayer.of(
        index, grid, need, blocks, match_pyramid, usage, uses, shortlist, symmetries, wrap, seed
    )
    laid = [transfer.transferred_onto(index, finished)]
    layer.lay_transferred(laid[0])
    layer.close(transfer.closed(index, finished))
    start = 0
    for part in parts:
        if part.closed:
            again = transfer.transferred_around(index, replace(joined(laid), bounds=need))
            layer.lay_transferred(again)
            layer.close([side for side in around if side[0] in part.closed])
            laid.append(again)
        stop = start + len(part.blocks)
        laid.append(layer.lay_own(LayWeights(*weights.tolist()), start, stop, number))
        start = stop
    # Nothing changes any more along edges where the chart meets itself: both sides are laid.
    layer.close(around)
    whole = replace(joined(laid), bounds=need)
    if effort:
        refine = refine_tile if wrap else refine_chart
        whole = refine(layer.laid_chart(weights, phases, number), whole, effort)
    if wrap:
        whole = wrapped(whole, grid.chart, rim=2 * LABEL_CELL)
    return whole, layer.usage, landmarks.shown(uses)


def _in_order(blocks: IntArray, order: NDArray[np.intp]) -> IntArray:
    # Blocks in another order than their raster's, with their neighbours' new places.
    place = np.empty(len(order) + 1, np.int32)
    place[order], place[-1] = np.arange(len(order), dtype=np.int32), -1
    out = blocks[order]
    for column in (LEFT, TOP):
        out[:, column] = place[out[:, column]]
    return out


@dataclass(eq=False)
class _ChartLayer:
    """A chart while it is laid: its canvas, with room round it for every block that touches the chart.

    `usage` counts how much of the exemplar has been used, `uses` tells where landmarks are shown, and
    `state` is that of the random numbers; the rest is what the kernels take.
    """

    index: int
    grid: BlockGrid
    need: tuple[int, int, int, int]
    match_level: MatchLevel
    canvas: ChartCanvas
    pads: tuple[int, int]
    numbers: LayNumbers
    blocks: IntArray
    cells: NDArray[np.uint8]
    usage: FloatArray
    uses: LandmarkUses
    state: NDArray[np.uint64]
    scratch: LayScratch

    @classmethod
    def of(
        cls,
        index: int,
        grid: BlockGrid,
        need: tuple[int, int, int, int],
        blocks: IntArray,
        match_pyramid: MatchPyramid,
        usage: FloatArray,
        uses: LandmarkUses,
        shortlist: int,
        symmetries: int,
        wrap: bool,
        seed: int,
    ) -> "_ChartLayer":
        """Begin a chart."""
        match_level = match_pyramid.levels[grid.level]
        pads = (0, 0) if wrap else (2 * grid.height, 2 * grid.width)
        rows, columns = grid.chart.height + 2 * pads[0], grid.chart.width + 2 * pads[1]
        canvas = ChartCanvas(
            np.zeros((rows, columns), np.int32),
            np.zeros((rows, columns), np.uint8),
            np.zeros((rows, columns), np.uint8),
        )
        numbers = _numbers(
            grid, need, match_level, match_pyramid.stride(grid.level), pads, shortlist, symmetries, wrap
        )
        used, state = usage.copy(), np.array([seed], np.uint64)
        cells = np.empty((len(blocks), grid.cells), np.uint8)
        scratch = LayScratch.of(numbers, used)
        return cls(
            index, grid, need, match_level, canvas, pads, numbers, blocks, cells, used, uses, state, scratch
        )

    def lay_transferred(self, transferred: ChartPlacements) -> None:
        """Lay blocks that were transferred to the chart."""
        if not len(transferred.placements):
            return
        field, level = self.grid.field, self.match_level
        laid = np.stack([transferred.placements[name].astype(np.int32) for name in _TRANSFERRED], axis=1)
        lay_transferred(
            self.canvas,
            level.match.image,
            (level.height, level.width, self.grid.level),
            field.matrices,
            field.margin,
            self.pads,
            self.grid.mask_cell,
            np.concatenate([laid, step_matrices(field, transferred.placements)], axis=1),
            transferred.cells,
        )

    def close(self, closed: Sequence[tuple[int, float, float, int]]) -> None:
        """Let nothing change any more along some parts of edges, see `BlockTransfer.closed`."""
        for side, start, stop, rim in closed:
            self.canvas.covered[_beyond(self.grid.chart, side, start, stop, rim, self.pads)] |= 2

    def laid_chart(self, weights: FloatArray, phases: Phases | None, number: int) -> LaidChart:
        """Return the chart as it is refined."""
        return LaidChart(
            self.index,
            self.grid,
            self.canvas,
            self.match_level,
            self.numbers,
            LayWeights(*weights.tolist()),
            self.usage,
            self.state,
            phases,
            number + len(self.blocks),
        )

    def lay_own(self, weights: LayWeights, start: int, stop: int, number: int) -> ChartPlacements:
        """Lay the chart's own blocks from `start` to before `stop`; `number` is the first one's origin."""
        level = self.match_level
        for first in range(start, stop, _BLOCKS_PER_CALL):
            # Few blocks a call: between two calls, Python can be interrupted.
            lay_blocks(
                self.canvas,
                level.match,
                self.grid.field.matrices,
                self.numbers,
                weights,
                self.usage,
                self.uses,
                self.state,
                self.blocks,
                (first, min(first + _BLOCKS_PER_CALL, stop)),
                self.cells,
                self.scratch,
            )
        kept = start + np.flatnonzero(self.blocks[start:stop, LAID])
        placed = _placements(self.index, self.grid, self.blocks[kept])
        steps = np.zeros(len(kept), np.int64)
        return ChartPlacements(placed, self.cells[kept].reshape(-1), number + kept, steps)


def _numbers(
    grid: BlockGrid,
    need: tuple[int, int, int, int],
    match_level: MatchLevel,
    usage_step: int,
    pads: tuple[int, int],
    shortlist: int,
    symmetries: int,
    wrap: bool,
) -> LayNumbers:
    top, bottom, left, right = need
    return LayNumbers(
        height=match_level.height,
        width=match_level.width,
        level=grid.level,
        step=match_level.step,
        shortlist=shortlist,
        usage_step=usage_step,
        symmetries=symmetries,
        margin=grid.field.margin,
        origin_row=pads[0],
        origin_column=pads[1],
        wrap=int(wrap),
        block_height=grid.height,
        block_width=grid.width,
        mask_cell=grid.mask_cell,
        across=grid.across(need),
        sample=grid.sample,
        need_top=top,
        need_bottom=bottom,
        need_left=left,
        need_right=right,
    )


def _placements(index: int, grid: BlockGrid, blocks: NDArray[np.int32]) -> NDArray[np.void]:
    placed = np.zeros(len(blocks), BLOCK)
    placed["chart"] = index
    for name, place in (
        ("row", ROW),
        ("column", COLUMN),
        ("source_row", SOURCE_ROW),
        ("source_column", SOURCE_COLUMN),
        ("symmetry", SYMMETRY),
    ):
        placed[name] = blocks[:, place]
    placed["height"], placed["width"] = grid.height, grid.width
    cut = blocks[:, LAID] == 1
    placed["first_cell"] = np.where(cut, np.arange(len(blocks)) * grid.cells, -1)
    placed["mask_cell"] = np.where(cut, grid.mask_cell, 0)
    return placed


def _beyond(
    chart: Chart, side: int, start: float, stop: float, rim: int, pads: tuple[int, int]
) -> tuple[slice, slice]:
    # The part of a chart's canvas that lies beyond part of an edge, or at most `rim` texels inside it.
    pad_rows, pad_columns = pads
    length, pad = (chart.height, pad_rows) if side & 1 else (chart.width, pad_columns)
    low, high = (int(np.clip(np.rint(pad + end), 0, length + 2 * pad)) for end in (start, stop))
    along = slice(low, high)
    return (
        (slice(0, pad_rows + rim), along),
        (along, slice(pad_columns + chart.width - rim, None)),
        (slice(pad_rows + chart.height - rim, None), along),
        (along, slice(0, pad_columns + rim)),
    )[side]
