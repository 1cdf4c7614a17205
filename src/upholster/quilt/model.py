"""The result of a synthesis: charts, placements and label maps; and the texels that painting produces.

A *quilt* defines where each block of texture comes from; it contains no colours. `upholster.quilt.painting`
turns a quilt and an exemplar into *texels*. SPEC.md, section 8, defines a placement exactly.
"""

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import DTypeLike, NDArray

from upholster.base.display import Shown, on_a_line
from upholster.base.errors import InputError
from upholster.base.types import IntArray, PixelArray, frozen_array
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.quilt.chart import Chart
from upholster.quilt.displacement import warped_sources
from upholster.quilt.labels import LabelMap
from upholster.quilt.placement import check_placements
from upholster.quilt.warp_field import WarpField

__all__ = ["DENSITIES", "Quilt", "Texels"]

DENSITIES = tuple(2.0**k for k in range(-3, 7))
"""Texels per step, each way, for which a quilt may be made."""


@dataclass(frozen=True, eq=False)
class Texels(Shown):
    """The result of painting: one array per chart.

    Attributes
    ----------
    charts
        The layout.
    arrays
        One (height, width, channels) array per chart, of the exemplar's dtype.
    quilt, exemplar
        The quilt and the exemplar that they were painted from; None if they were made in another way.

    Raises
    ------
    InputError
        If the arrays are not one for each chart, with its height and width.
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
                f"texels have {len(shapes)} arrays for {len(expected)} charts, or have other shapes than the "
                "charts; allowed: one of (height, width, channels) for each chart"
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
        """The surface that they were made for; None if it is not known."""
        return None if self.quilt is None else self.quilt.surface

    def check_surface(self, surface: AnySurface) -> None:
        """Raise InputError if they were made for another surface."""
        _check_surface("texels", self.charts, self.surface, surface)

    @property
    def count(self) -> int:
        """Number of texels over all charts."""
        return sum(chart.height * chart.width for chart in self.charts)

    @property
    def nbytes(self) -> int:
        """Size of the arrays in bytes."""
        return sum(array.nbytes for array in self.arrays)


@dataclass(frozen=True, eq=False)
class Quilt(Shown):
    """Charts, warp fields, placements and label maps: the complete result of a synthesis.

    Attributes
    ----------
    charts
        The layout, in steps.
    exemplar_shape
        (height, width) in pixels of the exemplar that it was made from; any image of this shape can be
        painted.
    placements
        Structured array of `PLACEMENT`, read-only: chart by chart, first the placements of its first layer,
        then those of its second.
    labels
        One or two label maps per chart: the second layer covers the first.
    fields
        Each chart's warp field; if empty, the identity on all charts.
    surface
        The surface that it was made for; None if it is not known.
    seed
        The seed that it was made with, if a synthesis made it.
    density
        Texels per step, each way, at which it is painted by default: a power of two from 1/8 to 64.
    has_tones
        Whether painting adds tones: broad shades change over several cells where placements meet, and details
        within one. Only with one layer on each chart.

    Raises
    ------
    InputError
        If fields or labels are not one for each chart, the density is not allowed, a placement cannot be
        painted (`check_placements`), or a label is not the number of one of its chart's placements.
    """

    charts: tuple[Chart, ...]
    exemplar_shape: tuple[int, int]
    placements: NDArray[np.void]
    labels: tuple[tuple[LabelMap, ...], ...]
    fields: tuple[WarpField, ...] = ()
    surface: AnySurface | None = None
    seed: int | None = None
    density: float = 1.0
    has_tones: bool = False

    def __repr__(self) -> str:
        height, width = self.exemplar_shape
        parts = {"charts": len(self.charts), "steps": self.steps, "placements": len(self.placements)}
        return on_a_line(self, {**parts, "sample": f"{width}x{height}", "seed": self.seed})

    def on(
        self, surface: AnySurface | None, *, seed: int | None = None, density: float | None = None
    ) -> "Quilt":
        """Return the same quilt with its surface and its seed, and optionally another density."""
        known = copy(self)  # without checking or computing anything again
        object.__setattr__(known, "surface", surface)
        object.__setattr__(known, "seed", seed)
        object.__setattr__(known, "density", self.density if density is None else density)
        return known

    def check_surface(self, surface: AnySurface) -> None:
        """Raise InputError if it was made for another surface."""
        _check_surface("quilt", self.charts, self.surface, surface)

    def __post_init__(self) -> None:
        if not _are_charts(self.charts) or not isinstance(self.fields, tuple):
            raise InputError("charts and fields of a quilt must be tuples, of Chart and of WarpField")
        if not (isinstance(self.exemplar_shape, tuple) and len(self.exemplar_shape) == 2):
            raise InputError(f"exemplar_shape is {self.exemplar_shape!r}; allowed: (height, width)")
        if self.density not in DENSITIES:
            raise InputError(f"density is {self.density!r}; allowed: a power of two from 1/8 to 64")
        if not self.fields:
            object.__setattr__(self, "fields", (WarpField.identity(),) * len(self.charts))
        if len(self.fields) != len(self.charts):
            raise InputError(f"quilt has {len(self.fields)} fields; allowed: none, or one for each chart")
        if self.has_tones and any(len(each) > 1 for each in self.labels):
            raise InputError("has_tones is True with a second layer; allowed: with one layer")
        check_placements(self.placements, self.charts, self.exemplar_shape)
        frozen_array(self.placements)
        self._check_labels()

    def _check_labels(self) -> None:
        if (
            not isinstance(self.labels, tuple)
            or len(self.labels) != len(self.charts)
            or not all(isinstance(each, tuple) and 1 <= len(each) <= 2 for each in self.labels)
            or not all(isinstance(layer, LabelMap) for each in self.labels for layer in each)
        ):
            raise InputError("labels must be a tuple of one or two label maps for each chart")
        first = np.cumsum(
            np.bincount(
                2 * self.placements["chart"] + self.placements["layer"], minlength=2 * len(self.charts)
            ).reshape(-1, 2),
            axis=1,
        )
        for chart, layers, (lower, upper) in zip(self.charts, self.labels, first.tolist(), strict=True):
            layers[0].check(chart, 0, lower, empty=False)
            for layer in layers[1:]:
                layer.check(chart, lower, upper, empty=True)

    @cached_property
    def steps(self) -> int:
        """Number of steps over all charts, which is the number of texels at density 1."""
        return sum(chart.height * chart.width for chart in self.charts)

    @cached_property
    def _starts(self) -> NDArray[np.intp]:
        return np.searchsorted(self.placements["chart"], np.arange(len(self.charts) + 1))

    def first_on(self, index: int) -> int:
        """Return the number of the first placement of chart `index`."""
        return int(self._starts[index])

    def on_chart(self, index: int) -> NDArray[np.void]:
        """Return the placements of chart `index`, to which its labels refer (a view)."""
        return self.placements[self._starts[index] : self._starts[index + 1]]

    def sources(self) -> tuple[IntArray, ...]:
        """Return the place in the exemplar from which each step comes.

        This transfers any other data on the exemplar's pixels to the surface as well: labels, numbers,
        another picture. `docs/sources.ipynb` shows how.

        Returns
        -------
        tuple of ndarray
            Per chart, (height, width, 2): row and column in the exemplar in 1/16 pixel, for the placement
            that shows in the step's cell, mirrored into the exemplar as in painting.
        """
        return tuple(self._sources(index) for index in range(len(self.charts)))

    def owners(self, index: int, row: int, column: int, height: int, width: int) -> IntArray:
        """Return the placement that shows in the cell of each step of a window of a chart.

        Parameters
        ----------
        index
            The chart.
        row, column, height, width
            The window, in steps.

        Returns
        -------
        ndarray
            (height, width) int32: index into `on_chart`; a placement of the second layer where one shows.
        """
        rows = row + np.arange(height, dtype=np.int64)[:, None]
        columns = column + np.arange(width, dtype=np.int64)[None]
        found = self.labels[index][0].at(rows, columns)
        for layer in self.labels[index][1:]:
            above = layer.at(rows, columns)
            found = np.where(above >= 0, above, found)
        return found

    def _sources(self, index: int) -> IntArray:
        chart = self.charts[index]
        owners = self.owners(index, 0, 0, chart.height, chart.width)
        rows, columns = np.mgrid[8 : 16 * chart.height : 16, 8 : 16 * chart.width : 16]
        owner = self.on_chart(index)[owners.reshape(-1)]
        found = warped_sources(self.fields[index], owner, rows.reshape(-1), columns.reshape(-1))
        out = np.empty((*owners.shape, 2), np.int32)
        for axis, (source, size) in enumerate(zip(found, self.exemplar_shape, strict=True)):
            out[..., axis] = _mirrored(source, size).reshape(owners.shape)
        return out


def _mirrored(places: IntArray, size: int) -> IntArray:
    # Mirrors into 0 to 16·(size − 1), the pixels' centres: the half pixel beyond the last centre repeats the
    # rim.
    turned = (places + 8) % (32 * size)
    turned = np.where(turned >= 16 * size, 32 * size - 1 - turned, turned) - 8
    found: IntArray = np.clip(turned, 0, 16 * (size - 1))
    return found


def _are_charts(charts: object) -> bool:
    return isinstance(charts, tuple) and all(isinstance(chart, Chart) for chart in charts)


def _check_surface(what: str, charts: tuple[Chart, ...], own: AnySurface | None, surface: AnySurface) -> None:
    """Raise unless charts fit `surface`; `own` is the surface that they were made for, if known."""
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
