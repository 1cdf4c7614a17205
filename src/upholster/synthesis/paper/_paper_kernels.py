"""The two hot loops of method "paper": blocks laid in raster order, edge blocks along a shared edge."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.runtime.jit import allocating_kernel, inline, spliced
from upholster.synthesis._cut_kernels import cut_grid
from upholster.synthesis.paper._match_kernels import (
    FRACTION_BITS,
    CandidateNumbers,
    Features,
    add_tile,
    best_candidate,
)

__all__ = ["EdgeBlocks", "SharedCharts", "lay_chart_blocks", "lay_edge_blocks"]


class SharedCharts(NamedTuple):
    """Two charts, A and B, and the position of B relative to A.

    Canvases (rows, columns · channels) may be larger than the charts, whose sizes are (rows, columns).
    `labels` are those of the charts' second layer. `map_b` (6,) takes a texel of A's grid to B's grid: two
    rows of a matrix, then the offset. `along_rows`: the edge runs along A's rows axis (edges 1 and 3).
    """

    canvas_a: NDArray[np.uint16]
    canvas_b: NDArray[np.uint16]
    labels_a: NDArray[np.int32]
    labels_b: NDArray[np.int32]
    size_a: tuple[int, int]
    size_b: tuple[int, int]
    map_b: NDArray[np.int64]
    along_rows: bool


class EdgeBlocks(NamedTuple):
    """The edge blocks of one edge.

    `corners` (n, 2) are their first texels on A; `chosen` (n,) receives the candidates that they show. Their
    labels are `number` on A and `number` + 1 on B, and increase by 2 for each further block. `side` and
    `cell` are the sizes in texels of a block and of a cell of its mask.
    """

    corners: NDArray[np.int64]
    chosen: NDArray[np.int32]
    number: int
    side: int
    cell: int


class EdgeCutScratch(NamedTuple):
    """Scratch of a block's cut, by cells."""

    difference: NDArray[np.int64]
    residual: NDArray[np.int64]
    seeds: NDArray[np.int8]
    work: NDArray[np.int32]
    mask: NDArray[np.uint8]


@spliced
def _features(numbers: CandidateNumbers, tiles: int) -> Features:
    most = 2 * numbers.channels * tiles * tiles
    return Features(
        np.empty(most, np.int32), np.empty(most, np.int32), np.empty(most, np.int32), np.empty(2048, np.int64)
    )


@spliced
def _ramp(block: int, overlap: int, channels: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    # Weights (of 256) of a block's samples from its overlapping side: one for each row, one for each sample
    # of a row.
    down, right = np.empty(block, np.int32), np.empty(block * channels, np.int32)
    for i in range(block):
        down[i] = min((2 * i + 1) * 128 // overlap, 256)
        right[i * channels : (i + 1) * channels] = down[i]
    return down, right


@inline
def _blend_line(
    line: NDArray[np.uint16], new: NDArray[np.uint16], down: int, right: NDArray[np.int32]
) -> None:
    # Lays samples of the exemplar over samples of a canvas, with weights down · right of 256 · 256.
    for x in range(line.shape[0]):
        weight = np.int32(np.int32(down * right[x]) >> 8)
        old = np.int32(line[x])
        step = np.int32(np.int32(new[x]) << FRACTION_BITS) - old
        line[x] = old + (np.int32(step * weight + 128) >> 8)


@allocating_kernel
def lay_chart_blocks(
    canvas: NDArray[np.uint16],
    chosen: NDArray[np.int32],
    rows: tuple[int, int],
    first: int,
    sizes: tuple[int, int],
    numbers: CandidateNumbers,
    working: NDArray[np.uint16],
    table: NDArray[np.int32],
) -> None:
    """Choose and paint the blocks of a range of block rows (from, to) of a chart, in raster order.

    `canvas` (rows, columns · channels) holds the chart, padded to whole tiles. `chosen` (down, across)
    receives each block's candidate, as a number of its first tile in the exemplar's grid; the very first
    block shows candidate `first`. `sizes` are the side of a block and the overlap. `working` (H, W ·
    channels) is the exemplar, `table` its coefficients.
    """
    block, overlap = sizes
    channels, tile = numbers.channels, numbers.tile
    columns = canvas.shape[1] // channels
    tiles, band, step = block // tile, overlap // tile, block - overlap
    features = _features(numbers, tiles)
    down, right = _ramp(block, overlap, channels)
    full = np.full(block * channels, 256, np.int32)
    for i in range(rows[0], rows[1]):
        for j in range(chosen.shape[1]):
            top, left = i * step, j * step
            if i == 0 and j == 0:
                best = first
            else:
                count = 0
                for a in range(min(tiles, (canvas.shape[0] - top) // tile)):
                    for b in range(min(tiles, (columns - left) // tile)):
                        if (i > 0 and a < band) or (j > 0 and b < band):
                            row, column = top + a * tile, left + b * tile
                            offset = a * numbers.grid_columns + b
                            count = add_tile(features, count, numbers, canvas, row, column, offset)
                best = best_candidate(table, numbers, features, count)
            chosen[i, j] = best
            source_row, source = (
                best // numbers.grid_columns * tile,
                best % numbers.grid_columns * tile * channels,
            )
            size = min(block, columns - left) * channels
            for a in range(min(block, canvas.shape[0] - top)):
                line = canvas[top + a, left * channels : left * channels + size]
                new = working[source_row + a, source : source + size]
                _blend_line(line, new, down[a] if i > 0 else 256, right[:size] if j > 0 else full[:size])


@inline
def _across(row: int, column: int, map_b: NDArray[np.int64]) -> tuple[int, int]:
    # A texel of chart A's grid, beyond its edge, in the grid of chart B.
    return (
        map_b[0] * row + map_b[1] * column + map_b[4],
        map_b[2] * row + map_b[3] * column + map_b[5],
    )


@inline
def _seed_labels(seeds: NDArray[np.int8], size: int, along_rows: bool, is_first: bool, is_last: bool) -> None:
    # The sides parallel to the edge stay old. The cells at the edge become new, except in the first row,
    # which the previous block covered. Where a strip ends, its end stays old except for the cells at the
    # edge.
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


@inline
def _gather(charts: SharedCharts, top: int, left: int, channels: int, old: NDArray[np.uint16]) -> None:
    # Writes to `old` the current content below an edge block, on both sides of the edge, in A's frame.
    block = old.shape[0]
    for i in range(block):
        row = top + i
        for j in range(block):
            column = left + j
            x, y = column * channels, j * channels
            if 0 <= row < charts.size_a[0] and 0 <= column < charts.size_a[1]:
                for k in range(channels):
                    old[i, y + k] = charts.canvas_a[row, x + k]
            else:
                row_b, column_b = _across(row, column, charts.map_b)
                x = column_b * channels
                for k in range(channels):
                    old[i, y + k] = charts.canvas_b[row_b, x + k]


@inline
def _cut_block(
    old: NDArray[np.uint16],
    working: NDArray[np.uint16],
    source_row: int,
    source_column: int,
    channels: int,
    cell: int,
    scratch: EdgeCutScratch,
) -> None:
    # Cuts between the current content and the match, cell by cell; the seeds are set. A cell's squared
    # coefficient differences at levels 1 to n - 1 equal those of its texels, because the transform is
    # orthonormal.
    difference, residual = scratch.difference, scratch.residual
    side = difference.shape[0]
    half = 1 << (FRACTION_BITS - 1)
    for a in range(side):
        for b in range(side):
            total: Any = 0
            for i in range(a * cell, (a + 1) * cell):
                line, source = old[i], working[source_row + i]
                for x in range(b * cell * channels, (b + 1) * cell * channels):
                    now = np.int64(np.int32((line[x] + half) >> FRACTION_BITS))
                    step = now - np.int64(source[x + source_column * channels])
                    total += step * step
            difference[a, b] = total
    for m in range(side * side):
        for direction in range(4):
            residual[direction, m] = 0
    for a in range(side):
        for b in range(side):
            m = a * side + b
            if b + 1 < side:
                residual[0, m] = residual[2, m + 1] = difference[a, b] + difference[a, b + 1]
            if a + 1 < side:
                residual[1, m] = residual[3, m + side] = difference[a, b] + difference[a + 1, b]
    cut_grid(residual, scratch.seeds, side, scratch.work, scratch.mask)


@spliced
def _between_cells(block: int, cell: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    # For each texel of a block, the cell before it, counted by centres, and its distance from it (of 16).
    low, part = np.empty(block, np.int64), np.empty(block, np.int64)
    for i in range(block):
        place = 16 * i + 8 - 8 * cell
        low[i], part[i] = place // (16 * cell), place % (16 * cell) // cell
    return low, part


@inline
def _weight(
    mask: NDArray[np.uint8], side: int, low: NDArray[np.int64], part: NDArray[np.int64], i: int, j: int
) -> Any:
    # The weight (of 256) of a block at its texel (i, j): bilinear between its cells, 0 beyond them.
    a, b, f, g = low[i], low[j], part[i], part[j]
    total: Any = 0
    for p in range(2):
        for q in range(2):
            if 0 <= a + p < side and 0 <= b + q < side and mask[(a + p) * side + b + q]:
                total += (f if p else 16 - f) * (g if q else 16 - g)
    return total


@inline
def _paint_on(
    canvas: NDArray[np.uint16],
    size: tuple[int, int],
    row: int,
    column: int,
    new: NDArray[np.uint16],
    weight: int,
) -> None:
    # Blends one pixel of the exemplar over a texel, if that texel exists.
    if 0 <= row < size[0] and 0 <= column < size[1]:
        channels = new.shape[0]
        for k in range(channels):
            x = column * channels + k
            old = np.int64(canvas[row, x])
            step = (np.int64(new[k]) << FRACTION_BITS) - old
            canvas[row, x] = old + ((step * weight + 128) >> 8)


@inline
def _label(
    labels: NDArray[np.int32],
    map_chart: NDArray[np.int64],
    corner: tuple[int, int],
    grid: tuple[int, int],
    mask: NDArray[np.uint8],
    number: int,
) -> None:
    # Writes a block's label to the cells of a chart whose centres are in new cells of its mask. `map_chart`
    # maps texels of A's grid, in which the mask is defined, to the chart's. Places are in 1/16 texel: texel k
    # has its centre at 16·k + 8.
    side, cell = grid
    last = side * cell - 1
    near_row, near_column = _across(corner[0], corner[1], map_chart)
    far_row, far_column = _across(corner[0] + last, corner[1] + last, map_chart)
    low_row, low_column = min(near_row, far_row) // cell, min(near_column, far_column) // cell
    for i in range(max(low_row, 0), min(low_row + side + 3, labels.shape[0])):
        for j in range(max(low_column, 0), min(low_column + side + 3, labels.shape[1])):
            down = 16 * (cell * (i - 1) - near_row) + 8 * cell - 8
            right = 16 * (cell * (j - 1) - near_column) + 8 * cell - 8
            # The matrix is a rotation or reflection by quarters: its inverse is its transpose.
            y = map_chart[0] * down + map_chart[2] * right + 8
            x = map_chart[1] * down + map_chart[3] * right + 8
            a, b = y // (16 * cell), x // (16 * cell)
            if 0 <= a < side and 0 <= b < side and mask[a * side + b]:
                labels[i, j] = number


@allocating_kernel
def lay_edge_blocks(
    charts: SharedCharts,
    blocks: EdgeBlocks,
    members: tuple[int, int],
    numbers: CandidateNumbers,
    working: NDArray[np.uint16],
    table: NDArray[np.int32],
) -> None:
    """Choose, cut and paint a range of edge blocks (from, to) along an edge that charts A and B share.

    A block is upright on A. The part that its cut keeps goes onto the canvases and into the labels of both
    charts. `working` and `table` are as in `lay_chart_blocks`.
    """
    channels, tile = numbers.channels, numbers.tile
    block, cell = blocks.side, blocks.cell
    tiles, side = block // tile, block // cell
    old = np.empty((block, block * channels), np.uint16)
    features = _features(numbers, tiles)
    scratch = EdgeCutScratch(
        np.empty((side, side), np.int64),
        np.empty((4, side * side), np.int64),
        np.empty(side * side, np.int8),
        np.empty((4, side * side), np.int32),
        np.empty(side * side, np.uint8),
    )
    low, part = _between_cells(block, cell)
    map_a = np.zeros(6, np.int64)
    map_a[0] = map_a[3] = 1
    for n in range(members[0], members[1]):
        top, left = blocks.corners[n, 0], blocks.corners[n, 1]
        _gather(charts, top, left, channels, old)
        count = 0
        for a in range(tiles):
            for b in range(tiles):
                offset = a * numbers.grid_columns + b
                count = add_tile(features, count, numbers, old, a * tile, b * tile, offset)
        best = best_candidate(table, numbers, features, count)
        blocks.chosen[n] = best
        source_row, source_column = best // numbers.grid_columns * tile, best % numbers.grid_columns * tile
        _seed_labels(scratch.seeds, side, charts.along_rows, n == 0, n == len(blocks.corners) - 1)
        _cut_block(old, working, source_row, source_column, channels, cell, scratch)
        for i in range(block):
            for j in range(block):
                weight = _weight(scratch.mask, side, low, part, i, j)
                if weight == 0:
                    continue
                x = (source_column + j) * channels
                new = working[source_row + i, x : x + channels]
                row_b, column_b = _across(top + i, left + j, charts.map_b)
                _paint_on(charts.canvas_a, charts.size_a, top + i, left + j, new, weight)
                _paint_on(charts.canvas_b, charts.size_b, row_b, column_b, new, weight)
        _label(charts.labels_a, map_a, (top, left), (side, cell), scratch.mask, blocks.number + 2 * n)
        _label(
            charts.labels_b, charts.map_b, (top, left), (side, cell), scratch.mask, blocks.number + 2 * n + 1
        )
