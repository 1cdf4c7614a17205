"""Fields of unit directions over a whole triangle mesh: smooth, and along what is asked for.

`wishes` says what is asked for on each triangle, `frames` has the triangles' planes and how directions are
carried from one to the next, `solving` finds the smoothest field, `field` puts them together.
"""

from upholster.charts.mesh_directions.field import MeshField, mesh_directions
from upholster.charts.mesh_directions.wishes import MeshDirection, parse_mesh_direction

__all__ = ["MeshDirection", "MeshField", "mesh_directions", "parse_mesh_direction"]
