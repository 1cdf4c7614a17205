"""Coding the masks of a grid plan: cell by cell, where a decoder cannot know them (SPEC.md, section 5.6).

What is covered already tells most of a mask: nothing can show through a block where nothing lies beneath it,
and nothing is to be seen of what lies beyond the chart.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS, code_bit
from upholster.jit import inline, kernel
from upholster.stream._block_records import AGREES, COLUMN, CUT, HEIGHT, LINK, MATRIX, ROW, SIZE, WIDTH
from upholster.stream._kernels import START, signed

__all__ = ["MASK_COUNTERS", "MASK_INPUTS", "code_masks"]

# What is known of a cell before it is coded.
_FREE, _HELD, _NEXT, _NEW, _UNSEEN = 0, 1, 2, 3, 4

_SHAPE, _PLACE, _BAND = 2 * 128 * 8 * 4, 2 * 1024 * 16, 2 * 8 * 8 * 16 * 4
_PLAIN = _SHAPE + _PLACE + _BAND
MASK_COUNTERS = _PLAIN + 1
MASK_INPUTS = [3] * 64 + [1]
_PLAIN_MIXER = 64
_LIMIT = 400


@inline
def _seen_from(
    records: NDArray[np.int32],
    first: NDArray[np.int64],
    cells: NDArray[np.uint8],
    n: int,
    down: int,
    right: int,
) -> Any:
    # Whether a point, in half texels from a transferred block's centre, is outside the block that it comes
    # from
    # (0), where that was old (1) or new (2); 3: it comes from none.
    link = records[n, LINK]
    if link < 0:
        return 3
    one, here = records[link], records[n]
    a, b = signed(one[MATRIX]), signed(one[MATRIX + 1])
    c, d = signed(one[MATRIX + 2]), signed(one[MATRIX + 3])
    area = a * d - b * c
    y = (here[MATRIX] * down + here[MATRIX + 1] * right) >> 4
    x = (here[MATRIX + 2] * down + here[MATRIX + 3] * right) >> 4
    if area < 0:
        area, y, x = -area, -y, -x
    area >>= 4
    if area == 0:
        return 3
    row = (d * y - b * x + area) // (2 * area) + one[HEIGHT] // 2
    column = (a * x - c * y + area) // (2 * area) + one[WIDTH] // 2
    if row < 0 or column < 0 or row >= one[HEIGHT] or column >= one[WIDTH]:
        return 0
    if not one[CUT]:
        return 2
    cell = signed(one[SIZE])
    across = (one[WIDTH] + cell - 1) // cell
    return 1 + signed(cells[first[link] + row // cell * across + column // cell])


@inline
def _judge(
    covered: NDArray[np.uint8],
    top: int,
    left: int,
    height: int,
    width: int,
    cell: int,
    reach: int,
    own: bool,
    known: NDArray[np.uint8],
    under: NDArray[np.uint8],
) -> None:
    # What is known of each cell; `under` tells whether its first texel is covered: beyond the chart, all are.
    rows, columns = (height + cell - 1) // cell, (width + cell - 1) // cell
    tall, wide = covered.shape
    for i in range(rows):
        r0, r1 = top + i * cell, top + min(height, (i + 1) * cell)
        for j in range(columns):
            c0, c1 = left + j * cell, left + min(width, (j + 1) * cell)
            at = i * columns + j
            known[at], under[at] = _FREE, 1
            if r1 + reach <= 0 or c1 + reach <= 0 or r0 - reach >= tall or c0 - reach >= wide:
                known[at] = _UNSEEN
                continue
            if 0 <= r0 < tall and 0 <= c0 < wide:
                under[at] = covered[r0, c0]
            if own:
                for r in range(max(r0, 0), min(r1, tall)):
                    for c in range(max(c0, 0), min(c1, wide)):
                        if covered[r, c] == 0:
                            known[at] = _NEW
    if not own:
        return
    for i in range(rows):
        for j in range(columns):
            at = i * columns + j
            if known[at] != _FREE:
                continue
            for a in range(max(i - 1, 0), min(i + 2, rows)):
                for b in range(max(j - 1, 0), min(j + 2, columns)):
                    if known[a * columns + b] == _NEW:
                        known[at] = _NEXT
            if known[at] == _FREE:
                r, c = top + i * cell, left + j * cell
                above, below = i == 0 and r > 0, i == rows - 1 and top + height < tall
                before, behind = j == 0 and c > 0, j == columns - 1 and left + width < wide
                r, c = min(max(r, 0), tall - 1), min(max(c, 0), wide - 1)
                if (
                    (above and covered[min(max(top - 1, 0), tall - 1), c])
                    or (below and covered[min(max(top + height, 0), tall - 1), c])
                    or (before and covered[r, min(max(left - 1, 0), wide - 1)])
                    or (behind and covered[r, min(max(left + width, 0), wide - 1)])
                ):
                    known[at] = _HELD


@inline
def _cover(
    covered: NDArray[np.uint8],
    top: int,
    left: int,
    height: int,
    width: int,
    cell: int,
    own: bool,
    cells: NDArray[np.uint8],
    known: NDArray[np.uint8],
    under: NDArray[np.uint8],
) -> None:
    # An own block covers its rectangle; a transferred one each cell that is new with all round it.
    tall, wide = covered.shape
    rows, columns = (height + cell - 1) // cell, (width + cell - 1) // cell
    for i in range(rows):
        r0, r1 = max(top + i * cell, 0), min(top + min(height, (i + 1) * cell), tall)
        for j in range(columns):
            c0, c1 = max(left + j * cell, 0), min(left + min(width, (j + 1) * cell), wide)
            if r0 >= r1 or c0 >= c1:
                continue
            whole = own or cells[i * columns + j] == 1
            if not own and whole:
                for a in range(i - 1, i + 2):
                    for b in range(j - 1, j + 2):
                        if a < 0 or b < 0 or a >= rows or b >= columns:
                            whole = False
                        else:
                            at = a * columns + b
                            if cells[at] == 0 and under[at] == 0:
                                whole = False
            if whole:
                covered[r0:r1, c0:c1] = 1


@kernel
def code_masks(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    records: NDArray[np.int32],
    first: NDArray[np.int64],
    cells: NDArray[np.uint8],
    covered: NDArray[np.uint8],
    transferred: int,
    cell: int,
    feather: int,
    base: int,
    stop: int,
    start: int,
    place: int,
    encoding: bool,
) -> tuple[int, int]:
    """Code the masks of a chart's blocks from `start` on; 0 of its cells are behind, or `place` - 1.

    `records` are all blocks, see `_block_records`; those from `base` to `stop` are the chart's, the first
    `transferred` of them transferred. `first[n]` is where the cells of block n begin in `cells`, if any.
    `covered` (rows, columns) tells which texels of the chart the blocks before `start` have covered. Cells
    that nobody can see become 1. Returns `start` and `place` to go on with.
    """
    most = 0
    for n in range(start, stop):
        count = ((records[n, HEIGHT] + cell - 1) // cell) * ((records[n, WIDTH] + cell - 1) // cell)
        most = max(most, count)
    known, under = np.empty(most, np.uint8), np.empty(most, np.uint8)
    none = np.ones(1, np.uint8)
    for n in range(start, stop):
        height, width = signed(records[n, HEIGHT]), signed(records[n, WIDTH])
        top, left = records[n, ROW] - height // 2, records[n, COLUMN] - width // 2
        rows, columns = (height + cell - 1) // cell, (width + cell - 1) // cell
        own = n >= base + transferred
        if not records[n, CUT]:
            _cover(covered, top, left, height, width, cell, True, none, known, under)
            continue
        mask = cells[first[n] : first[n] + rows * columns]
        # Feathering carries a cell `feather` texels far.
        _judge(covered, top, left, height, width, cell, feather, own, known, under)
        plain = 0
        if own:
            # Whether the mask is none of those whose cells over nothing are new.
            if place == 0:
                if encoding:
                    for at in range(rows * columns):
                        if (known[at] == _NEW or known[at] == _NEXT) and mask[at] == 0:
                            plain = 1
                a[CONTEXTS + 0] = START + _PLAIN
                plain = code_bit(state, data, a, 1, _PLAIN_MIXER, _LIMIT, encoding, plain)
                if plain < 0:
                    return n, 0
            else:
                plain = signed(mask[0]) >> 1
                mask[0] &= 1
        agrees = signed(records[n, AGREES])
        kind = 0 if own else 1
        for at in range(rows * columns):
            if known[at] == _UNSEEN or (not plain and known[at] >= _NEXT):
                mask[at] = 1
        for at in range(max(place - 1, 0), rows * columns):
            if known[at] == _UNSEEN or (not plain and known[at] >= _NEXT):
                continue
            i, j = at // columns, at % columns
            west = signed(mask[at - 1]) if j > 0 else 0
            north = signed(mask[at - columns]) if i > 0 else 0
            north_west = signed(mask[at - columns - 1]) if i > 0 and j > 0 else 0
            north_east = signed(mask[at - columns + 1]) if i > 0 and j + 1 < columns else 0
            far_west = signed(mask[at - 2]) if j > 1 else 0
            far_north = signed(mask[at - 2 * columns]) if i > 1 else 0
            far_east = signed(mask[at - columns + 2]) if i > 0 and j + 2 < columns else 0
            near = west | north << 1 | north_west << 2 | north_east << 3
            shape = near | far_west << 4 | far_north << 5 | far_east << 6
            east = 1 if j + 1 < columns and known[at + 1] >= _NEXT else 0
            south = 1 if i + 1 < rows and known[at + columns] >= _NEXT else 0
            aslant = 1 if i + 1 < rows and j > 0 and known[at + columns - 1] >= _NEXT else 0
            seeds = 1 if known[at] == _HELD or (kind and under[at]) else 0
            # How far it is to where everything is new.
            right, down = 0, 0
            while right < 7 and j + right + 1 < columns and known[at + right + 1] < _NEXT:
                right += 1
            while down < 7 and i + down + 1 < rows and known[at + (down + 1) * columns] < _NEXT:
                down += 1
            if kind:
                agrees = _seen_from(
                    records,
                    first,
                    cells,
                    n,
                    2 * (top + i * cell - records[n, ROW]) + cell - 1,
                    2 * (left + j * cell - records[n, COLUMN]) + cell - 1,
                )
            sides = east + 2 * south + 4 * aslant
            a[CONTEXTS + 0] = START + ((kind * 128 + shape) * 8 + sides) * 4 + agrees
            spot = min(i, 31) * 32 + min(j, 31)
            a[CONTEXTS + 1] = START + _SHAPE + ((kind * 1024 + spot) * 4 + (near & 3)) * 4 + agrees
            a[CONTEXTS + 2] = (
                START + _SHAPE + _PLACE + (((kind * 8 + right) * 8 + down) * 16 + near) * 4 + agrees
            )
            mixer = (kind * 16 + near) * 2 + seeds
            bit = code_bit(state, data, a, 3, mixer, _LIMIT, encoding, signed(mask[at]))
            if bit < 0:
                mask[0] |= plain << 1
                return n, at + 1
            mask[at] = bit
        place = 0
        _cover(covered, top, left, height, width, cell, own, mask, known, under)
    return stop, 0
