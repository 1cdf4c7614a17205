"""The kernels of method "quilt": they choose, cut and lay blocks, and make placements of them."""
