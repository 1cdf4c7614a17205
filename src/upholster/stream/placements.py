"""Placements to bytes and back: the plan, the sources, the masks, each a chunk of its own.

A *regular* quilt (`upholster.stream.regular`) needs one number a block; one of method "quilt" has a decoder
of its own (`upholster.stream.grid_decoder`); any other is told field by field. Whatever the plan, a decoder
takes bytes as they come and knows at once which placements they determine.
"""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.errors import FormatError, InputError
from upholster.quilt import Chart, Quilt
from upholster.quilt.model import MASK_CUT, MASK_NONE, PLACEMENT
from upholster.quilt.warp_field import WarpField
from upholster.stream import _kernels as kernels
from upholster.stream.byte_reader import ByteReader
from upholster.stream.coder import BitReader
from upholster.stream.grid_decoder import GridDecoder
from upholster.stream.mirrored import assemble
from upholster.stream.records import (
    BATCH,
    FIELD_NAMES,
    FINE,
    GRID,
    MAX_CELLS,
    MAX_PLACEMENTS,
    REGULAR,
    beside,
    cell_counts,
    general_masks,
    grown,
    strip_masks,
)
from upholster.stream.regular import Regular

__all__ = ["PlacementDecoder", "open_plan"]


class PlacementDecoder:
    """Decodes placements as their bytes arrive.

    Parameters
    ----------
    plan
        The plan's fields, behind its kind.
    charts, exemplar_shape, fields
        As in `Quilt`.
    scale
        Scale of charts that are not known yet, see `upholster.stream.mirrored`.
    kind
        GENERAL, REGULAR or FINE.

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
        fields: tuple[WarpField | None, ...] = (),
        scale: int = 0,
        *,
        kind: int,
    ) -> None:
        self.charts, self.exemplar_shape, self.fields, self.scale = charts, exemplar_shape, fields, scale
        self.regular: Regular | None = None
        self._unit = 1 if kind == FINE else 16
        if kind == REGULAR:
            if fields:
                raise plan.error("plan is regular where charts have warp fields")
            regular = Regular.parse(plan, charts, exemplar_shape)
            self.regular, self.total, cells = regular, regular.count, int(regular.mask_starts[-1])
            room = MAX_CELLS // 2  # each is held for both charts
        else:
            counts = [plan.varint("number of placements", MAX_PLACEMENTS) for _ in charts]
            self._ends = np.cumsum(counts, dtype=np.int64)
            self.total, cells = int(self._ends[-1]), plan.varint("number of cells", MAX_CELLS)
            room = MAX_CELLS
        if self.total > MAX_PLACEMENTS or cells > room:
            raise plan.error(
                f"plan has {self.total} placements, {cells} cells; allowed: {MAX_PLACEMENTS}, {room}"
            )
        plan.end("plan")
        self.total_cells = cells
        self.known = self.known_cells = 0
        """How many sources (of strip plans) or placements, and how many coded cells, are known."""
        regular_counters = kernels.SOURCE_COUNTERS, 4
        self._sources = BitReader(*(regular_counters if self.regular else (kernels.FIELD_COUNTERS, 1)))
        self._masks = BitReader(kernels.CELL_COUNTERS, 3) if cells else None
        self._chosen = np.zeros(BATCH, np.int32)
        self._modes = np.zeros(BATCH, np.uint8)
        self._fields = np.zeros((0, kernels.FIELDS + 1), np.int64)
        self._cells = np.zeros(0, np.uint8)
        self._mask_run = 0

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
        if self.regular:
            self._read_chosen(self.regular)
        else:
            self._read_fields()

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
        for first, rows, columns, place, end in self._mask_runs[self._mask_run :]:
            while self.known_cells < end:
                start = self.known_cells
                stop = min(end, start + BATCH)
                self._cells = grown(self._cells, stop)
                self.known_cells = kernels.code_cells(
                    *self._masks.model, self._cells, start, stop, first, rows, columns, place, False
                )
                if self.known_cells < stop:
                    return
            self._mask_run += 1

    @cached_property
    def _mask_runs(self) -> list[tuple[int, int, int, int, int]]:
        if self.regular:
            return list(strip_masks(self.regular))
        return general_masks(self._general_placements(self.total), self.total_cells)

    def charts_known(self) -> int:
        """How many charts have all their own blocks known: they arrive one after another."""
        ends = self.regular.runs[1 : 1 + len(self.charts), 0] if self.regular else self._ends
        return int(np.searchsorted(ends, self.known, side="right"))

    def quilt(self) -> Quilt:
        """Return the quilt as far as it is known.

        Charts that are not known yet repeat the exemplar, mirrored at its borders. Edge blocks are there as
        soon as their masks are; other cut placements are painted whole until then.
        """
        charts = self.charts_known()
        parts, cells = (
            self._regular_parts(self.regular, charts) if self.regular else self._general_parts(charts)
        )
        return assemble(
            self.charts, self.exemplar_shape, parts, range(charts), cells, self.fields, self.scale
        )

    def _regular_parts(self, plan: Regular, charts: int) -> tuple[list[NDArray[np.void]], NDArray[np.uint8]]:
        first = plan.runs[:, 0]
        parts = [plan.chart_blocks(n, self._chosen[first[n] : first[n + 1]]) for n in range(charts)]
        cells = []
        for n, start in enumerate(plan.mask_starts[:-1].tolist()):
            run, area = len(self.charts) + n, plan.side**2
            known = min(plan.blocks_along(plan.strips[n]), (self.known_cells - start) // area)
            if known <= 0:
                break
            chosen = self._chosen[first[run] : first[run] + known]
            parts += plan.strip_blocks(n, chosen)
            cells.append(plan.cells_of(n, self._cells[start : start + known * area]))
        return parts, np.concatenate([np.zeros(0, np.uint8), *cells])

    def _general_parts(self, charts: int) -> tuple[list[NDArray[np.void]], NDArray[np.uint8]]:
        placed = self._general_placements(int(self._ends[charts - 1]) if charts else 0)
        if self.known_cells == self.total_cells:
            return [placed], self._cells[: self.total_cells].copy()
        cut = placed["mask"] == MASK_CUT
        unknown = cut & (placed["cells"] + cell_counts(placed) > self.known_cells)
        placed["mask"][unknown], placed["cells"][unknown] = MASK_NONE, -1
        return [placed], self._cells[: self.known_cells].copy()

    def _read_chosen(self, plan: Regular) -> None:
        runs = plan.runs
        run = int(np.searchsorted(runs[:, 0], self.known, side="right")) - 1
        while self.known < self.total:
            first, across, strip = runs[run].tolist()
            end = int(runs[run + 1, 0])
            stop = min(end, self.known + BATCH)
            self._chosen, self._modes = grown(self._chosen, stop), grown(self._modes, stop)
            known = kernels.code_sources(
                *self._sources.model,
                self._sources.log,
                self._chosen,
                self._modes,
                self.known,
                stop,
                first,
                across,
                strip,
                max(1, plan.step // plan.tile),
                *plan.grid,
                False,
            )
            if known < 0:
                raise FormatError(f"source of block {-1 - known} lies outside the exemplar")
            self.known = known
            if known < stop:
                return
            run += known == end

    def _read_fields(self) -> None:
        limits = _limits(self.exemplar_shape, self._unit)
        while self.known < self.total:
            stop = min(self.total, self.known + BATCH)
            self._fields = grown(self._fields, stop)
            start = self.known
            known = kernels.code_fields(
                *self._sources.model,
                self._sources.log,
                self._fields,
                limits,
                16 // self._unit,
                start,
                stop,
                False,
            )
            if known < 0:
                raise FormatError(f"a field of placement {-1 - known} is outside what is allowed")
            self.known = known
            placed = self._general_placements(known, start)
            outside = beside(placed, self.charts)
            if outside.any():
                raise FormatError(f"placement {start + int(np.argmax(outside))} does not touch its chart")
            wrong = (placed["mask"] == MASK_CUT) & (
                (placed["cell"] == 0)
                | (placed["cells"] < 0)
                | (placed["cells"] + cell_counts(placed) > self.total_cells)
            )
            if wrong.any():
                raise FormatError(f"cells of placement {start + int(np.argmax(wrong))} are not there")
            placed["mask"][placed["mask"] == MASK_CUT] = MASK_NONE  # whose cells have not come
            try:
                Quilt(self.charts, self.exemplar_shape, placed, np.zeros(0, np.uint8), self.fields)
            except InputError as error:
                raise FormatError(str(error)) from None
            if known < stop:
                return

    def _general_placements(self, stop: int, start: int = 0) -> NDArray[np.void]:
        placed = np.zeros(stop - start, PLACEMENT)
        placed["chart"] = np.searchsorted(self._ends, np.arange(start, stop), side="right")
        for n, name in enumerate(FIELD_NAMES):
            placed[name] = self._fields[start:stop, n] * (self._unit if name.startswith("source") else 1)
        return placed


def _limits(exemplar_shape: tuple[int, int], unit: int) -> NDArray[np.int64]:
    whole, byte = (-(2**31), 2**31 - 1), (0, 255)
    size = (1, 4096)
    height, width = exemplar_shape
    sources = ((0, 16 * height // unit - 1), (0, 16 * width // unit - 1))
    return np.array([whole, whole, size, size, (0, 7), (0, 2), byte, byte, byte, (0, 16), *sources, whole])


def open_plan(
    plan: ByteReader,
    charts: tuple[Chart, ...],
    exemplar_shape: tuple[int, int],
    fields: tuple[WarpField | None, ...] = (),
    scale: int = 0,
) -> PlacementDecoder | GridDecoder:
    """Return the decoder of a plan, whichever kind it is.

    Raises
    ------
    FormatError
        If the plan is malformed.
    """
    kind = plan.byte("kind of plan", FINE)
    if kind == GRID:
        return GridDecoder(plan, charts, exemplar_shape, fields, scale)
    return PlacementDecoder(plan, charts, exemplar_shape, fields, scale, kind=kind)
