"""The textured model: mesh, tangents, atlas and texture coordinates."""

from upholster.model.atlas import Atlas, AtlasCell, build_atlas
from upholster.model.mesh import Mesh, face_parameters, tessellate
from upholster.model.normal_atlas import build_normal_atlas
from upholster.model.tangents import vertex_tangents

__all__ = [
    "Atlas",
    "AtlasCell",
    "Mesh",
    "build_atlas",
    "build_normal_atlas",
    "face_parameters",
    "tessellate",
    "vertex_tangents",
]
