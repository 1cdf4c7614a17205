"""The result of a synthesis: charts, a plan of placements, and the texels that painting them gives.

A *quilt* says where each block of texture comes from; it contains no colours. `upholster.quilt.painting`
turns a quilt and an exemplar into *texels*. The exact meaning of a placement: SPEC.md, section 8.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.quilt._paint_kernels import trace_owners
from upholster.quilt.chart import Chart
from upholster.quilt.displacement import warped_sources
from upholster.quilt.placement import SYMMETRIES, check_placements
from upholster.quilt.plans import Plan
from upholster.quilt.warp_field import WarpField
from upholster.shown import Shown
from upholster.types import IntArray, PixelArray, frozen_array

__all__ = ["Quilt", "Texels"]


@dataclass(frozen=True, eq=False)
class Texels(Shown):
    """What painting gives: one array per chart.

    Attributes
    ----------
    charts
        The layout.
    arrays
        One (height, width, channels) array per chart, of the exemplar's dtype.
    """

    charts: tuple[Chart, ...]
    arrays: tuple[PixelArray, ...]

    @property
    def count(self) -> int:
        """Number of texels over all charts."""
        return sum(chart.height * chart.width for chart in self.charts)

    @property
    def nbytes(self) -> int:
        """Bytes that the arrays take."""
        return sum(array.nbytes for array in self.arrays)


@dataclass(frozen=True, eq=False)
class Quilt(Shown):
    """Charts and the plan of their placements: the whole result of a synthesis.

    Attributes
    ----------
    charts
        The layout.
    exemplar_shape
        (height, width) in pixels of the exemplar that it was made from; any image of this shape can be
        painted.
    plan
        How the placements are arranged (`upholster.quilt.plans`); they derive from it. Placements made by
        hand are a `PlacementList`.
    fields
        Each chart's warp field; empty: the identity on all of them.

    Raises
    ------
    InputError
        If fields are not one for each chart, or a placement can not be painted, see `check_placements`.
    """

    charts: tuple[Chart, ...]
    exemplar_shape: tuple[int, int]
    plan: Plan
    fields: tuple[WarpField, ...] = ()

    def __post_init__(self) -> None:
        if not self.fields:
            object.__setattr__(self, "fields", (WarpField.identity(),) * len(self.charts))
        if len(self.fields) != len(self.charts):
            raise InputError(f"quilt has {len(self.fields)} fields; allowed: none, or one for each chart")
        check_placements(self.placements, self.mask_cells, self.charts, self.fields, self.exemplar_shape)

    @property
    def placements(self) -> NDArray[np.void]:
        """All placements, of `PLACEMENT`, read-only: chart after chart, in painting order on each."""
        return self._placed[0]

    @property
    def mask_cells(self) -> NDArray[np.uint8]:
        """The cells of the cut masks' windows, read-only, 1 = new, row by row, one mask after another."""
        return self._placed[1]

    @cached_property
    def _placed(self) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
        placements, mask_cells = self.plan.placements(self.charts)
        return frozen_array(placements), frozen_array(mask_cells)

    @cached_property
    def texel_count(self) -> int:
        """Number of texels over all charts."""
        return sum(chart.height * chart.width for chart in self.charts)

    @cached_property
    def largest_block(self) -> tuple[int, int]:
        """Largest height and width of any placement, in texels."""
        if not len(self.placements):
            return 1, 1
        return int(self.placements["height"].max()), int(self.placements["width"].max())

    @cached_property
    def copied(self) -> tuple[bool, ...]:
        """Per chart, whether its texels are copies of whole pixels, so that painting need not sample."""
        return tuple(
            field.is_identity and _on_pixels(self.on_chart(index), self.exemplar_shape)
            for index, field in enumerate(self.fields)
        )

    @cached_property
    def _starts(self) -> NDArray[np.intp]:
        return np.searchsorted(self.placements["chart"], np.arange(len(self.charts) + 1))

    def on_chart(self, index: int) -> NDArray[np.void]:
        """Return the placements of chart `index`, in painting order (a view)."""
        return self.placements[self._starts[index] : self._starts[index + 1]]

    def sources(self) -> tuple[IntArray, ...]:
        """Tell for each texel where in the exemplar it comes from.

        Returns
        -------
        tuple of ndarray
            Per chart, (height, width, 2): row and column in the exemplar in 1/16 pixel, of the placement that
            gives the texel most of its colour, clamped to the exemplar's pixel centres as painting does; −1
            where nothing is painted.
        """
        return tuple(self._sources(index) for index in range(len(self.charts)))

    def owners(self, index: int, row: int, column: int, height: int, width: int) -> IntArray:
        """Tell which placement gives each texel of a window of a chart most of its colour.

        Parameters
        ----------
        index
            The chart.
        row, column, height, width
            The window, in texels.

        Returns
        -------
        ndarray
            (height, width) int32: index into `on_chart`; −1 where none gives at least half.
        """
        chart = self.charts[index]
        found = np.empty((height, width), np.int32)
        sizes = (chart.height, chart.width, row, column)
        scratch = np.empty((2, *self.largest_block), np.int32)
        trace_owners(self.on_chart(index), self.mask_cells, sizes, scratch, found)
        return found

    def _sources(self, index: int) -> IntArray:
        chart = self.charts[index]
        owners = self.owners(index, 0, 0, chart.height, chart.width)
        out = np.full((*owners.shape, 2), -1, np.int32)
        painted = owners >= 0
        owner = self.on_chart(index)[owners[painted]]
        found = warped_sources(self.fields[index], owner, *np.nonzero(painted))
        for axis, (source, size) in enumerate(zip(found, self.exemplar_shape, strict=True)):
            out[painted, axis] = np.clip(source, 0, 16 * (size - 1))
        return out


def _on_pixels(placed: NDArray[np.void], shape: tuple[int, int]) -> bool:
    # Whether all texels of placements lie on whole pixels inside the exemplar, without a centre matrix.
    if placed["centred"].any() or ((placed["source_row"] | placed["source_column"]) & 15).any():
        return False
    symmetry = SYMMETRIES[placed["symmetry"]]
    low_row, low_column = -(placed["height"] // 2), -(placed["width"] // 2)
    high_row, high_column = low_row + placed["height"] - 1, low_column + placed["width"] - 1
    for axis, name, size in ((0, "row", shape[0]), (2, "column", shape[1])):
        a, b, source = (
            symmetry[:, axis],
            symmetry[:, axis + 1],
            placed[f"source_{name}"].astype(np.int64) >> 4,
        )
        ends = [source + a * i + b * j for i in (low_row, high_row) for j in (low_column, high_column)]
        if (np.minimum.reduce(ends) < 0).any() or (np.maximum.reduce(ends) >= size).any():
            return False
    return True
