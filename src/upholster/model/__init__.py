"""The textured model: mesh, tangents, atlas and texture coordinates; and the displaced mesh.

- `atlas`: all charts in one image; `packing`, `islands`: their places in it; `gutter`: their gutters
- `island_cuts`: islands in pieces, if they are larger than a page
- `normal_atlas`: the atlas of a normal map; `tangents`: the frame of its vectors
- `mesh_on_charts`: a mesh with places on its charts
- `displaced`: the displaced mesh; `heights`: its heights; `folds`: finding and undoing its folds
- `solid`: whether triangles can be printed
"""

from upholster.charts.tessellation import Mesh, face_parameters, tessellate
from upholster.model.atlas import Atlas, build_atlas, build_page, by_chart, page_windows
from upholster.model.displaced import DisplacedMesh, displaced, kept_box, plain_solid
from upholster.model.islands import pack_atlas
from upholster.model.mesh_on_charts import charted_tangents, mesh_on_charts
from upholster.model.normal_atlas import build_normal_atlas, turn_gutters
from upholster.model.packing import AtlasCell, AtlasLayout, AtlasPage, pack_charts
from upholster.model.solid import Solid, check_solid, shown_length, solid_lines
from upholster.model.tangents import vertex_tangents

__all__ = [
    "Atlas",
    "AtlasCell",
    "AtlasLayout",
    "AtlasPage",
    "DisplacedMesh",
    "Mesh",
    "Solid",
    "build_atlas",
    "build_normal_atlas",
    "build_page",
    "by_chart",
    "charted_tangents",
    "check_solid",
    "displaced",
    "face_parameters",
    "kept_box",
    "mesh_on_charts",
    "pack_atlas",
    "pack_charts",
    "page_windows",
    "plain_solid",
    "shown_length",
    "solid_lines",
    "tessellate",
    "turn_gutters",
    "vertex_tangents",
]
