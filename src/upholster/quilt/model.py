"""The result of a synthesis: charts, ordered placements, and the texels that painting them gives.

A *quilt* says where each block of texture comes from; it holds no colour. `upholster.quilt.painting`
turns a quilt and an exemplar into *texels*. Words and the exact meaning of a placement: CONVENTIONS.md.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.quilt._paint_kernels import SYMMETRIES, trace_owners
from upholster.quilt.warp import LARGEST_WARPED, warped_sources
from upholster.quilt.warp_field import WarpField
from upholster.shown import Shown
from upholster.types import IntArray, PixelArray, frozen_array

__all__ = [
    "MASK_CUT",
    "MASK_NONE",
    "MASK_RAMP",
    "MAX_CHART",
    "MAX_TEXELS",
    "PLACEMENT",
    "SIDE_LEFT",
    "SIDE_TOP",
    "Chart",
    "Quilt",
    "Texels",
]

MAX_CHART = 16384
"""Texels of a chart, each way."""

MAX_TEXELS = 2**31
"""Texels of a layout."""

MASK_NONE, MASK_RAMP, MASK_CUT = 0, 1, 2
SIDE_TOP, SIDE_LEFT = 1, 2

PLACEMENT = np.dtype(
    [
        ("chart", np.int32),
        ("row", np.int32),  # centre of the target rectangle, in texels of the chart
        ("column", np.int32),
        ("height", np.int32),  # of the target rectangle, which may reach beyond the chart: clipped
        ("width", np.int32),
        ("source_row", np.int32),  # where the centre falls in the exemplar, in 1/16 pixel
        ("source_column", np.int32),
        ("cells", np.int32),  # MASK_CUT: where its cells start in `Quilt.cells`, else -1
        ("symmetry", np.uint8),  # symmetry of the square that takes chart steps to exemplar steps, 0…7
        ("mask", np.uint8),  # MASK_NONE, MASK_RAMP or MASK_CUT
        ("sides", np.uint8),  # MASK_RAMP: which sides are blended, SIDE_TOP | SIDE_LEFT
        ("ramp", np.uint8),  # MASK_RAMP: width of the ramp in texels
        ("cell", np.uint8),  # MASK_CUT: size of a cell in texels
        ("feather", np.uint8),  # MASK_CUT: smoothing passes
    ],
    align=True,
)


@dataclass(frozen=True, slots=True)
class Chart:
    """The texel grid laid over a rectangle of one face's parameters, across its patches.

    Attributes
    ----------
    face
        Index of the face in its surface.
    height, width
        Size in texels: rows go with s, columns with t.
    s0, s1, t0, t1
        The rectangle of parameters that the chart covers; texel (r, c) lies at
        ``s0 + (s1 - s0)·(r + ½)/height``, ``t0 + (t1 - t0)·(c + ½)/width``.
    """

    face: int
    height: int
    width: int
    s0: float = 0.0
    s1: float = 1.0
    t0: float = 0.0
    t1: float = 1.0


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
    """Charts and ordered placements: the whole result of a synthesis.

    Attributes
    ----------
    charts
        The layout.
    exemplar_shape
        (height, width) in pixels of the exemplar that it was made from; any image of this shape can be
        painted.
    placements
        Structured array of `PLACEMENT`, read-only: chart after chart, in painting order on each.
    cells
        uint8, read-only: the cut masks' cells, 1 = new, row by row, one mask after another.
    fields
        Each chart's warp field, None where texel steps are exemplar-pixel steps; empty: none has one.

    Raises
    ------
    InputError
        If a placement names a chart that is not there or reads outside the exemplar (on a chart with a field:
        has its source there), if charts are out of order, if fields are not one for each chart, or if a cut
        mask lacks cells.
    """

    charts: tuple[Chart, ...]
    exemplar_shape: tuple[int, int]
    placements: NDArray[np.void]
    cells: NDArray[np.uint8]
    fields: tuple[WarpField | None, ...] = ()

    def __post_init__(self) -> None:
        frozen_array(self.placements)
        frozen_array(self.cells)
        _check(self)

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
        scratch = np.empty((2, *self.largest_block), np.int32)
        found = []
        for index, chart in enumerate(self.charts):
            placements = self.on_chart(index)
            owners = np.empty((chart.height, chart.width), np.int32)
            trace_owners(placements, self.cells, scratch, owners)
            found.append(_sources(self, index, owners))
        return tuple(found)


def _sources(quilt: Quilt, index: int, owners: IntArray) -> IntArray:
    out = np.full((*owners.shape, 2), -1, np.int32)
    painted = owners >= 0
    owner = quilt.on_chart(index)[owners[painted]]
    rows, columns = np.nonzero(painted)
    field = quilt.fields[index] if quilt.fields else None
    if field is not None:
        height, width = quilt.exemplar_shape
        source_rows, source_columns = warped_sources(field, owner, rows, columns)
        out[painted, 0] = np.clip(source_rows, 0, 16 * (height - 1))
        out[painted, 1] = np.clip(source_columns, 0, 16 * (width - 1))
        return out
    down, right = rows - owner["row"], columns - owner["column"]
    symmetry = SYMMETRIES[owner["symmetry"]]
    out[painted, 0] = owner["source_row"] + 16 * (symmetry[:, 0] * down + symmetry[:, 1] * right)
    out[painted, 1] = owner["source_column"] + 16 * (symmetry[:, 2] * down + symmetry[:, 3] * right)
    return out


def _check(quilt: Quilt) -> None:
    placed = quilt.placements
    if quilt.fields and len(quilt.fields) != len(quilt.charts):
        raise InputError(f"quilt has {len(quilt.fields)} fields; allowed: none, or one for each chart")
    if placed.dtype != PLACEMENT or placed.ndim != 1:
        raise InputError(f"placements are of {placed.dtype}; allowed: a flat array of PLACEMENT")
    if not len(placed):
        return
    charts = placed["chart"]
    if charts.min() < 0 or charts.max() >= len(quilt.charts) or (np.diff(charts) < 0).any():
        raise InputError(f"placements name charts out of order or outside 0 to {len(quilt.charts) - 1}")
    if placed["symmetry"].max() > 7 or placed["mask"].max() > MASK_CUT or placed["feather"].max() > 16:
        raise InputError("a placement's symmetry, mask or feather is outside 0 to 7, 0 to 2, 0 to 16")
    if min(placed["height"].min(), placed["width"].min()) < 1 or max(quilt.largest_block) > 4096:
        raise InputError("a placement's size is outside 1 to 4096 texels")
    warped = np.array([field is not None for field in quilt.fields] or [False] * len(quilt.charts))[charts]
    _check_warped(placed[warped], quilt.exemplar_shape)
    _check_whole(placed, ~warped, quilt.exemplar_shape)
    cut = placed[placed["mask"] == MASK_CUT]
    if len(cut):
        if cut["cell"].min() < 1:
            raise InputError("a cut mask's cell is 0 texels; allowed: 1 to 255")
        cell = cut["cell"].astype(np.int64)
        count = -(-cut["height"] // cell) * -(-cut["width"] // cell)
        if cut["cells"].min() < 0 or (cut["cells"] + count).max() > len(quilt.cells):
            raise InputError("a cut mask's cells lie outside the quilt's")
    ramp = placed[placed["mask"] == MASK_RAMP]
    if len(ramp) and ramp["ramp"].min() < 1:
        raise InputError("a ramp is 0 texels wide; allowed: 1 to 255")


def _check_warped(placed: NDArray[np.void], shape: tuple[int, int]) -> None:
    # Beyond the exemplar painting reads its rim: only the centre must lie inside.
    if len(placed) and max(placed["height"].max(), placed["width"].max()) > LARGEST_WARPED:
        raise InputError(
            f"a placement on a chart with a field is too large; allowed: {LARGEST_WARPED} texels a side"
        )
    for name, size in (("row", shape[0]), ("column", shape[1])):
        source = placed[f"source_{name}"]
        if ((source < 0) | (source >> 4 >= size)).any():
            raise InputError(f"a placement's source lies outside the exemplar's {size} {name}s")


def _check_whole(placed: NDArray[np.void], mine: NDArray[np.bool_], shape: tuple[int, int]) -> None:
    if ((placed["source_row"] | placed["source_column"])[mine] & 15).any():
        raise InputError("a placement's source is not on a whole pixel")
    symmetry, low_row, low_column = (
        SYMMETRIES[placed["symmetry"]],
        -(placed["height"] // 2),
        -(placed["width"] // 2),
    )
    high_row, high_column = low_row + placed["height"] - 1, low_column + placed["width"] - 1
    for axis, name, size in ((0, "row", shape[0]), (2, "column", shape[1])):
        a, b, source = (
            symmetry[:, axis],
            symmetry[:, axis + 1],
            placed[f"source_{name}"].astype(np.int64) >> 4,
        )
        ends = [source + a * i + b * j for i in (low_row, high_row) for j in (low_column, high_column)]
        outside = mine & ((np.minimum.reduce(ends) < 0) | (np.maximum.reduce(ends) >= size))
        if outside.any():
            raise InputError(
                f"placement {int(np.argmax(outside))} reads outside the exemplar's {size} {name}s"
            )
