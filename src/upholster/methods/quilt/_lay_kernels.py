"""The hot loop of method "quilt": the blocks of one chart, chosen, cut and laid in raster order.

Numbers that the kernel needs come in `p` (int64), at the places named below; few arrays a call are faster.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.methods.quilt._search_kernels import draw, judge, search
from upholster.methods.quilt._seed_kernels import OUTSIDE, cut, seed_labels
from upholster.quilt._field_kernels import displacement, displacements, matrix_at

__all__ = ["lay_blocks"]

# Places in `p`.
(
    HEIGHT,
    WIDTH,
    CHANNELS,
    LEVEL,
    MARGIN,
    ORIGIN_ROW,
    ORIGIN_COLUMN,
    WRAP,
    BLOCK_HEIGHT,
    BLOCK_WIDTH,
    SAMPLE,
    CELL,
    SHORTLIST,
    STEP,
    USAGE_STEP,
    ACROSS,
    FIRST,
    LAST,
    NEED_TOP,
    NEED_BOTTOM,
    NEED_LEFT,
    NEED_RIGHT,
    PARAMETERS,
) = range(23)

# Columns of a block's record: centre, indices of the left and upper neighbours (-1: none), then what the
# kernel finds: source in 1/16 pixel, and whether it was laid (1), laid on nothing (2), or not needed (0).
ROW, COLUMN, LEFT, TOP, SOURCE_ROW, SOURCE_COLUMN, LAID = range(7)

REFINED = 4
"""How many of the best candidates are looked round."""

_BIG = np.int64(2**60)


@inline
def _whole(distance: int, level: int) -> int:
    # A distance in 1/16 pixel, in whole pixels of a level.
    return (distance + (8 << level)) >> (4 + level)


@inline
def _pixel(position: int, level: int) -> int:
    # The pixel of a level in which a position in 1/16 pixel lies.
    return (position + 8) >> (4 + level)


@inline
def _position(pixel: int, level: int) -> int:
    # The middle of a level's pixel, in 1/16 pixel of the exemplar.
    return ((16 * pixel + 8) << level) - 8


@inline
def _range(low: int, high: int, size: int, level: int) -> tuple[int, int]:
    # First and last pixel for a centre whose texels fall `low` to `high` from it; where there is none, the
    # middle, twice.
    first, last = -_whole(low, level), size - 1 - _whole(high, level)
    if first > last:
        first = last = min(max((first + last) // 2, 0), size - 1)
    return first, last


@inline
def splat_tent(
    usage_step: NDArray[np.float64], stride: int, row: int, column: int, height: int, width: int, by: float
) -> None:
    # Adds to each point of the lattice how much of a block there a block at (row, column) covers.
    i0, i1 = max(0, (row - height) // stride + 1), min(usage_step.shape[0], (row + height) // stride + 1)
    j0, j1 = max(0, (column - width) // stride + 1), min(usage_step.shape[1], (column + width) // stride + 1)
    for i in range(i0, i1):
        y = 1.0 - abs(i * stride - row) / height
        for j in range(j0, j1):
            x = 1.0 - abs(j * stride - column) / width
            if x > 0.0 and y > 0.0:
                usage_step[i, j] += by * (x * y)


@kernel
def lay_blocks(
    canvas: NDArray[np.uint8],
    covered: NDArray[np.uint8],
    image: NDArray[np.uint8],
    plane: NDArray[np.float32],
    matrices: NDArray[np.int32],
    p: NDArray[np.int64],
    weights: NDArray[np.float64],
    usage: NDArray[np.float64],
    state: NDArray[np.uint64],
    blocks: NDArray[np.int32],
    cells: NDArray[np.uint8],
) -> None:
    """Choose, cut and lay blocks [FIRST, LAST) of a chart in order.

    `canvas` (rows, columns · channels) and `covered` (rows, columns) hold the chart and what is round it,
    every block whole; texel (0, 0) is at (ORIGIN_ROW, ORIGIN_COLUMN), and with WRAP their ends meet.
    `covered`: bit 0 where something has been laid, bit 1 where it must not change, for finished charts go on
    there. A block that covers nothing new of rows NEED_TOP to NEED_BOTTOM and columns NEED_LEFT to NEED_RIGHT
    is left out. `image` (H · W · channels) is the exemplar's matching form and `plane` its boxes' means,
    every STEP-th of them side by side. `weights`: evenness and variety, each times the exemplar's variance,
    and the slack of the choice. `use` (n, m) counts how much each part of the exemplar is used, every LATTICE
    pixels. `cells` (blocks, cells of a block): masks, 1 = new.

    A block's candidates are every STEP-th pixel at which it reads inside the exemplar. Of those that differ
    least in boxes' means SHORTLIST are judged by the covered texels themselves (every other one, as on a
    chessboard), with the neighbours' continuations and then the pixels round the best ones. One of those
    within the slack of the best is drawn.
    """
    height, width, channels = p[HEIGHT], p[WIDTH], p[CHANNELS]
    level, margin, sample, cell = p[LEVEL], p[MARGIN], p[SAMPLE], p[CELL]
    bh, bw = p[BLOCK_HEIGHT], p[BLOCK_WIDTH]
    rows, columns = covered.shape
    stride, step, box = p[USAGE_STEP], p[STEP], 4 * sample
    area, reach = bh * bw, step // 2
    around_rows, around_columns = np.empty(bh + 2, np.int64), np.empty(bw + 2, np.int64)
    ys, xs = np.empty((bh, bw), np.int32), np.empty((bh, bw), np.int32)
    mine, old = np.empty((bh, bw), np.uint8), np.empty((bh, bw * channels), np.uint8)
    offsets, values = np.empty(area, np.int32), np.empty(area * channels, np.int32)
    features = np.empty(2 * (bh // box + 1) * (bw // box + 1), np.int64)
    feature_values = np.empty(features.shape[0], np.float32)
    costs = np.empty(width, np.float32)
    most = 2 + p[SHORTLIST] + REFINED * ((2 * reach + 1) ** 2 - 1)
    heap, kept, judged = np.empty(most, np.float32), np.empty(most, np.int64), np.empty(most, np.int64)
    going, going_y, going_x = np.empty(2, np.int64), np.zeros(2, np.int64), np.zeros(2, np.int64)
    penalties = np.empty_like(usage)
    cell_columns = bw // cell
    cell_count = bh // cell * cell_columns
    errors, seeds = np.empty(cell_count, np.int64), np.empty(cell_count, np.int8)
    missing, marks = np.empty(cell_count, np.int32), np.empty(cell_count, np.int32)
    residual, work = np.empty((4, cell_count), np.int64), np.empty((4, cell_count), np.int32)
    for n in range(p[FIRST], p[LAST]):
        block = blocks[n]
        row, column = np.int64(block[ROW]), np.int64(block[COLUMN])
        top, left = row - bh // 2, column - bw // 2
        for i in range(bh + 2):
            r = top - 1 + i + p[ORIGIN_ROW]
            around_rows[i] = r % rows if p[WRAP] else r if 0 <= r < rows else -1
        for j in range(bw + 2):
            c = left - 1 + j + p[ORIGIN_COLUMN]
            around_columns[j] = c % columns if p[WRAP] else c if 0 <= c < columns else -1
        # What is there already.
        there, bare = 0, 0
        for i in range(bh):
            r = around_rows[i + 1]
            needed = p[NEED_TOP] <= top + i < p[NEED_BOTTOM]
            for j in range(bw):
                c = around_columns[j + 1]
                mark = covered[r, c]
                mine[i, j] = mark
                if mark & 1:
                    there += 1
                    for k in range(channels):
                        old[i, j * channels + k] = canvas[r, c * channels + k]
                elif needed and p[NEED_LEFT] <= left + j < p[NEED_RIGHT]:
                    bare += 1
        block[LAID] = 0
        if bare == 0:
            continue
        # Where its texels fall, seen from its centre: in 1/16 pixel, then in pixels of the level.
        displacements(matrices, margin, row, column, top, left, ys, xs)
        low_y, high_y, low_x, high_x = 0, 0, 0, 0
        for i in range(bh):
            for j in range(bw):
                low_y, high_y = min(low_y, ys[i, j]), max(high_y, ys[i, j])
                low_x, high_x = min(low_x, xs[i, j]), max(high_x, xs[i, j])
        first_y, last_y = _range(low_y, high_y, height, level)
        first_x, last_x = _range(low_x, high_x, width, level)
        low_y, high_y = max(_whole(low_y, level), -first_y), min(_whole(high_y, level), height - 1 - last_y)
        low_x, high_x = max(_whole(low_x, level), -first_x), min(_whole(high_x, level), width - 1 - last_x)
        for i in range(bh):
            for j in range(bw):
                # A block larger than the exemplar repeats its edges.
                ys[i, j] = min(max(_whole(ys[i, j], level), low_y), high_y)
                xs[i, j] = min(max(_whole(xs[i, j], level), low_x), high_x)
        tall, wide = max(1, high_y - low_y), max(1, high_x - low_x)
        if there == 0:
            block[LAID] = 2
            block[SOURCE_ROW] = _position(first_y + draw(state, last_y - first_y + 1), level)
            block[SOURCE_COLUMN] = _position(first_x + draw(state, last_x - first_x + 1), level)
        else:
            block[LAID] = 1
            # What is used more than the rest, or by blocks near by, costs more.
            mean = 0.0
            for i in range(usage.shape[0]):
                for j in range(usage.shape[1]):
                    mean += usage[i, j]
            mean /= usage.size
            for i in range(usage.shape[0]):
                for j in range(usage.shape[1]):
                    penalties[i, j] = weights[0] * max(0.0, usage[i, j] / mean - 1.0) if mean > 0.0 else 0.0
            if weights[1] > 0.0:
                for m in range(n - 1, max(-1, n - 2 * p[ACROSS] - 3), -1):
                    near = abs(blocks[m, ROW] - row) < 2 * bh and abs(blocks[m, COLUMN] - column) < 2 * bw
                    if blocks[m, LAID] and near:
                        y, x = _pixel(blocks[m, SOURCE_ROW], level), _pixel(blocks[m, SOURCE_COLUMN], level)
                        splat_tent(penalties, stride, y, x, tall // 2 + 1, wide // 2 + 1, weights[1])
            # Features: means of boxes that are covered entirely.
            count = 0
            for a in range(0, bh - box + 1, box):
                for b in range(0, bw - box + 1, box):
                    total, whole = np.int64(0), True
                    for i in range(a, a + box, sample):
                        for j in range(b, b + box, sample):
                            whole = whole and mine[i, j] & 1 != 0
                            total += np.int32(old[i, j * channels])
                    if whole:
                        # The box's middle falls midway between two texels', 1½ pixels from the first of four.
                        i, j = a + box // 2, b + box // 2
                        y, x = (ys[i - 1, j - 1] + ys[i, j] - 3) >> 1, (xs[i - 1, j - 1] + xs[i, j] - 3) >> 1
                        features[2 * count] = max(min(y, high_y - 3), low_y)
                        features[2 * count + 1] = max(min(x, high_x - 3), low_x)
                        feature_values[count] = (total + 8) >> 4
                        count += 1
            samples = 0
            for i in range(0, bh, sample):
                for j in range((i // sample & 1) * sample, bw, 2 * sample):
                    if mine[i, j] & 1:
                        offsets[samples] = ys[i, j] * width + xs[i, j]
                        for k in range(channels):
                            values[samples * channels + k] = old[i, j * channels + k]
                        samples += 1
            # Candidates: from place 2 on those that the search finds, before them the continuations.
            if count:
                bounds = first_y, last_y, first_x, last_x
                stop = 2 + search(
                    plane,
                    width,
                    step,
                    bounds,
                    features,
                    feature_values,
                    count,
                    penalties,
                    stride,
                    p[SHORTLIST],
                    costs,
                    heap,
                    kept[2:],
                )
            else:  # too little is there to search by
                for m in range(2, 2 + p[SHORTLIST]):
                    y = first_y + draw(state, last_y - first_y + 1)
                    kept[m] = y * width + first_x + draw(state, last_x - first_x + 1)
                stop = 2 + p[SHORTLIST]
            centre = matrix_at(matrices, margin, row, column)
            start = 2
            for side in range(2):
                m = block[LEFT + side]
                going[side] = -1
                if m >= 0 and blocks[m, LAID]:
                    other = matrix_at(matrices, margin, blocks[m, ROW], blocks[m, COLUMN])
                    y, x = displacement(other, centre, row - blocks[m, ROW], column - blocks[m, COLUMN])
                    going_y[side], going_x[side] = y + blocks[m, SOURCE_ROW], x + blocks[m, SOURCE_COLUMN]
                    y, x = _pixel(going_y[side], level), _pixel(going_x[side], level)
                    if first_y <= y <= last_y and first_x <= x <= last_x:
                        going[side] = y * width + x
                        start -= 1
                        kept[start] = going[side]
            best, limit = _BIG, _BIG
            begin = start
            for refining in range(2):
                for m in range(begin, stop):
                    y, x = kept[m] // width, kept[m] % width
                    extra = penalties[
                        min(y // stride, usage.shape[0] - 1), min(x // stride, usage.shape[1] - 1)
                    ]
                    extra_cost = np.int64(extra * samples)
                    judged[m] = judge(image, channels, kept[m], offsets, values, samples, extra_cost, limit)
                    if judged[m] < best:
                        best = judged[m]
                        limit = np.int64(best * weights[2])
                if refining or reach == 0:
                    break
                # The pixels round the best ones: cheapest first, the first of equals.
                begin = stop
                cost, place = np.int64(-1), -1
                for _ in range(REFINED):
                    least = -1
                    for m in range(start, begin):
                        later = judged[m] > cost or (judged[m] == cost and m > place)
                        if later and (least < 0 or judged[m] < judged[least]):
                            least = m
                    if least < 0:
                        break
                    cost, place = judged[least], least
                    y, x = kept[least] // width, kept[least] % width
                    for i in range(max(y - reach, first_y), min(y + reach, last_y) + 1):
                        for j in range(max(x - reach, first_x), min(x + reach, last_x) + 1):
                            if i != y or j != x:
                                kept[stop] = i * width + j
                                stop += 1
            good = 0
            for m in range(start, stop):
                good += judged[m] <= limit
            pick = draw(state, good)
            chosen = kept[start]
            for m in range(start, stop):
                if judged[m] <= limit:
                    if pick == 0:
                        chosen = kept[m]
                        break
                    pick -= 1
            block[SOURCE_ROW] = _position(chosen // width, level)
            block[SOURCE_COLUMN] = _position(chosen % width, level)
            for side in range(1, -1, -1):
                if going[side] == chosen:
                    block[SOURCE_ROW], block[SOURCE_COLUMN] = going_y[side], going_x[side]
        # Where what is new begins.
        base_y, base_x = _pixel(block[SOURCE_ROW], level), _pixel(block[SOURCE_COLUMN], level)
        base = base_y * width + base_x
        mask = cells[n]
        if there == 0:
            mask[:] = 1
        else:
            errors[:] = 0
            missing[:] = 0
            marks[:] = 0
            for i in range(bh):
                at = i // cell * cell_columns
                looked = i % sample == 0
                needed = p[NEED_TOP] <= top + i < p[NEED_BOTTOM]
                for b in range(cell_columns):
                    error: Any = 0
                    seen: Any = 0
                    for j in range(b * cell, (b + 1) * cell):
                        seen |= mine[i, j]
                        if mine[i, j] & 1 == 0:
                            if needed and p[NEED_LEFT] <= left + j < p[NEED_RIGHT]:
                                missing[at + b] = 1
                            seen |= 4
                        elif looked and j % sample == 0:
                            place = (base + ys[i, j] * width + xs[i, j]) * channels
                            for k in range(channels):
                                d = np.int32(image[place + k]) - np.int32(old[i, j * channels + k])
                                error += d * d
                    errors[at + b] += error
                    marks[at + b] |= seen
            kinds = seed_labels(
                missing, marks, covered, around_rows, around_columns, cell, cell_columns, seeds
            )
            if kinds == 3:
                cut(errors, seeds, cell_columns, residual, work, mask)
            else:
                # All new, or nothing but what is bare.
                for at in range(cell_count):
                    mask[at] = 1 if kinds == 2 or seeds[at] == OUTSIDE else 0
        for i in range(bh):
            r = around_rows[i + 1]
            at = i // cell * cell_columns
            for j in range(bw):
                c = around_columns[j + 1]
                if mask[at + j // cell]:
                    covered[r, c] |= 1
                    place = (base + ys[i, j] * width + xs[i, j]) * channels
                    for k in range(channels):
                        canvas[r, c * channels + k] = image[place + k]
        splat_tent(usage, stride, base_y, base_x, tall, wide, 1.0)
