"""Meshes laid out flat: from a `TriangleMesh` to a `MeshSurface` of islands.

`unwrapping` is the whole flow; `atlas` asks xatlas for charts and their texture coordinates.
"""

from upholster.charts.unwrap.unwrapping import UnwrapReport, unwrap

__all__ = ["UnwrapReport", "unwrap"]
