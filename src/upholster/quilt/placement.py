"""The placement: one block of texture on one chart (SPEC.md, section 8).

Label maps define where a placement shows, see `upholster.quilt.labels`. Places on a chart are in 1/16 step
from its first edge; places in the exemplar are in 1/16 pixel, with the centre of pixel k at 16·k.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.quilt.chart import Chart

__all__ = ["MOST_OFFSET", "PLACEMENT", "SYMMETRIES", "bare_placement", "check_placements"]

PLACEMENT = np.dtype(
    [
        ("chart", np.int32),
        ("row", np.int32),  # of its centre, in 1/16 step
        ("column", np.int32),
        ("source_row", np.int32),  # where the centre reads, in 1/16 pixel
        ("source_column", np.int32),
        ("offset", np.int32, 4),  # centre matrix minus M(c), row by row, in 1/4096 pixel per step
        ("symmetry", np.uint8),  # of the square, takes chart steps to exemplar steps: 0…7
        ("layer", np.uint8),  # whose label map names it: 0, or 1 for the layer over the first one
    ],
    align=True,
)

SYMMETRIES = np.array(
    [
        [1, 0, 0, 1],
        [0, 1, -1, 0],
        [-1, 0, 0, -1],
        [0, -1, 1, 0],
        [0, 1, 1, 0],
        [1, 0, 0, -1],
        [0, -1, -1, 0],
        [-1, 0, 0, 1],
    ],
    dtype=np.int64,
)
"""Steps on a chart to pixel steps in the exemplar, per symmetry: (row per row, row per column, column
per row, column per column). 0 to 3 are rotations by quarters, 4 to 7 the same after a transposition."""

MOST_OFFSET = 2**18
"""Largest entry of an offset, in 1/4096 pixel per step."""


def bare_placement(chart: int, size: tuple[int, int], shape: tuple[int, int]) -> NDArray[np.void]:
    """Return a placement for a chart without any data: the exemplar about its middle, at true scale.

    Parameters
    ----------
    chart
        Its number.
    size
        (height, width) of the chart in steps.
    shape
        (height, width) of the exemplar in pixels.

    Returns
    -------
    ndarray
        (1,) of `PLACEMENT`.
    """
    found = np.zeros(1, PLACEMENT)
    found["chart"], found["row"], found["column"] = chart, 8 * size[0], 8 * size[1]
    found["source_row"], found["source_column"] = 8 * (shape[0] - 1), 8 * (shape[1] - 1)
    return found


def check_placements(placed: NDArray[np.void], charts: Sequence[Chart], shape: tuple[int, int]) -> None:
    """Check that placements can be painted.

    Parameters
    ----------
    placed
        (n,) of `PLACEMENT`.
    charts
        The layout.
    shape
        (height, width) of the exemplar in pixels.

    Raises
    ------
    InputError
        If they are not sorted by chart and layer, a chart has none in its first layer, or a field of one is
        out of range.
    """
    if not isinstance(placed, np.ndarray) or placed.dtype != PLACEMENT or placed.ndim != 1:
        kind = getattr(placed, "dtype", type(placed).__name__)
        raise InputError(f"placements are of {kind}; allowed: a flat array of PLACEMENT")
    order = 2 * placed["chart"].astype(np.int64) + placed["layer"]
    if (np.diff(order) < 0).any() or (len(placed) and placed["layer"].max() > 1):
        raise InputError("placements are not sorted by chart and layer, 0 and 1")
    named = np.unique(placed["chart"][placed["layer"] == 0])
    if not np.array_equal(named, np.arange(len(charts))) or placed["chart"].max(initial=0) >= len(charts):
        raise InputError(f"placements are of {len(named)} charts; allowed: of all {len(charts)}")
    if placed["symmetry"].max() > 7:
        raise InputError(f"a placement has symmetry {placed['symmetry'].max()}; allowed: 0 to 7")
    for name, size in (("row", shape[0]), ("column", shape[1])):
        source = placed[f"source_{name}"]
        outside = (source < 0) | (source >= 16 * size)
        if outside.any():
            raise InputError(
                f"placement {int(np.argmax(outside))} has its source outside the exemplar's {size} {name}s"
            )
    if (np.abs(placed["offset"].astype(np.int64)) > MOST_OFFSET).any():
        raise InputError(f"a matrix's offset is outside ±{MOST_OFFSET} in 1/4096 pixel per step")
