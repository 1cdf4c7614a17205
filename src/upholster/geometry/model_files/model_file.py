"""The contents of a model file: triangles, parts with their names, and the places of parts in the file."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upholster.base.display import Shown, on_a_line
from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.geometry.gltf.gltf import Gltf
from upholster.geometry.meshes.triangle_mesh import TriangleMesh, welded

__all__ = ["MAX_PARTS", "GltfPart", "ModelFile", "ModelPart", "chosen_parts", "named_parts", "welded_within"]

MAX_PARTS = 65_536

_NUMBERED = re.compile(r"(.+)#([1-9][0-9]{0,5})")
"""A name, and a number that selects one of the parts with this name, in the file's order."""

_LISTED = 30
"""Number of names that an error lists."""


@dataclass(frozen=True)
class ModelPart:
    """A part of a model: everything with one material on one object.

    Attributes
    ----------
    name
        Its name for users; no other part of the file has it.
    material
        Name of its material; empty if it has none.
    names
        Other names that select it: those of object, group, node and mesh.
    instances
        How often the file shows it. It is covered once, at its first placement.
    features
        Other features: "skin", "4 morph targets", "Draco", "meshopt", "quantised", "vertex colours".
    """

    name: str
    material: str = ""
    names: tuple[str, ...] = ()
    instances: int = 1
    features: tuple[str, ...] = ()

    def fits(self, pattern: str) -> bool:
        """Return whether a pattern, as for `fnmatch`, case-insensitive, selects it: by names or material."""
        wanted = pattern.lower()
        known = (self.name, self.material, *self.names)
        return any(fnmatchcase(name.lower(), wanted) for name in known if name)


@dataclass(frozen=True, eq=False)
class GltfPart:
    """The place of a part in a glTF file.

    Attributes
    ----------
    mesh, primitive
        Its numbers in the file.
    vertices
        (n, 3) int32: the primitive's vertices at the corners of the part's triangles, in their order.
    mirrored
        Whether its triangles have the opposite orientation in the file, because the scene mirrors it.
    """

    mesh: int
    primitive: int
    vertices: IntArray
    mirrored: bool


@dataclass(frozen=True, eq=False)
class ModelFile(Shown):
    """A model that has been read.

    Attributes
    ----------
    path
        Its file.
    mesh
        The triangles of the chosen parts, in the scene, z up, in the file's unit. `TriangleMesh.part` gives
        the index in `parts` of each; triangles of a part are consecutive.
    parts
        The chosen parts.
    up
        The file's upward axis: "y" or "z". If it is y, the mesh has (x, -z, y).
    notes
        What a user should know, one line each.
    contents
        Numbers of items in the file that stay as they are, by kind: animations, skins, cameras …
    inputs
        Every file that belongs to it.
    uv
        As `TriangleMesh.uv`, NaN for parts that have none; None if no part has any. The mesh has them only if
        all parts do.
    left
        Names of the parts that were not chosen.
    gltf, gltf_parts
        For a glTF file: the document, and the place of each part in it. A CAD file's model has them as well,
        with a document made from its faces.
    axes
        For a CAD file: (T, 2, 3), a point and the direction of the axis of each triangle's face, such as a
        cylinder's; zero for faces without an axis.
    colors
        Red, green and blue at each triangle's corners, (T, 3, 3) float32, 0 to 1 as the file stores them; NaN
        for parts that have none, None if no part has any.
    """

    path: str
    mesh: TriangleMesh
    parts: tuple[ModelPart, ...]
    up: str = "z"
    notes: tuple[str, ...] = ()
    contents: dict[str, int] = field(default_factory=dict)
    inputs: tuple[Path, ...] = ()
    uv: FloatArray | None = None
    left: tuple[str, ...] = ()
    gltf: Gltf | None = None
    gltf_parts: tuple[GltfPart, ...] = ()
    axes: FloatArray | None = None
    colors: NDArray[np.float32] | None = None

    def __repr__(self) -> str:
        parts = {"path": self.path, "triangles": len(self.mesh.triangles), "parts": len(self.parts)}
        return on_a_line(self, parts)

    def fitting(self, patterns: Sequence[str]) -> list[int]:
        """Return the numbers of the parts that patterns select, as in `read_model`.

        Raises
        ------
        InputError
            If a pattern selects none; lists the existing parts.
        """
        return chosen_parts(self.parts, patterns)


def chosen_parts(parts: Sequence[ModelPart], patterns: Sequence[str]) -> list[int]:
    """Return the numbers of the parts that at least one pattern selects; ``sink#2`` is the second sink.

    Raises
    ------
    InputError
        If a pattern selects none; lists the existing parts.
    """
    chosen = set()
    for pattern in patterns:
        found = _fitting(parts, pattern)
        if not found and (numbered := _NUMBERED.fullmatch(pattern)):
            same, which = _fitting(parts, numbered[1]), int(numbered[2])
            found = same[which - 1 : which]
            if same and not found:
                raise InputError(
                    f"part is {pattern!r}; allowed: {numbered[1]}#1 to {numbered[1]}#{len(same)}"
                )
        if not found:
            raise InputError(f"no part is called {pattern!r}; allowed: {_listed(parts)}")
        chosen.update(found)
    return sorted(chosen)


def _fitting(parts: Sequence[ModelPart], pattern: str) -> list[int]:
    return [number for number, part in enumerate(parts) if part.fits(pattern)]


def named_parts(labels: Sequence[tuple[str, str]]) -> list[str]:
    """Return a name for each part: its object's, followed by the material's if the object has several.

    Parameters
    ----------
    labels
        Names of object and material; each may be empty.
    """
    materials: dict[str, set[str]] = {}
    for label, material in labels:
        materials.setdefault(label, set()).add(material)
    taken: dict[str, int] = {}
    names = []
    for label, material in labels:
        several = len(materials[label]) > 1 or not label
        name = "/".join(part for part in (label, material if several else "") if part) or "part"
        count = taken[name] = taken.get(name, 0) + 1
        while count > 1 and f"{name} {count}" in taken:
            count += 1
        if count > 1:
            taken[name] = count
            name = f"{name} {count}"
            taken[name] = 1
        names.append(name)
    return names


def welded_within(positions: FloatArray, owner: IntArray) -> tuple[FloatArray, IntArray]:
    """Merge vertices at the same place that belong to the same object.

    Parameters
    ----------
    positions
        (V, 3).
    owner
        (V,): the object of each vertex.

    Returns
    -------
    first
        (W,) int64: an original vertex for each merged one, in the order of their objects.
    vertex
        (V,) int32: the merged vertex of each original one.
    """
    _, place = welded(positions)
    keys = owner.astype(np.int64) * (int(place.max(initial=0)) + 1) + place
    _, first, vertex = np.unique(keys, return_index=True, return_inverse=True)
    return first, vertex.reshape(-1).astype(np.int32)


def _listed(parts: Sequence[ModelPart]) -> str:
    names = list(dict.fromkeys(part.name for part in parts))
    materials = list(dict.fromkeys(part.material for part in parts if part.material))
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    text = ", ".join(names[:_LISTED]) + more
    return f"{text}; by material: {', '.join(materials[:_LISTED])}" if materials else text
