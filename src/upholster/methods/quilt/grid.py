"""Where a chart's blocks lie: their size in texels, the level they read, and their order."""

from collections.abc import Sequence, Set
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._block_kernels import BLOCK_COLUMNS, COLUMN, LAID, LEFT, ROW, TOP
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import WarpField
from upholster.types import FloatArray, IntArray

__all__ = ["BlockGrid", "GridPart", "coarse_cells"]

_SMALLEST_BLOCK = 16
_LARGEST_BLOCK = 512
_COARSE, _COARSE_IN_STEP, _COARSE_TEXELS = 48, 24, 24
"""Blocks of so many pixels, and of so many texels, have masks of cells twice as large: as many bytes tell as
long a cut."""

_LEAST_OVERLAP = 8
"""Texels where the texture is minified: in less, a cut has no way to choose from."""

_SMALLEST_LEVEL = 16
"""Pixels that a level has at least each way."""

_LARGEST_SHARE = 0.75
"""Of the exemplar's height and width that a block may read, so that there are several to choose from."""


def coarse_cells(
    charts: Sequence[Chart], fields: Sequence[WarpField], blocks: Set[int], *, in_step: bool = False
) -> dict[int, bool]:
    """Tell whether the cells of masks are twice as large, on all charts alike, for blocks of each side.

    Parameters
    ----------
    charts, fields
        The layout.
    blocks
        Sides of blocks in exemplar pixels.
    in_step
        Whether phases keep blocks in step: then cuts matter less, and smaller blocks will do.
    """
    least = _COARSE_IN_STEP if in_step else _COARSE
    scale = max(1.0, *(_typical(_sizes(*one)[0]) for one in zip(charts, fields, strict=True)))
    return {block: block >= least and block / scale >= _COARSE_TEXELS for block in blocks}


@dataclass(frozen=True, eq=False, slots=True)
class GridPart:
    """Blocks that are laid at a time.

    Attributes
    ----------
    blocks
        Their places in the grid's raster.
    closed
        Edges at which the chart meets blocks of itself that are laid already.
    """

    blocks: NDArray[np.intp]
    closed: set[int]


@dataclass(frozen=True, slots=True)
class BlockGrid:
    """The blocks of one chart.

    Attributes
    ----------
    chart, field
        The chart.
    level
        The pyramid's level whose pixels come nearest to its texels.
    sample
        Texels per pixel of that level: of so many texels each way, one is looked at.
    mask_cell
        Size of a mask's cells in texels.
    height, width
        Of a block, in texels: a multiple of `mask_cell`.
    overlap_rows, overlap_columns
        With the block before, in texels.
    wrap
        Whether the chart's opposite edges meet.
    """

    chart: Chart
    field: WarpField
    level: int
    sample: int
    mask_cell: int
    height: int
    width: int
    overlap_rows: int
    overlap_columns: int
    wrap: bool = False

    @classmethod
    def of(
        cls,
        chart: Chart,
        field: WarpField,
        exemplar_shape: tuple[int, int],
        block: int,
        overlap: int | None,
        *,
        coarse: bool = False,
        copied: bool = False,
        wrap: bool = False,
        most: tuple[float, float] = (_LARGEST_BLOCK, _LARGEST_BLOCK),
    ) -> "BlockGrid":
        """Fit blocks of given size in exemplar pixels to a chart.

        Parameters
        ----------
        exemplar_shape
            (height, width) in pixels: a block reads at most three quarters of it.
        block, overlap
            In pixels; an overlap of None is three tenths of a block, and 8 texels or more where the texture
            is minified.
        coarse
            Whether masks' cells are twice as large, see `coarse_cells`.
        copied
            Whether blocks must lie inside the exemplar, for their texels are copies of whole pixels.
        wrap
            Whether the chart's opposite edges meet as a tile's do: a block then takes half of it at most.
        most
            Largest height and width in texels.
        """
        sizes, crossed = _sizes(chart, field)
        typical = _typical(sizes)
        last = max(0, int(np.log2(min(exemplar_shape) / _SMALLEST_LEVEL)))
        level = min(max(0, int(np.floor(np.log2(typical) + 0.5))), last)
        sample = max(1, int(np.rint(2**level / typical)))
        cell = (4 if coarse else 2) * sample
        least = _LEAST_OVERLAP if overlap is None and level > 0 else 4 * sample
        share = block / (0.3 * block if overlap is None else overlap)
        sides, overlaps = [], []
        wanted = block / sizes
        wanted *= min(1.0, float((_LARGEST_SHARE * np.array(exemplar_shape) / (crossed @ wanted)).min()))
        wanted = np.clip(wanted, _SMALLEST_BLOCK, np.maximum(_SMALLEST_BLOCK, most))
        if wrap:
            wanted = np.minimum(wanted, (chart.height // 2, chart.width // 2))
        for texels, pixels in zip(wanted, exemplar_shape, strict=True):
            side = cell * max(2, int(np.rint(texels / cell)))
            if copied:  # it must lie inside the exemplar
                side = max(cell, min(side, pixels // cell * cell))
            sides.append(side)
            # At least one box of features deep.
            overlaps.append(min(max(least, 4 * sample, cell * int(np.rint(side / share / cell))), side // 2))
        return cls(chart, field, level, sample, cell, sides[0], sides[1], overlaps[0], overlaps[1], wrap)

    @property
    def cells(self) -> int:
        """How many cells a block's mask has."""
        return self.height // self.mask_cell * (self.width // self.mask_cell)

    def crossed(self, sides: tuple[int, int]) -> FloatArray:
        """Return how many rows and columns of the exemplar so many rows and columns of texels read."""
        found: FloatArray = _sizes(self.chart, self.field)[1] @ np.array(sides, float)
        return found

    def need(self, open_sides: Set[int]) -> tuple[int, int, int, int]:
        """Return which texels to cover: rows from, to, columns from, to.

        Parameters
        ----------
        open_sides
            Edges (0 top, 1 right, 2 bottom, 3 left) at which a neighbour is not laid yet: there, blocks
            continue for an overlap beyond the edge.
        """
        rows = self._reach(self.height, self.overlap_rows)
        columns = self._reach(self.width, self.overlap_columns)
        return (
            -rows * (0 in open_sides),
            self.chart.height + rows * (2 in open_sides),
            -columns * (3 in open_sides),
            self.chart.width + columns * (1 in open_sides),
        )

    def _reach(self, side: int, overlap: int) -> int:
        # How far blocks go on beyond an edge: a little more than an overlap, for masks transferred over an
        # edge lose their rims. But blocks must not end at the edge itself, which would show.
        reach = overlap + 2 * self.mask_cell + 8
        return reach if reach <= side - 2 else side - overlap

    def opened(self, around: Set[int]) -> set[int]:
        """Return the edges that stay open at first of those along which the chart meets itself.

        Parameters
        ----------
        around
            The edges: of two opposite ones the first stays open, if a block fits between them.
        """
        out = set()
        if around & {0, 2} and self.height <= self.chart.height:
            out.add(0)
        if around & {1, 3} and self.width <= self.chart.width:
            out.add(3)
        return out

    def parts(self, need: tuple[int, int, int, int], opened: Set[int]) -> list["GridPart"]:
        """Tell which blocks are laid at a time: all of them, or halves between opposite edges that meet.

        The first half ends before what its blocks show once more at the other edge.

        Parameters
        ----------
        need
            As for `blocks`.
        opened
            The edges that stay open at first, see `opened`.
        """
        rows = self._starts(need[0], need[1], self.height, self.overlap_rows)
        columns = self._starts(need[2], need[3], self.width, self.overlap_columns)
        late_rows = self._late(rows, self.height, self.chart.height, need[0]) & (0 in opened)
        late_columns = self._late(columns, self.width, self.chart.width, need[2]) & (3 in opened)
        part = (2 * late_rows[:, None] + late_columns).reshape(-1)
        closed = (set[int](), {1}, {2}, {1, 2})
        found = [GridPart(np.flatnonzero(part == n), closed[n]) for n in range(4)]
        return [one for one in found if len(one.blocks)]

    def _late(self, starts: IntArray, size: int, length: int, need: int) -> NDArray[np.bool_]:
        # Which rows or columns of blocks belong to the second half; `need` texels before 0 come once more.
        late = np.asarray((starts + size > length + need) | (2 * starts + size >= length))
        late[0] = False
        return late

    def across(self, need: tuple[int, int, int, int]) -> int:
        """Return how many blocks lie side by side."""
        return len(self._starts(need[2], need[3], self.width, self.overlap_columns))

    def smaller(self, block: int, exemplar_shape: tuple[int, int]) -> "BlockGrid":
        """Return smaller blocks of the same chart, of so many exemplar pixels."""
        return BlockGrid.of(
            self.chart, self.field, exemplar_shape, block, None,
            coarse=self.mask_cell > 2 * self.sample, most=(self.height, self.width),
        )  # fmt: skip

    def centres(self, need: tuple[int, int, int, int]) -> tuple[IntArray, IntArray]:
        """Return the rows and the columns of the centres of the blocks that cover what is needed."""
        rows = self._starts(need[0], need[1], self.height, self.overlap_rows) + self.height // 2
        columns = self._starts(need[2], need[3], self.width, self.overlap_columns) + self.width // 2
        return rows, columns

    def blocks(self, need: tuple[int, int, int, int]) -> IntArray:
        """Return the blocks that cover what is needed, in raster order, as `lay_blocks` takes them."""
        rows, columns = self.centres(need)
        number = np.arange(len(rows) * len(columns), dtype=np.int32).reshape(len(rows), len(columns))
        out = np.zeros((*number.shape, BLOCK_COLUMNS), np.int32)
        out[..., ROW], out[..., COLUMN] = rows[:, None], columns
        out[..., LEFT] = out[..., TOP] = -1
        out[:, 1:, LEFT] = number[:, :-1]
        out[1:, :, TOP] = number[:-1]
        out[..., LAID] = 0
        return out.reshape(-1, BLOCK_COLUMNS)

    def _starts(self, start: int, stop: int, block: int, overlap: int) -> IntArray:
        # Where the blocks along one axis begin: the last one reaches the end, or overlaps the first.
        step = block - overlap
        if self.wrap:
            count = -(-(stop - start) // step)
            return (start + np.arange(count) * (stop - start) // count).astype(np.int32)
        count = max(1, -(-(stop - start - overlap) // step))
        return (start + np.arange(count) * step).astype(np.int32)


def _typical(sizes: FloatArray) -> float:
    # Exemplar pixels per texel, by `_sizes`' lengths of steps.
    return float(np.sqrt(sizes[0] * sizes[1]))


def _sizes(chart: Chart, field: WarpField) -> tuple[FloatArray, FloatArray]:
    # Exemplar pixels per texel: the typical lengths of a step down and of one right; and, as a matrix, the
    # most rows and columns of the exemplar that either crosses.
    rows = np.linspace(0, chart.height - 1, min(9, chart.height))
    columns = np.linspace(0, chart.width - 1, min(9, chart.width))
    matrices = field.at(*np.meshgrid(rows, columns, indexing="ij"))
    lengths = np.maximum(1e-3, np.linalg.norm(matrices, axis=-2)).reshape(-1, 2)
    return np.exp(np.log(lengths).mean(axis=0)), np.abs(matrices).reshape(-1, 2, 2).max(axis=0)
