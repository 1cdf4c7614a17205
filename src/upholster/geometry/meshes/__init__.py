"""Triangle meshes.

- `triangle_mesh`: meshes, and their islands; `patch_mesh`: patches as a mesh; `simplification`: coarse ones
- `edge_pairs`, `corner_normals`, `rays`: neighbours, normals and hits of triangles; `mesh_state`: faults
"""
