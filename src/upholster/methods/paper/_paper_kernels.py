"""The two hot loops of method "paper": blocks laid in raster order, edge blocks along a shared edge."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.methods._cut_kernels import cut_grid
from upholster.methods.paper._match_kernels import best_candidate, tile_coefficients
from upholster.quilt._paint_kernels import FRACTION_BITS, lay_placement

__all__ = ["lay_blocks", "lay_edge_blocks"]


@inline
def _round(value: int) -> np.int32:
    return np.int32((value + (1 << (FRACTION_BITS - 1))) >> FRACTION_BITS)


@kernel
def lay_blocks(
    canvas: NDArray[np.uint16],
    placements: Any,
    block_columns: int,
    row_start: int,
    row_stop: int,
    first: int,
    working: NDArray[np.uint16],
    channels: int,
    tile: int,
    overlap: int,
    table: NDArray[np.int32],
    grid_columns: int,
    candidate_rows: int,
    candidate_columns: int,
    symmetries: NDArray[np.int64],
    cells: NDArray[np.uint8],
) -> None:
    """Choose and paint the blocks of block rows [row_start, row_stop) of a chart, in raster order.

    `canvas` (rows, columns · channels) holds the chart, padded to whole tiles. `placements` holds the chart's
    blocks in raster order, complete but for their source, which is written here. The very first block is
    candidate `first`.
    """
    block = placements[0].height
    columns = canvas.shape[1] // channels
    tiles = block // tile
    band = overlap // tile
    most = 2 * channels * tiles * tiles
    bands, offsets = np.empty(most, np.int32), np.empty(most, np.int32)
    values = np.empty(most, np.int32)
    costs = np.empty(2048, np.int64)
    spare = np.empty((1, 1), np.int32)
    for i in range(row_start, row_stop):
        for j in range(block_columns):
            placement = placements[i * block_columns + j]
            top, left = placement.row - block // 2, placement.column - block // 2
            if i == 0 and j == 0:
                chosen = (first // candidate_columns) * grid_columns + first % candidate_columns
            else:
                count = 0
                for a in range(tiles):
                    row = top + a * tile
                    if row >= canvas.shape[0]:
                        break
                    for b in range(tiles):
                        column = left + b * tile
                        if column >= columns:
                            break
                        if (i > 0 and a < band) or (j > 0 and b < band):
                            for k in range(channels):
                                low, high = tile_coefficients(
                                    canvas, row, column * channels + k, channels, tile
                                )
                                bands[count], bands[count + 1] = k, channels + k
                                offsets[count] = offsets[count + 1] = a * grid_columns + b
                                values[count], values[count + 1] = _round(low), _round(high)
                                count += 2
                chosen = best_candidate(
                    table,
                    grid_columns,
                    candidate_rows,
                    candidate_columns,
                    bands,
                    offsets,
                    values,
                    count,
                    costs,
                )
            placement.source_row = 16 * (chosen // grid_columns * tile + block // 2)
            placement.source_column = 16 * (chosen % grid_columns * tile + block // 2)
            lay_placement(canvas, 0, columns, placement, cells, working, channels, symmetries, spare, spare)


@inline
def _across(row: int, column: int, map_b: NDArray[np.int64]) -> tuple[int, int]:
    # A texel of chart A's grid, beyond its edge, in the grid of chart B.
    return (
        map_b[0] * row + map_b[1] * column + map_b[4],
        map_b[2] * row + map_b[3] * column + map_b[5],
    )


@inline
def _hold(seeds: NDArray[np.int8], size: int, along_rows: bool, is_first: bool, is_last: bool) -> None:
    # The sides parallel to the edge stay old; the cells at the edge become new, save in the first row where
    # the predecessor has been; where a strip ends, its end stays old but for the cells at the edge.
    for a in range(size):
        for x in range(size):
            value = 0
            seam = x == size // 2 - 1 or x == size // 2
            if x == 0 or x == size - 1 or (a == 0 and not is_first):
                value = 1
            elif seam:
                value = 2
            elif (a == 0 and is_first) or (a == size - 1 and is_last):
                value = 1
            seeds[a * size + x if along_rows else x * size + a] = value


@kernel
def lay_edge_blocks(
    canvas_a: NDArray[np.uint16],
    canvas_b: NDArray[np.uint16],
    size_a: tuple[int, int],
    size_b: tuple[int, int],
    map_b: NDArray[np.int64],
    along_rows: bool,
    placements_a: Any,
    placements_b: Any,
    cells: NDArray[np.uint8],
    start: int,
    stop: int,
    working: NDArray[np.uint16],
    channels: int,
    tile: int,
    table: NDArray[np.int32],
    grid_columns: int,
    candidate_rows: int,
    candidate_columns: int,
    symmetries: NDArray[np.int64],
) -> None:
    """Choose, cut and paint edge blocks [start, stop) along an edge that charts A and B share.

    A block is upright on A. `size_a`, `size_b` are the charts' true (rows, columns); `map_b` (6,) takes a
    texel of A's grid to B's grid: two rows of a matrix, then the offset. `along_rows`: the edge runs along
    A's rows axis (edges 1 and 3). `placements_a`, `placements_b` are complete but for their sources; `cells`
    receives the cut masks, as A and as B sees them, where the placements say.
    """
    block = placements_a[0].height
    half = block // 2
    tiles, cell = block // tile, tile // 2
    side = block // cell
    old = np.empty((block, block * channels), np.uint16)
    most = 2 * channels * tiles * tiles
    bands, offsets, values = np.empty(most, np.int32), np.empty(most, np.int32), np.empty(most, np.int32)
    costs = np.empty(2048, np.int64)
    weights, spare = np.empty((block, block), np.int32), np.empty((block, block), np.int32)
    difference = np.empty((side, side), np.int64)
    residual = np.empty((4, side * side), np.int64)
    seeds = np.empty(side * side, np.int8)
    work = np.empty((4, side * side), np.int32)
    for n in range(start, stop):
        on_a, on_b = placements_a[n], placements_b[n]
        top, left = on_a.row - half, on_a.column - half
        # The edge block: what lies there now, on both sides of the edge, in A's frame.
        for i in range(block):
            row = top + i
            for j in range(block):
                column = left + j
                x, y = column * channels, j * channels
                if 0 <= row < size_a[0] and 0 <= column < size_a[1]:
                    for k in range(channels):
                        old[i, y + k] = canvas_a[row, x + k]
                else:
                    row_b, column_b = _across(row, column, map_b)
                    x = column_b * channels
                    for k in range(channels):
                        old[i, y + k] = canvas_b[row_b, x + k]
        count = 0
        for a in range(tiles):
            for b in range(tiles):
                for k in range(channels):
                    low, high = tile_coefficients(old, a * tile, b * tile * channels + k, channels, tile)
                    bands[count], bands[count + 1] = k, channels + k
                    offsets[count] = offsets[count + 1] = a * grid_columns + b
                    values[count], values[count + 1] = _round(low), _round(high)
                    count += 2
        chosen = best_candidate(
            table, grid_columns, candidate_rows, candidate_columns, bands, offsets, values, count, costs
        )
        source_row, source_column = chosen // grid_columns * tile, chosen % grid_columns * tile
        # A cell's squared coefficient differences at levels 1 to n - 1 are, the transform being orthonormal,
        # the squared differences of its texels.
        for a in range(side):
            for b in range(side):
                total: Any = 0
                for i in range(a * cell, (a + 1) * cell):
                    line, source = old[i], working[source_row + i]
                    for x in range(b * cell * channels, (b + 1) * cell * channels):
                        step = np.int64(_round(line[x])) - np.int64(source[x + source_column * channels])
                        total += step * step
                difference[a, b] = total
        residual[:] = 0
        for a in range(side):
            for b in range(side):
                m = a * side + b
                if b + 1 < side:
                    residual[0, m] = residual[2, m + 1] = difference[a, b] + difference[a, b + 1]
                if a + 1 < side:
                    residual[1, m] = residual[3, m + side] = difference[a, b] + difference[a + 1, b]
        _hold(seeds, side, along_rows, n == 0, n == placements_a.shape[0] - 1)
        cut_a = cells[on_a.cells : on_a.cells + side * side]
        cut_b = cells[on_b.cells : on_b.cells + side * side]
        cut_grid(residual, seeds, side, work, cut_a)
        # Chart B sees the same block turned: its cells and its source point are expressed in its own frame.
        for a in range(side):
            for b in range(side):
                row_b, column_b = _across(top + a * cell, left + b * cell, map_b)
                far_row, far_column = _across(top + (a + 1) * cell - 1, left + (b + 1) * cell - 1, map_b)
                i = (min(row_b, far_row) - (on_b.row - half)) // cell
                j = (min(column_b, far_column) - (on_b.column - half)) // cell
                cut_b[i * side + j] = cut_a[a * side + b]
        symmetry = symmetries[on_b.symmetry]
        on_a.source_row, on_a.source_column = 16 * (source_row + half), 16 * (source_column + half)
        # B's centre in A's grid: the turn undoes the linear part of the map.
        down, right = on_b.row - map_b[4], on_b.column - map_b[5]
        on_b.source_row = 16 * (source_row + symmetry[0] * down + symmetry[1] * right - top)
        on_b.source_column = 16 * (source_column + symmetry[2] * down + symmetry[3] * right - left)
        lay_placement(canvas_a, 0, size_a[1], on_a, cells, working, channels, symmetries, weights, spare)
        lay_placement(canvas_b, 0, size_b[1], on_b, cells, working, channels, symmetries, weights, spare)
