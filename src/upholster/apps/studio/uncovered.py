"""Parts that no sample covers, as streams: in plain colours, as the file has them."""

from collections.abc import Collection

import numpy as np

from upholster.base.types import FloatArray, PixelArray
from upholster.codec.stream.writer import encode_stream
from upholster.covering.synthesis import synthesize
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.geometry.model_files.model_file import ModelFile
from upholster.output.glb_picture import part_colors

__all__ = ["plain_streams"]

_SIDE = 32
"""Height and width of a sample of one colour, the least that is allowed."""

_TEXELS = 1000


def plain_streams(model: ModelFile, names: Collection[str]) -> list[bytes]:
    """Return a stream for each colour that the parts of these names have in the file.

    A triangle on no island is drawn in the sample's mean colour. A stream needs an island, so the largest
    triangle is one.
    """
    colors = part_colors(model)
    chosen = np.array([part.name in names for part in model.parts])
    streams = []
    for color in np.unique(colors[chosen], axis=0):
        own = (chosen & (colors == color).all(axis=1))[model.mesh.part]
        mesh = TriangleMesh(model.mesh.positions, model.mesh.triangles[own])
        sample: PixelArray = np.broadcast_to(color, (_SIDE, _SIDE, 3)).copy()
        if (surface := _plain(mesh)) is not None:
            streams.append(encode_stream(surface, synthesize(sample, surface, texels=_TEXELS), sample))
    return streams


def _plain(mesh: TriangleMesh) -> MeshSurface | None:
    """Return a mesh with its largest triangle as its only island; None if no triangle has an area."""
    corners = mesh.corners
    sides = corners[:, 1:] - corners[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    largest = int(np.argmax(areas))
    if not areas[largest] > 0:
        return None
    island = np.full(len(areas), -1, np.int32)
    island[largest] = 0
    parameters = np.zeros((len(areas), 3, 2))
    parameters[largest] = _laid_flat(sides[largest])
    return MeshSurface(mesh, island, parameters)


def _laid_flat(sides: FloatArray) -> FloatArray:
    """Return the corners (3, 2) of a triangle in its plane, by its two sides from the first corner."""
    length = float(np.linalg.norm(sides[0]))
    along = float(sides[0] @ sides[1]) / length
    across = float(np.linalg.norm(np.cross(sides[0], sides[1]))) / length
    return np.array([[0.0, 0.0], [length, 0.0], [along, across]])
