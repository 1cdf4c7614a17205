"""Fields of unit directions over a whole triangle mesh: smooth, and along what is asked for.

`direction` and `strokes` read what users ask for; `asked` says what that is on the smooth surface that the
triangles stand for, `wishes` what it is on each of them. `frames` has
the triangles' planes and how directions are carried from one to the next, `solving` finds the smoothest
field, `singular` where it has no direction; `field` puts them together.
"""

from upholster.charts.mesh_directions.asked import asked_at_corners
from upholster.charts.mesh_directions.direction import MeshDirection, TriangleVectors, parse_mesh_direction
from upholster.charts.mesh_directions.field import MeshField, default_mesh_direction, mesh_directions
from upholster.charts.mesh_directions.strokes import asked_by_strokes, parse_strokes

__all__ = [
    "MeshDirection",
    "MeshField",
    "TriangleVectors",
    "asked_at_corners",
    "asked_by_strokes",
    "default_mesh_direction",
    "mesh_directions",
    "parse_mesh_direction",
    "parse_strokes",
]
