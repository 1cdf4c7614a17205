"""Coding the sources of a strip plan (SPEC.md, section 5.2)."""

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS
from upholster.jit import kernel
from upholster.stream._bit_kernels import HASHED, START, begin, hash_of, logged_bit, undo

__all__ = ["SOURCE_COUNTERS", "code_sources"]

SOURCE_COUNTERS = 256 + 4096 + 3 * HASHED
_FLAGS, _TREE = 0, 256
_HASHES = _TREE + 4096


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
