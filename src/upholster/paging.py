"""Painting pages of an atlas one by one: each from the sample and what is known of the charts on it.

Nothing but a page and the charts on it is in memory; pages can be painted in any order, and are to the bit
those of the whole atlas.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from upholster.charts.chart_seams import ChartSeam, find_seams
from upholster.export import write_map
from upholster.geometry import Surface
from upholster.image import write_image
from upholster.model import AtlasLayout, build_page, by_chart, pack_charts, page_windows, turn_gutters
from upholster.options import WriteOptions
from upholster.quilt import Chart
from upholster.types import PixelArray

__all__ = ["PagedAtlas", "PaintWindow", "write_page"]


class PaintWindow(Protocol):
    """Paints a window, rows and columns in texels, of a chart by its number; None: all of it."""

    def __call__(self, index: int, window: tuple[slice, slice] | None = None, /) -> PixelArray:
        """Return (rows, columns, C)."""


@dataclass(frozen=True, eq=False, slots=True)
class PagedAtlas:
    """An atlas of which pages are painted by themselves.

    Attributes
    ----------
    surface, charts
        What is covered, and the whole layout on it, in texels.
    layout
        All pages.
    seams
        Each chart's, see `upholster.model.by_chart`.
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
        """Return the charts that a page shows: its own, and those that its gutters show."""
        return {*self.layout.on_page(page), *page_windows(self.layout, page, self.seams)}

    def painted(self, page: int, role: str, paint: PaintWindow) -> PixelArray:
        """Return a page of the map of a role, (height, width, C): gutters and unused area are filled."""
        own = self.layout.on_page(page)
        arrays = {n: paint(n) for n in own}
        first = arrays[next(iter(own))]
        for n, windows in page_windows(self.layout, page, self.seams).items():
            chart = self.charts[n]
            # Memory that is not written to takes none.
            arrays[n] = np.empty((chart.height, chart.width, first.shape[2]), first.dtype)
            for window in windows:
                arrays[n][window] = paint(n, window)
        pixels = build_page(self.layout, page, self.seams, arrays)
        if role == "normal":
            top = self.layout.pages[page].top
            turn_gutters(self.surface, self.charts, self.seams, own, pixels, top)
        return pixels


def write_page(path: str | os.PathLike[str], role: str, pixels: PixelArray, *, quality: int) -> None:
    """Write a page of a map to a file; `InputError` as of `upholster.image.write_image`."""
    if role == "albedo":
        write_image(path, pixels, quality=quality)
    else:
        write_map(path, role, pixels, quality=quality)
