"""Coding placements and labels: encoder and decoder are the same loops (SPEC.md, section 5.2)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS
from upholster.jit import allocating_kernel, inline
from upholster.quilt._field_kernels import matrix_between, reading
from upholster.quilt.placement import MOST_MATRIX
from upholster.stream._bit_kernels import (
    MISSING,
    NUMBER_COUNTERS,
    START,
    BitCoder,
    begin,
    code_number,
    logged_bit,
    undo,
)
from upholster.types import int64

__all__ = [
    "CENTRED",
    "COLUMN",
    "COLUMNS",
    "LABEL_COUNTERS",
    "MATRIX",
    "PLACEMENT_COUNTERS",
    "ROW",
    "SOURCE",
    "SYMMETRY",
    "Grid",
    "Named",
    "code_labels",
    "code_placements",
]

ROW, COLUMN, SYMMETRY, CENTRED, MATRIX, SOURCE = 0, 1, 2, 3, 4, 8
"""Columns of a placement's record, in the order in which they are told: row and column of its cell, symmetry,
whether it has a centre matrix of its own; the four numbers of its centre matrix, its own or M at its centre;
row and column of its source."""

COLUMNS = 10

PLACEMENT_COUNTERS = COLUMNS * NUMBER_COUNTERS

_LOOKED_AT = 128
"""Placements before among which the nearest one is looked for."""

_FAR = 16383
"""How far, each way, a placement is followed from its centre, in 1/16 step."""

_CONTEXTS, _PLAIN_BITS = 4096, 20
_NONE, _PLAIN = 6, 7
"""Behind the six candidates of a label: the place of −1, and that of plain bits."""

LABEL_COUNTERS = _CONTEXTS * _PLAIN + _PLAIN_BITS


class Grid(NamedTuple):
    """What placing blocks on a layer of a chart needs to know.

    The grid of cells: steps a side, whether it is moved by half a cell, rows, columns; the margin of the
    chart's warp field; the exemplar's size in pixels; then the powers of 2 of which sources
    and own matrices' numbers are multiples.
    """

    cell: int
    half: int
    rows: int
    columns: int
    margin: int
    height: int
    width: int
    source_bits: int
    matrix_bits: int


class Named(NamedTuple):
    """What the labels of a map may be: the layer, its first placement, and how many it has."""

    layer: int
    first: int
    total: int


@inline
def _centre(grid: Grid, place: int) -> int:
    # Of a row or column of cells, in 1/16 step.
    return int(16 * grid.cell * (int64(place) - 1) + (0 if grid.half else 8 * grid.cell))


@inline
def _nearest_before(placed: NDArray[np.int32], first: int, n: int, row: int, column: int) -> int:
    # Of the last placements the one whose cell is nearest; of several the latest; −1 if there is none.
    found, least = int64(-1), int64(0)
    for k in range(n - 1, max(first, n - _LOOKED_AT) - 1, -1):
        down, right = int64(placed[k, ROW]) - row, int64(placed[k, COLUMN]) - column
        away = down * down + right * right
        if found < 0 or away < least:
            found, least = int64(k), away
    return int(found)


@inline
def _guess_source(
    placed: NDArray[np.int32],
    symmetries: NDArray[np.int64],
    grid: Grid,
    record: NDArray[np.int64],
    near: int,
) -> None:
    # Fills in where the placement `near` reads at a centre, within the exemplar; `record` has the cell, and M
    # at its centre.
    if near < 0:
        record[SOURCE], record[SOURCE + 1] = 8 * (grid.height - 1), 8 * (grid.width - 1)
        return
    one = placed[near]
    m = MATRIX
    centre = (int64(one[m]), int64(one[m + 1]), int64(one[m + 2]), int64(one[m + 3]))
    here = (record[m], record[m + 1], record[m + 2], record[m + 3])
    down = _centre(grid, record[ROW]) - _centre(grid, one[ROW])
    right = _centre(grid, record[COLUMN]) - _centre(grid, one[COLUMN])
    v0, v1 = reading(centre, here, min(_FAR, max(-_FAR, down)), min(_FAR, max(-_FAR, right)))
    s = symmetries[one[SYMMETRY]]
    record[SOURCE] = min(16 * grid.height - 1, max(0, one[SOURCE] + s[0] * v0 + s[1] * v1))
    record[SOURCE + 1] = min(16 * grid.width - 1, max(0, one[SOURCE + 1] + s[2] * v0 + s[3] * v1))


@inline
def _range(grid: Grid, k: int, least_row: int, least_column: int) -> tuple[int, int]:
    # The least and the greatest value of a column.
    if k == ROW:
        return int64(least_row), int64(grid.rows - 1)
    if k == COLUMN:
        return int64(least_column), int64(grid.columns - 1)
    if k == SYMMETRY:
        return int64(0), int64(7)
    if k == CENTRED:
        return int64(0), int64(1)
    if k < SOURCE:
        return int64(-MOST_MATRIX), int64(MOST_MATRIX)
    return int64(0), int64(16 * (grid.height if k == SOURCE else grid.width) - 1)


@allocating_kernel
def code_placements(
    coder: BitCoder,
    placed: NDArray[np.int32],
    matrices: NDArray[np.int32],
    symmetries: NDArray[np.int64],
    grid: Grid,
    span: tuple[int, int, int],
    encoding: bool,
) -> int:
    """Code placements of one layer of a chart.

    Parameters
    ----------
    coder
        Of all placements.
    placed
        (n, COLUMNS) records; an encoder has them.
    matrices
        Of the chart's warp field, see `WarpField.matrices`.
    symmetries
        As in `upholster.quilt.placement`.
    grid
        The layer's.
    span
        The layer's first placement; the first and the end of those to code.
    encoding
        Whether to write.

    Returns
    -------
    int
        The first placement not coded, or −1 − one of which a number is outside what is allowed.
    """
    first, start, stop = span
    kept = np.empty_like(coder.state)
    record = np.zeros(COLUMNS, np.int64)
    for n in range(start, stop):
        begin(coder, kept)
        row, column = int64(0), int64(-1)  # of the placement before
        if n > first:
            row, column = int64(placed[n - 1, ROW]), int64(placed[n - 1, COLUMN])
        record[ROW], record[COLUMN], record[SYMMETRY], record[CENTRED] = row, 0, 0, 0
        changed = int64(0)
        for k in range(COLUMNS):
            if k == COLUMN:
                record[COLUMN] = column + 1 if record[ROW] == row else 0
            if MATRIX <= k < SOURCE and record[CENTRED] == 0:
                continue
            if k == SYMMETRY:
                near = _nearest_before(placed, first, n, record[ROW], record[COLUMN])
                row_at, column_at = _centre(grid, record[ROW]), _centre(grid, record[COLUMN])
                here = matrix_between(matrices, grid.margin, row_at, column_at)
                for m in range(4):
                    record[MATRIX + m] = here[m]
                _guess_source(placed, symmetries, grid, record, near)
                if near >= 0:
                    record[SYMMETRY] = placed[near, SYMMETRY]
            low, high = _range(grid, k, row, record[COLUMN])
            bits = int64(0) if k < MATRIX else grid.matrix_bits if k < SOURCE else grid.source_bits
            guess = (record[k] + ((1 << bits) >> 1)) >> bits
            rest = code_number(coder, k, changed, encoding, (placed[n, k] >> bits) - guess if encoding else 0)
            if rest == MISSING:
                undo(coder, kept)
                return n
            changed = (2 * changed + (1 if rest != 0 else 0)) & 3
            record[k] = (guess + rest) << bits
            if record[k] < low or record[k] > high:
                return -1 - n
        for k in range(COLUMNS):
            placed[n, k] = record[k]
    return stop


@inline
def _at(labels: NDArray[np.int32], i: int, j: int) -> int:
    # A label that is known; −2 outside the map.
    if i < 0 or j < 0 or j >= labels.shape[1]:
        return -2
    return int(labels[i, j])


class _Guesses(NamedTuple):
    """What a label may be, by place, and the context in which that is asked."""

    west: int
    north: int
    nearest: int
    north_east: int
    right: int
    below: int
    context: int


@inline
def _guesses(labels: NDArray[np.int32], nearest: NDArray[np.int32], i: int, j: int) -> _Guesses:
    w, n, nw = _at(labels, i, j - 1), _at(labels, i - 1, j), _at(labels, i - 1, j - 1)
    ne, ww, nn = _at(labels, i - 1, j + 1), _at(labels, i, j - 2), _at(labels, i - 2, j)
    v = int64(nearest[i, j])
    right = int64(nearest[i, min(j + 2, nearest.shape[1] - 1)])
    below = int64(nearest[min(i + 2, nearest.shape[0] - 1), j])
    context = (w == n) | (w == nw) << 1 | (n == ne) << 2 | (v == w) << 3 | (v == n) << 4 | (w == ww) << 5
    context |= (n == nn) << 6 | (n == nw) << 7 | (right == w) << 8 | (below == w) << 9
    context |= (right == n) << 10 | (below == n) << 11
    return _Guesses(w, n, v, ne, right, below, int64(context))


@inline
def _is(coder: BitCoder, place: int, context: int, encoding: bool, bit: bool) -> int:
    # Whether the label is the candidate of a place.
    coder.a[CONTEXTS + 0] = START + _CONTEXTS * place + context
    return logged_bit(coder, 1, place, encoding, 1 if bit else 0)


@inline
def _plain_label(coder: BitCoder, named: Named, encoding: bool, label: int) -> int:
    bits, found = int64(0), int64(0)
    while (named.total - 1) >> bits:
        bits += 1
    for b in range(bits - 1, -1, -1):
        coder.a[CONTEXTS + 0] = START + _CONTEXTS * _PLAIN + b
        bit = logged_bit(coder, 1, _PLAIN, encoding, (label - named.first) >> b & 1)
        if bit < 0:
            return MISSING
        found = 2 * found + bit
    return int(named.first + found)


@inline
def _code_label(
    coder: BitCoder,
    labels: NDArray[np.int32],
    nearest: NDArray[np.int32],
    named: Named,
    i: int,
    j: int,
    encoding: bool,
) -> int:
    guesses, label = _guesses(labels, nearest, i, j), int64(labels[i, j])
    if named.layer > 0:
        bit = _is(coder, _NONE, guesses.context, encoding, label < 0)
        if bit != 0:
            return -1 if bit > 0 else MISSING
    candidates = guesses[:_NONE]
    for place in range(_NONE):
        told = candidates[place] < 0
        for before in range(place):
            told |= candidates[before] == candidates[place]
        if told:
            continue
        bit = _is(coder, place, guesses.context, encoding, label == candidates[place])
        if bit != 0:
            return candidates[place] if bit > 0 else MISSING
    return _plain_label(coder, named, encoding, label)


@allocating_kernel
def code_labels(
    coder: BitCoder,
    labels: NDArray[np.int32],
    nearest: NDArray[np.int32],
    named: Named,
    start: int,
    stop: int,
    encoding: bool,
) -> int:
    """Code cells [start, stop) of a label map, in raster order.

    Parameters
    ----------
    coder
        Of all labels.
    labels, nearest
        (rows, columns): the map, which an encoder has, and that of the nearest placements.
    named
        What labels may be.
    start, stop
        Which cells.
    encoding
        Whether to write.

    Returns
    -------
    int
        The first cell not coded, or −1 − one whose label is outside what is allowed.
    """
    kept = np.empty_like(coder.state)
    for place in range(start, stop):
        begin(coder, kept)
        i, j = place // labels.shape[1], place % labels.shape[1]
        label = _code_label(coder, labels, nearest, named, i, j, encoding)
        if label == MISSING:
            undo(coder, kept)
            return place
        if label >= named.first + named.total:
            return -1 - place
        labels[i, j] = label
    return stop
