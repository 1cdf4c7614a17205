"""Which way the texture runs over patches, and the warp fields that follow from it.

`direction` has what users ask for; `patches`, how that goes on from patch to patch, and which direction suits
a surface; `fields`, each chart's warp field; `nodes`, how its matrices are fitted where charts are short.
"""

from upholster.charts.directions.direction import NUMBER, Direction, Vectors, called, parse_direction
from upholster.charts.directions.fields import LEAST_SLOPE, direction_fields
from upholster.charts.directions.patches import default_direction

__all__ = [
    "LEAST_SLOPE",
    "NUMBER",
    "Direction",
    "Vectors",
    "called",
    "default_direction",
    "direction_fields",
    "parse_direction",
]
