"""A plain list of placements in a stream: every placement field by field."""

from bisect import bisect_right
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from upholster.errors import FormatError
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.methods.quilt.masked import MASK_CUT, MATRIX_UNIT, PLACEMENT, chart_sizes, mask_sizes, mask_windows
from upholster.quilt.warp_field import WarpField
from upholster.stream import _block_records as records_
from upholster.stream import _list_kernels as kernels
from upholster.stream._straight_kernels import cut_straight
from upholster.stream.budget import PaintBudget
from upholster.stream.byte_reader import ByteReader, varint
from upholster.stream.coder import BitReader, BitWriter
from upholster.stream.plan_common import (
    BATCH,
    FINE_LIST,
    LIST,
    MAX_CELLS,
    MAX_PLACEMENTS,
    PlanCode,
    check_decoded,
    grown,
    known_part,
)

__all__ = ["ListDecoder", "decode_cells", "encode_cells", "encode_list"]

_RECORDS_A_CALL = 256
_CHECKED_AT_ONCE = 2**16
_CENTRED, _MATRIX = 13, 14

FIELD_NAMES = (
    *("row", "column", "height", "width", "symmetry", "mask", "sides", "ramp", "mask_cell", "feather"),
    *("source_row", "source_column", "first_cell", "centred"),
)

MaskRun = tuple[int, int, int, int, int]
"""Masks of one shape in a row: first cell, rows, columns, place in a strip (0 outside of any), end."""


def encode_list(quilt: Quilt) -> PlanCode:
    """Encode a quilt field by field."""
    placed = quilt.placements
    counts = np.bincount(placed["chart"], minlength=len(quilt.charts))
    fine = bool(((placed["source_row"] | placed["source_column"]) & 15).any() or placed["centred"].any())
    head = bytes([FINE_LIST if fine else LIST]) + b"".join(varint(int(count)) for count in counts)
    fields = np.zeros((len(placed), kernels.FIELDS + 1), np.int64)
    for n, name in enumerate(FIELD_NAMES):
        fields[:, n] = placed[name] >> (4 if name.startswith("source") and not fine else 0)
    fields[:, _MATRIX : _MATRIX + 4] = np.where(placed["centred"][:, None] > 0, placed["matrix"], 0)
    ends = np.cumsum(counts)
    for n, field in enumerate(quilt.fields if fine else ()):
        part = fields[ends[n] - counts[n] : ends[n]]
        rest = part[:, _MATRIX : _MATRIX + 4] - field.integers_at(part[:, 0], part[:, 1])
        part[(part[:, _CENTRED] > 0) & (rest % MATRIX_UNIT == 0).all(axis=1), _CENTRED] = 2
    limits = np.array([[-(2**62), 2**62]] * kernels.FIELDS, np.int64)
    sizes = chart_sizes(quilt.charts)[placed["chart"]]
    writer, source_ends = BitWriter(kernels.FIELD_COUNTERS, 1), []
    for chart, end in enumerate(ends.tolist()):
        field = quilt.fields[chart]
        for start in range(end - int(counts[chart]), end, _RECORDS_A_CALL):
            writer.room(2048 * _RECORDS_A_CALL)
            stop = min(end, start + _RECORDS_A_CALL)
            kernels.code_fields(
                writer.coder, fields, sizes, limits, fine, field.matrices, field.margin, start, stop, True
            )
        source_ends.append(writer.length)
    cells = len(quilt.mask_cells)
    masks = encode_cells(quilt.mask_cells, _mask_runs(placed, quilt.charts, cells))
    # Cells are coded in the order of the placements, mostly, and each takes about as much.
    told = np.bincount(placed["chart"], mask_sizes(placed, quilt.charts) * (placed["mask"] == MASK_CUT))
    told = np.concatenate([told, np.zeros(len(counts) - len(told))])
    mask_ends = (np.cumsum(told) * (len(masks) / max(1, cells))).astype(int).tolist()
    order = range(len(counts))
    return PlanCode.of(head + varint(cells), writer.finish(), masks, order, source_ends, mask_ends)


def encode_cells(cells: NDArray[np.uint8], runs: list[MaskRun]) -> bytes:
    """Encode cells of masks, in runs of masks of one shape."""
    if not len(cells):
        return b""
    writer = BitWriter(kernels.CELL_COUNTERS, 3)
    cells = np.array(cells)
    for first, rows, columns, place, end in runs:
        for start in range(first, end, BATCH):
            writer.room(2 * BATCH + 64)
            stop = min(end, start + BATCH)
            kernels.code_cells(writer.coder, cells, start, stop, first, rows, columns, place, True)
    return writer.finish()


def decode_cells(
    reader: BitReader, cells: NDArray[np.uint8], known: int, runs: list[MaskRun]
) -> tuple[NDArray[np.uint8], int]:
    """Decode further cells of masks; return all so far, in an array that may be longer, and their number."""
    for run in range(bisect_right(runs, known, key=itemgetter(4)), len(runs)):
        first, rows, columns, place, end = runs[run]
        while known < end:
            stop = min(end, known + BATCH)
            cells = grown(cells, stop)
            known = kernels.code_cells(reader.coder, cells, known, stop, first, rows, columns, place, False)
            if known < stop:
                return cells, known
    return cells, known


class ListDecoder:
    """Decodes a list of placements as their bytes arrive, see `upholster.stream.plan_common.PlanDecoder`.

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
    fine
        Whether sources are in 1/16 pixel and there may be centre matrices.

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
        *,
        fine: bool,
    ) -> None:
        self.charts, self.exemplar_shape, self.warp_fields = charts, exemplar_shape, fields
        self.order = list(range(len(charts)))
        self._fine, self._budget = fine, budget
        counts = [plan.varint("number of placements", MAX_PLACEMENTS) for _ in charts]
        self._ends = np.cumsum(counts, dtype=np.int64)
        self.total, self.total_cells = int(self._ends[-1]), plan.varint("number of cells", MAX_CELLS)
        if self.total > MAX_PLACEMENTS:
            raise plan.error(f"plan has {self.total} placements; allowed: {MAX_PLACEMENTS}")
        plan.end("plan")
        budget.check_cells(self.total_cells)
        self._chart_sizes = chart_sizes(charts)
        self._sizes = np.repeat(self._chart_sizes, counts, axis=0)
        self.known = self.known_cells = 0
        self._sources = BitReader(kernels.FIELD_COUNTERS, 1)
        self._masks = BitReader(kernels.CELL_COUNTERS, 3) if self.total_cells else None
        self._fields = np.zeros((0, kernels.FIELDS + 1), np.int64)
        self._cells = np.zeros(0, np.uint8)

    @property
    def complete(self) -> bool:
        """Whether every placement and every cell is known."""
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
            If a placement lies outside its chart or the exemplar.
        """
        self._sources.feed(data)
        self.go_on()

    def go_on(self) -> None:
        """Read on, as far as placements and warp fields have come."""
        limits = _limits(self.exemplar_shape, 1 if self._fine else 16)
        first, missing = self.known, False
        while self.known < self.total and not missing:
            start = self.known
            chart = int(np.searchsorted(self._ends, start, side="right"))
            stop = min(int(self._ends[chart]), start + BATCH)
            field = self.warp_fields[chart]
            if field is None:
                break
            self._fields = grown(self._fields, stop)
            known = kernels.code_fields(
                self._sources.coder,
                self._fields,
                self._sizes,
                limits,
                self._fine,
                field.matrices,
                field.margin,
                start,
                stop,
                False,
            )
            if known < 0:
                raise FormatError(f"a field of placement {-1 - known} is outside what is allowed")
            self.known, missing = known, known < stop
            if known - first >= _CHECKED_AT_ONCE:
                self._check(first, known)
                first = known
        # Not chart by chart, of which there may be very many.
        if self.known > first:
            self._check(first, self.known)

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

    @cached_property
    def _mask_runs(self) -> list[MaskRun]:
        return _mask_runs(self._placements(0, self.total), self.charts, self.total_cells)

    def charts_known(self) -> int:
        """Return how many charts have all their placements known: they arrive one after another."""
        return int(np.searchsorted(self._ends, self.known, side="right"))

    def quilt(self) -> Quilt:
        """Return the quilt as far as it is known.

        Charts that are not known yet have no placements; masks that are not known yet are straight cuts.
        """
        charts = self.charts_known()
        placed = self._placements(0, int(self._ends[charts - 1]) if charts else 0)
        cells = self._cells[: self.known_cells].copy()
        cut = placed["mask"] == MASK_CUT
        unknown = cut & (placed["first_cell"] + mask_sizes(placed, self.charts) > self.known_cells)
        if unknown.any():
            cells = self._cut_straight(placed, cells, unknown)
        known = range(charts)
        return known_part(self.charts, self.exemplar_shape, placed, cells, known, self.warp_fields)

    def _cut_straight(
        self, placed: NDArray[np.void], cells: NDArray[np.uint8], unknown: NDArray[np.bool_]
    ) -> NDArray[np.uint8]:
        # Cuts unknown masks straight, each in cells of its own behind those that are known.
        windows = mask_windows(placed, self.charts)
        sizes = np.where(unknown, mask_sizes(placed, self.charts), 0)
        placed["first_cell"][unknown] = (len(cells) + np.cumsum(sizes) - sizes)[unknown]
        cells = np.concatenate([cells, np.zeros(int(sizes.sum()), np.uint8)])
        records = np.zeros((len(placed), records_.COLUMNS), np.int32)
        for column, name in enumerate(("row", "column", "height", "width")):
            records[:, column] = placed[name]
        records[:, records_.CUT] = placed["mask"] == MASK_CUT
        records[:, records_.SIZE] = placed["mask_cell"]
        ends = np.searchsorted(placed["chart"], np.arange(len(self.charts) + 1)).tolist()
        for chart, (start, stop) in zip(self.charts, pairwise(ends), strict=True):
            if stop > start:
                cut_straight(
                    records,
                    windows.astype(np.int32),
                    placed["first_cell"].astype(np.int64),
                    cells,
                    (~unknown).astype(np.uint8),
                    np.zeros((chart.height, chart.width), np.uint8),
                    0,
                    start,
                    stop,
                )
        return cells

    def _check(self, start: int, stop: int) -> None:
        placed = self._placements(start, stop)
        check_decoded(placed, self._chart_sizes, self.warp_fields, self.exemplar_shape)
        ends = placed["first_cell"].astype(np.int64) + mask_sizes(placed, self._chart_sizes)
        wrong = (placed["mask"] == MASK_CUT) & (
            (placed["mask_cell"] == 0) | (placed["first_cell"] < 0) | (ends > self.total_cells)
        )
        if wrong.any():
            raise FormatError(f"cells of placement {start + int(np.argmax(wrong))} are not there")
        self._budget.spend(placed)

    def _chart_of(self, start: int, stop: int) -> NDArray[np.int64]:
        return np.searchsorted(self._ends, np.arange(start, stop), side="right").astype(np.int64)

    def _placements(self, start: int, stop: int) -> NDArray[np.void]:
        placed = np.zeros(stop - start, PLACEMENT)
        placed["chart"] = self._chart_of(start, stop)
        for n, name in enumerate(FIELD_NAMES):
            unit = 16 if name.startswith("source") and not self._fine else 1
            placed[name] = self._fields[start:stop, n] * unit
        placed["centred"] = self._fields[start:stop, _CENTRED] > 0
        placed["matrix"] = self._fields[start:stop, _MATRIX : _MATRIX + 4]
        return placed


def _mask_runs(placed: NDArray[np.void], charts: tuple[Chart, ...], total: int) -> list[MaskRun]:
    # Masks that follow each other without gaps are coded each in its window's shape, anything else as one
    # long row.
    cut = placed[placed["mask"] == MASK_CUT]
    cut = cut[np.argsort(cut["first_cell"], kind="stable")]
    starts = cut["first_cell"].astype(np.int64)
    ends = starts + mask_sizes(cut, charts)
    if len(cut) and starts[0] == 0 and (ends[:-1] == starts[1:]).all() and ends[-1] == total:
        windows = mask_windows(cut, charts)
        rows, columns = windows[:, 1] - windows[:, 0], windows[:, 3] - windows[:, 2]
        return [
            (int(first), int(high), int(wide), 0, int(end))
            for first, high, wide, end in zip(starts, rows, columns, ends, strict=True)
        ]
    return [(0, 1, total, 0, total)] if total else []


def _limits(exemplar_shape: tuple[int, int], unit: int) -> NDArray[np.int64]:
    whole, byte = (-(2**31), 2**31 - 1), (0, 255)
    size, entry = (1, 4096), (-(2**18), 2**18)
    height, width = exemplar_shape
    sources = ((0, 16 * height // unit - 1), (0, 16 * width // unit - 1))
    told = (whole, whole, size, size, (0, 7), (0, 2), byte, byte, byte, (0, 16), *sources, whole, (0, 2))
    return np.array([*told, *[entry] * 4], np.int64)
