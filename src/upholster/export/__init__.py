"""Writing models and images to files."""

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
