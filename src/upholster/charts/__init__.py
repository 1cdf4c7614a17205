"""Charts over a surface: their layout, their sizes, where they meet, and the texture's direction on them.

- `layout`: patches cut into charts; `face_cuts`: the cuts; `chart_seams`: where charts meet
- `surface_to_cover`: reads a surface or a model; `unwrap`: meshes as islands; `mesh_layout`: a chart for each
- `charted_surface`: every kind of surface as triangles on charts, on which all modules below work;
  `tessellation`: those of patches; `subdivision`: shorter edges
- `directions`: the texture's direction; `creases`: edges over which it does not continue
- `part_directions`, `axis_directions`: directions of a model's parts, and along the axes of CAD faces
- `turns`, `mesh_warp_fields`: from directions to warp fields; `far_vertices`: stray vertices
- `phases`: aligned periods of a sample that repeats; `multigrid`: the solver for directions and phases
- `maps`: surface maps; `size_map`: the factor of the sample's size at each place
"""
