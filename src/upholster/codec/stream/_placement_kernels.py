"""Coding placements from coarse to fine: encoder and decoder are the same loops (SPEC.md, section 5.2)."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import int64
from upholster.codec._model_kernels import BYTES_DONE
from upholster.codec.stream._bit_kernels import (
    MISSING,
    NUMBER_COUNTERS,
    BitCoder,
    begin,
    code_counted,
    code_number,
    undo,
)
from upholster.quilt.placement import MOST_OFFSET
from upholster.runtime.jit import allocating_kernel, inline, kernel

__all__ = [
    "BOXES",
    "BOX_COLUMNS",
    "COLUMN",
    "COLUMNS",
    "DONE",
    "LINES",
    "OFFSET",
    "PART",
    "PAUSED",
    "PLACED",
    "PLACEMENT_COUNTERS",
    "ROW",
    "SOURCE",
    "SYMMETRY",
    "Boxes",
    "Units",
    "begin_boxes",
    "code_placements",
]

PART, ROW, COLUMN, SYMMETRY, OFFSET, SOURCE = 0, 1, 2, 3, 4, 8
"""Columns of a placement's record: its part (a layer of a chart), row and column of its cell, symmetry, the
four numbers of its matrix's offset, row and column of its source."""

COLUMNS = 10

# Columns of a box: its part; rows from, to; columns from, to; number of placements; the cell of the known
# one, with row −1 while there is none; the next box of its line; an encoder's first placement of it.
_PART, _TOP, _BOTTOM, _LEFT, _RIGHT, _COUNT, _ROW, _COLUMN, _NEXT, _FIRST = range(10)
BOX_COLUMNS = 10

LINES = 128
"""Number of lines in which boxes wait: 64 for each layer."""

_MOST_BYTES = 512
"""Largest number of bytes for a box: 254 bits of a placement, 41 of a cut; each takes 12 bits at worst."""

PLACED, BOXES = 0, 1
"""Places in `Boxes.counts`: number of placements coded so far, number of boxes made so far."""

PAUSED, DONE, _MISSING, _WRONG = 0, 1, 2, -1

_ROWS, _COLUMNS, _OFFSETS, _COUNTS = 0, 1, 2, 6
_KINDS = 7
_SYMMETRIES = _KINDS * NUMBER_COUNTERS
_HAS = _SYMMETRIES + 8
_SOURCES = _HAS + 1
_SOURCE_BITS = 32
PLACEMENT_COUNTERS = _SOURCES + 2 * _SOURCE_BITS


class Boxes(NamedTuple):
    """The boxes that wait.

    `boxes` (n, BOX_COLUMNS) int32; `lines` (LINES, 2) the first and the last box of each line, −1 if there is
    none; `parts` (parts, 2) area of a cell in steps, and the layer; `members` an encoder's
    placements, grouped by box; `counts`, see `PLACED` and `BOXES`.
    """

    boxes: NDArray[np.int32]
    lines: NDArray[np.int64]
    parts: NDArray[np.int64]
    members: NDArray[np.int64]
    counts: NDArray[np.int64]


class Units(NamedTuple):
    """The exemplar's size in pixels; the powers of 2 that divide all sources and all offsets."""

    height: int
    width: int
    source_bits: int
    offset_bits: int


@inline
def _cells(box: NDArray[np.int32]) -> int:
    return int(int64(box[_BOTTOM] - box[_TOP]) * int64(box[_RIGHT] - box[_LEFT]))


@inline
def _queue(waiting: Boxes, number: int) -> None:
    """Put a box at the end of its line."""
    box = waiting.boxes[number]
    steps, bits = _cells(box) * waiting.parts[box[_PART], 0], int64(0)
    while steps >> bits:
        bits += 1
    line = 64 * waiting.parts[box[_PART], 1] + 63 - bits
    box[_NEXT] = -1
    if waiting.lines[line, 0] < 0:
        waiting.lines[line, 0] = number
    else:
        waiting.boxes[waiting.lines[line, 1], _NEXT] = number
    waiting.lines[line, 1] = number


@kernel
def begin_boxes(waiting: Boxes) -> None:
    """Put the boxes made so far in their lines."""
    for number in range(waiting.counts[BOXES]):
        _queue(waiting, number)


@inline
def _next_line(lines: NDArray[np.int64]) -> int:
    for line in range(LINES):
        if lines[line, 0] >= 0:
            return line
    return -1


@inline
def _most_central(waiting: Boxes, box: NDArray[np.int32], given: NDArray[np.int32]) -> int:
    # An encoder's choice: the placement of a box that is nearest to its middle.
    row, column = (box[_TOP] + box[_BOTTOM] - 1) // 2, (box[_LEFT] + box[_RIGHT] - 1) // 2
    found, least = int64(-1), int64(0)
    for place in range(box[_FIRST], box[_FIRST] + box[_COUNT]):
        one = waiting.members[place]
        down, right = int64(given[one, ROW]) - row, int64(given[one, COLUMN]) - column
        away = down * down + right * right
        if found < 0 or away < least:
            found, least = int64(one), away
    return int(found)


@inline
def _code_bits(coder: BitCoder, place: int, bits: int, encoding: bool, value: int) -> int:
    # A number of `bits` bits, highest first, each with a counter of its own.
    found = int64(0)
    for b in range(bits - 1, -1, -1):
        bit = code_counted(coder, place + b, encoding, (value >> b) & 1)
        if bit < 0:
            return MISSING
        found = 2 * found + bit
    return int(found)


@inline
def _code_symmetry(coder: BitCoder, encoding: bool, symmetry: int) -> int:
    node = int64(1)
    for b in range(2, -1, -1):
        bit = code_counted(coder, _SYMMETRIES + node, encoding, (symmetry >> b) & 1)
        if bit < 0:
            return MISSING
        node = 2 * node + bit
    return int(node - 8)


@inline
def _code_cell(coder: BitCoder, box: NDArray[np.int32], record: NDArray[np.int64], encoding: bool) -> int:
    context = min(int64(box[_COUNT]), 4)
    for axis in range(2):
        low, high = int64(box[_TOP + 2 * axis]), int64(box[_BOTTOM + 2 * axis])
        middle = (low + high - 1) // 2
        rest = code_number(coder, _ROWS + axis, context, encoding, record[ROW + axis] - middle)
        if rest == MISSING:
            return _MISSING
        record[ROW + axis] = middle + rest
        if record[ROW + axis] < low or record[ROW + axis] >= high:
            return _WRONG
    return PAUSED


@inline
def _code_offset(coder: BitCoder, units: Units, record: NDArray[np.int64], encoding: bool) -> int:
    some = int64(0)
    for k in range(4):
        some |= record[OFFSET + k]
    has = code_counted(coder, _HAS, encoding, 1 if some != 0 else 0)
    if has < 0:
        return _MISSING
    for k in range(4):
        if has == 0:
            record[OFFSET + k] = 0
            continue
        number = code_number(coder, _OFFSETS + k, 0, encoding, record[OFFSET + k] >> units.offset_bits)
        if number == MISSING:
            return _MISSING
        record[OFFSET + k] = number << units.offset_bits
        if abs(record[OFFSET + k]) > MOST_OFFSET:
            return _WRONG
    return PAUSED


@inline
def _code_source(coder: BitCoder, units: Units, record: NDArray[np.int64], encoding: bool) -> int:
    for axis in range(2):
        largest = (16 * (units.height if axis == 0 else units.width) - 1) >> units.source_bits
        bits = int64(0)
        while largest >> bits:
            bits += 1
        place = _SOURCES + axis * _SOURCE_BITS
        number = _code_bits(coder, place, bits, encoding, record[SOURCE + axis] >> units.source_bits)
        if number == MISSING:
            return _MISSING
        if number > largest:
            return _WRONG
        record[SOURCE + axis] = number << units.source_bits
    return PAUSED


@inline
def _code_record(
    coder: BitCoder, box: NDArray[np.int32], units: Units, record: NDArray[np.int64], encoding: bool
) -> int:
    status = _code_cell(coder, box, record, encoding)
    if status != PAUSED:
        return int(status)
    symmetry = _code_symmetry(coder, encoding, record[SYMMETRY])
    if symmetry == MISSING:
        return _MISSING
    record[SYMMETRY] = symmetry
    status = _code_offset(coder, units, record, encoding)
    if status != PAUSED:
        return int(status)
    return int(_code_source(coder, units, record, encoding))


@inline
def _parted(waiting: Boxes, box: NDArray[np.int32], given: NDArray[np.int32], column: int, cut: int) -> int:
    # For an encoder: moves the box's placements before a cut to its front; returns their number.
    members, low = waiting.members, int64(box[_FIRST])
    first = low
    for place in range(low, low + box[_COUNT]):
        one = members[place]
        if given[one, column] < cut:
            members[place], members[first] = members[first], one
            first += 1
    return int(first - low)


@inline
def _split(
    coder: BitCoder,
    waiting: Boxes,
    number: int,
    given: NDArray[np.int32],
    record: NDArray[np.int64],
    encoding: bool,
) -> int:
    # Cuts a box in two; the half with the known placement takes its place. The known cell is in `record`.
    box = waiting.boxes[number]
    count = int64(box[_COUNT])
    across = 0 if box[_BOTTOM] - box[_TOP] >= box[_RIGHT] - box[_LEFT] else 1
    low, high = _TOP + 2 * across, _BOTTOM + 2 * across
    cut = (int64(box[low]) + int64(box[high])) // 2
    in_first = record[ROW + across] < cut
    before, others = int64(0), int64(0)
    if encoding:
        before = int64(_parted(waiting, box, given, ROW + across, cut))
        others = count - before if in_first else before
    rest = code_number(coder, _COUNTS, min(count, 5), encoding, others - count // 2)
    if rest == MISSING:
        return _MISSING
    others = count // 2 + rest
    if others < 0 or others >= count:
        return _WRONG
    other = waiting.boxes[waiting.counts[BOXES]]
    for k in range(BOX_COLUMNS):
        other[k] = box[k]
    other[_ROW] = -1
    box[_ROW], box[_COLUMN] = record[ROW], record[COLUMN]
    mine, theirs = (high, low) if in_first else (low, high)
    box[mine], other[theirs] = cut, cut
    box[_COUNT], other[_COUNT] = count - others, others
    if in_first:
        other[_FIRST] += before
    else:
        box[_FIRST] += before
    if _cells(box) < count - others or _cells(other) < others:
        return _WRONG
    _queue(waiting, number)
    if others > 0:
        _queue(waiting, waiting.counts[BOXES])
        waiting.counts[BOXES] += 1
    return PAUSED


@allocating_kernel
def code_placements(
    coder: BitCoder,
    waiting: Boxes,
    units: Units,
    given: NDArray[np.int32],
    placed: NDArray[np.int32],
    stop: int,
    encoding: bool,
) -> Any:
    """Code placements until `stop` are coded.

    Parameters
    ----------
    coder
        The coder of all placements.
    waiting
        The boxes that wait, with room for at least one more.
    units
        Units of the coded numbers.
    given
        (n, COLUMNS) an encoder's placements.
    placed
        (≥ stop, COLUMNS) receives the placements in coded order.
    stop
        Number of placements at which to pause; it pauses earlier if there is no more room for boxes, or for
        an encoder's bytes.
    encoding
        Whether to encode.

    Returns
    -------
    int
        PAUSED, DONE; 2 if bytes are missing, −1 if a number is not allowed.
    """
    kept = np.empty_like(coder.state)
    record = np.zeros(COLUMNS, np.int64)
    while True:
        line = _next_line(waiting.lines)
        if line < 0:
            return DONE
        if waiting.counts[PLACED] >= stop or waiting.counts[BOXES] >= waiting.boxes.shape[0]:
            return PAUSED
        if encoding and coder.state[BYTES_DONE] + _MOST_BYTES > coder.data.shape[0]:
            return PAUSED
        number = waiting.lines[line, 0]
        box = waiting.boxes[number]
        begin(coder, kept)
        after, status = int64(box[_NEXT]), int64(PAUSED)
        new = box[_ROW] < 0
        if new:
            if encoding:
                one = _most_central(waiting, box, given)
                for k in range(COLUMNS):
                    record[k] = given[one, k]
            record[PART] = box[_PART]
            status = int64(_code_record(coder, box, units, record, encoding))
        else:
            record[ROW], record[COLUMN] = box[_ROW], box[_COLUMN]
        if status == PAUSED:
            # It leaves its line before its halves join theirs; if bytes are missing it returns to it.
            waiting.lines[line, 0] = after
            if box[_COUNT] > 1:
                status = int64(_split(coder, waiting, number, given, record, encoding))
                if status == _MISSING:
                    waiting.lines[line, 0] = number
        if status == _MISSING:
            undo(coder, kept)
            return _MISSING
        if status == _WRONG:
            return _WRONG
        if new:
            for k in range(COLUMNS):
                placed[waiting.counts[PLACED], k] = record[k]
            waiting.counts[PLACED] += 1
