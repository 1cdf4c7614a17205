"""The head of a plan: grids of cells, and the number of placements on each chart (SPEC.md, section 4)."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.codec.stream.byte_reader import ByteReader, varint
from upholster.quilt.chart import Chart
from upholster.quilt.labels import MOST_CELL, cell_centres, label_shape, nearest_labels
from upholster.quilt.model import DENSITIES, Quilt

__all__ = ["MAX_CELLS", "MAX_PLACEMENTS", "PlanHead", "PlanPart"]

MAX_PLACEMENTS = 2**19
MAX_CELLS = 2**27
"""Largest number of cells of all label maps."""

_CELLS_A_STEP, _CELLS_A_CHART = 4, 32
_MOST_LAYERS = 2
_MOST_SOURCE_BITS, _MOST_OFFSET_BITS = 4, 7
_HALF, _ALIKE = 1, 2
"""Bits of a layer: its cells are shifted by half a cell; all charts have cells of one size."""


@dataclass(frozen=True, slots=True)
class PlanPart:
    """A layer of a chart: the unit of coding.

    Attributes
    ----------
    number, layer, chart
        The chart's number, the layer, 0 or 1, and the chart.
    cell, half
        As for `LabelMap`.
    first, start, count
        Its first placement among those of the chart, and among all; the number of its placements.
    """

    number: int
    layer: int
    chart: Chart
    cell: int
    half: bool
    first: int
    start: int
    count: int

    def __str__(self) -> str:
        return f"layer {self.layer} of chart {self.number}"

    @property
    def stop(self) -> int:
        """End of its placements among all."""
        return self.start + self.count

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of cells."""
        return label_shape(self.chart.height, self.chart.width, self.cell)

    @property
    def size(self) -> int:
        """Number of its cells."""
        return self.shape[0] * self.shape[1]

    @property
    def is_settled(self) -> bool:
        """Whether its label map has only one possible content, and is not coded."""
        return self.count == (1 if self.layer == 0 else 0)

    def blank(self) -> NDArray[np.int32]:
        """Return labels that are all unknown."""
        return np.full(self.shape, 0 if self.layer == 0 else -1, np.int32)

    def nearest(self, rows: NDArray[np.int32], columns: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the nearest placement of each cell, given centres, by its number on the chart."""
        found = nearest_labels(rows, columns, self.chart, self.cell, half=self.half)
        return found + np.int32(self.first)

    def cells_of(self, placed: NDArray[np.void]) -> NDArray[np.int64]:
        """Return (n, 2) row and column of the cells whose centres its placements have.

        Raises
        ------
        InputError
            If a centre is not that of a cell, or they are not one per cell, row after row.
        """
        found = np.empty((len(placed), 2), np.int64)
        for axis, name in enumerate(("row", "column")):
            centres = cell_centres(self.shape[axis], self.cell, half=self.half)
            found[:, axis] = np.searchsorted(centres, placed[name])
            if not np.isin(placed[name], centres).all():
                raise InputError(
                    f"{self!s} has a placement whose centre is none of its cells of {self.cell} steps; "
                    "allowed in a stream: centres of cells"
                )
        if (np.diff(found @ (self.shape[1], 1)) <= 0).any():
            raise InputError(
                f"{self!s} has placements that share a cell or are not in the cells' order; "
                "allowed in a stream: row after row"
            )
        return found


@dataclass(frozen=True, slots=True)
class PlanHead:
    """Grids of cells, and numbers of placements.

    Attributes
    ----------
    charts
        The layout.
    half
        For each layer whether its cells are shifted by half a cell; one layer or two.
    cells, counts
        (charts, layers) size of the cells in steps, and number of placements.
    density
        As for `Quilt`.
    bits
        Sources are multiples of 2 to the power of the first, offsets to the power of the second.
    """

    charts: tuple[Chart, ...]
    half: tuple[bool, ...]
    cells: NDArray[np.int64]
    counts: NDArray[np.int64]
    density: float = 1.0
    bits: tuple[int, int] = (0, 0)

    @classmethod
    def bare(cls, charts: tuple[Chart, ...]) -> "PlanHead":
        """Return the head that applies before a plan has arrived."""
        shape = len(charts), 1
        return cls(charts, (False,), np.full(shape, MOST_CELL, np.int64), np.ones(shape, np.int64))

    @classmethod
    def of(cls, quilt: Quilt) -> "PlanHead":
        """Return the head of a quilt.

        Raises
        ------
        InputError
            If it exceeds the format's limits.
        """
        numbers = {len(maps) for maps in quilt.labels}
        if len(numbers) > 1:
            raise InputError("some charts have a second layer; allowed in a stream: all of them or none")
        half = [{maps[layer].half for maps in quilt.labels} for layer in range(max(numbers))]
        if any(len(some) > 1 for some in half):
            raise InputError("cells of some charts are shifted by half; allowed in a stream: all or none")
        cells = np.array([[one.cell for one in maps] for maps in quilt.labels], np.int64)
        place = _MOST_LAYERS * quilt.placements["chart"].astype(np.int64) + quilt.placements["layer"]
        counts = np.bincount(place, minlength=_MOST_LAYERS * len(cells)).reshape(-1, _MOST_LAYERS)
        counts = counts[:, : len(half)]
        moved = tuple(some.pop() for some in half)
        found = cls(quilt.charts, moved, cells, counts, quilt.density, _bits_of(quilt.placements))
        wrong = found._excess()
        if wrong:
            raise InputError(f"{wrong} in a stream")
        return found

    @classmethod
    def parse(cls, fields: ByteReader, charts: tuple[Chart, ...]) -> "PlanHead":
        """Read it back.

        Raises
        ------
        FormatError
            If it is malformed or not allowed.
        """
        layers = fields.varint("number of layers", _MOST_LAYERS, 1)
        density = DENSITIES[fields.byte("density", len(DENSITIES) - 1)]
        bits = (
            fields.byte("bits of sources", _MOST_SOURCE_BITS),
            fields.byte("bits of offsets", _MOST_OFFSET_BITS),
        )
        half, cells, counts = [], np.empty((len(charts), layers), np.int64), []
        for layer in range(layers):
            flags = fields.byte("flags of a layer", _HALF | _ALIKE)
            half.append(bool(flags & _HALF))
            sizes = [
                fields.varint("cell of a layer", MOST_CELL, 1)
                for _ in range(1 if flags & _ALIKE else len(charts))
            ]
            cells[:, layer] = sizes
        found = cls(charts, tuple(half), cells, np.ones_like(cells))
        wrong = found._excess()
        if wrong:
            raise fields.error(wrong)
        for layer in range(layers):
            most = np.minimum(found._shapes()[:, layer].prod(axis=1), MAX_PLACEMENTS).tolist()
            least = 1 if layer == 0 else 0
            counts.append([fields.varint("number of placements", each, least) for each in most])
        total = sum(map(sum, counts))
        if total > MAX_PLACEMENTS:
            raise fields.error(f"plan has {total} placements; allowed: {MAX_PLACEMENTS}")
        fields.end("plan")
        return cls(charts, tuple(half), cells, np.array(counts, np.int64).T, density, bits)

    def pack(self) -> bytes:
        """Return it as bytes."""
        out = [varint(self.layers), bytes([DENSITIES.index(self.density), *self.bits])]
        for half, cells in zip(self.half, self.cells.T.tolist(), strict=True):
            alike = len(set(cells)) == 1
            out.append(bytes([_HALF * half | _ALIKE * alike]))
            out += [varint(cell) for cell in cells[: 1 if alike else None]]
        return b"".join([*out, *(varint(count) for count in self.counts.T.reshape(-1).tolist())])

    @property
    def layers(self) -> int:
        """Number of layers."""
        return len(self.half)

    @property
    def total(self) -> int:
        """Number of placements."""
        return int(self.counts.sum())

    @property
    def size(self) -> int:
        """Number of cells of all label maps."""
        return int(self._shapes().prod(axis=2).sum())

    def parts(self) -> Iterator[PlanPart]:
        """Return all charts' layers, in the order of coding."""
        rows = zip(self.charts, self.cells.tolist(), self.counts.tolist(), strict=True)
        start = 0
        for number, (chart, cells, counts) in enumerate(rows):
            first = 0
            for layer, (cell, count) in enumerate(zip(cells, counts, strict=True)):
                yield PlanPart(number, layer, chart, cell, self.half[layer], first, start, count)
                first, start = first + count, start + count

    def _shapes(self) -> NDArray[np.int64]:
        # (charts, layers, 2) rows and columns of cells.
        sizes = np.array([(chart.height, chart.width) for chart in self.charts], np.int64)
        return -(-sizes[:, None] // self.cells[..., None]) + 2

    def _excess(self) -> str:
        # The error about the number of cells; an empty text for none.
        steps = sum(chart.height * chart.width for chart in self.charts)
        most = min(MAX_CELLS, _CELLS_A_STEP * steps + _CELLS_A_CHART * len(self.charts))
        return f"label maps have {self.size} cells; allowed: {most}" if self.size > most else ""


def _bits_of(placed: NDArray[np.void]) -> tuple[int, int]:
    """Return the largest powers of two that divide all sources and all offsets."""
    sources = np.bitwise_or.reduce(placed["source_row"] | placed["source_column"])
    offsets = np.bitwise_or.reduce(placed["offset"], axis=None)
    return _zeros(int(sources), _MOST_SOURCE_BITS), _zeros(int(offsets), _MOST_OFFSET_BITS)


def _zeros(number: int, most: int) -> int:
    return next((k for k in range(most) if number >> k & 1), most)
