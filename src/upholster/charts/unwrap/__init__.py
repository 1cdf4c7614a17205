"""Meshes laid out flat: from a `TriangleMesh` to a `MeshSurface` of islands.

`unwrapping` is the whole flow: `clusters` tells which triangles lie on one island, `pieces` what hangs
together, `flattening` lays a piece flat, `island_joining` joins again what unrolls together, `kept` takes
the islands that a file has.
"""

from upholster.charts.unwrap.unwrapping import UnwrapReport, unwrap

__all__ = ["UnwrapReport", "unwrap"]
