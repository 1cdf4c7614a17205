"""The hot loop of method "quilt": the blocks of one chart, chosen, cut and laid in raster order.

A block's steps have a function each: `look`, what is there; `_list_symmetries`, which ones it is tried
with; for each of these `fall`, where its texels read, and `choose_source` (see `_choice_kernels`);
`cut_block` (see `_seed_kernels`); `_lay`.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.methods.quilt._block_kernels import (
    COLUMN,
    LAID,
    PHASE,
    ROW,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
    BlockTexels,
    ChartCanvas,
    LayNumbers,
    LayScratch,
    LayWeights,
    MatchImage,
    Span,
    SymmetryScratch,
    pixel_at,
    position_of,
    splat_tent,
    whole_pixels,
)
from upholster.methods.quilt._choice_kernels import (
    choose_source,
    draw_in_phase,
    first_of,
    list_continued,
    penalise,
)
from upholster.methods.quilt._landmark_kernels import LandmarkUses, shown_landmarks
from upholster.methods.quilt._phase_kernels import want_phases
from upholster.methods.quilt._search_kernels import draw
from upholster.methods.quilt._seed_kernels import cut_block
from upholster.quilt._field_kernels import displacement_row, matrix_at
from upholster.quilt.placement import SYMMETRIES
from upholster.types import int64, uint64

__all__ = ["fall", "lay_blocks", "look"]


@inline
def _place(texel: int, origin: int, size: int, wrap: int) -> int:
    # Where a row or column of texels lies on the canvas; -1 beyond it.
    place = texel + origin
    if wrap:
        return place % size
    return place if 0 <= place < size else -1


@inline
def look(
    chart: ChartCanvas, numbers: LayNumbers, top: int, left: int, texels: BlockTexels
) -> tuple[int, int]:
    """Copy what is under a block; return how many texels are laid, and how many needed ones are bare."""
    rows, columns = chart.covered.shape
    for i in range(numbers.block_height + 2):
        texels.rows[i] = _place(top - 1 + i, numbers.origin_row, rows, numbers.wrap)
    for j in range(numbers.block_width + 2):
        texels.columns[j] = _place(left - 1 + j, numbers.origin_column, columns, numbers.wrap)
    laid, bare = int64(0), int64(0)
    first, stop = max(0, numbers.need_left - left), min(numbers.block_width, numbers.need_right - left)
    for i in range(numbers.block_height):
        marks, old, r = texels.marks[i], texels.old[i], uint64(texels.rows[i + 1])
        for j in range(numbers.block_width):
            c = uint64(texels.columns[j + 1])
            marks[j], old[j] = chart.covered[r, c], chart.canvas[r, c]
        for j in range(numbers.block_width):
            laid += marks[j] & np.uint8(1)
        if numbers.need_top <= top + i < numbers.need_bottom:
            for j in range(first, stop):
                bare += np.uint8(1) - (marks[uint64(j)] & np.uint8(1))
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
def _turn(turn: NDArray[np.int64], ys: NDArray[np.int32], xs: NDArray[np.int32]) -> None:
    # Applies a symmetry to displacements.
    a, b, c, d = np.int32(turn[0]), np.int32(turn[1]), np.int32(turn[2]), np.int32(turn[3])
    for j in range(ys.shape[0]):
        y, x = ys[j], xs[j]
        ys[j] = np.int32(a * y) + np.int32(b * x)
        xs[j] = np.int32(c * y) + np.int32(d * x)


@inline
def _extend(ends: tuple[np.int32, np.int32], places: NDArray[np.int32]) -> tuple[np.int32, np.int32]:
    # The least and the greatest of some numbers, and of those before them.
    low, high = ends
    for j in range(places.shape[0]):
        low, high = min(low, places[j]), max(high, places[j])
    return low, high


@inline
def _round(places: NDArray[np.int32], level: int, low: np.int32, high: np.int32) -> None:
    # Displacements in 1/16 pixel, in whole pixels of a level, from `low` to `high`.
    half, shift = np.int32(8 << level), np.int32(4 + level)
    for j in range(places.shape[0]):
        places[j] = min(max(np.int32(places[j] + half) >> shift, low), high)


@inline
def fall(
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    symmetry: int,
    row: int,
    column: int,
    texels: BlockTexels,
) -> Span:
    """Write where a block's texels fall, seen from its centre, in pixels of the level."""
    level, height = numbers.level, numbers.block_height
    turn, centre = SYMMETRIES[symmetry], matrix_at(matrices, numbers.margin, row, column)
    down, right = -(height // 2), -(numbers.block_width // 2)
    ends_y, ends_x = (np.int32(0), np.int32(0)), (np.int32(0), np.int32(0))
    for i in range(height):
        ys, xs = texels.ys[i], texels.xs[i]
        displacement_row(
            matrices, numbers.margin, centre, down + i, row + down + i, column + right, right, ys, xs
        )
        if symmetry:
            _turn(turn, ys, xs)
        ends_y, ends_x = _extend(ends_y, ys), _extend(ends_x, xs)
    first_y, last_y, low_y, high_y = _span(int64(ends_y[0]), int64(ends_y[1]), numbers.height, level)
    first_x, last_x, low_x, high_x = _span(int64(ends_x[0]), int64(ends_x[1]), numbers.width, level)
    for i in range(height):
        _round(texels.ys[i], level, np.int32(low_y), np.int32(high_y))
        _round(texels.xs[i], level, np.int32(low_x), np.int32(high_x))
    return Span(first_y, last_y, first_x, last_x, low_y, high_y, low_x, high_x)


@inline
def _list_symmetries(
    chart: ChartCanvas,
    numbers: LayNumbers,
    texels: BlockTexels,
    state: NDArray[np.uint64],
    scratch: SymmetryScratch,
) -> Any:
    # Lists the symmetries that a block is tried with: the two that most of what it overlaps shows, and one
    # drawn from all that are allowed. Returns how many; where nothing is laid, the drawn one alone.
    shown, tried = scratch.shown, scratch.tried
    tried[0] = 0
    if numbers.symmetries == 1:
        return int64(1)
    for s in range(8):
        shown[s] = 0
    for i in range(numbers.block_height):
        for j in range(numbers.block_width):
            if texels.marks[i, j] & 1:
                r, c = uint64(texels.rows[i + 1]), uint64(texels.columns[j + 1])
                shown[chart.symmetries[r, c]] += 1
    allowed = int64(0)
    for s in range(8):
        allowed += numbers.symmetries >> s & 1
        if numbers.symmetries >> s & 1 == 0:
            shown[s] = 0
    count = int64(0)
    for _ in range(2):
        most = int64(0)
        for s in range(1, 8):
            if shown[s] > shown[most]:
                most = s
        if shown[most] > 0:
            tried[count], shown[most] = most, 0
            count += 1
    pick = draw(state, allowed)
    for s in range(8):
        if numbers.symmetries >> s & 1:
            if pick == 0 and (count == 0 or s != tried[0]) and (count < 2 or s != tried[1]):
                tried[count] = s
                count += 1
            pick -= 1
    return count


@inline
def _choose(
    match: MatchImage,
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    weights: LayWeights,
    usage: NDArray[np.float64],
    uses: LandmarkUses,
    state: NDArray[np.uint64],
    blocks: NDArray[np.int32],
    n: int,
    count: int,
    scratch: LayScratch,
) -> Span:
    # Chooses the source of block n with each of the symmetries listed, and keeps the cheapest, the first of
    # equals.
    block, choice, tried = blocks[n], scratch.choice, scratch.symmetries.tried
    row, column = int64(block[ROW]), int64(block[COLUMN])
    span = fall(matrices, numbers, tried[0], row, column, scratch.texels)
    least = int64(-1)
    for t in range(count):
        if t:
            span = fall(matrices, numbers, tried[t], row, column, scratch.texels)
        penalise(usage, numbers, weights, uses, blocks, n, tried[t], span, choice.penalties)
        want_phases(match, block[PHASE:], tried[t], choice)
        start = list_continued(matrices, numbers, blocks, n, tried[t], span, choice)
        y, x, cost = choose_source(match, numbers, weights, state, span, scratch.texels, choice, start)
        if least < 0 or cost < least:
            least = cost
            block[SOURCE_ROW], block[SOURCE_COLUMN], block[SYMMETRY] = y, x, tried[t]
    if block[SYMMETRY] != tried[count - 1]:
        span = fall(matrices, numbers, int64(block[SYMMETRY]), row, column, scratch.texels)
    return span


@inline
def _lay(
    chart: ChartCanvas,
    image: NDArray[np.int32],
    numbers: LayNumbers,
    symmetry: int,
    base: int,
    mask: NDArray[np.uint8],
    texels: BlockTexels,
) -> None:
    # Copies the texels of a block's new cells; `base` is the pixel that its centre reads.
    cell, across, width = numbers.mask_cell, numbers.block_width // numbers.mask_cell, np.int32(numbers.width)
    shown = np.uint8(symmetry)
    for i in range(numbers.block_height):
        r, ys, xs = uint64(texels.rows[i + 1]), texels.ys[i], texels.xs[i]
        covered, canvas, symmetries = chart.covered[r], chart.canvas[r], chart.symmetries[r]
        for b in range(across):
            if mask[uint64(i // cell * across + b)]:
                for j in range(b * cell, b * cell + cell):
                    c, at = uint64(texels.columns[uint64(j + 1)]), uint64(j)
                    covered[c] |= np.uint8(1)
                    symmetries[c] = shown
                    canvas[c] = image[uint64(base + (np.int32(ys[at] * width) + xs[at]))]


@kernel
def lay_blocks(
    chart: ChartCanvas,
    match: MatchImage,
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    weights: LayWeights,
    usage: NDArray[np.float64],
    uses: LandmarkUses,
    state: NDArray[np.uint64],
    blocks: NDArray[np.int32],
    part: tuple[int, int],
    cells: NDArray[np.uint8],
    scratch: LayScratch,
) -> None:
    """Choose, cut and lay some blocks of a chart, from, to, in order.

    `matrices` are the warp field's. `usage` counts how much each part of the exemplar is used, every
    `usage_step` pixels, (n, m) for each symmetry that is allowed, one below the other, and `uses` where its
    landmarks are shown. `state` is that of
    the random numbers. `blocks` are records, see `_block_kernels`. `cells` (blocks, cells of a block)
    receives their masks, 1 = new.

    A block that covers nothing new of what is needed is left out. One on nothing is drawn from all that fit;
    any other is chosen by what it continues, and cut where the two differ least.
    """
    texels = scratch.texels
    for n in range(part[0], part[1]):
        block, mask = blocks[n], cells[n]
        row, column = int64(block[ROW]), int64(block[COLUMN])
        top, left = row - numbers.block_height // 2, column - numbers.block_width // 2
        laid, bare = look(chart, numbers, top, left, texels)
        block[LAID] = 0
        if bare == 0:
            continue
        count = _list_symmetries(chart, numbers, texels, state, scratch.symmetries)
        if laid == 0:
            block[LAID], block[SYMMETRY] = 2, scratch.symmetries.tried[0]
            span = fall(matrices, numbers, int64(block[SYMMETRY]), row, column, texels)
            want_phases(match, block[PHASE:], int64(block[SYMMETRY]), scratch.choice)
            y, x = draw_in_phase(match, numbers, state, span, scratch.choice)
            block[SOURCE_ROW], block[SOURCE_COLUMN] = (
                position_of(y, numbers.level),
                position_of(x, numbers.level),
            )
            for at in range(mask.shape[0]):
                mask[at] = 1
        else:
            block[LAID] = 1
            span = _choose(match, matrices, numbers, weights, usage, uses, state, blocks, n, count, scratch)
        source_y = pixel_at(int64(block[SOURCE_ROW]), numbers.level)
        source_x = pixel_at(int64(block[SOURCE_COLUMN]), numbers.level)
        base = source_y * numbers.width + source_x
        if laid:
            cut_block(chart.covered, match.image, numbers, top, left, base, texels, scratch.cut, mask)
        _lay(chart, match.image, numbers, int64(block[SYMMETRY]), base, mask, texels)
        tall, wide = max(1, span.high_y - span.low_y), max(1, span.high_x - span.low_x)
        rows = scratch.choice.penalties.shape[0]
        first = first_of(numbers, int64(block[SYMMETRY]), rows)
        used = usage[first : first + rows]
        splat_tent(used, numbers.usage_step, source_y, source_x, tall, wide, 1.0)
        uses.shown[uses.before + n] = shown_landmarks(uses, source_y, source_x, tall, wide)
