"""What writing and reading placements share: limits, the fields' order, the shapes of coded masks."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from upholster.quilt import Chart
from upholster.quilt.model import MASK_CUT
from upholster.stream.regular import Regular

__all__ = [
    "BATCH",
    "FIELD_NAMES",
    "FINE",
    "GENERAL",
    "GRID",
    "MAX_CELLS",
    "MAX_PLACEMENTS",
    "REGULAR",
    "beside",
    "cell_counts",
    "general_masks",
    "grown",
    "strip_masks",
]

Array = TypeVar("Array", bound=NDArray[Any])

MAX_PLACEMENTS = 2**19
MAX_CELLS = 2**25

GENERAL, REGULAR, GRID, FINE = 0, 1, 2, 3
"""Kinds of plan; FINE is general with sources in 1/16 pixel."""

BATCH = 4096
"""Symbols coded in one call."""

FIELD_NAMES = (
    *("row", "column", "height", "width", "symmetry", "mask", "sides", "ramp", "cell", "feather"),
    *("source_row", "source_column", "cells"),
)


def strip_masks(plan: Regular) -> Iterator[tuple[int, int, int, int, int]]:
    """Yield runs of a strip plan's masks: (first cell, rows, columns, place in the strip, end).

    The place is 1 for the strip's first mask, 2 for the last, 3 for an only one, 0 for those between.
    """
    area = plan.side**2
    for n, strip in enumerate(plan.strips):
        start, count = int(plan.mask_starts[n]), plan.blocks_along(strip)
        cuts = sorted({0, 1, count - 1, count})
        for low, high in pairwise(cuts):
            place = (low == 0) + 2 * (high == count)
            yield start + low * area, plan.side, plan.side, place, start + high * area


def general_masks(placed: NDArray[np.void], total: int) -> list[tuple[int, int, int, int, int]]:
    """Return runs of a general plan's masks, as `strip_masks` does.

    Masks that follow each other without gaps are coded each in its shape, anything else as one long row.
    """
    cut = placed[placed["mask"] == MASK_CUT]
    cut = cut[np.argsort(cut["cells"], kind="stable")]
    ends = cut["cells"].astype(np.int64) + cell_counts(cut)
    if len(cut) and cut["cells"][0] == 0 and (ends[:-1] == cut["cells"][1:]).all() and ends[-1] == total:
        cell = cut["cell"].astype(np.int64)
        rows, columns = -(-cut["height"] // cell), -(-cut["width"] // cell)
        return [
            (int(first), int(high), int(wide), 0, int(end))
            for first, high, wide, end in zip(cut["cells"], rows, columns, ends, strict=True)
        ]
    return [(0, 1, total, 0, total)] if total else []


def cell_counts(placed: NDArray[np.void]) -> NDArray[np.int64]:
    """Return how many cells the placements' masks have."""
    cell = np.maximum(placed["cell"], 1).astype(np.int64)
    return cast(
        NDArray[np.int64],
        -(-placed["height"].astype(np.int64) // cell) * -(-placed["width"].astype(np.int64) // cell),
    )


def beside(placed: NDArray[np.void], charts: Sequence[Chart]) -> NDArray[np.bool_]:
    """Return which placements do not touch their chart."""
    sizes = np.array([(chart.height, chart.width) for chart in charts], np.int64)[placed["chart"]]
    out = np.zeros(len(placed), bool)
    for axis, (at, extent) in enumerate((("row", "height"), ("column", "width"))):
        low = placed[at].astype(np.int64) - placed[extent] // 2
        out |= (low >= sizes[:, axis]) | (low + placed[extent] <= 0)
    return out


def grown(array: Array, length: int) -> Array:
    """Return an array of at least so many rows, further ones 0."""
    if length <= len(array):
        return array
    grown = np.zeros((max(length, len(array) + len(array) // 2), *array.shape[1:]), array.dtype)
    grown[: len(array)] = array
    return cast(Array, grown)
