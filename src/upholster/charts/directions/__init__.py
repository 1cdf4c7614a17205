"""The texture's direction: smooth fields of unit directions that follow what the user asks for.

`direction`, `direction_image` and `strokes` read what users ask for. `on_patches` converts u and v, and
`on_coordinates` images, to vectors on triangles, which `detail` makes small enough. `asked` evaluates a
direction on the smooth surface that the triangles approximate, `wishes` on each triangle. `frames` has the
triangles' planes and carries directions from one to the next. `field_solving` finds the smoothest field,
`singular` the points where it has no direction, and `field` combines them all. `flats` finds flat faces with
sharp borders, and `held` gives each of them one direction.
"""

from upholster.charts.directions.asked import asked_at_corners
from upholster.charts.directions.detail import in_detail
from upholster.charts.directions.direction import (
    NUMBER,
    Direction,
    TriangleVectors,
    Vectors,
    parse_direction,
)
from upholster.charts.directions.direction_image import is_direction_image
from upholster.charts.directions.field import DirectionField, default_direction, direction_field
from upholster.charts.directions.on_patches import default_on_patches, vectors_on_patches
from upholster.charts.directions.strokes import is_stroke_file, parse_strokes, stroke_texts

__all__ = [
    "NUMBER",
    "Direction",
    "DirectionField",
    "TriangleVectors",
    "Vectors",
    "asked_at_corners",
    "default_direction",
    "default_on_patches",
    "direction_field",
    "in_detail",
    "is_direction_image",
    "is_stroke_file",
    "parse_direction",
    "parse_strokes",
    "stroke_texts",
    "vectors_on_patches",
]
