"""Coding the masks of a grid plan: cell by cell, where a decoder cannot know them (SPEC.md, section 5.6).

What is covered already tells most of a mask: nothing can show through a block where nothing lies beneath it.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS, STRETCH_AT, WEIGHTS, code_bit
from upholster.jit import allocating_kernel, inline
from upholster.stream._bit_kernels import START, BitCoder, signed
from upholster.stream._block_records import AGREES, COLUMN, CUT, HEIGHT, LINK, MATRIX, ROW, SIZE, WIDTH
from upholster.types import int64

__all__ = [
    "FREE",
    "HELD",
    "LIKELY",
    "MASK_COUNTERS",
    "MASK_INPUTS",
    "NEXT",
    "Frame",
    "code_masks",
    "cover",
    "frame_of",
    "judge",
    "seen_from",
    "source_of",
]

FREE, HELD, NEXT, NEW, UNSEEN = 0, 1, 2, 3, 4
"""What is known of a cell before it is coded; from `NEXT` on it is new."""

LIKELY = 2
"""In place of a cell that an encoder may tell as it likes: it becomes what costs least."""

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


class Source(NamedTuple):
    """What leads from a transferred block to the one that it comes from: matrices, inverse, and its cells.

    `kind` 0: it comes from none; 1: from a whole one; 2: from one with a mask, which begins with `first`.
    """

    kind: int
    here: tuple[int, int, int, int]
    there: tuple[int, int, int, int]
    area: int
    inverse: float
    frame: Frame
    first: int


@inline
def source_of(
    records: NDArray[np.int32], windows: NDArray[np.int32], first: NDArray[np.int64], n: int
) -> Source:
    """Return where block n comes from."""
    link = signed(records[n, LINK])
    last = max(link, 0)
    one, here = records[last], records[n]
    a, b = signed(one[MATRIX]), signed(one[MATRIX + 1])
    c, d = signed(one[MATRIX + 2]), signed(one[MATRIX + 3])
    area = a * d - b * c
    if area < 0:
        area, a, b, c, d = -area, -a, -b, -c, -d
    area >>= 4
    kind = 0 if link < 0 or area == 0 else 2 if one[CUT] else 1
    frame = frame_of(one, windows[last], max(signed(one[SIZE]), 1), False)
    matrix = (
        signed(here[MATRIX]),
        signed(here[MATRIX + 1]),
        signed(here[MATRIX + 2]),
        signed(here[MATRIX + 3]),
    )
    return Source(kind, matrix, (a, b, c, d), area, 0.5 / max(area, 1), frame, signed(first[last]))


@inline
def _divided(number: int, source: Source) -> Any:
    # number / (2 · area), rounded down, without a division. Beyond 2^53 it is no place in a block anyway.
    quotient = int64(np.floor(number * source.inverse))
    rest = number - quotient * 2 * source.area
    return quotient + (1 if rest >= 2 * source.area else 0) - (1 if rest < 0 else 0)


@inline
def seen_from(source: Source, cells: NDArray[np.uint8], down: int, right: int) -> int:
    """Return what the block that a transferred one comes from shows at a point.

    The point is `down` and `right` half texels from the transferred block's centre. 0: it is outside that
    block; where that is old: 1, new: 2; 3: the block comes from none.
    """
    if source.kind == 0:
        return 3
    here, (a, b, c, d), f = source.here, source.there, source.frame
    y = (here[0] * down + here[1] * right) >> 4
    x = (here[2] * down + here[3] * right) >> 4
    row: int = _divided(d * y - b * x + source.area, source) + f.height // 2
    column = _divided(a * x - c * y + source.area, source) + f.width // 2
    if row < 0 or column < 0 or row >= f.height or column >= f.width:
        return 0
    if source.kind == 1:
        return 2
    return int(1 + _cell_at(cells[source.first :], f, row // f.cell, column // f.cell))


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
    rows, across = f.i1 - f.i0, f.j1 - f.j0
    for i in range(rows):
        down = f.top + (f.i0 + i) * f.cell
        r0, r1 = max(down, 0), min(f.top + min(f.height, (f.i0 + i + 1) * f.cell), tall)
        for j in range(across):
            if mask[i * across + j] == 0:
                continue
            right = f.left + (f.j0 + j) * f.cell
            c0, c1 = max(right, 0), min(f.left + min(f.width, (f.j0 + j + 1) * f.cell), wide)
            if r0 < r1 and c0 < c1 and _is_closed(f, mask, under, i, j):
                _mark(covered, r0, r1, c0, c1)


@inline
def _is_closed(f: Frame, mask: NDArray[np.uint8], under: NDArray[np.uint8], i: int, j: int) -> bool:
    # Whether no cell round one of a window lies outside the block, or is old and bare.
    if f.i0 + i == 0 or f.j0 + j == 0 or f.i0 + i + 1 == f.rows or f.j0 + j + 1 == f.columns:
        return False
    rows, across = f.i1 - f.i0, f.j1 - f.j0
    for a in range(max(i - 1, 0), min(i + 2, rows)):
        for at in range(a * across + max(j - 1, 0), a * across + min(j + 2, across)):
            if mask[at] == 0 and under[at] == 0:
                return False
    return True


@inline
def _hint(f: Frame, known: NDArray[np.uint8], under: NDArray[np.uint8], hints: NDArray[np.int32]) -> None:
    # What a cell's contexts hold that is known before any mask: whether it is held (bit 0), which of the
    # cells beside and below are new (1 to 3), and how far it is to where all is new, along the row (4 to 6)
    # and down (7 to 9).
    rows, across = f.i1 - f.i0, f.j1 - f.j0
    for i in range(rows - 1, -1, -1):
        for j in range(across - 1, -1, -1):
            at = i * across + j
            held = known[at] == HELD or (not f.own and under[at] == 1)
            beside = _known_at(known, f, f.i0 + i, f.j0 + j + 1)
            below = _known_at(known, f, f.i0 + i + 1, f.j0 + j)
            hint = (1 if held else 0) | (2 if beside >= NEXT else 0) | (4 if below >= NEXT else 0)
            if _known_at(known, f, f.i0 + i + 1, f.j0 + j - 1) >= NEXT:
                hint |= 8
            if j + 1 < across and beside < NEXT:
                hint |= (min(6, (hints[at + 1] >> 4) & 7) + 1) << 4
            if i + 1 < rows and below < NEXT:
                hint |= (min(6, hints[at + across] >> 7) + 1) << 7
            hints[at] = hint


@inline
def _surround(f: Frame, mask: NDArray[np.uint8], place: int, shown: NDArray[np.uint8]) -> None:
    # The mask with two cells more on each side: what no chart shows counts as new, what lies outside the
    # block as old. Of the mask itself, what comes before a place.
    across = f.j1 - f.j0
    for i in range(f.i0 - 2, f.i1 + 2):
        for j in range(f.j0 - 2, f.j1 + 2):
            inside = 0 <= i < f.rows and 0 <= j < f.columns
            shown[(i - f.i0 + 2) * (across + 4) + j - f.j0 + 2] = 1 if inside else 0
    for at in range(place):
        shown[(at // across + 2) * (across + 4) + at % across + 2] = mask[at]


@inline
def _contexts(
    a: NDArray[np.int32], f: Frame, shown: NDArray[np.uint8], at: int, hint: Any, spot: int, sort: Any
) -> int:
    # Enters a cell's three contexts; returns its mixer. `at` is where the cell is in `shown`; `spot`, where
    # in its block; `sort`, what is known of it from elsewhere.
    line = f.j1 - f.j0 + 4
    near = signed(shown[at - 1]) | signed(shown[at - line]) << 1
    near |= signed(shown[at - line - 1]) << 2 | signed(shown[at - line + 1]) << 3
    shape = near | signed(shown[at - 2]) << 4 | signed(shown[at - 2 * line]) << 5
    shape |= signed(shown[at - line + 2]) << 6
    sides, right, down = (hint >> 1) & 7, (hint >> 4) & 7, hint >> 7
    kind = 0 if f.own else 1
    a[CONTEXTS + 0] = START + ((kind * 128 + shape) * 8 + sides) * 4 + sort
    a[CONTEXTS + 1] = START + _SHAPE + ((kind * 1024 + spot) * 4 + (near & 3)) * 4 + sort
    a[CONTEXTS + 2] = START + _SHAPE + _PLACE + (((kind * 8 + right) * 8 + down) * 16 + near) * 4 + sort
    return int((kind * 16 + near) * 2 + (hint & 1))


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


@inline
def _likely_bit(a: NDArray[np.int32], mixer: int) -> Any:
    # What a cell's three contexts predict.
    total = int64(0)
    for k in range(3):
        logit = a[STRETCH_AT + (a[a[CONTEXTS + k]] >> 18)]
        total += int64(a[WEIGHTS + 8 * mixer + k]) * logit
    return 1 if total > 0 else 0


class _Scratch(NamedTuple):
    # What is known of the cells of a block, one number a cell; `shown` has a rim of two.
    known: NDArray[np.uint8]
    under: NDArray[np.uint8]
    hints: NDArray[np.int32]
    shown: NDArray[np.uint8]


@inline
def _code_cells(
    coder: BitCoder,
    f: Frame,
    source: Source,
    cells: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    scratch: _Scratch,
    start: int,
    odd: int,
    agrees: int,
    encoding: bool,
) -> int:
    # Codes a mask's cells from `start` on; returns how many are known then.
    known, hints, shown = scratch.known, scratch.hints, scratch.shown
    across, middle_row, middle_column = f.j1 - f.j0, f.height // 2, f.width // 2
    for i in range(start // max(across, 1), f.i1 - f.i0):
        down = 2 * ((f.i0 + i) * f.cell - middle_row) + f.cell - 1
        for j in range(start % across if i == start // across else 0, across):
            at, to = i * across + j, (i + 2) * (across + 4) + j + 2
            if not odd and known[at] >= NEXT:
                continue
            sort = agrees
            if not f.own:
                right = 2 * ((f.j0 + j) * f.cell - middle_column) + f.cell - 1
                sort = seen_from(source, cells, down, right)
            spot = min(f.i0 + i, 31) * 32 + min(f.j0 + j, 31)
            mixer = _contexts(coder.a, f, shown, to, signed(hints[at]), spot, sort)
            told = signed(mask[at])
            if encoding and told == LIKELY:
                told = _likely_bit(coder.a, mixer)
            bit = code_bit(coder.state, coder.data, coder.a, 3, mixer, _LIMIT, encoding, told)
            if bit < 0:
                return at
            mask[at] = shown[to] = bit
    return len(mask)


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
    blocks before `start` have covered. Encoding changes cells that are `LIKELY`.
    Returns `start` and `place` to go on with.
    """
    most, rim = 1, 1
    for n in range(start, stop):
        rows, across = windows[n, 1] - windows[n, 0], windows[n, 3] - windows[n, 2]
        most, rim = max(most, rows * across), max(rim, (rows + 4) * (across + 4))
    known, under = np.empty(most, np.uint8), np.empty(most, np.uint8)
    scratch = _Scratch(known, under, np.empty(most, np.int32), np.empty(rim, np.uint8))
    for n in range(start, stop):
        f = frame_of(records[n], windows[n], cell, n >= first_own)
        if not records[n, CUT]:
            cover(covered, f, under, under, True)
            continue
        mask = cells[first[n] : first[n] + (f.i1 - f.i0) * (f.j1 - f.j0)]
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
        begun = max(place - 1, 0)
        _hint(f, known, under, scratch.hints)
        _surround(f, mask, begun, scratch.shown)
        source, agrees = source_of(records, windows, first, n), signed(records[n, AGREES])
        done = _code_cells(coder, f, source, cells, mask, scratch, begun, odd, agrees, encoding)
        if done < mask.shape[0]:
            mask[0] |= odd << 1
            return n, done + 1
        place = 0
        cover(covered, f, mask, under, False)
    return stop, 0
