"""Watertight meshes of quadrilaterals over patches.

`grids` says how many quadrilaterals each chart gets, `junctions` where vertices of two charts meet, `mesh`
puts them together.
"""

from upholster.charts.tessellation.grids import connected
from upholster.charts.tessellation.mesh import (
    MAX_QUADS,
    Mesh,
    face_parameters,
    own_patches,
    tessellate,
    tessellate_by_bends,
)

__all__ = [
    "MAX_QUADS",
    "Mesh",
    "connected",
    "face_parameters",
    "own_patches",
    "tessellate",
    "tessellate_by_bends",
]
