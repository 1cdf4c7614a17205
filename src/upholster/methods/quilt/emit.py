"""What shows of laid blocks becomes placements and labels.

A label map's cell takes the block that shows there. A placement's centre lies in the middle of a cell that
shows it, with what the block reads there; where its chart's field alone would turn or stretch it by more than
a little, its matrix gets an offset, fitted to the cells that show it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._block_kernels import BLOCK_COLUMNS, SOURCE_COLUMN, SOURCE_ROW, SYMMETRY
from upholster.methods.quilt._label_kernels import fill_labels, label_beyond, label_cells, read_cells
from upholster.methods.quilt._sheet_kernels import FIT, MOST_SHEETS
from upholster.methods.quilt.laying import Drawn, LayPlan
from upholster.parallel import run_tasks
from upholster.quilt.chart import Chart
from upholster.quilt.displacement import warped_sources
from upholster.quilt.labels import LabelMap, cell_centres, label_shape
from upholster.quilt.model import Quilt
from upholster.quilt.placement import MOST_OFFSET, PLACEMENT, SYMMETRIES, bare_placement
from upholster.quilt.warp_field import UNIT, WarpField
from upholster.types import FloatArray, IntArray

__all__ = ["LABEL_CELL", "LabelPiece", "Labelled", "emitted_quilt", "label_pieces", "labelled"]

LABEL_CELL = 2
"""Steps a side of a cell of label maps: blocks are blended over so many. Cells of two charts do not line up:
the larger they are, the more a border of blocks is off where it crosses a seam."""

_SOURCE_UNIT, _OFFSET_UNIT = 4, 64
"""Sources are quarters of a pixel, offsets 1/64 pixel for a step: finer ones only cost bytes."""

_OFF = 0.3
"""Pixels that a placement may be off somewhere before its matrix gets an offset."""

_AT_ONCE = 2**18
"""Cells that are looked at, at a time, about: those of a large chart would take much memory."""

Labelled = tuple[NDArray[np.void], LabelMap]
"""A chart's placements and labels."""


@dataclass(frozen=True, eq=False, slots=True)
class LabelPiece:
    """A part of a chart's labels: a window of cells, of which one parcel tells those that it shows.

    Attributes
    ----------
    chart
        Its number.
    corner
        Row and column of the window's first cell.
    labels
        (rows, columns) int32: which of the sheets below shows in a cell; −1: this parcel does not tell.
    away
        (rows, columns) float32: 0 where the surface lies, else how far beyond a seam a cell lies, in square
        steps.
    numbers
        (n,) int64, ascending: of each sheet the block's number · `MOST_SHEETS` + the sheet's.
    records, fits
        (n, `BLOCK_COLUMNS`) the block's, and (n, `FIT`) how the sheet reads, on the chart.
    """

    chart: int
    corner: tuple[int, int]
    labels: IntArray
    away: NDArray[np.float32]
    numbers: NDArray[np.int64]
    records: IntArray
    fits: FloatArray


def label_pieces(plan: LayPlan, drawn: Drawn) -> list[LabelPiece]:
    """Return the labels of a parcel's own steps, and of the cells beyond its seams, chart by chart."""
    mesh, charts = drawn.placed.ground.mesh, plan.surface.charts
    seams = np.argwhere((mesh.seam >= 0) & drawn.own[:, None])
    seams = seams[np.argsort(mesh.chart[seams[:, 0]], kind="stable")]
    ends = np.searchsorted(mesh.chart[seams[:, 0]], np.arange(len(charts) + 1))
    pieces = []
    for n in np.unique(mesh.chart[drawn.own]).tolist():
        edges = np.ascontiguousarray(seams[ends[n] : ends[n + 1]], np.int64)
        pieces.append(_piece(drawn, n, edges, _cell_of(plan, n)))
    return pieces


def _piece(drawn: Drawn, chart: int, edges: NDArray[np.int64], cell: int) -> LabelPiece:
    ground, corner = drawn.placed.ground, drawn.placed.corners[chart]
    height, width = int(ground.canvases.heights[chart]), int(ground.canvases.widths[chart])
    seen = np.empty(label_shape(height, width, cell), np.int64)
    away = np.empty(seen.shape)
    label_cells(ground.canvases, drawn.own.view(np.uint8), chart, cell, away, seen)
    label_beyond(
        ground.mesh, ground.field, ground.canvases, drawn.firsts, drawn.fits, edges, chart, cell, away, seen
    )
    told = (seen >= 0) & (away >= 0)
    keys, row = np.unique(seen[told], return_inverse=True)
    block, sheet = np.divmod(keys, MOST_SHEETS)
    numbers = drawn.numbers[block] * MOST_SHEETS + sheet
    order = np.argsort(numbers)
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    labels = np.full(seen.shape, -1, np.int32)
    labels[told] = rank[row.reshape(-1)]
    fits = drawn.fits[drawn.firsts[block] + sheet]
    fits[:, 2:4] += corner
    first = int(corner[0]) // cell, int(corner[1]) // cell
    return LabelPiece(
        chart,
        first,
        labels,
        away.astype(np.float32),
        numbers[order],
        drawn.records[block[order]],
        fits[order],
    )


def emitted_quilt(plan: LayPlan, pieces: Sequence[LabelPiece], *, threads: int | None = None) -> Quilt:
    """Return the quilt of what was laid.

    Parameters
    ----------
    plan
        By which it was laid.
    pieces
        All parcels' labels, in the order of parcels.
    threads
        As in `upholster.parallel.run_tasks`.
    """
    charts = plan.surface.charts
    of_charts: list[list[LabelPiece]] = [[] for _ in charts]
    for piece in pieces:
        of_charts[piece.chart].append(piece)
    found: list[Labelled | None] = [None] * len(charts)

    def label(n: int) -> None:
        found[n] = labelled(plan, n, of_charts[n])

    run_tasks([partial(label, n) for n in range(len(charts))], threads=threads)
    each = [one for one in found if one is not None]
    placements = np.concatenate([own for own, _ in each])
    return Quilt(charts, plan.shape, placements, tuple((layer,) for _, layer in each), plan.fields)


def _cell_of(plan: LayPlan, chart: int) -> int:
    # Of a tile's cells a whole number is each side: then cells beyond an edge are those at the opposite one,
    # and blocks are blended alike on both sides.
    own = plan.surface.charts[chart]
    sides = (own.height, own.width) if plan.surface.is_tile else ()
    return next(cell for cell in (LABEL_CELL, 3, 1) if not any(side % cell for side in sides))


def labelled(plan: LayPlan, number: int, pieces: Sequence[LabelPiece]) -> Labelled:
    """Return a chart's placements and labels, from all its pieces in the order of parcels."""
    chart, field, shape = plan.surface.charts[number], plan.fields[number], plan.shape
    cell = _cell_of(plan, number)
    shown, sheets = _joined(label_shape(chart.height, chart.width, cell), pieces)
    cells = np.flatnonzero(shown >= 0)
    if not len(cells):
        none = np.zeros(shown.shape, np.int32)
        return bare_placement(number, (chart.height, chart.width), shape), LabelMap(cell, none)
    owner = shown.ravel()[cells]
    placed = np.zeros(len(sheets.numbers), PLACEMENT)
    placed["chart"] = number
    placed["symmetry"] = _PRODUCTS[sheets.records[:, SYMMETRY], sheets.fits[:, 10].astype(np.intp)]
    centres = np.empty((len(placed), 2), np.int64)
    for first, stop, which in _groups(owner, len(placed)):
        at = np.stack(np.divmod(cells[which], shown.shape[1]), axis=1)
        own = _Sheets(sheets.numbers[first:stop], sheets.records[first:stop], sheets.fits[first:stop])
        on = (chart, field, shape, cell)
        centres[first:stop] = _recentred(plan, placed[first:stop], own, owner[which] - first, at, on)
    fill_labels(shown, np.empty(shown.size, np.int64))
    order = np.lexsort((centres[:, 1], centres[:, 0]))
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    return placed[order], LabelMap(cell, rank[shown])


def _groups(owner: IntArray, count: int) -> Iterator[tuple[int, int, NDArray[np.intp] | slice]]:
    # Groups of placements: the first, the one after the last, and which cells (n,) show them.
    if len(owner) <= _AT_ONCE:
        yield 0, count, slice(None)
        return
    order = np.argsort(owner, kind="stable")
    ends = np.cumsum(np.bincount(owner, minlength=count))
    start = first = 0
    while first < count:
        stop = max(int(np.searchsorted(ends, start + _AT_ONCE)), first + 1)
        yield first, stop, order[start : ends[stop - 1]]
        first, start = stop, int(ends[stop - 1])


@dataclass(frozen=True, eq=False, slots=True)
class _Sheets:
    # The sheets that a chart shows, as a `LabelPiece` has them.
    numbers: NDArray[np.int64]
    records: IntArray
    fits: FloatArray


def _joined(shape: tuple[int, int], pieces: Sequence[LabelPiece]) -> tuple[IntArray, _Sheets]:
    # A chart's cells, which of its sheets each shows, −1 for none, and those sheets. Where two pieces tell of
    # a cell, the nearer one counts, and of two as near the first.
    shown, nearest = np.full(shape, -1, np.int32), np.full(shape, np.inf, np.float32)
    numbers, first, row = np.unique(
        np.concatenate([np.zeros(0, np.int64), *(piece.numbers for piece in pieces)]),
        return_index=True,
        return_inverse=True,
    )
    start = 0
    for piece in pieces:
        i, j = piece.corner
        window = slice(i, i + piece.labels.shape[0]), slice(j, j + piece.labels.shape[1])
        nearer = (piece.labels >= 0) & (piece.away < nearest[window])
        shown[window][nearer] = row.reshape(-1)[start:][piece.labels[nearer]]
        nearest[window][nearer] = piece.away[nearer]
        start += len(piece.numbers)
    is_seen = np.zeros(len(numbers) + 1, np.bool_)
    is_seen[shown] = True
    is_seen[-1] = False
    rank = np.append(np.cumsum(is_seen[:-1], dtype=np.int32) - 1, -1)
    source = first[is_seen[:-1]]
    records = np.concatenate([np.zeros((0, BLOCK_COLUMNS), np.int32), *(piece.records for piece in pieces)])
    fits = np.concatenate([np.zeros((0, FIT)), *(piece.fits for piece in pieces)])
    shown = rank[shown].astype(np.int32)
    return shown, _Sheets(numbers[is_seen[:-1]], records[source], fits[source])


def _products() -> NDArray[np.uint8]:
    # Of two symmetries the one that is both, the second one first.
    matrices = SYMMETRIES.reshape(-1, 2, 2)
    both = (matrices[:, None] @ matrices).reshape(8, 8, 1, 4)
    found: NDArray[np.uint8] = (both == SYMMETRIES).all(axis=3).argmax(axis=2).astype(np.uint8)
    return found


_PRODUCTS = _products()


def _read(plan: LayPlan, sheets: _Sheets, owner: IntArray, at: NDArray[np.int64]) -> NDArray[np.int64]:
    # Where places (n, 2) of a chart, in 1/16 step, read by sheets (n,): (n, 2) in 1/16 pixel.
    read = np.empty((len(at), 2))
    read_cells(plan.field, sheets.fits, owner.astype(np.int64), at / 16 - 0.5, read)
    turn = SYMMETRIES[sheets.records[owner, SYMMETRY]]
    level = plan.numbers.level
    parts = []
    for axis, column in enumerate((SOURCE_ROW, SOURCE_COLUMN)):
        shown = turn[:, 2 * axis] * read[:, 0] + turn[:, 2 * axis + 1] * read[:, 1]
        # The middle of a level's pixel, and what lies beside it.
        source = ((16 * sheets.records[owner, column].astype(np.int64) + 8) << level) - 8
        parts.append(source + np.rint((16 << level) * shown).astype(np.int64))
    return np.stack(parts, axis=1)


def _recentred(
    plan: LayPlan,
    placed: NDArray[np.void],
    sheets: _Sheets,
    owner: IntArray,
    cells: NDArray[np.int64],
    on: tuple[Chart, WarpField, tuple[int, int], int],
) -> NDArray[np.int64]:
    """Give placements their centres, middles of cells that show them; return which cells, rows and columns.

    `cells` (n, 2) are rows and columns, and `owner` (n,) tells which placement they show.
    """
    chart, field, shape, cell = on
    rows, columns = cells.T
    at = np.stack(
        [cell_centres(int(part.max()) + 1, cell)[part] for part in (rows, columns)],
        axis=1,
    )
    read = _read(plan, sheets, owner, at)
    last = [count - 1 for count in label_shape(chart.height, chart.width, cell)]
    inside = ((read >= 0) & (read < 16 * np.array(shape))).all(axis=1)
    within = (rows > 0) & (rows < last[0]) & (columns > 0) & (columns < last[1])
    size = np.bincount(owner, minlength=len(placed))
    middle = [np.bincount(owner, index, minlength=len(placed)) / size for index in (rows, columns)]
    away = (rows - middle[0][owner]) ** 2 + (columns - middle[1][owner]) ** 2
    # Cells that read inside the sample come first, then those on the chart, then near ones.
    away += 2.0**34 * ~within + 2.0**36 * ~inside
    least = np.full(len(placed), np.inf)
    np.minimum.at(least, owner, away)
    nearest = np.flatnonzero(away == least[owner])[::-1]
    chosen = np.empty(len(placed), np.intp)
    chosen[owner[nearest]] = nearest  # of several the first
    placed["row"], placed["column"] = at[chosen].T
    for axis, name in enumerate(("source_row", "source_column")):
        whole = _SOURCE_UNIT * ((read[chosen, axis] + _SOURCE_UNIT // 2) // _SOURCE_UNIT)
        placed[name] = np.clip(whole, 0, 16 * shape[axis] - _SOURCE_UNIT)
    _fit_matrices(placed, field, owner, at, read)
    return cells[chosen]


def _fit_matrices(
    moved: NDArray[np.void],
    field: WarpField,
    owner: IntArray,
    at: NDArray[np.int64],
    read: NDArray[np.int64],
) -> None:
    """Give placements' matrices the offsets with which they read as before, where the field alone is off.

    With C + ΔC in place of C = M(c), a place q reads ½·ΔC·(q − c) further, T turned by the symmetry; ΔC is
    the least squares' answer over the cells that show the placement.
    """
    moved["offset"] = 0
    now = np.stack(warped_sources(field, moved[owner], at[:, 0], at[:, 1]), axis=1)
    turn = SYMMETRIES[moved["symmetry"][owner]].reshape(-1, 2, 2)
    # A symmetry's inverse is its transpose.
    rest: FloatArray = np.einsum("nji,nj->ni", turn, (read - now) / 16)
    centre: IntArray = np.stack([moved["row"][owner], moved["column"][owner]], axis=1)
    step: FloatArray = (at - centre) / np.float64(16)
    off: FloatArray = np.zeros(len(moved))
    np.maximum.at(off, owner, np.abs(rest).max(axis=1))
    bent = np.flatnonzero(off > _OFF)
    if not len(bent):
        return

    def summed(values: FloatArray) -> FloatArray:
        return np.bincount(owner, values, minlength=len(moved))[bent].astype(np.float64)

    square: FloatArray = np.empty((len(bent), 2, 2))
    product: FloatArray = np.empty((len(bent), 2, 2))
    for i in range(2):
        for j in range(2):
            # A step's worth against singular ones.
            square[:, i, j] = summed(step[:, i] * step[:, j]) + (i == j)
            product[:, i, j] = summed(2 * rest[:, i] * step[:, j])
    added = product @ np.linalg.inv(square)
    offset = _OFFSET_UNIT * np.rint(added.reshape(-1, 4) * UNIT / _OFFSET_UNIT)
    moved["offset"][bent] = np.clip(offset, -MOST_OFFSET, MOST_OFFSET).astype(np.int32)
