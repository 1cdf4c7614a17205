"""From a chart's cells to placements: where each one's centre lies, what it reads there, how it is bent."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.methods.quilt._block_kernels import SOURCE_COLUMN, SOURCE_ROW, SYMMETRY
from upholster.methods.quilt._sheet_kernels import FieldArrays, shown_at
from upholster.quilt._field_kernels import matrix_between, reading
from upholster.quilt.placement import MOST_OFFSET, SYMMETRIES
from upholster.quilt.warp_field import UNIT
from upholster.types import FloatArray, IntArray, int64

__all__ = [
    "FITTED",
    "PLACED",
    "CellLabels",
    "PlacedSheets",
    "choose_centres",
    "enter_piece",
    "fit_offsets",
]

_SOURCE_UNIT, _OFFSET_UNIT = 4, 64
"""Sources are quarters of a pixel, offsets 1/64 pixel for a step: finer ones only cost bytes."""

_OFF = 0.3
"""Pixels that a placement may be off somewhere before its matrix gets an offset."""

_BEYOND, _OUTSIDE = 2.0**34, 2.0**36
"""Squared cells: cells beyond the chart's edges, and those that read outside the sample, are so much further
from the middle than others."""

CELLS, ROW, COLUMN, PLACE_ROW, PLACE_COLUMN, READ_ROW, READ_COLUMN = range(7)
"""Columns of `PlacedSheets.places`."""

PLACED = 7
"""How many there are."""

FITTED = 8
"""Columns of the scratch of `fit_offsets`."""


class CellLabels(NamedTuple):
    """A chart's cells: the sheet that each shows, (rows, columns), −1 for none; and all its sheets.

    `records` and `fits` are those of `LabelPiece`. A cell is `cell` steps wide, and `level` that of the
    exemplar's pixels which blocks read.
    """

    labels: IntArray
    records: IntArray
    fits: FloatArray
    cell: int
    level: int


class PlacedSheets(NamedTuple):
    """What becomes of sheets, (n, `PLACED`): how many cells show each, and if any do its centre and source.

    Row and column of the centre's cell, its place in 1/16 step, and what it reads in 1/16 pixel. `symmetries`
    (n,) are theirs.
    """

    places: NDArray[np.int64]
    symmetries: NDArray[np.int64]


@kernel
def enter_piece(
    labels: IntArray,
    away: NDArray[np.float32],
    sheets: NDArray[np.int64],
    corner: tuple[int, int],
    shown: IntArray,
    nearest: NDArray[np.float32],
) -> None:
    """Enter a piece's labels in a chart's, where none is nearer yet.

    `labels` and `away` are the piece's, `corner` the first of its cells, `sheets` (n,) the chart's numbers
    for its sheets. `shown` and `nearest` are the chart's cells.
    """
    for i in range(labels.shape[0]):
        for j in range(labels.shape[1]):
            r, c = corner[0] + i, corner[1] + j
            if labels[i, j] >= 0 and away[i, j] < nearest[r, c]:
                nearest[r, c] = away[i, j]
                shown[r, c] = sheets[labels[i, j]]


@inline
def _place(index: int, cell: int) -> Any:
    # Where the middle of a cell lies, in 1/16 step: see `cell_centres`.
    return 16 * cell * (index - 1) + 8 * cell


@inline
def _read(field: FieldArrays, cells: CellLabels, sheet: int, row: int, column: int) -> tuple[Any, Any]:
    # Where a place in 1/16 step reads by a sheet, in 1/16 pixel.
    y, x = shown_at(field, cells.fits[sheet], row / 16 - 0.5, column / 16 - 0.5)
    turn = SYMMETRIES[cells.records[sheet, SYMMETRY]]
    unit = 16 << cells.level
    # The middle of a level's pixel, and what lies beside it.
    first = ((16 * int64(cells.records[sheet, SOURCE_ROW]) + 8) << cells.level) - 8
    second = ((16 * int64(cells.records[sheet, SOURCE_COLUMN]) + 8) << cells.level) - 8
    return (
        first + int64(np.rint(unit * (turn[0] * y + turn[1] * x))),
        second + int64(np.rint(unit * (turn[2] * y + turn[3] * x))),
    )


@inline
def _sum_cells(labels: IntArray, places: NDArray[np.int64]) -> None:
    # How many cells show each sheet, and the sums of their rows and of their columns.
    places[:, :] = 0
    for i in range(labels.shape[0]):
        for j in range(labels.shape[1]):
            n = labels[i, j]
            if n >= 0:
                places[n, CELLS] += 1
                places[n, PLACE_ROW] += i
                places[n, PLACE_COLUMN] += j


@kernel
def choose_centres(
    field: FieldArrays, cells: CellLabels, shape: tuple[int, int], middles: FloatArray, placed: PlacedSheets
) -> None:
    """Give sheets their centres: of the cells that show one, that nearest to their middle.

    Cells that read inside the sample, of `shape`, come first, then those on the chart, then near ones; of
    several as near the first in raster order. `middles` (n, 3) is scratch.
    """
    labels, places = cells.labels, placed.places
    _sum_cells(labels, places)
    for n in range(places.shape[0]):
        size = max(places[n, CELLS], 1)
        middles[n, 0], middles[n, 1] = places[n, PLACE_ROW] / size, places[n, PLACE_COLUMN] / size
        middles[n, 2] = np.inf
    rows, columns = labels.shape
    for i in range(rows):
        for j in range(columns):
            n = labels[i, j]
            if n < 0:
                continue
            down, right = i - middles[n, 0], j - middles[n, 1]
            away = down * down + right * right
            more = 0.0 if 0 < i < rows - 1 and 0 < j < columns - 1 else _BEYOND
            if away + more >= middles[n, 2]:
                continue
            y, x = _place(i, cells.cell), _place(j, cells.cell)
            row, column = _read(field, cells, n, y, x)
            if row < 0 or column < 0 or row >= 16 * shape[0] or column >= 16 * shape[1]:
                more += _OUTSIDE
            if away + more < middles[n, 2]:
                middles[n, 2] = away + more
                places[n, ROW], places[n, COLUMN] = i, j
                places[n, PLACE_ROW], places[n, PLACE_COLUMN] = y, x
                row = _SOURCE_UNIT * ((row + _SOURCE_UNIT // 2) // _SOURCE_UNIT)
                column = _SOURCE_UNIT * ((column + _SOURCE_UNIT // 2) // _SOURCE_UNIT)
                places[n, READ_ROW] = min(max(row, 0), 16 * shape[0] - _SOURCE_UNIT)
                places[n, READ_COLUMN] = min(max(column, 0), 16 * shape[1] - _SOURCE_UNIT)


@inline
def _sum_misfits(
    field: FieldArrays,
    cells: CellLabels,
    matrices: IntArray,
    margin: int,
    placed: PlacedSheets,
    offsets: IntArray,
    sums: FloatArray,
) -> None:
    # Of each placement by how many pixels it is off somewhere, without an offset, and what the least squares
    # of its offset need: sums of squares of steps (3) and of what is missing times steps (4).
    # `offsets` is scratch for their centres' matrices.
    for n in range(len(sums)):
        m = matrix_between(matrices, margin, placed.places[n, PLACE_ROW], placed.places[n, PLACE_COLUMN])
        offsets[n, 0], offsets[n, 1], offsets[n, 2], offsets[n, 3] = m[0], m[1], m[2], m[3]
        sums[n, :] = 0.0
    for i in range(cells.labels.shape[0]):
        for j in range(cells.labels.shape[1]):
            n = cells.labels[i, j]
            if n < 0:
                continue
            own = placed.places[n]
            y, x = _place(i, cells.cell), _place(j, cells.cell)
            read = _read(field, cells, n, y, x)
            down, right = y - own[PLACE_ROW], x - own[PLACE_COLUMN]
            now = reading(
                (int64(offsets[n, 0]), int64(offsets[n, 1]), int64(offsets[n, 2]), int64(offsets[n, 3])),
                matrix_between(matrices, margin, y, x),
                min(max(down, -16383), 16383),
                min(max(right, -16383), 16383),
            )
            turn = SYMMETRIES[placed.symmetries[n]]
            row = (read[0] - own[READ_ROW] - turn[0] * now[0] - turn[1] * now[1]) / 16
            column = (read[1] - own[READ_COLUMN] - turn[2] * now[0] - turn[3] * now[1]) / 16
            # A symmetry's inverse is its transpose.
            missing_y, missing_x = turn[0] * row + turn[2] * column, turn[1] * row + turn[3] * column
            sums[n, 0] = max(sums[n, 0], abs(missing_y), abs(missing_x))
            step_y, step_x = down / 16, right / 16
            sums[n, 1] += step_y * step_y
            sums[n, 2] += step_y * step_x
            sums[n, 3] += step_x * step_x
            sums[n, 4] += 2 * missing_y * step_y
            sums[n, 5] += 2 * missing_y * step_x
            sums[n, 6] += 2 * missing_x * step_y
            sums[n, 7] += 2 * missing_x * step_x


@kernel
def fit_offsets(
    field: FieldArrays,
    cells: CellLabels,
    matrices: IntArray,
    margin: int,
    placed: PlacedSheets,
    sums: FloatArray,
    offsets: IntArray,
) -> None:
    """Give placements the offsets (n, 4) with which they read as their sheets, where the field alone is off.

    With C + ΔC in place of C = M(c), a place q reads ½·ΔC·(q − c) further, turned by the symmetry; ΔC is the
    least squares' answer over the cells that show the placement. `matrices` and `margin` are the chart's warp
    field; `sums` (n, `FITTED`) is scratch.
    """
    _sum_misfits(field, cells, matrices, margin, placed, offsets, sums)
    for n in range(offsets.shape[0]):
        offsets[n, :] = 0
        if sums[n, 0] <= _OFF:
            continue
        a, b, d = sums[n, 1] + 1.0, sums[n, 2], sums[n, 3] + 1.0  # a step's worth against singular ones
        determinant = a * d - b * b
        for i in range(2):
            p, q = sums[n, 4 + 2 * i], sums[n, 5 + 2 * i]
            for j in range(2):
                more = (p * d - q * b if j == 0 else q * a - p * b) / determinant
                steps = _OFFSET_UNIT * np.rint(more * UNIT / _OFFSET_UNIT)
                offsets[n, 2 * i + j] = int64(min(max(steps, -MOST_OFFSET), MOST_OFFSET))
