"""Which placement each texel comes from, and which neighbouring texels continue one another."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.measure.samples import Window, chosen_windows
from upholster.quilt import Quilt
from upholster.quilt._paint_kernels import trace_owners
from upholster.quilt.warp import warped_sources
from upholster.quilt.warp_field import WarpField
from upholster.types import IntArray

__all__ = ["Border", "Trace", "field_of", "quilt_windows"]

MOST_TEXELS = 2**23
SIDE = 2048

NEAR = 8
"""Half a pixel, in 1/16."""

IDENTITY = WarpField(np.zeros((1, 1, 4), np.int16), margin=0)
"""What a chart without a field has: texel steps are pixel steps."""

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False, slots=True)
class Border:
    """The pairs of neighbouring texels along one axis that two placements paint.

    Attributes
    ----------
    rows, columns
        (n,) of the first texel of each pair, counted from the window's corner.
    first, second
        (n,) of `PLACEMENT`: who paints the first texel and its right or lower neighbour.
    continued
        (n,) whether the second texel is where the first one's placement would have it, within ½ pixel.
    """

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    first: NDArray[np.void]
    second: NDArray[np.void]
    continued: Flags


@dataclass(frozen=True, eq=False, slots=True)
class Trace:
    """The placements that give the texels of a window most of their colour.

    Attributes
    ----------
    window
        Which part of which chart.
    field
        The chart's warp field; the identity where it has none.
    placements
        Those that touch the window, in painting order.
    owners
        (height, width) int32: index into `placements`, −1 where none gives at least half of the colour.
    """

    window: Window
    field: WarpField
    placements: NDArray[np.void]
    owners: IntArray

    @classmethod
    def of(cls, quilt: Quilt, window: Window) -> "Trace":
        """Trace a window of a quilt (`Window.index` is the chart)."""
        placements = quilt.on_chart(window.index)
        top = placements["row"] - placements["height"] // 2 - window.row
        left = placements["column"] - placements["width"] // 2 - window.column
        touching = (top < window.height) & (top + placements["height"] > 0)
        touching &= (left < window.width) & (left + placements["width"] > 0)
        mine: NDArray[np.void] = placements[touching]
        local = mine.copy()
        local["row"] -= window.row
        local["column"] -= window.column
        owners = np.empty((window.height, window.width), np.int32)
        scratch = np.empty((2, *quilt.largest_block), np.int32)
        # Read-only, as in `Quilt.sources`: one compiled version of the kernel serves both.
        local.setflags(write=False)
        trace_owners(local, quilt.cells, scratch, owners)
        return cls(window, field_of(quilt, window.index), mine, owners)

    def border(self, axis: int) -> Border:
        """Return the pairs of texels that two placements paint: lower neighbours (0) or right ones (1)."""
        one, other = _pair(self.owners, axis)
        rows, columns = np.nonzero((one != other) & (one >= 0) & (other >= 0))
        first, second = self.placements[one[rows, columns]], self.placements[other[rows, columns]]
        at = (rows + self.window.row + (axis == 0), columns + self.window.column + (axis == 1))
        near = first["symmetry"] == second["symmetry"]
        for mine, its in zip(
            warped_sources(self.field, first, *at), warped_sources(self.field, second, *at), strict=True
        ):
            near &= np.abs(mine - its) <= NEAR
        return Border(rows, columns, first, second, near)

    def links(self, axis: int) -> Flags:
        """Return which texels the lower (0) or right (1) neighbour continues: one less than the window."""
        one, other = _pair(self.owners, axis)
        linked: Flags = (one == other) & (one >= 0)
        border = self.border(axis)
        linked[border.rows, border.columns] = border.continued
        return linked


def quilt_windows(quilt: Quilt) -> list[Window]:
    """Choose the parts of a quilt's charts that are measured (`Window.index` is the chart)."""
    shapes = [(chart.height, chart.width) for chart in quilt.charts]
    return chosen_windows(shapes, side=SIDE, most=MOST_TEXELS)


def field_of(quilt: Quilt, chart: int) -> WarpField:
    """Return the warp field of a chart, the identity where it has none."""
    return (quilt.fields[chart] if quilt.fields else None) or IDENTITY


def _pair(array: IntArray, axis: int) -> tuple[IntArray, IntArray]:
    return (array[:-1], array[1:]) if axis == 0 else (array[:, :-1], array[:, 1:])
