"""Watertight meshes of quadrilaterals over patches.

`grids` sets the number of quadrilaterals of each chart, `junctions` finds where vertices of two charts meet,
and `mesh` assembles the mesh.
"""
