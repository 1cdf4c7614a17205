"""``upholster info`` for a surface of patches: a built-in one, or a file of control nets."""

from collections import Counter
from typing import TYPE_CHECKING

from upholster.apps.cli.console import say
from upholster.base.display import number_of

if TYPE_CHECKING:  # NumPy, which it imports, would slow down --help
    from upholster.geometry.patches.surface import Surface

__all__ = ["is_surface", "show_surface"]

_POINTS = 33
"""Points of a patch, each way, from which a surface's extent is taken."""


def is_surface(text: str) -> bool:
    """Return whether a text names a built-in surface or a file of patches."""
    from upholster.geometry.built_in.catalog import SURFACES, surface_file

    return text.partition(":")[0].strip() in SURFACES or surface_file(text) is not None


def show_surface(text: str) -> None:
    """Print a surface's patches and their degrees, its size and area, and how its edges meet."""
    from upholster.charts.far_vertices import far_vertices
    from upholster.charts.layout import area_of, default_width
    from upholster.geometry.built_in.catalog import surface_from_spec

    surface = surface_from_spec(text)
    degrees = Counter(patch.degree for patch in surface.patches).most_common()
    kinds = ", ".join(f"{count} of degree ({m}, {n})" for (m, n), count in degrees)
    patches = number_of(len(surface.patches), "patch", "patches")
    say(f"{text}: {number_of(len(surface.faces), 'face')}, {patches}: {kinds}")
    area = area_of(surface)
    say(
        f"{_extent(surface)} (x, y, z) in model units; area {area:.4g}; without --sample-size "
        f"the sample is {default_width(surface.size, area):.3g} wide"
    )
    border = len({(each.patch, each.edge) for each in surface.border})
    state = f"open: {number_of(border, 'edge')} at the border" if border else "closed"
    poles = len(surface.degenerate)
    points = f", {number_of(poles, 'edge that is a point', 'edges that are points')}" if poles else ""
    say(f"{state}, {number_of(len(surface.shared), 'shared edge')}{points}")
    near, tolerance = surface.nearly_meeting
    if near:
        say(f"note: {number_of(near, 'edge')} would also meet with a tolerance of {tolerance:g}")
    far = far_vertices(surface)
    if far is not None:
        say(f"note: {far.words}")


def _extent(surface: "Surface") -> str:
    """Return the sides of the surface's box in words; that of its control points may be larger."""
    import numpy as np

    along = np.linspace(0, 1, _POINTS)
    points = [patch.points_grid(along, along).reshape(-1, 3) for patch in surface.patches]
    low = np.min([each.min(axis=0) for each in points], axis=0)
    high = np.max([each.max(axis=0) for each in points], axis=0)
    return " x ".join(f"{side:.4g}" for side in high - low)
