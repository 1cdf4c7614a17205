"""The plan of method "paper": blocks in raster order on every chart, and strips of blocks along edges.

Where everything lies follows from a few numbers and the list of *strips*: the intervals of shared edges along
which blocks lie on both charts. A strip's block is upright on chart A; what chart B gets follows from it. So
a block needs its source alone, and a strip's block one mask for both charts.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from upholster.quilt.chart import Chart
from upholster.methods.quilt.masked import (
    MASK_CUT,
    MASK_NONE,
    MASK_RAMP,
    PLACEMENT,
    SIDE_LEFT,
    SIDE_TOP,
    SYMMETRIES,
    mask_windows,
)
from upholster.types import IntArray

_Texels = TypeVar("_Texels", int, IntArray)

__all__ = ["Strip", "StripLayout", "StripPlan", "edge_length"]


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

    def to_b(self, row: _Texels, column: _Texels, a: Chart, b: Chart) -> tuple[_Texels, _Texels]:
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
class StripLayout:
    """Where blocks and strips lie: everything of the plan but sources and masks.

    Attributes
    ----------
    charts, exemplar_shape
        As in `Quilt`.
    block, edge_block, overlap, tile
        Sides of a chart's and of a strip's blocks and width of the overlap, in texels; sources lie `tile`
        pixels apart.
    mask_cell, feather
        Of the cut masks along strips.
    strips
        In painting order.
    """

    charts: tuple[Chart, ...]
    exemplar_shape: tuple[int, int]
    block: int
    edge_block: int
    overlap: int
    tile: int
    mask_cell: int
    feather: int
    strips: tuple[Strip, ...]

    def candidates(self, block: int) -> tuple[int, int]:
        """Rows and columns of candidates in the exemplar for blocks of a size."""
        height, width = self.exemplar_shape
        return (height - block) // self.tile + 1, (width - block) // self.tile + 1

    @property
    def side(self) -> int:
        """Cells along each side of a mask; 0 where there are none."""
        return self.edge_block // self.mask_cell if self.mask_cell else 0

    def block_grid(self, chart: int) -> tuple[int, int]:
        """Rows and columns of blocks on a chart."""
        height, width = self.charts[chart].height, self.charts[chart].width
        return self._count(height, self.block), self._count(width, self.block)

    def blocks_along(self, strip: Strip) -> int:
        """Blocks of a strip."""
        return self._count(strip.length, self.edge_block)

    def _count(self, length: int, block: int) -> int:
        return max(1, -(-(length - self.overlap) // (block - self.overlap)))

    @cached_property
    def runs(self) -> NDArray[np.int64]:
        """Runs of sources, charts first: (runs, 3), index of the first block, blocks across, 1 for strips.

        A last row holds the number of blocks.
        """
        grids = [self.block_grid(n) for n in range(len(self.charts))]
        counts = [rows * columns for rows, columns in grids]
        across = [columns for _, columns in grids]
        for strip in self.strips:
            counts.append(self.blocks_along(strip))
            across.append(1 if strip.along_rows else counts[-1])
        kinds = [0] * len(grids) + [1] * len(self.strips)
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
        rows, columns = self.block_grid(chart)
        step = self.block - self.overlap
        placed = np.zeros((rows, columns), PLACEMENT)
        placed["chart"] = chart
        placed["row"] = (np.arange(rows) * step + self.block // 2)[:, None]
        placed["column"] = np.arange(columns) * step + self.block // 2
        placed["height"] = placed["width"] = self.block
        placed["first_cell"] = -1
        placed["mask"] = MASK_RAMP
        placed["mask"][0, 0] = MASK_NONE
        placed["ramp"] = self.overlap
        placed["sides"][1:] |= SIDE_TOP
        placed["sides"][:, 1:] |= SIDE_LEFT
        flat = placed.reshape(-1)
        self._set_sources(flat, chosen.reshape(-1))
        return flat

    def strip_blocks(self, index: int, chosen: IntArray) -> tuple[NDArray[np.void], NDArray[np.void]]:
        """Return a strip's first ``len(chosen)`` blocks on A and on B.

        They begin at the strip's start, a step apart; the last one is moved back to end with it.
        """
        start = int(self.runs[len(self.charts) + index, 0] - self.runs[len(self.charts), 0])
        on_a, on_b = self._shown(self._strip_blocks[:, start : start + len(chosen)], chosen)
        return on_a, on_b

    @cached_property
    def maps(self) -> NDArray[np.int64]:
        """Per strip (6,): texel (r, c) of A's grid is (m0·r + m1·c + m4, m2·r + m3·c + m5) of B's."""
        out = np.empty((len(self.strips), 6), np.int64)
        for n, strip in enumerate(self.strips):
            a, b = self.charts[strip.a], self.charts[strip.b]
            (r0, c0), (r1, c1), (r2, c2) = (strip.to_b(*at, a, b) for at in ((0, 0), (1, 0), (0, 1)))
            out[n] = r1 - r0, r2 - r0, c1 - c0, c2 - c0, r0, c0
        return out

    @cached_property
    def symmetries(self) -> NDArray[np.int64]:
        """The symmetry on B of a block upright on A, per strip."""
        steps = self.maps[:, None, [0, 2, 1, 3]]
        return np.asarray((steps == SYMMETRIES).all(axis=2).argmax(axis=1), np.int64)

    @cached_property
    def _strip_blocks(self) -> NDArray[np.void]:
        # All strips' blocks on A and on B, (2, blocks), as if each showed the first candidate.
        block, half, strips = self.edge_block, self.edge_block // 2, self.strips
        counts = np.diff(self.runs[len(self.charts) :, 0])
        strip = np.repeat(np.arange(len(strips)), counts)
        on_a = np.zeros(len(strip), PLACEMENT)
        numbers = np.array(
            [(one.a, one.b, one.along_rows, one.start, one.length, self._line(one)) for one in strips],
            np.int64,
        ).reshape(-1, 6)
        a, b, along_rows, first, length, line = numbers[strip].T
        along = np.arange(len(strip)) - np.repeat(np.cumsum(counts) - counts, counts)
        along = first + np.minimum(along * (block - self.overlap), length - block) + half
        on_a["chart"] = a
        on_a["row"], on_a["column"] = np.where(along_rows, (along, line), (line, along))
        on_a["height"] = on_a["width"] = block
        on_a["mask"], on_a["mask_cell"], on_a["feather"] = MASK_CUT, self.mask_cell, self.feather
        on_a["source_row"] = on_a["source_column"] = 16 * half
        on_b = on_a.copy()
        on_b["chart"] = b
        m0, m1, m2, m3, m4, m5 = self.maps[strip].T
        top, left = on_a["row"] - half, on_a["column"] - half
        near_row, near_column = m0 * top + m1 * left + m4, m2 * top + m3 * left + m5
        # The block's last texel is as many steps down and right; on B it is one of four corners.
        last = block - 1
        on_b["row"] = near_row + np.minimum(0, (m0 + m1) * last) + half
        on_b["column"] = near_column + np.minimum(0, (m2 + m3) * last) + half
        on_b["symmetry"] = self.symmetries[strip]
        # Exemplar pixel of B's centre: B's steps from the texel that is A's top left one, taken back to A's.
        s0, s1, s2, s3 = SYMMETRIES[on_b["symmetry"]].T
        rows, columns = on_b["row"] - near_row, on_b["column"] - near_column
        on_b["source_row"] = 16 * (s0 * rows + s1 * columns)
        on_b["source_column"] = 16 * (s2 * rows + s3 * columns)
        return np.stack([on_a, on_b])

    def _line(self, strip: Strip) -> int:
        # The row or column of A at which the strip's blocks have their centres.
        a = self.charts[strip.a]
        return (0, a.width, a.height, 0)[strip.edge_a]

    def strip_masks(
        self, index: int, coded: NDArray[np.uint8]
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Return the masks of a strip's blocks on A and on B, (blocks, side, side).

        Those given run along the strip: their rows are cells along the edge, their columns cells across it.
        """
        strip, side = self.strips[index], self.side
        masks = coded.reshape(-1, side, side)
        on_a = masks if strip.along_rows else masks.swapaxes(1, 2)
        m0, m1, m2, m3 = self.maps[index, :4].tolist()
        on_b = on_a if m0 else on_a.swapaxes(1, 2)
        if m0 + m1 < 0:
            on_b = on_b[:, ::-1]
        if m2 + m3 < 0:
            on_b = on_b[:, :, ::-1]
        return on_a, on_b

    def assemble(
        self, chosen: IntArray, masks: NDArray[np.uint8], known: int | None = None
    ) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
        """Return the placements that sources and masks give, and the cells of their windows.

        Parameters
        ----------
        chosen, masks
            As in `StripPlan`, or the first of each, as far as they are known.
        known
            Charts whose blocks are all known: all by default. A strip's block is there as soon as its source
            and its mask are.
        """
        first = self.runs[:, 0]
        charts = len(self.charts) if known is None else known
        parts = [self.chart_blocks(n, chosen[first[n] : first[n + 1]]) for n in range(charts)]
        along, cells = self._known_strips(chosen[first[len(self.charts)] :], masks)
        placements = np.concatenate([np.zeros(0, PLACEMENT), *parts, along])
        order = np.argsort(placements["chart"], kind="stable")
        return placements[order], cells

    def _known_strips(
        self, chosen: IntArray, masks: NDArray[np.uint8]
    ) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
        # The strips' blocks whose masks are known, each strip's on A, then on B, and their windows' cells.
        area = self.side**2
        there = min(len(chosen), len(masks) // area) if area else 0
        placed = self._shown(self._strip_blocks[:, :there], chosen[:there])
        cells, order, count = [np.zeros(0, np.uint8)], [np.zeros((2, 0), np.intp)], 0
        starts = self.runs[len(self.charts) :, 0] - self.runs[len(self.charts), 0]
        begins = starts[:-1][starts[:-1] < there].tolist()
        # Along the edge blocks lie inside the chart, so all windows of a strip are alike.
        windows = mask_windows(placed[:, begins].reshape(-1), self.charts).reshape(2, -1, 4).tolist()
        for n, start in enumerate(begins):
            stop = min(there, int(starts[n + 1]))
            for side, grids in enumerate(self.strip_masks(n, masks[start * area : stop * area])):
                i0, i1, j0, j1 = windows[side][n]
                seen = grids[:, i0:i1, j0:j1].reshape(stop - start, -1)
                placed["first_cell"][side, start:stop] = count + np.arange(stop - start) * seen.shape[1]
                count += seen.size
                cells.append(seen.reshape(-1))
            order.append(np.arange(start, stop) + np.array([[0], [there]]))
        flat = np.concatenate([one.reshape(-1) for one in order])
        return placed.reshape(-1)[flat], np.concatenate(cells)

    def _shown(self, blocks: NDArray[np.void], chosen: IntArray) -> NDArray[np.void]:
        # A strip's blocks that show the first candidate, as such that show the chosen ones.
        out, columns = blocks.copy(), self.candidates(self.edge_block)[1]
        out["source_row"] += 16 * self.tile * (chosen // columns)
        out["source_column"] += 16 * self.tile * (chosen % columns)
        return out

    def _set_sources(self, placed: NDArray[np.void], chosen: IntArray) -> None:
        columns = self.candidates(self.block)[1]
        placed["source_row"] = 16 * (chosen // columns * self.tile + self.block // 2)
        placed["source_column"] = 16 * (chosen % columns * self.tile + self.block // 2)

    def chosen(self, placed: NDArray[np.void]) -> IntArray:
        """Return the candidates that upright blocks have as sources."""
        half, columns = placed["height"] // 2, self.candidates(int(placed["height"][0]))[1]
        row = placed["source_row"] // 16 - half
        column = placed["source_column"] // 16 - half
        return np.asarray(row // self.tile * columns + column // self.tile, np.int32)


@dataclass(frozen=True, eq=False)
class StripPlan:
    """A quilt of method "paper".

    Attributes
    ----------
    layout
        Where its blocks and strips lie.
    chosen
        (blocks,) int32: the candidate that each block shows, charts in order, then strips.
    masks
        uint8, 1 = new: the masks of the strips' blocks, (side, side) each, with rows along the edge.
    """

    layout: StripLayout
    chosen: IntArray
    masks: NDArray[np.uint8]

    def placements(
        self,
        charts: Sequence[Chart],  # noqa: ARG002  # as every plan
    ) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
        """Return the placements, chart after chart in painting order, and the cells of their masks."""
        return self.layout.assemble(self.chosen, self.masks)


def edge_length(chart: Chart, edge: int) -> int:
    """Return how many texels lie along an edge of a chart."""
    return chart.height if edge in (1, 3) else chart.width
