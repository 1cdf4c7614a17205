"""Charts over a mesh's islands, one each."""

from collections.abc import Sequence

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.charts.far_vertices import blamed_on_far
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.quilt.chart import MAX_CHART, Chart
from upholster.runtime.stages import stage

__all__ = [
    "GUTTER",
    "chart_places",
    "mesh_charts",
]

GUTTER = 8
"""Texels by which a chart extends beyond its island each way."""

_SPARE, _EACH = 2**26, 4
"""Charts may have this many texels in all, and so many times those of the surface and of their gutters. Only
thin islands that are bent, such as rings, need more."""


@stage
def mesh_charts(surface: MeshSurface, density: float) -> tuple[Chart, ...]:
    """Lay a chart over each island.

    Parameters
    ----------
    surface
        The islands.
    density
        Texels per model unit.

    Raises
    ------
    InputError
        If a chart would be too large; the message gives the limit.
    """
    charts = []
    for number, box in enumerate(surface.boxes * density):
        low, high = np.floor(box[0]).astype(int) - GUTTER, np.ceil(box[1]).astype(int) + GUTTER
        sides = np.maximum(high - low, 2 * GUTTER + 1).tolist()
        if max(sides) > MAX_CHART:
            raise InputError(
                f"island {number} would have {sides[1]} x {sides[0]} texels; allowed: {MAX_CHART} each way: "
                f"ask for fewer texels{blamed_on_far(surface.mesh)}"
            )
        # Integer texels from one origin on all islands: a stream stores such charts in few bytes.
        (s0, t0), (s1, t1) = (low * (1 / density)).tolist(), ((low + sides) * (1 / density)).tolist()
        charts.append(Chart(number, sides[0], sides[1], s0, s1, t0, t1))
    _check_total(surface, charts, density)
    return tuple(charts)


def _check_total(surface: MeshSurface, charts: Sequence[Chart], density: float) -> None:
    """Refuse charts that have far more texels than their islands."""
    sizes = [chart.height * chart.width for chart in charts]
    shown = density**2 * float(surface.mesh.areas[surface.island >= 0].sum())
    most = _SPARE + _EACH * (shown + (2 * GUTTER + 1) ** 2 * len(sizes))
    if sum(sizes) > most:
        worst = int(np.argmax(sizes))
        raise InputError(
            f"charts of thin islands, such as {charts[worst].width} x {charts[worst].height} for island "
            f"{worst}, would have {sum(sizes):,} texels for {shown:,.0f} of the surface; allowed: "
            f"{most:,.0f}, as with fewer texels{blamed_on_far(surface.mesh)}"
        )


def chart_places(surface: MeshSurface, charts: Sequence[Chart]) -> FloatArray:
    """Return (T, 3, 2), row and column of each triangle's corners on its island's chart, in texels.

    Texel (r, c) has its centre at (r + ½, c + ½). Triangles that are left plain have 0.
    """
    numbers = np.array([(c.s0, c.t0, c.height / (c.s1 - c.s0), c.width / (c.t1 - c.t0)) for c in charts])
    own = numbers[surface.island][:, None]
    places: FloatArray = (surface.parameters - own[..., :2]) * own[..., 2:]
    places[surface.island < 0] = 0.0
    return places
