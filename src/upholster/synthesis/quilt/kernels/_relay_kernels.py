"""Laying again, once all blocks are laid: a block is cut into the middle of a frame where cuts cost much.

Candidates fit the ring around the frame's middle. For each of them a minimum cut chooses which cells become
new: an expansion move, which never raises the cost of all cuts in the frame (Boykov, Veksler, Zabih: Fast
approximate energy minimization via graph cuts, PAMI 23, 2001; for textures Kwatra et al., 2003).
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.quilt.placement import SYMMETRIES
from upholster.runtime.jit import inline, kernel
from upholster.synthesis._cut_kernels import cut_weighted
from upholster.synthesis.quilt.kernels._block_kernels import (
    EITHER,
    MULTIPLIER,
    OUTCOME,
    PHASE,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
    CutScratch,
    FramePixels,
    LayNumbers,
    LayWeights,
    MatchImage,
    squared_difference,
)
from upholster.synthesis.quilt.kernels._choice_kernels import judge_sources, next_best
from upholster.synthesis.quilt.kernels._frame_kernels import (
    BESIDE,
    FIXED,
    LAID,
    Canvases,
    keep_to_course,
    look_at_frame,
)
from upholster.synthesis.quilt.kernels._guide_kernels import is_barred, is_beyond, penalise_off, prefer_cells
from upholster.synthesis.quilt.kernels._lay_kernels import (
    BlockArrays,
    Ground,
    LayScratch,
    bar_folds,
    centre_step,
    find_block,
    list_symmetries,
    turn_frame,
    write_block,
)
from upholster.synthesis.quilt.kernels._phase_kernels import want_phases
from upholster.synthesis.quilt.kernels._sheet_kernels import field_at

__all__ = ["RelayScratch", "cost_steps", "relay_blocks", "sum_around"]

_HELD = int64(2**40)
"""Cost of moving a cell to the other side of the cut if it must stay on its side."""

_CANDIDATES = 4
"""Number of candidates for which a cut is tried."""

_RING = 0.3
"""Width of the ring that candidates must fit, as a fraction of the frame's side."""


class RelayScratch(NamedTuple):
    """Scratch for the cells of a frame.

    `inner`, `right` and `below` are the cost of old cuts inside a cell, and towards the cells to its right
    and below it. `owners` (size, size) are the blocks shown at the frame's pixels, −1 for none. `away` (size,
    size) are the squared differences of a candidate and the old pixels. `marks`
    (size, size) are the frame's marks, `held` the cells that stay old. `best` are the new cells of the best
    candidate, `tried` those of another one.
    """

    inner: NDArray[np.int64]
    right: NDArray[np.int64]
    below: NDArray[np.int64]
    owners: IntArray
    away: NDArray[np.int32]
    marks: NDArray[np.uint8]
    held: NDArray[np.uint8]
    best: NDArray[np.uint8]
    tried: NDArray[np.uint8]

    @classmethod
    def of(cls, numbers: LayNumbers) -> "RelayScratch":
        """Return scratch for frames of the size in `numbers`."""
        cells, shape = (numbers.size // numbers.cell) ** 2, (numbers.size, numbers.size)
        return cls(
            np.zeros(cells, np.int64),
            np.zeros(cells, np.int64),
            np.zeros(cells, np.int64),
            np.zeros(shape, np.int32),
            np.zeros(shape, np.int32),
            np.zeros(shape, np.uint8),
            np.zeros(cells, np.uint8),
            np.zeros(cells, np.uint8),
            np.zeros(cells, np.uint8),
        )


@inline
def _beyond(match: MatchImage, numbers: LayNumbers, source: int, symmetry: int, down: int, right: int) -> Any:
    # The pixel that a block shows `down` and `right` of a step that reads `source`.
    turn = SYMMETRIES[symmetry]
    y = source // numbers.width + turn[0] * down + turn[1] * right
    x = source % numbers.width + turn[2] * down + turn[3] * right
    y, x = min(max(y, 0), numbers.height - 1), min(max(x, 0), numbers.width - 1)
    return match.image[y * numbers.width + x]


@inline
def _cut_between(
    canvases: Canvases,
    match: MatchImage,
    numbers: LayNumbers,
    records: IntArray,
    p: int,
    q: int,
    down: int,
    right: int,
) -> Any:
    # The cost of the cut between two steps, q `down` and `right` pixels from p: what both blocks show there.
    one, other = int64(canvases.sources[p]), int64(canvases.sources[q])
    first, second = records[canvases.owners[p], SYMMETRY], records[canvases.owners[q], SYMMETRY]
    there = _beyond(match, numbers, one, first, down, right)
    here = _beyond(match, numbers, other, second, -down, -right)
    total = squared_difference(match.image[one], here) + squared_difference(match.image[other], there)
    return int64(total)


@kernel
def cost_steps(
    ground: Ground, match: MatchImage, numbers: LayNumbers, records: IntArray, out: FloatArray
) -> None:
    """Write to `out` (steps,) the cost of cuts from each step of the canvases to the next on its chart."""
    canvases = ground.canvases
    owners = canvases.owners
    for k in range(canvases.firsts.shape[0]):
        width = canvases.widths[k]
        for r in range(canvases.heights[k]):
            for c in range(width):
                p = canvases.firsts[k] + r * width + c
                out[p] = 0.0
                for down in range(2):
                    if (r + 1 == canvases.heights[k]) if down else (c + 1 == width):
                        continue
                    q = p + (width if down else 1)
                    if owners[p] < 0 or owners[q] < 0 or owners[p] == owners[q]:
                        continue
                    m = field_at(ground.field, k, float(r), float(c))
                    y, x = (m[0], m[2]) if down else (m[1], m[3])
                    y, x = int64(np.floor(y + 0.5)), int64(np.floor(x + 0.5))
                    out[p] += _cut_between(canvases, match, numbers, records, p, q, y, x)


@kernel
def sum_around(
    canvases: Canvases, costs: FloatArray, roots: FloatArray, reach: NDArray[np.int64], out: FloatArray
) -> None:
    """Write to `out` (n,) the costs of the squares around roots that are 2 · `reach` + 1 steps wide."""
    for n in range(roots.shape[0]):
        k = int64(roots[n, 0])
        row, column, total = int64(roots[n, 1]), int64(roots[n, 2]), 0.0
        width, first = canvases.widths[k], canvases.firsts[k]
        for r in range(max(row - reach[n], 0), min(row + reach[n] + 1, canvases.heights[k])):
            for c in range(max(column - reach[n], 0), min(column + reach[n] + 1, width)):
                total += costs[first + r * width + c]
        out[n] = total


@inline
def _cost_cuts(
    canvases: Canvases,
    match: MatchImage,
    numbers: LayNumbers,
    records: IntArray,
    pixels: FramePixels,
    out: RelayScratch,
) -> Any:
    # Fills `inner`, `right` and `below`; returns their sum.
    size, cell, steps, owners, total = numbers.size, numbers.cell, pixels.steps, out.owners, int64(0)
    across = size // cell
    out.inner[:], out.right[:], out.below[:] = 0, 0, 0
    for i in range(size):
        for j in range(size):
            owners[i, j] = canvases.owners[steps[i, j]] if steps[i, j] >= 0 else -1
    for i in range(size):
        a = i // cell
        ends = (i + 1) % cell == 0
        for b in range(across):
            at, last = a * across + b, b * cell + cell - 1
            for j in range(b * cell, last + 1):
                own = owners[i, j]
                if own < 0:
                    continue
                if j + 1 < size and owners[i, j + 1] != own and owners[i, j + 1] >= 0:
                    cost = _cut_between(canvases, match, numbers, records, steps[i, j], steps[i, j + 1], 0, 1)
                    total += cost
                    if j < last:
                        out.inner[at] += cost
                    else:
                        out.right[at] += cost
                if i + 1 < size and owners[i + 1, j] != own and owners[i + 1, j] >= 0:
                    cost = _cut_between(canvases, match, numbers, records, steps[i, j], steps[i + 1, j], 1, 0)
                    total += cost
                    if ends:
                        out.below[at] += cost
                    else:
                        out.inner[at] += cost
    return total


@inline
def _hold_cells(numbers: LayNumbers, zone: int, pixels: FramePixels, out: RelayScratch) -> None:
    # Marks the cells that stay as they are: on the frame's rim, off the surface, fixed, of another zone.
    cell, across = numbers.cell, numbers.size // numbers.cell
    for a in range(across):
        for b in range(across):
            held = a == 0 or b == 0 or a == across - 1 or b == across - 1
            held = held or is_barred(pixels, zone, cell, a, b)
            for i in range(a * cell, a * cell + cell):
                for j in range(b * cell, b * cell + cell):
                    mark = pixels.marks[i, j]
                    held = held or mark & LAID == 0 or mark & (FIXED | BESIDE) != 0
            out.held[a * across + b] = held


@inline
def _side(numbers: LayNumbers, out: RelayScratch, a: int, b: int, down: int) -> Any:
    # The cost of a cut between old and new along the side of a cell to the right, or below.
    cell, total = numbers.cell, int64(0)
    for k in range(cell):
        i, j = (a * cell + cell - 1, b * cell + k) if down else (a * cell + k, b * cell + cell - 1)
        total += int64(out.away[i, j]) + int64(out.away[i + down, j + 1 - down])
    return total + 1


@inline
def _prefer(match: MatchImage, numbers: LayNumbers, base: int, pixels: FramePixels, cut: CutScratch) -> None:
    # Writes what guides gain by each new cell to `balance`.
    cut.balance[:] = 0
    if match.guides.shape[0]:
        prefer_cells(match, numbers, base, pixels, cut)


@inline
def _expand(
    match: MatchImage,
    numbers: LayNumbers,
    base: int,
    pixels: FramePixels,
    scratch: LayScratch,
    out: RelayScratch,
) -> Any:
    # Chooses the cells that become new with the source at pixel `base`, in `tried`. Returns what all cuts and
    # guides in the frame then cost less.
    size, cut, across = numbers.size, scratch.cut, numbers.size // numbers.cell
    for i in range(size):
        for j in range(size):
            place = base + pixels.ys[i, j] * numbers.width + pixels.xs[i, j]
            is_laid = np.int32(pixels.marks[i, j] & LAID)
            out.away[i, j] = is_laid * squared_difference(match.image[place], pixels.old[i, j])
    _prefer(match, numbers, base, pixels, cut)
    for at in range(cut.balance.shape[0]):
        cut.balance[at] += out.inner[at]
        for side in range(4):
            cut.residual[side, at] = 0
    for a in range(across):
        for b in range(across):
            at = a * across + b
            for down in range(2):
                if (a if down else b) == across - 1:
                    continue
                other = at + (across if down else 1)
                cost = _side(numbers, out, a, b, down)
                old = min(out.below[at] if down else out.right[at], 2 * cost)
                # Kolmogorov, Zabih: What energy functions can be minimized via graph cuts?, PAMI 26 (2004).
                cut.balance[at] += cost
                cut.balance[other] -= cost - old
                cut.residual[1 if down else 0, at] = 2 * cost - old
    for at in range(cut.balance.shape[0]):
        if out.held[at] or is_beyond(numbers, base, pixels, at // across, at % across):
            cut.balance[at] = -_HELD
    cut_weighted(cut.residual, cut.balance, across, cut.work, out.tried)
    return _gained(match, numbers, base, pixels, scratch, out)


@inline
def _gained(
    match: MatchImage,
    numbers: LayNumbers,
    base: int,
    pixels: FramePixels,
    scratch: LayScratch,
    out: RelayScratch,
) -> Any:
    across, gain = numbers.size // numbers.cell, int64(0)
    _prefer(match, numbers, base, pixels, scratch.cut)
    for a in range(across):
        for b in range(across):
            at = a * across + b
            if out.tried[at]:
                gain += scratch.cut.balance[at] + out.inner[at]
            for down in range(2):
                if (a if down else b) == across - 1:
                    continue
                other = at + (across if down else 1)
                old = out.below[at] if down else out.right[at]
                if out.tried[at] != out.tried[other]:
                    gain += old - _side(numbers, out, a, b, down)
                elif out.tried[at]:
                    gain += old
    return gain


@inline
def _fit_ring(numbers: LayNumbers, pixels: FramePixels, out: RelayScratch) -> None:
    # Lets only the ring around the frame's middle count in the search; keeps the marks.
    size, ring = numbers.size, int64(_RING * numbers.size)
    for i in range(size):
        for j in range(size):
            out.marks[i, j] = pixels.marks[i, j]
            if ring <= i < size - ring and ring <= j < size - ring:
                pixels.marks[i, j] = BESIDE


@inline
def _relay_block(
    ground: Ground,
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    blocks: BlockArrays,
    n: int,
    triangles: int,
    scratch: LayScratch,
    out: RelayScratch,
) -> None:
    # Cuts block n into what is laid, if cuts then cost less.
    record, pixels, canvases = blocks.records[n], scratch.pixels, ground.canvases
    choice, size = scratch.choice, numbers.size
    _, bare = look_at_frame(
        canvases,
        match,
        blocks.records,
        scratch.found,
        triangles,
        scratch.inside,
        scratch.covered,
        pixels,
        scratch.symmetries,
    )
    if numbers.course.spare > 0.0:
        _, bare = keep_to_course(numbers, record, scratch.covered, pixels)
    least = int64(weights.relay * size)
    if bare or _cost_cuts(canvases, match, numbers, blocks.records, pixels, out) <= least:
        return
    centre = centre_step(canvases, blocks.roots[n])
    choice.zone[0] = canvases.zones[centre] % EITHER if canvases.zones.shape[0] else 0
    list_symmetries(numbers, scratch)
    symmetry = scratch.tried[0]
    span = turn_frame(numbers, symmetry, pixels)
    choice.penalties[:, :] = 0.0
    penalise_off(match, numbers, span, pixels, choice)
    bar_folds(canvases, numbers, blocks.records, symmetry, pixels, choice)
    want_phases(match, record[PHASE:], symmetry, choice)
    _fit_ring(numbers, pixels, out)
    choice.nearby[0] = 0
    stop = judge_sources(match, numbers, weights, scratch.state, span, pixels, choice)
    for i in range(size):
        for j in range(size):
            pixels.marks[i, j] = out.marks[i, j]
    _hold_cells(numbers, choice.zone[0], pixels, out)
    for _ in range(_CANDIDATES):
        place = next_best(numbers, choice, stop)
        if place < 0:
            break
        gain = _expand(match, numbers, place, pixels, scratch, out)
        if gain > least:
            least = gain
            for at in range(out.best.shape[0]):
                out.best[at] = out.tried[at]
            record[SOURCE_ROW], record[SOURCE_COLUMN] = place // numbers.width, place % numbers.width
            record[SYMMETRY], record[OUTCOME] = symmetry, 1
    if record[OUTCOME]:
        for at in range(out.best.shape[0]):
            scratch.mask[at] = out.best[at]
        write_block(canvases, numbers, blocks, n, scratch.mask, triangles, scratch)


@kernel
def relay_blocks(
    ground: Ground,
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    blocks: BlockArrays,
    part: tuple[int, int],
    seed: np.uint64,
    fits: FloatArray,
    pieces: NDArray[np.int64],
    masks: NDArray[np.uint8],
    stop: NDArray[np.uint8],
    scratch: LayScratch,
    out: RelayScratch,
) -> None:
    """Lay blocks over others, in the range `part`, where that lowers the cost of cuts; see `lay_blocks`."""
    for n in range(part[0], part[1]):
        if stop[0]:
            return
        own = n - part[0]
        scratch.state[0] = seed + np.uint64(own) * np.uint64(MULTIPLIER)
        blocks.records[n, OUTCOME] = 0
        scratch.mask[:] = 0
        count, pieces[own] = find_block(ground, 0.5 * numbers.size, blocks, n, fits[own], scratch)
        _relay_block(ground, match, numbers, weights, blocks, n, count, scratch, out)
        for m in range(masks.shape[1]):
            masks[own, m] = scratch.mask[m]
