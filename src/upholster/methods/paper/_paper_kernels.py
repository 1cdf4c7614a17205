"""The two hot loops of method "paper": blocks laid in raster order, edge blocks along a shared edge."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import allocating_kernel, inline, spliced
from upholster.methods._cut_kernels import cut_grid
from upholster.methods.paper._match_kernels import (
    FRACTION_BITS,
    CandidateNumbers,
    Features,
    add_tile,
    best_candidate,
)
from upholster.methods.quilt._masked_kernels import lay_placement

__all__ = ["lay_blocks", "lay_edge_blocks"]


class CutScratch(NamedTuple):
    """Scratch of a block's cut: by cells, but for the weights, which are by texels."""

    difference: NDArray[np.int64]
    residual: NDArray[np.int64]
    seeds: NDArray[np.int8]
    work: NDArray[np.int32]
    weights: NDArray[np.int32]
    spare: NDArray[np.int32]


@spliced
def _features(numbers: CandidateNumbers, tiles: int) -> Features:
    most = 2 * numbers.channels * tiles * tiles
    return Features(
        np.empty(most, np.int32), np.empty(most, np.int32), np.empty(most, np.int32), np.empty(2048, np.int64)
    )


@allocating_kernel
def lay_blocks(
    canvas: NDArray[np.uint16],
    placements: Any,
    across: int,
    rows: tuple[int, int],
    first: int,
    overlap: int,
    numbers: CandidateNumbers,
    working: NDArray[np.uint16],
    table: NDArray[np.int32],
    symmetries: NDArray[np.int64],
) -> None:
    """Choose and paint the blocks of some block rows of a chart, from, to, in raster order.

    `canvas` (rows, columns · channels) holds the chart, padded to whole tiles. `placements` holds the chart's
    blocks in raster order, `across` in a row, complete but for their source, which is written here. The very
    first block is candidate `first`. `working` (H, W · channels) is the exemplar, `table` its coefficients.
    """
    channels, tile = numbers.channels, numbers.tile
    block = placements[0].height
    columns = canvas.shape[1] // channels
    tiles, band = block // tile, overlap // tile
    features = _features(numbers, tiles)
    spare, none = np.empty((1, 1), np.int32), np.zeros(0, np.uint8)
    for i in range(rows[0], rows[1]):
        for j in range(across):
            placement = placements[i * across + j]
            top, left = placement.row - block // 2, placement.column - block // 2
            if i == 0 and j == 0:
                chosen = (first // numbers.columns) * numbers.grid_columns + first % numbers.columns
            else:
                count = 0
                for a in range(min(tiles, (canvas.shape[0] - top) // tile)):
                    for b in range(min(tiles, (columns - left) // tile)):
                        if (i > 0 and a < band) or (j > 0 and b < band):
                            row, column = top + a * tile, left + b * tile
                            offset = a * numbers.grid_columns + b
                            count = add_tile(features, count, numbers, canvas, row, column, offset)
                chosen = best_candidate(table, numbers, features, count)
            placement.source_row = 16 * (chosen // numbers.grid_columns * tile + block // 2)
            placement.source_column = 16 * (chosen % numbers.grid_columns * tile + block // 2)
            lay_placement(
                canvas, 0, columns, placement, none, (0, 0, 0, 0), working, channels, symmetries, spare, spare
            )


@inline
def _across(row: int, column: int, map_b: NDArray[np.int64]) -> tuple[int, int]:
    # A texel of chart A's grid, beyond its edge, in the grid of chart B.
    return (
        map_b[0] * row + map_b[1] * column + map_b[4],
        map_b[2] * row + map_b[3] * column + map_b[5],
    )


@inline
def _seed_labels(seeds: NDArray[np.int8], size: int, along_rows: bool, is_first: bool, is_last: bool) -> None:
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


@inline
def _gather(
    canvas_a: NDArray[np.uint16],
    canvas_b: NDArray[np.uint16],
    size_a: tuple[int, int],
    map_b: NDArray[np.int64],
    top: int,
    left: int,
    channels: int,
    old: NDArray[np.uint16],
) -> None:
    # Writes to `old` what lies under an edge block now, on both sides of the edge, in A's frame.
    block = old.shape[0]
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


@inline
def _cut_block(
    old: NDArray[np.uint16],
    working: NDArray[np.uint16],
    source_row: int,
    source_column: int,
    channels: int,
    cell: int,
    scratch: CutScratch,
    mask: NDArray[np.uint8],
) -> None:
    # Cuts between what is there and the match, cell by cell; the seeds are set. A cell's squared coefficient
    # differences at levels 1 to n - 1 are, the transform being orthonormal, those of its texels.
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
    cut_grid(residual, scratch.seeds, side, scratch.work, mask)


@inline
def _mask_on_b(
    mask: NDArray[np.uint8],
    side: int,
    cell: int,
    map_b: NDArray[np.int64],
    corner_a: tuple[int, int],
    corner_b: tuple[int, int],
    out: NDArray[np.uint8],
) -> None:
    # Chart B sees the same block turned: its cells are expressed in its own frame.
    for a in range(side):
        for b in range(side):
            row, column = corner_a[0] + a * cell, corner_a[1] + b * cell
            row_b, column_b = _across(row, column, map_b)
            far_row, far_column = _across(row + cell - 1, column + cell - 1, map_b)
            i, j = (
                (min(row_b, far_row) - corner_b[0]) // cell,
                (min(column_b, far_column) - corner_b[1]) // cell,
            )
            out[i * side + j] = mask[a * side + b]


@inline
def _paint_block(
    canvas: NDArray[np.uint16],
    size: tuple[int, int],
    placement: Any,
    mask: NDArray[np.uint8],
    working: NDArray[np.uint16],
    channels: int,
    symmetries: NDArray[np.int64],
    scratch: CutScratch,
) -> None:
    # Paints an edge block on one of its charts, with its whole mask.
    placement.first_cell = 0
    side = scratch.difference.shape[0]
    window = (0, side, 0, side)
    weights, spare = scratch.weights, scratch.spare
    lay_placement(canvas, 0, size[1], placement, mask, window, working, channels, symmetries, weights, spare)


@allocating_kernel
def lay_edge_blocks(
    canvases: tuple[NDArray[np.uint16], NDArray[np.uint16]],
    sizes: tuple[tuple[int, int], tuple[int, int]],
    map_b: NDArray[np.int64],
    along_rows: bool,
    blocks: tuple[Any, Any],
    masks: NDArray[np.uint8],
    members: tuple[int, int],
    numbers: CandidateNumbers,
    working: NDArray[np.uint16],
    table: NDArray[np.int32],
    symmetries: NDArray[np.int64],
) -> None:
    """Choose, cut and paint some edge blocks, from, to, along an edge that charts A and B share.

    `canvases` and `sizes` (rows, columns) are those of A and B. `map_b` (6,) takes a texel of A's grid to B's
    grid: two rows of a matrix, then the offset. `along_rows`: the edge runs along A's rows axis (edges 1 and
    3). `blocks`: the placements on A, where they are upright, and on B, complete but for their sources;
    `masks` (blocks, side, side) receives the cut masks as A sees them.
    """
    on_each_a, on_each_b = blocks
    channels, tile = numbers.channels, numbers.tile
    block = on_each_a[0].height
    half, tiles, cell, side = block // 2, block // tile, tile // 2, masks.shape[1]
    old = np.empty((block, block * channels), np.uint16)
    features = _features(numbers, tiles)
    scratch = CutScratch(
        np.empty((side, side), np.int64),
        np.empty((4, side * side), np.int64),
        np.empty(side * side, np.int8),
        np.empty((4, side * side), np.int32),
        np.empty((block, block), np.int32),
        np.empty((block, block), np.int32),
    )
    mask_b = np.empty(side * side, np.uint8)
    for n in range(members[0], members[1]):
        on_a, on_b = on_each_a[n], on_each_b[n]
        top, left = on_a.row - half, on_a.column - half
        _gather(canvases[0], canvases[1], sizes[0], map_b, top, left, channels, old)
        count = 0
        for a in range(tiles):
            for b in range(tiles):
                offset = a * numbers.grid_columns + b
                count = add_tile(features, count, numbers, old, a * tile, b * tile, offset)
        chosen = best_candidate(table, numbers, features, count)
        source_row, source_column = (
            chosen // numbers.grid_columns * tile,
            chosen % numbers.grid_columns * tile,
        )
        _seed_labels(scratch.seeds, side, along_rows, n == 0, n == on_each_a.shape[0] - 1)
        mask_a = masks[n].reshape(-1)
        _cut_block(old, working, source_row, source_column, channels, cell, scratch, mask_a)
        corner_b = (on_b.row - half, on_b.column - half)
        _mask_on_b(mask_a, side, cell, map_b, (top, left), corner_b, mask_b)
        symmetry = symmetries[on_b.symmetry]
        on_a.source_row, on_a.source_column = 16 * (source_row + half), 16 * (source_column + half)
        # B's centre in A's grid: the symmetry undoes the linear part of the map.
        down, right = on_b.row - map_b[4], on_b.column - map_b[5]
        on_b.source_row = 16 * (source_row + symmetry[0] * down + symmetry[1] * right - top)
        on_b.source_column = 16 * (source_column + symmetry[2] * down + symmetry[3] * right - left)
        _paint_block(canvases[0], sizes[0], on_a, mask_a, working, channels, symmetries, scratch)
        _paint_block(canvases[1], sizes[1], on_b, mask_b, working, channels, symmetries, scratch)
