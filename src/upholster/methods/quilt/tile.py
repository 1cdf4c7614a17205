"""A tile's blocks: what reaches beyond an edge comes in again at the opposite one; refinement over edges."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._block_kernels import ChartCanvas
from upholster.methods.quilt.refinement import LaidChart, refine_chart
from upholster.methods.quilt.transfer import EVERYWHERE, ChartPlacements
from upholster.quilt.chart import Chart

__all__ = ["refine_tile", "wrapped"]

_AROUND = ((-1, 0), (0, -1), (-1, -1), (1, 0), (0, 1), (1, 1), (-1, 1), (1, -1))
"""Where a block comes in again, in tiles down and right."""


def wrapped(own: ChartPlacements, chart: Chart, *, rim: int = 0) -> ChartPlacements:
    """Return a tile's blocks with all that can be seen of them.

    Parameters
    ----------
    own
        Each block once, beginning on the chart.
    chart
        The only chart, whose opposite edges meet.
    rim
        How many texels beyond its edges are seen, too.

    Returns
    -------
    ChartPlacements
        A block that reaches beyond an edge comes in again at the opposite one, right after, with the same
        origin; so does one that begins or ends within `rim` of an edge, beyond the opposite one.
    """
    placed = own.placements
    parts, order = [placed], [np.arange(float(len(placed)))]
    top, left = _corners(placed)
    for k, (rows, columns) in enumerate(_AROUND, start=1):
        down, right = rows * chart.height, columns * chart.width
        seen = (top + down < chart.height + rim) & (top + down + placed["height"] > -rim)
        seen &= (left + right < chart.width + rim) & (left + right + placed["width"] > -rim)
        again = placed[seen].copy()
        again["row"] += down
        again["column"] += right
        parts.append(again)
        order.append(np.flatnonzero(seen) + 0.1 * k)
    whole = np.concatenate(order)
    sequence = np.argsort(whole, kind="stable")
    return replace(
        own,
        placements=np.concatenate(parts)[sequence],
        origins=own.origins[whole[sequence].astype(np.intp)],
        steps=np.zeros(len(sequence), np.int64),
        bounds=EVERYWHERE,
    )


def refine_tile(chart: LaidChart, own: ChartPlacements, effort: int) -> ChartPlacements:
    """Refine a tile, then once more over its edges, as if it began in its middle.

    Parameters
    ----------
    chart, effort
        As for `refine_chart`.
    own
        Each block once, beginning on the chart.

    Returns
    -------
    ChartPlacements
        Those that can be seen still and the added ones, each once.
    """
    tile = chart.grid.chart
    for middle in ((0, 0), (tile.height // 2, tile.width // 2)):
        back = -middle[0], -middle[1]
        begun = replace(
            chart,
            canvas=_rolled(chart.canvas, back),
            begins=middle,
            origin=int(own.origins.max()) + 1,
        )
        whole = wrapped(_moved(own, tile, back), tile)
        own = _moved(_each_once(refine_chart(begun, whole, effort)), tile, middle)
        chart = replace(chart, canvas=_rolled(begun.canvas, middle))
    return own


def _rolled(canvas: ChartCanvas, by: tuple[int, int]) -> ChartCanvas:
    return ChartCanvas(
        np.roll(canvas.canvas, by, (0, 1)),
        np.roll(canvas.covered, by, (0, 1)),
        np.roll(canvas.symmetries, by, (0, 1)),
    )


def _corners(placed: NDArray[np.void]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    return placed["row"] - placed["height"] // 2, placed["column"] - placed["width"] // 2


def _moved(own: ChartPlacements, tile: Chart, by: tuple[int, int]) -> ChartPlacements:
    # Blocks moved round the tile, each beginning on it.
    placed = own.placements.copy()
    for name, first, size, step in zip(
        ("row", "column"), _corners(placed), (tile.height, tile.width), by, strict=True
    ):
        placed[name] += (first + step) % size - first
    return replace(own, placements=placed)


def _each_once(whole: ChartPlacements) -> ChartPlacements:
    # The first of those with one origin: it begins on the tile, or what begins there is hidden.
    first = np.sort(np.unique(whole.origins, return_index=True)[1])
    return replace(
        whole,
        placements=whole.placements[first],
        origins=whole.origins[first],
        steps=whole.steps[first],
    )
