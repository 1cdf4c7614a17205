"""What guides ask for: what a source pays whose pixels are off, and which side of a cut they prefer."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline
from upholster.methods.quilt._block_kernels import EITHER, CutScratch, FramePixels, LayNumbers, MatchImage
from upholster.types import int64

__all__ = ["is_barred", "penalise_off", "prefer_cells", "show_all"]

_POINTS = 6
"""A frame is compared with guides at so many points each way."""


@inline
def _costs_of(match: MatchImage, pixels: FramePixels, place: Any, i: int, j: int) -> Any:
    # What a pixel of the frame pays, by all guides, that reads a place of the exemplar.
    total = int64(0)
    for k in range(match.guides.shape[0]):
        wanted = int64(pixels.wanted[k, i, j])
        if wanted > 0:
            total += match.costs[k, abs(int64(match.guides[k, place]) - wanted)]
    return total


@inline
def penalise_off(
    match: MatchImage, numbers: LayNumbers, pixels: FramePixels, penalties: NDArray[np.float64]
) -> None:
    """Add what places cost whose frame is off what guides ask for: the mean over some of its pixels.

    A place stands for the square of places that begins there. What even the best one pays counts for nothing.
    """
    if match.guides.shape[0] == 0:
        return
    half, stride = numbers.usage_step // 2, max(1, numbers.size // _POINTS)
    first, least = (numbers.size - 1) % stride // 2, np.inf
    for a in range(penalties.shape[0]):
        for b in range(penalties.shape[1]):
            row, column = a * numbers.usage_step + half, b * numbers.usage_step + half
            total, count = int64(0), int64(0)
            for i in range(first, numbers.size, stride):
                for j in range(first, numbers.size, stride):
                    y = min(max(row + pixels.ys[i, j], 0), numbers.height - 1)
                    x = min(max(column + pixels.xs[i, j], 0), numbers.width - 1)
                    total += _costs_of(match, pixels, y * numbers.width + x, i, j)
                    count += 1
            mean = total / count
            least = min(least, mean)
            penalties[a, b] += mean
    for a in range(penalties.shape[0]):
        for b in range(penalties.shape[1]):
            penalties[a, b] -= least


@inline
def is_barred(pixels: FramePixels, zone: int, cell: int, a: int, b: int) -> Any:
    """Return whether most of a cell shall be of another zone: near its border, of what is bare alone."""
    if pixels.zones.shape[0] == 0 or zone == 0:
        return False
    other = int64(0)
    for i in range(a * cell, a * cell + cell):
        for j in range(b * cell, b * cell + cell):
            wanted, is_laid = int64(pixels.zones[i, j]), pixels.marks[i, j] & 1
            other += wanted > 0 and wanted % EITHER != zone and (wanted < EITHER or not is_laid)
    return 2 * other > cell * cell


@inline
def prefer_cells(
    match: MatchImage, numbers: LayNumbers, base: int, zone: int, pixels: FramePixels, scratch: CutScratch
) -> None:
    """Write to `balance` by how much each cell is less off if it is new, with the source at pixel `base`.

    That lies in a `zone`; 0: there are none.
    """
    across = numbers.size // numbers.cell
    for at in range(scratch.balance.shape[0]):
        scratch.balance[at] = 0
        for i in range(at // across * numbers.cell, at // across * numbers.cell + numbers.cell):
            for j in range(at % across * numbers.cell, at % across * numbers.cell + numbers.cell):
                if pixels.marks[i, j] & 1:
                    place = base + pixels.ys[i, j] * numbers.width + pixels.xs[i, j]
                    scratch.balance[at] += pixels.off[i, j] - _costs_of(match, pixels, place, i, j)
                    if zone > 0 and pixels.zones[i, j] >= EITHER and pixels.zones[i, j] - EITHER != zone:
                        scratch.balance[at] -= match.pull


@inline
def show_all(
    match: MatchImage, numbers: LayNumbers, base: int, pixels: FramePixels, mask: NDArray[np.uint8]
) -> None:
    """Let a block on nothing show all its cells but those that shall be of another zone."""
    zone = int64(match.allowed[base]) if pixels.zones.shape[0] else int64(0)
    across = numbers.size // numbers.cell
    for at in range(mask.shape[0]):
        mask[at] = 0 if is_barred(pixels, zone, numbers.cell, at // across, at % across) else 1
