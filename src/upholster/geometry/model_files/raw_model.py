"""The result of each format's reader: corners of triangles, before they are merged."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.geometry.gltf.gltf import Gltf
from upholster.geometry.model_files.model_file import GltfPart, ModelPart

__all__ = ["RawModel", "joined_corners"]


@dataclass(eq=False)
class RawModel:
    """Triangles as in a file.

    Attributes
    ----------
    positions
        (V, 3) float64, in the file's axes and unit.
    triangles
        (T, 3) int: vertices of each; triangles of a part are consecutive.
    part
        (T,) int32: the index in `parts` of each triangle's part.
    parts
        All parts of the file.
    same
        (V, 3) by which vertices are merged, if not by `positions`: those without the pose of a skin.
    owner
        (V,) int32: the object of each vertex; vertices of two objects are not merged. By default one object.
    uv
        (T, 3, 2), v downward; None without.
    normals
        (T, 3, 3); None without. They need not be of length 1.
    colors
        As in `ModelFile`.
    metres
        Length of a unit; None if the file does not state it.
    up
        The upward axis, by the format's convention.
    notes, contents, gltf, gltf_parts, axes
        As in `ModelFile`.
    files
        Other files that it was read from, apart from those of `gltf`.
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
    files: list[Path] = field(default_factory=list)


def joined_corners(
    arrays: Sequence[NDArray[Any] | None], counts: list[int], width: int, kind: type = np.float64
) -> NDArray[Any] | None:
    """Concatenate arrays of corners; None if no part has any, NaN for parts without."""
    if all(array is None for array in arrays):
        return None
    return np.concatenate(
        [
            np.full((count, 3, width), np.nan, kind) if array is None else array
            for array, count in zip(arrays, counts, strict=True)
        ]
    )
