"""Writing models and images to files.

- `glb`: glTF from a surface; `pbr`: its material; `gltf_editing`, `gltf_references`: changes to a document
- `retextured`: a copy of a glTF file with other textures; `vertex_splits`: vertices with several coordinates
- `obj`, `ply`: with texture; `bare`: without; `stl`, `three_mf`: for printing; `usdz`: from a GLB
- `pages`: a mesh with the pages of its atlas; `map_files`: a material's maps as images
- `npz`: texels as arrays; `html`: a page that shows a stream
"""

from upholster.export.bare import write_bare_obj, write_bare_ply
from upholster.export.glb import TextureFormat, write_glb
from upholster.export.html import viewer_page, write_html
from upholster.export.map_files import map_companion, write_map
from upholster.export.npz import write_npz
from upholster.export.obj import ObjPart, write_obj, write_tiled_obj
from upholster.export.pages import PagedMesh, page_files, udim_tile
from upholster.export.ply import write_ply
from upholster.export.retextured import Cover, write_retextured_glb
from upholster.export.stl import write_stl
from upholster.export.three_mf import write_3mf
from upholster.export.usdz import check_usd, write_usdz

__all__ = [
    "Cover",
    "ObjPart",
    "PagedMesh",
    "TextureFormat",
    "check_usd",
    "map_companion",
    "page_files",
    "udim_tile",
    "viewer_page",
    "write_3mf",
    "write_bare_obj",
    "write_bare_ply",
    "write_glb",
    "write_html",
    "write_map",
    "write_npz",
    "write_obj",
    "write_ply",
    "write_retextured_glb",
    "write_stl",
    "write_tiled_obj",
    "write_usdz",
]
