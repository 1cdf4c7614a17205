"""Surfaces of patches on charts, with the warp fields of a direction."""

from collections.abc import Sequence

from upholster.charts.charted_surface import ChartedSurface, charted_patches
from upholster.charts.directions.direction import parse_direction
from upholster.charts.directions.field import direction_field
from upholster.charts.directions.patch_directions import default_on_patches, vectors_on_patches
from upholster.charts.mesh_warp_fields import triangle_frames, warp_fields
from upholster.charts.turns import chart_turns
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import WarpField


def laid(
    surface: Surface, charts: Sequence[Chart], text: str | None, scale: float
) -> tuple[ChartedSurface, tuple[WarpField, ...]]:
    """Return a surface on charts, and the warp fields of a direction, by default of the one that suits it."""
    charted = charted_patches(surface, charts)
    asked = default_on_patches(surface, charted) if text is None else text
    wanted = vectors_on_patches(surface, charted, parse_direction(asked, patches=True))
    field = direction_field(charted.mesh, wanted)
    along, down = triangle_frames(charted.mesh, field.corner_vectors)
    turns = chart_turns(charted, along, field.fold)
    return charted, warp_fields(charted, along, down, scale, turns, field.corner_vectors)
