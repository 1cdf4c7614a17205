"""Checks of a stream's demands against a caller's limits (SPEC.md, section 9)."""

from collections.abc import Sequence

from upholster.base.errors import FormatError
from upholster.base.limits import Limits
from upholster.codec.header import ImageHeader
from upholster.codec.stream.plan_head import PlanHead
from upholster.quilt.chart import Chart

__all__ = ["check_cell_budget", "check_chart_budget", "check_sample_budget"]

_LEAST_CELLS = 2**16
"""Cells that label maps may have whatever the limit of texels: small charts have more cells than texels."""


def check_chart_budget(charts: Sequence[Chart], limits: Limits) -> None:
    """Raise FormatError for more charts or texels than the limits."""
    limits.check("layout has", "texels", sum(chart.height * chart.width for chart in charts))
    limits.check("layout has", "charts", len(charts))


def check_sample_budget(headers: Sequence[ImageHeader], limits: Limits) -> None:
    """Raise FormatError for more samples, over all maps, than the limits."""
    samples = sum(header.height * header.width * header.channels for header in headers)
    limits.check("maps have", "samples", samples)


def check_cell_budget(head: PlanHead, limits: Limits) -> None:
    """Raise FormatError for more cells of label maps than texels are allowed: each takes as long as one."""
    most = max(_LEAST_CELLS, limits.texels)
    if head.size > most:
        raise FormatError(
            f"label maps have {head.size} cells; allowed here: {most}; --limit {head.size} allows it"
        )
