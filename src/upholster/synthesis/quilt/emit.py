"""Turns the visible parts of laid blocks into placements and labels.

A cell of a label map takes the block visible there. A placement's centre is the middle of a cell that shows
it, and its source is the position that the block reads there. Placements that stay from another quilt keep
their centres, even where they no longer show, and no two placements share a centre. Where the chart's field
alone would turn or stretch the placement noticeably, its matrix gets an offset, fitted to the cells that show
it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.quilt.labels import LabelMap, label_shape
from upholster.quilt.model import Quilt
from upholster.quilt.placement import MOST_OFFSET, PLACEMENT, SYMMETRIES, bare_placement
from upholster.quilt.warp_field import UNIT, WarpField
from upholster.runtime.parallel import run_tasks
from upholster.synthesis.quilt.kernels._block_kernels import (
    BLOCK_COLUMNS,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
)
from upholster.synthesis.quilt.kernels._emit_kernels import CentredArrays, ShownCells, centre_placements
from upholster.synthesis.quilt.kernels._label_map_kernels import (
    KEPT,
    fill_labels,
    label_beyond,
    label_cells,
    list_sheets,
)
from upholster.synthesis.quilt.kernels._sheet_kernels import FIT, FIT_PLACE, FIT_TURNS, MOST_SHEETS
from upholster.synthesis.quilt.laid_blocks import Drawn
from upholster.synthesis.quilt.lay_plan import LayPlan

__all__ = ["LABEL_CELL", "LabelPiece", "Labelled", "emitted_quilt", "label_pieces", "labelled"]

LABEL_CELL = 2
"""Side of a label map's cell in steps; blocks are blended over this width. Cells of two charts do not line
up: the larger they are, the larger is the jump of blocks' borders at seams."""

_SOURCE_UNIT, _OFFSET_UNIT = 4, 64
"""Sources are quarters of a pixel, offsets 1/64 pixel per step. Finer values would only cost bytes."""

_OFF = 0.3
"""Maximum error of a placement in pixels without an offset of its matrix."""

Labelled = tuple[NDArray[np.void], LabelMap]
"""A chart's placements and labels."""


@dataclass(frozen=True, eq=False, slots=True)
class LabelPiece:
    """A part of a chart's labels: a window of cells, with labels for the cells that one parcel shows.

    Attributes
    ----------
    chart
        Its number.
    corner
        Row and column of the window's first cell.
    labels
        (rows, columns) int32: the index of the sheet, in the lists below, that each cell shows; −1: this
        parcel has no label for the cell; `KEPT`: the cell stays as it was.
    away
        (rows, columns) float32: 0 on the surface, otherwise the squared distance, in steps, of a cell beyond
        a seam.
    numbers
        (n,) int64, ascending: for each sheet, its block's number · `MOST_SHEETS` + its own number.
    records, fits
        (n, `BLOCK_COLUMNS`) the records of the sheets' blocks, and (n, `FIT`) the sheets' fits on the chart.
    """

    chart: int
    corner: tuple[int, int]
    labels: IntArray
    away: NDArray[np.float32]
    numbers: NDArray[np.int64]
    records: IntArray
    fits: FloatArray


def label_pieces(plan: LayPlan, drawn: Drawn) -> list[LabelPiece]:
    """Return the labels of a parcel's own steps and of cells beyond its seams, one piece for each chart."""
    mesh, charts = drawn.placed.ground.mesh, plan.scene.charted.charts
    seams = np.argwhere((mesh.seam >= 0) & drawn.own[:, None])
    seams = seams[np.argsort(mesh.chart[seams[:, 0]], kind="stable")]
    ends = np.searchsorted(mesh.chart[seams[:, 0]], np.arange(len(charts) + 1))
    found: dict[int, LabelPiece] = {}
    shown = np.unique(mesh.chart[drawn.own]).tolist()
    free: list[IntArray] = []

    def label(n: int) -> None:
        edges = np.ascontiguousarray(seams[ends[n] : ends[n + 1]], np.int64)
        ranks = free.pop() if free else np.full(len(drawn.fits), -1, np.int32)
        found[n] = _piece(drawn, n, edges, _cell_of(plan, n), ranks)
        free.append(ranks)

    run_tasks([partial(label, n) for n in shown])
    return [found[n] for n in shown]


def _piece(drawn: Drawn, chart: int, edges: NDArray[np.int64], cell: int, ranks: IntArray) -> LabelPiece:
    ground, corner = drawn.placed.ground, drawn.placed.corners[chart]
    height, width = int(ground.canvases.heights[chart]), int(ground.canvases.widths[chart])
    seen = np.empty(label_shape(height, width, cell), np.int64)
    away = np.empty(seen.shape)
    label_cells(ground.canvases, drawn.own.view(np.uint8), chart, cell, away, seen)
    label_beyond(
        ground.mesh, ground.field, ground.canvases, drawn.firsts, drawn.fits, edges, chart, cell, away, seen
    )
    labels = np.empty(seen.shape, np.int32)
    keys = np.empty(min(seen.size, len(ranks)), np.int64)
    keys = keys[: list_sheets(seen, away, drawn.firsts, ranks, labels, keys)]
    block, sheet = np.divmod(keys, MOST_SHEETS)
    numbers = drawn.numbers[block] * MOST_SHEETS + sheet
    order = np.argsort(numbers)
    rank = np.full(len(order) + 1, -1, np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    fits = drawn.fits[drawn.firsts[block] + sheet]
    fits[:, FIT_PLACE] += corner
    first = int(corner[0]) // cell, int(corner[1]) // cell
    return LabelPiece(
        chart,
        first,
        np.where(labels == KEPT, KEPT, rank[np.maximum(labels, -1)]).astype(
            np.int32
        ),  # label -1 reads the last rank, which is -1
        away.astype(np.float32),
        numbers[order],
        drawn.records[block[order]],
        fits[order],
    )


def emitted_quilt(plan: LayPlan, pieces: Sequence[LabelPiece]) -> Quilt:
    """Return the quilt of all laid blocks.

    Parameters
    ----------
    plan
        The plan by which they were laid.
    pieces
        All parcels' labels, in the order of parcels.
    """
    charts = plan.scene.charted.charts
    of_charts: list[list[LabelPiece]] = [[] for _ in charts]
    for piece in pieces:
        of_charts[piece.chart].append(piece)
    found: list[Labelled | None] = [None] * len(charts)

    def label(n: int) -> None:
        found[n] = labelled(plan, n, of_charts[n])

    run_tasks([partial(label, n) for n in range(len(charts))])
    each = [one for one in found if one is not None]
    placements = np.concatenate([own for own, _ in each])
    labels = tuple((layer,) for _, layer in each)
    return Quilt(charts, plan.shape, placements, labels, plan.scene.fields, has_tones=plan.has_tones)


def _cell_of(plan: LayPlan, chart: int) -> int:
    # Each side of a tile is a whole number of cells. So the cells beyond an edge are those at the opposite
    # edge, and blocks are blended in the same way on both sides.
    own = plan.scene.charted.charts[chart]
    sides = (own.height, own.width) if plan.scene.charted.is_tile else ()
    return next(cell for cell in (LABEL_CELL, 3, 1) if not any(side % cell for side in sides))


def labelled(plan: LayPlan, number: int, pieces: Sequence[LabelPiece]) -> Labelled:
    """Return a chart's placements and labels, from all its pieces, which are in the order of parcels."""
    chart, field, shape = plan.scene.charted.charts[number], plan.scene.fields[number], plan.shape
    cell = _cell_of(plan, number)
    cells = label_shape(chart.height, chart.width, cell)
    stays = _Stays.of(plan.before, number, cell, _kept(cells, pieces))
    shown, sheets = _joined(stays.taken, pieces)
    if not len(sheets.numbers):
        if plan.before is not None:
            return plan.before.on_chart(number), plan.before.labels[number][0]
        none = np.zeros(shown.shape, np.int32)
        return bare_placement(number, (chart.height, chart.width), shape), LabelMap(cell, none)
    placed = np.zeros(len(sheets.numbers), PLACEMENT)
    placed["chart"] = number
    placed["symmetry"] = _PRODUCTS[sheets.records[:, SYMMETRY], sheets.fits[:, FIT_TURNS].astype(np.intp)]
    sources = sheets.records[:, [SOURCE_ROW, SOURCE_COLUMN, SYMMETRY]].astype(np.int64)
    sources[:, :2] -= plan.numbers.fringe
    free = np.where(stays.taken, np.int32(-1), shown)
    found = _centred(
        plan,
        ShownCells(free, cell, sheets.fits, sources, placed["symmetry"].copy(), plan.numbers.level, shape),
        field,
    )
    placed["row"], placed["column"] = 16 * cell * (found.cells.T - 1) + 8 * cell
    placed["source_row"], placed["source_column"] = found.reads.T
    placed["offset"] = _offsets(found)
    shown[stays.kept] = len(placed) + stays.labels
    placed = np.concatenate([placed, stays.placed])
    fill_labels(shown, np.empty(shown.size, np.int64))
    order = np.lexsort((placed["column"], placed["row"]))
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    return placed[order], LabelMap(cell, rank[shown])


def _centred(plan: LayPlan, cells: ShownCells, field: WarpField) -> CentredArrays:
    # The centres of a chart's placements, and the sums for fitting their matrices.
    count = len(cells.turns)
    found = CentredArrays(
        np.full((count, 2), -1, np.int64),
        np.zeros((count, 2), np.int64),
        np.zeros((count, 4), np.int64),
        np.zeros(count),
        np.zeros((count, 3)),
        np.zeros((count, 4)),
        np.full(count, np.inf),
        np.zeros((count, 3)),
    )
    centre_placements(plan.field, cells, field.matrices, field.margin, _SOURCE_UNIT, found)
    return found


def _offsets(found: CentredArrays) -> IntArray:
    """Return the matrices' offsets (n, 4), with which placements read as their blocks did; 0 within `_OFF`.

    With C + ΔC in place of C = M(c), a place q reads ½·ΔC·(q − c) further, turned by the symmetry T. ΔC is
    the least-squares solution over the cells that show the placement.
    """
    out = np.zeros((len(found.off), 4), np.int32)
    bent = np.flatnonzero(found.off > _OFF)
    if not len(bent):
        return out
    # The identity, one step squared, regularizes singular matrices.
    square = found.square[bent][:, [0, 1, 1, 2]].reshape(-1, 2, 2) + np.eye(2)
    added = found.product[bent].reshape(-1, 2, 2) @ np.linalg.inv(square)
    offset = _OFFSET_UNIT * np.rint(added.reshape(-1, 4) * UNIT / _OFFSET_UNIT)
    out[bent] = np.clip(offset, -MOST_OFFSET, MOST_OFFSET).astype(np.int32)
    return out


@dataclass(frozen=True, eq=False, slots=True)
class _Sheets:
    # The sheets that a chart shows; the attributes are those of `LabelPiece`.
    numbers: NDArray[np.int64]
    records: IntArray
    fits: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class _Stays:
    """The part of a chart that stays as it was.

    `kept` (rows, columns) is the mask of its cells. `placed` (n,) are the placements that they show, `labels`
    (cells,) the number of the one that each shows. `taken` (rows, columns) is the mask of the cells that
    contain these placements' centres; they may be outside the part.
    """

    kept: NDArray[np.bool_]
    placed: NDArray[np.void]
    labels: NDArray[np.intp]
    taken: NDArray[np.bool_]

    @classmethod
    def of(cls, quilt: Quilt | None, number: int, cell: int, kept: NDArray[np.bool_]) -> "_Stays":
        taken = np.zeros_like(kept)
        if quilt is None:
            return cls(kept, np.zeros(0, PLACEMENT), np.zeros(0, np.intp), taken)
        used, labels = np.unique(quilt.labels[number][0].labels[kept], return_inverse=True)
        placed = quilt.on_chart(number)[used]
        taken[placed["row"] // (16 * cell) + 1, placed["column"] // (16 * cell) + 1] = True
        return cls(kept, placed, labels.reshape(-1), taken)


def _kept(shape: tuple[int, int], pieces: Sequence[LabelPiece]) -> NDArray[np.bool_]:
    # A mask of the cells that stay as they were.
    kept = np.zeros(shape, np.bool_)
    for piece in pieces:
        kept[_window(piece)] |= piece.labels == KEPT
    return kept


def _window(piece: LabelPiece) -> tuple[slice, slice]:
    (i, j), (rows, columns) = piece.corner, piece.labels.shape
    return slice(i, i + rows), slice(j, j + columns)


def _joined(taken: NDArray[np.bool_], pieces: Sequence[LabelPiece]) -> tuple[IntArray, _Sheets]:
    # The sheet that each cell of a chart shows, −1 for none, and those sheets. Where two pieces label a cell,
    # the nearer piece counts; if both are equally near, the first. No two placements of a chart have their
    # centres in the same cell, so sheets that show only `taken` cells are left out.
    shown, nearest = np.full(taken.shape, -1, np.int32), np.full(taken.shape, np.inf, np.float32)
    numbers = np.concatenate([np.zeros(0, np.int64), *(piece.numbers for piece in pieces)])
    first = row = np.arange(len(numbers))
    if len(pieces) > 1:
        numbers, first, row = np.unique(numbers, return_index=True, return_inverse=True)
    start = 0
    for piece in pieces:
        window = _window(piece)
        nearer = (piece.labels >= 0) & (piece.away < nearest[window])
        shown[window][nearer] = row.reshape(-1)[start:][piece.labels[nearer]]
        nearest[window][nearer] = piece.away[nearer]
        start += len(piece.numbers)
    is_seen = np.zeros(len(numbers) + 1, np.bool_)
    is_seen[shown[~taken]] = True
    is_seen[-1] = False
    rank = np.where(is_seen, np.cumsum(is_seen, dtype=np.int32) - 1, -1)
    source = first[is_seen[:-1]]
    records = np.concatenate([np.zeros((0, BLOCK_COLUMNS), np.int32), *(piece.records for piece in pieces)])
    fits = np.concatenate([np.zeros((0, FIT)), *(piece.fits for piece in pieces)])
    shown = rank[shown].astype(np.int32)
    return shown, _Sheets(numbers[is_seen[:-1]], records[source], fits[source])


def _products() -> NDArray[np.uint8]:
    # The product of each two symmetries: the second one is applied first.
    matrices = SYMMETRIES.reshape(-1, 2, 2)
    both = (matrices[:, None] @ matrices).reshape(8, 8, 1, 4)
    found: NDArray[np.uint8] = (both == SYMMETRIES).all(axis=3).argmax(axis=2).astype(np.uint8)
    return found


_PRODUCTS = _products()
