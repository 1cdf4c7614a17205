"""The cut of a block: the cells where it may run, and the minimum cut itself."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import int64, uint64
from upholster.runtime.jit import inline, shared
from upholster.synthesis._cut_kernels import FREE, NEW, OLD, OUTSIDE, cut_grid, cut_weighted
from upholster.synthesis.quilt.kernels._block_kernels import (
    CutScratch,
    FramePixels,
    LayNumbers,
    MatchImage,
    squared_difference,
)
from upholster.synthesis.quilt.kernels._frame_kernels import BESIDE, FIXED, LAID
from upholster.synthesis.quilt.kernels._guide_kernels import is_barred, is_beyond, prefer_cells

__all__ = ["cut_block"]

_BARE = 4
"""A mark of cells, in addition to the marks of a frame's pixels: some of the cell's pixels show no block."""

_HELD = int64(2**40)
"""Cost of moving a cell to the other side of the cut if it must stay on its side."""


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
    # The squared differences between a row of texels and the pixels there, laid or not.
    for j in range(differences.shape[0]):
        place = base + (np.int32(ys[j] * width) + xs[j])
        differences[j] = squared_difference(image[uint64(place)], old[j])


@inline
def _compare(
    match: MatchImage, numbers: LayNumbers, base: int, pixels: FramePixels, scratch: CutScratch
) -> None:
    # Fills three arrays for cells: `errors`, the sum of squared differences between the source at pixel
    # `base` and the laid pixels; `marks`, the combined marks of the cell's pixels; `missing`, 1 if a pixel is
    # bare.
    image = match.image
    cell, differences = numbers.cell, scratch.differences
    across = numbers.size // cell
    for at in range(scratch.errors.shape[0]):
        scratch.errors[at], scratch.missing[at], scratch.marks[at] = 0, 0, 0
    for i in range(numbers.size):
        _differ(image, np.int32(numbers.width), base, pixels.ys[i], pixels.xs[i], pixels.old[i], differences)
        for b in range(across):
            at = uint64(i // cell * across + b)
            for j in range(b * cell, b * cell + cell):
                mark = pixels.marks[uint64(i), uint64(j)]
                scratch.marks[at] |= mark
                if mark == 0 or mark == BESIDE:
                    scratch.marks[at] |= _BARE
                    if mark == 0:
                        scratch.missing[at] = 1
                else:
                    scratch.errors[at] += differences[uint64(j)]


@inline
def _bar_cells(numbers: LayNumbers, base: int, zone: int, pixels: FramePixels, scratch: CutScratch) -> None:
    # Cells beyond the exemplar, or requested for another zone, stay as they are, old or bare.
    across = numbers.size // numbers.cell
    for at in range(scratch.barred.shape[0]):
        a, b = at // across, at % across
        barred = is_barred(pixels, zone, numbers.cell, a, b)
        scratch.barred[at] = barred or is_beyond(numbers, base, pixels, a, b)
        if scratch.barred[at]:
            scratch.missing[at] = 0


@inline
def _touches_missing(missing: NDArray[np.int32], rows: int, columns: int, a: int, b: int) -> bool:
    # Whether a cell or one of the eight cells around it is missing.
    found = 0
    for i in range(max(a - 1, 0), min(a + 2, rows)):
        for j in range(max(b - 1, 0), min(b + 2, columns)):
            found |= missing[i * columns + j]
    return found != 0


@inline
def _goes_on(covered: NDArray[np.uint8], cell: int, across: int, a: int, b: int) -> bool:
    # Whether a block is laid right outside the frame at a cell on the frame's rim.
    last, r, c = covered.shape[0] - 1, a * cell + 1, b * cell + 1
    found = 0
    if a == 0:
        found |= covered[0, c]
    if b == 0:
        found |= covered[r, 0]
    if a == across - 1:
        found |= covered[last, c]
    if b == across - 1:
        found |= covered[r, last]
    return found & LAID != 0


@inline
def _label_seeds(covered: NDArray[np.uint8], cell: int, across: int, scratch: CutScratch) -> int:
    # Fixes the cells that stay old and those that become new at any cost. Returns bit 0 if some are old, and
    # bit 1 if some are new. Missing cells are new but outside the grid; the cells around them are new. Cells
    # that must not change are old, as is the frame's rim where laid blocks continue beyond it.
    marks, missing, seeds = scratch.marks, scratch.missing, scratch.seeds
    kinds = 0
    for a in range(across):
        for b in range(across):
            at = a * across + b
            kind = FREE
            if missing[at]:
                kind = OUTSIDE
            elif marks[at] & FIXED or (scratch.barred[at] and not marks[at] & _BARE):
                kind = OLD
            elif marks[at] & _BARE:
                # Without a block, but not needed if it is off the surface.
                needed = _touches_missing(missing, across, across, a, b)
                kind = OLD if marks[at] & BESIDE and not needed else OUTSIDE
            elif _touches_missing(missing, across, across, a, b):
                kind = NEW
            elif marks[at] & BESIDE or _goes_on(covered, cell, across, a, b):
                kind = OLD
            seeds[at] = kind
            kinds |= (kind == OLD) | (kind == NEW) << 1
    return kinds


@inline
def _list_steps(columns: int, scratch: CutScratch) -> None:
    # The cost of a cut between two cells is at least 1, to keep the cut short.
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


@inline
def _cut_as_preferred(columns: int, scratch: CutScratch, mask: NDArray[np.uint8]) -> None:
    # The minimum cut where cells prefer a side; no preference moves cells that must stay on their side.
    for at in range(scratch.seeds.shape[0]):
        if scratch.seeds[at] == OUTSIDE:
            scratch.balance[at] = 0
        elif scratch.seeds[at] == OLD:
            scratch.balance[at] = -_HELD
        elif scratch.seeds[at] == NEW:
            scratch.balance[at] = _HELD
    cut_weighted(scratch.residual, scratch.balance, columns, scratch.work, mask)


@shared
def cut_block(
    covered: NDArray[np.uint8],
    match: MatchImage,
    numbers: LayNumbers,
    base: int,
    pixels: FramePixels,
    scratch: CutScratch,
    mask: NDArray[np.uint8],
) -> None:
    """Cut a block along the laid blocks; `mask` receives its new cells.

    `covered` (size + 2, size + 2) are the marks of the frame's pixels and of a rim around it, `base` is the
    pixel that its centre reads. If there are guides, cells prefer the side that fits them better.
    """
    across, guided = numbers.size // numbers.cell, match.guides.shape[0] > 0
    zone = int64(match.allowed[base]) if pixels.zones.shape[0] else int64(0)
    _compare(match, numbers, base, pixels, scratch)
    _bar_cells(numbers, base, zone, pixels, scratch)
    kinds = _label_seeds(covered, numbers.cell, across, scratch)
    both = kinds == 3 or (guided and kinds != 0)
    if both:
        _list_steps(across, scratch)
    if both and guided:
        prefer_cells(match, numbers, base, pixels, scratch)
        _cut_as_preferred(across, scratch, mask)
    elif both:
        cut_grid(scratch.residual, scratch.seeds, across, scratch.work, mask)
    for at in range(mask.shape[0]):
        if scratch.seeds[at] == OUTSIDE:
            mask[at] = 0 if scratch.barred[at] else 1
        elif not both:  # all cells are new, or only the bare ones
            mask[at] = 1 if kinds == 2 else 0
