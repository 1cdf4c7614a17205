"""From label maps to placements: their centres, the positions read there, and errors of the field alone."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.quilt._field_kernels import matrix_between, reading
from upholster.quilt.placement import SYMMETRIES
from upholster.runtime.jit import inline, kernel
from upholster.synthesis.quilt.kernels._sheet_kernels import FieldArrays, shown_at

__all__ = ["CentredArrays", "ShownCells", "centre_placements"]


class ShownCells(NamedTuple):
    """A chart's cells, the sheet that each shows, and those sheets.

    `shown` (rows, columns) are the sheets' numbers, −1 for none; cells are `cell` steps wide. `fits`
    (n, `FIT`) are the sheets' fits, `sources` (n, 3) the row and column of their blocks' source and the
    block's symmetry, `turns` (n,) the symmetry of their placements. Sources are pixels of a `level` of the
    exemplar, which has `shape` pixels.
    """

    shown: IntArray
    cell: int
    fits: FloatArray
    sources: NDArray[np.int64]
    turns: NDArray[np.uint8]
    level: int
    shape: tuple[int, int]


class CentredArrays(NamedTuple):
    """The results for n placements.

    `cells` (n, 2) is the cell whose middle is the placement's centre, −1 for none yet. `reads` (n, 2) is the
    position read there, in 1/16 pixel, and `centres` (n, 4) is the field's matrix there. `off` (n,) is the
    maximum error of the chart's field alone, in pixels. `square` (n, 3) and `product` (n, 4) are the sums of
    least squares for an offset, see `upholster.synthesis.quilt.emit`. `away` (n,) and `sums` (n, 3) are
    scratch. Initially `cells` is −1, `away` is infinite, and the others are 0.
    """

    cells: NDArray[np.int64]
    reads: NDArray[np.int64]
    centres: NDArray[np.int64]
    off: FloatArray
    square: FloatArray
    product: FloatArray
    away: FloatArray
    sums: FloatArray


@inline
def _read_at(field: FieldArrays, cells: ShownCells, n: int, row: int, column: int) -> tuple[int, int]:
    # The position that a sheet reads at a place: the place is in 1/16 step, the position in 1/16 pixel.
    y, x = shown_at(field, cells.fits[n], row / 16.0 - 0.5, column / 16.0 - 0.5)
    turn, unit = SYMMETRIES[cells.sources[n, 2]], 16 << cells.level
    # The centre of the source's pixel of the level; the offset from there is added below.
    down = ((16 * cells.sources[n, 0] + 8) << cells.level) - 8
    right = ((16 * cells.sources[n, 1] + 8) << cells.level) - 8
    return (
        down + int64(np.rint(unit * (turn[0] * y + turn[1] * x))),
        right + int64(np.rint(unit * (turn[2] * y + turn[3] * x))),
    )


@inline
def _choose_centres(field: FieldArrays, cells: ShownCells, found: CentredArrays) -> None:
    # Chooses each placement's central cell: first by whether it reads inside the sample, then by whether it
    # is on the chart, then by its distance from the mean of all cells that show the placement.
    shown, unit = cells.shown, 16 * cells.cell
    rows, columns = shown.shape
    for i in range(rows):
        for j in range(columns):
            n = shown[i, j]
            if n >= 0:
                found.sums[n, 0] += 1.0
                found.sums[n, 1] += i
                found.sums[n, 2] += j
    for i in range(rows):
        for j in range(columns):
            n = int64(shown[i, j])
            if n < 0:
                continue
            down = i - found.sums[n, 1] / found.sums[n, 0]
            right = j - found.sums[n, 2] / found.sums[n, 0]
            away = down * down + right * right
            if not (0 < i < rows - 1 and 0 < j < columns - 1):
                away += 2.0**34
            if away >= found.away[n]:
                continue  # no position that it reads can make it better
            y, x = _read_at(field, cells, n, unit * (i - 1) + unit // 2, unit * (j - 1) + unit // 2)
            if y < 0 or x < 0 or y >= 16 * cells.shape[0] or x >= 16 * cells.shape[1]:
                away += 2.0**36
            if away < found.away[n]:
                found.away[n] = away
                found.cells[n, 0], found.cells[n, 1] = i, j
                found.reads[n, 0], found.reads[n, 1] = y, x


@kernel
def centre_placements(
    field: FieldArrays,
    cells: ShownCells,
    matrices: IntArray,
    margin: int,
    rounded: int,
    found: CentredArrays,
) -> None:
    """Choose the placements' centres, and sum up the differences between their readings and the field's.

    `matrices` and `margin` are those of the chart's warp field. Sources are rounded to multiples of `rounded`
    sixteenths of a pixel.
    """
    _choose_centres(field, cells, found)
    unit = 16 * cells.cell
    for n in range(found.cells.shape[0]):
        for k in range(2):
            whole = rounded * ((found.reads[n, k] + rounded // 2) // rounded)
            found.reads[n, k] = min(max(whole, 0), 16 * cells.shape[k] - rounded)
        top, left = unit * (found.cells[n, 0] - 1) + unit // 2, unit * (found.cells[n, 1] - 1) + unit // 2
        m = matrix_between(matrices, margin, top, left)
        for k in range(4):
            found.centres[n, k] = m[k]
    for i in range(cells.shown.shape[0]):
        for j in range(cells.shown.shape[1]):
            n = int64(cells.shown[i, j])
            if n < 0:
                continue
            row, column = unit * (i - 1) + unit // 2, unit * (j - 1) + unit // 2
            top = unit * (found.cells[n, 0] - 1) + unit // 2
            left = unit * (found.cells[n, 1] - 1) + unit // 2
            y, x = _read_at(field, cells, n, row, column)
            c = found.centres[n]
            first = c[0], c[1], c[2], c[3]
            here = matrix_between(matrices, margin, row, column)
            down, right = row - top, column - left
            v, u = reading(first, here, min(max(down, -16383), 16383), min(max(right, -16383), 16383))
            turn = SYMMETRIES[cells.turns[n]]
            y -= found.reads[n, 0] + turn[0] * v + turn[1] * u
            x -= found.reads[n, 1] + turn[2] * v + turn[3] * u
            # A symmetry's inverse is its transpose.
            a, b = (turn[0] * y + turn[2] * x) / 16.0, (turn[1] * y + turn[3] * x) / 16.0
            found.off[n] = max(found.off[n], abs(a), abs(b))
            s, t = down / 16.0, right / 16.0
            found.square[n, 0] += s * s
            found.square[n, 1] += s * t
            found.square[n, 2] += t * t
            found.product[n, 0] += 2.0 * a * s
            found.product[n, 1] += 2.0 * a * t
            found.product[n, 2] += 2.0 * b * s
            found.product[n, 3] += 2.0 * b * t
