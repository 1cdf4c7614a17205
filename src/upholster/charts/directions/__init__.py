"""The texture's direction: smooth fields of unit directions that follow what the user asks for.

`direction`, `direction_image` and `strokes` read what users ask for. `patch_directions` converts u and v, and
`coordinate_directions` images, to vectors on triangles, which `detail` makes small enough.
`level_directions` evaluates a direction on the smooth surface that the triangles approximate,
`direction_request` on each triangle. `frames` has the triangles' planes and carries directions from one to
the next. `field_solution` finds the smoothest field, `singularities` the points where it has no direction,
and `field` combines them all. `flats` finds flat faces with sharp borders, and `flat_directions` gives each
of them one direction.
"""
