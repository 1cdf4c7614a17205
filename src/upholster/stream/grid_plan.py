"""A grid plan in a stream: where the grids lie, then blocks and masks in the context of their neighbours."""

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from upholster.errors import FormatError, InputError
from upholster.quilt.chart import Chart
from upholster.quilt.displacement import centre_matrices
from upholster.quilt.model import Quilt
from upholster.methods.quilt.masked import MATRIX_UNIT, chart_sizes, mask_windows
from upholster.methods.quilt.old_plans import ChartGrid, GridPlan
from upholster.methods.quilt.old_plans.grid import BLOCK
from upholster.quilt.warp_field import WarpField
from upholster.stream import _block_records as records_
from upholster.stream import _grid_kernels as kernels
from upholster.stream import _mask_kernels as mask_kernels
from upholster.stream._straight_kernels import cut_straight
from upholster.stream.budget import PaintBudget
from upholster.stream.byte_reader import ByteReader, varint
from upholster.stream.coder import BitReader, BitWriter
from upholster.stream.plan_common import (
    BATCH,
    GRID,
    MAX_CELLS,
    MAX_PLACEMENTS,
    PlanCode,
    check_decoded,
    grown,
    known_part,
)

__all__ = ["GridDecoder", "encode_grid"]

_MOST_CELL, _MOST_FEATHER, _MOST_BLOCK, _MOST_LEVEL = 255, 16, 4096, 12
_TURNED = 32
"""Added to a plan's feather where own blocks have symmetries of their own."""
_MOST_POSITIONS = 2**19
_FAR = 2**20
_BYTES_A_BLOCK = 512

_RECORD_NAMES = ("row", "column", "height", "width", "symmetry", "cut", "source_row", "source_column")
_TOLD = [field.name for field in fields(ChartGrid)][1:11]
_LEAST = dict.fromkeys(("rows", "across", "height", "width", "step_row", "step_column", "mask_cell"), 1) | {
    "level": 0
}
_MOST = {"height": _MOST_BLOCK, "width": _MOST_BLOCK, "level": _MOST_LEVEL, "mask_cell": _MOST_CELL}
_BEFORE_ALL = ChartGrid(0, 1, 1, 20, 20, 40, 40, 28, 28, 0, 2, 0, 0)


def encode_grid(quilt: Quilt, plan: GridPlan, hidden: NDArray[np.bool_] | None = None) -> PlanCode:
    """Encode a grid plan; cells of masks that are `hidden` as what costs least.

    Raises
    ------
    InputError
        If a number is beyond the format's limits, a block or its link does not fit the plan, or a centre
        matrix differs from its warp field by other than multiples of 1/64 pixel per texel.
    """
    turned = _is_turned(plan)
    head = bytes([GRID, plan.feather + _TURNED * turned]) + _grid_bytes(plan, quilt.charts)
    for place in range(len(plan.grids)):
        _check_blocks(plan, place)
    records = _records(quilt, plan)
    sources = BitWriter(kernels.BLOCK_COUNTERS, kernels.BLOCK_INPUTS)
    masks = BitWriter(mask_kernels.MASK_COUNTERS, mask_kernels.MASK_INPUTS)
    windows, first = _mask_places(plan, quilt.charts)
    cells = np.array(plan.mask_cells)
    if hidden is not None:
        cells[hidden] = mask_kernels.LIKELY
    source_ends, mask_ends = [], []
    for place in range(len(plan.grids)):
        _code_sources(sources, quilt, plan, place, turned, records)
        source_ends.append(sources.length)
    covered = np.zeros((0, 0), np.uint8)
    for place, grid in enumerate(plan.grids):
        start, stop = plan.starts[place : place + 2].tolist()
        masks.room(2 * int(np.prod(np.diff(windows[start:stop])[:, ::2], axis=1).sum()) + 64)
        covered = _covered(plan, place, quilt.charts, covered)
        mask_kernels.code_masks(
            masks.coder,
            records,
            windows,
            first,
            cells,
            covered,
            grid.mask_cell,
            start + grid.transferred,
            start,
            stop,
            0,
            True,
        )
        mask_ends.append(masks.length)
    order = [grid.chart for grid in plan.grids]
    return PlanCode.of(
        head, sources.finish(), masks.finish() if len(cells) else b"", order, source_ends, mask_ends
    )


def _is_turned(plan: GridPlan) -> bool:
    # Whether own blocks have symmetries.
    return any(
        bool(plan.blocks["symmetry"][start + grid.transferred : stop].any())
        for grid, start, stop in zip(
            plan.grids, plan.starts[:-1].tolist(), plan.starts[1:].tolist(), strict=True
        )
    )


def _check_blocks(plan: GridPlan, place: int) -> None:
    # That a grid's blocks are such as the format tells: its own follow from it, but for their sources.
    grid, (start, stop) = plan.grids[place], plan.starts[place : place + 2].tolist()
    first = start + grid.transferred
    links, own = plan.blocks["link"][start:first], plan.blocks[first:stop]
    wrong = np.flatnonzero((links < -1) | (links >= start))
    if len(wrong):
        raise InputError(
            f"block {start + wrong[0]} has its link at {links[wrong[0]]}; "
            f"allowed: -1, or a block of a grid before, below {start}"
        )
    row, column = own["row"] - grid.first_row, own["column"] - grid.first_column
    i, j = row // grid.step_row, column // grid.step_column
    outside = (row % grid.step_row > 0) | (column % grid.step_column > 0) | (i < 0) | (j < 0)
    outside |= (i >= grid.rows) | (j >= grid.across) | (np.diff(i * grid.across + j, prepend=-1) <= 0)
    outside |= (own["height"] != grid.height) | (own["width"] != grid.width)
    wrong = np.flatnonzero(outside | (own["centred"] > 0) | (own["link"] != -1))
    if len(wrong):
        raise InputError(
            f"block {first + wrong[0]} is none of its grid; allowed there: its positions in raster "
            "order, its size, no centre matrix, no link"
        )


def _records(quilt: Quilt, plan: GridPlan) -> NDArray[np.int32]:
    # The blocks as the kernels take them.
    blocks = plan.blocks
    records = np.zeros((len(blocks), records_.COLUMNS), np.int32)
    for n, name in enumerate(_RECORD_NAMES):
        records[:, n] = blocks[name]
    records[:, records_.LINK], records[:, records_.CENTRED] = blocks["link"], blocks["centred"]
    placed = plan.in_order()
    for place, grid in enumerate(plan.grids):
        n, part = grid.chart, slice(*plan.starts[place : place + 2].tolist())
        centres = centre_matrices(quilt.fields[n], placed[part])
        records[part, records_.CENTRE : records_.CENTRE + 4] = centres
        change = centres - quilt.fields[n].integers_at(placed["row"][part], placed["column"][part])
        if (change % MATRIX_UNIT).any():
            raise InputError(
                f"a centre matrix on chart {n} differs from its warp field by other than multiples of "
                f"{MATRIX_UNIT} in 1/4096 pixel per texel; allowed: such multiples in a stream"
            )
    return records


def _mask_places(plan: GridPlan, charts: Sequence[Chart]) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    # Each block's window, and where it begins among the cells.
    windows = mask_windows(plan.in_order(), charts)
    sizes = (windows[:, 1] - windows[:, 0]) * (windows[:, 3] - windows[:, 2])
    sizes = np.where(plan.blocks["cut"] == 1, sizes, 0)
    return windows.astype(np.int32), np.cumsum(sizes) - sizes


def _covered(
    plan: GridPlan, place: int, charts: Sequence[Chart], before: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    # Which texels of a grid's chart are covered when its masks begin: what its grids before covered.
    n = plan.grids[place].chart
    if place > 0 and plan.grids[place - 1].chart == n:
        return before
    return np.zeros((charts[n].height, charts[n].width), np.uint8)


def _numbers(
    grid: ChartGrid,
    chart: Chart,
    field: WarpField,
    exemplar_shape: tuple[int, int],
    feather: int,
    turned: bool,
    base: int,
) -> records_.ChartNumbers:
    return records_.ChartNumbers(
        grid.chart,
        grid.transferred,
        grid.height,
        grid.width,
        grid.first_row,
        grid.first_column,
        grid.step_row,
        grid.step_column,
        grid.rows,
        grid.across,
        grid.level,
        grid.mask_cell,
        feather,
        int(turned),
        base,
        field.margin,
        chart.height,
        chart.width,
        *exemplar_shape,
    )


def _code_sources(
    writer: BitWriter,
    quilt: Quilt,
    plan: GridPlan,
    place: int,
    turned: bool,
    records: NDArray[np.int32],
) -> None:
    grid = plan.grids[place]
    chart, field = quilt.charts[grid.chart], quilt.fields[grid.chart]
    start, stop = plan.starts[place : place + 2].tolist()
    own = records[start + grid.transferred : stop]
    there = np.zeros(grid.positions, np.uint8)
    rows = (own[:, records_.ROW] - grid.first_row) // grid.step_row
    there[rows * grid.across + (own[:, records_.COLUMN] - grid.first_column) // grid.step_column] = 1
    end = grid.transferred + grid.positions
    writer.room(_BYTES_A_BLOCK * end + 64)
    kernels.code_blocks(
        writer.coder,
        records,
        plan.starts,
        place,
        there,
        np.full((grid.rows + 2, grid.across + 2), -1, np.int32),
        field.matrices,
        _numbers(grid, chart, field, quilt.exemplar_shape, plan.feather, turned, start),
        (0, end),
        0,
        True,
    )


def _grid_bytes(plan: GridPlan, charts: Sequence[Chart]) -> bytes:
    # All that is told of the grids; charts are told elsewhere.
    order = [grid.chart for grid in plan.grids]
    _check_order(order, len(charts))
    rising = order == list(range(len(charts)))
    out = bytearray(varint(0 if rising else 1 + len(order) - len(charts)))
    out += b"" if rising else b"".join(varint(n) for n in order)
    before = _BEFORE_ALL
    for grid in plan.grids:
        chart = charts[grid.chart]
        values = {name: getattr(grid, name) for name in _TOLD}
        for name, value in values.items():
            least, most = _LEAST.get(name, -_FAR), _MOST.get(name, _FAR)
            if not least <= value <= most:
                raise InputError(f"{name} of a grid is {value}; allowed: {least} to {most} in a stream")
        changes = [values[name] - _guess(name, before, values, chart) for name in _TOLD]
        out += varint(sum(1 << n for n, change in enumerate(changes) if change))
        out += b"".join(varint(2 * change if change > 0 else -2 * change - 1) for change in changes if change)
        out += varint(grid.transferred) + varint(grid.positions - grid.own)
        before = grid
    if (positions := sum(grid.positions for grid in plan.grids)) > _MOST_POSITIONS:
        raise InputError(f"grids have {positions} positions; allowed: {_MOST_POSITIONS} in a stream")
    return bytes(out)


def _check_order(order: list[int], charts: int) -> None:
    # That every chart has grids, and that they follow each other.
    first = [n for place, n in enumerate(order) if place == 0 or order[place - 1] != n]
    if sorted(first) != list(range(charts)):
        raise InputError(
            f"{len(order)} grids lie on charts {first[:20]} in this order; allowed: every chart from 0 to "
            f"{charts - 1}, grids of one chart right after each other"
        )


def _guess(name: str, before: ChartGrid, values: dict[str, int], chart: Chart) -> int:
    # As of the grid before; as many positions as it takes to reach the chart's end.
    if name == "rows":
        beyond = chart.height - (values["first_row"] - values["height"] // 2) - values["height"]
        return max(1, 1 - (-beyond // values["step_row"]))
    if name == "across":
        beyond = chart.width - (values["first_column"] - values["width"] // 2) - values["width"]
        return max(1, 1 - (-beyond // values["step_column"]))
    return int(getattr(before, name))


def _parse(reader: ByteReader, charts: Sequence[Chart]) -> tuple[GridPlan, bool]:
    # The plan without its blocks, and whether own blocks have symmetries.
    place = reader.offset
    turned, feather = divmod(reader.byte("feather", _TURNED + _MOST_FEATHER), _TURNED)
    if feather > _MOST_FEATHER:
        raise FormatError(f"byte {place}: feather is {feather}; allowed: 0 to {_MOST_FEATHER}")
    before, grids, blocks, positions = _BEFORE_ALL, [], 0, 0
    for n in _parse_order(reader, len(charts)):
        grid = _parse_grid(reader, n, charts[n], before)
        blocks, positions = blocks + grid.blocks, positions + grid.positions
        if blocks > MAX_PLACEMENTS or positions > _MOST_POSITIONS:
            raise reader.error(
                f"plan has {blocks} blocks, {positions} positions; "
                f"allowed: {MAX_PLACEMENTS}, {_MOST_POSITIONS}"
            )
        grids.append(grid)
        before = grid
    reader.end("plan")
    return GridPlan(tuple(grids), feather, np.zeros(0, BLOCK), np.zeros(0, np.uint8)), turned > 0


def _parse_order(reader: ByteReader, charts: int) -> list[int]:
    # The chart of each grid.
    more = reader.varint("how many grids there are", _MOST_POSITIONS)
    if not more:
        return list(range(charts))
    order, seen = [0] * (charts + more - 1), set[int]()
    for place in range(len(order)):
        order[place] = reader.varint("number of a chart", charts - 1)
        if (place == 0 or order[place] != order[place - 1]) and order[place] in seen:
            raise reader.error("a chart's grids do not follow each other")
        seen.add(order[place])
    if len(seen) < charts:
        raise reader.error("a chart has no grid")
    return order


def _parse_grid(reader: ByteReader, n: int, chart: Chart, before: ChartGrid) -> ChartGrid:
    changed = reader.varint("which numbers of a grid change", 2 ** len(_TOLD) - 1)
    codes = {
        name: reader.varint("change of a grid", 2**24, 1) if changed >> n & 1 else 0
        for n, name in enumerate(_TOLD)
    }
    values: dict[str, int] = {}
    # Rows and columns are guessed from the numbers behind them.
    for name in reversed(_TOLD):
        code = codes[name]
        values[name] = _guess(name, before, values, chart) + (-(code + 1) // 2 if code & 1 else code // 2)
        least, most = _LEAST.get(name, -_FAR), _MOST.get(name, _FAR)
        if not least <= values[name] <= most:
            raise reader.error(f"{name} of a grid is {values[name]}; allowed: {least} to {most}")
    for first, count, step in (("first_row", "rows", "step_row"), ("first_column", "across", "step_column")):
        if (last := values[first] + (values[count] - 1) * values[step]) > _FAR:
            raise reader.error(f"last position of a grid is {last}; allowed: up to {_FAR}")
    positions = values["rows"] * values["across"]
    return ChartGrid(
        chart=n,
        **values,
        transferred=reader.varint("number of transferred blocks", MAX_PLACEMENTS),
        own=positions - reader.varint("number of positions skipped", positions),
    )


class GridDecoder:
    """Decodes a grid plan as its bytes arrive, see `upholster.stream.plan_common.PlanDecoder`.

    Parameters
    ----------
    plan
        The plan's bytes behind its kind.
    charts, exemplar_shape
        As in `Quilt`.
    fields
        Per chart; None where its nodes have not come.
    budget
        What painting may cost.

    Raises
    ------
    FormatError
        If the plan is malformed.
    """

    def __init__(
        self,
        plan: ByteReader,
        charts: tuple[Chart, ...],
        exemplar_shape: tuple[int, int],
        fields: Sequence[WarpField | None],
        budget: PaintBudget,
    ) -> None:
        self.charts, self.exemplar_shape, self.warp_fields = charts, exemplar_shape, fields
        self.plan, self._turned = _parse(plan, charts)
        self._budget, self._sizes = budget, chart_sizes(charts)
        self.order = list(dict.fromkeys(grid.chart for grid in self.plan.grids))
        self.total = int(self.plan.starts[-1])
        self.known = self.known_cells = self.total_cells = 0
        self._sources = BitReader(kernels.BLOCK_COUNTERS, kernels.BLOCK_INPUTS)
        self._masks = BitReader(mask_kernels.MASK_COUNTERS, mask_kernels.MASK_INPUTS)
        self._records = np.zeros((0, records_.COLUMNS), np.int32)
        self._windows = np.zeros((0, 4), np.int32)
        self._first = np.zeros(0, np.int64)
        self._cells = np.zeros(0, np.uint8)
        self._straight = np.zeros(0, np.uint8)  # the cells of straight cuts
        self._straight_covered = np.zeros((0, 0), np.uint8)
        self._straight_done = 0  # grids that have them
        self._is_begun = False
        self._done = 0  # grids whose sources are known
        self._mask_grid = self._mask_start = self._mask_place = 0
        self._covered = np.zeros((0, 0), np.uint8)
        self.go_on()

    @property
    def complete(self) -> bool:
        """Whether every block and every cell is known."""
        return self._done == len(self.plan.grids) and self.known_cells == self.total_cells

    @property
    def unread(self) -> int:
        """Bytes that came and that no symbol needed."""
        return self._sources.unread + self._masks.unread

    def feed_sources(self, data: bytes) -> None:
        """Take further bytes of the sources.

        Raises
        ------
        FormatError
            If a block lies outside its chart or the exemplar.
        """
        self._sources.feed(data)
        self.go_on()

    def feed_masks(self, data: bytes) -> None:
        """Take further bytes of the masks; all sources must be known.

        Raises
        ------
        FormatError
            If there are no masks, or sources are missing.
        """
        if self._done < len(self.plan.grids) or not self.total_cells:
            raise FormatError("masks come where none are due")
        self._masks.feed(data)
        if not len(self._cells):
            self._cells = np.zeros(self.total_cells, np.uint8)
        while self._mask_grid < len(self.plan.grids):
            if not self._read_masks(self._mask_grid):
                self.known_cells = int(self._first[self._mask_start])
                return
            self._mask_grid, self._mask_place = self._mask_grid + 1, 0
        self.known_cells = self.total_cells

    def charts_known(self) -> int:
        """Return how many charts have all their sources known: they arrive one after another."""
        return len(self._charts_done())

    def _charts_done(self) -> list[int]:
        # Charts all of whose grids are known.
        grids = self.plan.grids
        waiting = {grid.chart for grid in grids[self._done :]}
        return [n for n in dict.fromkeys(grid.chart for grid in grids[: self._done]) if n not in waiting]

    def quilt(self) -> Quilt:
        """Return the quilt as far as it is known.

        Charts that are not known yet have no placements; masks that are not known yet are straight cuts.
        """
        known = int(self.plan.starts[self._done])
        blocks, cells = _blocks(self._records[:known]), self._known_cells()
        if self._done == len(self.plan.grids):
            fields = tuple(field for field in self.warp_fields if field is not None)
            return Quilt(
                self.charts, self.exemplar_shape, replace(self.plan, blocks=blocks, mask_cells=cells), fields
            )
        part = GridPlan(self.plan.grids[: self._done], self.plan.feather, blocks, cells)
        placed, cells = part.placements(self.charts)
        done = self._charts_done()
        placed = placed[np.isin(placed["chart"], done)]
        return known_part(self.charts, self.exemplar_shape, placed, cells, done, self.warp_fields)

    def _known_cells(self) -> NDArray[np.uint8]:
        # Cells of masks, straight cuts where they are not known; where some of a chart's masks are known, its
        # others are cut by what those cover.
        if self.known_cells == self.total_cells > 0:
            return self._cells
        cells = self._all_straight().copy()
        cells[: self.known_cells] = self._cells[: self.known_cells]
        if 0 < self.known_cells < self.total_cells:
            chart, covered = self.plan.grids[self._mask_grid].chart, self._covered
            settled = (np.arange(len(self._first)) < self._mask_start).astype(np.uint8)
            begun = next(n for n, grid in enumerate(self.plan.grids) if grid.chart == chart)
            if not self._records[self.plan.starts[begun] : self._mask_start, records_.CUT].any():
                return cells  # none of this chart's masks have come
            for place, grid in enumerate(self.plan.grids):
                if grid.chart == chart:
                    covered = self._cut_straight(place, cells, settled, covered)
        return cells

    def _all_straight(self) -> NDArray[np.uint8]:
        # The cells of straight cuts of all grids whose sources are known: made when they are asked for.
        self._straight = grown(self._straight, self.total_cells)
        settled = np.zeros(int(self.plan.starts[self._done]), np.uint8)
        for place in range(self._straight_done, self._done):
            self._straight_covered = self._cut_straight(
                place, self._straight, settled, self._straight_covered
            )
        self._straight_done = self._done
        return self._straight[: self.total_cells]

    def _cut_straight(
        self, place: int, cells: NDArray[np.uint8], settled: NDArray[np.uint8], covered: NDArray[np.uint8]
    ) -> NDArray[np.uint8]:
        covered = _covered(self.plan, place, self.charts, covered)
        start, stop = self.plan.starts[place : place + 2].tolist()
        first_own = start + self.plan.grids[place].transferred
        cut_straight(
            self._records, self._windows, self._first, cells, settled, covered, first_own, start, stop
        )
        return covered

    def _begin_grid(self, field: WarpField) -> None:
        grid, base = self.plan.grids[self._done], int(self.plan.starts[self._done])
        n = grid.chart
        self._matrices = field.matrices
        self._numbers = _numbers(
            grid, self.charts[n], field, self.exemplar_shape, self.plan.feather, self._turned, base
        )
        self._records = grown(self._records, base + grid.blocks)
        self._there = np.zeros(grid.positions, np.uint8)
        self._lookup = np.full((grid.rows + 2, grid.across + 2), -1, np.int32)
        self._symbols = self._own = 0
        self._is_begun = True

    def go_on(self) -> None:
        """Read on, as far as sources and warp fields have come."""
        first = self._done
        self._decode_sources()
        if self._done > first:
            self._check_grids(first)

    def _decode_sources(self) -> None:
        while self._done < len(self.plan.grids):
            grid = self.plan.grids[self._done]
            field = self.warp_fields[grid.chart]
            if field is None:
                return
            if not self._is_begun:
                self._begin_grid(field)
            end = grid.transferred + grid.positions
            stop = min(end, self._symbols + BATCH)
            done, self._own = kernels.code_blocks(
                self._sources.coder,
                self._records,
                self.plan.starts,
                self._done,
                self._there,
                self._lookup,
                self._matrices,
                self._numbers,
                (self._symbols, stop),
                self._own,
                False,
            )
            if done < 0:
                raise FormatError(f"block {-1 - done} of a chart is outside what is allowed")
            self._symbols = done
            self.known = int(self.plan.starts[self._done]) + min(done, grid.transferred) + self._own
            if done < stop:
                return
            if done == end:
                self._end_grid(grid)

    def _end_grid(self, grid: ChartGrid) -> None:
        if self._own != grid.own:
            raise FormatError(f"chart {grid.chart} has other blocks than its plan says")
        self._done += 1
        self._is_begun = False

    def _check_grids(self, first: int) -> None:
        # What the sources of the grids from one on tell, all at once: there may be very many.
        start, stop = self.plan.starts[[first, self._done]].tolist()
        blocks = _blocks(self._records[start:stop])
        grids = self.plan.grids[first : self._done]
        placed = GridPlan(grids, self.plan.feather, blocks, np.zeros(0, np.uint8)).in_order()
        in_turn = np.argsort(placed["chart"], kind="stable")
        check_decoded(placed[in_turn], self._sizes, self.warp_fields, self.exemplar_shape)
        self._budget.spend(placed)
        windows = mask_windows(placed, self._sizes)
        sizes = np.where(
            blocks["cut"] == 1, (windows[:, 1] - windows[:, 0]) * (windows[:, 3] - windows[:, 2]), 0
        )
        self._windows, self._first = grown(self._windows, stop), grown(self._first, stop)
        self._windows[start:stop] = windows
        self._first[start:stop] = self.total_cells + np.cumsum(sizes) - sizes
        self.total_cells += int(sizes.sum())
        if self.total_cells > MAX_CELLS:
            raise FormatError(f"masks have {self.total_cells} cells; allowed: {MAX_CELLS}")
        self._budget.check_cells(self.total_cells)

    def _read_masks(self, place: int) -> bool:
        # Whether all masks of a grid are known.
        grid, (base, stop) = self.plan.grids[place], self.plan.starts[place : place + 2].tolist()
        if self._mask_start == base and self._mask_place == 0:
            self._covered = _covered(self.plan, place, self.charts, self._covered)
        self._mask_start, self._mask_place = mask_kernels.code_masks(
            self._masks.coder,
            self._records,
            self._windows,
            self._first,
            self._cells,
            self._covered,
            grid.mask_cell,
            base + grid.transferred,
            self._mask_start,
            stop,
            self._mask_place,
            False,
        )
        return bool(self._mask_start == stop)


def _blocks(records: NDArray[np.int32]) -> NDArray[np.void]:
    # Records as blocks.
    blocks = np.zeros(len(records), BLOCK)
    for n, name in enumerate(_RECORD_NAMES):
        blocks[name] = records[:, n]
    blocks["link"], blocks["centred"] = records[:, records_.LINK], records[:, records_.CENTRED]
    centred = records[:, records_.CENTRED, None] > 0
    blocks["matrix"] = np.where(centred, records[:, records_.CENTRE : records_.CENTRE + 4], 0)
    return blocks
