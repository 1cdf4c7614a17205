"""Coding the sources of a strip plan (SPEC.md, section 5.2)."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS
from upholster.jit import allocating_kernel, inline
from upholster.stream._bit_kernels import HASHED, MISSING, START, BitCoder, begin, hash_of, logged_bit, undo
from upholster.types import int64

__all__ = ["SOURCE_COUNTERS", "CandidateGrid", "Run", "code_sources"]

SOURCE_COUNTERS = 256 + 4096 + 3 * HASHED
_TREE = 256
_HASHES = _TREE + 4096


class CandidateGrid(NamedTuple):
    """The exemplar's candidates in raster order, and how many of them apart blocks lie."""

    rows: int
    columns: int
    step: int


class Run(NamedTuple):
    """Blocks in raster order: the first one, how many lie side by side, and 1 for blocks along an edge."""

    first: int
    across: int
    strip: int


class Beside(NamedTuple):
    """Candidates of the left and upper neighbours, what would continue them, and their modes; -1: none."""

    left: int
    top: int
    left_on: int
    top_on: int
    modes: int


@inline
def _beside(
    chosen: NDArray[np.int32], modes: NDArray[np.uint8], n: int, run: Run, grid: CandidateGrid
) -> Beside:
    left, top, left_on, top_on = int64(-1), int64(-1), int64(-1), int64(-1)
    left_mode, top_mode = int64(3), int64(3)
    if (n - run.first) % run.across:
        left, left_mode = int64(chosen[n - 1]), int64(modes[n - 1])
        if left % grid.columns + grid.step < grid.columns:
            left_on = left + grid.step
    if n - run.first >= run.across:
        top, top_mode = int64(chosen[n - run.across]), int64(modes[n - run.across])
        if top + grid.step * grid.columns < grid.rows * grid.columns:
            top_on = top + grid.step * grid.columns
    return Beside(left, top, left_on, top_on, left_mode * 4 + top_mode)


@inline
def _code_continued(
    coder: BitCoder, beside: Beside, strip: int, encoding: bool, target: int
) -> tuple[int, int]:
    # Whether a block continues a neighbour's source: which candidate that is, and its mode; -1, 0 if it does
    # not, MISSING where bytes are.
    a = coder.a
    agree = 1 if beside.left_on == beside.top_on else 0
    for side in range(2):
        guess = beside.top_on if side else beside.left_on
        if guess < 0 or (side == 1 and agree):
            continue
        a[CONTEXTS + 0] = START + 128 * strip + (side * 16 + beside.modes) * 2 + agree
        a[CONTEXTS + 1] = START + _HASHES + HASHED + hash_of(beside.left, beside.top, 5000 + side)
        same = 1 if target == guess else 0
        bit = logged_bit(coder, 2, 10 * strip + side, encoding, same)
        if bit < 0:
            return MISSING, 0
        if bit:
            return guess, side + 1
    return -1, 0


@inline
def _bits_for(count: int) -> Any:
    bits = int64(0)
    while (1 << bits) < count:
        bits += 1
    return bits


@inline
def _code_number(
    coder: BitCoder, beside: Beside, strip: int, axis: int, row: int, count: int, encoding: bool, target: int
) -> Any:
    # A candidate's row (axis 0), or its column where the row is known: highest bits first.
    a = coder.a
    mixer = 10 * strip + 2 + 4 * axis + (1 if beside.left_on >= 0 else 0) + (2 if beside.top_on >= 0 else 0)
    node, length = int64(1), _bits_for(count)
    for b in range(length - 1, -1, -1):
        place = node + 4096 * (1 + row) if axis else node
        a[CONTEXTS + 0] = START + _TREE + 2048 * axis + (node & 2047)
        a[CONTEXTS + 1] = START + _HASHES + hash_of(place, beside.left + 1, strip)
        a[CONTEXTS + 2] = START + _HASHES + HASHED + hash_of(place, beside.top + 1, 7 + strip)
        a[CONTEXTS + 3] = START + _HASHES + 2 * HASHED + hash_of(place, beside.left + 1, beside.top + 19)
        bit = logged_bit(coder, 4, mixer, encoding, (target >> b) & 1)
        if bit < 0:
            return MISSING
        node = 2 * node + bit
    return node - (1 << length)


@allocating_kernel
def code_sources(
    coder: BitCoder,
    chosen: NDArray[np.int32],
    modes: NDArray[np.uint8],
    part: tuple[int, int],
    run: Run,
    grid: CandidateGrid,
    encoding: bool,
) -> int:
    """Code the candidates `chosen` of some blocks of a run, from, to.

    `modes`: 1 where a block continues its left neighbour's source, 2 the upper one's. Returns the index of
    the first not coded, or -1 - index of one that is out of range.
    """
    kept = np.empty_like(coder.state)
    for n in range(part[0], part[1]):
        begin(coder, kept)
        beside = _beside(chosen, modes, n, run, grid)
        target = int64(chosen[n]) if encoding else int64(0)
        found, mode = _code_continued(coder, beside, run.strip, encoding, target)
        if found == -1:
            row, column = target // grid.columns, target % grid.columns
            row = _code_number(coder, beside, run.strip, 0, 0, grid.rows, encoding, row)
            found = row
            if row != MISSING:
                column = _code_number(coder, beside, run.strip, 1, row, grid.columns, encoding, column)
                found = column if column == MISSING else row * grid.columns + column
            if found != MISSING and (row >= grid.rows or column >= grid.columns):
                return -1 - n
        if found == MISSING:
            undo(coder, kept)
            return n
        chosen[n], modes[n] = found, mode
    return part[1]
