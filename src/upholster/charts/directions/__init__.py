"""Which way the texture runs: fields of unit directions, smooth, and along what is asked for.

`direction`, `direction_image` and `strokes` read what users ask for; `on_patches` says what u and v are
there, `on_coordinates` what an image asks for, on triangles that `detail` makes small enough, `asked` what a
direction is on the smooth surface that the triangles stand for, `wishes` what it is on each of them. `frames`
has the triangles' planes and how directions are carried from one to the next, `field_solving` finds the
smoothest field, `singular` where it has no direction; `field` puts them together.
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
from upholster.charts.directions.on_patches import default_on_patches, told_on_patches
from upholster.charts.directions.strokes import asked_by_strokes, is_stroke_file, parse_strokes, stroke_texts

__all__ = [
    "NUMBER",
    "Direction",
    "DirectionField",
    "TriangleVectors",
    "Vectors",
    "asked_at_corners",
    "asked_by_strokes",
    "default_direction",
    "default_on_patches",
    "direction_field",
    "in_detail",
    "is_direction_image",
    "is_stroke_file",
    "parse_direction",
    "parse_strokes",
    "stroke_texts",
    "told_on_patches",
]
