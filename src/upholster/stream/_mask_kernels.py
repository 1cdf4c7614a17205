"""Coding the masks of a grid plan: cell by cell, where a decoder cannot know them (SPEC.md, section 5.6).

What is covered already tells most of a mask: nothing can show through a block where nothing lies beneath it.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS, code_bit
from upholster.jit import allocating_kernel, inline
from upholster.stream._bit_kernels import START, BitCoder, signed
from upholster.stream._block_records import AGREES, COLUMN, CUT, HEIGHT, LINK, MATRIX, ROW, SIZE, WIDTH

__all__ = [
    "FREE",
    "HELD",
    "MASK_COUNTERS",
    "MASK_INPUTS",
    "NEXT",
    "Frame",
    "code_masks",
    "cover",
    "frame_of",
    "judge",
    "seen_from",
]

FREE, HELD, NEXT, NEW, UNSEEN = 0, 1, 2, 3, 4
"""What is known of a cell before it is coded; from `NEXT` on it is new."""

_SHAPE, _PLACE, _BAND = 2 * 128 * 8 * 4, 2 * 1024 * 16, 2 * 8 * 8 * 16 * 4
_ODD = _SHAPE + _PLACE + _BAND
MASK_COUNTERS = _ODD + 1
MASK_INPUTS = [3] * 64 + [1]
_ODD_MIXER = 64
_LIMIT = 400


class Frame(NamedTuple):
    """Where a block's cells lie: its first texel and size, its rows and columns of cells, and its window."""

    top: int
    left: int
    height: int
    width: int
    cell: int
    rows: int
    columns: int
    i0: int
    i1: int
    j0: int
    j1: int
    own: bool


@inline
def frame_of(one: Any, window: Any, cell: int, own: bool) -> Frame:
    """Return the frame of a block's record."""
    height, width = signed(one[HEIGHT]), signed(one[WIDTH])
    top, left = signed(one[ROW]) - height // 2, signed(one[COLUMN]) - width // 2
    rows, columns = (height + cell - 1) // cell, (width + cell - 1) // cell
    i0, i1, j0, j1 = signed(window[0]), signed(window[1]), signed(window[2]), signed(window[3])
    return Frame(top, left, height, width, cell, rows, columns, i0, i1, j0, j1, own)


@inline
def _place(f: Frame, i: int, j: int) -> int:
    # Where a cell lies in its window; -1 outside the window, -2 outside the block.
    if i < 0 or j < 0 or i >= f.rows or j >= f.columns:
        return -2
    if i < f.i0 or j < f.j0 or i >= f.i1 or j >= f.j1:
        return -1
    return (i - f.i0) * (f.j1 - f.j0) + j - f.j0


@inline
def _cell_at(mask: NDArray[np.uint8], f: Frame, i: int, j: int) -> Any:
    # What no chart shows counts as new, what lies outside the block as old.
    at = _place(f, i, j)
    return signed(mask[at]) if at >= 0 else signed(2 + at)


@inline
def _known_at(known: NDArray[np.uint8], f: Frame, i: int, j: int) -> Any:
    at = _place(f, i, j)
    return signed(known[at]) if at >= 0 else signed(UNSEEN if at == -1 else FREE)


@inline
def seen_from(
    records: NDArray[np.int32],
    windows: NDArray[np.int32],
    first: NDArray[np.int64],
    cells: NDArray[np.uint8],
    n: int,
    down: int,
    right: int,
) -> Any:
    """Return what the block that a transferred one comes from shows at a point.

    The point is `down` and `right` half texels from the transferred block's centre. 0: it is outside that
    block; where that is old: 1, new: 2; 3: the block comes from none.
    """
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
    f = frame_of(one, windows[link], signed(one[SIZE]), False)
    return 1 + _cell_at(cells[first[link] :], f, row // f.cell, column // f.cell)


@inline
def _bare_or_covered(
    covered: NDArray[np.uint8], f: Frame, known: NDArray[np.uint8], under: NDArray[np.uint8]
) -> None:
    # Marks the cells of an own block that are bare somewhere as new; `under` tells whether a cell's first
    # texel is covered: beyond the chart, all are.
    tall, wide = covered.shape
    for i in range(f.i0, f.i1):
        r0, r1 = f.top + i * f.cell, f.top + min(f.height, (i + 1) * f.cell)
        for j in range(f.j0, f.j1):
            c0, c1 = f.left + j * f.cell, f.left + min(f.width, (j + 1) * f.cell)
            at = _place(f, i, j)
            known[at], under[at] = FREE, 1
            if 0 <= r0 < tall and 0 <= c0 < wide:
                under[at] = covered[r0, c0]
            if f.own:
                for r in range(max(r0, 0), min(r1, tall)):
                    for c in range(max(c0, 0), min(c1, wide)):
                        if covered[r, c] == 0:
                            known[at] = NEW


@inline
def _is_held(covered: NDArray[np.uint8], f: Frame, i: int, j: int) -> bool:
    # Whether a cell on the block's rim has something covered right beyond that rim, in the chart.
    tall, wide = covered.shape
    r, c = f.top + i * f.cell, f.left + j * f.cell
    above, below = i == 0 and r > 0, i == f.rows - 1 and f.top + f.height < tall
    before, behind = j == 0 and c > 0, j == f.columns - 1 and f.left + f.width < wide
    r, c = min(max(r, 0), tall - 1), min(max(c, 0), wide - 1)
    return bool(
        (above and covered[min(max(f.top - 1, 0), tall - 1), c])
        or (below and covered[min(max(f.top + f.height, 0), tall - 1), c])
        or (before and covered[r, min(max(f.left - 1, 0), wide - 1)])
        or (behind and covered[r, min(max(f.left + f.width, 0), wide - 1)])
    )


@inline
def judge(covered: NDArray[np.uint8], f: Frame, known: NDArray[np.uint8], under: NDArray[np.uint8]) -> None:
    """Tell what is known of each cell of a window before it is coded."""
    _bare_or_covered(covered, f, known, under)
    if not f.own:
        return
    for i in range(f.i0, f.i1):
        for j in range(f.j0, f.j1):
            at = _place(f, i, j)
            if known[at] != FREE:
                continue
            for a in range(i - 1, i + 2):
                for b in range(j - 1, j + 2):
                    if _known_at(known, f, a, b) == NEW:
                        known[at] = NEXT
            if known[at] == FREE and _is_held(covered, f, i, j):
                known[at] = HELD


@inline
def _mark(covered: NDArray[np.uint8], r0: int, r1: int, c0: int, c1: int) -> None:
    for r in range(r0, r1):
        for c in range(c0, c1):
            covered[r, c] = 1


@inline
def cover(
    covered: NDArray[np.uint8], f: Frame, mask: NDArray[np.uint8], under: NDArray[np.uint8], whole: bool
) -> None:
    """Cover what a block covers: a whole one its rectangle, an own one too.

    A transferred one covers the cells that are new with all round them new or covered.
    """
    tall, wide = covered.shape
    if whole or f.own:
        r0, r1 = max(f.top, 0), min(f.top + f.height, tall)
        c0, c1 = max(f.left, 0), min(f.left + f.width, wide)
        _mark(covered, r0, r1, c0, c1)
        return
    for i in range(f.i0, f.i1):
        r0, r1 = max(f.top + i * f.cell, 0), min(f.top + min(f.height, (i + 1) * f.cell), tall)
        for j in range(f.j0, f.j1):
            c0, c1 = max(f.left + j * f.cell, 0), min(f.left + min(f.width, (j + 1) * f.cell), wide)
            if r0 >= r1 or c0 >= c1:
                continue
            good = mask[_place(f, i, j)] == 1
            for a in range(i - 1, i + 2):
                for b in range(j - 1, j + 2):
                    at = _place(f, a, b)
                    if at == -2 or (at >= 0 and mask[at] == 0 and under[at] == 0):
                        good = False
            if good:
                _mark(covered, r0, r1, c0, c1)


@inline
def _contexts(
    a: NDArray[np.int32],
    f: Frame,
    mask: NDArray[np.uint8],
    known: NDArray[np.uint8],
    under: NDArray[np.uint8],
    i: int,
    j: int,
    sort: Any,
) -> int:
    # Enters a cell's three contexts; returns its mixer. `sort`: what is known of it from elsewhere.
    west, north = _cell_at(mask, f, i, j - 1), _cell_at(mask, f, i - 1, j)
    north_west, north_east = _cell_at(mask, f, i - 1, j - 1), _cell_at(mask, f, i - 1, j + 1)
    near = west | north << 1 | north_west << 2 | north_east << 3
    shape = near | _cell_at(mask, f, i, j - 2) << 4 | _cell_at(mask, f, i - 2, j) << 5
    shape |= _cell_at(mask, f, i - 1, j + 2) << 6
    sides = 1 if _known_at(known, f, i, j + 1) >= NEXT else 0
    sides |= 2 if _known_at(known, f, i + 1, j) >= NEXT else 0
    sides |= 4 if _known_at(known, f, i + 1, j - 1) >= NEXT else 0
    # How far it is to where everything is new.
    right, down = 0, 0
    while right < 7 and j + right + 1 < f.columns and _known_at(known, f, i, j + right + 1) < NEXT:
        right += 1
    while down < 7 and i + down + 1 < f.rows and _known_at(known, f, i + down + 1, j) < NEXT:
        down += 1
    at, kind = _place(f, i, j), 0 if f.own else 1
    held = 1 if known[at] == HELD or (kind and under[at]) else 0
    a[CONTEXTS + 0] = START + ((kind * 128 + shape) * 8 + sides) * 4 + sort
    spot = min(i, 31) * 32 + min(j, 31)
    a[CONTEXTS + 1] = START + _SHAPE + ((kind * 1024 + spot) * 4 + (near & 3)) * 4 + sort
    a[CONTEXTS + 2] = START + _SHAPE + _PLACE + (((kind * 8 + right) * 8 + down) * 16 + near) * 4 + sort
    return int((kind * 16 + near) * 2 + held)


@inline
def _code_odd(
    coder: BitCoder,
    known: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    encoding: bool,
) -> int:
    # Whether an own block's mask is none of those whose cells over nothing, and next to these, are new.
    a = coder.a
    odd = 0
    if encoding:
        for at in range(mask.shape[0]):
            if known[at] >= NEXT and mask[at] == 0:
                odd = 1
    a[CONTEXTS + 0] = START + _ODD
    return code_bit(coder.state, coder.data, coder.a, 1, _ODD_MIXER, _LIMIT, encoding, odd)


@allocating_kernel
def code_masks(
    coder: BitCoder,
    records: NDArray[np.int32],
    windows: NDArray[np.int32],
    first: NDArray[np.int64],
    cells: NDArray[np.uint8],
    covered: NDArray[np.uint8],
    cell: int,
    first_own: int,
    start: int,
    stop: int,
    place: int,
    encoding: bool,
) -> tuple[int, int]:
    """Code the masks of a chart's blocks from `start` to `stop`; 0 of its cells are behind, or `place` - 1.

    `records` are all blocks, see `_block_records`; the chart's own begin with `first_own`. `windows`
    (blocks, 4) are those of their masks, rows and columns of cells from, to; `first[n]` is where that of
    block n begins in `cells`, if it has a mask. `covered` (rows, columns) tells which texels of the chart the
    blocks before `start` have covered. Returns `start` and `place` to go on with.
    """
    a = coder.a
    most = 1
    for n in range(start, stop):
        most = max(most, (windows[n, 1] - windows[n, 0]) * (windows[n, 3] - windows[n, 2]))
    known, under = np.empty(most, np.uint8), np.empty(most, np.uint8)
    for n in range(start, stop):
        f = frame_of(records[n], windows[n], cell, n >= first_own)
        if not records[n, CUT]:
            cover(covered, f, under, under, True)
            continue
        across = f.j1 - f.j0
        mask = cells[first[n] : first[n] + (f.i1 - f.i0) * across]
        judge(covered, f, known, under)
        odd = 0
        if f.own and place == 0:
            odd = _code_odd(coder, known, mask, encoding)
            if odd < 0:
                return n, 0
        elif f.own:  # kept there when bytes ran out
            odd = signed(mask[0]) >> 1
            mask[0] &= 1
        for at in range(mask.shape[0]):
            if not odd and known[at] >= NEXT:
                mask[at] = 1
        for at in range(max(place - 1, 0), mask.shape[0]):
            if not odd and known[at] >= NEXT:
                continue
            i, j = f.i0 + at // across, f.j0 + at % across
            sort = signed(records[n, AGREES])
            if not f.own:
                down = 2 * (f.top + i * cell - records[n, ROW]) + cell - 1
                right = 2 * (f.left + j * cell - records[n, COLUMN]) + cell - 1
                sort = seen_from(records, windows, first, cells, n, down, right)
            mixer = _contexts(a, f, mask, known, under, i, j, sort)
            bit = code_bit(coder.state, coder.data, coder.a, 3, mixer, _LIMIT, encoding, signed(mask[at]))
            if bit < 0:
                mask[0] |= odd << 1
                return n, at + 1
            mask[at] = bit
        place = 0
        cover(covered, f, mask, under, False)
    return stop, 0
