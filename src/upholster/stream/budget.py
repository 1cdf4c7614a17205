"""Checks of a stream's demands against a caller's limits (SPEC.md, section 9)."""

from collections.abc import Sequence

from upholster.codec import ImageHeader
from upholster.limits import Limits
from upholster.quilt import Chart

__all__ = ["check_chart_budget", "check_sample_budget"]


def check_chart_budget(charts: Sequence[Chart], limits: Limits) -> None:
    """Raise FormatError for more charts or texels than the limits."""
    limits.check("layout has", "texels", sum(chart.height * chart.width for chart in charts))
    limits.check("layout has", "charts", len(charts))


def check_sample_budget(headers: Sequence[ImageHeader], limits: Limits) -> None:
    """Raise FormatError for more samples, over all maps, than the limits."""
    samples = sum(header.height * header.width * header.channels for header in headers)
    limits.check("maps have", "samples", samples)
