"""The result of a synthesis: charts, a plan of placements, and the texels that painting them gives.

A *quilt* says where each block of texture comes from; it contains no colours. `upholster.quilt.painting`
turns a quilt and an exemplar into *texels*. The exact meaning of a placement: SPEC.md, section 8.
"""

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import DTypeLike, NDArray

from upholster.errors import InputError
from upholster.geometry import AnySurface, MeshSurface
from upholster.quilt._paint_kernels import trace_owners, weight_rows
from upholster.quilt.chart import Chart
from upholster.quilt.displacement import warped_sources
from upholster.quilt.placement import SYMMETRIES, check_placements
from upholster.quilt.plans import Plan
from upholster.quilt.warp_field import WarpField
from upholster.shown import Shown, on_a_line
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
    quilt, exemplar
        What they were painted from; None where they were made otherwise.

    Raises
    ------
    InputError
        If the arrays are not one for each chart, of its height and width.
    """

    charts: tuple[Chart, ...]
    arrays: tuple[PixelArray, ...]
    quilt: "Quilt | None" = None
    exemplar: PixelArray | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.arrays, tuple) or not _are_charts(self.charts):
            raise InputError("charts and arrays of texels must be tuples, one array for each chart")
        shapes = [getattr(array, "shape", ()) for array in self.arrays]
        expected = [(chart.height, chart.width) for chart in self.charts]
        if [shape[:2] for shape in shapes] != expected or any(len(shape) != 3 for shape in shapes):
            raise InputError(
                f"texels have {len(shapes)} arrays for {len(expected)} charts, or others than the charts' "
                "shapes; allowed: one of (height, width, channels) for each chart"
            )

    def __repr__(self) -> str:
        first = self.arrays[0] if self.arrays else np.zeros((0, 0, 0), np.uint8)
        parts = {"charts": len(self.charts), "texels": self.count, "channels": first.shape[2]}
        return on_a_line(self, {**parts, "dtype": str(first.dtype)})

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> PixelArray:
        """Return the array of the only chart, for `numpy.asarray`.

        Raises
        ------
        InputError
            If there are several charts.
        """
        if len(self.arrays) != 1:
            raise InputError(
                f"texels have {len(self.arrays)} charts, so they are not one array; allowed: .arrays, "
                "a tuple with one for each chart"
            )
        array = self.arrays[0] if dtype is None else self.arrays[0].astype(dtype, copy=False)
        return array.copy() if copy else array

    @property
    def surface(self) -> AnySurface | None:
        """The surface that they were made for; None where that is not known."""
        return None if self.quilt is None else self.quilt.surface

    def check_surface(self, surface: AnySurface) -> None:
        """Raise InputError if they belong to another surface."""
        _check_surface("texels", self.charts, self.surface, surface)

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
    surface
        The surface that it was made for; None where that is not known.
    seed
        That it was made with, if a synthesis made it.

    Raises
    ------
    InputError
        If fields are not one for each chart, or a placement can not be painted, see `check_placements`.
    """

    charts: tuple[Chart, ...]
    exemplar_shape: tuple[int, int]
    plan: Plan
    fields: tuple[WarpField, ...] = ()
    surface: AnySurface | None = None
    seed: int | None = None

    def __repr__(self) -> str:
        height, width = self.exemplar_shape
        parts = {"charts": len(self.charts), "texels": self.texel_count, "placements": len(self.placements)}
        return on_a_line(self, {**parts, "sample": f"{width}x{height}", "seed": self.seed})

    def on(self, surface: AnySurface | None, *, seed: int | None = None) -> "Quilt":
        """Return the same quilt, which knows its surface and the seed that it was made with."""
        known = copy(self)  # nothing is checked or computed again
        object.__setattr__(known, "surface", surface)
        object.__setattr__(known, "seed", seed)
        return known

    def check_surface(self, surface: AnySurface) -> None:
        """Raise InputError if it was made for another surface."""
        _check_surface("quilt", self.charts, self.surface, surface)

    def __post_init__(self) -> None:
        if not _are_charts(self.charts) or not isinstance(self.fields, tuple):
            raise InputError("charts and fields of a quilt must be tuples, of Chart and of WarpField")
        if not (isinstance(self.exemplar_shape, tuple) and len(self.exemplar_shape) == 2):
            raise InputError(f"exemplar_shape is {self.exemplar_shape!r}; allowed: (height, width)")
        if not callable(getattr(self.plan, "placements", None)):
            raise InputError(
                f"plan is a {type(self.plan).__name__}; allowed: a plan of `upholster.quilt.plans`"
            )
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
        beside = self.placements["chart"][~_on_pixels(self.placements, self.exemplar_shape)]
        others = np.bincount(beside, minlength=len(self.charts)).tolist()
        return tuple(
            field.is_identity and not count for field, count in zip(self.fields, others, strict=True)
        )

    @cached_property
    def _starts(self) -> NDArray[np.intp]:
        return np.searchsorted(self.placements["chart"], np.arange(len(self.charts) + 1))

    def on_chart(self, index: int) -> NDArray[np.void]:
        """Return the placements of chart `index`, in painting order (a view)."""
        return self.placements[self._starts[index] : self._starts[index + 1]]

    def sources(self) -> tuple[IntArray, ...]:
        """Tell for each texel where in the exemplar it comes from.

        So whatever else is known of the exemplar's pixels goes onto the surface as well: labels, numbers,
        another picture. `docs/sources.ipynb` shows how.

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
        tall, wide = self.largest_block
        scratch = np.empty((2, weight_rows(height, tall), wide), np.int32)
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


def _are_charts(charts: object) -> bool:
    return isinstance(charts, tuple) and all(isinstance(chart, Chart) for chart in charts)


def _check_surface(what: str, charts: tuple[Chart, ...], own: AnySurface | None, surface: AnySurface) -> None:
    """Raise unless charts, made for the surface `own` if that is known, can lie on `surface`."""
    if own is not None:
        if not own.is_like(surface):
            raise InputError(f"{what} belong to {own!r}; allowed: no other surface, but given is {surface!r}")
        return
    if isinstance(surface, MeshSurface):
        if {chart.face for chart in charts} != set(range(surface.islands)):
            raise InputError(f"{what} have charts on other islands than {surface!r}")
        return
    faces = surface.faces
    if {chart.face for chart in charts} != set(range(len(faces))) or any(
        chart.s1 > faces[chart.face].rows or chart.t1 > faces[chart.face].columns for chart in charts
    ):
        raise InputError(
            f"{what} have charts on {len({chart.face for chart in charts})} faces that do not fit {surface!r}"
        )


def _on_pixels(placed: NDArray[np.void], shape: tuple[int, int]) -> NDArray[np.bool_]:
    # Whether all texels of a placement lie on whole pixels inside the exemplar, without a centre matrix.
    on: NDArray[np.bool_] = (placed["centred"] == 0) & (
        (placed["source_row"] | placed["source_column"]) & 15 == 0
    )
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
        on &= (np.minimum.reduce(ends) >= 0) & (np.maximum.reduce(ends) < size)
    return on
