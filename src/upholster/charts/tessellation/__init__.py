"""Watertight meshes of quadrilaterals over patches.

`grids` sets the number of quadrilaterals of each chart, `junctions` finds where vertices of two charts meet,
and `mesh` assembles the mesh.
"""

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
    "face_parameters",
    "own_patches",
    "tessellate",
    "tessellate_by_bends",
]
