"""The progressive stream, .uph: a textured surface in one file; its prefixes are coarser models.

The shortest of these is the first view. If the surface takes many bytes, it has a base, a coarse mesh.

- `writer`, `reader`: streams as bytes; `chunks`: the container; `order`: the order of parts
- `plan`, `plan_head`: placements and labels; `field_chunks`: warp fields; `layout_chunk`: charts
- `base_chunk`: bases; `base_maker`: making them
- `surface_chunk`: the surface; `seam_code`: its seams; `mesh`: a mesh
- `sample`, `maps`: the sample, and several maps of a material
- `bit_coder`, `byte_reader`: bits and small fields
- `budget`: limits of a stream's demands; `prefix`: limits of reading it; `description`: its contents
- `surface_swap`: the same stream on another surface
"""
