"""Coding what other charts' blocks leave on a chart: each told by the block that it was there.

See `upholster.stream._grid_kernels`, which codes a chart's own blocks behind them (SPEC.md, section 5.5).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS
from upholster.jit import inline
from upholster.quilt._field_kernels import matrix_at
from upholster.quilt._paint_kernels import SYMMETRIES
from upholster.stream._block_records import (
    AGREES,
    BASE,
    BLOCK_HEIGHT,
    CELL,
    COLUMN,
    CUT,
    EXEMPLAR_HEIGHT,
    EXEMPLAR_WIDTH,
    HEIGHT,
    LINK,
    MARGIN,
    MATRIX,
    MODE,
    ROW,
    SIZE,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
    WIDTH,
)
from upholster.stream._kernels import NUMBER_COUNTERS, START, UNKNOWN, code_number, logged_bit, signed

__all__ = [
    "FLAG_MIXER",
    "NO_MODE",
    "TRANSFER_COUNTERS",
    "TRANSFER_MIXERS",
    "code_transferred",
    "enter_matrix",
    "going_on",
]

# What is told of a transferred block: the eight numbers of a placement, then the link.
_CHART, _INDEX = 8, 9
_FIELDS = 10
_ORDER = (SYMMETRY, ROW, COLUMN, HEIGHT, WIDTH, CUT, SOURCE_ROW, SOURCE_COLUMN)

NO_MODE = 7
"""Mode of a block whose source was not told by its neighbours."""

_RUN = _FIELDS * NUMBER_COUNTERS
TRANSFER_COUNTERS = _RUN + 2
TRANSFER_MIXERS = 5 * _FIELDS
FLAG_MIXER = TRANSFER_MIXERS
"""Mixer of flags of one context."""


@inline
def going_on(
    records: NDArray[np.int32],
    neighbour: int,
    matrices: NDArray[np.int32],
    margin: int,
    row: int,
    column: int,
) -> tuple[int, int]:
    # Where a placed block would read at a texel, in 1/16 pixel: what painting does there.
    one = records[neighbour]
    here, there = matrix_at(matrices, margin, row, column), matrix_at(matrices, margin, one[ROW], one[COLUMN])
    down, right = row - signed(one[ROW]), column - signed(one[COLUMN])
    y = ((signed(there[0]) + here[0]) * down + (signed(there[1]) + here[1]) * right + 256) >> 9
    x = ((signed(there[2]) + here[2]) * down + (signed(there[3]) + here[3]) * right + 256) >> 9
    symmetry = SYMMETRIES[one[SYMMETRY]]
    return one[SOURCE_ROW] + symmetry[0] * y + symmetry[1] * x, one[SOURCE_COLUMN] + symmetry[
        2
    ] * y + symmetry[3] * x


@inline
def _share(number: int, by: int) -> int:
    # number / by, rounded; by > 0.
    return (2 * number + by) // (2 * by)


@inline
def enter_matrix(records: NDArray[np.int32], matrices: NDArray[np.int32], margin: int, n: int) -> None:
    # Enter a block's turn times M at its centre.
    one = records[n]
    m = matrix_at(matrices, margin, signed(one[ROW]), signed(one[COLUMN]))
    symmetry = SYMMETRIES[one[SYMMETRY]]
    one[MATRIX] = symmetry[0] * m[0] + symmetry[1] * m[2]
    one[MATRIX + 1] = symmetry[0] * m[1] + symmetry[1] * m[3]
    one[MATRIX + 2] = symmetry[2] * m[0] + symmetry[3] * m[2]
    one[MATRIX + 3] = symmetry[2] * m[1] + symmetry[3] * m[3]


@inline
def _transferred_guess(
    records: NDArray[np.int32],
    matrices: NDArray[np.int32],
    p: NDArray[np.int64],
    n: int,
    f: int,
) -> Any:
    # What is likely for number f of a transferred block, the ones before it in `_ORDER` known.
    first, link = n == p[BASE], signed(records[n, LINK])
    guess = signed(0) if first else signed(records[n - 1, f])
    if f == CUT and first:
        guess = signed(1)
    elif HEIGHT <= f <= WIDTH and link < 0 and first:
        guess = p[BLOCK_HEIGHT + f - HEIGHT]
    elif f >= SOURCE_ROW:
        if link >= 0:
            guess = signed(records[link, f])
        elif not first:
            y, x = going_on(
                records, n - 1, matrices, p[MARGIN], signed(records[n, ROW]), signed(records[n, COLUMN])
            )
            guess = y if f == SOURCE_ROW else x
    elif f <= COLUMN:
        if not first and link >= 0 and records[n - 1, LINK] >= 0:
            # As far as the other chart's blocks lie apart, seen through both M.
            one, before, there = records[link], records[records[n - 1, LINK]], records[n - 1]
            down, right = signed(one[ROW]) - before[ROW], signed(one[COLUMN]) - before[COLUMN]
            y = (one[MATRIX] * down + one[MATRIX + 1] * right) >> 4
            x = (one[MATRIX + 2] * down + one[MATRIX + 3] * right) >> 4
            a, b = signed(there[MATRIX]), signed(there[MATRIX + 1])
            c, d = signed(there[MATRIX + 2]), signed(there[MATRIX + 3])
            area = (a * d - b * c) >> 4
            number = d * y - b * x if f == ROW else a * x - c * y
            if area < 0:
                area, number = -area, -number
            if area > 0:
                guess += _share(number, area)
        elif n - p[BASE] > 1:
            guess += guess - records[n - 2, f]
    elif link >= 0 and HEIGHT <= f <= WIDTH:
        # The rectangle round the other chart's block, seen through both M.
        here, one = records[n], records[link]
        a, b = signed(here[MATRIX]), signed(here[MATRIX + 1])
        c, d = signed(here[MATRIX + 2]), signed(here[MATRIX + 3])
        y, x = (d, b) if f == HEIGHT else (c, a)
        tall = abs(y * one[MATRIX] - x * one[MATRIX + 2]) * one[HEIGHT]
        wide = abs(y * one[MATRIX + 1] - x * one[MATRIX + 3]) * one[WIDTH]
        guess = min(((tall + wide) // max(1, abs(a * d - b * c)) // p[CELL] + 2) * p[CELL], 4096)
    return guess


@inline
def _code_link(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    log: NDArray[np.int64],
    records: NDArray[np.int32],
    starts: NDArray[np.int64],
    order: int,
    n: int,
    encoding: bool,
) -> int:
    # Which block of a chart before was transferred here: 1, 0 where bytes are missing, -1 if there is none
    # such.
    base, target = starts[order], signed(records[n, LINK])
    before = signed(records[n - 1, LINK]) if n > base else -1
    further = signed(records[n - 2, LINK]) if n > base + 1 else -1
    chart = 0  # of the link before, counted back from this one
    if before >= 0:
        chart = 1
        while starts[order - chart] > before:
            chart += 1
    onward = -1
    if before >= 0:
        onward = before + 1
        if further >= starts[order - chart] and further < before:
            onward = 2 * before - further
        if onward >= starts[order - chart + 1]:
            onward = -1
    if onward >= 0:
        a[CONTEXTS + 0] = START + _RUN + (1 if further >= 0 else 0)
        bit = logged_bit(state, data, a, log, 1, FLAG_MIXER, encoding, 1 if target == onward else 0)
        if bit < 0:
            return 0
        if bit:
            records[n, LINK] = onward
            return 1
    back = 0
    if encoding and target >= 0:
        back = 1
        while starts[order - back] > target:
            back += 1
    value = code_number(state, data, a, log, _CHART, 1 if before >= 0 else 0, encoding, back - chart)
    if value == UNKNOWN:
        return 0
    back = value + chart
    if back == 0:
        records[n, LINK] = -1
        return 1
    if back < 0 or back > order:
        return -1
    first = starts[order - back]
    guess = before if back == chart else first
    value = code_number(state, data, a, log, _INDEX, 1 if back == chart else 0, encoding, target - guess)
    if value == UNKNOWN:
        return 0
    value += guess
    if value < first or value >= starts[order - back + 1]:
        return -1
    records[n, LINK] = value
    return 1


@inline
def _code_numbers(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    log: NDArray[np.int64],
    records: NDArray[np.int32],
    matrices: NDArray[np.int32],
    p: NDArray[np.int64],
    n: int,
    encoding: bool,
) -> int:
    # Returns 1, 0 where bytes are missing, -1 where a number is out of range.
    changed = 0 if records[n, LINK] >= 0 else 2
    for f in _ORDER:
        guess = _transferred_guess(records, matrices, p, n, f)
        value = records[n, f] - guess if encoding else signed(0)
        value = code_number(state, data, a, log, f, changed, encoding, value)
        if value == UNKNOWN:
            return 0
        changed = (changed & 2) | (1 if value != 0 else 0)
        value += guess
        least, most = 0, 4096
        if f < HEIGHT:
            least, most = -(2**14) - 4096, 2**15
        elif f < SYMMETRY:
            least = 1
        elif f == SYMMETRY:
            most = 7
        elif f == CUT:
            most = 1
        elif f == SOURCE_ROW:
            most = 16 * p[EXEMPLAR_HEIGHT] - 1
        else:
            most = 16 * p[EXEMPLAR_WIDTH] - 1
        if value < least or value > most:
            return -1
        records[n, f] = value
        if f == COLUMN:
            enter_matrix(records, matrices, p[MARGIN], n)
    records[n, MODE], records[n, AGREES], records[n, SIZE] = NO_MODE, 0, p[CELL]
    return 1


@inline
def code_transferred(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    log: NDArray[np.int64],
    records: NDArray[np.int32],
    starts: NDArray[np.int64],
    order: int,
    matrices: NDArray[np.int32],
    p: NDArray[np.int64],
    n: int,
    encoding: bool,
) -> int:
    """Code a transferred block: 1, 0 where bytes are missing, -1 where a number is out of range."""
    done = _code_link(state, data, a, log, records, starts, order, n, encoding)
    if done > 0:
        done = _code_numbers(state, data, a, log, records, matrices, p, n, encoding)
    return done
