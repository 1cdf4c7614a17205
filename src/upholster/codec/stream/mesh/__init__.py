"""A mesh in a stream: `mesh_code` codes its triangles, positions and parameters."""
