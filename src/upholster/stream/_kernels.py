"""Coding placements: encoder and decoder are the same loops, over the bit coder of `upholster.codec`.

Each loop returns how far it came. A decoder stops where the bytes at hand do not determine the next symbol,
and goes on from there when there are more; a record that was begun is taken back first (`undo`), so that
only whole ones count.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS, WEIGHTS, code_bit
from upholster.jit import inline, kernel

__all__ = [
    "CELL_COUNTERS",
    "FIELDS",
    "FIELD_COUNTERS",
    "HASHED",
    "LOG",
    "MIXERS",
    "NUMBER_COUNTERS",
    "SOURCE_COUNTERS",
    "START",
    "UNKNOWN",
    "begin",
    "code_cells",
    "code_fields",
    "code_number",
    "code_sources",
    "hash_of",
    "logged_bit",
    "signed",
    "undo",
]

LOG = 4096
"""Length of the log of a record's changes."""

MIXERS = 5 * 13
START = WEIGHTS + 8 * MIXERS
"""Where the counters start in the model."""

HASHED = 1 << 16
SOURCE_COUNTERS = 256 + 4096 + 3 * HASHED
_FLAGS, _TREE = 0, 256

FIELDS = 13
"""Row, column, height, width, turn, mask, sides, ramp, cell, feather, source row, source column, cells."""

NUMBER_COUNTERS = 8 + 40 + 40 * 64
UNKNOWN = 1 << 40
"""What `code_number` returns where the bytes at hand do not determine a number."""

FIELD_COUNTERS = FIELDS * NUMBER_COUNTERS
CELL_COUNTERS = (256 * 256) + 2048 + 8192


@inline
def signed(value: Any) -> Any:
    """Return a number from any array in 64 bits, signed: unsigned ones do not mix."""
    return np.int64(value)


@inline
def logged_bit(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    log: NDArray[np.int64],
    inputs: int,
    mixer: int,
    encoding: bool,
    bit: int,
) -> int:
    # log[0] counts the numbers of the model that changed: (place, value before) each.
    if not encoding:
        n = log[0]
        for k in range(inputs):
            for place in (np.int64(a[CONTEXTS + k]), WEIGHTS + 8 * mixer + k):
                log[1 + 2 * n], log[2 + 2 * n] = place, a[place]
                n += 1
        log[0] = n
    return code_bit(state, data, a, inputs, mixer, 255, encoding, bit)


@inline
def begin(state: NDArray[np.int64], kept: NDArray[np.int64], log: NDArray[np.int64]) -> None:
    kept[:] = state
    log[0] = 0


@inline
def undo(
    state: NDArray[np.int64],
    kept: NDArray[np.int64],
    a: NDArray[np.int32],
    log: NDArray[np.int64],
) -> None:
    state[:] = kept
    for n in range(log[0] - 1, -1, -1):
        a[log[1 + 2 * n]] = log[2 + 2 * n]


@inline
def hash_of(a: int, b: int, c: int) -> int:
    # The upper 16 bits of a sum of products modulo 2^32.
    return ((a * 2654435761 + b * 2246822519 + c * 3266489917) & 0xFFFFFFFF) >> 16


@kernel
def code_sources(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    log: NDArray[np.int64],
    chosen: NDArray[np.int32],
    modes: NDArray[np.uint8],
    start: int,
    stop: int,
    first: int,
    across: int,
    strip: int,
    step: int,
    grid_rows: int,
    grid_columns: int,
    encoding: bool,
) -> int:
    """Code `chosen[start:stop]`, candidates of blocks of the run that begins at `first`.

    Candidates are numbered in raster order. The run is a raster `across` blocks wide; blocks lie `step`
    candidates apart. `strip`: 1 for edge blocks. `modes`: 1 where a block continues its left neighbour's
    source, 2 the upper one's. Returns the index of the first not coded.
    """
    kept = np.empty_like(state)
    bits_row, bits_column = 0, 0
    while (1 << bits_row) < grid_rows:
        bits_row += 1
    while (1 << bits_column) < grid_columns:
        bits_column += 1
    flags = _FLAGS + 128 * strip
    hashed = _TREE + 4096
    mixers = 10 * strip
    for n in range(start, stop):
        begin(state, kept, log)
        here = n - first
        left, top, left_mode, top_mode = -1, -1, 3, 3
        left_on, top_on = -1, -1
        if here % across:
            left, left_mode = chosen[n - 1], modes[n - 1]
            if left % grid_columns + step < grid_columns:
                left_on = left + step
        if here >= across:
            top, top_mode = chosen[n - across], modes[n - across]
            if top + step * grid_columns < grid_rows * grid_columns:
                top_on = top + step * grid_columns
        target = chosen[n] if encoding else 0
        found, mode = -1, 0
        around = left_mode * 4 + top_mode
        agree = 1 if left_on == top_on else 0
        for side in range(2):
            guess = left_on if side == 0 else top_on
            if guess < 0 or (side == 1 and agree) or found >= 0:
                continue
            a[CONTEXTS + 0] = START + flags + (side * 16 + around) * 2 + agree
            a[CONTEXTS + 1] = START + hashed + HASHED + hash_of(left, top, 5000 + side)
            bit = logged_bit(state, data, a, log, 2, mixers + side, encoding, target == guess)
            if bit < 0:
                undo(state, kept, a, log)
                return n
            if bit:
                found, mode = guess, side + 1
        if found < 0:
            node = 1
            row = 0
            for b in range(bits_row + bits_column):
                in_column = b >= bits_row
                if b == bits_row:
                    row, node = node - (1 << bits_row), 1
                if in_column:
                    bit = (target % grid_columns) >> (bits_column - 1 - (b - bits_row)) & 1
                    place = node + 4096 * (1 + row)
                else:
                    bit = (target // grid_columns) >> (bits_row - 1 - b) & 1
                    place = node
                a[CONTEXTS + 0] = START + _TREE + (2048 if in_column else 0) + (node & 2047)
                a[CONTEXTS + 1] = START + hashed + hash_of(place, left + 1, strip)
                a[CONTEXTS + 2] = START + hashed + HASHED + hash_of(place, top + 1, 7 + strip)
                a[CONTEXTS + 3] = START + hashed + 2 * HASHED + hash_of(place, left + 1, top + 19)
                bit = logged_bit(
                    state,
                    data,
                    a,
                    log,
                    4,
                    mixers
                    + 2
                    + ((1 if left_on >= 0 else 0) + (2 if top_on >= 0 else 0) + (4 if in_column else 0)),
                    encoding,
                    bit,
                )
                if bit < 0:
                    undo(state, kept, a, log)
                    return n
                node = 2 * node + bit
            if bits_column == 0:
                row, node = node - (1 << bits_row), 1
            found = row * grid_columns + node - (1 << bits_column)
            if row >= grid_rows or node - (1 << bits_column) >= grid_columns:
                return -1 - n
        chosen[n], modes[n] = found, mode
    return stop


@kernel
def code_cells(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    cells: NDArray[np.uint8],
    start: int,
    stop: int,
    first: int,
    rows: int,
    columns: int,
    place: int,
    encoding: bool,
) -> int:
    """Code cells [start, stop) of masks of rows × columns cells, the first of which begins at `first`.

    `place` says where in its strip the mask is: 0 inside, 1 first, 2 last, 3 both. Returns the first cell not
    coded.
    """
    area = rows * columns
    for n in range(start, stop):
        at = (n - first) % area
        i, j = at // columns, at % columns
        west = cells[n - 1] if j > 0 else 0
        north = cells[n - columns] if i > 0 else 0
        north_west = cells[n - columns - 1] if i > 0 and j > 0 else 0
        north_east = cells[n - columns + 1] if i > 0 and j + 1 < columns else 0
        far_west = cells[n - 2] if j > 1 else 0
        far_north = cells[n - 2 * columns] if i > 1 else 0
        near = west | north << 1 | north_west << 2 | north_east << 3
        around = near | far_west << 4 | far_north << 5
        half = min(15, 16 * j // columns)
        a[CONTEXTS + 0] = START + ((min(i, 63) * 64 + min(j, 63)) * 4 + place) * 4 + (near & 3)
        a[CONTEXTS + 1] = START + 65536 + (around * 16 + half) * 2 + (1 if i == 0 else 0)
        a[CONTEXTS + 2] = (
            START + 65536 + 2048 + (near * 64 + min(j, 63)) * 4 + (0 if i == 0 else 2 if i == rows - 1 else 1)
        )
        bit = code_bit(state, data, a, 3, 1 if i == 0 else 0, 400, encoding, cells[n])
        if bit < 0:
            return n
        cells[n] = bit
    return stop


@inline
def code_number(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    log: NDArray[np.int64],
    field: int,
    context: int,
    encoding: bool,
    value: int,
) -> int:
    # A signed number within ±2^34 as: is it 0; the bit length of its magnitude, in unary; the sign; the bits
    # below the first, of which six are modelled.
    base = field * NUMBER_COUNTERS
    mixer = 5 * field
    a[CONTEXTS + 0] = START + base + context
    bit = logged_bit(state, data, a, log, 1, mixer, encoding, 1 if value != 0 else 0)
    if bit <= 0:
        return 0 if bit == 0 else UNKNOWN
    magnitude = abs(value)
    length = 0
    while length < 34:
        a[CONTEXTS + 0] = START + base + 8 + length
        more = 1 if magnitude >> (length + 1) else 0
        bit = logged_bit(state, data, a, log, 1, mixer + 1, encoding, more)
        if bit < 0:
            return UNKNOWN
        if bit == 0:
            break
        length += 1
    a[CONTEXTS + 0] = START + base + 4
    sign = logged_bit(state, data, a, log, 1, mixer + 2, encoding, 1 if value < 0 else 0)
    if sign < 0:
        return UNKNOWN
    node = 1
    result = 1
    for b in range(length):
        a[CONTEXTS + 0] = START + base + 48 + length * 64 + (node if b < 6 else 0)
        bit = logged_bit(
            state,
            data,
            a,
            log,
            1,
            mixer + (3 if b < 6 else 4),
            encoding,
            (magnitude >> (length - 1 - b)) & 1,
        )
        if bit < 0:
            return UNKNOWN
        node = 2 * node + bit
        result = 2 * result + bit
    return -result if sign else result


@kernel
def code_fields(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    log: NDArray[np.int64],
    fields: NDArray[np.int64],
    limits: NDArray[np.int64],
    steps: int,
    start: int,
    stop: int,
    encoding: bool,
) -> int:
    """Code placements `fields[start:stop]`, each as its difference from what the one before makes likely.

    `fields` (n, 14): the 13 fields, then where the next mask's cells are expected to start. `limits` (13, 2):
    least and greatest value of each field; sources count `steps` to a pixel. Returns the index of the first
    placement not coded, or -1 - index of one that breaks a limit.
    """
    kept = np.empty_like(state)
    record = np.zeros(FIELDS, np.int64)
    for n in range(start, stop):
        begin(state, kept, log)
        changed = 0
        for f in range(FIELDS):
            guess = 0
            if n > 0:
                guess = fields[n - 1, f]
                if f == 10 or f == 11:
                    guess += steps * (record[f - 10] - fields[n - 1, f - 10])
            if f == 12:
                guess = -1 if record[5] != 2 else fields[n - 1, 13] if n > 0 else 0
            context = changed
            value = fields[n, f] - guess if encoding else 0
            value = code_number(state, data, a, log, f, context, encoding, value)
            if value == UNKNOWN:
                undo(state, kept, a, log)
                return n
            changed = (2 * changed + (1 if value != 0 else 0)) & 3
            record[f] = guess + value
            if record[f] < limits[f, 0] or record[f] > limits[f, 1]:
                return -1 - n
        for f in range(FIELDS):
            fields[n, f] = record[f]
        following = fields[n - 1, 13] if n > 0 else 0
        if record[5] == 2:
            cell = max(1, record[8])
            following = record[12] + (record[2] + cell - 1) // cell * ((record[3] + cell - 1) // cell)
        fields[n, 13] = following
    return stop
