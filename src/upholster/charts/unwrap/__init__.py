"""Flattening meshes: from a `TriangleMesh` to a `MeshSurface` of islands.

`unwrapping` is the complete process. `clusters` groups triangles into islands, `pieces` finds connected
pieces, `flattening` flattens a piece, `island_joining` rejoins islands that unroll together, and `kept` takes
the islands that a file has.
"""

from upholster.charts.unwrap.unwrapping import UnwrapReport, unwrap

__all__ = ["UnwrapReport", "unwrap"]
