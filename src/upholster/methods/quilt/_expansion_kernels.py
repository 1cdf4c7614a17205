"""One expansion move: which cells of a region take a new source, so that the cuts cost least.

Cells are those of masks. Of each, four texels are compared. What two sources differ by in a cell is the norm
of their difference there: a metric. A cut between two cells that show different sources costs what these
differ by in both cells, and 1 (Kwatra et al. 2003). So an expansion move is a minimum cut (Boykov, Veksler,
Zabih 2001), and never costs more than what is there.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline
from upholster.methods._cut_kernels import cut_weighted
from upholster.methods.quilt._block_kernels import (
    BLOCK_COLUMNS,
    COLUMN,
    ROW,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
    LayNumbers,
    squared_difference,
)
from upholster.quilt._field_kernels import displacement, matrix_at
from upholster.quilt.placement import SYMMETRIES
from upholster.types import int64

__all__ = [
    "CENTRE",
    "FACTOR",
    "FINE",
    "LAID_COLUMNS",
    "SAMPLES",
    "CellLattice",
    "ChartCells",
    "ExpansionScratch",
    "difference",
    "enter_pairs",
    "expand",
    "place_shown",
    "read_old",
    "saved",
    "seam_cost",
    "settle",
]

CENTRE = BLOCK_COLUMNS
"""Columns of a laid block's record: a block's, see `_block_kernels`, then its centre matrix."""
LAID_COLUMNS = CENTRE + 4

SAMPLES = 4
"""Texels of a cell that are compared: two rows of two."""

FACTOR = 2
"""Cells each way that are taken together where sources are tried."""

FINE = 4
"""Costs are in so many parts of a difference of 1."""

_HELD = int64(2**50)


class CellLattice(NamedTuple):
    """Where a chart's cells lie.

    There are `rows` × `columns` cells of `cell` texels each way, the first of which begins at texel (`top`,
    `left`); a region has `high` × `wide` of them.
    """

    rows: int
    columns: int
    cell: int
    top: int
    left: int
    high: int
    wide: int


class ChartCells(NamedTuple):
    """What a chart's cells show: `labels` (rows, columns), the laid block; `held`, 1 where it must stay.

    `seams` (2, rows, columns): what the cut to the cell on the right, and to that below, costs; 0 without
    one.
    """

    labels: NDArray[np.int32]
    held: NDArray[np.uint8]
    seams: NDArray[np.int32]


class ExpansionScratch(NamedTuple):
    """Scratch by the cells of a region, row by row.

    `old` (cells, samples) is what they show, `new` what the new source has there, pixels as in `MatchImage`.
    `apart` (cells,) is the cost of the difference. `pairs` (n, 3) are cells that a cut runs between: 0 for
    one beside, 1 for one below the other, and both cells; `across` (n, 2, samples) is what the second one's
    block has in the first, and the first one's in the second; `costs` (n, 3) what the cut costs now, and if
    the first or the second cell alone is new. `dues` (cells,) is twice what it costs cells otherwise to stay
    as they are (negative: to become new). The rest see `cut_weighted`.
    """

    old: NDArray[np.int32]
    new: NDArray[np.int32]
    apart: NDArray[np.int64]
    pairs: NDArray[np.int64]
    across: NDArray[np.int32]
    costs: NDArray[np.int64]
    dues: NDArray[np.int64]
    residual: NDArray[np.int64]
    balance: NDArray[np.int64]
    work: NDArray[np.int32]

    @classmethod
    def of(cls, lattice: CellLattice) -> "ExpansionScratch":
        """Return scratch for regions."""
        cells = lattice.high * lattice.wide
        return cls(
            np.empty((cells, SAMPLES), np.int32),
            np.empty((cells, SAMPLES), np.int32),
            np.empty(cells, np.int64),
            np.empty((2 * cells, 3), np.int64),
            np.empty((2 * cells, 2, SAMPLES), np.int32),
            np.empty((2 * cells, 3), np.int64),
            np.empty(cells, np.int64),
            np.empty((4, cells), np.int64),
            np.empty(cells, np.int64),
            np.empty((4, cells), np.int32),
        )


@inline
def difference(one: NDArray[np.int32], other: NDArray[np.int32]) -> Any:
    """Return what two sources differ by in a cell, by their samples there: a norm."""
    total = np.int32(0)
    for s in range(SAMPLES):
        total += squared_difference(one[s], other[s])
    return int64(FINE * np.sqrt(float(total)))


@inline
def place_shown(
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    laid: NDArray[np.int32],
    n: Any,
    row: Any,
    column: Any,
) -> Any:
    """Return the pixel of the exemplar that block n shows at texel (row, column), row by row."""
    block, shift = laid[n], 4 + numbers.level
    turn = SYMMETRIES[block[SYMMETRY]]
    centre = (block[CENTRE], block[CENTRE + 1], block[CENTRE + 2], block[CENTRE + 3])
    here = matrix_at(matrices, numbers.margin, row, column)
    v, w = displacement(centre, here, row - block[ROW], column - block[COLUMN])
    y = (block[SOURCE_ROW] + turn[0] * v + turn[1] * w + 8) >> shift
    x = (block[SOURCE_COLUMN] + turn[2] * v + turn[3] * w + 8) >> shift
    y, x = min(max(y, 0), numbers.height - 1), min(max(x, 0), numbers.width - 1)
    return y * numbers.width + x


@inline
def _read(
    image: NDArray[np.int32],
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    laid: NDArray[np.int32],
    n: Any,
    row: Any,
    column: Any,
    cell: int,
    out: NDArray[np.int32],
) -> None:
    # Reads what block n has in the cell whose first texel is (row, column).
    stride = cell // 2
    for s in range(SAMPLES):
        r, c = row + (s >> 1) * stride, column + (s & 1) * stride
        out[s] = image[place_shown(matrices, numbers, laid, n, r, c)]


@inline
def read_old(
    canvas: NDArray[np.int32],
    numbers: LayNumbers,
    lattice: CellLattice,
    i: Any,
    j: Any,
    out: NDArray[np.int32],
) -> None:
    """Read what a chart shows in cell (i, j)."""
    stride = lattice.cell // 2
    row = numbers.origin_row + lattice.top + i * lattice.cell
    column = numbers.origin_column + lattice.left + j * lattice.cell
    for s in range(SAMPLES):
        r, c = row + (s >> 1) * stride, column + (s & 1) * stride
        out[s] = canvas[r, c]


@inline
def _read_across(
    image: NDArray[np.int32],
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    lattice: CellLattice,
    labels: NDArray[np.int32],
    laid: NDArray[np.int32],
    place: tuple[Any, Any, Any],
    theirs: NDArray[np.int32],
    mine: NDArray[np.int32],
) -> None:
    # Reads what the next cell's block has in a cell, and what the cell's block has in the next one. `place`:
    # 0 for the next cell on the right, 1 for that below; the cell's row and column.
    way, i, j = place
    down, right = way, 1 - way
    row, column, cell = lattice.top + i * lattice.cell, lattice.left + j * lattice.cell, lattice.cell
    _read(image, matrices, numbers, laid, labels[i + down, j + right], row, column, cell, theirs)
    row, column = row + down * cell, column + right * cell
    _read(image, matrices, numbers, laid, labels[i, j], row, column, cell, mine)


@inline
def seam_cost(
    canvas: NDArray[np.int32],
    image: NDArray[np.int32],
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    lattice: CellLattice,
    labels: NDArray[np.int32],
    laid: NDArray[np.int32],
    place: tuple[Any, Any, Any],
    scratch: ExpansionScratch,
) -> Any:
    """Return what the cut from a cell to the next costs, 0 without one; `place` as in `_read_across`.

    The first cells of the scratch are used.
    """
    way, i, j = place
    here, there = labels[i, j], labels[i + way, j + 1 - way]
    if here == there or here < 0 or there < 0:
        return int64(0)
    old, theirs, mine = scratch.old[0], scratch.across[0, 0], scratch.across[0, 1]
    _read_across(image, matrices, numbers, lattice, labels, laid, place, theirs, mine)
    read_old(canvas, numbers, lattice, i, j, old)
    cost = 1 + difference(old, theirs)
    read_old(canvas, numbers, lattice, i + way, j + 1 - way, old)
    return cost + difference(old, mine)


@inline
def enter_pairs(
    match_image: NDArray[np.int32],
    matrices: NDArray[np.int32],
    numbers: LayNumbers,
    lattice: CellLattice,
    cells: ChartCells,
    laid: NDArray[np.int32],
    region: tuple[Any, Any],
    scratch: ExpansionScratch,
) -> Any:
    """List the cuts in a region, pairs of cells, and what either block has in both; return how many."""
    count, pairs = int64(0), scratch.pairs
    for way in range(2):
        for i in range(lattice.high - way):
            for j in range(lattice.wide - 1 + way):
                a, b = region[0] + i, region[1] + j
                if cells.seams[way, a, b] > 0:
                    n = i * lattice.wide + j
                    pairs[count, 0], pairs[count, 1] = way, n
                    pairs[count, 2] = n + lattice.wide if way else n + 1
                    theirs, mine = scratch.across[count, 0], scratch.across[count, 1]
                    _read_across(
                        match_image, matrices, numbers, lattice, cells.labels, laid, (way, a, b), theirs, mine
                    )
                    scratch.costs[count, 0] = cells.seams[way, a, b]
                    count += 1
    return count


@inline
def _enter_costs(
    old: NDArray[np.int32],
    new: NDArray[np.int32],
    across: NDArray[np.int32],
    pairs: NDArray[np.int64],
    count: int,
    apart: NDArray[np.int64],
    costs: NDArray[np.int64],
) -> None:
    # Enters by how much the new source differs in each cell, and what each cut costs if its first or its
    # second cell alone is new.
    for n in range(apart.shape[0]):
        apart[n] = difference(old[n], new[n])
    for p in range(count):
        at, other = pairs[p, 1], pairs[p, 2]
        costs[p, 1] = 1 + apart[other] + difference(across[p, 0], new[at])
        costs[p, 2] = 1 + apart[at] + difference(across[p, 1], new[other])


@inline
def _link_cells(
    apart: NDArray[np.int64],
    dues: NDArray[np.int64],
    high: int,
    wide: int,
    factor: int,
    residual: NDArray[np.int64],
    balance: NDArray[np.int64],
) -> None:
    # Enters all pairs as if no cut ran between them, all twice, so that halves are whole. Nodes have
    # `factor` × `factor` cells.
    broad = (wide + factor - 1) // factor
    for n in range(balance.shape[0]):
        balance[n] = 0
        for d in range(4):
            residual[d, n] = 0
    for i in range(high):
        for j in range(wide):
            n, node = i * wide + j, i // factor * broad + j // factor
            balance[node] += dues[n]
            if j + 1 < wide and j % factor == factor - 1:
                cost = 2 * (apart[n] + apart[n + 1] + 1)
                residual[0, node] += cost
                residual[2, node + 1] += cost
            if i + 1 < high and i % factor == factor - 1:
                cost = 2 * (apart[n] + apart[n + wide] + 1)
                residual[1, node] += cost
                residual[3, node + broad] += cost


@inline
def _link_cuts(
    apart: NDArray[np.int64],
    pairs: NDArray[np.int64],
    costs: NDArray[np.int64],
    count: int,
    wide: int,
    factor: int,
    residual: NDArray[np.int64],
    balance: NDArray[np.int64],
) -> None:
    # Enters the pairs that a cut runs between, in place of what stands there.
    broad = (wide + factor - 1) // factor
    for p in range(count):
        way, at, other = pairs[p, 0], pairs[p, 1], pairs[p, 2]
        node = at // wide // factor * broad + at % wide // factor
        beside = other // wide // factor * broad + other % wide // factor
        both, first, second = costs[p, 0], costs[p, 1], costs[p, 2]
        if node == beside:
            balance[node] += 2 * both
            continue
        forth, back, here, there = 2 * first - both, 2 * second - both, both, both
        if forth < 0:
            forth, back, here, there = int64(0), 2 * (second - both + first), 2 * (both - first), 2 * first
        elif back < 0:
            forth, back, here, there = 2 * (first - both + second), int64(0), 2 * second, 2 * (both - second)
        plain = 2 * (apart[at] + apart[other] + 1)
        # Whole numbers may miss the triangle's inequality by 2.
        residual[way, node] += max(forth, 0) - plain
        residual[way + 2, beside] += max(back, 0) - plain
        balance[node] += here
        balance[beside] += there


@inline
def _leave_out_held(residual: NDArray[np.int64], balance: NDArray[np.int64], wide: int) -> None:
    # Leaves nodes that are held, `_HELD` new or old, out of the flow: what a cut to one costs becomes part of
    # its neighbour's balance. The cut stays the same, and is found far sooner.
    for n in range(balance.shape[0]):
        here = balance[n] if abs(balance[n]) == _HELD else int64(0)
        for way in range(2):
            m = n + (wide if way else 1)
            forth = residual[way, n]
            back = residual[way + 2, m] if m < balance.shape[0] else int64(0)
            if forth == 0 and back == 0:
                continue
            there = balance[m] if abs(balance[m]) == _HELD else int64(0)
            if here != 0 or there != 0:
                residual[way, n] = residual[way + 2, m] = 0
                if there == 0:
                    balance[m] += forth if here > 0 else -back
                elif here == 0:
                    balance[n] += back if there > 0 else -forth
    for n in range(balance.shape[0]):
        if abs(balance[n]) == _HELD:
            balance[n] = 1 if balance[n] > 0 else -1


@inline
def _is_fixed(held: NDArray[np.uint8], region: tuple[Any, Any], lattice: CellLattice, i: Any, j: Any) -> bool:
    # Whether a cell stays: on the region's rim, unless the lattice ends there.
    top, left = region
    rim = (i == 0 and top > 0) or (i == lattice.high - 1 and top + lattice.high < lattice.rows)
    rim = rim or (j == 0 and left > 0) or (j == lattice.wide - 1 and left + lattice.wide < lattice.columns)
    return bool(rim or held[top + i, left + j])


@inline
def expand(
    cells: ChartCells,
    region: tuple[Any, Any],
    lattice: CellLattice,
    count: int,
    scratch: ExpansionScratch,
    mask: NDArray[np.uint8],
) -> Any:
    """Choose which cells of a region take the new source; return twice by how much it gets cheaper.

    `region` is its first cell; `scratch` has all values and `count` cuts. Cells are taken in squares of
    `FACTOR`, a byte of `mask` for each.
    """
    high, wide, apart, costs = lattice.high, lattice.wide, scratch.apart, scratch.costs
    tall, broad = (high + FACTOR - 1) // FACTOR, (wide + FACTOR - 1) // FACTOR
    nodes = tall * broad
    residual, balance = scratch.residual[:, :nodes], scratch.balance[:nodes]
    _enter_costs(scratch.old, scratch.new, scratch.across, scratch.pairs, count, apart, costs)
    _link_cells(apart, scratch.dues, high, wide, FACTOR, residual, balance)
    _link_cuts(apart, scratch.pairs, costs, count, wide, FACTOR, residual, balance)
    for i in range(high):
        for j in range(wide):
            if _is_fixed(cells.held, region, lattice, i, j):
                balance[i // FACTOR * broad + j // FACTOR] = -_HELD
    _leave_out_held(residual, balance, broad)
    stays = int64(0)
    for n in range(nodes):
        stays += max(balance[n], 0)
    return stays - cut_weighted(residual, balance, broad, scratch.work, mask)


@inline
def settle(
    cells: ChartCells,
    region: tuple[Any, Any],
    lattice: CellLattice,
    count: int,
    scratch: ExpansionScratch,
    squares: NDArray[np.uint8],
    mask: NDArray[np.uint8],
) -> None:
    """Choose the same cell by cell, near the border between squares; `squares` is what `expand` chose."""
    high, wide, apart, costs = lattice.high, lattice.wide, scratch.apart, scratch.costs
    tall, broad = (high + FACTOR - 1) // FACTOR, (wide + FACTOR - 1) // FACTOR
    _enter_costs(scratch.old, scratch.new, scratch.across, scratch.pairs, count, apart, costs)
    _link_cells(apart, scratch.dues, high, wide, 1, scratch.residual, scratch.balance)
    _link_cuts(apart, scratch.pairs, costs, count, wide, 1, scratch.residual, scratch.balance)
    for a in range(tall):
        for b in range(broad):
            new = squares[a * broad + b]
            border = False
            for i in range(max(a - 1, 0), min(a + 2, tall)):
                for j in range(max(b - 1, 0), min(b + 2, broad)):
                    border = border or squares[i * broad + j] != new
            for i in range(a * FACTOR, min((a + 1) * FACTOR, high)):
                for j in range(b * FACTOR, min((b + 1) * FACTOR, wide)):
                    if _is_fixed(cells.held, region, lattice, i, j):
                        scratch.balance[i * wide + j] = -_HELD
                    elif not border:
                        scratch.balance[i * wide + j] = _HELD if new else -_HELD
    _leave_out_held(scratch.residual, scratch.balance, wide)
    cut_weighted(scratch.residual, scratch.balance, wide, scratch.work, mask)


@inline
def saved(lattice: CellLattice, count: int, scratch: ExpansionScratch, mask: NDArray[np.uint8]) -> Any:
    """Return by how much a region gets cheaper with a mask, of the source entered last."""
    total, high, wide = int64(0), lattice.high, lattice.wide
    apart, dues, pairs, costs = scratch.apart, scratch.dues, scratch.pairs, scratch.costs
    for i in range(high):
        for j in range(wide):
            n = i * wide + j
            if mask[n]:
                total += dues[n] // 2
            if j + 1 < wide and mask[n] != mask[n + 1]:
                total -= apart[n] + apart[n + 1] + 1
            if i + 1 < high and mask[n] != mask[n + wide]:
                total -= apart[n] + apart[n + wide] + 1
    for p in range(count):
        at, other = pairs[p, 1], pairs[p, 2]
        if mask[at] or mask[other]:
            total += costs[p, 0]
        if mask[at] != mask[other]:
            total += apart[at] + apart[other] + 1 - (costs[p, 1] if mask[at] else costs[p, 2])
    return total
