"""A surface cut along the borders of its charts, so that each chart covers a patch of its own."""

from dataclasses import replace

from upholster.geometry import Surface
from upholster.quilt.model import Chart, Texels

__all__ = ["chart_pieces"]


def chart_pieces(surface: Surface, texels: Texels) -> tuple[Surface, Texels]:
    """Cut patches that several charts share, and let every chart cover a whole patch.

    Meshes, gutters and texture coordinates then know nothing but patches, and the vertices on an edge are the
    union of both sides' breaks, as at any T-junction.

    Parameters
    ----------
    surface
        The surface.
    texels
        Its texels; the charts of a patch cover it without overlap.

    Returns
    -------
    surface, texels
        Patch n of the new surface is what chart n covers: the same points, for the Bernstein form is
        subdivided exactly. Both as they are if that is so already.
    """
    charts = texels.charts
    if [_rectangle(chart) for chart in charts] == [(n, 0, 1, 0, 1) for n in range(len(surface.patches))]:
        return surface, texels
    patches = [surface.patches[c.patch].part(c.s0, c.s1, c.t0, c.t1) for c in charts]
    # Parts of an edge are found again, though they differ from it in the last bits.
    tolerance = max(surface.tolerance, 1e-9)
    whole = tuple(replace(c, patch=n, s0=0.0, s1=1.0, t0=0.0, t1=1.0) for n, c in enumerate(charts))
    return Surface(patches, surface.name, tolerance), Texels(whole, texels.arrays)


def _rectangle(chart: Chart) -> tuple[int, float, float, float, float]:
    return chart.patch, chart.s0, chart.s1, chart.t0, chart.t1
