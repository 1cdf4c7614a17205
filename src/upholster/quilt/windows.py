"""Painting a window of one chart by itself: what a tile of an atlas shows, and no texel more.

All that painting a chart needs are its own placements: charts can be painted one by one, in any order.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.normals import paint_normals, unit_normals
from upholster.quilt.painting import check_painted, fill_bare, paint_each
from upholster.quilt.plans import PlacementList
from upholster.quilt.pyramid import Pyramid, build_pyramid, most_levels
from upholster.types import PixelArray

__all__ = ["map_pyramid", "paint_window", "touching"]


def map_pyramid(role: str, image: PixelArray) -> Pyramid | None:
    """Return what `paint_window` can be given, if it is called more than once; normals have none."""
    return None if role == "normal" else build_pyramid((image,), most_levels(*image.shape[:2]))


def paint_window(
    quilt: Quilt,
    role: str,
    image: PixelArray,
    window: tuple[slice, slice] | None = None,
    *,
    pyramid: Pyramid | None = None,
    threads: int | None = None,
) -> PixelArray:
    """Paint a window of a quilt that has a single chart.

    Parameters
    ----------
    quilt
        The chart, its warp field and its placements.
    role
        Of the map: normals turn with the texture, and are of length 1, as in `paint_material`.
    image
        The map, (H, W) or (H, W, C), of the height and width that the quilt was made for.
    window
        Rows and columns; None: the whole chart.
    pyramid
        Of the map, see `map_pyramid`; by default it is made.
    threads
        As in `upholster.quilt.paint`.

    Returns
    -------
    ndarray
        (rows, columns, C), of the map's dtype: to the bit those of the whole chart.

    Raises
    ------
    InputError
        For a map of another height, width or dtype.
    """
    image = check_painted(quilt, image)
    chart = quilt.charts[0]
    rows, columns = window or (slice(0, chart.height), slice(0, chart.width))
    part = quilt if window is None else _touching(quilt, rows, columns)
    if len(quilt.placements) and not len(part.placements):
        return np.zeros((rows.stop - rows.start, columns.stop - columns.start, image.shape[2]), image.dtype)
    ends = rows.start, rows.stop
    if role == "normal":
        inside = paint_normals(part, image, rows=ends, threads=threads).arrays[0][rows, columns]
        alone = Chart(0, *inside.shape[:2])
        return unit_normals(Texels((alone,), (inside,)), threads=threads).arrays[0]
    which = np.zeros(len(part.placements), np.int64)
    texels = paint_each(part, (image,), which, rows=ends, pyramid=pyramid, threads=threads)
    fill_bare(part, image, texels)
    return texels.arrays[0][rows, columns]


def touching(placed: NDArray[np.void], rows: slice, columns: slice) -> NDArray[np.bool_]:
    """Return which placements of a chart touch a window of it."""
    top, left = placed["row"] - placed["height"] // 2, placed["column"] - placed["width"] // 2
    found: NDArray[np.bool_] = (top < rows.stop) & (top + placed["height"] > rows.start)
    found &= (left < columns.stop) & (left + placed["width"] > columns.start)
    return found


def _touching(quilt: Quilt, rows: slice, columns: slice) -> Quilt:
    """Return the chart with those placements alone that touch a window."""
    kept = touching(quilt.placements, rows, columns)
    plan = PlacementList(quilt.placements[kept], quilt.mask_cells)
    return Quilt(quilt.charts, quilt.exemplar_shape, plan, quilt.fields)
