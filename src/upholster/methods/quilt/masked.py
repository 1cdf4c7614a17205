"""A block as it is laid: a rectangle of texels with a mask, laid over what is there.

What shows in the end becomes label maps, see `upholster.methods.quilt.emit`.

A cut mask is stored as its *window*: the cells of the block that a chart can show, row by row. A cell shows
if one of its texels lies at most `feather` texels beyond the chart: feathering moves it that far.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.quilt.chart import Chart
from upholster.quilt.placement import MOST_MATRIX, SYMMETRIES
from upholster.quilt.warp_field import WarpField
from upholster.types import IntArray

__all__ = [
    "LARGEST_BLOCK",
    "LARGEST_WARPED",
    "MASK_CUT",
    "MASK_NONE",
    "MASK_RAMP",
    "MATRIX_UNIT",
    "PLACEMENT",
    "SIDE_LEFT",
    "SIDE_TOP",
    "SYMMETRIES",
    "ChartSizes",
    "chart_sizes",
    "check_placements",
    "mask_sizes",
    "mask_windows",
    "step_matrices",
    "touches",
]

MASK_NONE, MASK_RAMP, MASK_CUT = 0, 1, 2
SIDE_TOP, SIDE_LEFT = 1, 2

MATRIX_UNIT = 64
"""A centre matrix differs from the warp field there by multiples of this, in 1/4096 pixel per texel, if it is
to be told in a stream's grid plan."""

LARGEST_BLOCK = 4096
"""Largest side of a block in texels."""

LARGEST_WARPED = 2048
"""The same on a chart with a warp field: keeps all of its arithmetic within 32 bits."""

PLACEMENT = np.dtype(
    [
        ("chart", np.int32),
        ("row", np.int32),  # centre of the target rectangle, in texels of the chart
        ("column", np.int32),
        ("height", np.int32),  # of the target rectangle, which may reach beyond the chart: clipped
        ("width", np.int32),
        ("source_row", np.int32),  # where the centre falls in the exemplar, in 1/16 pixel
        ("source_column", np.int32),
        ("first_cell", np.int32),  # MASK_CUT: where its window starts in `Quilt.mask_cells`, else -1
        ("matrix", np.int32, 4),  # if `centred`: the centre matrix, row by row, in 1/4096 pixel per texel
        ("symmetry", np.uint8),  # of the square, takes chart steps to exemplar steps: 0…7
        ("centred", np.uint8),  # 1: has a centre matrix of its own, in place of the warp field's there
        ("mask", np.uint8),  # MASK_NONE, MASK_RAMP or MASK_CUT
        ("sides", np.uint8),  # MASK_RAMP: which sides are blended, SIDE_TOP | SIDE_LEFT
        ("ramp", np.uint8),  # MASK_RAMP: width of the ramp in texels
        ("mask_cell", np.uint8),  # MASK_CUT: size of a cell in texels
        ("feather", np.uint8),  # MASK_CUT: smoothing passes
    ],
    align=True,
)

ChartSizes = Sequence[Chart] | NDArray[np.int64]
"""A layout, or its `chart_sizes`, made once by who asks again and again: there may be many charts."""


def chart_sizes(charts: ChartSizes) -> NDArray[np.int64]:
    """Return (height, width) of each chart, (n, 2) int64."""
    if isinstance(charts, np.ndarray):
        return charts
    return np.array([(chart.height, chart.width) for chart in charts], np.int64).reshape(-1, 2)


def mask_windows(placed: NDArray[np.void], charts: ChartSizes) -> NDArray[np.int64]:
    """Return the windows of placements' masks.

    Parameters
    ----------
    placed
        (n,) of `PLACEMENT`; of those without a cut mask the windows mean nothing.
    charts
        The layout.

    Returns
    -------
    ndarray
        (n, 4) int64: first and end row, first and end column of cells; end ≥ first.
    """
    cell = np.maximum(placed["mask_cell"], 1).astype(np.int64)
    reach = placed["feather"].astype(np.int64)
    sizes = chart_sizes(charts)
    out = np.empty((len(placed), 4), np.int64)
    for axis, (at, extent) in enumerate((("row", "height"), ("column", "width"))):
        low = placed[at].astype(np.int64) - placed[extent] // 2
        count = -(-placed[extent].astype(np.int64) // cell)
        # Cell k holds texels low + k·cell to the next one's first, the last one fewer.
        first = np.clip((-reach - low) // cell, 0, count)
        end = np.clip(-((low - sizes[placed["chart"], axis] - reach) // cell), first, count)
        out[:, 2 * axis], out[:, 2 * axis + 1] = first, end
    return out


def mask_sizes(placed: NDArray[np.void], charts: ChartSizes) -> NDArray[np.int64]:
    """Return how many cells the windows of placements' masks have, 0 where there is no cut mask."""
    windows = mask_windows(placed, charts)
    count = (windows[:, 1] - windows[:, 0]) * (windows[:, 3] - windows[:, 2])
    return np.where(placed["mask"] == MASK_CUT, count, 0)


def touches(placed: NDArray[np.void], charts: ChartSizes) -> NDArray[np.bool_]:
    """Return which placements touch their chart."""
    sizes = chart_sizes(charts)[placed["chart"]]
    out = np.ones(len(placed), bool)
    for axis, (at, extent) in enumerate((("row", "height"), ("column", "width"))):
        low = placed[at].astype(np.int64) - placed[extent] // 2
        out &= (low < sizes[:, axis]) & (low + placed[extent] > 0)
    return out


def check_placements(
    placed: NDArray[np.void],
    mask_cells: NDArray[np.uint8],
    charts: ChartSizes,
    fields: Sequence[WarpField | None],
    shape: tuple[int, int],
) -> None:
    """Check that placements can be painted.

    Parameters
    ----------
    placed, mask_cells
        What is painted.
    charts, fields
        The layout, and the warp field of each chart; None only where a chart has no placements.
    shape
        (height, width) of the exemplar in pixels.

    Raises
    ------
    InputError
        If a placement names a chart that is not there, is out of order, too large, has its source outside
        the exemplar, or lacks cells of its mask.
    """
    if placed.dtype != PLACEMENT or placed.ndim != 1:
        raise InputError(f"placements are of {placed.dtype}; allowed: a flat array of PLACEMENT")
    if not len(placed):
        return
    named = placed["chart"]
    if named.min() < 0 or named.max() >= len(charts) or (np.diff(named) < 0).any():
        raise InputError(f"placements name charts out of order or outside 0 to {len(charts) - 1}")
    if placed["symmetry"].max() > 7 or placed["mask"].max() > MASK_CUT or placed["feather"].max() > 16:
        raise InputError("a placement's symmetry, mask or feather is outside 0 to 7, 0 to 2, 0 to 16")
    _check_sizes(placed, fields)
    for name, size in (("row", shape[0]), ("column", shape[1])):
        source = placed[f"source_{name}"]
        outside = (source < 0) | (source >> 4 >= size)
        if outside.any():
            raise InputError(
                f"placement {int(np.argmax(outside))} has its source outside the exemplar's {size} {name}s"
            )
    cut = placed[placed["mask"] == MASK_CUT]
    if len(cut):
        if cut["mask_cell"].min() < 1:
            raise InputError("a cut mask's cell is 0 texels; allowed: 1 to 255")
        if cut["first_cell"].min() < 0 or (cut["first_cell"] + mask_sizes(cut, charts)).max() > len(
            mask_cells
        ):
            raise InputError("a cut mask's cells lie outside the quilt's")
    ramp = placed[placed["mask"] == MASK_RAMP]
    if len(ramp) and ramp["ramp"].min() < 1:
        raise InputError("a ramp is 0 texels wide; allowed: 1 to 255")


def _check_sizes(placed: NDArray[np.void], fields: Sequence[WarpField | None]) -> None:
    largest = np.maximum(placed["height"], placed["width"])
    if min(placed["height"].min(), placed["width"].min()) < 1 or largest.max() > LARGEST_BLOCK:
        raise InputError(f"a placement's size is outside 1 to {LARGEST_BLOCK} texels")
    is_bent = np.zeros(len(fields), bool)
    for n in np.unique(placed["chart"]).tolist():
        field = fields[n]
        is_bent[n] = field is not None and not field.is_identity
    warped = is_bent[placed["chart"]] | (placed["centred"] > 0)
    if (largest[warped] > LARGEST_WARPED).any():
        raise InputError(
            f"a placement on a chart with a warp field is too large; allowed: {LARGEST_WARPED} texels a side"
        )
    if (np.abs(placed["matrix"][placed["centred"] > 0]) > MOST_MATRIX).any():
        raise InputError(f"a centre matrix is outside ±{MOST_MATRIX} in 1/4096 pixel per texel")


def step_matrices(field: WarpField, placed: NDArray[np.void]) -> IntArray:
    """Return blocks' centre matrices, (n, 4) int32 in 1/4096 pixel per step, row by row."""
    found = field.integers_at(placed["row"], placed["column"])
    own = placed["centred"] > 0
    return np.where(own[:, None], placed["matrix"], found) if own.any() else found
