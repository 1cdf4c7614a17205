"""Method "quilt" over meshes: blocks on charts of any shape, unfolded from their centres."""
