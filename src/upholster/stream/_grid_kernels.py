"""Coding the blocks of a grid plan: one chart's transferred blocks, then its own, by what they continue.

Encoder and decoder are the same loops (SPEC.md, section 5.5). A decoder stops where the bytes at hand do not
determine the next block, takes what it has begun of it back, and goes on when there are more.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS
from upholster.jit import allocating_kernel, inline
from upholster.stream._bit_kernels import (
    HASHED,
    MISSING,
    START,
    BitCoder,
    begin,
    hash_of,
    logged_bit,
    signed,
    undo,
)
from upholster.stream._block_records import (
    AGREES,
    CHART,
    COLUMN,
    CUT,
    HEIGHT,
    LINK,
    MATRIX,
    MODE,
    ROW,
    SIZE,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
    WIDTH,
    ChartNumbers,
)
from upholster.stream._transfer_kernels import (
    FLAG_MIXER,
    NO_MODE,
    TRANSFER_COUNTERS,
    TRANSFER_MIXERS,
    code_transferred,
    enter_centre,
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
_AS_BESIDE = _HASHES + 3 * HASHED
_TURN = _AS_BESIDE + 4
BLOCK_COUNTERS = _TURN + 8

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
def _owner(neighbour: int, first_own: int) -> int:
    return 0 if neighbour < 0 else 1 if neighbour < first_own else 2


@inline
def _pixel(position: int, level: int) -> int:
    return (position + 8) >> (4 + level)


@inline
def _position(pixel: int, level: int) -> int:
    return ((16 * pixel + 8) << level) - 8


@inline
def _code_tree(
    coder: BitCoder,
    sizes: tuple[int, int],
    left: int,
    top: int,
    encoding: bool,
    target_row: int,
    target_column: int,
) -> tuple[int, int]:
    # A pixel, row then column, highest bits first, in the neighbours' context; -1 where bytes are missing.
    a = coder.a
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
            bit = logged_bit(coder, 4, mixer, encoding, (target >> b) & 1)
            if bit < 0:
                return -1, -1
            node = 2 * node + bit
        if axis:
            column = node - (1 << bits)
        else:
            row = node - (1 << bits)
    return row, column


class Suggestions(NamedTuple):
    """What a block's neighbours suggest as its source: left, top, and a third.

    `ys`, `xs` are sources in 1/16 pixel, `valid` whether there is such a neighbour and source, `inside` how
    far inside the exemplar a block there reads.
    """

    ys: NDArray[np.int64]
    xs: NDArray[np.int64]
    valid: NDArray[np.int64]
    inside: NDArray[np.int64]


@inline
def _suggest(
    records: NDArray[np.int32],
    near: NDArray[np.int64],
    matrices: NDArray[np.int32],
    numbers: ChartNumbers,
    n: int,
    suggested: Suggestions,
) -> int:
    # Fills in what a block's neighbours suggest; returns how far left and top disagree, 0 to 3.
    one, unit = records[n], signed(16) << numbers.level
    most_y, most_x = 16 * numbers.exemplar_height - 1, 16 * numbers.exemplar_width - 1
    a, b = abs(signed(one[MATRIX])), abs(signed(one[MATRIX + 1]))
    c, d = abs(signed(one[MATRIX + 2])), abs(signed(one[MATRIX + 3]))
    tall, wide = (a * numbers.height + b * numbers.width) >> 9, (c * numbers.height + d * numbers.width) >> 9
    ys, xs, valid, inside = suggested.ys, suggested.xs, suggested.valid, suggested.inside
    for g in range(_GUESSES):
        ys[g], xs[g], valid[g], inside[g] = 0, 0, 0, 0
        if near[g] < 0 or records[near[g], SYMMETRY] != one[SYMMETRY]:
            continue
        y, x = going_on(records, near[g], matrices, numbers.margin, signed(one[ROW]), signed(one[COLUMN]))
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
    return apart


@inline
def _code_offset(
    coder: BitCoder,
    g: int,
    off_y: int,
    off_x: int,
    encoding: bool,
) -> tuple[int, int]:
    # How far a source lies from suggestion g, in pixels: three bits each; MISSING where bytes are.
    a = coder.a
    down, found = 0, signed(0)
    for axis in range(2):
        node = 1
        target = (off_x if axis else off_y) + _NEAR
        for b in range(2, -1, -1):
            a[CONTEXTS + 0] = START + _DELTA + g * 128 + (8 + 8 * down if axis else 0) + node
            bit = logged_bit(coder, 1, _DELTA_MIXER + axis, encoding, (target >> b) & 1)
            if bit < 0:
                return MISSING, 0
            node = 2 * node + bit
        if axis:
            found = node - 8 - _NEAR
        else:
            down = node - 8
    return down - _NEAR, found


@inline
def _code_suggested(
    coder: BitCoder,
    records: NDArray[np.int32],
    near: NDArray[np.int64],
    suggested: Suggestions,
    apart: int,
    target: tuple[int, int],
    level: int,
    encoding: bool,
) -> tuple[int, int, int]:
    # Mode and source of a block whose neighbours suggest it; mode 0 if none does, MISSING where bytes are.
    a = coder.a
    around = _mode_of(records, near[0]) * 8 + _mode_of(records, near[1])
    upper = _mode_of(records, near[3]) * 8 + _mode_of(records, near[4])
    for step in range(2 * _GUESSES):
        g, loose = step % _GUESSES, step // _GUESSES
        if not suggested.valid[g] or (step == 1 and apart == 0):
            continue
        y, x = suggested.ys[g], suggested.xs[g]
        pixel_y, pixel_x = _pixel(y, level), _pixel(x, level)
        off_y, off_x = _pixel(target[0], level) - pixel_y, _pixel(target[1], level) - pixel_x
        if loose:
            asked = abs(off_y) <= _NEAR and abs(off_x) <= _NEAR
            asked = asked and _position(pixel_y + off_y, level) == target[0]
            asked = asked and _position(pixel_x + off_x, level) == target[1]
        else:
            asked = target[0] == y and target[1] == x
        place = apart * 3 + suggested.inside[g]
        a[CONTEXTS + 0] = START + _FLAG + (step * 64 + around) * 12 + place
        a[CONTEXTS + 1] = START + _FLAG + 2 * _GUESSES * 768 + step * 12 + place
        a[CONTEXTS + 2] = START + _FLAG + 2 * _GUESSES * 780 + step * 64 + upper
        bit = logged_bit(coder, 3, _GUESS_MIXER + step, encoding, 1 if asked else 0)
        if bit < 0:
            return MISSING, y, x
        if bit and loose:
            down, right = _code_offset(coder, g, off_y, off_x, encoding)
            if down == MISSING:
                return MISSING, y, x
            return 1 + step, _position(pixel_y + down, level), _position(pixel_x + right, level)
        if bit:
            return 1 + step, y, x
    return 0, signed(0), signed(0)


@inline
def _code_plain(
    coder: BitCoder,
    suggested: Suggestions,
    target: tuple[int, int],
    numbers: ChartNumbers,
    encoding: bool,
) -> tuple[int, int]:
    # A source that no neighbour suggests; MISSING where bytes are.
    a = coder.a
    level = numbers.level
    whole_y, whole_x = _pixel(target[0], level), _pixel(target[1], level)
    off = _position(whole_y, level) != target[0] or _position(whole_x, level) != target[1]
    a[CONTEXTS + 0] = START + _OFF
    bit = logged_bit(coder, 1, _PLAIN_MIXER, encoding, 1 if off else 0)
    if bit < 0:
        return MISSING, 0
    if bit:
        row, column = signed(0), signed(0)
        for axis in range(2):
            value = signed(0)
            for b in range(19, -1, -1):
                a[CONTEXTS + 0] = START + _OFF + 1 + 20 * axis + b
                bit = (target[1] if axis else target[0]) >> b & 1
                bit = logged_bit(coder, 1, _PLAIN_MIXER, encoding, bit)
                if bit < 0:
                    return MISSING, 0
                value = 2 * value + bit
            if axis:
                column = value
            else:
                row = value
        return row, column
    ys, xs, valid = suggested.ys, suggested.xs, suggested.valid
    left = 1 + (_pixel(ys[0], level) >> 2) * 1024 + (_pixel(xs[0], level) >> 2) if valid[0] else 0
    top = 1 + (_pixel(ys[1], level) >> 2) * 1024 + (_pixel(xs[1], level) >> 2) if valid[1] else 0
    sizes = (
        _pixel(16 * (numbers.exemplar_height - 1), level) + 1,
        _pixel(16 * (numbers.exemplar_width - 1), level) + 1,
    )
    row, column = _code_tree(coder, sizes, left, top, encoding, whole_y, whole_x)
    if row < 0:
        return MISSING, 0
    return _position(row, level), _position(column, level)


@inline
def _code_symmetry(
    coder: BitCoder, records: NDArray[np.int32], near: NDArray[np.int64], target: int, encoding: bool
) -> int:
    # A block's symmetry: that of the block to the left, or above, or three bits; -1 where bytes are missing.
    a = coder.a
    left = signed(records[near[0], SYMMETRY]) if near[0] >= 0 else -1
    top = signed(records[near[1], SYMMETRY]) if near[1] >= 0 else -1
    for side in range(2):
        guess = top if side else left
        if guess < 0 or (side == 1 and guess == left):
            continue
        a[CONTEXTS + 0] = START + _AS_BESIDE + (3 if side else 0 if top < 0 else 1 if top == left else 2)
        bit = logged_bit(coder, 1, FLAG_MIXER, encoding, 1 if target == guess else 0)
        if bit < 0:
            return -1
        if bit:
            return guess
    node = 1
    for b in range(2, -1, -1):
        a[CONTEXTS + 0] = START + _TURN + node
        bit = logged_bit(coder, 1, FLAG_MIXER, encoding, (target >> b) & 1)
        if bit < 0:
            return -1
        node = 2 * node + bit
    return node - 8


@inline
def _code_own(
    coder: BitCoder,
    records: NDArray[np.int32],
    near: NDArray[np.int64],
    suggested: Suggestions,
    matrices: NDArray[np.int32],
    numbers: ChartNumbers,
    n: int,
    encoding: bool,
) -> int:
    # `near`: records beside (left, top, another, upper left, upper right), -1 where there is none. Returns 1,
    # 0 where bytes are missing, -1 where the source is out of range.
    a = coder.a
    a[CONTEXTS + 0] = START + _MASK + (1 if n > numbers.base else 0)
    cut = logged_bit(coder, 1, FLAG_MIXER, encoding, signed(records[n, CUT]))
    if cut < 0:
        return 0
    symmetry = 0
    if numbers.turned:
        symmetry = _code_symmetry(coder, records, near, signed(records[n, SYMMETRY]), encoding)
        if symmetry < 0:
            return 0
    records[n, CUT], records[n, LINK], records[n, SYMMETRY] = cut, -1, symmetry
    records[n, CHART] = numbers.chart
    enter_centre(records, matrices, numbers.margin, n)
    enter_matrix(records, n)
    target = (signed(records[n, SOURCE_ROW]), signed(records[n, SOURCE_COLUMN]))
    apart = _suggest(records, near, matrices, numbers, n, suggested)
    mode, y, x = _code_suggested(coder, records, near, suggested, apart, target, numbers.level, encoding)
    if mode == 0:
        y, x = _code_plain(coder, suggested, target, numbers, encoding)
    if mode == MISSING or y == MISSING:
        return 0
    if not (0 <= y < 16 * numbers.exemplar_height and 0 <= x < 16 * numbers.exemplar_width):
        return -1
    agrees, unit = 0, signed(16) << numbers.level
    for g in range(2):
        if suggested.valid[g] and abs(suggested.ys[g] - y) <= unit and abs(suggested.xs[g] - x) <= unit:
            agrees |= 1 << g
    records[n, SOURCE_ROW], records[n, SOURCE_COLUMN] = y, x
    records[n, MODE], records[n, AGREES], records[n, SIZE] = mode, agrees, numbers.mask_cell
    return 1


@inline
def _enter(lookup: NDArray[np.int32], records: NDArray[np.int32], numbers: ChartNumbers, n: int) -> None:
    # Enters a transferred block at the position that it lies nearest to.
    row, column = (
        signed(records[n, ROW]) - numbers.first_row,
        signed(records[n, COLUMN]) - numbers.first_column,
    )
    i = (row + numbers.step_row // 2) // numbers.step_row + 1
    j = (column + numbers.step_column // 2) // numbers.step_column + 1
    lookup[min(max(i, 0), numbers.rows + 1), min(max(j, 0), numbers.across + 1)] = n


@inline
def _neighbours(lookup: NDArray[np.int32], i: int, j: int, near: NDArray[np.int64]) -> None:
    near[0], near[1] = lookup[i, j - 1], lookup[i - 1, j]
    near[3], near[4] = lookup[i - 1, j - 1], lookup[i - 1, j + 1]
    # The third: what was transferred here, or to the right, below, or aslant.
    near[2] = lookup[i, j]
    for k in range(5):
        if near[2] < 0:
            down = 0 if k == 0 else -1 if k > 2 else 1
            right = 0 if k == 1 else 1 if k == 0 or k == 2 or k == 3 else -1
            near[2] = lookup[i + down, j + right]


@allocating_kernel
def code_blocks(
    coder: BitCoder,
    records: NDArray[np.int32],
    starts: NDArray[np.int64],
    order: int,
    there: NDArray[np.uint8],
    lookup: NDArray[np.int32],
    matrices: NDArray[np.int32],
    numbers: ChartNumbers,
    part: tuple[int, int],
    own: int,
    encoding: bool,
) -> tuple[int, int]:
    """Code some of a chart's transferred blocks and then positions of its grid, from, to, of both together.

    `records` (blocks, COLUMNS) are those of all charts in coded order; `starts` (charts + 1,) says where each
    chart's begin, and `order` which of them this one is. `there` (positions,) says which positions have a
    block; `own` of them have been coded. `lookup` (rows + 2, columns + 2) holds the block nearest to each
    position so far, with a ring round the grid; -1 at first. Returns the first not coded, or -1 - index of
    one that is out of range, and `own` to go on with.
    """
    a = coder.a
    kept = np.empty_like(coder.state)
    near = np.empty(5, np.int64)
    suggested = Suggestions(
        np.empty(_GUESSES, np.int64),
        np.empty(_GUESSES, np.int64),
        np.empty(_GUESSES, np.int64),
        np.empty(_GUESSES, np.int64),
    )
    across, first_own = numbers.across, numbers.base + numbers.transferred
    for t in range(part[0], part[1]):
        begin(coder, kept)
        if t < numbers.transferred:
            n = numbers.base + t
            done = code_transferred(coder, records, starts, order, matrices, numbers, n, encoding)
            if done > 0:
                _enter(lookup, records, numbers, n)
        else:
            place = t - numbers.transferred
            i, j = place // across + 1, place % across + 1
            n = first_own + own
            rim = i == 1 or j == 1 or i == numbers.rows or j == across
            beside = _owner(lookup[i, j - 1], first_own) * 3 + _owner(lookup[i - 1, j], first_own)
            beside = beside * 3 + _owner(lookup[i, j], first_own)
            a[CONTEXTS + 0] = START + _SKIP + 2 * beside + (1 if rim else 0)
            bit = logged_bit(coder, 1, FLAG_MIXER, encoding, signed(there[place]))
            if bit == 0:
                there[place] = 0
                continue
            done = 0
            if bit > 0:
                if n >= starts[order + 1]:
                    return -1 - t, own
                there[place] = 1
                records[n, ROW] = numbers.first_row + (i - 1) * numbers.step_row
                records[n, COLUMN] = numbers.first_column + (j - 1) * numbers.step_column
                records[n, HEIGHT], records[n, WIDTH] = numbers.height, numbers.width
                _neighbours(lookup, i, j, near)
                done = _code_own(coder, records, near, suggested, matrices, numbers, n, encoding)
            if done > 0:
                lookup[i, j] = n
                own += 1
        if done == 0:
            undo(coder, kept)
            return t, own
        if done < 0:
            return -1 - t, own
    return part[1], own
