"""Filling the gutters of one chart from its neighbours across the edges."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, PixelArray
from upholster.charts.chart_seams import ChartSeam
from upholster.quilt.chart import Chart

__all__ = ["beyond", "fill_gutters", "mixed_corner", "shown_beyond"]


def fill_gutters(
    cell: PixelArray,
    row: int,
    column: int,
    chart: int,
    seams: Sequence[ChartSeam],
    arrays: Sequence[PixelArray] | Mapping[int, PixelArray],
) -> None:
    """Write a chart and its gutters into its cell of the atlas.

    Across a seam the gutter continues with the neighbour's texels, nearest ones where the sizes differ. At a
    border and at a degenerate edge the outermost texel is repeated. In a corner the two adjacent gutters are
    continued and blended.

    Parameters
    ----------
    cell
        (cell height, cell width, C): receives the result.
    row, column
        The place of the chart's first texel in the cell.
    chart
        The chart's number.
    seams
        The chart's own seams.
    arrays
        Texels of all charts, or a mapping by number with those that are shown, see `shown_beyond`.
    """
    texels = arrays[chart]
    height, width = texels.shape[:2]
    cell[row : row + height, column : column + width] = texels
    depths = (row, cell.shape[1] - column - width, cell.shape[0] - row - height, column)
    bands = [
        _band(edge, depths[edge], texels, [m for m in seams if m.edge == edge], arrays) for edge in range(4)
    ]
    bottom, right = row + height, column + width
    cell[:row, column:right] = bands[0][:, ::-1].swapaxes(0, 1)
    cell[row:bottom, right:] = bands[1]
    cell[bottom:, column:right] = bands[2].swapaxes(0, 1)
    cell[row:bottom, :column] = bands[3][:, ::-1]
    cell[:row, :column] = mixed_corner(bands[0][0], bands[3][0])[::-1, ::-1]
    cell[:row, right:] = mixed_corner(bands[0][-1], bands[1][0])[::-1]
    cell[bottom:, :column] = mixed_corner(bands[2][0], bands[3][-1])[:, ::-1]
    cell[bottom:, right:] = mixed_corner(bands[2][-1], bands[1][-1])


def beyond(seam: ChartSeam, count: int) -> tuple[slice, FloatArray]:
    """Return which of `count` texels along an edge a seam contains, and their places along the other edge."""
    first, last = np.searchsorted(np.arange(count) + 0.5, (seam.start, seam.stop)).tolist()
    slope = (seam.other_stop - seam.other_start) / (seam.stop - seam.start)
    return slice(first, last), seam.other_start + slope * (np.arange(first, last) + 0.5 - seam.start)


def shown_beyond(seam: ChartSeam, depth: int, other: Chart) -> tuple[slice, slice]:
    """Return the rows and columns of the chart across a seam that a gutter shows, or a few more."""
    tall, wide = (other.height, other.width) if seam.other_edge & 1 else (other.width, other.height)
    low, high = sorted((seam.other_start, seam.other_stop))
    along = slice(max(0, int(low) - 1), min(tall, int(high) + 2))
    across = min(wide, max(depth, int(depth * _ratio(seam)) + 1))
    return (
        (slice(0, across), along),
        (along, slice(wide - across, wide)),
        (slice(wide - across, wide), along),
        (along, slice(0, across)),
    )[seam.other_edge]


def _ratio(seam: ChartSeam) -> float:
    # Texels are about square, so the ratio of sizes along the edge holds across it too.
    return abs(seam.other_stop - seam.other_start) / (seam.stop - seam.start)


def _band(
    edge: int,
    depth: int,
    texels: PixelArray,
    seams: Sequence[ChartSeam],
    arrays: Sequence[PixelArray] | Mapping[int, PixelArray],
) -> PixelArray:
    """Return the texels beyond an edge: (texels along the edge, depth, C), outward."""
    own = _inward(texels, edge)
    count = own.shape[0]
    band = np.repeat(own[:, :1], depth, axis=1)
    for seam in seams:
        mine, where = beyond(seam, count)
        other = _inward(arrays[seam.other_chart], seam.other_edge)
        opposed = seam.other_start > seam.other_stop
        ratio = _ratio(seam)
        if ratio == 1 and mine.stop - mine.start == other.shape[0] and depth <= other.shape[1]:
            band[mine] = other[::-1, :depth] if opposed else other[:, :depth]
            continue
        along = np.clip(where.astype(np.int64), 0, other.shape[0] - 1)
        across = np.minimum(((np.arange(depth) + 0.5) * ratio).astype(np.int64), other.shape[1] - 1)
        band[mine] = other[along[:, None], across]
    return band


def _inward(texels: PixelArray, edge: int) -> PixelArray:
    """Return a view of a chart's texels as (along an edge, away from it, C)."""
    match edge:
        case 0:
            return texels.swapaxes(0, 1)
        case 1:
            return texels[:, ::-1]
        case 2:
            return texels[::-1].swapaxes(0, 1)
        case _:
            return texels


def mixed_corner(vertical: PixelArray, horizontal: PixelArray) -> PixelArray:
    """Continue two gutters into the corner between them: (rows outward, columns outward, C).

    `vertical` (rows, C) is the column of one gutter next to the corner, `horizontal` (columns, C) the row of
    the other; each dominates near itself.
    """
    rows = np.arange(vertical.shape[0])[:, None] + 0.5
    columns = np.arange(horizontal.shape[0])[None, :] + 0.5
    share: NDArray[np.float64] = (rows / (rows + columns))[:, :, None]
    mixed = share * vertical[:, None] + (1 - share) * horizontal[None, :]
    return (mixed if vertical.dtype.kind == "f" else np.rint(mixed)).astype(vertical.dtype)
