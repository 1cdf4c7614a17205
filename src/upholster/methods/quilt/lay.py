"""One chart of a quilt: the blocks transferred from finished charts, then its own blocks."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._block_kernels import (
    COLUMN,
    LAID,
    ROW,
    SOURCE_COLUMN,
    SOURCE_ROW,
    ChartCanvas,
    LayNumbers,
    LayScratch,
    LayWeights,
    MatchImage,
)
from upholster.methods.quilt._lay_kernels import lay_blocks
from upholster.methods.quilt._transfer_kernels import lay_transferred
from upholster.methods.quilt.grid import BlockGrid
from upholster.methods.quilt.match_pyramid import MatchPyramid
from upholster.methods.quilt.transfer import ChartPlacements, joined
from upholster.quilt.chart import Chart
from upholster.quilt.displacement import centre_matrices
from upholster.quilt.placement import MASK_CUT, MASK_NONE, PLACEMENT
from upholster.types import FloatArray

__all__ = ["lay_chart"]

_BLOCKS_PER_CALL = 256
_TRANSFERRED = ("row", "column", "height", "width", "source_row", "source_column", "symmetry", "first_cell")


def lay_chart(
    index: int,
    grid: BlockGrid,
    transferred: ChartPlacements,
    open_sides: set[int],
    closed: Sequence[tuple[int, float, float, int]],
    match_pyramid: MatchPyramid,
    usage: FloatArray,
    weights: FloatArray,
    *,
    shortlist: int,
    wrap: bool,
    seed: int,
    number: int,
) -> tuple[ChartPlacements, FloatArray]:
    """Lay a chart's blocks.

    Parameters
    ----------
    index, grid
        The chart, and where its blocks lie.
    transferred, closed
        The blocks transferred from finished charts, and where these must stay as they are: see
        `BlockTransfer.transferred_onto` and `BlockTransfer.closed`.
    open_sides
        Edges at which a neighbour is not laid yet.
    match_pyramid, usage, weights, shortlist
        What blocks are compared by; how much of the exemplar has been used; evenness, variety and tolerance;
        how many candidates are judged at full resolution.
    wrap
        Whether its opposite edges meet.
    seed
        Of its own random numbers.
    number
        Its first block's origin, see `ChartPlacements`.

    Returns
    -------
    placements
        All its placements.
    usage
        How much of the exemplar has been used, its own blocks included.
    """
    chart, field, match_level = grid.chart, grid.field, match_pyramid.levels[grid.level]
    need = grid.need(open_sides)
    blocks = grid.blocks(need)
    # Room for every block that touches the chart, whole.
    pads = (0, 0) if wrap else (2 * grid.height, 2 * grid.width)
    rows, columns = chart.height + 2 * pads[0], chart.width + 2 * pads[1]
    canvas = np.zeros((rows, columns * match_level.channels), np.uint8)
    covered = np.zeros((rows, columns), np.uint8)
    matrices, margin = field.matrices, field.margin
    if len(transferred.placements):
        laid = np.stack([transferred.placements[name].astype(np.int32) for name in _TRANSFERRED], axis=1)
        laid = np.concatenate([laid, centre_matrices(field, transferred.placements)], axis=1)
        sizes = match_level.height, match_level.width, match_level.channels, grid.level
        lay_transferred(
            canvas,
            covered,
            match_level.image,
            sizes,
            matrices,
            margin,
            pads,
            grid.mask_cell,
            laid,
            transferred.cells,
        )
    for side, start, stop, rim in closed:
        covered[_beyond(chart, side, start, stop, rim, pads)] |= 2
    top, bottom, left, right = need
    numbers = LayNumbers(
        height=match_level.height,
        width=match_level.width,
        channels=match_level.channels,
        level=grid.level,
        step=match_level.step,
        shortlist=shortlist,
        usage_step=match_pyramid.stride(grid.level),
        margin=margin,
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
    used, state = usage.copy(), np.array([seed], np.uint64)
    cells = np.empty((len(blocks), grid.cells), np.uint8)
    scratch = LayScratch.of(numbers, used)
    for start in range(0, len(blocks), _BLOCKS_PER_CALL):
        # Few blocks a call: between two calls, Python can be interrupted.
        lay_blocks(
            ChartCanvas(canvas, covered),
            MatchImage(match_level.image, match_level.plane),
            matrices,
            numbers,
            LayWeights(*weights.tolist()),
            used,
            state,
            blocks,
            (start, min(start + _BLOCKS_PER_CALL, len(blocks))),
            cells,
            scratch,
        )
    kept = np.flatnonzero(blocks[:, LAID])
    placed = _placements(index, grid, blocks[kept])
    none = np.full((len(kept), 2), -1, np.int64)
    own = ChartPlacements(placed, cells[kept].reshape(-1), number + kept, np.zeros(len(kept), np.int64), none)
    if wrap:
        own = _wrapped(own, chart)
    return replace(joined([transferred, own]), bounds=need), used


def _placements(index: int, grid: BlockGrid, blocks: NDArray[np.int32]) -> NDArray[np.void]:
    placed = np.zeros(len(blocks), PLACEMENT)
    placed["chart"] = index
    for name, place in (
        ("row", ROW),
        ("column", COLUMN),
        ("source_row", SOURCE_ROW),
        ("source_column", SOURCE_COLUMN),
    ):
        placed[name] = blocks[:, place]
    placed["height"], placed["width"] = grid.height, grid.width
    cut = blocks[:, LAID] == 1
    placed["mask"] = np.where(cut, MASK_CUT, MASK_NONE)
    placed["first_cell"] = np.where(cut, np.arange(len(blocks)) * grid.cells, -1)
    placed["mask_cell"], placed["feather"] = np.where(cut, grid.mask_cell, 0), np.where(cut, grid.feather, 0)
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


def _wrapped(own: ChartPlacements, chart: Chart) -> ChartPlacements:
    # What reaches beyond an edge comes in again at the opposite one, right after.
    placed = own.placements
    parts, order = [placed], [np.arange(float(len(placed)))]
    top, left = placed["row"] - placed["height"] // 2, placed["column"] - placed["width"] // 2
    below, beside = top + placed["height"] > chart.height, left + placed["width"] > chart.width
    for rows, columns, crossing in ((1, 0, below), (0, 1, beside), (1, 1, below & beside)):
        again = placed[crossing].copy()
        again["row"] -= rows * chart.height
        again["column"] -= columns * chart.width
        parts.append(again)
        order.append(np.flatnonzero(crossing) + 0.25 * (rows + 2 * columns))
    sequence = np.argsort(np.concatenate(order), kind="stable")
    zeros = np.zeros(len(sequence), np.int64)
    none = np.full((len(sequence), 2), -1, np.int64)
    return ChartPlacements(np.concatenate(parts)[sequence], own.cells, zeros, zeros, none)
