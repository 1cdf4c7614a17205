"""Refining a chart: regions where the cuts cost most get a new source, as far as that makes the cuts cheaper.

For a region, `_look_at` tells what is there, `_list_sources` what may come instead: sources that agree with
what is there, except along cuts that show. Each of them is tried as an expansion move (`_expansion_kernels`);
the best is laid.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.methods.quilt._block_kernels import (
    COLUMN,
    LAID,
    LEFT,
    PHASE,
    ROW,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
    TOP,
    BlockTexels,
    ChartCanvas,
    ChoiceScratch,
    LayNumbers,
    LayScratch,
    LayWeights,
    MatchImage,
    Span,
    pixel_at,
    position_of,
    splat_tent,
)
from upholster.methods.quilt._choice_kernels import first_of, penalise_used, rank_sources
from upholster.methods.quilt._expansion_kernels import (
    CENTRE,
    FINE,
    SAMPLES,
    CellLattice,
    ChartCells,
    ExpansionScratch,
    enter_pairs,
    expand,
    place_shown,
    saved,
    seam_cost,
    settle,
)
from upholster.methods.quilt._lay_kernels import fall, look
from upholster.methods.quilt._phase_kernels import misfit, want_phases
from upholster.quilt._field_kernels import matrix_at
from upholster.types import int64

__all__ = [
    "RefineScratch",
    "RefineWeights",
    "charge_phases",
    "count_uses",
    "enter_source",
    "label_cells",
    "list_hidden",
    "pick_sources",
    "refine_regions",
    "score_regions",
    "weigh_seams",
]

_APART = 3
"""Pixels that two sources tried for a region lie apart at least, one way or the other."""

_LABELS = 64
"""Blocks that a region's change can be booked for."""

_FEW = 4.0
"""Cells by which a place is not yet shown often."""


class RefineWeights(NamedTuple):
    """What regions are chosen and moves are taken by.

    A region whose cuts cost less than `least` is left alone, as is one that can not save `saving`. Along cuts
    that cost more than `shown` a pair of cells, sources need not agree with what is there. `tries` sources
    are tried. A block shows `area` cells. `share` is what a cell pays by its source's phase, in parts of the
    cost of a difference as large; `even` is what it pays, in differences, for a place shown twice as often as
    others. On a mesh `share` is for a source's use as well.
    """

    least: int
    saving: int
    shown: int
    tries: int
    area: float
    share: float
    even: float


class RefineScratch(NamedTuple):
    """Scratch: masks by the cells of a region, `best`, and by squares of them, `squares` and `mask`.

    `tried` (sources,) are those to try, `lost` (`_LABELS`, 2) blocks and how many cells each has lost. `uses`
    (places,) counts the cells of the chart that show each place of the usage grid, and `places` (2, cells)
    are those that a region's cells show, and would show of the source entered last.
    """

    best: NDArray[np.uint8]
    squares: NDArray[np.uint8]
    mask: NDArray[np.uint8]
    tried: NDArray[np.int64]
    lost: NDArray[np.int64]
    uses: NDArray[np.int32]
    places: NDArray[np.int32]

    @classmethod
    def of(cls, lattice: CellLattice, tries: int, places: int) -> "RefineScratch":
        """Return scratch for regions; so many places are in the usage grid."""
        cells = lattice.high * lattice.wide
        return cls(
            np.empty(cells, np.uint8),
            np.empty(cells, np.uint8),
            np.empty(cells, np.uint8),
            np.empty(tries, np.int64),
            np.empty((_LABELS, 2), np.int64),
            np.zeros(places, np.int32),
            np.empty((2, cells), np.int32),
        )


@kernel
def label_cells(
    blocks: NDArray[np.int32], masks: NDArray[np.uint8], lattice: CellLattice, labels: NDArray[np.int32]
) -> None:
    """Tell which block each cell of a chart shows, -1 for none: the last that has its first texel.

    `blocks` (n, 6): row, column, height, width, size of a mask's cells, where its mask begins (-1: none).
    """
    labels[:] = -1
    for n in range(blocks.shape[0]):
        high, wide, size, first = blocks[n, 2], blocks[n, 3], blocks[n, 4], blocks[n, 5]
        top, left = blocks[n, 0] - high // 2 - lattice.top, blocks[n, 1] - wide // 2 - lattice.left
        across = (wide + size - 1) // max(size, 1)
        for i in range(max(-(-top // lattice.cell), 0), min(-(-(top + high) // lattice.cell), lattice.rows)):
            for j in range(
                max(-(-left // lattice.cell), 0), min(-(-(left + wide) // lattice.cell), lattice.columns)
            ):
                at = (i * lattice.cell - top) // max(size, 1) * across
                at += (j * lattice.cell - left) // max(size, 1)
                if first < 0 or masks[first + at]:
                    labels[i, j] = n


@kernel
def weigh_seams(
    canvas: NDArray[np.int32],
    image: NDArray[np.int32],
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    lattice: CellLattice,
    cells: ChartCells,
    laid: NDArray[np.int32],
    part: tuple[int, int, int, int],
    scratch: ExpansionScratch,
) -> None:
    """Enter what the cuts cost, in rows of cells from, to, and columns from, to."""
    for i in range(part[0], part[1]):
        for j in range(part[2], part[3]):
            for way in range(2):
                cost = int64(0)
                if i + way < lattice.rows and j + 1 - way < lattice.columns:
                    cost = seam_cost(
                        canvas,
                        image,
                        matrices,
                        numbers,
                        lattice,
                        cells.labels,
                        laid,
                        (way, i, j),
                        scratch,
                    )
                cells.seams[way, i, j] = cost


@inline
def _score(seams: NDArray[np.int32], lattice: CellLattice, a: Any, b: Any) -> Any:
    # What the cuts in the middle of a region cost.
    total = int64(0)
    for i in range(a + lattice.high // 4, a + lattice.high - lattice.high // 4):
        for j in range(b + lattice.wide // 4, b + lattice.wide - lattice.wide // 4):
            total += seams[0, i, j] + seams[1, i, j]
    return total


@kernel
def score_regions(
    seams: NDArray[np.int32],
    lattice: CellLattice,
    regions: NDArray[np.int32],
    scores: NDArray[np.int64],
) -> None:
    """Write what the cuts in the middle of each region (n, 2), first row and column of cells, cost."""
    for n in range(regions.shape[0]):
        scores[n] = _score(seams, lattice, regions[n, 0], regions[n, 1])


@inline
def _look_at(
    chart: ChartCanvas,
    match: MatchImage,
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    lattice: CellLattice,
    cells: ChartCells,
    laid: NDArray[np.int32],
    region: tuple[Any, Any],
    shown: int,
    texels: BlockTexels,
    scratch: ExpansionScratch,
) -> Any:
    # Reads all that a region shows, and takes the texels along cuts that show for not laid; returns how many
    # pairs of cells have a cut between them.
    cell, pairs = lattice.cell, scratch.pairs
    look(chart, numbers, lattice.top + region[0] * cell, lattice.left + region[1] * cell, texels)
    stride = cell // 2
    for i in range(lattice.high):
        for j in range(lattice.wide):
            n = i * lattice.wide + j
            for s in range(SAMPLES):
                scratch.old[n, s] = texels.old[i * cell + (s >> 1) * stride, j * cell + (s & 1) * stride]
    count = enter_pairs(match.image, matrices, numbers, lattice, cells, laid, region, scratch)
    for p in range(count):
        if scratch.costs[p, 0] > shown:
            i, j = pairs[p, 1] // lattice.wide, pairs[p, 1] % lattice.wide
            down, right = pairs[p, 0], 1 - pairs[p, 0]
            for r in range(i * cell, (i + down + 1) * cell):
                for c in range(j * cell, (j + right + 1) * cell):
                    texels.marks[r, c] = 0
    return count


@inline
def pick_sources(
    choice_kept: NDArray[np.int64],
    judged: NDArray[np.int64],
    stop: int,
    width: int,
    tries: int,
    tried: NDArray[np.int64],
) -> Any:
    """List the best judged sources that lie apart, cheapest first, the first of equals; return how many.

    See `ChoiceScratch` for `choice_kept` and `judged`; `stop` is their end.
    """
    count = int64(0)
    for _ in range(tries):
        best = int64(-1)
        for m in range(2, stop):
            if best >= 0 and judged[m] >= judged[best]:
                continue
            far = True
            for t in range(count):
                rows = abs(choice_kept[m] // width - tried[t] // width)
                columns = abs(choice_kept[m] % width - tried[t] % width)
                far = far and (rows >= _APART or columns >= _APART)
            if far:
                best = m
        if best < 0:
            break
        tried[count] = choice_kept[best]
        count += 1
    return count


@inline
def _use_of(numbers: LayNumbers, across: Any, pixel: Any) -> Any:
    # The place of the usage grid, `across` wide, where a pixel counts.
    return pixel // numbers.width // numbers.usage_step * across + pixel % numbers.width // numbers.usage_step


@inline
def _enter_places(
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    lattice: CellLattice,
    labels: NDArray[np.int32],
    laid: NDArray[np.int32],
    part: tuple[Any, Any, Any, Any],
    across: Any,
    places: NDArray[np.int32],
) -> None:
    # Enters the places of the usage grid that cells show, -1 for none. `part`: the first row and column of
    # cells, and how many rows and columns.
    half = lattice.cell // 2
    for i in range(part[2]):
        for j in range(part[3]):
            a, b = part[0] + i, part[1] + j
            label, n = int64(labels[a, b]), i * part[3] + j
            places[n] = -1
            if label >= 0:
                row, column = lattice.top + a * lattice.cell + half, lattice.left + b * lattice.cell + half
                pixel = place_shown(matrices, numbers, laid, label, row, column)
                places[n] = _use_of(numbers, across, pixel)


@kernel
def count_uses(
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    lattice: CellLattice,
    labels: NDArray[np.int32],
    laid: NDArray[np.int32],
    across: int,
    places: NDArray[np.int32],
    uses: NDArray[np.int32],
) -> None:
    """Add to `uses` how many cells show each place of the usage grid, which is `across` wide.

    `places` (columns,) is scratch.
    """
    for i in range(lattice.rows):
        part = (int64(i), int64(0), int64(1), int64(lattice.columns))
        _enter_places(matrices, numbers, lattice, labels, laid, part, across, places)
        for j in range(lattice.columns):
            if places[j] >= 0:
                uses[places[j]] += 1


@inline
def _unevenness(uses: NDArray[np.int32], place: Any, mean: float) -> Any:
    # How much more often a place is shown than others, from -1 to 2: few cells tell little.
    return min(2.0, (uses[place] - mean) / (mean + _FEW))


@inline
def _pixel_of(laid: NDArray[np.int32], n: Any, numbers: LayNumbers) -> Any:
    # The pixel that a block's centre reads.
    y = min(max(pixel_at(int64(laid[n, SOURCE_ROW]), numbers.level), 0), numbers.height - 1)
    x = min(max(pixel_at(int64(laid[n, SOURCE_COLUMN]), numbers.level), 0), numbers.width - 1)
    return y * numbers.width + x


@inline
def _charge(match: MatchImage, numbers: LayNumbers, weight: float, choice: ChoiceScratch, place: Any) -> Any:
    # What a sample of a source costs by its phase.
    return weight * misfit(match.phases, choice.wanted, place) if match.phases.shape[0] else 0.0


@inline
def enter_source(
    image: NDArray[np.int32],
    lattice: CellLattice,
    numbers: LayNumbers,
    place: Any,
    ys: NDArray[np.int32],
    xs: NDArray[np.int32],
    new: NDArray[np.int32],
) -> None:
    """Enter what a source has in a region's cells, `new`; its texels fall at `ys`, `xs` from `place`."""
    stride = lattice.cell // 2
    for i in range(lattice.high):
        for j in range(lattice.wide):
            n = i * lattice.wide + j
            for s in range(SAMPLES):
                r, c = i * lattice.cell + (s >> 1) * stride, j * lattice.cell + (s & 1) * stride
                new[n, s] = image[place + ys[r, c] * numbers.width + xs[r, c]]


@inline
def _enter_dues(
    numbers: LayNumbers,
    lattice: CellLattice,
    labels: NDArray[np.int32],
    charges: NDArray[np.float64],
    region: tuple[Any, Any],
    place: Any,
    mine: float,
    weights: RefineWeights,
    texels: BlockTexels,
    across: Any,
    scratch: RefineScratch,
    dues: NDArray[np.int64],
) -> None:
    # Enters what it costs cells to stay with what they show, by use and phase, and not to take the source at
    # `place`, whose phase costs `mine`.
    half, places, uses = lattice.cell // 2, scratch.places, scratch.uses
    mean = lattice.rows * lattice.columns / uses.shape[0]
    for i in range(lattice.high):
        for j in range(lattice.wide):
            n, due = i * lattice.wide + j, 0.0
            label = int64(labels[region[0] + i, region[1] + j])
            r, c = i * lattice.cell + half, j * lattice.cell + half
            pixel = place + texels.ys[r, c] * numbers.width + texels.xs[r, c]
            places[1, n] = _use_of(numbers, across, pixel)
            if label >= 0:
                more = _unevenness(uses, places[0, n], mean) - _unevenness(uses, places[1, n], mean)
                due = weights.share * (np.sqrt(SAMPLES * charges[label]) - mine) + weights.even * more
            dues[n] = int64(2 * FINE * due)


@inline
def _lay_source(
    chart: ChartCanvas,
    image: NDArray[np.int32],
    numbers: LayNumbers,
    lattice: CellLattice,
    cells: ChartCells,
    region: tuple[Any, Any],
    place: Any,
    label: Any,
    symmetry: Any,
    mask: NDArray[np.uint8],
    texels: BlockTexels,
) -> None:
    # Copies a source's texels where a mask is new.
    cell = lattice.cell
    for n in range(mask.shape[0]):
        if mask[n] == 0:
            continue
        i, j = n // lattice.wide, n % lattice.wide
        cells.labels[region[0] + i, region[1] + j] = label
        for r in range(i * cell, (i + 1) * cell):
            for c in range(j * cell, (j + 1) * cell):
                a, b = texels.rows[r + 1], texels.columns[c + 1]
                chart.symmetries[a, b] = symmetry
                chart.canvas[a, b] = image[place + texels.ys[r, c] * numbers.width + texels.xs[r, c]]


@inline
def _book(
    usage: NDArray[np.float64],
    numbers: LayNumbers,
    lattice: CellLattice,
    cells: ChartCells,
    laid: NDArray[np.int32],
    region: tuple[Any, Any],
    label: Any,
    area: float,
    span: Span,
    mask: NDArray[np.uint8],
    lost: NDArray[np.int64],
) -> None:
    # Books what a region's new block uses, and what others lose to it: the share of a block that shows.
    count, won = int64(0), int64(0)
    for n in range(mask.shape[0]):
        if mask[n]:
            won += 1
            other = cells.labels[region[0] + n // lattice.wide, region[1] + n % lattice.wide]
            m = int64(0)
            while m < count and lost[m, 0] != other:
                m += 1
            if m == count and count < lost.shape[0]:
                lost[m, 0], lost[m, 1] = other, 0
                count += 1
            if m < count:
                lost[m, 1] += 1
    planes = 0
    for s in range(8):
        planes += numbers.symmetries >> s & 1
    rows = usage.shape[0] // planes
    tall, wide = max(1, span.high_y - span.low_y), max(1, span.high_x - span.low_x)
    for m in range(-1, count):
        one = laid[label] if m < 0 else laid[lost[m, 0]]
        share = won / area if m < 0 else -lost[m, 1] / area
        first = first_of(numbers, int64(one[SYMMETRY]), rows)
        y = pixel_at(int64(one[SOURCE_ROW]), numbers.level)
        x = pixel_at(int64(one[SOURCE_COLUMN]), numbers.level)
        splat_tent(usage[first : first + rows], numbers.usage_step, y, x, tall, wide, share)


@inline
def _try_sources(
    match: MatchImage,
    numbers: LayNumbers,
    lattice: CellLattice,
    cells: ChartCells,
    laid: NDArray[np.int32],
    charges: NDArray[np.float64],
    phase: float,
    weights: RefineWeights,
    region: tuple[Any, Any],
    across: Any,
    cuts: int,
    tries: int,
    texels: BlockTexels,
    choice: ChoiceScratch,
    expansion: ExpansionScratch,
    scratch: RefineScratch,
) -> Any:
    # Tries sources, and writes the best one's mask; returns it, -1 if none saves enough.
    ys, xs = texels.ys, texels.xs
    most, chosen = int64(0), int64(-1)
    for k in range(tries + 1):
        place = scratch.tried[k] if k < tries else chosen
        if place < 0:
            break
        enter_source(match.image, lattice, numbers, place, ys, xs, expansion.new)
        mine = np.sqrt(SAMPLES * _charge(match, numbers, phase, choice, place))
        _enter_dues(
            *(numbers, lattice, cells.labels, charges, region, place, mine, weights, texels, across),
            *(scratch, expansion.dues),
        )
        if k == tries:
            break
        gain = expand(cells, region, lattice, cuts, expansion, scratch.mask)
        if gain > most:
            most, chosen = gain, place
            for n in range(scratch.mask.shape[0]):
                scratch.squares[n] = scratch.mask[n]
    if chosen < 0:
        return chosen
    settle(cells, region, lattice, cuts, expansion, scratch.squares, scratch.best)
    return chosen if saved(lattice, cuts, expansion, scratch.best) >= weights.saving else int64(-1)


@inline
def _enter_block(
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    row: Any,
    column: Any,
    place: Any,
    symmetry: Any,
    phases: NDArray[np.int32],
    block: NDArray[np.int32],
) -> None:
    # Writes a new block's record.
    block[ROW], block[COLUMN], block[LEFT], block[TOP], block[LAID] = row, column, -1, -1, 1
    block[SOURCE_ROW] = position_of(place // numbers.width, numbers.level)
    block[SOURCE_COLUMN] = position_of(place % numbers.width, numbers.level)
    block[SYMMETRY] = symmetry
    for k in range(phases.shape[0]):
        block[PHASE + k] = phases[k]
    centre = matrix_at(matrices, numbers.margin, row, column)
    for k in range(4):
        block[CENTRE + k] = centre[k]


@kernel
def charge_phases(
    match: MatchImage,
    numbers: LayNumbers,
    weight: float,
    laid: NDArray[np.int32],
    count: int,
    choice: ChoiceScratch,
    charges: NDArray[np.float64],
) -> None:
    """Write what a sample of each of the first `count` blocks costs by its phase; `weight` for a misfit."""
    for n in range(count):
        want_phases(match, laid[n, PHASE:], int64(laid[n, SYMMETRY]), choice)
        charges[n] = _charge(match, numbers, weight, choice, _pixel_of(laid, n, numbers))


@kernel
def refine_regions(
    chart: ChartCanvas,
    match: MatchImage,
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    lattice: CellLattice,
    cells: ChartCells,
    laid: NDArray[np.int32],
    charges: NDArray[np.float64],
    lay_weights: LayWeights,
    weights: RefineWeights,
    usage: NDArray[np.float64],
    state: NDArray[np.uint64],
    regions: NDArray[np.int32],
    part: tuple[int, int],
    count: int,
    masks: NDArray[np.uint8],
    scratch: LayScratch,
    expansion: ExpansionScratch,
    refine: RefineScratch,
) -> int:
    """Try the regions from, to, in order; return how many blocks there are then.

    `laid` (blocks, `LAID_COLUMNS`) are those of the chart, `count` at first, with room for one a region;
    `charges` (blocks,) see `charge_phases`; `masks` (regions, cells) those of the blocks that are added.
    `regions` (n, 4): first row and column of cells, then the phases wanted at the centre. `numbers` are those
    of a block as large as a region; the rest as in `lay_blocks`.
    """
    start, texels, choice = laid.shape[0] - masks.shape[0], scratch.texels, scratch.choice
    across = int64(choice.penalties.shape[1])
    for t in range(part[0], part[1]):
        region = (int64(regions[t, 0]), int64(regions[t, 1]))
        if _score(cells.seams, lattice, region[0], region[1]) < weights.least:
            continue
        cuts = _look_at(
            chart,
            match,
            matrices,
            numbers,
            lattice,
            cells,
            laid,
            region,
            weights.shown,
            texels,
            expansion,
        )
        row = lattice.top + region[0] * lattice.cell + numbers.block_height // 2
        column = lattice.left + region[1] * lattice.cell + numbers.block_width // 2
        middle = cells.labels[region[0] + lattice.high // 2, region[1] + lattice.wide // 2]
        symmetry = int64(laid[middle, SYMMETRY]) if middle >= 0 else int64(0)
        if numbers.symmetries >> symmetry & 1 == 0:
            symmetry = int64(0)
        span = fall(matrices, numbers, symmetry, row, column, texels)
        first = first_of(numbers, symmetry, choice.penalties.shape[0])
        penalise_used(usage, first, lay_weights.evenness, choice.penalties)
        want_phases(match, regions[t, 2:], symmetry, choice)
        stop, _ = rank_sources(match, numbers, lay_weights, state, span, texels, choice, 2)
        whole = (region[0], region[1], int64(lattice.high), int64(lattice.wide))
        _enter_places(matrices, numbers, lattice, cells.labels, laid, whole, across, refine.places[0])
        tries = pick_sources(choice.kept, choice.judged, stop, numbers.width, weights.tries, refine.tried)
        chosen = _try_sources(
            match,
            numbers,
            lattice,
            cells,
            laid,
            charges,
            lay_weights.phase,
            weights,
            region,
            across,
            cuts,
            tries,
            texels,
            choice,
            expansion,
            refine,
        )
        if chosen < 0:
            continue
        _enter_block(matrices, numbers, row, column, chosen, symmetry, regions[t, 2:], laid[count])
        charges[count] = _charge(match, numbers, lay_weights.phase, choice, chosen)
        _book(
            *(usage, numbers, lattice, cells, laid, region, count, weights.area, span, refine.best),
            refine.lost,
        )
        _lay_source(
            *(chart, match.image, numbers, lattice, cells, region, chosen, count, symmetry, refine.best),
            texels,
        )
        for n in range(refine.best.shape[0]):
            masks[count - start, n] = refine.best[n]
            if refine.best[n]:
                refine.uses[refine.places[0, n]] -= 1
                refine.uses[refine.places[1, n]] += 1
        count += 1
        around = (
            max(region[0] - 1, 0),
            min(region[0] + lattice.high, lattice.rows),
            max(region[1] - 1, 0),
            min(region[1] + lattice.wide, lattice.columns),
        )
        weigh_seams(chart.canvas, match.image, matrices, numbers, lattice, cells, laid, around, expansion)
    return count


@kernel
def list_hidden(
    blocks: NDArray[np.int32],
    masks: NDArray[np.uint8],
    added: int,
    lattice: CellLattice,
    over: NDArray[np.int32],
    hidden: NDArray[np.uint8],
) -> None:
    """Tell which blocks cannot be seen: later ones cover wholly where they may show, and a cell round it.

    `blocks` as in `label_cells`, of which the last `added` lie on the lattice, each as large as a region.
    `over` (rows, columns) is scratch: the last block that covers each cell wholly, whose mask is new there
    and all round.
    """
    over[:] = -1
    high, wide = lattice.high, lattice.wide
    for n in range(blocks.shape[0] - added, blocks.shape[0]):
        top = (blocks[n, 0] - blocks[n, 2] // 2 - lattice.top) // lattice.cell
        left = (blocks[n, 1] - blocks[n, 3] // 2 - lattice.left) // lattice.cell
        for i in range(high):
            for j in range(wide):
                new: Any = 1
                for a in range(max(i - 1, 0), min(i + 2, high)):
                    for b in range(max(j - 1, 0), min(j + 2, wide)):
                        new &= masks[blocks[n, 5] + a * wide + b]
                if new:
                    over[top + i, left + j] = n
    for n in range(blocks.shape[0]):
        hidden[n] = 1
        size, first = max(blocks[n, 4], 1), blocks[n, 5]
        top, left = blocks[n, 0] - blocks[n, 2] // 2, blocks[n, 1] - blocks[n, 3] // 2
        rows, across = (blocks[n, 2] + size - 1) // size, (blocks[n, 3] + size - 1) // size
        for k in range(rows * across):
            if hidden[n] and (first < 0 or masks[first + k]):
                # The cell and one more all round.
                y, x = (
                    top + (k // across - 1) * size - lattice.top,
                    left + (k % across - 1) * size - lattice.left,
                )
                i0, i1 = max(y // lattice.cell, 0), min((y + 3 * size - 1) // lattice.cell + 1, lattice.rows)
                j0, j1 = (
                    max(x // lattice.cell, 0),
                    min((x + 3 * size - 1) // lattice.cell + 1, lattice.columns),
                )
                for i in range(i0, i1):
                    for j in range(j0, j1):
                        if over[i, j] <= n:
                            hidden[n] = 0
