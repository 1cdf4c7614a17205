"""Filling the gutters of one chart from its neighbours across the edges."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from upholster.geometry import Surface
from upholster.types import PixelArray

__all__ = ["fill_gutters"]


def fill_gutters(
    cell: PixelArray,
    row: int,
    column: int,
    texels: PixelArray,
    surface: Surface,
    patch: int,
    arrays: Mapping[int, PixelArray],
) -> None:
    """Write a chart and its gutters into its cell of the atlas.

    Across a shared edge the gutter continues with the neighbour's texels, nearest ones where the sizes
    differ. At a border and at a degenerate edge the outermost texel is repeated. In a corner the two gutters
    that meet are continued and blended.

    Parameters
    ----------
    cell
        (cell height, cell width, C): written.
    row, column
        Where the chart's first texel lies in the cell.
    texels
        (h, w, C): the chart's own.
    surface, patch
        Which patch the chart covers, of which surface.
    arrays
        Texels of every patch's chart.
    """
    height, width = texels.shape[:2]
    cell[row : row + height, column : column + width] = texels
    depths = (row, cell.shape[1] - column - width, cell.shape[0] - row - height, column)
    bands = [_band(edge, depths[edge], texels, surface, patch, arrays) for edge in range(4)]
    bottom, right = row + height, column + width
    cell[:row, column:right] = bands[0][:, ::-1].swapaxes(0, 1)
    cell[row:bottom, right:] = bands[1]
    cell[bottom:, column:right] = bands[2].swapaxes(0, 1)
    cell[row:bottom, :column] = bands[3][:, ::-1]
    cell[:row, :column] = _corner(bands[0][0], bands[3][0])[::-1, ::-1]
    cell[:row, right:] = _corner(bands[0][-1], bands[1][0])[::-1]
    cell[bottom:, :column] = _corner(bands[2][0], bands[3][-1])[:, ::-1]
    cell[bottom:, right:] = _corner(bands[2][-1], bands[1][-1])


def _band(
    edge: int,
    depth: int,
    texels: PixelArray,
    surface: Surface,
    patch: int,
    arrays: Mapping[int, PixelArray],
) -> PixelArray:
    """Return what lies beyond an edge: (texels along the edge, depth, C), outward."""
    own = _inward(texels, edge)
    count = own.shape[0]
    centres = (np.arange(count) + 0.5) / count
    band = np.repeat(own[:, :1], depth, axis=1)
    for there in surface.neighbours(patch, edge):
        first, last = np.searchsorted(centres, (there.start, there.stop))
        other = _inward(arrays[there.other_patch], there.other_edge)
        slope = (there.other_stop - there.other_start) / (there.stop - there.start)
        # Texels are about square, so the ratio of sizes along the edge holds across it too.
        ratio = abs(slope) * other.shape[0] / count
        if ratio == 1 and last - first == other.shape[0] and depth <= other.shape[1]:
            band[first:last] = other[:, :depth] if slope > 0 else other[::-1, :depth]
            continue
        where = (there.other_start + slope * (centres[first:last] - there.start)) * other.shape[0]
        along = np.clip(where.astype(np.int64), 0, other.shape[0] - 1)
        across = np.minimum(((np.arange(depth) + 0.5) * ratio).astype(np.int64), other.shape[1] - 1)
        band[first:last] = other[along[:, None], across]
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


def _corner(vertical: PixelArray, horizontal: PixelArray) -> PixelArray:
    """Continue two gutters into the corner between them: (rows outward, columns outward, C).

    `vertical` (rows, C) is the column of one gutter that adjoins the corner, `horizontal` (columns, C) the
    row of the other; each prevails near itself.
    """
    rows = np.arange(vertical.shape[0])[:, None] + 0.5
    columns = np.arange(horizontal.shape[0])[None, :] + 0.5
    share: NDArray[np.float64] = (rows / (rows + columns))[:, :, None]
    mixed = share * vertical[:, None] + (1 - share) * horizontal[None, :]
    return (mixed if vertical.dtype.kind == "f" else np.rint(mixed)).astype(vertical.dtype)
