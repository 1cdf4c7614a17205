"""The plan of a quilt to bytes and back: grids, placements, labels, each a chunk of its own (SPEC.md, 4, 5).

A decoder takes bytes as they come, and knows at once which placements and labels they determine.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from upholster.errors import FormatError, InputError
from upholster.quilt.displacement import centre_matrices, warped_sources
from upholster.quilt.labels import LabelMap, cell_centres
from upholster.quilt.model import Quilt
from upholster.quilt.placement import PLACEMENT, SYMMETRIES, bare_placement
from upholster.quilt.warp_field import WarpField
from upholster.stream import _plan_kernels as kernels
from upholster.stream.coder import BitReader, BitWriter
from upholster.stream.plan_head import MAX_PLACEMENTS, PlanHead, PlanPart

__all__ = ["PlanCode", "PlanDecoder", "encode_plan", "refuse_pixel"]

_PLACEMENTS_A_CALL, _CELLS_A_CALL = 256, 4096
"""Placements and cells coded in one call."""


@dataclass(frozen=True, slots=True)
class PlanCode:
    """A quilt's placements and labels as bytes.

    Attributes
    ----------
    head
        What `PlanDecoder` takes first.
    placements, labels
        What it is fed; `labels` is empty where none need telling.
    placement_ends, label_ends
        Per chart how many bytes of them tell the charts up to it, about.
    surprising
        Per chart over how many steps its labels show something else than what is shown before they come.
    """

    head: bytes
    placements: bytes
    labels: bytes
    placement_ends: tuple[int, ...]
    label_ends: tuple[int, ...]
    surprising: tuple[int, ...]


def encode_plan(quilt: Quilt) -> PlanCode:
    """Encode a quilt's placements and labels; its warp fields are told elsewhere, see `warp_fields`.

    Raises
    ------
    InputError
        For more placements or cells than the format holds, charts that differ in their number of layers or in
        `half`, or placements of which one's centre is not that of a cell behind the cell of the one before.
    """
    if len(quilt.placements) > MAX_PLACEMENTS:
        refuse_pixel(quilt.steps, quilt.exemplar_shape)
    quilt = _on_cells(quilt)
    head = PlanHead.of(quilt)
    placements, placement_ends = _encode_placements(quilt, head)
    labels, label_ends, surprising = _encode_labels(quilt, head)
    return PlanCode(head.pack(), placements, labels, placement_ends, label_ends, surprising)


def _on_cells(quilt: Quilt) -> Quilt:
    """Return a quilt in which the bare placements of charts that have not come stand on middles of cells."""
    placed = quilt.placements
    alone = np.flatnonzero(np.bincount(placed["chart"], minlength=len(quilt.charts)) == 1)
    moved = placed.copy()
    for chart in alone.tolist():
        first, layer = quilt.first_on(chart), quilt.labels[chart][0]
        one, at = placed[first : first + 1], []
        for name, count in zip(("row", "column"), layer.labels.shape, strict=True):
            centres = cell_centres(count, layer.cell, half=layer.half)
            at.append(centres[np.abs(centres - one[name]).argmin()])
            moved[name][first] = at[-1]
        for name, place, size in zip(
            ("source_row", "source_column"),
            warped_sources(quilt.fields[chart], one, [at[0]], [at[1]]),
            quilt.exemplar_shape,
            strict=True,
        ):
            moved[name][first] = np.clip(place[0], 0, 16 * size - 1)
    return replace(quilt, placements=moved)


def _encode_placements(quilt: Quilt, head: PlanHead) -> tuple[bytes, tuple[int, ...]]:
    writer, ends = BitWriter(kernels.PLACEMENT_COUNTERS, 1), []
    for part in head.parts():
        field = quilt.fields[part.number]
        placed = quilt.placements[part.start : part.stop]
        records = np.empty((part.count, kernels.COLUMNS), np.int32)
        records[:, : kernels.SYMMETRY] = part.cells_of(placed)
        records[:, kernels.SYMMETRY], records[:, kernels.CENTRED] = placed["symmetry"], placed["centred"]
        records[:, kernels.MATRIX : kernels.SOURCE] = centre_matrices(field, placed)
        records[:, kernels.SOURCE] = placed["source_row"]
        records[:, kernels.SOURCE + 1] = placed["source_column"]
        for start in range(0, part.count, _PLACEMENTS_A_CALL):
            writer.room(2048 * _PLACEMENTS_A_CALL)
            span = (0, start, min(part.count, start + _PLACEMENTS_A_CALL))
            grid = head.grid(part, field.margin, quilt.exemplar_shape)
            kernels.code_placements(writer.coder, records, field.matrices, SYMMETRIES, grid, span, True)
        ends.append(writer.length)
    coded = writer.finish()
    return coded, _ends(ends[head.layers - 1 :: head.layers], coded)


def _encode_labels(quilt: Quilt, head: PlanHead) -> tuple[bytes, tuple[int, ...], tuple[int, ...]]:
    writer, ends, told = BitWriter(kernels.LABEL_COUNTERS, 1), [], False
    surprising = np.zeros(len(quilt.charts), np.int64)
    for part in head.parts():
        if not part.is_settled:
            told = True
            placed = quilt.placements[part.start : part.stop]
            nearest = part.nearest(placed["row"], placed["column"])
            labels = np.array(quilt.labels[part.number][part.layer].labels)
            named = kernels.Named(part.layer, part.first, part.count)
            for start in range(0, labels.size, _CELLS_A_CALL):
                writer.room(64 * _CELLS_A_CALL)
                stop = min(labels.size, start + _CELLS_A_CALL)
                kernels.code_labels(writer.coder, labels, nearest, named, start, stop, True)
            # Of a second layer nothing is shown before its labels come.
            before = nearest if part.layer == 0 else part.blank()
            surprising[part.number] += part.cell**2 * np.count_nonzero(labels != before)
        ends.append(writer.length)
    coded = writer.finish() if told else b""
    return coded, _ends(ends[head.layers - 1 :: head.layers], coded), tuple(surprising.tolist())


def _ends(ends: Sequence[int], coded: bytes) -> tuple[int, ...]:
    # The last bytes may be fewer than were counted on the way.
    return (*(min(end, len(coded)) for end in ends[:-1]), len(coded))


def refuse_pixel(texels: int, shape: tuple[int, ...]) -> NoReturn:
    """Raise InputError: a stream would hold a source for each of so many texels, in a sample of `shape`."""
    bits = (shape[0] * shape[1] - 1).bit_length()
    raise InputError(
        f"method 'pixel' has no stream: {texels:,} texels with a source of {bits} bits each would take "
        f"{texels * bits / 8e6:.1f} MB; allowed with it: models, texels and pictures"
    )


class PlanDecoder:
    """Decodes placements and labels as their bytes arrive, chart after chart.

    Attributes
    ----------
    known, total
        How many placements are known, and how many there are.
    known_cells, total_cells
        The same of the labels that are told.

    Parameters
    ----------
    head
        Grids of cells and numbers of placements.
    exemplar_shape
        As in `Quilt`.
    fields
        Per chart its warp field, None while its nodes have not come; the decoder sees it when they have.
        Empty: the identity everywhere.
    """

    def __init__(
        self, head: PlanHead, exemplar_shape: tuple[int, int], fields: Sequence[WarpField | None] = ()
    ) -> None:
        self._head, self._shape = head, exemplar_shape
        self._fields = fields or (WarpField.identity(),) * len(head.charts)
        self._parts = list(head.parts())
        self._told = [part for part in self._parts if not part.is_settled]
        self.total, self.total_cells = head.total, sum(part.size for part in self._told)
        self.known = self.known_cells = 0
        self._parts_known = self._told_known = 0
        self._within = 0  # cells of the next part that is told
        self._placed = np.zeros((0, kernels.COLUMNS), np.int32)
        self._placements = BitReader(kernels.PLACEMENT_COUNTERS, 1)
        self._labels = BitReader(kernels.LABEL_COUNTERS, 1)
        self._nearest: dict[tuple[int, int], NDArray[np.int32]] = {}
        self._maps: dict[tuple[int, int], NDArray[np.int32]] = {}
        self._quilt: Quilt | None = None

    @property
    def density(self) -> float:
        """Texels for a step of the charts, each way, at which it is painted."""
        return self._head.density

    @property
    def complete(self) -> bool:
        """Whether every placement and every label is known."""
        return self.known == self.total and self.known_cells == self.total_cells

    @property
    def unread(self) -> int:
        """Bytes that came and that no symbol needed."""
        return self._placements.unread + self._labels.unread

    @property
    def charts_known(self) -> int:
        """How many charts have all their placements known: they arrive one after another."""
        return self._parts_known // self._head.layers

    @property
    def _waiting(self) -> int:
        # The chart whose labels come next; charts behind it have none.
        return self._told[self._told_known].number if self._told_known < len(self._told) else -1

    def feed_placements(self, data: bytes) -> None:
        """Take further bytes of the placements.

        Raises
        ------
        FormatError
            If a number of one is outside what is allowed.
        """
        self._placements.feed(data)
        self._read_placements()

    def go_on(self) -> None:
        """Read on: further warp fields are known. Raises as `feed_placements` does."""
        self._quilt = None
        self._read_placements()

    def _read_placements(self) -> None:
        while self._parts_known < len(self._parts):
            part = self._parts[self._parts_known]
            field = self._fields[part.number]
            if field is None:
                return
            stop = min(part.stop, self.known + _PLACEMENTS_A_CALL)
            self._placed = _grown(self._placed, stop)
            grid, span = self._head.grid(part, field.margin, self._shape), (part.start, self.known, stop)
            coder = self._placements.coder
            known = kernels.code_placements(
                coder, self._placed, field.matrices, SYMMETRIES, grid, span, False
            )
            if known < 0:
                raise FormatError(f"placement {-1 - known} has a number outside what is allowed")
            self.known = known
            if known < stop:
                return
            if known == part.stop:
                self._parts_known += 1
                self._quilt = None

    def feed_labels(self, data: bytes) -> None:
        """Take further bytes of the labels; all placements must be known.

        Raises
        ------
        FormatError
            If no labels are due, or one names no placement of its layer.
        """
        if not self._told or self.known < self.total:
            raise FormatError("labels come where none are due")
        self._labels.feed(data)
        while self._told_known < len(self._told):
            part = self._told[self._told_known]
            nearest = self._nearest_of(part)
            labels = self._maps.setdefault((part.number, part.layer), part.blank())
            stop = min(labels.size, self._within + _CELLS_A_CALL)
            named = kernels.Named(part.layer, part.first, part.count)
            known = kernels.code_labels(self._labels.coder, labels, nearest, named, self._within, stop, False)
            if known < 0:
                raise FormatError(f"a label of chart {part.number} names no placement of its layer")
            self.known_cells += known - self._within
            self._within = known
            if known < stop:
                return
            if known == labels.size:
                self._told_known, self._within, self._quilt = self._told_known + 1, 0, None

    def quilt(self) -> Quilt:
        """Return the quilt as far as it is known.

        Charts whose placements are not known have a bare one. Where labels are not known the nearest
        placement shows, and of a second layer nothing.
        """
        if self._quilt is None:
            charts, known = self._head.charts, self.charts_known
            placed = [self._known_placements()]
            for number, chart in enumerate(charts[known:], known):
                placed.append(bare_placement(number, (chart.height, chart.width), self._shape))
            labels = [LabelMap(part.cell, self._labels_of(part), part.half) for part in self._parts]
            identity, layers = WarpField.identity(), self._head.layers
            self._quilt = Quilt(
                charts,
                self._shape,
                np.concatenate(placed),
                tuple(tuple(labels[n : n + layers]) for n in range(0, len(labels), layers)),
                tuple(identity if field is None else field for field in self._fields),
                density=self._head.density,
            )
        return self._quilt

    def _labels_of(self, part: PlanPart) -> NDArray[np.int32]:
        place = part.number, part.layer
        if place in self._maps and part.number != self._waiting:
            return self._maps[place]
        if part.layer > 0 or part.is_settled or part.number >= self.charts_known:
            return part.blank()
        return self._nearest_of(part).copy()

    def _nearest_of(self, part: PlanPart) -> NDArray[np.int32]:
        place = part.number, part.layer
        if place not in self._nearest:
            cells = self._placed[part.start : part.stop]
            at = [
                cell_centres(count, part.cell, half=part.half)[cells[:, column]].astype(np.int32)
                for count, column in zip(part.shape, (kernels.ROW, kernels.COLUMN), strict=True)
            ]
            self._nearest[place] = part.nearest(at[0], at[1])
        return self._nearest[place]

    def _known_placements(self) -> NDArray[np.void]:
        counts = self._head.counts[: self.charts_known]
        owner = np.repeat(np.arange(counts.size), counts.reshape(-1))
        records = self._placed[: len(owner)]
        placed = np.zeros(len(owner), PLACEMENT)
        placed["chart"], placed["layer"] = np.divmod(owner, self._head.layers)
        cells = self._head.cells.reshape(-1)[owner]
        moved = np.where(np.array(self._head.half)[placed["layer"]], 0, 8 * cells)
        placed["row"] = 16 * cells * (records[:, kernels.ROW] - 1) + moved
        placed["column"] = 16 * cells * (records[:, kernels.COLUMN] - 1) + moved
        placed["symmetry"], placed["centred"] = records[:, kernels.SYMMETRY], records[:, kernels.CENTRED]
        own = records[:, [kernels.CENTRED]] > 0
        placed["matrix"] = np.where(own, records[:, kernels.MATRIX : kernels.SOURCE], 0)
        placed["source_row"], placed["source_column"] = records[:, kernels.SOURCE :].T
        return placed


def _grown(records: NDArray[np.int32], length: int) -> NDArray[np.int32]:
    """Return at least so many records, further ones 0: as many as have come, not as many as are told."""
    if length <= len(records):
        return records
    grown = np.zeros((max(length, len(records) + len(records) // 2), records.shape[1]), np.int32)
    grown[: len(records)] = records
    return grown
