"""Flattening meshes: from a `TriangleMesh` to a `MeshSurface` of islands.

`flat_islands` is the complete process. `clusters` groups triangles into islands, `pieces` finds connected
pieces, `flat_piece` flattens a piece, `island_merge` rejoins islands that unroll together, and `file_islands`
takes the islands that a file has.
"""
