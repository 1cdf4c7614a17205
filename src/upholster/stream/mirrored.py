"""What a chart shows before its placements have come: the exemplar at its scale, repeated and mirrored."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.synthesis import Chart
from upholster.synthesis.quilt import MASK_NONE, PLACEMENT

__all__ = ["MAX_TILES", "check_tiles", "mirrored_tiling"]

MAX_TILES = 2**19
"""Repeats of the exemplar over all charts."""

# Turns that mirror nothing, columns, rows, both.
_TURNS = np.array([[0, 5], [7, 2]], np.uint8)


def _tiles(chart: Chart, exemplar_shape: tuple[int, int]) -> tuple[int, int]:
    return -(-chart.height // exemplar_shape[0]), -(-chart.width // exemplar_shape[1])


def mirrored_tiling(index: int, chart: Chart, exemplar_shape: tuple[int, int]) -> NDArray[np.void]:
    """Return placements of the whole exemplar, mirrored at its borders, over chart `index`.

    Parameters
    ----------
    index, chart
        The chart and its number.
    exemplar_shape
        (height, width) in pixels, at most 4096 each.

    Returns
    -------
    ndarray
        Of `PLACEMENT`, in raster order from the chart's top left corner.
    """
    height, width = exemplar_shape
    rows, columns = _tiles(chart, exemplar_shape)
    placed = np.zeros((rows, columns), PLACEMENT)
    placed["chart"], placed["cells"], placed["mask"] = index, -1, MASK_NONE
    placed["height"], placed["width"] = height, width
    i, j = np.arange(rows)[:, None], np.arange(columns)
    placed["row"], placed["column"] = i * height + height // 2, j * width + width // 2
    placed["turn"] = _TURNS[i % 2, j % 2]
    # A mirrored block's centre is the mirrored pixel.
    placed["source_row"] = 16 * np.where(i % 2, height - 1 - height // 2, height // 2)
    placed["source_column"] = 16 * np.where(j % 2, width - 1 - width // 2, width // 2)
    return placed.reshape(-1)


def check_tiles(charts: Sequence[Chart], exemplar_shape: tuple[int, int]) -> None:
    """Check that the charts take at most `MAX_TILES` repeats of an exemplar of at most 4096 each way.

    Raises
    ------
    InputError
        If it does not.
    """
    if not all(1 <= side <= 4096 for side in exemplar_shape):
        raise InputError(
            f"exemplar is {exemplar_shape[1]}×{exemplar_shape[0]}; allowed: 1 to 4096 each way in a stream"
        )
    count = sum(math.prod(_tiles(chart, exemplar_shape)) for chart in charts)
    if count > MAX_TILES:
        raise InputError(f"charts take {count} repeats of the exemplar; allowed: {MAX_TILES} in a stream")
