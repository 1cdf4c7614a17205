"""Quilts of method "paper": blocks on a raster and along shared edges, of which only the sources need bytes.

Where everything else lies follows from a few numbers and the list of *strips*: the intervals of shared edges
along which blocks lie on both charts. A strip's block is upright on chart A; what chart B gets follows from
it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.geometry import SharedEdge
from upholster.quilt import Chart, Quilt
from upholster.quilt._paint_kernels import SYMMETRIES
from upholster.quilt.model import MASK_CUT, MASK_NONE, MASK_RAMP, PLACEMENT, SIDE_LEFT, SIDE_TOP
from upholster.stream.byte_reader import ByteReader, varint
from upholster.types import IntArray

__all__ = ["Regular", "Strip", "recognise"]

MOST_BLOCK, MOST_STRIPS, MOST_FEATHER = 256, 4 * 65_536, 16
MOST_CHART = 16384

_OPPOSED, _PARTIAL = 16, 32


@dataclass(frozen=True)
class Strip:
    """An interval of a shared edge, in texels.

    Attributes
    ----------
    a, b
        Numbers of the two charts.
    edge_a, edge_b
        Edge of each, 0 to 3.
    opposed
        Whether the two edges run in opposite directions.
    start, length
        The interval on A's edge.
    other
        The interval's first texel on B's edge, counted along B's edge from its low end.
    """

    a: int
    b: int
    edge_a: int
    edge_b: int
    opposed: bool
    start: int
    length: int
    other: int

    @property
    def along_rows(self) -> bool:
        """Whether it runs along A's rows axis."""
        return self.edge_a in (1, 3)

    def to_b(self, row: IntArray, column: IntArray, a: Chart, b: Chart) -> tuple[IntArray, IntArray]:
        """Return row and column in B's grid of texels of A's grid, beyond or before the edge."""
        along = row if self.along_rows else column
        depth = (-1 - row, column - a.width, row - a.height, -1 - column)[self.edge_a]
        step = along - self.start
        there = self.other + (self.length - 1 - step if self.opposed else step)
        return (
            (depth, there),
            (there, b.width - 1 - depth),
            (b.height - 1 - depth, there),
            (there, depth),
        )[self.edge_b]


@dataclass(frozen=True)
class Regular:
    """The plan of a regular quilt: everything but sources and masks.

    Attributes
    ----------
    charts, exemplar_shape
        As in `Quilt`.
    block, overlap, tile
        Side of a block and width of the overlap, in texels; sources lie `tile` pixels apart.
    cell, feather
        Of the cut masks along strips.
    strips
        In painting order.
    """

    charts: tuple[Chart, ...]
    exemplar_shape: tuple[int, int]
    block: int
    overlap: int
    tile: int
    cell: int
    feather: int
    strips: tuple[Strip, ...]

    @property
    def step(self) -> int:
        """Distance of blocks, in texels."""
        return self.block - self.overlap

    @property
    def grid(self) -> tuple[int, int]:
        """Rows and columns of candidates in the exemplar."""
        height, width = self.exemplar_shape
        return (height - self.block) // self.tile + 1, (width - self.block) // self.tile + 1

    @property
    def side(self) -> int:
        """Cells along each side of a mask; 0 where there are none."""
        return self.block // self.cell if self.cell else 0

    def raster(self, chart: int) -> tuple[int, int]:
        """Rows and columns of blocks on a chart."""
        return self._count(self.charts[chart].height), self._count(self.charts[chart].width)

    def blocks_along(self, strip: Strip) -> int:
        """Blocks of a strip."""
        return self._count(strip.length)

    def _count(self, length: int) -> int:
        return max(1, -(-(length - self.overlap) // self.step))

    @cached_property
    def runs(self) -> NDArray[np.int64]:
        """Runs of sources, charts first: (runs, 3), index of the first block, blocks across, 1 for strips.

        A last row holds the number of blocks.
        """
        rasters = [self.raster(n) for n in range(len(self.charts))]
        counts = [rows * columns for rows, columns in rasters]
        across = [columns for _, columns in rasters]
        for strip in self.strips:
            counts.append(self.blocks_along(strip))
            across.append(1 if strip.along_rows else counts[-1])
        kinds = [0] * len(rasters) + [1] * len(self.strips)
        first = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
        return np.stack([first, [*across, 0], [*kinds, 0]], axis=1).astype(np.int64)

    @property
    def count(self) -> int:
        """How many sources there are; a strip's block lies on two charts and has one."""
        return int(self.runs[-1, 0])

    @cached_property
    def mask_starts(self) -> NDArray[np.int64]:
        """Where each strip's cells begin among those coded, and their number: (strips + 1,)."""
        counts = [self.blocks_along(strip) * self.side**2 for strip in self.strips]
        return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])

    def chart_blocks(self, chart: int, chosen: IntArray) -> NDArray[np.void]:
        """Return a chart's blocks: in raster order, a step apart; the last reach beyond the chart."""
        rows, columns = self.raster(chart)
        placed = np.zeros((rows, columns), PLACEMENT)
        placed["chart"] = chart
        placed["row"] = (np.arange(rows) * self.step + self.block // 2)[:, None]
        placed["column"] = np.arange(columns) * self.step + self.block // 2
        placed["height"] = placed["width"] = self.block
        placed["cells"] = -1
        placed["mask"] = MASK_RAMP
        placed["mask"][0, 0] = MASK_NONE
        placed["ramp"] = self.overlap
        placed["sides"][1:] |= SIDE_TOP
        placed["sides"][:, 1:] |= SIDE_LEFT
        flat = placed.reshape(-1)
        self._set_sources(flat, chosen)
        return flat

    def strip_blocks(self, index: int, chosen: IntArray) -> tuple[NDArray[np.void], NDArray[np.void]]:
        """Return a strip's first ``len(chosen)`` blocks on A and on B.

        They begin at the strip's start, a step apart; the last one is moved back to end with it.
        """
        strip, half, area = self.strips[index], self.block // 2, self.side**2
        a, b = self.charts[strip.a], self.charts[strip.b]
        along = np.arange(len(chosen)) * self.step
        along = strip.start + np.minimum(along, strip.length - self.block) + half
        line = (0, a.width, a.height, 0)[strip.edge_a]
        on_a = np.zeros(len(chosen), PLACEMENT)
        on_a["chart"] = strip.a
        on_a["row"], on_a["column"] = (along, line) if strip.along_rows else (line, along)
        on_a["height"] = on_a["width"] = self.block
        on_a["mask"], on_a["cell"], on_a["feather"] = MASK_CUT, self.cell, self.feather
        on_a["cells"] = 2 * self.mask_starts[index] + np.arange(len(chosen)) * 2 * area
        self._set_sources(on_a, chosen)
        on_b = on_a.copy()
        on_b["chart"] = strip.b
        on_b["cells"] += area
        top, left = on_a["row"] - half, on_a["column"] - half
        near = strip.to_b(top, left, a, b)
        far = strip.to_b(top + self.block - 1, left + self.block - 1, a, b)
        on_b["row"] = np.minimum(near[0], far[0]) + half
        on_b["column"] = np.minimum(near[1], far[1]) + half
        symmetry, _ = self.symmetry(strip)
        on_b["symmetry"] = symmetry
        # Exemplar pixel of B's centre: B's steps from the texel that is A's top left one, taken back to A's.
        steps = SYMMETRIES[symmetry]
        rows, columns = on_b["row"] - near[0], on_b["column"] - near[1]
        on_b["source_row"] += 16 * (steps[0] * rows + steps[1] * columns - half)
        on_b["source_column"] += 16 * (steps[2] * rows + steps[3] * columns - half)
        return on_a, on_b

    def symmetry(self, strip: Strip) -> tuple[int, tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Return the turn on B of a block upright on A, and B's steps for A's steps down and right."""
        a, b = self.charts[strip.a], self.charts[strip.b]
        rows, columns = strip.to_b(np.array([0, 1, 0]), np.array([0, 0, 1]), a, b)
        points = np.stack([rows, columns], axis=1)
        down, right = points[1] - points[0], points[2] - points[0]
        symmetry = int(np.flatnonzero((np.concatenate([down, right]) == SYMMETRIES).all(axis=1))[0])
        return symmetry, (down, right)

    def cells_of(self, index: int, coded: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the cells of a strip's blocks as `Quilt` holds them, A's and B's in turn, from those coded.

        Coded masks run along the strip: their rows are cells along the edge, their columns cells across it.
        """
        strip, side = self.strips[index], self.side
        masks = coded.reshape(-1, side, side)
        on_a = masks if strip.along_rows else masks.swapaxes(1, 2)
        _, (down, right) = self.symmetry(strip)
        on_b = on_a if down[0] else on_a.swapaxes(1, 2)
        if (down + right)[0] < 0:
            on_b = on_b[:, ::-1]
        if (down + right)[1] < 0:
            on_b = on_b[:, :, ::-1]
        return np.stack([on_a, on_b], axis=1).reshape(-1)

    def coded_cells(self, index: int, cells: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the masks to code of a strip, from its part of `Quilt.cells`."""
        on_a = cells.reshape(-1, 2, self.side, self.side)[:, 0]
        return (on_a if self.strips[index].along_rows else on_a.swapaxes(1, 2)).reshape(-1)

    def _set_sources(self, placed: NDArray[np.void], chosen: IntArray) -> None:
        columns = self.grid[1]
        placed["source_row"] = 16 * (chosen // columns * self.tile + self.block // 2)
        placed["source_column"] = 16 * (chosen % columns * self.tile + self.block // 2)

    def chosen(self, placed: NDArray[np.void]) -> IntArray:
        """Return the candidates that placements have as sources; −1 where it is none."""
        rows, columns = self.grid
        row = placed["source_row"] // 16 - self.block // 2
        column = placed["source_column"] // 16 - self.block // 2
        ok = (row % self.tile == 0) & (column % self.tile == 0) & (row >= 0) & (column >= 0)
        row, column = row // self.tile, column // self.tile
        ok &= (row < rows) & (column < columns)
        return np.where(ok, row * columns + column, -1).astype(np.int32)

    def payload(self) -> bytes:
        """Return it as bytes; charts and exemplar are told elsewhere."""
        out = [varint(self.block), varint(self.overlap), bytes([self.tile.bit_length() - 1])]
        out += [varint(len(self.strips))]
        if self.strips:
            out += [bytes([self.cell, self.feather])]
        for strip in self.strips:
            partial = not self._is_whole(strip)
            head = strip.edge_a | strip.edge_b << 2 | _OPPOSED * strip.opposed | _PARTIAL * partial
            out += [bytes([head]), varint(strip.a), varint(strip.b)]
            if partial:
                out += [varint(strip.start), varint(strip.length), varint(strip.other)]
        return b"".join(out)

    def _is_whole(self, strip: Strip) -> bool:
        length = _edge_length(self.charts[strip.a], strip.edge_a)
        return (strip.start, strip.length, strip.other) == (0, length, 0)

    @classmethod
    def parse(
        cls, fields: ByteReader, charts: tuple[Chart, ...], exemplar_shape: tuple[int, int]
    ) -> "Regular":
        """Read it back, checking that it fits charts and exemplar."""
        block = fields.varint("block", min(MOST_BLOCK, *exemplar_shape), 2)
        overlap = fields.varint("overlap", (block - 1) // 2, 1)
        tile = 1 << fields.byte("levels", 6)
        cell = feather = 0
        count = fields.varint("number of strips", MOST_STRIPS)
        if count:
            cell, feather = fields.byte("cell"), fields.byte("feather", MOST_FEATHER)
            if cell == 0 or block % cell or block % 2:
                raise fields.error(f"cell is {cell}; allowed: divisors of the block, {block}, which is even")
        strips = []
        for _ in range(count):
            head = fields.byte("strip", 63)
            a = fields.varint("chart", len(charts) - 1)
            b = fields.varint("chart", len(charts) - 1)
            edge_a, edge_b = head & 3, head >> 2 & 3
            long_a, long_b = _edge_length(charts[a], edge_a), _edge_length(charts[b], edge_b)
            start, length, other = 0, long_a, 0
            if head & _PARTIAL:
                start = fields.varint("start of a strip", long_a)
                length = fields.varint("length of a strip", long_a - start)
                other = fields.varint("start of a strip on its other chart", long_b)
            if length < block or other + length > long_b:
                raise fields.error(
                    f"strip of {length} texels at {other}; allowed: a block, {block}, to what fits {long_b}"
                )
            strips.append(Strip(a, b, edge_a, edge_b, bool(head & _OPPOSED), start, length, other))
        return cls(charts, exemplar_shape, block, overlap, tile, cell, feather, tuple(strips))


def _edge_length(chart: Chart, edge: int) -> int:
    return chart.height if edge in (1, 3) else chart.width


def recognise(quilt: Quilt, shared: Sequence[SharedEdge]) -> Regular | None:
    """Return the plan of a quilt that looks regular; its placements still have to be compared."""
    placed = quilt.placements
    if not len(placed):
        return None
    block, overlap = int(placed["height"][0]), int(placed["ramp"][0])
    if not 2 <= block <= min(MOST_BLOCK, *quilt.exemplar_shape) or not 1 <= overlap <= (block - 1) // 2:
        return None
    cut = placed[placed["mask"] == MASK_CUT]
    cell, feather = (int(cut["cell"][0]), int(cut["feather"][0])) if len(cut) else (0, 0)
    upright = placed[placed["symmetry"] == 0]
    corners = np.bitwise_or.reduce(
        (upright["source_row"] // 16 - block // 2) | (upright["source_column"] // 16 - block // 2)
    )
    tile = min(64, int(corners) & -int(corners)) if corners else 64
    if len(cut) and (cell < 1 or block % cell or block % 2):
        return None
    plan = Regular(quilt.charts, quilt.exemplar_shape, block, overlap, tile, cell, feather, ())
    if not len(cut):
        return plan
    first_cells = {
        (int(one["chart"]), int(one["row"]), int(one["column"])): int(one["cells"]) for one in cut[::-1]
    }
    found = []
    for strip in _strips(quilt.charts, shared, block):
        trial = Regular(quilt.charts, quilt.exemplar_shape, block, overlap, tile, cell, feather, (strip,))
        on_a, on_b = trial.strip_blocks(0, np.zeros(1, np.int32))
        key, other = (
            (int(one["chart"][0]), int(one["row"][0]), int(one["column"][0])) for one in (on_a, on_b)
        )
        if key in first_cells and other in first_cells:
            found.append((first_cells[key], strip))
    strips = tuple(strip for _, strip in sorted(found, key=lambda pair: pair[0]))
    return Regular(quilt.charts, quilt.exemplar_shape, block, overlap, tile, cell, feather, strips)


def _strips(charts: Sequence[Chart], shared: Sequence[SharedEdge], block: int) -> list[Strip]:
    """Return the shared edges along which texels meet one to one, as strips."""
    strips = []
    for edge in shared:
        if max(edge.patch, edge.other_patch) >= len(charts):
            return []
        long_a = _edge_length(charts[edge.patch], edge.edge)
        long_b = _edge_length(charts[edge.other_patch], edge.other_edge)
        ends = np.array(
            [edge.start * long_a, edge.stop * long_a, edge.other_start * long_b, edge.other_stop * long_b]
        )
        start, stop, other, other_stop = (int(end) for end in np.rint(ends))
        if np.abs(ends - np.rint(ends)).max() > 1e-6 or stop - start != abs(other_stop - other):
            continue
        if stop - start >= block:
            strips.append(
                Strip(
                    edge.patch,
                    edge.other_patch,
                    edge.edge,
                    edge.other_edge,
                    other > other_stop,
                    start,
                    stop - start,
                    min(other, other_stop),
                )
            )
    return strips
