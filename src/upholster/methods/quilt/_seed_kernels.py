"""Where a block's cut may run, and where it does."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, shared
from upholster.methods._cut_kernels import FREE, NEW, OLD, OUTSIDE, cut_grid
from upholster.methods.quilt._block_kernels import BlockTexels, CutScratch, LayNumbers, squared_difference
from upholster.types import int64, uint64

__all__ = ["cut_block"]

# What texels are, in bits: laid; not to change, for a finished chart shows them or there is no surface;
# beside the surface. Of a cell: some of its texels are so, or bare.
_LAID, _CLOSED, _BESIDE, _BARE = 1, 2, 4, 8


@inline
def _differ(
    image: NDArray[np.int32],
    width: np.int32,
    base: int,
    ys: NDArray[np.int32],
    xs: NDArray[np.int32],
    old: NDArray[np.int32],
    differences: NDArray[np.int32],
) -> None:
    # The squared differences of a row of texels and what is there, laid or not.
    for j in range(differences.shape[0]):
        place = base + (np.int32(ys[j] * width) + xs[j])
        differences[j] = squared_difference(image[uint64(place)], old[j])


@inline
def _compare(
    image: NDArray[np.int32],
    numbers: LayNumbers,
    top: int,
    left: int,
    base: int,
    texels: BlockTexels,
    scratch: CutScratch,
) -> None:
    # Fills `errors`, squared differences between the source at pixel `base` and what is laid, summed over
    # each cell; `marks`, what a cell's texels are; and `missing`, 1 where one is bare and needed.
    cell, sample, differences = numbers.mask_cell, numbers.sample, scratch.differences
    across = numbers.block_width // cell
    for at in range(scratch.errors.shape[0]):
        scratch.errors[at], scratch.missing[at], scratch.marks[at] = 0, 0, 0
    for i in range(numbers.block_height):
        compared = i % sample == 0
        needed = numbers.need_top <= top + i < numbers.need_bottom
        if compared:
            ys, xs = texels.ys[i], texels.xs[i]
            _differ(image, np.int32(numbers.width), base, ys, xs, texels.old[i], differences)
        for b in range(across):
            at, phase = uint64(i // cell * across + b), int64(0)
            for j in range(b * cell, b * cell + cell):
                mark = texels.marks[uint64(i), uint64(j)]
                scratch.marks[at] |= mark
                if mark & _LAID == 0:
                    scratch.marks[at] |= _BARE
                    inside = needed and mark & _BESIDE == 0
                    if inside and numbers.need_left <= left + j < numbers.need_right:
                        scratch.missing[at] = 1
                elif compared and phase == 0:
                    scratch.errors[at] += differences[uint64(j)]
                phase = phase + 1 if phase + 1 < sample else int64(0)


@inline
def _touches_missing(missing: NDArray[np.int32], rows: int, columns: int, a: int, b: int) -> bool:
    # Whether something is missing in one of the cells round a cell.
    found = 0
    for i in range(max(a - 1, 0), min(a + 2, rows)):
        for j in range(max(b - 1, 0), min(b + 2, columns)):
            found |= missing[i * columns + j]
    return found != 0


@inline
def _goes_on(
    covered: NDArray[np.uint8], texels: BlockTexels, cell: int, rows: int, columns: int, a: int, b: int
) -> bool:
    # Whether a cell on the block's rim has something laid right beyond that rim.
    r, c = texels.rows[a * cell + 1], texels.columns[b * cell + 1]
    above, below = texels.rows[0], texels.rows[texels.rows.shape[0] - 1]
    left, right = texels.columns[0], texels.columns[texels.columns.shape[0] - 1]
    found = 0
    if a == 0 and above >= 0:
        found |= covered[above, c]
    if b == 0 and left >= 0:
        found |= covered[r, left]
    if a == rows - 1 and below >= 0:
        found |= covered[below, c]
    if b == columns - 1 and right >= 0:
        found |= covered[r, right]
    return found & 1 != 0


@inline
def _label_seeds(
    covered: NDArray[np.uint8], texels: BlockTexels, cell: int, columns: int, scratch: CutScratch
) -> int:
    # Tells which cells stay old and which become new, whatever it costs; bit 0: some old, bit 1: some new.
    # New is what is bare and missing (then out of the grid), and what is round it, so that feathering never
    # meets bare texels. Old is what a finished chart shows, and the block's rim where its chart goes on.
    marks, missing, seeds = scratch.marks, scratch.missing, scratch.seeds
    rows = seeds.shape[0] // columns
    kinds = 0
    for a in range(rows):
        for b in range(columns):
            at = a * columns + b
            kind = FREE
            if missing[at]:
                kind = OUTSIDE
            elif marks[at] & _BARE:
                # Bare, but where nobody needs it: a finished chart's, or beyond reach. What is needed beside
                # it must not be feathered against it.
                beside = _touches_missing(missing, rows, columns, a, b)
                kind = OLD if marks[at] & _CLOSED and not beside else OUTSIDE
            elif _touches_missing(missing, rows, columns, a, b):
                kind = NEW
            elif marks[at] & _CLOSED or _goes_on(covered, texels, cell, rows, columns, a, b):
                kind = OLD
            seeds[at] = kind
            kinds |= (kind == OLD) | (kind == NEW) << 1
    return kinds


@inline
def _cut(columns: int, scratch: CutScratch, mask: NDArray[np.uint8]) -> Any:
    # The minimum cut between cells held old and new, and what it costs; a step costs 1 at least, to keep it
    # short.
    errors, seeds, residual = scratch.errors, scratch.seeds, scratch.residual
    for at in range(seeds.shape[0]):
        for side in range(4):
            residual[side, at] = 0
    for at in range(seeds.shape[0]):
        if seeds[at] != OUTSIDE:
            if (at + 1) % columns and seeds[at + 1] != OUTSIDE:
                cost = errors[at] + errors[at + 1] + 1
                residual[0, at], residual[2, at + 1] = cost, cost
            below = at + columns
            if below < seeds.shape[0] and seeds[below] != OUTSIDE:
                cost = errors[at] + errors[below] + 1
                residual[1, at], residual[3, below] = cost, cost
    return int64(cut_grid(residual, seeds, columns, scratch.work, mask))


@shared
def cut_block(
    covered: NDArray[np.uint8],
    image: NDArray[np.int32],
    numbers: LayNumbers,
    top: int,
    left: int,
    base: int,
    texels: BlockTexels,
    scratch: CutScratch,
    mask: NDArray[np.uint8],
) -> Any:
    """Cut a block against what is laid, and return what that costs; `mask` receives its new cells.

    `top`, `left` are its first texel, `base` the pixel that its centre reads; the rest as in `lay_blocks`.
    """
    columns = numbers.block_width // numbers.mask_cell
    _compare(image, numbers, top, left, base, texels, scratch)
    kinds = _label_seeds(covered, texels, numbers.mask_cell, columns, scratch)
    both, cost = kinds == 3, int64(0)
    if both:
        cost = _cut(columns, scratch, mask)
    for at in range(mask.shape[0]):
        if scratch.seeds[at] == OUTSIDE:
            mask[at] = 1
        elif not both:  # all new, or nothing but what is bare
            mask[at] = 1 if kinds == 2 else 0
    return cost
