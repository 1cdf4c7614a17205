"""Charts of any size, one a patch, whatever faces a surface has."""

from collections.abc import Sequence
from dataclasses import replace

from upholster.charts.layout import uniform_layout
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart


def patch_charts(surface: Surface, sizes: Sequence[tuple[int, int]]) -> tuple[Chart, ...]:
    """Return a chart of so many texels, height and width, for each patch."""
    whole = uniform_layout(surface, chart=8)
    return tuple(
        replace(chart, height=height, width=width)
        for chart, (height, width) in zip(whole, sizes, strict=True)
    )
