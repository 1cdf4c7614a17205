"""Reading a model, whatever its format."""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upholster.errors import FormatError, InputError, nearest
from upholster.files import path_text, read_bytes
from upholster.geometry.mesh_files.gltf import parse_gltf
from upholster.geometry.mesh_files.gltf_scene import read_scene
from upholster.geometry.mesh_files.model_file import ModelFile, chosen_parts, welded_within
from upholster.geometry.mesh_files.obj import read_obj
from upholster.geometry.mesh_files.off import read_off
from upholster.geometry.mesh_files.ply import read_ply
from upholster.geometry.mesh_files.raw_model import RawModel
from upholster.geometry.mesh_files.stl import read_stl
from upholster.geometry.triangle_mesh import TriangleMesh
from upholster.types import FloatArray

__all__ = ["MODEL_SUFFIXES", "UNITS", "read_model"]

_READERS: dict[str, Callable[[bytes, str], RawModel]] = {
    ".obj": read_obj,
    ".ply": read_ply,
    ".stl": read_stl,
    ".off": read_off,
}
MODEL_SUFFIXES = (".glb", ".gltf", *_READERS)
"""What `read_model` reads."""

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "km": 1000.0, "in": 0.0254, "ft": 0.3048}
"""Units by name, in metres."""


def read_model(
    path: str | os.PathLike[str],
    *,
    parts: Sequence[str] | None = None,
    unit: str | None = None,
    up: str | None = None,
) -> ModelFile:
    """Read a model: GLB, glTF, OBJ, PLY, STL or OFF.

    Vertices at one place of one object become one; nothing else is changed, so triangles without area stay.
    Quadrilaterals and polygons become triangles. The mesh has z up: (x, -z, y) where y is up in the file, as
    in glTF and, by habit, in OBJ.

    Parameters
    ----------
    path
        The file.
    parts
        Patterns as of `fnmatch`, in any case: parts are chosen by their names, or those of their object or
        material. By default all.
    unit
        What the file's unit is: "m", "dm", "cm", "mm", "km", "in", "ft". By default what the format says:
        metres in glTF, nothing in the others.
    up
        Which axis is up in the file, "y" or "z"; by default the format's habit.

    Raises
    ------
    InputError
        If the file cannot be read or needs what is not installed, has no triangles or too many, or there is
        no such part; if `unit` or `up` is unknown.
    FormatError
        If it breaks its format.
    """
    name = path_text(path, "model")
    suffix = Path(name).suffix.lower()
    if suffix not in MODEL_SUFFIXES:
        raise InputError(
            f"model {name!r} has suffix {Path(name).suffix!r}; allowed: {', '.join(MODEL_SUFFIXES)}"
        )
    if unit is not None and unit not in UNITS:
        raise InputError(f"unit {unit!r} is unknown; {nearest(str(unit), UNITS)}")
    if up not in (None, "y", "z"):
        raise InputError(f"up is {up!r}; allowed: 'y' or 'z'")
    data = read_bytes(name)
    try:
        if not data:
            raise InputError("is empty; allowed: a model")
        with np.errstate(all="ignore"):  # numbers beyond all bounds are refused by the mesh
            if suffix in (".glb", ".gltf"):
                raw = read_scene(parse_gltf(data, name))
            else:
                raw = _READERS[suffix](data, Path(name).stem)
            chosen = None if parts is None else chosen_parts(raw.parts, parts)
            return _model(name, raw, chosen, raw.metres if unit is None else UNITS[unit], up or raw.up)
    except (FormatError, InputError) as error:
        raise type(error)(f"{name}: {error}") from None


def _model(
    name: str, raw: RawModel, chosen: Sequence[int] | None, metres: float | None, up: str
) -> ModelFile:
    """Put the chosen parts together."""
    owner = raw.owner if len(raw.owner) else np.zeros(len(raw.positions), np.int32)
    first, vertex = welded_within(raw.positions if raw.same is None else raw.same, owner)
    triangles = vertex[raw.triangles]
    part, kept = raw.part, np.arange(len(raw.parts))
    mine: slice | NDArray[np.intp] = slice(None)
    if chosen is not None:
        kept = np.array(chosen)
        mine = np.flatnonzero(np.isin(part, kept))
        triangles, part = triangles[mine], np.searchsorted(kept, part[mine]).astype(np.int32)
        used, inverse = np.unique(triangles, return_inverse=True)
        first, triangles = first[used], inverse.reshape(-1, 3).astype(np.int32)
    uv = None if raw.uv is None else raw.uv[mine]
    parts = tuple(raw.parts[number] for number in kept)
    mesh = TriangleMesh(
        _upright(raw.positions[first], up),
        triangles,
        part,
        tuple(each.name for each in parts),
        uv if uv is not None and np.isfinite(uv).all() else None,
        None,
        Path(name).stem,
        metres,
    )
    normals = None if raw.normals is None else _unit_normals(_upright(raw.normals[mine], up), mesh)
    return ModelFile(
        name,
        mesh if normals is None else replace(mesh, normals=normals),
        parts,
        up,
        tuple(dict.fromkeys(raw.notes)),
        raw.contents,
        (Path(name), *((*raw.gltf.inputs, *raw.gltf.images_beside()) if raw.gltf else ())),
        uv,
        tuple(part.name for number, part in enumerate(raw.parts) if number not in kept),
        raw.gltf,
        tuple(raw.gltf_parts[number] for number in kept) if raw.gltf_parts else (),
    )


def _upright(vectors: FloatArray, up: str) -> FloatArray:
    """Return vectors with z up."""
    if up == "z":
        return vectors
    turned: FloatArray = np.stack([vectors[..., 0], -vectors[..., 2], vectors[..., 1]], axis=-1)
    return turned


def _unit_normals(normals: FloatArray, mesh: TriangleMesh) -> FloatArray:
    """Return normals of length 1; where there is none, the triangle's own."""
    largest = np.abs(normals).max(axis=2, keepdims=True)
    scaled = normals / largest  # so that squares stay in range
    unit: FloatArray = scaled / np.linalg.norm(scaled, axis=2, keepdims=True)
    bad = ~np.isfinite(unit).all(axis=2)
    unit[bad] = np.repeat(mesh.flat_normals[:, None], 3, axis=1)[bad]
    return unit
