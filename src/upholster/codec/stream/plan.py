"""The plan of a quilt to bytes and back: grids, placements, labels, each a chunk of its own (SPEC.md, 4, 5).

Placements are coded from coarse to fine over all charts: any first part of them covers everything. A decoder
takes bytes as they arrive, and determines placements and labels as early as possible.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError, InputError
from upholster.codec.stream import _placement_kernels as kernels
from upholster.codec.stream._label_code_kernels import LABEL_COUNTERS, NamedPlacements, code_labels
from upholster.codec.stream.bit_coder import BitReader, BitWriter
from upholster.codec.stream.plan_head import MAX_PLACEMENTS, PlanHead
from upholster.quilt.displacement import warped_sources
from upholster.quilt.labels import LabelMap, cell_centres
from upholster.quilt.model import Quilt
from upholster.quilt.placement import PLACEMENT, bare_placement
from upholster.quilt.warp_field import WarpField

__all__ = ["PlanCode", "PlanDecoder", "encode_plan", "refuse_pixel"]

_PLACEMENTS_A_CALL, _CELLS_A_CALL = 256, 4096
"""Number of placements and cells coded in one call."""

_GROWTH, _FEWEST = 1.125, 16
"""Placements are cut into parts when their number has grown by this factor, from this number on."""


@dataclass(frozen=True, slots=True)
class PlanCode:
    """A quilt's placements and labels as bytes.

    Attributes
    ----------
    head
        The head, which `PlanDecoder` takes first.
    placements, labels
        The bytes to feed to it; `labels` is empty if none need coding.
    placement_ends, label_ends
        Where they may be cut: the number of bytes, about, and the number of steps that show their final
        placement from there on. The steps of labels add to those of all placements.
    """

    head: bytes
    placements: bytes
    labels: bytes
    placement_ends: tuple[tuple[int, float], ...]
    label_ends: tuple[tuple[int, float], ...]


def encode_plan(quilt: Quilt) -> PlanCode:
    """Encode a quilt's placements and labels; warp fields are coded by `field_chunks`.

    Raises
    ------
    InputError
        For more placements or cells than the format allows, charts that differ in their number of layers or
        in `half`, or placements whose centres are not centres of cells, in the order of the cells.
    """
    if len(quilt.placements) > MAX_PLACEMENTS:
        refuse_pixel(quilt.steps, quilt.exemplar_shape)
    quilt = _on_cells(quilt)
    head = PlanHead.of(quilt)
    labels, label_ends, right = _encode_labels(quilt, head)
    placements, placement_ends = _encode_placements(quilt, head, right)
    return PlanCode(head.pack(), placements, labels, placement_ends, label_ends)


def _on_cells(quilt: Quilt) -> Quilt:
    """Return a quilt in which the bare placements of charts without data are on centres of cells."""
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


def _encode_placements(
    quilt: Quilt, head: PlanHead, right: NDArray[np.int64]
) -> tuple[bytes, tuple[tuple[int, float], ...]]:
    # `right`: for each placement the number of steps that show it while it is the nearest one.
    writer, placed = BitWriter(kernels.PLACEMENT_COUNTERS), quilt.placements
    given = np.zeros((len(placed), kernels.COLUMNS), np.int32)
    for number, part in enumerate(head.parts()):
        own = slice(part.start, part.stop)
        given[own, kernels.PART] = number
        given[own, kernels.ROW : kernels.SYMMETRY] = part.cells_of(placed[own])
    given[:, kernels.SYMMETRY], given[:, kernels.OFFSET : kernels.SOURCE] = (
        placed["symmetry"],
        placed["offset"],
    )
    given[:, kernels.SOURCE], given[:, kernels.SOURCE + 1] = placed["source_row"], placed["source_column"]
    boxes, records = _Boxes(head, np.arange(len(placed), dtype=np.int64)), np.zeros_like(given)
    units = kernels.Units(*quilt.exemplar_shape, *head.bits)
    cuts, lengths = _cuts(len(placed)), []
    for stop in cuts:
        done = 0
        while done < stop:
            waiting = boxes.with_room()
            writer.room(2**16)
            status = kernels.code_placements(writer.coder, waiting, units, given, records, stop, True)
            if status < 0:
                raise InputError(f"placement {done} has a number outside what a stream allows")
            done = int(waiting.counts[kernels.PLACED])
        lengths.append(writer.length)
    coded = writer.finish()
    order = _cell_order(records)
    shown = np.empty(len(placed), np.int64)
    shown[order] = right
    so_far = np.cumsum(shown)[np.array(cuts) - 1].astype(np.float64).tolist()
    lengths[-1] = len(coded)
    return coded, tuple((min(a, len(coded)), b) for a, b in zip(lengths, so_far, strict=True))


def _cuts(total: int) -> list[int]:
    found, count = [], float(_FEWEST)
    while count < total:
        found.append(int(count))
        count *= _GROWTH
    return [*found, total]


def _encode_labels(
    quilt: Quilt, head: PlanHead
) -> tuple[bytes, tuple[tuple[int, float], ...], NDArray[np.int64]]:
    writer, ends = BitWriter(LABEL_COUNTERS), []
    right, wrong = np.zeros(len(quilt.placements), np.int64), 0
    for part in head.parts():
        placed = quilt.placements[part.start : part.stop]
        labels = np.array(quilt.labels[part.number][part.layer].labels)
        nearest = labels if part.is_settled else part.nearest(placed["row"], placed["column"])
        if part.layer == 0:
            there = np.bincount(labels[labels == nearest], minlength=part.count)
            right[part.start : part.stop] = part.cell**2 * there
            wrong += part.cell**2 * int(np.count_nonzero(labels != nearest))
        else:  # a second layer shows nothing before its labels arrive
            wrong += part.cell**2 * int(np.count_nonzero(labels >= 0))
        if part.is_settled:
            continue
        named = NamedPlacements(part.layer, part.first, part.count)
        for start in range(0, labels.size, _CELLS_A_CALL):
            writer.room(64 * _CELLS_A_CALL)
            stop = min(labels.size, start + _CELLS_A_CALL)
            code_labels(writer.coder, labels, nearest, named, start, stop, True)
        ends.append((writer.length, float(wrong)))
    coded = writer.finish() if ends else b""
    return coded, tuple((min(a, len(coded)), b) for a, b in ends), right


def refuse_pixel(texels: int, shape: tuple[int, ...]) -> NoReturn:
    """Raise InputError: a stream would hold a source for each of these texels, in a sample of `shape`."""
    bits = (shape[0] * shape[1] - 1).bit_length()
    raise InputError(
        f"method 'pixel' has no stream: {texels:,} texels with a source of {bits} bits each would take "
        f"{texels * bits / 8e6:.1f} MB; allowed with it: models, texels and pictures"
    )


def _cell_order(records: NDArray[np.int32]) -> NDArray[np.intp]:
    """Return the order of placements by part and cell, row after row."""
    return np.lexsort((records[:, kernels.COLUMN], records[:, kernels.ROW], records[:, kernels.PART]))


class _Boxes:
    """The boxes that wait, with room for new ones."""

    def __init__(self, head: PlanHead, members: NDArray[np.int64]) -> None:
        parts = list(head.parts())
        self._all = kernels.Boxes(
            np.zeros((len(parts), kernels.BOX_COLUMNS), np.int32),
            np.full((kernels.LINES, 2), -1, np.int64),
            np.array([(part.cell**2, part.layer) for part in parts], np.int64).reshape(-1, 2),
            members,
            np.zeros(2, np.int64),
        )
        for number, part in enumerate(parts):
            if part.count > 0:
                made = int(self._all.counts[kernels.BOXES])
                box = (number, 0, part.shape[0], 0, part.shape[1], part.count, -1, -1, -1, part.start)
                self._all.boxes[made] = box
                self._all.counts[kernels.BOXES] += 1
        kernels.begin_boxes(self._all)

    def with_room(self) -> kernels.Boxes:
        """Return them, with room for new ones."""
        wanted = int(self._all.counts[kernels.BOXES]) + _PLACEMENTS_A_CALL
        self._all = self._all._replace(boxes=_grown(self._all.boxes, wanted))
        return self._all


class PlanDecoder:
    """Decodes placements and labels as their bytes arrive, from coarse to fine over all charts.

    Attributes
    ----------
    known, total
        Number of known placements, and of all.
    known_cells, total_cells
        The same for the coded labels.

    Parameters
    ----------
    head
        Grids of cells and numbers of placements.
    exemplar_shape
        As for `Quilt`.
    """

    def __init__(self, head: PlanHead, exemplar_shape: tuple[int, int]) -> None:
        self._head, self._shape = head, exemplar_shape
        self._parts = list(head.parts())
        self._coded = [n for n, part in enumerate(self._parts) if not part.is_settled]
        self.total, self.total_cells = head.total, sum(self._parts[n].size for n in self._coded)
        self.known = self.known_cells = 0
        self._coded_known = 0
        self._within = 0  # known cells of the next coded part
        self._boxes = _Boxes(head, np.empty(0, np.int64))
        self._placed = np.zeros((0, kernels.COLUMNS), np.int32)
        self._placements = BitReader(kernels.PLACEMENT_COUNTERS)
        self._labels = BitReader(LABEL_COUNTERS)
        self._nearest: dict[int, tuple[int, NDArray[np.int32]]] = {}
        self._maps: dict[int, NDArray[np.int32]] = {}
        self._sorted = self._placed, np.zeros(len(self._parts) + 1, np.intp)
        self._has_tones = False

    @property
    def density(self) -> float:
        """Density of painting in texels per step of the charts, each way."""
        return self._head.density

    @property
    def complete(self) -> bool:
        """Whether all placements and labels are known."""
        return self.known == self.total and self.known_cells == self.total_cells

    @property
    def unread(self) -> int:
        """Received bytes that no symbol has needed."""
        return self._placements.unread + self._labels.unread

    @property
    def charts_known(self) -> int:
        """Number of charts that have a placement of their own."""
        starts = self._by_cell()[1]
        return int(np.count_nonzero(np.diff(starts)[:: self._head.layers]))

    @property
    def is_spread(self) -> bool:
        """Whether at least a sixteenth of all placements is known (SPEC.md, 2.1)."""
        return 16 * self.known >= self.total

    def add_tones(self) -> None:
        """Let the quilt have tones, see `Quilt.has_tones`.

        Raises
        ------
        FormatError
            If it has two layers.
        """
        if self._head.layers > 1:
            raise FormatError("tones with two layers; allowed: with one")
        self._has_tones = True

    def feed_placements(self, data: bytes) -> None:
        """Take further bytes of the placements.

        Raises
        ------
        FormatError
            If a number of a placement is not allowed.
        """
        self._placements.feed(data)
        units = kernels.Units(*self._shape, *self._head.bits)
        none = np.zeros((0, kernels.COLUMNS), np.int32)
        status = kernels.PAUSED
        while status == kernels.PAUSED and self.known < self.total:
            stop = min(self.total, self.known + _PLACEMENTS_A_CALL)
            waiting, self._placed = self._boxes.with_room(), _grown(self._placed, stop)
            coder = self._placements.coder
            status = kernels.code_placements(coder, waiting, units, none, self._placed, stop, False)
            self.known = int(waiting.counts[kernels.PLACED])
            if status < 0:
                raise FormatError(f"placement {self.known} has a number outside what is allowed")

    def feed_labels(self, data: bytes) -> None:
        """Take further bytes of the labels; all placements must be known.

        Raises
        ------
        FormatError
            If no labels are due, or a label is no placement of its layer.
        """
        if not self._coded or self.known < self.total:
            raise FormatError("labels come where none are due")
        self._labels.feed(data)
        while self._coded_known < len(self._coded):
            number = self._coded[self._coded_known]
            part, nearest = self._parts[number], self._nearest_of(number)
            if number not in self._maps:
                self._maps[number] = part.blank()
            labels = self._maps[number]
            stop = min(labels.size, self._within + _CELLS_A_CALL)
            named = NamedPlacements(part.layer, part.first, part.count)
            known = code_labels(self._labels.coder, labels, nearest, named, self._within, stop, False)
            if known < 0:
                raise FormatError(f"a label of chart {part.number} names no placement of its layer")
            self.known_cells += known - self._within
            self._within = known
            if known < stop:
                return
            if known == labels.size:
                self._coded_known, self._within = self._coded_known + 1, 0

    def quilt(self, fields: Sequence[WarpField] = ()) -> Quilt:
        """Return the known part of the quilt, with warp fields per chart; without any, the identity.

        Charts without a placement have a bare one. Where labels are not known, the nearest placement shows;
        a second layer shows nothing there.
        """
        charts, layers = self._head.charts, self._head.layers
        labels = [LabelMap(part.cell, self._labels_of(n), part.half) for n, part in enumerate(self._parts)]
        return Quilt(
            charts,
            self._shape,
            self._known_placements(),
            tuple(tuple(labels[n : n + layers]) for n in range(0, len(labels), layers)),
            tuple(fields) or (WarpField.identity(),) * len(charts),
            density=self._head.density,
            has_tones=self._has_tones,
        )

    def _by_cell(self) -> tuple[NDArray[np.int32], NDArray[np.intp]]:
        # The known placements by part and cell; the start of each part, and the end.
        if len(self._sorted[0]) < self.known:
            records = self._placed[: self.known]
            records = records[_cell_order(records)]
            starts = np.searchsorted(records[:, kernels.PART], np.arange(len(self._parts) + 1))
            self._sorted = records, starts
        return self._sorted

    def _labels_of(self, number: int) -> NDArray[np.int32]:
        part, starts = self._parts[number], self._by_cell()[1]
        known = self._coded_known == len(self._coded) or (
            part.number < self._parts[self._coded[self._coded_known]].number
        )
        if known and number in self._maps:
            return self._maps[number]
        if part.layer > 0 or part.is_settled or starts[number] == starts[number + 1]:
            return part.blank()
        return self._nearest_of(number).copy()

    def _nearest_of(self, number: int) -> NDArray[np.int32]:
        part, (records, starts) = self._parts[number], self._by_cell()
        own = records[starts[number] : starts[number + 1]]
        count, found = self._nearest.get(number) or (0, part.blank())
        if count < len(own):
            at = [
                cell_centres(size, part.cell, half=part.half)[own[:, column]].astype(np.int32)
                for size, column in zip(part.shape, (kernels.ROW, kernels.COLUMN), strict=True)
            ]
            found = part.nearest(at[0], at[1])
            self._nearest[number] = len(own), found
        return found

    def _known_placements(self) -> NDArray[np.void]:
        records, starts = self._by_cell()
        layers = self._head.layers
        numbers = records[:, kernels.PART].astype(np.int64)
        placed = np.zeros(len(records), PLACEMENT)
        placed["chart"], placed["layer"] = np.divmod(numbers, layers)
        cells = self._head.cells.reshape(-1)[numbers]
        moved = np.where(np.array(self._head.half)[placed["layer"]], 0, 8 * cells)
        placed["row"] = 16 * cells * (records[:, kernels.ROW] - 1) + moved
        placed["column"] = 16 * cells * (records[:, kernels.COLUMN] - 1) + moved
        placed["symmetry"] = records[:, kernels.SYMMETRY]
        placed["offset"] = records[:, kernels.OFFSET : kernels.SOURCE]
        placed["source_row"], placed["source_column"] = records[:, kernels.SOURCE :].T
        bare = np.flatnonzero(np.diff(starts)[::layers] == 0).tolist()
        if not bare:
            return placed
        sizes = [(self._head.charts[n].height, self._head.charts[n].width) for n in bare]
        added = [bare_placement(n, size, self._shape) for n, size in zip(bare, sizes, strict=True)]
        at = starts[[layers * n for n in bare]]
        return np.insert(placed, at, np.concatenate(added))


def _grown(records: NDArray[np.int32], length: int) -> NDArray[np.int32]:
    """Return at least `length` records, new ones 0: memory follows received data, not announced sizes."""
    if length <= len(records):
        return records
    grown = np.zeros((max(length, len(records) + len(records) // 2), records.shape[1]), np.int32)
    grown[: len(records)] = records
    return grown
