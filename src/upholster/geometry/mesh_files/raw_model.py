"""What the reader of each format returns: corners of triangles, before they are put together."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from upholster.geometry.mesh_files.gltf import Gltf
from upholster.geometry.mesh_files.model_file import GltfPart, ModelPart
from upholster.types import FloatArray, IntArray

__all__ = ["RawModel"]


@dataclass(eq=False)
class RawModel:
    """Triangles of a file, as they stand there.

    Attributes
    ----------
    positions
        (V, 3) float64, in the file's axes and unit.
    triangles
        (T, 3) int: vertices of each, those of a part together.
    part
        (T,) int32: which of `parts` each belongs to.
    parts
        All that the file has.
    same
        (V, 3) by which vertices count as one, if not by `positions`: those without the pose of a skin.
    owner
        (V,) int32: the object of each vertex; those of two objects stay apart. By default all of one.
    uv
        (T, 3, 2), v downward; None without.
    normals
        (T, 3, 3); None without. They need not be of length 1.
    colors
        As of `ModelFile`.
    metres
        Length of a unit; None where the file does not tell.
    up
        Which axis is up by the format's habit.
    notes, contents, gltf, gltf_parts, axes
        As of `ModelFile`.
    """

    positions: FloatArray
    triangles: IntArray
    part: IntArray
    parts: list[ModelPart]
    same: FloatArray | None = None
    owner: IntArray = field(default_factory=lambda: np.zeros(0, np.int32))
    uv: FloatArray | None = None
    normals: FloatArray | None = None
    metres: float | None = None
    up: str = "z"
    notes: list[str] = field(default_factory=list)
    contents: dict[str, int] = field(default_factory=dict)
    gltf: Gltf | None = None
    gltf_parts: list[GltfPart] = field(default_factory=list)
    axes: FloatArray | None = None
    colors: NDArray[np.float32] | None = None
