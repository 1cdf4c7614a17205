"""Surface maps: a value from 0 to 1 at each step of a surface, by which others steer what is laid there.

`text` reads maps as users write them: an image, a part, what faces up, what is hollow. `surface_map` is what
it returns; `map_ground` has what a map is evaluated on, and goes over its steps. A kind of map is a
`map_source`: `shapes` has those of place and normal, `map_images` those of pictures and of vertex colours,
`ray_maps` those of edges and hollows (found at `coarse` steps), `noise` and `painted` one each.
"""

from upholster.charts.maps.map_ground import MapGround
from upholster.charts.maps.softened import softened
from upholster.charts.maps.surface_map import SurfaceMap, region
from upholster.charts.maps.text import parse_map

__all__ = ["MapGround", "SurfaceMap", "parse_map", "region", "softened"]
