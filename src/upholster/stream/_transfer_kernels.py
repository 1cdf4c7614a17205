"""Coding what other charts' blocks leave on a chart: each told by the block that it was there.

See `upholster.stream._grid_kernels`, which codes a chart's own blocks behind them (SPEC.md, section 5.5).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS
from upholster.jit import inline
from upholster.quilt._field_kernels import displacement, matrix_at
from upholster.methods.quilt.masked import MATRIX_UNIT, SYMMETRIES
from upholster.stream._bit_kernels import (
    MISSING,
    NUMBER_COUNTERS,
    NUMBER_MIXERS,
    START,
    BitCoder,
    code_number,
    logged_bit,
    signed,
)
from upholster.stream._block_records import (
    AGREES,
    CENTRE,
    CENTRED,
    CHART,
    COLUMN,
    CUT,
    HEIGHT,
    LINK,
    MATRIX,
    MODE,
    PLACE,
    ROW,
    SIZE,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
    WIDTH,
    ChartNumbers,
)

__all__ = [
    "FLAG_MIXER",
    "NO_MODE",
    "TRANSFER_COUNTERS",
    "TRANSFER_MIXERS",
    "code_transferred",
    "enter_centre",
    "enter_matrix",
    "going_on",
]

# Kinds of numbers that tell a transferred block: the first eight of its record; where the block lies that it
# was transferred from, as chart and place; its centre matrix; then the first eight where nothing leads to it.
_CHART, _INDEX, _OWN_MATRIX, _ALONE = 8, 9, 10, 11
_KINDS = 19
_BEFORE, _SOURCE, _BEHIND = (SYMMETRY, ROW, COLUMN), (SOURCE_ROW, SOURCE_COLUMN), (HEIGHT, WIDTH, CUT)
_MOST_MATRIX = 2**18
_NEAR = 16
"""Transferred blocks before one that may lead to its place."""

_FARTHEST = 1 << 24
_STEPS = 3
"""Guesses at the step from link to link."""

NO_MODE = 7
"""Mode of a block whose source was not told by its neighbours."""

_RUN = _KINDS * NUMBER_COUNTERS
_CENTRED = _RUN + 3 * _STEPS
TRANSFER_COUNTERS = _CENTRED + 1
TRANSFER_MIXERS = NUMBER_MIXERS * _KINDS
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
    """Return where a placed block would read at a texel, in 1/16 pixel: what painting does there."""
    one = records[neighbour]
    y, x = displacement(
        one[CENTRE : CENTRE + 4],
        matrix_at(matrices, margin, row, column),
        row - signed(one[ROW]),
        column - signed(one[COLUMN]),
    )
    symmetry = SYMMETRIES[one[SYMMETRY]]
    return one[SOURCE_ROW] + symmetry[0] * y + symmetry[1] * x, one[SOURCE_COLUMN] + symmetry[
        2
    ] * y + symmetry[3] * x


@inline
def _share(number: int, by: int) -> int:
    # number / by, rounded; by > 0.
    return (2 * number + by) // (2 * by)


@inline
def enter_centre(records: NDArray[np.int32], matrices: NDArray[np.int32], margin: int, n: int) -> None:
    """Enter M at a block's centre as its centre matrix."""
    one = records[n]
    m = matrix_at(matrices, margin, signed(one[ROW]), signed(one[COLUMN]))
    one[CENTRED] = 0
    one[CENTRE], one[CENTRE + 1], one[CENTRE + 2], one[CENTRE + 3] = m


@inline
def enter_matrix(records: NDArray[np.int32], n: int) -> None:
    """Enter a block's symmetry times its centre matrix."""
    one = records[n]
    s = SYMMETRIES[one[SYMMETRY]]
    a, b, c, d = one[CENTRE], one[CENTRE + 1], one[CENTRE + 2], one[CENTRE + 3]
    one[MATRIX] = s[0] * a + s[1] * c
    one[MATRIX + 1] = s[0] * b + s[1] * d
    one[MATRIX + 2] = s[2] * a + s[3] * c
    one[MATRIX + 3] = s[2] * b + s[3] * d


@inline
def _turned_alike(records: NDArray[np.int32], link: int, other: int) -> int:
    # The symmetry that turns `link` as `other` turns the block that it was transferred from: T·E⁻¹·B.
    t, e = SYMMETRIES[records[link, SYMMETRY]], SYMMETRIES[records[records[other, LINK], SYMMETRY]]
    b = SYMMETRIES[records[other, SYMMETRY]]
    # The inverse of a symmetry is its transpose.
    p, q = t[0] * e[0] + t[1] * e[1], t[0] * e[2] + t[1] * e[3]
    r, s = t[2] * e[0] + t[3] * e[1], t[2] * e[2] + t[3] * e[3]
    p, q, r, s = p * b[0] + q * b[2], p * b[1] + q * b[3], r * b[0] + s * b[2], r * b[1] + s * b[3]
    found = 0
    for n in range(8):
        one = SYMMETRIES[n]
        if one[0] == p and one[1] == q and one[2] == r and one[3] == s:
            found = n
    return found


@inline
def _beside(records: NDArray[np.int32], base: int, n: int) -> Any:
    # The transferred block of this grid, of the latest ones, that was nearest to `n` on the chart from which
    # both come; -1 if there is none.
    link, found, least = signed(records[n, LINK]), signed(-1), signed(1 << 40)
    if link >= 0:
        for m in range(n - 1, max(base, n - _NEAR) - 1, -1):
            other = signed(records[m, LINK])
            if other < 0 or records[other, CHART] != records[link, CHART]:
                continue
            apart = abs(signed(records[link, ROW]) - records[other, ROW])
            apart += abs(signed(records[link, COLUMN]) - records[other, COLUMN])
            if apart < least:
                found, least = signed(m), apart
    return found


@inline
def _steps(matrix: tuple[int, int, int, int], y: int, x: int, factor: int, shift: int) -> tuple[int, int]:
    # The inverse of a matrix times (y, x), times factor·2^shift; 0 where there is none.
    p, q, r, s = matrix
    area = (p * s - q * r) >> shift
    down, right = factor * (s * y - q * x), factor * (p * x - r * y)
    if area < 0:
        area, down, right = -area, -down, -right
    if area == 0:
        return signed(0), signed(0)
    most = signed(_FARTHEST)
    return (
        min(max(_share(down, area), -most), most),
        min(max(_share(right, area), -most), most),
    )


@inline
def _matrix_of(one: Any) -> tuple[int, int, int, int]:
    return signed(one[MATRIX]), signed(one[MATRIX + 1]), signed(one[MATRIX + 2]), signed(one[MATRIX + 3])


@inline
def _enter_place(records: NDArray[np.int32], n: int) -> None:
    # Where a transferred block shows what the one that it comes from has at its centre, in 1/64 texel.
    one = records[n]
    link = signed(one[LINK])
    down, right = signed(0), signed(0)
    if link >= 0:
        y = signed(one[SOURCE_ROW]) - records[link, SOURCE_ROW]
        x = signed(one[SOURCE_COLUMN]) - records[link, SOURCE_COLUMN]
        down, right = _steps(_matrix_of(one), y, x, 1 << 14, 0)
    one[PLACE], one[PLACE + 1] = 64 * signed(one[ROW]) - down, 64 * signed(one[COLUMN]) - right


@inline
def _guess_place(
    records: NDArray[np.int32], matrices: NDArray[np.int32], margin: int, n: int, beside: int
) -> None:
    # Enters where a transferred block's place is likely, as far from `beside` as both are on the other chart,
    # seen through the warp fields there and here.
    near, link, other = records[beside], records[records[n, LINK]], records[records[beside, LINK]]
    down, right = signed(link[ROW]) - other[ROW], signed(link[COLUMN]) - other[COLUMN]
    v = (signed(link[CENTRE]) + other[CENTRE]) * down + (signed(link[CENTRE + 1]) + other[CENTRE + 1]) * right
    w = (signed(link[CENTRE + 2]) + other[CENTRE + 2]) * down
    w += (signed(link[CENTRE + 3]) + other[CENTRE + 3]) * right
    turn = SYMMETRIES[other[SYMMETRY]]
    y, x = (turn[0] * v + turn[1] * w) >> 6, (turn[2] * v + turn[3] * w) >> 6
    one = records[n]
    down, right = _steps(_matrix_of(near), y, x, 16, 7)
    row, column = (near[PLACE] + down + 32) >> 6, (near[PLACE + 1] + right + 32) >> 6
    m, turn = matrix_at(matrices, margin, row, column), SYMMETRIES[near[SYMMETRY]]
    a, b = near[CENTRE] + m[0], near[CENTRE + 1] + m[1]
    c, d = near[CENTRE + 2] + m[2], near[CENTRE + 3] + m[3]
    turned = (
        turn[0] * a + turn[1] * c,
        turn[0] * b + turn[1] * d,
        turn[2] * a + turn[3] * c,
        turn[2] * b + turn[3] * d,
    )
    down, right = _steps(turned, y, x, 8, 9)
    one[PLACE], one[PLACE + 1] = near[PLACE] + down, near[PLACE + 1] + right


@inline
def _rim_off(border: Any, count: Any, cell: Any) -> Any:
    # How far a border, in 1/64 texel from a block's centre, lies from that of a cell of `count`.
    apart = (border + 64 * ((count * cell) // 2) + 32) % (64 * cell)
    return min(apart, 64 * cell - apart)


@inline
def _size_guess(one: Any, link: Any, cell: int, f: int) -> Any:
    # The rectangle round the other chart's block, seen through both M; one cell more where the borders of
    # cells then lie nearer to those of the other block.
    a, b, c, d = _matrix_of(one)
    p, q, r, s = _matrix_of(link)
    y, x = (d, b) if f == HEIGHT else (c, a)
    tall, wide = abs(y * p - x * r) * signed(link[HEIGHT]), abs(y * q - x * s) * signed(link[WIDTH])
    count = (tall + wide) // max(1, abs(a * d - b * c)) // cell + 6
    area = p * s - q * r
    if f == HEIGHT:
        along, across = s * a - q * c, s * b - q * d
        half, place = 2 * (signed(link[HEIGHT]) // 2) + 1, signed(one[PLACE]) - 64 * signed(one[ROW])
    else:
        along, across = p * d - r * b, p * c - r * a
        half, place = 2 * (signed(link[WIDTH]) // 2) + 1, signed(one[PLACE + 1]) - 64 * signed(one[COLUMN])
    if 2 * abs(along) > abs(across):
        by, number = along >> 4, 32 * half * (area >> 4)
        if by < 0:
            by, number = -by, -number
        if by > 0:
            border = place - _share(number, by)
            if _rim_off(border, count + 1, cell) < _rim_off(border, count, cell):
                count += 1
    return min(count * cell, 4096)


@inline
def _transferred_guess(
    records: NDArray[np.int32],
    matrices: NDArray[np.int32],
    numbers: ChartNumbers,
    n: int,
    beside: int,
    f: int,
) -> Any:
    # What is likely for number f of a transferred block, the ones before it known.
    first, link = n == numbers.base, signed(records[n, LINK])
    guess = signed(0) if first else signed(records[n - 1, f])
    if f == SYMMETRY and numbers.turned and link >= 0:
        guess = signed(records[link, SYMMETRY])
        if beside >= 0:
            guess = signed(_turned_alike(records, link, beside))
    elif f == CUT and first:
        guess = signed(1)
    elif HEIGHT <= f <= WIDTH and link < 0 and first:
        guess = signed(numbers.height if f == HEIGHT else numbers.width)
    elif f >= SOURCE_ROW:
        if link >= 0:
            guess = signed(records[link, f])
            if beside >= 0:
                one, k = records[n], 2 * (f - SOURCE_ROW)
                down, right = 64 * signed(one[ROW]) - one[PLACE], 64 * signed(one[COLUMN]) - one[PLACE + 1]
                guess += (one[MATRIX + k] * down + one[MATRIX + k + 1] * right + 8192) >> 14
            # Sources across a seam are told in quarters of a pixel, unless they must be finer.
            guess = ((guess + 2) >> 2) << 2
        elif not first:
            y, x = going_on(
                records, n - 1, matrices, numbers.margin, signed(records[n, ROW]), signed(records[n, COLUMN])
            )
            guess = y if f == SOURCE_ROW else x
    elif f <= COLUMN:
        if beside >= 0:
            guess = (signed(records[n, PLACE + f]) + 32) >> 6
        elif n - numbers.base > 1:
            guess += guess - records[n - 2, f]
    elif link >= 0 and HEIGHT <= f <= WIDTH:
        guess = _size_guess(records[n], records[link], numbers.mask_cell, f)
    return guess


@inline
def _last_links(
    records: NDArray[np.int32], base: int, first: int, end: int, n: int
) -> tuple[int, int, int, int]:
    # Links of the up to four blocks before `n`, the latest first, as far as they lie in one grid; else -1.
    found = (signed(-1), signed(-1), signed(-1), signed(-1))
    for k in range(4):
        m = n - 1 - k
        link = signed(records[m, LINK]) if m >= base else -1
        if link < first or link >= end:
            break
        if k == 0:
            found = (link, found[1], found[2], found[3])
        elif k == 1:
            found = (found[0], link, found[2], found[3])
        elif k == 2:
            found = (found[0], found[1], link, found[3])
        else:
            found = (found[0], found[1], found[2], link)
    return found


@inline
def _step_guess(last: tuple[int, int, int, int], which: int) -> Any:
    # The step before the last one, which blocks along a seam repeat; the last one; 1. -1: not known.
    guess = signed(-1)
    if which == 0 and last[2] >= 0:
        guess = last[0] + last[1] - last[2]
    elif which == 1 and last[1] >= 0:
        guess = last[0] + last[0] - last[1]
    elif which == 2:
        guess = last[0] + 1
    return guess


@inline
def _code_link(
    coder: BitCoder,
    records: NDArray[np.int32],
    starts: NDArray[np.int64],
    order: int,
    n: int,
    encoding: bool,
) -> int:
    # Which block of a chart before was transferred here: 1, 0 where bytes are missing, -1 if there is none
    # such.
    a = coder.a
    base, target = starts[order], signed(records[n, LINK])
    before = signed(records[n - 1, LINK]) if n > base else -1
    chart = 0  # of the link before, counted back from this one
    if before >= 0:
        chart = 1
        while starts[order - chart] > before:
            chart += 1
        first, end = starts[order - chart], starts[order - chart + 1]
        last = _last_links(records, base, first, end, n)
        usual = 0 if last[3] < 0 else 1 if last[0] - last[1] == last[2] - last[3] else 2
        for which in range(_STEPS):
            guess = _step_guess(last, which)
            asked = first <= guess < end and guess != before
            for other in range(which):
                asked = asked and guess != _step_guess(last, other)
            if not asked:
                continue
            a[CONTEXTS + 0] = START + _RUN + 3 * which + usual
            bit = logged_bit(coder, 1, FLAG_MIXER, encoding, 1 if target == guess else 0)
            if bit < 0:
                return 0
            if bit:
                records[n, LINK] = guess
                return 1
    back = 0
    if encoding and target >= 0:
        back = 1
        while starts[order - back] > target:
            back += 1
    value = code_number(coder, _CHART, 1 if before >= 0 else 0, encoding, back - chart)
    if value == MISSING:
        return 0
    back = value + chart
    if back == 0:
        records[n, LINK] = -1
        return 1
    if back < 0 or back > order:
        return -1
    first = starts[order - back]
    guess = before if back == chart else first
    value = code_number(coder, _INDEX, 1 if back == chart else 0, encoding, target - guess)
    if value == MISSING:
        return 0
    value += guess
    if value < first or value >= starts[order - back + 1]:
        return -1
    records[n, LINK] = value
    return 1


@inline
def _code_centre(
    coder: BitCoder,
    records: NDArray[np.int32],
    matrices: NDArray[np.int32],
    numbers: ChartNumbers,
    n: int,
    encoding: bool,
) -> int:
    # Whether a block has a centre matrix of its own, and by how much it differs from M: 1, 0 where bytes are
    # missing, -1 where it is out of range.
    a = coder.a
    one = records[n]
    a[CONTEXTS + 0] = START + _CENTRED
    bit = logged_bit(coder, 1, FLAG_MIXER, encoding, signed(one[CENTRED]))
    if bit < 0:
        return 0
    m = matrix_at(matrices, numbers.margin, signed(one[ROW]), signed(one[COLUMN]))
    for k in range(4):
        value = signed(0)
        if bit:
            change = (signed(one[CENTRE + k]) - m[k]) // MATRIX_UNIT if encoding else signed(0)
            value = code_number(coder, _OWN_MATRIX, min(k, 1), encoding, change)
            if value == MISSING:
                return 0
        entry = m[k] + MATRIX_UNIT * value
        if bit and abs(entry) > _MOST_MATRIX:
            return -1
        one[CENTRE + k] = entry
    one[CENTRED] = bit
    enter_matrix(records, n)
    return 1


@inline
def _code_number_of(
    coder: BitCoder,
    records: NDArray[np.int32],
    matrices: NDArray[np.int32],
    numbers: ChartNumbers,
    n: int,
    beside: int,
    f: int,
    changed: int,
    encoding: bool,
) -> int:
    # Number f of a block: 2 where it was as guessed, 3 where not, 0 where bytes are missing, -1 where it is
    # out of range.
    guess = _transferred_guess(records, matrices, numbers, n, beside, f)
    value = records[n, f] - guess if encoding else signed(0)
    value = code_number(coder, f if beside >= 0 else _ALONE + f, changed, encoding, value)
    if value == MISSING:
        return 0
    result = 3 if value != 0 else 2
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
        most = 16 * numbers.exemplar_height - 1
    else:
        most = 16 * numbers.exemplar_width - 1
    if value < least or value > most:
        return -1
    records[n, f] = value
    return result


@inline
def _code_numbers(
    coder: BitCoder,
    records: NDArray[np.int32],
    matrices: NDArray[np.int32],
    numbers: ChartNumbers,
    n: int,
    encoding: bool,
) -> int:
    # Returns 1, 0 where bytes are missing, -1 where a number is out of range.
    changed = 0 if records[n, LINK] >= 0 else 2
    beside = _beside(records, numbers.base, n)
    records[n, CHART] = numbers.chart
    for f in _BEFORE:
        if f == ROW and beside >= 0:
            _guess_place(records, matrices, numbers.margin, n, beside)
        done = _code_number_of(coder, records, matrices, numbers, n, beside, f, changed, encoding)
        if done <= 0:
            return done
        changed = (changed & 2) | (done & 1)
    done = _code_centre(coder, records, matrices, numbers, n, encoding)
    if done <= 0:
        return done
    for f in _SOURCE:
        done = _code_number_of(coder, records, matrices, numbers, n, beside, f, changed, encoding)
        if done <= 0:
            return done
        changed = (changed & 2) | (done & 1)
    _enter_place(records, n)
    for f in _BEHIND:
        done = _code_number_of(coder, records, matrices, numbers, n, beside, f, changed, encoding)
        if done <= 0:
            return done
        changed = (changed & 2) | (done & 1)
    records[n, MODE], records[n, AGREES], records[n, SIZE] = NO_MODE, 0, numbers.mask_cell
    return 1


@inline
def code_transferred(
    coder: BitCoder,
    records: NDArray[np.int32],
    starts: NDArray[np.int64],
    order: int,
    matrices: NDArray[np.int32],
    numbers: ChartNumbers,
    n: int,
    encoding: bool,
) -> int:
    """Code a transferred block: 1, 0 where bytes are missing, -1 where a number is out of range."""
    done = _code_link(coder, records, starts, order, n, encoding)
    if done > 0:
        done = _code_numbers(coder, records, matrices, numbers, n, encoding)
    return done
