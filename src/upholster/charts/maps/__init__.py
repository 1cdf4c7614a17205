"""Surface maps: a value from 0 to 1 at each step of a surface, which steers the texture there.

`map_text` parses maps as users write them: an image, a part, faces that point up, hollows. It returns a
`surface_map`. `map_ground` has everything on which a map is evaluated, and iterates over its steps. Each kind
of map is a `map_source`: `shapes` has maps of place and normal, `map_images` those of pictures and vertex
colours, `ray_maps` those of edges and hollows (evaluated at steps of `coarse_values`), `noise` and
`stroke_map` one each. `soft_borders` has maps whose borders are softened.
"""
