"""The hot loop of method "quilt": the blocks of one chart, chosen, cut and laid in raster order.

A block's steps have a function each: `_look`, what is there; `_fall`, where its texels read; `choose_source`
(see `_choice_kernels`); `cut_block` (see `_seed_kernels`); `_lay`.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.methods.quilt._block_kernels import (
    COLUMN,
    LAID,
    ROW,
    SOURCE_COLUMN,
    SOURCE_ROW,
    BlockTexels,
    ChartCanvas,
    LayNumbers,
    LayScratch,
    LayWeights,
    MatchImage,
    Span,
    pixel_at,
    position_of,
    splat_tent,
    whole_pixels,
)
from upholster.methods.quilt._choice_kernels import choose_source, list_continued, penalise
from upholster.methods.quilt._search_kernels import draw
from upholster.methods.quilt._seed_kernels import cut_block
from upholster.quilt._field_kernels import displacement_row, matrix_at
from upholster.types import int64

__all__ = ["lay_blocks"]


@inline
def _place(texel: int, origin: int, size: int, wrap: int) -> int:
    # Where a row or column of texels lies on the canvas; -1 beyond it.
    place = texel + origin
    if wrap:
        return place % size
    return place if 0 <= place < size else -1


@inline
def _look(
    chart: ChartCanvas, numbers: LayNumbers, top: int, left: int, texels: BlockTexels
) -> tuple[int, int]:
    # Copies what is under a block; returns how many texels are laid, and how many needed ones are bare.
    rows, columns = chart.covered.shape
    channels = numbers.channels
    for i in range(numbers.block_height + 2):
        texels.rows[i] = _place(top - 1 + i, numbers.origin_row, rows, numbers.wrap)
    for j in range(numbers.block_width + 2):
        texels.columns[j] = _place(left - 1 + j, numbers.origin_column, columns, numbers.wrap)
    laid, bare = int64(0), int64(0)
    for i in range(numbers.block_height):
        r = texels.rows[i + 1]
        needed = numbers.need_top <= top + i < numbers.need_bottom
        for j in range(numbers.block_width):
            c = texels.columns[j + 1]
            mark = chart.covered[r, c]
            texels.marks[i, j] = mark
            if mark & 1:
                laid += 1
                for k in range(channels):
                    texels.old[i, j * channels + k] = chart.canvas[r, c * channels + k]
            elif needed and numbers.need_left <= left + j < numbers.need_right:
                bare += 1
    return laid, bare


@inline
def _span(low: int, high: int, size: int, level: int) -> tuple[int, int, int, int]:
    # First and last pixel for a centre whose texels fall `low` to `high` from it, in 1/16 pixel (where there
    # is none, the middle, twice), and how far they then fall: a block larger than the exemplar repeats its
    # edges.
    low, high = whole_pixels(low, level), whole_pixels(high, level)
    first, last = -low, size - 1 - high
    if first > last:
        first = last = min(max((first + last) // 2, 0), size - 1)
    return first, last, max(low, -first), min(high, size - 1 - last)


@inline
def _fall(
    matrices: NDArray[np.int32], numbers: LayNumbers, row: int, column: int, texels: BlockTexels
) -> Span:
    # Writes where a block's texels fall, seen from its centre, in pixels of the level.
    ys, xs, level = texels.ys, texels.xs, numbers.level
    height, width = numbers.block_height, numbers.block_width
    centre = matrix_at(matrices, numbers.margin, row, column)
    down, right = -(height // 2), -(width // 2)
    low_y, high_y, low_x, high_x = int64(0), int64(0), int64(0), int64(0)
    for i in range(height):
        displacement_row(
            matrices, numbers.margin, centre, down + i, row + down + i, column + right, right, ys[i], xs[i]
        )
        for j in range(width):
            y, x = int64(ys[i, j]), int64(xs[i, j])
            low_y, high_y, low_x, high_x = min(low_y, y), max(high_y, y), min(low_x, x), max(high_x, x)
    first_y, last_y, low_y, high_y = _span(low_y, high_y, numbers.height, level)
    first_x, last_x, low_x, high_x = _span(low_x, high_x, numbers.width, level)
    for i in range(height):
        for j in range(width):
            ys[i, j] = min(max(whole_pixels(int64(ys[i, j]), level), low_y), high_y)
            xs[i, j] = min(max(whole_pixels(int64(xs[i, j]), level), low_x), high_x)
    return Span(first_y, last_y, first_x, last_x, low_y, high_y, low_x, high_x)


@inline
def _lay(
    chart: ChartCanvas,
    image: NDArray[np.uint8],
    numbers: LayNumbers,
    base: int,
    mask: NDArray[np.uint8],
    texels: BlockTexels,
) -> None:
    # Copies the texels of a block's new cells; `base` is the pixel that its centre reads.
    cell, channels, across = numbers.mask_cell, numbers.channels, numbers.block_width // numbers.mask_cell
    for i in range(numbers.block_height):
        r, at = texels.rows[i + 1], i // cell * across
        for j in range(numbers.block_width):
            if mask[at + j // cell]:
                c = texels.columns[j + 1]
                chart.covered[r, c] |= 1
                place = (base + texels.ys[i, j] * numbers.width + texels.xs[i, j]) * channels
                for k in range(channels):
                    chart.canvas[r, c * channels + k] = image[place + k]


@kernel
def lay_blocks(
    chart: ChartCanvas,
    match: MatchImage,
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    weights: LayWeights,
    usage: NDArray[np.float64],
    state: NDArray[np.uint64],
    blocks: NDArray[np.int32],
    part: tuple[int, int],
    cells: NDArray[np.uint8],
    scratch: LayScratch,
) -> None:
    """Choose, cut and lay some blocks of a chart, from, to, in order.

    `matrices` are the warp field's. `usage` (n, m) counts how much each part of the exemplar is used, every
    `usage_step` pixels. `state` is that of the random numbers. `blocks` are records, see `_block_kernels`.
    `cells` (blocks, cells of a block) receives their masks, 1 = new.

    A block that covers nothing new of what is needed is left out. One on nothing is drawn from all that fit;
    any other is chosen by what it continues, and cut where the two differ least.
    """
    texels = scratch.texels
    for n in range(part[0], part[1]):
        block, mask = blocks[n], cells[n]
        row, column = int64(block[ROW]), int64(block[COLUMN])
        top, left = row - numbers.block_height // 2, column - numbers.block_width // 2
        laid, bare = _look(chart, numbers, top, left, texels)
        block[LAID] = 0
        if bare == 0:
            continue
        span = _fall(matrices, numbers, row, column, texels)
        if laid == 0:
            block[LAID] = 2
            y = span.first_y + draw(state, span.last_y - span.first_y + 1)
            x = span.first_x + draw(state, span.last_x - span.first_x + 1)
            block[SOURCE_ROW], block[SOURCE_COLUMN] = (
                position_of(y, numbers.level),
                position_of(x, numbers.level),
            )
            for at in range(mask.shape[0]):
                mask[at] = 1
        else:
            block[LAID] = 1
            choice = scratch.choice
            penalise(usage, numbers, weights, blocks, n, span, choice.penalties)
            start = list_continued(matrices, numbers, blocks, n, span, choice)
            block[SOURCE_ROW], block[SOURCE_COLUMN] = choose_source(
                match, numbers, weights, state, span, texels, choice, start
            )
        source_y = pixel_at(int64(block[SOURCE_ROW]), numbers.level)
        source_x = pixel_at(int64(block[SOURCE_COLUMN]), numbers.level)
        base = source_y * numbers.width + source_x
        if laid:
            cut_block(chart.covered, match.image, numbers, top, left, base, texels, scratch.cut, mask)
        _lay(chart, match.image, numbers, base, mask, texels)
        tall, wide = max(1, span.high_y - span.low_y), max(1, span.high_x - span.low_x)
        splat_tent(usage, numbers.usage_step, source_y, source_x, tall, wide, 1.0)
