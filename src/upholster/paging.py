"""Painting pages of an atlas one by one: each from the sample and the placements of the charts on it.

Nothing but a page and the charts on it is in memory; pages can be painted in any order, and are to the bit
those of the whole atlas.
"""

import os
from collections.abc import Mapping, Sequence

import numpy as np

from upholster.charts.seams import ChartSeam
from upholster.export import write_map
from upholster.geometry import Surface
from upholster.image import write_image
from upholster.model import AtlasLayout, build_page, page_windows, turn_gutters
from upholster.quilt import Chart, Quilt
from upholster.methods.quilt.masked import MASK_CUT
from upholster.methods.quilt.old_plans import PlacementList
from upholster.quilt.pyramid import Pyramid
map_pyramid = paint_window = touching = None  # replaced by the owner of this file
from upholster.types import PixelArray

__all__ = ["chart_quilt", "paint_page", "shown_charts", "write_page"]


def shown_charts(layout: AtlasLayout, page: int, seams: Mapping[int, Sequence[ChartSeam]]) -> set[int]:
    """Return the charts that a page shows: its own, and those that its gutters show."""
    return {*layout.on_page(page), *page_windows(layout, page, seams)}


def paint_page(
    surface: Surface,
    charts: Sequence[Chart],
    layout: AtlasLayout,
    page: int,
    seams: Mapping[int, Sequence[ChartSeam]],
    quilts: Mapping[int, Quilt],
    role: str,
    image: PixelArray,
    pyramid: Pyramid | None,
) -> PixelArray:
    """Paint a page of the atlas of one map.

    Parameters
    ----------
    surface, charts
        What is covered, and the whole layout on it.
    layout, page
        All pages, and which it is.
    seams
        Each chart's, see `upholster.model.by_chart`.
    quilts
        Of each of the charts that `shown_charts` tells a quilt of that chart alone.
    role, image, pyramid
        The map, and what `upholster.quilt.windows.map_pyramid` makes of it.

    Returns
    -------
    ndarray
        (height, width, C) of the map's dtype, gutters and unused area filled.
    """
    own = layout.on_page(page)
    arrays = {n: paint_window(quilts[n], role, image, pyramid=pyramid, threads=1) for n in own}
    for n, windows in page_windows(layout, page, seams).items():
        # Memory that is not written to takes none.
        arrays[n] = np.empty((charts[n].height, charts[n].width, image.shape[2]), image.dtype)
        for window in windows:
            arrays[n][window] = paint_window(quilts[n], role, image, window, pyramid=pyramid, threads=1)
    pixels = build_page(layout, page, seams, arrays)
    if role == "normal":
        turn_gutters(surface, charts, seams, own, pixels, layout.pages[page].top)
    return pixels


def write_page(path: str | os.PathLike[str], role: str, pixels: PixelArray, *, quality: int) -> None:
    """Write a page of a map to a file; `InputError` as of `upholster.image.write_image`."""
    if role == "albedo":
        write_image(path, pixels, quality=quality)
    else:
        write_map(path, role, pixels, quality=quality)


def chart_quilt(quilt: Quilt, n: int) -> Quilt:
    """Return a quilt of one chart of several alone, which paints the same texels there."""
    placed, cells = quilt.placements, quilt.mask_cells
    own = placed[placed["chart"] == n]
    own["chart"] = 0
    cut = own["mask"] == MASK_CUT
    firsts = own["first_cell"][cut]
    if len(firsts):
        start = firsts.min()
        others = placed["first_cell"][placed["mask"] == MASK_CUT]
        cells = cells[start : min(others[others > firsts.max()], default=len(cells))]
        own["first_cell"][cut] -= start
    plan = PlacementList(own, cells if len(firsts) else cells[:0])
    return Quilt((quilt.charts[n],), quilt.exemplar_shape, plan, (quilt.fields[n],))
