"""Painting pages of an atlas one by one: each from the sample and the charts on it.

Only one page and the charts on it are in memory. Pages can be painted in any order, and are equal, to the
bit, to those of the complete atlas.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from upholster.base.options.write_options import WriteOptions
from upholster.base.types import PixelArray
from upholster.charts.chart_seams import ChartSeam, find_seams
from upholster.geometry.patches.surface import Surface
from upholster.image.files.write import write_image
from upholster.model.atlas import build_page, by_chart, page_windows
from upholster.model.normal_atlas import turn_gutters
from upholster.model.packing import AtlasLayout, pack_charts
from upholster.output.export.map_files import write_map
from upholster.quilt.chart import Chart

__all__ = ["PagedAtlas", "PaintWindow", "write_page"]


class PaintWindow(Protocol):
    """Paints a window, rows and columns in texels, of a chart by its number; None: all of it."""

    def __call__(self, index: int, window: tuple[slice, slice] | None = None, /) -> PixelArray:
        """Return (rows, columns, C)."""


@dataclass(frozen=True, eq=False, slots=True)
class PagedAtlas:
    """An atlas whose pages are painted separately.

    Attributes
    ----------
    surface, charts
        The surface, and the complete layout on it, in texels.
    layout
        All pages.
    seams
        The seams of each chart, see `upholster.model.atlas.by_chart`.
    """

    surface: Surface
    charts: tuple[Chart, ...]
    layout: AtlasLayout
    seams: Mapping[int, Sequence[ChartSeam]]

    @classmethod
    def of(cls, surface: Surface, charts: tuple[Chart, ...], options: WriteOptions) -> "PagedAtlas":
        """Lay charts out as the options say; `InputError` if they do not fit."""
        layout = pack_charts(charts, **options.packing)
        return cls(surface, charts, layout, dict(by_chart(find_seams(surface, charts))))

    def shown_on(self, page: int) -> set[int]:
        """Return the charts that a page shows: its own, and those in its gutters."""
        return {*self.layout.on_page(page), *page_windows(self.layout, page, self.seams)}

    def painted(self, page: int, role: str, paint: PaintWindow) -> PixelArray:
        """Return a page of the map of a role, (height, width, C): gutters and unused area are filled."""
        own = self.layout.on_page(page)
        arrays = {n: paint(n) for n in own}
        first = arrays[next(iter(own))]
        for n, windows in page_windows(self.layout, page, self.seams).items():
            chart = self.charts[n]
            # Memory that is never written takes no space.
            arrays[n] = np.empty((chart.height, chart.width, first.shape[2]), first.dtype)
            for window in windows:
                arrays[n][window] = paint(n, window)
        pixels = build_page(self.layout, page, self.seams, arrays)
        if role == "normal":
            top = self.layout.pages[page].top
            turn_gutters(self.surface, self.charts, self.seams, own, pixels, top)
        return pixels


def write_page(path: str | os.PathLike[str], role: str, pixels: PixelArray, *, quality: int) -> None:
    """Write a page of a map to a file; `InputError` as for `upholster.image.files.write.write_image`."""
    if role == "albedo":
        write_image(path, pixels, quality=quality)
    else:
        write_map(path, role, pixels, quality=quality)
