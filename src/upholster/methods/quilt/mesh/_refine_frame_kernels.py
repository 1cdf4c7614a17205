"""Refining blocks on meshes: in frames over the dearest cuts a new source comes as far as cuts get cheaper.

As on charts (`upholster.methods.quilt._refine_kernels`), but a frame sees what is laid through the map of its
own footprint, on all charts at once: seams between charts do not matter. Two cells of a frame have a cut
between them where the second one's source is not where the first one's goes on.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.methods.quilt._block_kernels import (
    ChoiceScratch,
    LayNumbers,
    LayScratch,
    LayWeights,
    MatchImage,
    Span,
    position_of,
    splat_tent,
)
from upholster.methods.quilt._choice_kernels import penalise_used, rank_sources
from upholster.methods.quilt._expansion_kernels import (
    FINE,
    SAMPLES,
    CellLattice,
    ChartCells,
    ExpansionScratch,
    difference,
    expand,
    saved,
    settle,
)
from upholster.methods.quilt._landmark_kernels import LandmarkUses, penalise_landmarks, shown_landmarks
from upholster.methods.quilt._phase_kernels import misfit, want_phases
from upholster.methods.quilt._refine_kernels import RefineScratch, RefineWeights, enter_source, pick_sources
from upholster.methods.quilt.mesh._frame_kernels import KEPT, Canvases, look_at_frame, write_frame
from upholster.methods.quilt.mesh._unfold_kernels import MeshArrays
from upholster.types import IntArray, int64

__all__ = ["enter_cells", "enter_cuts", "refine_frames"]

_GOES_ON = 1
"""Pixels, each way, by which a source may be off where it goes on: what lies under a frame is resampled."""

_MIDDLE = 4
"""Cuts count for a frame's score but for this part of its side at each border."""


@kernel
def enter_cells(
    marks: NDArray[np.uint8],
    old: NDArray[np.int32],
    lattice: CellLattice,
    cells: ChartCells,
    scratch: ExpansionScratch,
) -> None:
    """Enter what a frame's cells show: `labels` is 0 where a whole cell is laid, -1 elsewhere.

    `held` is 1 on the frame's rim and where it ends beside what is laid. `marks` and `old` (size, size) are
    the frame's pixels, see `BlockTexels`. Where nothing is laid all is free and costs nothing.
    """
    cell = lattice.cell
    stride = cell // 2
    for i in range(lattice.high):
        for j in range(lattice.wide):
            whole, kept, n = True, False, i * lattice.wide + j
            for r in range(i * cell, (i + 1) * cell):
                for c in range(j * cell, (j + 1) * cell):
                    whole &= marks[r, c] & 5 == 1
                    kept |= marks[r, c] == KEPT
            for s in range(SAMPLES):
                scratch.old[n, s] = old[i * cell + (s >> 1) * stride, j * cell + (s & 1) * stride]
            rim = i == 0 or j == 0 or i == lattice.high - 1 or j == lattice.wide - 1
            cells.labels[i, j] = 0 if whole else -1
            cells.held[i, j] = 1 if (rim or kept) and whole else 0


@inline
def _read(
    image: NDArray[np.int32], numbers: LayNumbers, source: Any, down: Any, right: Any, stride: int, out: Any
) -> None:
    # Reads what a source, at a cell's first pixel, has in the cell `down`, `right` pixels away.
    for s in range(SAMPLES):
        y = source // numbers.width + down + (s >> 1) * stride
        x = source % numbers.width + right + (s & 1) * stride
        y, x = min(max(y, 0), numbers.height - 1), min(max(x, 0), numbers.width - 1)
        out[s] = image[y * numbers.width + x]


@kernel
def enter_cuts(
    image: NDArray[np.int32],
    numbers: LayNumbers,
    lattice: CellLattice,
    cells: ChartCells,
    sources: IntArray,
    scratch: ExpansionScratch,
) -> int:
    """List the cuts in a frame, pairs of cells, with what either side has in both; return how many.

    `sources` (size, size) are the exemplar's pixels that the frame's show, row · width + column; `cells` and
    `scratch.old` as `enter_cells` leaves them. `scratch.costs[:, 0]` receives what each cut costs.
    """
    count, cell, pairs = int64(0), lattice.cell, scratch.pairs
    for way in range(2):
        down, right = way * cell, (1 - way) * cell
        for i in range(lattice.high - way):
            for j in range(lattice.wide - 1 + way):
                if cells.labels[i, j] < 0 or cells.labels[i + way, j + 1 - way] < 0:
                    continue
                here = int64(sources[i * cell, j * cell])
                there = int64(sources[i * cell + down, j * cell + right])
                y = there // numbers.width - here // numbers.width - down
                x = there % numbers.width - here % numbers.width - right
                if abs(y) <= _GOES_ON and abs(x) <= _GOES_ON:
                    continue
                n = i * lattice.wide + j
                m = n + lattice.wide if way else n + 1
                theirs, mine = scratch.across[count, 0], scratch.across[count, 1]
                _read(image, numbers, there, -down, -right, cell // 2, theirs)
                _read(image, numbers, here, down, right, cell // 2, mine)
                pairs[count, 0], pairs[count, 1], pairs[count, 2] = way, n, m
                cost = difference(scratch.old[n], theirs) + difference(scratch.old[m], mine)
                scratch.costs[count, 0] = 1 + cost
                count += 1
    return int(count)


@inline
def _score(lattice: CellLattice, count: int, scratch: ExpansionScratch) -> Any:
    # What the cuts in the middle of a frame cost.
    total = int64(0)
    for p in range(count):
        i, j = scratch.pairs[p, 1] // lattice.wide, scratch.pairs[p, 1] % lattice.wide
        rows, columns = lattice.high // _MIDDLE, lattice.wide // _MIDDLE
        if rows <= i < lattice.high - rows and columns <= j < lattice.wide - columns:
            total += scratch.costs[p, 0]
    return total


@inline
def _forget(
    lattice: CellLattice, count: int, shown: Any, scratch: ExpansionScratch, marks: NDArray[np.uint8]
) -> None:
    # Takes the pixels along cuts that show for not laid: sources need not agree with these.
    cell = lattice.cell
    for p in range(count):
        if scratch.costs[p, 0] > shown:
            i, j = scratch.pairs[p, 1] // lattice.wide, scratch.pairs[p, 1] % lattice.wide
            down, right = scratch.pairs[p, 0], 1 - scratch.pairs[p, 0]
            for r in range(i * cell, (i + down + 1) * cell):
                for c in range(j * cell, (j + right + 1) * cell):
                    marks[r, c] = 0


@inline
def _enter_dues(
    match: MatchImage,
    numbers: LayNumbers,
    lattice: CellLattice,
    cells: ChartCells,
    sources: IntArray,
    place: Any,
    weight: float,
    share: float,
    choice: ChoiceScratch,
    dues: NDArray[np.int64],
) -> None:
    # Enters what it costs cells to stay out of phase, less what it costs them to be new. Where the surface
    # wants which phase follows from the centre, as the new source's phases go on.
    for n in range(dues.shape[0]):
        dues[n] = 0
    if match.phases.shape[0] == 0:
        return
    half, mine = numbers.block_height // 2, misfit(match.phases, choice.wanted, place)
    for i in range(lattice.high):
        for j in range(lattice.wide):
            if cells.labels[i, j] < 0:
                continue
            source = int64(sources[i * lattice.cell, j * lattice.cell])
            y = place // numbers.width + i * lattice.cell - half
            x = place % numbers.width + j * lattice.cell - half
            new = min(max(y, 0), numbers.height - 1) * numbers.width + min(max(x, 0), numbers.width - 1)
            for k in range(match.phases.shape[0]):
                choice.wanted[k, 2] += int64(match.phases[k, new]) - int64(match.phases[k, place])
            theirs = misfit(match.phases, choice.wanted, source)
            for k in range(match.phases.shape[0]):
                choice.wanted[k, 2] -= int64(match.phases[k, new]) - int64(match.phases[k, place])
            staying, changing = np.sqrt(SAMPLES * weight * theirs), np.sqrt(SAMPLES * weight * mine)
            dues[i * lattice.wide + j] = int64(2 * FINE * share * (staying - changing))


@inline
def _enter_source(
    image: NDArray[np.int32],
    lattice: CellLattice,
    numbers: LayNumbers,
    cells: ChartCells,
    place: Any,
    scratch: LayScratch,
    expansion: ExpansionScratch,
) -> None:
    # Enters what a source has in a frame's cells; where nothing is laid it costs nothing.
    enter_source(image, lattice, numbers, place, scratch.texels.ys, scratch.texels.xs, expansion.new)
    for i in range(lattice.high):
        for j in range(lattice.wide):
            if cells.labels[i, j] < 0:
                n = i * lattice.wide + j
                for s in range(SAMPLES):
                    expansion.new[n, s] = expansion.old[n, s]


@inline
def _try_sources(
    match: MatchImage,
    numbers: LayNumbers,
    lattice: CellLattice,
    cells: ChartCells,
    sources: IntArray,
    weight: float,
    weights: RefineWeights,
    counts: tuple[Any, Any],
    least: Any,
    scratch: LayScratch,
    expansion: ExpansionScratch,
    refine: RefineScratch,
) -> Any:
    # Tries sources, and writes the best one's mask; returns it, -1 if none saves `least`. `counts` says how
    # many sources and how many cuts there are.
    region, choice = (int64(0), int64(0)), scratch.choice
    most, chosen = int64(0), int64(-1)
    for k in range(counts[0] + 1):
        place = refine.tried[k] if k < counts[0] else chosen
        if place < 0:
            break
        _enter_source(match.image, lattice, numbers, cells, place, scratch, expansion)
        _enter_dues(
            *(match, numbers, lattice, cells, sources, place, weight, weights.share, choice, expansion.dues)
        )
        if k == counts[0]:
            break
        gain = expand(cells, region, lattice, counts[1], expansion, refine.mask)
        if gain > most:
            most, chosen = gain, place
            for n in range(refine.mask.shape[0]):
                refine.squares[n] = refine.mask[n]
    if chosen < 0:
        return chosen
    settle(cells, region, lattice, counts[1], expansion, refine.squares, refine.best)
    return chosen if saved(lattice, counts[1], expansion, refine.best) >= least else int64(-1)


@kernel
def refine_frames(
    mesh: MeshArrays,
    canvases: Canvases,
    match: MatchImage,
    numbers: LayNumbers,
    lay_weights: LayWeights,
    weights: RefineWeights,
    span: Span,
    usage: NDArray[np.float64],
    uses: LandmarkUses,
    state: NDArray[np.uint64],
    before: int,
    part: tuple[int, int],
    footprint: tuple[NDArray[np.int64], IntArray, NDArray[np.float32], IntArray, NDArray[np.uint8]],
    blocks: IntArray,
    masks: NDArray[np.uint8],
    lattice: CellLattice,
    cells: ChartCells,
    covered: NDArray[np.uint8],
    sources: IntArray,
    inside: NDArray[np.uint8],
    scratch: LayScratch,
    expansion: ExpansionScratch,
    refine: RefineScratch,
) -> None:
    """Try the frames from, to, in order.

    As in `lay_frames`, with these differences: `footprint`, `blocks` and `masks` are the frames', the first
    of which is block `before` of all; `numbers` and `span` are those of a block as large as a frame, and
    `weights.saving` is a part in 64 of what cuts in the middle of a frame cost that a move must save.
    """
    firsts, triangles, maps, sheets, misfits = footprint
    choice, size = scratch.choice, numbers.block_height
    for n in range(part[0], part[1]):
        block, mask, first, stop = blocks[n], masks[n], firsts[n], firsts[n + 1]
        block[2] = 0
        laid, _ = look_at_frame(
            *(mesh, canvases, triangles, maps, sheets, misfits, first, stop),
            *(covered, sources, inside, int64(0), False, scratch),
        )
        enter_cells(scratch.texels.marks, scratch.texels.old, lattice, cells, expansion)
        cuts = enter_cuts(match.image, numbers, lattice, cells, sources, expansion)
        score = _score(lattice, cuts, expansion)
        if laid == 0 or score < weights.least:
            continue
        total = int64(0)
        for p in range(cuts):
            total += expansion.costs[p, 0]
        _forget(lattice, cuts, total // max(cuts, 1), expansion, scratch.texels.marks)
        penalise_used(usage, int64(0), lay_weights.evenness, choice.penalties)
        if lay_weights.variety > 0.0:
            penalise_landmarks(uses, numbers.usage_step, before + n, size, size, choice.penalties)
        want_phases(match, block[3:], int64(0), choice)
        end, _ = rank_sources(match, numbers, lay_weights, state, span, scratch.texels, choice, 2)
        tries = pick_sources(choice.kept, choice.judged, end, numbers.width, weights.tries, refine.tried)
        place = _try_sources(
            match,
            numbers,
            lattice,
            cells,
            sources,
            lay_weights.phase,
            weights,
            (tries, cuts),
            max(1, weights.saving * score // 64),
            scratch,
            expansion,
            refine,
        )
        if place < 0:
            continue
        y, x = place // numbers.width, place % numbers.width
        block[0], block[1], block[2] = position_of(y, numbers.level), position_of(x, numbers.level), 1
        won = 0
        for at in range(mask.shape[0]):
            mask[at] = refine.best[at]
            won += mask[at]
        write_frame(
            *(mesh, canvases, match.image, numbers, (y, x), mask),
            *(triangles, maps, sheets, misfits, first, stop),
        )
        splat_tent(usage, numbers.usage_step, y, x, size, size, won / weights.area)
        uses.shown[before + n] = shown_landmarks(uses, y, x, size, size)
