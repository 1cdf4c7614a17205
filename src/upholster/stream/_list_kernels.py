"""Coding the placements of a list field by field, and their masks (SPEC.md, sections 5.3 and 5.4)."""

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS, code_bit
from upholster.jit import allocating_kernel, inline, kernel
from upholster.quilt._field_kernels import matrix_at
from upholster.methods.quilt._masked_kernels import window_of
from upholster.stream._bit_kernels import MISSING, NUMBER_COUNTERS, START, BitCoder, begin, code_number, undo
from upholster.types import int64

__all__ = ["CELL_COUNTERS", "FIELDS", "FIELD_COUNTERS", "PLAIN_FIELDS", "code_cells", "code_fields"]

PLAIN_FIELDS = 13
"""Row, column, height, width, symmetry, mask, sides, ramp, cell, feather, source row, source column, first
cell: those of a list without centre matrices."""

FIELDS = PLAIN_FIELDS + 5
"""Then whether there is a centre matrix, 2 if it differs from the warp field there by multiples of 64,
and its four numbers."""

_MASK, _CELL, _SOURCE, _FIRST, _CENTRED = 5, 8, 10, 12, 13

FIELD_COUNTERS = FIELDS * NUMBER_COUNTERS
CELL_COUNTERS = (256 * 256) + 2048 + 8192


@kernel
def code_cells(
    coder: BitCoder,
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
    a = coder.a
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
        bit = code_bit(
            coder.state, coder.data, coder.a, 3, 1 if i == 0 else 0, 400, encoding, int64(cells[n])
        )
        if bit < 0:
            return n
        cells[n] = bit
    return stop


@inline
def _following(record: NDArray[np.int64], before: int, tall: int, wide: int) -> int:
    # Where the next mask's window is expected to start.
    if record[_MASK] != 2:
        return before
    height, width = record[2], record[3]
    low = (record[0] - height // 2, record[1] - width // 2)
    cell, reach = max(1, record[_CELL]), record[_CELL + 1]
    i0, i1, j0, j1 = window_of(low, (height, width), cell, reach, tall, wide)
    return int(record[_FIRST] + (i1 - i0) * (j1 - j0))


@allocating_kernel
def code_fields(
    coder: BitCoder,
    fields: NDArray[np.int64],
    sizes: NDArray[np.int64],
    limits: NDArray[np.int64],
    fine: bool,
    matrices: NDArray[np.int32],
    margin: int,
    start: int,
    stop: int,
    encoding: bool,
) -> int:
    """Code placements `fields[start:stop]`, each as its difference from what the one before makes likely.

    `fields` (n, FIELDS + 1): the fields, then where the next mask's window is expected to start. `sizes`
    (n, 2) are those of the placements' charts in texels; `limits` (FIELDS, 2) the least and greatest value of
    each field. `fine`: sources count 16 to a pixel, and there may be centre matrices; `matrices` and
    `margin` are the warp field of the placements' chart. Returns the index of the first placement
    not coded, or -1 - index of one that breaks a limit.
    """
    kept = np.empty_like(coder.state)
    record = np.zeros(FIELDS, np.int64)
    count, steps = (FIELDS, 16) if fine else (PLAIN_FIELDS, 1)
    for n in range(start, stop):
        begin(coder, kept)
        changed = 0
        following = fields[n - 1, FIELDS] if n > 0 else 0
        for f in range(_CENTRED, FIELDS):
            record[f] = 0
        for f in range(count):
            if f > _CENTRED and record[_CENTRED] == 0:
                break
            guess = int64(0)
            if n > 0:
                guess = fields[n - 1, f]
                if f == _SOURCE or f == _SOURCE + 1:
                    guess += steps * (record[f - _SOURCE] - fields[n - 1, f - _SOURCE])
            if f == _FIRST:
                guess = following if record[_MASK] == 2 else -1
            unit = int64(1)
            if f > _CENTRED and record[_CENTRED] == 2:
                field = matrix_at(matrices, margin, record[0], record[1])
                guess, unit = int64(field[f - _CENTRED - 1]), int64(64)
            value = (fields[n, f] - guess) // unit if encoding else int64(0)
            value = code_number(coder, f, changed, encoding, value)
            if value == MISSING:
                undo(coder, kept)
                return n
            changed = (2 * changed + (1 if value != 0 else 0)) & 3
            record[f] = guess + unit * value
            if record[f] < limits[f, 0] or record[f] > limits[f, 1]:
                return -1 - n
        for f in range(FIELDS):
            fields[n, f] = record[f]
        fields[n, FIELDS] = _following(record, following, sizes[n, 0], sizes[n, 1])
    return stop
