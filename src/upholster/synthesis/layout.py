"""The layout: which charts lie on which patches, and how large they are."""

from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.synthesis.quilt import Chart

__all__ = ["MAX_CHART", "MAX_TEXELS", "uniform_layout"]

MAX_CHART = 16384
MAX_TEXELS = 2**31


def uniform_layout(surface: Surface, *, chart: int = 512) -> tuple[Chart, ...]:
    """Lay one square chart over every patch, all of the same size, as the paper does.

    Parameters
    ----------
    surface
        The surface to cover.
    chart
        Side of each chart in texels, 8 to 16384; at most 2^31 texels in all.

    Raises
    ------
    InputError
        For a size out of range or too many texels; the message says how much memory they would take.
    """
    if not 8 <= chart <= MAX_CHART:
        raise InputError(f"chart is {chart} texels; allowed: 8 to {MAX_CHART}")
    count = len(surface.patches) * chart * chart
    if count > MAX_TEXELS:
        raise InputError(
            f"chart {chart} on {len(surface.patches)} patches makes {count:,} texels, which would take "
            f"{3 * count / 2**30:.1f} GiB as 8-bit RGB; allowed: {MAX_TEXELS:,}"
        )
    return tuple(Chart(index, chart, chart) for index in range(len(surface.patches)))
