"""Placements of method "quilt" as their bytes arrive (see `upholster.stream.grid`)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.errors import FormatError, InputError
from upholster.quilt import Chart, Quilt
from upholster.quilt.warp_field import UNIT, WarpField
from upholster.stream import _grid_kernels as kernels
from upholster.stream import _mask_kernels as mask_kernels
from upholster.stream._block_records import COLUMNS, CUT, OWN
from upholster.stream.byte_reader import ByteReader
from upholster.stream.coder import BitReader
from upholster.stream.grid import MAX_GRID_CELLS, ChartPlan, GridPlan, placements_of
from upholster.stream.mirrored import assemble
from upholster.stream.records import BATCH, MAX_PLACEMENTS, beside, grown

__all__ = ["PLAIN_MATRIX", "GridDecoder", "matrices_of"]

PLAIN_MATRIX = np.array([[[UNIT, 0, 0, UNIT]]], np.int32)
"""Matrices of a chart without an warp field."""


def matrices_of(field: WarpField | None) -> tuple[NDArray[np.int32], int]:
    """Return a field's matrices, as kernels want them, and its margin."""
    return (PLAIN_MATRIX.copy(), 0) if field is None else (np.array(field.matrices), field.margin)


class GridDecoder:
    """Decodes a grid plan's placements as their bytes arrive.

    Parameters
    ----------
    plan
        The plan's fields, behind its kind.
    charts, exemplar_shape, fields
        As in `Quilt`.
    scale
        Scale of charts that are not known yet, see `upholster.stream.mirrored`.

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
    ) -> None:
        self.charts, self.exemplar_shape, self.scale = charts, exemplar_shape, scale
        self.fields = fields
        self.plan = GridPlan.parse(plan, charts, MAX_PLACEMENTS)
        plan.end("plan")
        self.total = int(self.plan.starts[-1])
        self.known = self.known_cells = self.total_cells = 0
        """How many blocks and cells of masks are known, and how many cells known blocks have."""
        self._sources = BitReader(kernels.BLOCK_COUNTERS, kernels.BLOCK_INPUTS)
        self._masks = BitReader(mask_kernels.MASK_COUNTERS, mask_kernels.MASK_INPUTS)
        self._records = np.zeros((0, COLUMNS), np.int32)
        self._first = np.zeros(0, np.int64)
        self._cells = np.zeros(0, np.uint8)
        self._every_cell = 0
        self._done = 0  # charts whose sources are known
        self._mask_chart = self._mask_start = self._mask_place = 0
        self._covered = np.zeros((0, 0), np.uint8)
        self._begin_chart()
        self._read_sources()

    @property
    def complete(self) -> bool:
        """Whether every block and every cell is known."""
        return self._done == len(self.charts) and self.known_cells == self.total_cells

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
        self._read_sources()

    def feed_masks(self, data: bytes) -> None:
        """Take further bytes of the masks; all sources must be known.

        Raises
        ------
        FormatError
            If there are no masks, or sources are missing.
        """
        if self._done < len(self.charts) or not self.total_cells:
            raise FormatError("masks come where none are due")
        self._masks.feed(data)
        if not len(self._cells):
            self._cells = np.zeros(self.total_cells, np.uint8)
        while self._mask_chart < len(self.charts):
            n = self.plan.order[self._mask_chart]
            base, stop = self.plan.starts[self._mask_chart : self._mask_chart + 2].tolist()
            if self._mask_start == base and self._mask_place == 0:
                self._covered = np.zeros((self.charts[n].height, self.charts[n].width), np.uint8)
            self._mask_start, self._mask_place = mask_kernels.code_masks(
                *self._masks.model,
                self._records,
                self._first,
                self._cells,
                self._covered,
                self.plan.charts[n].transferred,
                self.plan.charts[n].cell,
                self.plan.feather,
                base,
                stop,
                self._mask_start,
                self._mask_place,
                False,
            )
            if self._mask_start < stop:
                self.known_cells = int(self._first[self._mask_start])
                return
            self._mask_chart, self._mask_place = self._mask_chart + 1, 0
        self.known_cells = self.total_cells

    def charts_known(self) -> int:
        """How many charts have all their sources known: they arrive one after another."""
        return self._done

    def quilt(self) -> Quilt:
        """Return the quilt as far as it is known.

        Charts that are not known yet repeat the exemplar, mirrored at its borders; blocks whose masks are not
        are painted whole.
        """
        parts = []
        for place, n in enumerate(self.plan.order[: self._done]):
            part = slice(*self.plan.starts[place : place + 2].tolist())
            records, first, plan = self._records[part], self._first[part], self.plan.charts[n]
            first = np.where(first + plan.cells_of(records) <= self.known_cells, first, -1)
            parts.append(placements_of(records, n, plan.cell, self.plan.feather, first))
        return assemble(
            self.charts,
            self.exemplar_shape,
            parts,
            self.plan.order[: self._done],
            self._cells[: self.known_cells].copy(),
            self.fields,
            self.scale,
        )

    def _field(self, chart: int) -> WarpField | None:
        return self.fields[chart] if self.fields else None

    def _begin_chart(self) -> None:
        if self._done == len(self.charts):
            return
        n = self.plan.order[self._done]
        plan, base = self.plan.charts[n], int(self.plan.starts[self._done])
        self._matrices, margin = matrices_of(self._field(n))
        self._numbers = plan.numbers(margin, self.exemplar_shape, base)
        self._records = grown(self._records, base + plan.blocks)
        self._there = np.zeros(plan.positions, np.uint8)
        self._lookup = np.full((plan.rows + 2, plan.across + 2), -1, np.int32)
        self._symbols = 0

    def _read_sources(self) -> None:
        while self._done < len(self.charts):
            plan = self.plan.charts[self.plan.order[self._done]]
            end = plan.transferred + plan.positions
            stop = min(end, self._symbols + BATCH)
            done = kernels.code_blocks(
                *self._sources.model,
                self._sources.log,
                self._records,
                self.plan.starts,
                self._done,
                self._there,
                self._lookup,
                self._matrices,
                self._numbers,
                self._symbols,
                stop,
                False,
            )
            if done < 0:
                raise FormatError(f"block {-1 - done} of a chart is outside what is allowed")
            self._symbols = done
            own = int(self._numbers[OWN])
            self.known = int(self.plan.starts[self._done]) + min(done, plan.transferred) + own
            if done < stop:
                return
            if done == end:
                self._end_chart(plan)

    def _end_chart(self, plan: ChartPlan) -> None:
        n = self.plan.order[self._done]
        if self._numbers[OWN] != plan.positions - plan.skipped:
            raise FormatError(f"chart {n} has other blocks than its plan says")
        part = self._records[slice(*self.plan.starts[self._done : self._done + 2].tolist())]
        counts = plan.cells_of(part)
        self._every_cell += int(counts.sum())
        if self._every_cell > MAX_GRID_CELLS:
            raise FormatError(f"blocks have {self._every_cell} cells; allowed: {MAX_GRID_CELLS}")
        counts = np.where(part[:, CUT] == 1, counts, 0)
        first = self.total_cells + np.cumsum(counts) - counts
        self._first = np.concatenate([self._first, first])
        self.total_cells += int(counts.sum())
        placed = placements_of(part, n, 1, 0, np.full_like(first, -1))
        _check(self.charts, self.exemplar_shape, self.fields, n, placed)
        self._done += 1
        self._begin_chart()


def _check(
    charts: tuple[Chart, ...],
    exemplar_shape: tuple[int, int],
    fields: Sequence[WarpField | None],
    chart: int,
    placed: NDArray[np.void],
) -> None:
    outside = beside(placed, charts)
    if outside.any():
        raise FormatError(f"block {int(np.argmax(outside))} of chart {chart} does not touch it")
    try:
        Quilt(charts, exemplar_shape, placed, np.zeros(0, np.uint8), tuple(fields))
    except InputError as error:
        raise FormatError(f"chart {chart}: {error}") from None
