"""One chart of a quilt: what finished charts leave on it, then its own blocks."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upholster.synthesis import _quilt_kernels as kernels
from upholster.synthesis._carry_kernels import lay_carried
from upholster.synthesis.carrying import Covering, joined
from upholster.synthesis.field import UNIT
from upholster.synthesis.quilt import MASK_CUT, MASK_NONE, PLACEMENT, Chart
from upholster.synthesis.raster import Raster
from upholster.synthesis.sights import Sights
from upholster.types import FloatArray

__all__ = ["lay_chart"]

_BLOCKS_PER_CALL = 256
_IDENTITY = np.array([[[UNIT, 0, 0, UNIT]]], np.int32)
_CARRIED = ("row", "column", "height", "width", "source_row", "source_column", "turn", "cells")


def lay_chart(
    index: int,
    raster: Raster,
    carried: Covering,
    open_sides: set[int],
    closed: Sequence[tuple[int, float, float, int]],
    sights: Sights,
    use: FloatArray,
    weights: FloatArray,
    *,
    shortlist: int,
    wrap: bool,
    seed: int,
    number: int,
) -> tuple[Covering, FloatArray]:
    """Lay a chart's blocks.

    Parameters
    ----------
    index, raster
        The chart and its blocks.
    carried, closed
        What finished charts leave on it, and where it must stay so: see `Carrying`.
    open_sides
        Edges at which a neighbour is still to come.
    sights, use, weights, shortlist
        As `lay_quilt` takes them.
    wrap
        Whether its opposite edges meet.
    seed
        Of its own random numbers.
    number
        Its first block's origin, see `Covering`.

    Returns
    -------
    covering
        All its placements.
    use
        Counts of use, its own blocks included.
    """
    chart, field, sight = raster.chart, raster.field, sights.levels[raster.level]
    need = raster.need(open_sides)
    blocks = raster.blocks(need)
    # Room for every block that touches the chart, whole.
    pads = (0, 0) if wrap else (2 * raster.height, 2 * raster.width)
    rows, columns = chart.height + 2 * pads[0], chart.width + 2 * pads[1]
    canvas = np.zeros((rows, columns * sight.channels), np.uint8)
    covered = np.zeros((rows, columns), np.uint8)
    matrices, margin = (_IDENTITY, 0) if field is None else (field.matrices, field.margin)
    if len(carried.placements):
        laid = np.stack([carried.placements[name].astype(np.int32) for name in _CARRIED], axis=1)
        sizes = sight.height, sight.width, sight.channels, raster.level
        lay_carried(
            canvas, covered, sight.image, sizes, matrices, margin, pads, raster.cell, laid, carried.cells
        )
    for side, start, stop, rim in closed:
        covered[_beyond(chart, side, start, stop, rim, pads)] |= 2
    p = np.zeros(kernels.PARAMETERS, np.int64)
    p[kernels.HEIGHT], p[kernels.WIDTH], p[kernels.CHANNELS] = sight.height, sight.width, sight.channels
    p[kernels.LEVEL], p[kernels.MARGIN], p[kernels.WRAP] = raster.level, margin, wrap
    p[kernels.ORIGIN_ROW], p[kernels.ORIGIN_COLUMN] = pads
    p[kernels.BLOCK_HEIGHT], p[kernels.BLOCK_WIDTH] = raster.height, raster.width
    p[kernels.SAMPLE], p[kernels.CELL], p[kernels.SHORTLIST] = raster.sample, raster.cell, shortlist
    p[kernels.STEP], p[kernels.LATTICE] = sight.step, sights.stride(raster.level)
    p[kernels.ACROSS] = raster.across(need)
    p[kernels.NEED_TOP], p[kernels.NEED_BOTTOM], p[kernels.NEED_LEFT], p[kernels.NEED_RIGHT] = need
    used, state = use.copy(), np.array([seed], np.uint64)
    cells = np.empty((len(blocks), raster.cells), np.uint8)
    for start in range(0, len(blocks), _BLOCKS_PER_CALL):
        # Few blocks a call: between two calls, Python can be interrupted.
        p[kernels.FIRST], p[kernels.LAST] = start, min(start + _BLOCKS_PER_CALL, len(blocks))
        kernels.lay_quilt(
            canvas, covered, sight.image, sight.plane, matrices, p, weights, used, state, blocks, cells
        )
    kept = np.flatnonzero(blocks[:, kernels.LAID])
    placed = _placements(index, raster, blocks[kept])
    own = Covering(placed, cells[kept].reshape(-1), number + kept, np.zeros(len(kept), np.int64))
    if wrap:
        own = _wrapped(own, chart)
    return replace(joined([carried, own]), bounds=need), used


def _placements(index: int, raster: Raster, blocks: NDArray[np.int32]) -> NDArray[np.void]:
    placed = np.zeros(len(blocks), PLACEMENT)
    placed["chart"] = index
    for name, place in (
        ("row", kernels.ROW),
        ("column", kernels.COLUMN),
        ("source_row", kernels.SOURCE_ROW),
        ("source_column", kernels.SOURCE_COLUMN),
    ):
        placed[name] = blocks[:, place]
    placed["height"], placed["width"] = raster.height, raster.width
    cut = blocks[:, kernels.LAID] == 1
    placed["mask"] = np.where(cut, MASK_CUT, MASK_NONE)
    placed["cells"] = np.where(cut, np.arange(len(blocks)) * raster.cells, -1)
    placed["cell"], placed["feather"] = np.where(cut, raster.cell, 0), np.where(cut, raster.feather, 0)
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


def _wrapped(own: Covering, chart: Chart) -> Covering:
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
    return Covering(np.concatenate(parts)[sequence], own.cells, zeros, zeros)
