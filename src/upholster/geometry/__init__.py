"""Surfaces: rational Bézier patches, faces, adjacency of edges, builders, files; and triangle meshes.

- `patch`: one rational Bézier patch; `bernstein`: its polynomials; `normals`: its normals, poles included
- `face`: a grid of patches; `joining`: patches to faces; `surface`: faces and how their edges meet
- `edges`, `overlaps`, `adjacency`, `face_seams`: which edges of patches meet, and where
- `orientation`: normals outward; `matching_edges`: whether two surfaces are connected in the same way
- `catalog`: built-in surfaces by name; `parameter_checks`: their parameters
- `plane`, `sphere`, `cyclide`, `revolution`, `circle`: the builders
- `surface_files`: control nets from files; `cad`: faces of CAD models
- `triangle_mesh`: meshes, and their islands; `mesh_files`: models; `patch_mesh`: patches as a mesh
- `edge_pairs`, `corner_normals`, `rays`: neighbours, normals and hits of triangles; `mesh_state`: faults
- `components`: which numbered items are connected
"""

from upholster.geometry.adjacency import BorderInterval, SharedEdge
from upholster.geometry.catalog import (
    SURFACES,
    SurfaceKind,
    SurfaceLike,
    SurfaceParameter,
    as_surface,
    surface_file,
    surface_from_spec,
)
from upholster.geometry.corner_normals import corner_normals
from upholster.geometry.cyclide import ring_cyclide, torus
from upholster.geometry.face import Face, grid_face
from upholster.geometry.face_seams import FaceSeam
from upholster.geometry.joining import join_patches
from upholster.geometry.matching_edges import check_same_edges
from upholster.geometry.patch import RationalPatch
from upholster.geometry.plane import plane
from upholster.geometry.revolution import cone, cylinder, ellipsoid, revolve, vase
from upholster.geometry.sphere import sphere
from upholster.geometry.surface import BuiltIn, Surface
from upholster.geometry.surface_files import read_bpt, read_nets, read_surface
from upholster.geometry.triangle_mesh import MeshSurface, TriangleMesh, welded

AnySurface = Surface | MeshSurface
"""Surfaces that charts can be on: faces of patches, or a mesh's islands."""

__all__ = [
    "SURFACES",
    "AnySurface",
    "BorderInterval",
    "BuiltIn",
    "Face",
    "FaceSeam",
    "MeshSurface",
    "RationalPatch",
    "SharedEdge",
    "Surface",
    "SurfaceKind",
    "SurfaceLike",
    "SurfaceParameter",
    "TriangleMesh",
    "as_surface",
    "check_same_edges",
    "cone",
    "corner_normals",
    "cylinder",
    "ellipsoid",
    "grid_face",
    "join_patches",
    "plane",
    "read_bpt",
    "read_nets",
    "read_surface",
    "revolve",
    "ring_cyclide",
    "sphere",
    "surface_file",
    "surface_from_spec",
    "torus",
    "vase",
    "welded",
]
