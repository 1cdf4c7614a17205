"""Guides in kernels: the cost of sources that differ from requests, and the preferred sides of cuts."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import int64, uint64
from upholster.runtime.jit import inline
from upholster.synthesis.quilt.kernels._block_kernels import (
    EITHER,
    ChoiceScratch,
    CutScratch,
    FramePixels,
    LayNumbers,
    MatchImage,
    Span,
)

__all__ = ["is_barred", "is_beyond", "penalise_off", "prefer_cells", "show_all"]

_POINTS = 6
"""Number of points each way at which a frame is compared with guides."""


@inline
def _costs_of(match: MatchImage, pixels: FramePixels, place: Any, i: int, j: int) -> Any:
    # The cost, by all guides, of a pixel of the frame that reads a place of the exemplar.
    total = int64(0)
    for k in range(match.guides.shape[0]):
        wanted = int64(pixels.wanted[k, i, j])
        if wanted > 0:
            total += match.costs[k, abs(int64(match.guides[k, place]) - wanted)]
    return total


@inline
def _list_points(
    match: MatchImage, numbers: LayNumbers, k: int, pixels: FramePixels, choice: ChoiceScratch
) -> tuple[Any, Any]:
    # Lists the requests of guide k at some pixels of the frame: the position that each pixel reads, relative
    # to the source, and the requested value. Returns the number of requests, and of all pixels examined.
    stride = max(1, numbers.size // _POINTS)
    first, listed, seen = (numbers.size - 1) % stride // 2, int64(0), int64(0)
    for i in range(first, numbers.size, stride):
        for j in range(first, numbers.size, stride):
            seen += 1
            wanted = pixels.wanted[k, i, j]
            if wanted > 0:
                choice.offsets[listed] = pixels.ys[i, j] * numbers.width + pixels.xs[i, j]
                choice.values[listed] = wanted
                listed += 1
    return listed, seen


@inline
def penalise_off(
    match: MatchImage, numbers: LayNumbers, span: Span, pixels: FramePixels, choice: ChoiceScratch
) -> None:
    """Add to `penalties` the cost of frames that differ from the guides' requests: the mean over some pixels.

    Each place represents the square of places that begins there, clipped to the span. The cost of the best
    place is subtracted from all. Lists of samples are overwritten.
    """
    step, penalties, least = numbers.guide_step, choice.penalties, np.inf
    first_a, last_a = span.first_y // step, min(span.last_y // step, penalties.shape[0] - 1)
    first_b, last_b = span.first_x // step, min(span.last_x // step, penalties.shape[1] - 1)
    for k in range(match.guides.shape[0]):
        listed, seen = _list_points(match, numbers, k, pixels, choice)
        shown, costs, least = match.guides[k], match.costs[k], np.inf
        for a in range(min(first_a, last_a), last_a + 1):
            y = min(max(a * step + step // 2, span.first_y), span.last_y)
            for b in range(min(first_b, last_b), last_b + 1):
                x, total = min(max(b * step + step // 2, span.first_x), span.last_x), int64(0)
                for n in range(listed):
                    place = y * numbers.width + x + choice.offsets[uint64(n)]
                    total += costs[abs(int64(shown[place]) - choice.values[uint64(n)])]
                penalties[a, b] += total / seen
                least = min(least, penalties[a, b])
    if match.guides.shape[0]:
        for a in range(min(first_a, last_a), last_a + 1):
            for b in range(min(first_b, last_b), last_b + 1):
                penalties[a, b] -= least


@inline
def is_beyond(numbers: LayNumbers, base: int, pixels: FramePixels, a: int, b: int) -> Any:
    """Return whether a cell reads beyond the exemplar, in its fringe, with the source at pixel `base`."""
    y, x, fringe, last = base // numbers.width, base % numbers.width, numbers.fringe, numbers.cell - 1
    i, j = a * numbers.cell, b * numbers.cell
    found = False
    for k in range(2):  # opposite corners, since blocks turn by quarters only
        row, column = y + pixels.ys[i + k * last, j + k * last], x + pixels.xs[i + k * last, j + k * last]
        found = found or row < fringe or row >= numbers.height - fringe
        found = found or column < fringe or column >= numbers.width - fringe
    return found


@inline
def is_barred(pixels: FramePixels, zone: int, cell: int, a: int, b: int) -> Any:
    """Return whether most of a cell is requested for another zone; in bands only bare pixels count."""
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
    match: MatchImage, numbers: LayNumbers, base: int, pixels: FramePixels, scratch: CutScratch
) -> None:
    """Write to `balance` the saving in each cell's cost if it is new, with the source at pixel `base`."""
    across = numbers.size // numbers.cell
    for at in range(scratch.balance.shape[0]):
        scratch.balance[at] = 0
        for i in range(at // across * numbers.cell, at // across * numbers.cell + numbers.cell):
            for j in range(at % across * numbers.cell, at % across * numbers.cell + numbers.cell):
                if pixels.marks[i, j] & 1:
                    place = base + pixels.ys[i, j] * numbers.width + pixels.xs[i, j]
                    scratch.balance[at] += pixels.off[i, j] - _costs_of(match, pixels, place, i, j)


@inline
def show_all(
    match: MatchImage, numbers: LayNumbers, base: int, pixels: FramePixels, mask: NDArray[np.uint8]
) -> None:
    """Let a block on bare steps show all its cells, except those beyond the exemplar or of another zone."""
    zone = int64(match.allowed[base]) if pixels.zones.shape[0] else int64(0)
    across = numbers.size // numbers.cell
    for at in range(mask.shape[0]):
        a, b = at // across, at % across
        left_out = is_beyond(numbers, base, pixels, a, b) or is_barred(pixels, zone, numbers.cell, a, b)
        mask[at] = 0 if left_out else 1
