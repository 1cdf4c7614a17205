"""Refining a chart that is laid: where its cuts cost most, further blocks are laid over them.

A region of the chart takes another source as far as that makes its cuts cheaper: one block more, with a cut
mask (`_refine_kernels`). What cannot be seen any more is left out.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._block_kernels import (
    COLUMN,
    PHASE,
    ROW,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
    ChartCanvas,
    LayNumbers,
    LayScratch,
    LayWeights,
)
from upholster.methods.quilt._expansion_kernels import (
    CENTRE,
    LAID_COLUMNS,
    SAMPLES,
    CellLattice,
    ChartCells,
    ExpansionScratch,
)
from upholster.methods.quilt._refine_kernels import (
    RefineScratch,
    RefineWeights,
    charge_phases,
    count_uses,
    label_cells,
    list_hidden,
    refine_regions,
    score_regions,
    weigh_seams,
)
from upholster.methods.quilt.grid import BlockGrid
from upholster.methods.quilt.masked import BLOCK, step_matrices
from upholster.methods.quilt.match_pyramid import MatchLevel
from upholster.methods.quilt.phases import Phases
from upholster.methods.quilt.transfer import ChartPlacements
from upholster.types import FloatArray, IntArray

__all__ = ["LaidChart", "refine_chart"]

_REGION = (3.0, 2.5, 2.5)
"""Side of a region, in blocks: the cut needs room between what does not fit and the region's rim. With an
effort of 1 flat and on a surface, where blocks are more of the stream; with more."""

_REGION_IN_STEP = 2.0
"""The same where courses are stretched: inside a region they are not, so that its rim falls out of step."""

_STEPS = (3, 2, 3)
"""Regions that begin within one's side, each way, in the same cases."""

_SHORTLIST, _TRIES = 12, 1
"""Sources that are compared with a region at full resolution, and that are tried: more find little more."""

_LEAST = (0.5, 1.2, 0.5)
"""A region is tried if its cuts cost so many times the chart's average, in the same cases."""

_SAVING = (0.06, 0.25, 0.02)
"""A move is taken if it saves as much of what a region's cuts cost on average, in the same cases: each takes
bytes and time."""

_SHARE = 0.02
"""What a cell pays by its source's phase, in parts of the cost of a difference as large."""

_EVEN = 0.2
"""What a cell pays for a place that is shown twice as often as others, in parts of the cost of a difference
that costs a block in laying as much. Cheap cuts run through quiet places, which else would show too often."""

_TOLERANCE = 1.5
"""Sources that cost more than so many times the best are not compared to the end."""

_LARGEST_SHARE = 0.75
"""Of the exemplar's height and width that a region may read, unless a block reads more."""

_REGIONS_PER_CALL = 64


@dataclass(frozen=True, eq=False, slots=True)
class LaidChart:
    """A chart as laying leaves it.

    Attributes
    ----------
    index, grid, canvas
        The chart, where its own blocks lie, and what it shows.
    level
        The exemplar as it is compared.
    numbers, weights
        As for `lay_blocks`.
    usage, state
        How much of the exemplar is used, and the state of the random numbers: both go on.
    phases
        Those that the surface wants, None where none are looked at.
    origin
        Of the first block that is added, see `ChartPlacements`.
    begins
        Of a tile, at which row and column of it the chart begins: if not at its first ones, only regions
        over its edges are gone through, which then lie inside.
    """

    index: int
    grid: BlockGrid
    canvas: ChartCanvas
    level: MatchLevel
    numbers: LayNumbers
    weights: LayWeights
    usage: FloatArray
    state: NDArray[np.uint64]
    phases: Phases | None
    origin: int
    begins: tuple[int, int] = (0, 0)


def refine_chart(chart: LaidChart, laid: ChartPlacements, effort: int) -> ChartPlacements:
    """Lay further blocks where the cuts of a chart cost most.

    Parameters
    ----------
    chart
        The chart; its canvas and usage change.
    laid
        Its placements.
    effort
        How often all regions are gone through, 1 or more.

    Returns
    -------
    ChartPlacements
        Those that can be seen still, and the added ones as a part of their own.
    """
    if effort == 1 and _in_step(chart):
        # Cuts that cost a tenth less would break a fifth more elements.
        return laid
    level = 2 if effort > 1 else 0 if chart.grid.field.is_identity else 1
    lattice = _lattice(chart, level)
    blocks = _mask_places(laid.placements)
    cells = _cells(chart, lattice, blocks, laid.cells)
    table, masks = _refined(chart, lattice, cells, laid.placements, effort, level)
    if not len(table):
        return laid
    added = _placements(chart, lattice, table, len(laid.cells))
    return _without_hidden(_with_added(chart, laid, added, masks), lattice, len(added))


def _lattice(chart: LaidChart, level: int) -> CellLattice:
    # The cells of the chart's own blocks, over all that they have to cover; and a region's size.
    grid, numbers, cell = chart.grid, chart.numbers, chart.grid.mask_cell
    spans = (numbers.need_bottom - numbers.need_top, numbers.need_right - numbers.need_left)
    # Cells of a tile that do not fit between its edges belong to none.
    counts = [span // cell if numbers.wrap else -(-span // cell) for span in spans]
    shape, sides = (chart.level.height, chart.level.width), (grid.height, grid.width)
    crossed = grid.crossed(sides) / 2**grid.level
    region = _REGION_IN_STEP if _in_step(chart) else _REGION[level]
    times = max(1.0, min(region, _LARGEST_SHARE / float((crossed / np.array(shape)).max())))
    high, wide = (min(count, int(times * side / cell)) for side, count in zip(sides, counts, strict=True))
    return CellLattice(counts[0], counts[1], cell, numbers.need_top, numbers.need_left, high, wide)


def _in_step(chart: LaidChart) -> bool:
    # Whether blocks make up for what courses are stretched by.
    return chart.phases is not None and not chart.grid.field.is_identity


def _mask_places(placed: NDArray[np.void]) -> IntArray:
    # Placements as `label_cells` takes them.
    names = ("row", "column", "height", "width", "mask_cell", "first_cell")
    return np.stack([placed[name].astype(np.int32) for name in names], axis=1)


def _cells(chart: LaidChart, lattice: CellLattice, blocks: IntArray, masks: NDArray[np.uint8]) -> ChartCells:
    # What the chart's cells show, and which of them stay: those that a finished chart shows, too.
    rows, columns, cell = lattice.rows, lattice.columns, lattice.cell
    labels = np.empty((rows, columns), np.int32)
    label_cells(blocks, masks, lattice, labels)
    top, left = chart.numbers.origin_row + lattice.top, chart.numbers.origin_column + lattice.left
    covered = chart.canvas.covered[top : top + rows * cell, left : left + columns * cell]
    held = (covered != 1).reshape(rows, cell, columns, cell).any(axis=(1, 3)) | (labels < 0)
    if chart.numbers.wrap:
        # For the opposite edge shows the same.
        held[[0, 1, -2, -1]] = held[:, [0, 1, -2, -1]] = True
    return ChartCells(labels, held.astype(np.uint8), np.zeros((2, rows, columns), np.int32))


def _regions(lattice: CellLattice, turn: int, steps: int) -> IntArray:
    # All regions that are looked at, (n, 4): first row and column of cells; phases come behind. At every
    # second turn they lie midway between those of the first.
    starts = []
    for count, size in ((lattice.rows, lattice.high), (lattice.columns, lattice.wide)):
        step = max(1, size // steps)
        first = min(turn % 2 * step // 2, count - size)
        starts.append(np.minimum(np.arange(first, count - size + step, step), count - size))
    rows, columns = np.meshgrid(*starts, indexing="ij")
    out = np.zeros((rows.size, 4), np.int32)
    out[:, 0], out[:, 1] = rows.reshape(-1), columns.reshape(-1)
    return out


def _over_edges(chart: LaidChart, lattice: CellLattice, regions: IntArray) -> IntArray:
    # Of the regions of a tile that does not begin at its own edges those that lie over one.
    tile = chart.grid.chart
    over = np.zeros(len(regions), bool)
    for axis, (size, length) in enumerate(((tile.height, lattice.high), (tile.width, lattice.wide))):
        edge = (size - chart.begins[axis]) / lattice.cell
        over |= (regions[:, axis] < edge) & (edge < regions[:, axis] + length)
    return regions[over]


def _wanted(chart: LaidChart, rows: IntArray, columns: IntArray) -> IntArray:
    # The phases wanted at some texels, (n, 2): 0 where there is none.
    out = np.zeros((len(rows), 2), np.int32)
    if chart.phases is not None:
        places = (part.astype(np.float64) for part in (rows + chart.begins[0], columns + chart.begins[1]))
        found = chart.phases.at(chart.index, *places)
        out[:, : len(found)] = found.T
    return out


def _table(chart: LaidChart, placed: NDArray[np.void], most: int) -> IntArray:
    # Placements as the kernels take them, with room for more.
    count = len(placed)
    table = np.zeros((count + most, LAID_COLUMNS), np.int32)
    for name, place in (
        ("row", ROW),
        ("column", COLUMN),
        ("source_row", SOURCE_ROW),
        ("source_column", SOURCE_COLUMN),
        ("symmetry", SYMMETRY),
    ):
        table[:count, place] = placed[name]
    table[:count, PHASE : PHASE + 2] = _wanted(chart, placed["row"], placed["column"])
    table[:count, CENTRE:] = step_matrices(chart.grid.field, placed)
    return table


def _refined(
    chart: LaidChart,
    lattice: CellLattice,
    cells: ChartCells,
    placed: NDArray[np.void],
    effort: int,
    level: int,
) -> tuple[IntArray, NDArray[np.uint8]]:
    # Refines; returns the records of the blocks that were added, and their masks.
    match, matrices, cell = chart.level.match, chart.grid.field.matrices, lattice.cell
    numbers = chart.numbers._replace(
        shortlist=min(_SHORTLIST, chart.numbers.shortlist),
        block_height=lattice.high * cell,
        block_width=lattice.wide * cell,
    )
    scratch, expansion = LayScratch.of(numbers, chart.usage), ExpansionScratch.of(lattice)
    refine, first = RefineScratch.of(lattice, _TRIES, scratch.choice.penalties.size), len(placed)
    steps = _STEPS[level]
    count, most = first, sum(len(_regions(lattice, turn, steps)) for turn in range(effort))
    table, charges = _table(chart, placed, most), np.zeros(count + most)
    masks = np.empty((most, lattice.high * lattice.wide), np.uint8)
    charge_phases(match, numbers, chart.weights.phase, table, count, scratch.choice, charges)
    across = scratch.choice.penalties.shape[1]
    places = np.empty(lattice.columns, np.int32)
    count_uses(matrices, numbers, lattice, cells.labels, table, across, places, refine.uses)
    common = numbers, lattice, cells, table
    whole = (0, lattice.rows, 0, lattice.columns)
    weigh_seams(chart.canvas.canvas, match.image, matrices, *common, whole, expansion)
    for turn in range(effort):
        regions = _regions(lattice, turn, steps)
        if any(chart.begins):
            regions = _over_edges(chart, lattice, regions)
        regions, weights = _worst(chart, lattice, cells, regions, level)
        for start in range(0, len(regions), _REGIONS_PER_CALL):
            # Few regions a call: between two calls, Python can be interrupted.
            count = refine_regions(
                *(chart.canvas, match, matrices, *common, charges),
                *(chart.weights._replace(tolerance=_TOLERANCE), weights, chart.usage, chart.state),
                regions,
                (start, min(start + _REGIONS_PER_CALL, len(regions))),
                count,
                *(masks, scratch, expansion, refine),
            )
    return table[first:count], masks[: count - first]


def _worst(
    chart: LaidChart, lattice: CellLattice, cells: ChartCells, regions: IntArray, level: int
) -> tuple[IntArray, RefineWeights]:
    # The regions to try, those whose cuts cost most first, with the phases that they want; and what they are
    # tried by.
    grid = chart.grid
    scores = np.empty(len(regions), np.int64)
    score_regions(cells.seams, lattice, regions, scores)
    total, cuts = int(cells.seams.sum(dtype=np.int64)), int((cells.seams > 0).sum())
    middle = (lattice.high - lattice.high // 4 * 2) * (lattice.wide - lattice.wide // 4 * 2)
    typical = total * middle / (lattice.rows * lattice.columns)
    order = np.argsort(-scores, kind="stable")
    found = regions[order[scores[order] >= max(1.0, _LEAST[level] * typical)]]
    height, width = lattice.high * lattice.cell, lattice.wide * lattice.cell
    found[:, 2:] = _wanted(
        chart,
        lattice.top + found[:, 0] * lattice.cell + height // 2,
        lattice.left + found[:, 1] * lattice.cell + width // 2,
    )
    shown = (grid.height - grid.overlap_rows) * (grid.width - grid.overlap_columns)
    weights = RefineWeights(
        int(_LEAST[level] * typical),
        max(1, int(_SAVING[level] * typical)),
        total // max(1, cuts),
        _TRIES,
        shown / lattice.cell**2,
        _SHARE,
        _EVEN * float(np.sqrt(SAMPLES * chart.weights.evenness)),
    )
    return found, weights


def _placements(chart: LaidChart, lattice: CellLattice, table: IntArray, first_cell: int) -> NDArray[np.void]:
    placed = np.zeros(len(table), BLOCK)
    placed["chart"] = chart.index
    for name, place in (
        ("row", ROW),
        ("column", COLUMN),
        ("source_row", SOURCE_ROW),
        ("source_column", SOURCE_COLUMN),
        ("symmetry", SYMMETRY),
    ):
        placed[name] = table[:, place]
    placed["height"], placed["width"] = lattice.high * lattice.cell, lattice.wide * lattice.cell
    placed["mask_cell"] = lattice.cell
    placed["first_cell"] = first_cell + np.arange(len(table)) * lattice.high * lattice.wide
    return placed


def _with_added(
    chart: LaidChart, laid: ChartPlacements, added: NDArray[np.void], masks: NDArray[np.uint8]
) -> ChartPlacements:
    count = len(added)
    return replace(
        laid,
        placements=np.concatenate([laid.placements, added]),
        cells=np.concatenate([laid.cells, masks.reshape(-1)]),
        origins=np.concatenate([laid.origins, chart.origin + np.arange(count)]),
        steps=np.concatenate([laid.steps, np.zeros(count, np.int64)]),
    )


def _without_hidden(laid: ChartPlacements, lattice: CellLattice, added: int) -> ChartPlacements:
    # Leaves out what cannot be seen; the cells of its masks stay where they are. The last `added` placements
    # lie on the lattice.
    hidden = np.zeros(len(laid.placements), np.uint8)
    over = np.empty((lattice.rows, lattice.columns), np.int32)
    list_hidden(_mask_places(laid.placements), laid.cells, added, lattice, over, hidden)
    seen = hidden == 0
    return replace(laid, placements=laid.placements[seen], origins=laid.origins[seen], steps=laid.steps[seen])
