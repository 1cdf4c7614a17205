"""Quilts of method "quilt": on each chart what other charts' blocks leave on it, then its own on a raster.

The plan tells where the rasters lie; sources and masks are coded by what their neighbours make likely.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.quilt import Chart, Quilt
from upholster.quilt.model import MASK_CUT, MASK_NONE, MASK_RAMP, PLACEMENT
from upholster.stream import _block_records as kernels
from upholster.stream.byte_reader import ByteReader, varint

__all__ = ["MAX_GRID_CELLS", "ChartPlan", "GridPlan", "placements_of", "recognise_grid", "records_of"]

MAX_GRID_CELLS = 2**26
"""Cells over all blocks of a grid plan, those without a mask counted as well."""

_MOST_CELL, _MOST_FEATHER, _MOST_BLOCK, _MOST_LEVEL = 255, 16, 4096, 12
_MOST_POSITIONS = 2**19
_FAR = 2**20

_RECORD_NAMES = ("row", "column", "height", "width", "symmetry", "mask", "source_row", "source_column")


@dataclass(frozen=True, slots=True)
class ChartPlan:
    """Where a chart's blocks lie.

    Attributes
    ----------
    rows, across
        Positions of its raster.
    first_row, first_column
        Centre of the first position.
    height, width
        Size of its own blocks.
    step_row, step_column
        Distances of positions.
    level
        Level of the pyramid whose pixels new sources lie on.
    cell
        Size of the masks' cells in texels.
    transferred, skipped
        How many blocks come before its own, and how many positions have none.
    """

    rows: int
    across: int
    first_row: int
    first_column: int
    height: int
    width: int
    step_row: int
    step_column: int
    level: int
    cell: int
    transferred: int
    skipped: int

    @property
    def positions(self) -> int:
        """How many positions its raster has."""
        return self.rows * self.across

    @property
    def blocks(self) -> int:
        """How many blocks lie on the chart."""
        return self.transferred + self.positions - self.skipped

    def numbers(self, margin: int, exemplar_shape: tuple[int, int], base: int) -> NDArray[np.int64]:
        """Return what the kernels want to know, see `upholster.stream._block_records`."""
        p = np.zeros(kernels.SPEC, np.int64)
        p[: kernels.OWN] = (
            self.transferred, self.height, self.width, self.first_row, self.first_column,
            self.step_row, self.step_column, self.rows, self.across,
        )  # fmt: skip
        p[kernels.MARGIN], p[kernels.LEVEL], p[kernels.CELL], p[kernels.BASE] = (
            margin,
            self.level,
            self.cell,
            base,
        )
        p[kernels.EXEMPLAR_HEIGHT], p[kernels.EXEMPLAR_WIDTH] = exemplar_shape
        return p

    def cells_of(self, records: NDArray[np.int32]) -> NDArray[np.int64]:
        """Return how many cells each of its blocks has, or would have."""
        size = -(-records[:, [kernels.HEIGHT, kernels.WIDTH]].astype(np.int64) // self.cell)
        return np.asarray(size[:, 0] * size[:, 1])


_TOLD = [field.name for field in fields(ChartPlan)][:10]
_LEAST = dict.fromkeys(("rows", "across", "height", "width", "step_row", "step_column", "cell"), 1) | {
    "level": 0
}
_MOST = {"height": _MOST_BLOCK, "width": _MOST_BLOCK, "level": _MOST_LEVEL, "cell": _MOST_CELL}
_BEFORE_ALL = ChartPlan(1, 1, 20, 20, 40, 40, 28, 28, 0, 2, 0, 0)


@dataclass(frozen=True)
class GridPlan:
    """The plan of a quilt of method "quilt".

    Attributes
    ----------
    charts
        Where each chart's blocks lie.
    feather
        Of all cut masks.
    order
        The charts' numbers in coded order: what is transferred comes from charts before.
    """

    charts: tuple[ChartPlan, ...]
    feather: int
    order: tuple[int, ...]

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """Where each chart's blocks begin in coded order, and their number: (charts + 1,)."""
        counts = [self.charts[n].blocks for n in self.order]
        return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])

    def payload(self, charts: Sequence[Chart]) -> bytes:
        """Return it as bytes; charts are told elsewhere."""
        rising = self.order == tuple(range(len(self.order)))
        out = bytearray([self.feather, not rising])
        out += b"" if rising else b"".join(varint(n) for n in self.order)
        before = _BEFORE_ALL
        for chart, plan in zip(charts, self.charts, strict=True):
            guess = _guess(before, plan, chart)
            changes = [getattr(plan, name) - guess[name] for name in _TOLD]
            out += varint(sum(1 << n for n, change in enumerate(changes) if change))
            out += b"".join(
                varint(2 * change if change > 0 else -2 * change - 1) for change in changes if change
            )
            out += varint(plan.transferred) + varint(plan.skipped)
            before = plan
        return bytes(out)

    @classmethod
    def parse(cls, told: ByteReader, charts: Sequence[Chart], most_blocks: int) -> "GridPlan":
        """Read it back."""
        feather = told.byte("feather", _MOST_FEATHER)
        order = tuple(range(len(charts)))
        if told.byte("whether charts are in another order", 1):
            order = tuple(told.varint("number of a chart", len(charts) - 1) for _ in charts)
            if len(set(order)) < len(charts):
                raise told.error("a chart comes twice in the order")
        before, plans, blocks, positions = _BEFORE_ALL, [], 0, 0
        for chart in charts:
            changed = told.varint("which numbers of a raster change", 2 ** len(_TOLD) - 1)
            values: dict[str, int] = {}
            # Rows and columns are guessed from the numbers behind them.
            codes = {
                name: told.varint("change of a raster", 2**24, 1) if changed >> n & 1 else 0
                for n, name in enumerate(_TOLD)
            }
            for name in reversed(_TOLD):
                guess = _guess_one(name, before, values, chart)
                code = codes[name]
                values[name] = guess + (-(code + 1) // 2 if code & 1 else code // 2)
                least, most = _LEAST.get(name, -_FAR), _MOST.get(name, _FAR)
                if not least <= values[name] <= most:
                    raise told.error(f"{name} of a raster is {values[name]}; allowed: {least} to {most}")
            plan = ChartPlan(
                **values,
                transferred=told.varint("number of transferred blocks", most_blocks),
                skipped=told.varint("number of positions skipped", values["rows"] * values["across"]),
            )
            blocks, positions = blocks + plan.blocks, positions + plan.positions
            if blocks > most_blocks or positions > _MOST_POSITIONS:
                raise told.error(
                    f"plan has {blocks} blocks, {positions} positions; "
                    f"allowed: {most_blocks}, {_MOST_POSITIONS}"
                )
            plans.append(plan)
            before = plan
        return cls(tuple(plans), feather, order)


def _guess(before: ChartPlan, plan: ChartPlan, chart: Chart) -> dict[str, int]:
    values = {name: getattr(plan, name) for name in _TOLD}
    return {name: _guess_one(name, before, values, chart) for name in _TOLD}


def _guess_one(name: str, before: ChartPlan, values: dict[str, int], chart: Chart) -> int:
    # As on the chart before; as many positions as it takes to reach the chart's end.
    if name == "rows":
        beyond = chart.height - (values["first_row"] - values["height"] // 2) - values["height"]
        return max(1, 1 - (-beyond // values["step_row"]))
    if name == "across":
        beyond = chart.width - (values["first_column"] - values["width"] // 2) - values["width"]
        return max(1, 1 - (-beyond // values["step_column"]))
    return int(getattr(before, name))


def records_of(placed: NDArray[np.void]) -> NDArray[np.int32]:
    """Return placements as the kernels take them."""
    records = np.zeros((len(placed), kernels.COLUMNS), np.int32)
    for n, name in enumerate(_RECORD_NAMES):
        records[:, n] = placed[name]
    records[:, kernels.CUT] = placed["mask"] == MASK_CUT
    records[:, kernels.LINK] = -1
    return records


def placements_of(
    records: NDArray[np.int32], chart: int, cell: int, feather: int, first: NDArray[np.int64]
) -> NDArray[np.void]:
    """Return records of a chart as placements; `first` says where the cells of each begin, -1: not known."""
    placed = np.zeros(len(records), PLACEMENT)
    placed["chart"] = chart
    for n, name in enumerate(_RECORD_NAMES):
        placed[name] = records[:, n]
    cut = (records[:, kernels.CUT] == 1) & (first >= 0)
    placed["mask"] = np.where(cut, MASK_CUT, MASK_NONE)
    placed["cells"] = np.where(cut, first, -1)
    placed["cell"], placed["feather"] = np.where(cut, cell, 0), np.where(cut, feather, 0)
    return placed


def recognise_grid(quilt: Quilt) -> GridPlan | None:
    """Return the plan of a quilt whose blocks lie as method "quilt" lays them, None of any other."""
    placed = quilt.placements
    cut = placed["mask"] == MASK_CUT
    if (
        not cut.any()
        or (placed["mask"] == MASK_RAMP).any()
        or len(np.unique(placed["feather"][cut])) > 1
        or max(np.abs(placed["row"]).max(), np.abs(placed["column"]).max()) >= _FAR
    ):
        return None
    plans: list[ChartPlan] = []
    cells = 0
    for n in range(len(quilt.charts)):
        on_chart = quilt.on_chart(n)
        sizes = np.unique(on_chart["cell"][on_chart["mask"] == MASK_CUT])
        if len(sizes) > 1:
            return None
        before = plans[-1] if plans else _BEFORE_ALL
        plans.append(_chart_plan(on_chart, before, int(sizes[0]) if len(sizes) else before.cell))
        cells += int(plans[-1].cells_of(records_of(on_chart)).sum())
    positions, transferred = sum(plan.positions for plan in plans), sum(plan.transferred for plan in plans)
    if positions > _MOST_POSITIONS or transferred == len(placed) or cells > MAX_GRID_CELLS:
        return None
    return GridPlan(tuple(plans), int(placed["feather"][cut][0]), tuple(range(len(plans))))


def _chart_plan(placed: NDArray[np.void], before: ChartPlan, cell: int) -> ChartPlan:
    # The own blocks are the longest end that is alike, upright, and in raster order on an even grid.
    if not len(placed) or placed["symmetry"][-1]:
        return replace(before, rows=1, across=1, cell=cell, transferred=len(placed), skipped=1)
    last = placed[-1]
    like = (
        (placed["height"] == last["height"]) & (placed["width"] == last["width"]) & (placed["symmetry"] == 0)
    )
    rows, columns = placed["row"].astype(np.int64), placed["column"].astype(np.int64)
    onward = (np.diff(rows) > 0) | ((np.diff(rows) == 0) & (np.diff(columns) > 0))
    like[:-1] &= onward
    begin = _behind_last_false(like)
    step_row, step_column = _step(rows[begin:], before.step_row), _step(columns[begin:], before.step_column)
    on_grid = ((rows - rows[-1]) % step_row == 0) & ((columns - columns[-1]) % step_column == 0)
    on_grid[:begin] = False
    begin = _behind_last_false(on_grid)
    rows, columns = rows[begin:], columns[begin:]
    first_row, first_column = int(rows.min()), int(columns.min())
    high, wide = (
        int(rows.max() - first_row) // step_row + 1,
        int(columns.max() - first_column) // step_column + 1,
    )
    level = _level(placed[begin:])
    return ChartPlan(
        high, wide, first_row, first_column, int(last["height"]), int(last["width"]),
        step_row, step_column, level, cell, begin, high * wide - len(rows),
    )  # fmt: skip


def _behind_last_false(flags: NDArray[np.bool_]) -> int:
    wrong = np.flatnonzero(~flags)
    return int(wrong[-1]) + 1 if len(wrong) else 0


def _step(places: NDArray[np.int64], usual: int) -> int:
    # The commonest distance of places in use; one of a chart with a single row is as before.
    distances = np.diff(np.unique(places))
    if not len(distances):
        return usual
    values, counts = np.unique(distances, return_counts=True)
    return int(values[counts.argmax()])


def _level(own: NDArray[np.void]) -> int:
    # The one on whose pixels most sources lie.
    row, column = own["source_row"].astype(np.int64) + 8, own["source_column"].astype(np.int64) + 8
    levels = range(_MOST_LEVEL + 1)
    return int(
        np.argmax([((row % (16 << k) == 8 << k) & (column % (16 << k) == 8 << k)).sum() for k in levels])
    )
