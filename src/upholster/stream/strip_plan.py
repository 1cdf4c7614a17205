"""A strip plan in a stream: a few numbers, the strips, and one source a block."""

from itertools import pairwise

import numpy as np

from upholster.errors import FormatError
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.methods.quilt.old_plans import Strip, StripLayout, StripPlan
from upholster.methods.quilt.old_plans.strips import edge_length
from upholster.quilt.warp_field import WarpField
from upholster.stream import _strip_kernels as kernels
from upholster.stream._list_kernels import CELL_COUNTERS
from upholster.stream.budget import PaintBudget, strips_work
from upholster.stream.byte_reader import ByteReader, varint
from upholster.stream.coder import BitReader, BitWriter
from upholster.stream.list_plan import MaskRun, decode_cells, encode_cells
from upholster.stream.plan_common import (
    BATCH,
    MAX_CELLS,
    MAX_PLACEMENTS,
    STRIPS,
    PlanCode,
    grown,
    known_part,
)

__all__ = ["StripDecoder", "encode_strips"]

MOST_BLOCK, MOST_STRIPS, MOST_FEATHER = 256, 4 * 65_536, 16

_OPPOSED, _PARTIAL = 16, 32


def encode_strips(plan: StripPlan) -> PlanCode:
    """Encode a strip plan."""
    layout, chosen = plan.layout, np.array(plan.chosen, np.int32)
    writer = BitWriter(kernels.SOURCE_COUNTERS, 4)
    modes = np.zeros(len(chosen), np.uint8)
    ends = []
    for (start, across, strip), (end, _, _) in pairwise(layout.runs.tolist()):
        writer.room(64 * (end - start) + 64)
        kernels.code_sources(
            writer.coder,
            chosen,
            modes,
            (start, end),
            kernels.Run(start, across, strip),
            _candidates(layout, strip),
            True,
        )
        ends.append(writer.length)
    masks = encode_cells(plan.masks, _mask_runs(layout))
    head, order = bytes([STRIPS]) + _layout_bytes(layout), range(len(layout.charts))
    # A chart's blocks are there before those of any strip, and all masks come at the end.
    return PlanCode.of(head, writer.finish(), masks, order, ends[: len(order)], [0] * len(order))


def _candidates(layout: StripLayout, strip: int) -> kernels.CandidateGrid:
    block = layout.edge_block if strip else layout.block
    return kernels.CandidateGrid(*layout.candidates(block), max(1, (block - layout.overlap) // layout.tile))


def _layout_bytes(layout: StripLayout) -> bytes:
    # Charts and exemplar are told elsewhere.
    out = [varint(layout.block), varint(layout.overlap), bytes([layout.tile.bit_length() - 1])]
    out += [varint(len(layout.strips))]
    if layout.strips:
        out += [varint(layout.edge_block), bytes([layout.mask_cell, layout.feather])]
    for strip in layout.strips:
        partial = not _is_whole(layout, strip)
        head = strip.edge_a | strip.edge_b << 2 | _OPPOSED * strip.opposed | _PARTIAL * partial
        out += [bytes([head]), varint(strip.a), varint(strip.b)]
        if partial:
            out += [varint(strip.start), varint(strip.length), varint(strip.other)]
    return b"".join(out)


def _is_whole(layout: StripLayout, strip: Strip) -> bool:
    length = edge_length(layout.charts[strip.a], strip.edge_a)
    return (strip.start, strip.length, strip.other) == (0, length, 0)


def _parse_layout(
    reader: ByteReader, charts: tuple[Chart, ...], exemplar_shape: tuple[int, int]
) -> StripLayout:
    # Read back, checked that it fits charts and exemplar.
    most = min(MOST_BLOCK, *exemplar_shape)
    block = edge_block = reader.varint("block", most, 2)
    overlap = reader.varint("overlap", (block - 1) // 2, 1)
    tile = 1 << reader.byte("levels", 6)
    cell = feather = 0
    count = reader.varint("number of strips", MOST_STRIPS)
    if count:
        edge_block = reader.varint("edge block", most, 2 * overlap + 1)
        cell, feather = reader.byte("cell"), reader.byte("feather", MOST_FEATHER)
        if cell == 0 or edge_block % cell or edge_block % 2:
            raise reader.error(
                f"cell is {cell}; allowed: divisors of the edge block, {edge_block}, which is even"
            )
    strips = []
    for _ in range(count):
        head = reader.byte("strip", 63)
        a = reader.varint("chart", len(charts) - 1)
        b = reader.varint("chart", len(charts) - 1)
        edge_a, edge_b = head & 3, head >> 2 & 3
        long_a, long_b = edge_length(charts[a], edge_a), edge_length(charts[b], edge_b)
        start, length, other = 0, long_a, 0
        if head & _PARTIAL:
            start = reader.varint("start of a strip", long_a)
            length = reader.varint("length of a strip", long_a - start)
            other = reader.varint("start of a strip on its other chart", long_b)
        if length < edge_block or other + length > long_b:
            raise reader.error(
                f"strip of {length} texels at {other}; "
                f"allowed: an edge block, {edge_block}, to what fits {long_b}"
            )
        strips.append(Strip(a, b, edge_a, edge_b, bool(head & _OPPOSED), start, length, other))
    return StripLayout(charts, exemplar_shape, block, edge_block, overlap, tile, cell, feather, tuple(strips))


def _mask_runs(layout: StripLayout) -> list[MaskRun]:
    # The place is 1 for a strip's first mask, 2 for the last, 3 for an only one, 0 for those between.
    area, runs = layout.side**2, []
    for n, strip in enumerate(layout.strips):
        start, count = int(layout.mask_starts[n]), layout.blocks_along(strip)
        for low, high in pairwise(sorted({0, 1, count - 1, count})):
            place = (low == 0) + 2 * (high == count)
            runs.append((start + low * area, layout.side, layout.side, place, start + high * area))
    return runs


class StripDecoder:
    """Decodes a strip plan as its bytes arrive, see `upholster.stream.plan_common.PlanDecoder`.

    Parameters
    ----------
    plan
        The plan's bytes behind its kind.
    charts, exemplar_shape
        As in `Quilt`.
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
        budget: PaintBudget,
    ) -> None:
        self.order = list(range(len(charts)))
        self.layout = _parse_layout(plan, charts, exemplar_shape)
        self.total, self.total_cells = self.layout.count, int(self.layout.mask_starts[-1])
        # Each cell is stored for both charts.
        if self.total > MAX_PLACEMENTS or self.total_cells > MAX_CELLS // 2:
            raise plan.error(
                f"plan has {self.total} placements, {self.total_cells} cells; "
                f"allowed: {MAX_PLACEMENTS}, {MAX_CELLS // 2}"
            )
        plan.end("plan")
        budget.check_cells(self.total_cells)
        budget.take(strips_work(self.layout))
        self.known = self.known_cells = 0
        self._sources = BitReader(kernels.SOURCE_COUNTERS, 4)
        self._masks = BitReader(CELL_COUNTERS, 3) if self.total_cells else None
        self._mask_runs = _mask_runs(self.layout)
        self._chosen = np.zeros(BATCH, np.int32)
        self._modes = np.zeros(BATCH, np.uint8)
        self._cells = np.zeros(0, np.uint8)

    @property
    def complete(self) -> bool:
        """Whether every block and every cell is known."""
        return self.known == self.total and self.known_cells == self.total_cells

    @property
    def unread(self) -> int:
        """Bytes that came and that no symbol needed."""
        return self._sources.unread + (self._masks.unread if self._masks else 0)

    def feed_sources(self, data: bytes) -> None:
        """Take further bytes of the sources.

        Raises
        ------
        FormatError
            If a block reads outside the exemplar.
        """
        self._sources.feed(data)
        runs = self.layout.runs
        run = int(np.searchsorted(runs[:, 0], self.known, side="right")) - 1
        while self.known < self.total:
            first, across, strip = runs[run].tolist()
            end = int(runs[run + 1, 0])
            stop = min(end, self.known + BATCH)
            self._chosen, self._modes = grown(self._chosen, stop), grown(self._modes, stop)
            known = kernels.code_sources(
                self._sources.coder,
                self._chosen,
                self._modes,
                (self.known, stop),
                kernels.Run(first, across, strip),
                _candidates(self.layout, strip),
                False,
            )
            if known < 0:
                raise FormatError(f"source of block {-1 - known} lies outside the exemplar")
            self.known = known
            if known < stop:
                return
            run += known == end

    def go_on(self) -> None:
        """Do nothing: charts with strips have no warp fields."""

    def feed_masks(self, data: bytes) -> None:
        """Take further bytes of the masks; all sources must be known.

        Raises
        ------
        FormatError
            If there are no masks, or sources are missing.
        """
        if self._masks is None or self.known < self.total:
            raise FormatError("masks come where none are due")
        self._masks.feed(data)
        self._cells, self.known_cells = decode_cells(
            self._masks, self._cells, self.known_cells, self._mask_runs
        )

    def charts_known(self) -> int:
        """Return how many charts have all their own blocks known: they arrive one after another."""
        ends = self.layout.runs[1 : 1 + len(self.layout.charts), 0]
        return int(np.searchsorted(ends, self.known, side="right"))

    def quilt(self) -> Quilt:
        """Return the quilt as far as it is known.

        Charts that are not known yet have no placements. Edge blocks are there as soon as their masks are.
        """
        layout, cells = self.layout, self._cells[: self.known_cells].copy()
        if self.complete:
            plan = StripPlan(layout, self._chosen[: self.total].copy(), cells)
            return Quilt(layout.charts, layout.exemplar_shape, plan)
        charts = self.charts_known()
        placed, windows = layout.assemble(self._chosen, cells, charts)
        identity = (WarpField.identity(),) * len(layout.charts)
        return known_part(layout.charts, layout.exemplar_shape, placed, windows, range(charts), identity)
