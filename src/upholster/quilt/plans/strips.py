"""The plan of method "paper": blocks in raster order on every chart, and strips of blocks along edges.

Where everything lies follows from a few numbers and the list of *strips*: the intervals of shared edges along
which blocks lie on both charts. A strip's block is upright on chart A; what chart B gets follows from it. So
a block needs its source alone, and a strip's block one mask for both charts.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.quilt.chart import Chart
from upholster.quilt.placement import (
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
class StripLayout:
    """Where blocks and strips lie: everything of the plan but sources and masks.

    Attributes
    ----------
    charts, exemplar_shape
        As in `Quilt`.
    block, overlap, tile
        Side of a block and width of the overlap, in texels; sources lie `tile` pixels apart.
    mask_cell, feather
        Of the cut masks along strips.
    strips
        In painting order.
    """

    charts: tuple[Chart, ...]
    exemplar_shape: tuple[int, int]
    block: int
    overlap: int
    tile: int
    mask_cell: int
    feather: int
    strips: tuple[Strip, ...]

    @property
    def step(self) -> int:
        """Distance of blocks, in texels."""
        return self.block - self.overlap

    @property
    def candidates(self) -> tuple[int, int]:
        """Rows and columns of candidates in the exemplar."""
        height, width = self.exemplar_shape
        return (height - self.block) // self.tile + 1, (width - self.block) // self.tile + 1

    @property
    def side(self) -> int:
        """Cells along each side of a mask; 0 where there are none."""
        return self.block // self.mask_cell if self.mask_cell else 0

    def block_grid(self, chart: int) -> tuple[int, int]:
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
        placed = np.zeros((rows, columns), PLACEMENT)
        placed["chart"] = chart
        placed["row"] = (np.arange(rows) * self.step + self.block // 2)[:, None]
        placed["column"] = np.arange(columns) * self.step + self.block // 2
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
        strip, half = self.strips[index], self.block // 2
        a, b = self.charts[strip.a], self.charts[strip.b]
        along = np.arange(len(chosen)) * self.step
        along = strip.start + np.minimum(along, strip.length - self.block) + half
        line = (0, a.width, a.height, 0)[strip.edge_a]
        on_a = np.zeros(len(chosen), PLACEMENT)
        on_a["chart"] = strip.a
        on_a["row"], on_a["column"] = (along, line) if strip.along_rows else (line, along)
        on_a["height"] = on_a["width"] = self.block
        on_a["mask"], on_a["mask_cell"], on_a["feather"] = MASK_CUT, self.mask_cell, self.feather
        self._set_sources(on_a, chosen)
        on_b = on_a.copy()
        on_b["chart"] = strip.b
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
        """Return the symmetry on B of a block upright on A, and B's steps for A's steps down and right."""
        a, b = self.charts[strip.a], self.charts[strip.b]
        rows, columns = strip.to_b(np.array([0, 1, 0]), np.array([0, 0, 1]), a, b)
        points = np.stack([rows, columns], axis=1)
        down, right = points[1] - points[0], points[2] - points[0]
        symmetry = int(np.flatnonzero((np.concatenate([down, right]) == SYMMETRIES).all(axis=1))[0])
        return symmetry, (down, right)

    def map_to_b(self, strip: Strip) -> NDArray[np.int64]:
        """Return (6,) int64: texel (r, c) of A's grid is (m0·r + m1·c + m4, m2·r + m3·c + m5) of B's."""
        a, b = self.charts[strip.a], self.charts[strip.b]
        rows, columns = strip.to_b(np.array([0, 1, 0]), np.array([0, 0, 1]), a, b)
        (r0, r1, r2), (c0, c1, c2) = rows.tolist(), columns.tolist()
        return np.array([r1 - r0, r2 - r0, c1 - c0, c2 - c0, r0, c0], np.int64)

    def strip_masks(
        self, index: int, coded: NDArray[np.uint8]
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Return the masks of a strip's blocks on A and on B, (blocks, side, side).

        Those given run along the strip: their rows are cells along the edge, their columns cells across it.
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
        cells, count = [np.zeros(0, np.uint8)], 0
        for n, start in enumerate(self.mask_starts[:-1].tolist()):
            run, area = len(self.charts) + n, self.side**2
            there = min(self.blocks_along(self.strips[n]), (len(masks) - start) // area)
            if there <= 0:
                break
            blocks = self.strip_blocks(n, chosen[first[run] : first[run] + there])
            for placed, grids in zip(
                blocks, self.strip_masks(n, masks[start : start + there * area]), strict=True
            ):
                # Along the edge blocks lie inside the chart, so all windows of a strip are alike.
                i0, i1, j0, j1 = mask_windows(placed[:1], self.charts)[0]
                seen = grids[:, i0:i1, j0:j1].reshape(there, -1)
                placed["first_cell"] = count + np.arange(there) * seen.shape[1]
                count += seen.size
                cells.append(seen.reshape(-1))
            parts += blocks
        placements = np.concatenate([np.zeros(0, PLACEMENT), *parts])
        order = np.argsort(placements["chart"], kind="stable")
        return placements[order], np.concatenate(cells)

    def _set_sources(self, placed: NDArray[np.void], chosen: IntArray) -> None:
        columns = self.candidates[1]
        placed["source_row"] = 16 * (chosen // columns * self.tile + self.block // 2)
        placed["source_column"] = 16 * (chosen % columns * self.tile + self.block // 2)

    def chosen(self, placed: NDArray[np.void]) -> IntArray:
        """Return the candidates that upright blocks have as sources."""
        row = placed["source_row"] // 16 - self.block // 2
        column = placed["source_column"] // 16 - self.block // 2
        return np.asarray(row // self.tile * self.candidates[1] + column // self.tile, np.int32)


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
