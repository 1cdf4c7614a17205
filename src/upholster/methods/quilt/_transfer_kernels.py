"""Hot loops of transfer blocks from chart to chart: their masks as others see them, their texels there."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import allocating_kernel, inline, kernel
from upholster.methods.quilt._block_kernels import ChartCanvas
from upholster.quilt._field_kernels import displacement_row
from upholster.quilt.placement import SYMMETRIES
from upholster.types import int64, uint64

__all__ = ["lay_transferred", "transfer_masks"]


@inline
def _off(border: Any, centre: Any, count: Any, cell: int) -> Any:
    # How far a border lies from the nearest one of `count` cells round a centre.
    apart = (border - (centre - count * cell // 2 - 0.5)) / cell
    return abs(apart - np.rint(apart))


@inline
def _nudge(border: Any, centre: Any, count: Any, cell: int) -> int:
    # 1 where count + 1 cells round a centre come to lie nearer to a border than count.
    return 1 if _off(border, centre, count + 1, cell) < _off(border, centre, count, cell) else 0


@kernel
def transfer_masks(
    placements: NDArray[np.int32],
    cells: NDArray[np.uint8],
    places: NDArray[np.float64],
    bounds: tuple[int, int, int, int],
    cell: int,
    height: int,
    width: int,
    out: NDArray[np.int32],
    masks: NDArray[np.uint8],
) -> int:
    """Tell the masks of some placements of one chart on another; return how many cells were written.

    `placements` (n, 7): row, column, height, width, cell size, whether there is a mask, where its cells
    start. `places` (n, 6): where the centre falls on the other chart, and the 2×2 matrix of texel steps from
    the other chart to this one. What lies outside `bounds` (rows from, to, columns from, to) of its own chart
    is left out. `out` (n, 5): row, column, height and width there, and where the cells start
    in `masks`; -1 if nothing falls on the chart of height × width texels, or within two cells of it.
    """
    count: Any = 0
    for n in range(placements.shape[0]):
        h, w, size = placements[n, 2], placements[n, 3], placements[n, 4]
        across = (w + size - 1) // size
        # A mask's rim goes on for two cells, for those here lie aslant.
        spread = 2 * size
        a, b, c, d = places[n, 2], places[n, 3], places[n, 4], places[n, 5]
        determinant = a * d - b * c
        row, column = int64(np.rint(places[n, 0])), int64(np.rint(places[n, 1]))
        # Half the extents of the rectangle's image.
        tall = 0.5 * (abs(d) * h + abs(b) * w) / abs(determinant)
        wide = 0.5 * (abs(c) * h + abs(a) * w) / abs(determinant)
        rows, columns = int64(np.ceil(2 * tall / cell)) + 5, int64(np.ceil(2 * wide / cell)) + 5
        # One cell more, if that brings the cells' borders nearer to those they have on their own chart.
        if abs(a) > 0.5 * abs(b):
            rows += _nudge(places[n, 0] - (h // 2 + 0.5) / a, row, rows, cell)
        if abs(d) > 0.5 * abs(c):
            columns += _nudge(places[n, 1] - (w // 2 + 0.5) / d, column, columns, cell)
        out[n, 0], out[n, 1], out[n, 2], out[n, 3], out[n, 4] = row, column, rows * cell, columns * cell, -1
        if rows * cell > 4096 or columns * cell > 4096 or count + rows * columns > masks.shape[0]:
            continue
        top, left = row - rows * cell // 2, column - columns * cell // 2
        seen = False
        for i in range(rows):
            y = top + i * cell + 0.5 * (cell - 1) - places[n, 0]
            for j in range(columns):
                x = left + j * cell + 0.5 * (cell - 1) - places[n, 1]
                r = int64(np.floor(a * y + b * x + 0.5)) + h // 2
                s = int64(np.floor(c * y + d * x + 0.5)) + w // 2
                y_there, x_there = r + placements[n, 0] - h // 2, s + placements[n, 1] - w // 2
                inside = bounds[0] <= y_there < bounds[1] and bounds[2] <= x_there < bounds[3]
                new = 0
                if inside and -spread <= r < h + spread and -spread <= s < w + spread:
                    new = 1
                    if placements[n, 5]:
                        r, s = min(max(r, 0), h - 1), min(max(s, 0), w - 1)
                        new = cells[placements[n, 6] + r // size * across + s // size]
                masks[count + i * columns + j] = new
                y_here, x_here = top + i * cell, left + j * cell
                if new and -3 * cell < y_here < height + 2 * cell and -3 * cell < x_here < width + 2 * cell:
                    seen = True
        if seen:
            out[n, 4] = count
            count += rows * columns
    return int(count)


@inline
def _shrink(mask: NDArray[np.uint8], rows: int, columns: int, whole: NDArray[np.uint8]) -> None:
    # Marks the cells whose eight neighbours are in the mask as they are: what lies well inside it.
    for at in range(rows * columns):
        whole[at] = 0
    for a in range(1, rows - 1):
        for b in range(1, columns - 1):
            good = np.uint8(1)
            for i in range(a - 1, a + 2):
                for j in range(b - 1, b + 2):
                    good &= mask[uint64(i * columns + j)]
            whole[uint64(a * columns + b)] = good


@inline
def _read(
    block: NDArray[np.int32], sizes: tuple[int, int, int], ys: NDArray[np.int32], xs: NDArray[np.int32]
) -> None:
    # Turns a row's displacements into the pixels that its texels read, numbered row by row, in `ys`.
    turn, level = SYMMETRIES[block[6]], sizes[2]
    a, b, c, d = np.int32(turn[0]), np.int32(turn[1]), np.int32(turn[2]), np.int32(turn[3])
    first_y, first_x, shift = np.int32(block[4] + 8), np.int32(block[5] + 8), np.int32(4 + level)
    zero, last_y, last_x = np.int32(0), np.int32(sizes[0] - 1), np.int32(sizes[1] - 1)
    for j in range(ys.shape[0]):
        y, x = ys[j], xs[j]
        v = np.int32(first_y + np.int32(np.int32(a * y) + np.int32(b * x))) >> shift
        w = np.int32(first_x + np.int32(np.int32(c * y) + np.int32(d * x))) >> shift
        ys[j] = np.int32(min(max(v, zero), last_y) * np.int32(last_x + 1)) + min(max(w, zero), last_x)


@allocating_kernel
def lay_transferred(
    chart: ChartCanvas,
    image: NDArray[np.int32],
    sizes: tuple[int, int, int],
    matrices: NDArray[np.int32],
    margin: int,
    origin: tuple[int, int],
    cell: int,
    transferred: NDArray[np.int32],
    cells: NDArray[np.uint8],
) -> None:
    """Lay what other charts' blocks leave on this one: `transferred` (n, 12) in order, `cells` their masks.

    Columns: row, column, height, width, source row and column in 1/16 pixel, symmetry, where the cells
    start, then the centre matrix. `sizes` are the image's height, width and level. A texel counts as covered
    where its cell and the eight round it are in the mask: elsewhere blocks may cut.
    """
    last_row, last_column = chart.covered.shape
    for n in range(transferred.shape[0]):
        block = transferred[n]
        row, column, height, width = int64(block[0]), int64(block[1]), int64(block[2]), int64(block[3])
        top, left = row - height // 2, column - width // 2
        rows, columns = (height + cell - 1) // cell, (width + cell - 1) // cell
        mask = cells[block[7] : block[7] + rows * columns]
        centre = (block[8], block[9], block[10], block[11])
        whole, ys, xs = (
            np.empty(rows * columns, np.uint8),
            np.empty(width, np.int32),
            np.empty(width, np.int32),
        )
        _shrink(mask, rows, columns, whole)
        for i in range(height):
            r = top + i + origin[0]
            if not 0 <= r < last_row:
                continue
            displacement_row(matrices, margin, centre, top + i - row, top + i, left, left - column, ys, xs)
            _read(block, sizes, ys, xs)
            covered, canvas, symmetries = chart.covered[r], chart.canvas[r], chart.symmetries[r]
            for b in range(columns):
                at = uint64(i // cell * columns + b)
                if mask[at] == 0:
                    continue
                for j in range(b * cell, min(b * cell + cell, width)):
                    c = left + j + origin[1]
                    if 0 <= c < last_column:
                        symmetries[uint64(c)] = np.uint8(block[6])
                        canvas[uint64(c)] = image[uint64(ys[uint64(j)])]
                        covered[uint64(c)] |= whole[at]
