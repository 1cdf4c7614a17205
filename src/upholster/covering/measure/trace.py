"""The placement of each texel, and the neighbouring texels that do not have the same one."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import IntArray
from upholster.charts.charted_surface import ChartedSurface, charted_surface
from upholster.covering.measure.samples import Window, chosen_windows
from upholster.quilt.displacement import warped_sources
from upholster.quilt.model import Quilt
from upholster.quilt.warp_field import WarpField

__all__ = ["Border", "Trace", "charted_of", "quilt_windows", "step_sources", "traces"]

MOST_TEXELS = 2**23
SIDE = 2048

NEAR = 8
"""Half a pixel, in 1/16."""

Steps = NDArray[np.integer[Any]]


@dataclass(frozen=True, eq=False, slots=True)
class Border:
    """The pairs of neighbouring texels along one axis that belong to two placements.

    Attributes
    ----------
    rows, columns
        (n,) of the first texel of each pair, counted from the window's corner.
    first, second
        (n,) of `PLACEMENT`: those of the first texel and of its right or lower neighbour.
    onward, found
        (2, n) rows and columns in the exemplar, in 1/16 pixel, of the second texel: through the first one's
        placement, and through its own.
    cut
        (n,) whether these two differ by more than ½ pixel, or the placements' symmetries differ.
    """

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    first: NDArray[np.void]
    second: NDArray[np.void]
    onward: IntArray
    found: IntArray
    cut: NDArray[np.bool_]


@dataclass(frozen=True, eq=False, slots=True)
class Trace:
    """The placements that give the steps of a window most of their colour.

    Attributes
    ----------
    window
        The part of a chart.
    field
        The chart's warp field.
    placements
        The placements of the chart.
    owners
        (height, width) int32: index into `placements`; −1 beyond the surface, where it is invisible.
    """

    window: Window
    field: WarpField
    placements: NDArray[np.void]
    owners: IntArray

    @classmethod
    def of(cls, quilt: Quilt, window: Window, charted: ChartedSurface | None = None) -> "Trace":
        """Trace a window of a quilt (`Window.index` is the chart), on a `charted` surface only its texels."""
        index, shape = window.index, (window.height, window.width)
        owners = quilt.owners(index, window.row, window.column, *shape)
        if charted is not None:
            owners[~charted.lies_on(index, (window.row, window.column), shape)] = -1
        return cls(window, quilt.fields[index], quilt.on_chart(index), owners)

    def border(self, axis: int) -> Border:
        """Return the pairs of texels with two placements: lower neighbours (0) or right ones (1)."""
        own = self.owners
        one, other = (own[:-1], own[1:]) if axis == 0 else (own[:, :-1], own[:, 1:])
        rows, columns = np.nonzero((one != other) & (one >= 0) & (other >= 0))
        first, second = self.placements[one[rows, columns]], self.placements[other[rows, columns]]
        at = rows + self.window.row + (axis == 0), columns + self.window.column + (axis == 1)
        onward, found = (step_sources(self.field, owner, *at) for owner in (first, second))
        cut = (np.abs(onward - found) > NEAR).any(axis=0) | (first["symmetry"] != second["symmetry"])
        return Border(rows, columns, first, second, onward, found, cut)


def step_sources(field: WarpField, owner: NDArray[np.void], rows: Steps, columns: Steps) -> IntArray:
    """Return the places in the exemplar of the middles of steps, each through its own placement.

    Parameters
    ----------
    field
        The chart's warp field.
    owner
        (n,) of `PLACEMENT`: the one that each step uses.
    rows, columns
        (n,) the steps.

    Returns
    -------
    ndarray
        (2, n) rows and columns in the exemplar, in 1/16 pixel, before they are mirrored into it.
    """
    return np.stack(warped_sources(field, owner, 16 * rows + 8, 16 * columns + 8))


def charted_of(quilt: Quilt) -> ChartedSurface | None:
    """Return the charted surface of a quilt; None if it does not know its surface."""
    return None if quilt.surface is None else charted_surface(quilt.surface, quilt.charts)


def traces(quilt: Quilt) -> Iterator[Trace]:
    """Trace the parts of a quilt's charts that are measured; only texels on its surface, if it is known."""
    charted = charted_of(quilt)
    for window in quilt_windows(quilt):
        yield Trace.of(quilt, window, charted)


def quilt_windows(quilt: Quilt) -> list[Window]:
    """Choose the parts of a quilt's charts to measure (`Window.index` is the chart)."""
    shapes = [(chart.height, chart.width) for chart in quilt.charts]
    return chosen_windows(shapes, side=SIDE, most=MOST_TEXELS)
