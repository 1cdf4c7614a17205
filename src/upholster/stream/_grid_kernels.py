"""Coding the blocks of a grid plan: one chart's transferred blocks, then its own, by what they continue.

Encoder and decoder are the same loops (SPEC.md, section 5.5). A decoder stops where the bytes at hand do not
determine the next block, takes what it has begun of it back, and goes on when there are more.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS
from upholster.jit import inline, kernel
from upholster.quilt._field_kernels import matrix_at
from upholster.stream._block_records import (
    ACROSS,
    AGREES,
    BASE,
    BLOCK_HEIGHT,
    BLOCK_WIDTH,
    CELL,
    COLUMN,
    CUT,
    EXEMPLAR_HEIGHT,
    EXEMPLAR_WIDTH,
    FIRST_COLUMN,
    FIRST_ROW,
    HEIGHT,
    LEVEL,
    LINK,
    MARGIN,
    MODE,
    OWN,
    ROW,
    ROWS,
    SIZE,
    SOURCE_COLUMN,
    SOURCE_ROW,
    STEP_COLUMN,
    STEP_ROW,
    SYMMETRY,
    TRANSFERRED,
    WIDTH,
)
from upholster.stream._kernels import HASHED, START, begin, hash_of, logged_bit, signed, undo
from upholster.stream._transfer_kernels import (
    FLAG_MIXER,
    NO_MODE,
    TRANSFER_COUNTERS,
    TRANSFER_MIXERS,
    code_transferred,
    enter_matrix,
    going_on,
)

__all__ = ["BLOCK_COUNTERS", "BLOCK_INPUTS", "code_blocks"]

_GUESSES = 3
_NEAR = 3

# Counters, after those of the transferred blocks.
_SKIP = TRANSFER_COUNTERS
_MASK = _SKIP + 54
_FLAG = _MASK + 2
_DELTA = _FLAG + 2 * _GUESSES * (64 * 12 + 12 + 64)
_OFF = _DELTA + _GUESSES * 128
_TREE = _OFF + 1 + 40
_HASHES = _TREE + 4096
BLOCK_COUNTERS = _HASHES + 3 * HASHED

_GUESS_MIXER = FLAG_MIXER + 1
_DELTA_MIXER = _GUESS_MIXER + 2 * _GUESSES
_TREE_MIXER = _DELTA_MIXER + 2
_PLAIN_MIXER = _TREE_MIXER + 4
BLOCK_INPUTS = [1] * (TRANSFER_MIXERS + 1) + [3] * 6 + [1] * 2 + [4] * 4 + [1]
"""How many contexts each mixer weighs."""


@inline
def _mode_of(records: NDArray[np.int32], neighbour: int) -> int:
    return NO_MODE if neighbour < 0 else signed(records[neighbour, MODE])


@inline
def _owner(neighbour: int, transferred: int) -> int:
    return 0 if neighbour < 0 else 1 if neighbour < transferred else 2


@inline
def _pixel(position: int, level: int) -> int:
    return (position + 8) >> (4 + level)


@inline
def _position(pixel: int, level: int) -> int:
    return ((16 * pixel + 8) << level) - 8


@inline
def _code_tree(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    log: NDArray[np.int64],
    sizes: tuple[int, int],
    left: int,
    top: int,
    encoding: bool,
    target_row: int,
    target_column: int,
) -> tuple[int, int]:
    # A pixel, row then column, highest bits first, in the neighbours' context; -1 where bytes are missing.
    row, column = 0, 0
    for axis in range(2):
        bits = 0
        while (1 << bits) < sizes[axis]:
            bits += 1
        node = 1
        target = target_column if axis else target_row
        for b in range(bits - 1, -1, -1):
            place = node + 4096 * (1 + row) if axis else node
            a[CONTEXTS + 0] = START + _TREE + 2048 * axis + (node & 2047)
            a[CONTEXTS + 1] = START + _HASHES + hash_of(place, left, 0)
            a[CONTEXTS + 2] = START + _HASHES + HASHED + hash_of(place, top, 7)
            a[CONTEXTS + 3] = START + _HASHES + 2 * HASHED + hash_of(place, left, top + 19)
            mixer = _TREE_MIXER + 2 * axis + (1 if left > 0 or top > 0 else 0)
            bit = logged_bit(state, data, a, log, 4, mixer, encoding, (target >> b) & 1)
            if bit < 0:
                return -1, -1
            node = 2 * node + bit
        if axis:
            column = node - (1 << bits)
        else:
            row = node - (1 << bits)
    return row, column


@inline
def _code_own(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    log: NDArray[np.int64],
    records: NDArray[np.int32],
    near: NDArray[np.int64],
    matrices: NDArray[np.int32],
    p: NDArray[np.int64],
    n: int,
    later: bool,
    encoding: bool,
) -> int:
    # `near`: records beside (left, top, another, upper left, upper right), -1 where there is none.
    row, column, level, margin = signed(records[n, ROW]), signed(records[n, COLUMN]), p[LEVEL], p[MARGIN]
    a[CONTEXTS + 0] = START + _MASK + (1 if later else 0)
    cut = logged_bit(state, data, a, log, 1, FLAG_MIXER, encoding, signed(records[n, CUT]))
    if cut < 0:
        return 0
    records[n, CUT] = cut
    target_y, target_x = signed(records[n, SOURCE_ROW]), signed(records[n, SOURCE_COLUMN])
    most_y, most_x = 16 * p[EXEMPLAR_HEIGHT] - 1, 16 * p[EXEMPLAR_WIDTH] - 1
    # What each neighbour suggests, and whether a block there reads inside the exemplar.
    here = matrix_at(matrices, margin, row, column)
    tall = (abs(signed(here[0])) * p[BLOCK_HEIGHT] + abs(signed(here[1])) * p[BLOCK_WIDTH]) >> 9
    wide = (abs(signed(here[2])) * p[BLOCK_HEIGHT] + abs(signed(here[3])) * p[BLOCK_WIDTH]) >> 9
    unit = signed(16) << level
    ys, xs = np.zeros(_GUESSES, np.int64), np.zeros(_GUESSES, np.int64)
    valid, inside = np.zeros(_GUESSES, np.int64), np.zeros(_GUESSES, np.int64)
    for g in range(_GUESSES):
        if near[g] < 0 or records[near[g], SYMMETRY] != 0:
            continue
        y, x = going_on(records, near[g], matrices, margin, row, column)
        if y < 0 or y > most_y or x < 0 or x > most_x:
            continue
        if g == 2 and ((valid[0] and ys[0] == y and xs[0] == x) or (valid[1] and ys[1] == y and xs[1] == x)):
            continue
        ys[g], xs[g], valid[g] = y, x, 1
        room = min(min(y - tall, most_y - 15 - y - tall), min(x - wide, most_x - 15 - x - wide))
        inside[g] = 2 if room >= unit else 1 if room >= -unit else 0
    apart = 3
    if valid[0] and valid[1]:
        distance = max(abs(ys[0] - ys[1]), abs(xs[0] - xs[1]))
        apart = 0 if distance == 0 else 1 if distance <= _NEAR * unit else 2
    around = _mode_of(records, near[0]) * 8 + _mode_of(records, near[1])
    upper = _mode_of(records, near[3]) * 8 + _mode_of(records, near[4])
    mode, y, x = 0, signed(0), signed(0)
    for step in range(2 * _GUESSES):
        g, loose = step % _GUESSES, step // _GUESSES
        if mode or not valid[g] or (step == 1 and apart == 0):
            continue
        pixel_y, pixel_x = _pixel(ys[g], level), _pixel(xs[g], level)
        off_y, off_x = _pixel(target_y, level) - pixel_y, _pixel(target_x, level) - pixel_x
        if loose:
            asked = abs(off_y) <= _NEAR and abs(off_x) <= _NEAR
            asked = asked and _position(pixel_y + off_y, level) == target_y
            asked = asked and _position(pixel_x + off_x, level) == target_x
        else:
            asked = target_y == ys[g] and target_x == xs[g]
        place = apart * 3 + inside[g]
        a[CONTEXTS + 0] = START + _FLAG + (step * 64 + around) * 12 + place
        a[CONTEXTS + 1] = START + _FLAG + 2 * _GUESSES * 768 + step * 12 + place
        a[CONTEXTS + 2] = START + _FLAG + 2 * _GUESSES * 780 + step * 64 + upper
        bit = logged_bit(state, data, a, log, 3, _GUESS_MIXER + step, encoding, 1 if asked else 0)
        if bit < 0:
            return 0
        if not bit:
            continue
        mode = 1 + step
        y, x = ys[g], xs[g]
        if loose:
            # How far off: rows, then columns, three bits each.
            down = 0
            for axis in range(2):
                node = 1
                target = (off_x if axis else off_y) + _NEAR
                for b in range(2, -1, -1):
                    a[CONTEXTS + 0] = START + _DELTA + g * 128 + (8 + 8 * down if axis else 0) + node
                    bit = logged_bit(state, data, a, log, 1, _DELTA_MIXER + axis, encoding, (target >> b) & 1)
                    if bit < 0:
                        return 0
                    node = 2 * node + bit
                if axis:
                    x = _position(pixel_x + node - 8 - _NEAR, level)
                else:
                    down = node - 8
                    y = _position(pixel_y + down - _NEAR, level)
    if mode == 0:
        whole_y, whole_x = _pixel(target_y, level), _pixel(target_x, level)
        off = _position(whole_y, level) != target_y or _position(whole_x, level) != target_x
        a[CONTEXTS + 0] = START + _OFF
        bit = logged_bit(state, data, a, log, 1, _PLAIN_MIXER, encoding, 1 if off else 0)
        if bit < 0:
            return 0
        if bit:
            for axis in range(2):
                value = signed(0)
                for b in range(19, -1, -1):
                    a[CONTEXTS + 0] = START + _OFF + 1 + 20 * axis + b
                    target = target_x if axis else target_y
                    bit = logged_bit(state, data, a, log, 1, _PLAIN_MIXER, encoding, (target >> b) & 1)
                    if bit < 0:
                        return 0
                    value = 2 * value + bit
                if axis:
                    x = value
                else:
                    y = value
        else:
            left = 1 + (_pixel(ys[0], level) >> 2) * 1024 + (_pixel(xs[0], level) >> 2) if valid[0] else 0
            top = 1 + (_pixel(ys[1], level) >> 2) * 1024 + (_pixel(xs[1], level) >> 2) if valid[1] else 0
            sizes = (_pixel(most_y - 15, level) + 1, _pixel(most_x - 15, level) + 1)
            row_there, column_there = _code_tree(
                state, data, a, log, sizes, left, top, encoding, whole_y, whole_x
            )
            if row_there < 0:
                return 0
            y, x = _position(row_there, level), _position(column_there, level)
    if y < 0 or y > most_y or x < 0 or x > most_x:
        return -1
    agrees = 0
    for g in range(2):
        if valid[g] and abs(ys[g] - y) <= unit and abs(xs[g] - x) <= unit:
            agrees |= 1 << g
    records[n, SOURCE_ROW], records[n, SOURCE_COLUMN] = y, x
    records[n, MODE], records[n, AGREES], records[n, SIZE] = mode, agrees, p[CELL]
    records[n, LINK], records[n, SYMMETRY] = -1, 0
    enter_matrix(records, matrices, margin, n)
    return 1


@kernel
def code_blocks(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    log: NDArray[np.int64],
    records: NDArray[np.int32],
    starts: NDArray[np.int64],
    order: int,
    there: NDArray[np.uint8],
    lookup: NDArray[np.int32],
    matrices: NDArray[np.int32],
    p: NDArray[np.int64],
    start: int,
    stop: int,
    encoding: bool,
) -> int:
    """Code a chart's transferred blocks and the positions of its raster, [start, stop) of both together.

    `records` (blocks, 17) are those of all charts in coded order, see the columns; `starts` (charts + 1,)
    says where each chart's begin, and `order` which of them this one is. `there` (positions,) says which
    positions have a block. `lookup` (rows + 2, columns + 2) holds the block nearest to each position so far,
    with a ring round the raster; -1 at first. `p` are the chart's numbers. Returns the first not coded, or
    -1 - index of one that is out of range.
    """
    kept = np.empty_like(state)
    near = np.empty(5, np.int64)
    transferred, across, base = p[TRANSFERRED], p[ACROSS], p[BASE]
    for t in range(start, stop):
        begin(state, kept, log)
        if t < transferred:
            n = base + t
            done = code_transferred(state, data, a, log, records, starts, order, matrices, p, n, encoding)
            if done > 0:
                i = (signed(records[n, ROW]) - p[FIRST_ROW] + p[STEP_ROW] // 2) // p[STEP_ROW] + 1
                j = (signed(records[n, COLUMN]) - p[FIRST_COLUMN] + p[STEP_COLUMN] // 2) // p[STEP_COLUMN] + 1
                lookup[min(max(i, 0), p[ROWS] + 1), min(max(j, 0), across + 1)] = n
        else:
            i, j = (t - transferred) // across + 1, (t - transferred) % across + 1
            n = base + transferred + p[OWN]
            rim = i == 1 or j == 1 or i == p[ROWS] or j == across
            beside = _owner(lookup[i, j - 1], base + transferred) * 3 + _owner(
                lookup[i - 1, j], base + transferred
            )
            beside = beside * 3 + _owner(lookup[i, j], base + transferred)
            a[CONTEXTS + 0] = START + _SKIP + 2 * beside + (1 if rim else 0)
            done = logged_bit(state, data, a, log, 1, FLAG_MIXER, encoding, signed(there[t - transferred]))
            if done == 0:
                there[t - transferred] = 0
                continue
            if done > 0 and n >= starts[order + 1]:
                return -1 - t
            if done > 0:
                there[t - transferred] = 1
                records[n, ROW] = p[FIRST_ROW] + (i - 1) * p[STEP_ROW]
                records[n, COLUMN] = p[FIRST_COLUMN] + (j - 1) * p[STEP_COLUMN]
                records[n, HEIGHT], records[n, WIDTH] = p[BLOCK_HEIGHT], p[BLOCK_WIDTH]
                near[0], near[1] = lookup[i, j - 1], lookup[i - 1, j]
                near[3], near[4] = lookup[i - 1, j - 1], lookup[i - 1, j + 1]
                # The third: what was transferred here, or to the right, below, or aslant.
                near[2] = lookup[i, j]
                for k in range(5):
                    if near[2] < 0:
                        down = 0 if k == 0 else -1 if k > 2 else 1
                        right = 0 if k == 1 else 1 if k == 0 or k == 2 or k == 3 else -1
                        near[2] = lookup[i + down, j + right]
                done = _code_own(state, data, a, log, records, near, matrices, p, n, n > base, encoding)
            else:
                done = 0
            if done > 0:
                lookup[i, j] = n
                p[OWN] += 1
        if done == 0:
            undo(state, kept, a, log)
            return t
        if done < 0:
            return -1 - t
    return stop
