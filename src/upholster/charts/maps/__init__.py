"""Surface maps: a value from 0 to 1 at each step of a surface, which steers the texture there.

`text` parses maps as users write them: an image, a part, faces that point up, hollows. It returns a
`surface_map`. `map_ground` has everything on which a map is evaluated, and iterates over its steps. Each kind
of map is a `map_source`: `shapes` has maps of place and normal, `map_images` those of pictures and vertex
colours, `ray_maps` those of edges and hollows (evaluated at `coarse` steps), `noise` and `painted` one each.
`softened` has maps whose borders are softened.
"""

from upholster.charts.maps.map_ground import MapGround
from upholster.charts.maps.softened import softened
from upholster.charts.maps.surface_map import SurfaceMap, region
from upholster.charts.maps.text import parse_map

__all__ = ["MapGround", "SurfaceMap", "parse_map", "region", "softened"]
