"""The plan of method "quilt": on each chart the blocks transferred to it, then its own on an even grid."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.quilt.chart import Chart
from upholster.methods.quilt.masked import MASK_CUT, MASK_NONE, PLACEMENT, mask_sizes

__all__ = ["BLOCK", "ChartGrid", "GridPlan"]

BLOCK = np.dtype(
    [
        ("row", np.int32),  # centre, in texels of the chart
        ("column", np.int32),
        ("height", np.int32),  # texels
        ("width", np.int32),
        ("symmetry", np.int32),  # of the square, as a placement's
        ("cut", np.int32),  # 1: has a cut mask, 0: is painted whole
        ("source_row", np.int32),  # in 1/16 pixel
        ("source_column", np.int32),
        ("link", np.int32),  # of a transferred block: the block that it was transferred from, -1: none known
        ("centred", np.int32),  # 1: has a centre matrix of its own
        ("matrix", np.int32, 4),  # if so, row by row, in 1/4096 pixel per texel
    ]
)

_SHARED_FIELDS = ("row", "column", "height", "width", "symmetry", "source_row", "source_column")


@dataclass(frozen=True, slots=True)
class ChartGrid:
    """Where blocks lie that were laid on a chart at a time.

    A chart that meets itself has several grids, and one that was refined, or got smaller blocks, another one
    of no position of its own: the added blocks are its transferred ones, without links.

    Attributes
    ----------
    chart
        Its number.
    rows, across
        Positions of its grid.
    first_row, first_column
        Centre of the first position, in texels.
    height, width
        Size of its own blocks.
    step_row, step_column
        Distances of positions.
    level
        Level of the pyramid whose pixels new sources lie on.
    mask_cell
        Size of the masks' cells in texels.
    transferred, own
        How many blocks were transferred to the chart first, or added to it, and how many lie on the grid:
        some positions may have none.
    """

    chart: int
    rows: int
    across: int
    first_row: int
    first_column: int
    height: int
    width: int
    step_row: int
    step_column: int
    level: int
    mask_cell: int
    transferred: int
    own: int

    @property
    def positions(self) -> int:
        """How many positions its grid has."""
        return self.rows * self.across

    @property
    def blocks(self) -> int:
        """How many blocks lie on the chart."""
        return self.transferred + self.own


@dataclass(frozen=True, eq=False)
class GridPlan:
    """A quilt of method "quilt".

    Attributes
    ----------
    grids
        Where blocks lie, in the order in which they were laid: what is transferred comes from grids before.
        Every chart has one or several, one right after the other.
    feather
        Smoothing passes of all cut masks.
    blocks
        Of `BLOCK`: grid after grid, of each the transferred ones in painting order, then its own in raster
        order. A link is the index of a block of a grid before.
    mask_cells
        uint8, 1 = new: the windows of the cut masks, in the blocks' order.
    """

    grids: tuple[ChartGrid, ...]
    feather: int
    blocks: NDArray[np.void]
    mask_cells: NDArray[np.uint8]

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """Where each grid's blocks begin, and their number: (grids + 1,)."""
        counts = [grid.blocks for grid in self.grids]
        return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])

    def placements(self, charts: Sequence[Chart]) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
        """Return the placements, chart after chart in painting order, and the cells of their masks."""
        placed = self.in_order()
        sizes = mask_sizes(placed, charts)
        placed["first_cell"] = np.where(placed["mask"] == MASK_CUT, np.cumsum(sizes) - sizes, -1)
        return placed[np.argsort(placed["chart"], kind="stable")], self.mask_cells

    def in_order(self) -> NDArray[np.void]:
        """Return the placements in the order of `blocks`, without where their masks begin."""
        blocks = self.blocks
        placed = np.zeros(len(blocks), PLACEMENT)
        counts = np.diff(self.starts)
        placed["chart"] = np.repeat(np.array([grid.chart for grid in self.grids], np.int32), counts)
        for name in _SHARED_FIELDS:
            placed[name] = blocks[name]
        placed["centred"], placed["matrix"] = blocks["centred"], blocks["matrix"]
        cut = blocks["cut"] == 1
        cells = np.array([grid.mask_cell for grid in self.grids], np.int64)
        placed["mask"] = np.where(cut, MASK_CUT, MASK_NONE)
        placed["mask_cell"] = np.where(cut, np.repeat(cells, counts), 0)
        placed["feather"] = np.where(cut, self.feather, 0)
        placed["first_cell"] = -1
        return placed
