"""Small pictures of models on the shelf, without a texture."""

import numpy as np

from upholster.charts.surface_to_cover import as_covered
from upholster.charts.tessellation.mesh import tessellate
from upholster.geometry.meshes.corner_normals import corner_normals
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.image.color import from_linear
from upholster.image.files.write import encode_image
from upholster.model.render.picture import render
from upholster.runtime.stages import file_stage

__all__ = ["model_picture"]

_QUADS = 4000


@file_stage(lambda _, path, *__: [path])
def model_picture(path: str, size: int) -> tuple[bytes, int, int]:
    """Return a PNG of a model or surface, `size` pixels wide, and its width and height.

    Reading the model takes the most time, and a preview of it needs the same result.

    Raises
    ------
    InputError, FormatError
        If it can not be read.
    """
    surface = as_covered(path).surface
    height = 3 * size // 4
    if isinstance(surface, MeshSurface):
        corners = surface.mesh.corners.reshape(-1, 3)
        normals = corner_normals(surface.mesh).reshape(-1, 3)
        places, triangles = np.zeros((len(corners), 2)), np.arange(len(corners)).reshape(-1, 3)
    else:
        mesh = tessellate(surface, quads=_QUADS)
        corners, normals, places = mesh.positions, mesh.normals, mesh.places
        triangles = np.asarray(mesh.all_triangles(), np.int64)
    shown = render(corners, normals, places, triangles, None, size=(size, height))
    return encode_image(from_linear(shown, "uint8"), "png"), size, height
