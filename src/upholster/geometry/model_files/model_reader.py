"""Reading a model of any format."""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError, InputError
from upholster.base.files import path_text, read_bytes
from upholster.base.formats import CAD_SUFFIXES, MODEL_SUFFIXES, input_kind
from upholster.base.lengths import parse_length
from upholster.base.types import FloatArray
from upholster.geometry.gltf.gltf import parse_gltf
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.geometry.model_files.cad_model import read_cad_model
from upholster.geometry.model_files.gltf_scene import read_scene
from upholster.geometry.model_files.model_file import ModelFile, chosen_parts, welded_within
from upholster.geometry.model_files.obj import read_obj
from upholster.geometry.model_files.off import read_off
from upholster.geometry.model_files.ply import read_ply
from upholster.geometry.model_files.raw_model import RawModel
from upholster.geometry.model_files.stl import read_stl
from upholster.geometry.model_files.text_numbers import in_utf8
from upholster.geometry.model_files.three_mf import read_3mf
from upholster.geometry.model_files.units import unit_in_metres

__all__ = ["read_model"]

_READERS: dict[str, Callable[[bytes, str], RawModel]] = {
    "OBJ": read_obj,
    "PLY": read_ply,
    "STL": read_stl,
    "OFF": read_off,
    "3MF": read_3mf,
}
"""Readers of bytes and a name, by the names of `upholster.base.formats.INPUTS`."""


def read_model(
    path: str | os.PathLike[str],
    *,
    parts: Sequence[str] | None = None,
    unit: str | None = None,
    up: str | None = None,
    deviation: str | float | None = None,
    unique: bool = False,
) -> ModelFile:
    """Read a model: GLB, glTF, OBJ, PLY, STL, OFF or 3MF; or a CAD model: STEP, IGES, BREP or 3DM.

    Vertices of one object at the same place are merged. Nothing else changes, so degenerate triangles stay.
    Quadrilaterals and polygons become triangles. The mesh has z up: it has (x, -z, y) if y is up in the file,
    as in glTF and, by convention, in OBJ. Reading a CAD model has the stages of progress "faces" and "mesh".

    Parameters
    ----------
    path
        The file.
    parts
        Patterns as for `fnmatch`, case-insensitive: they select parts by their names, or those of their
        object or material. By default all parts.
    unit
        The file's unit, see `upholster.base.lengths.METRES`. By default the format's: metres in glTF,
        the file's in 3MF, none in the others. A note says if it contradicts glTF's.
    up
        The file's upward axis, "y" or "z"; by default the format's convention.
    deviation
        For a CAD model: greatest distance of triangles from its faces, as ``"0.1mm"`` or in millimetres; by
        default a two-thousandth of its size.
    unique
        For a CAD model: whether each placement of a shape is a separate part.

    Raises
    ------
    InputError
        If the file cannot be read or needs a package that is not installed, has no triangles or too many, or
        there is no such part; if `unit` or `up` is unknown.
    FormatError
        If it violates its format.
    """
    name = path_text(path, "model")
    kind = input_kind(name)
    if kind is None or kind.holds == "patches":
        raise InputError(
            f"model {name!r} has suffix {Path(name).suffix!r}; allowed: {', '.join(MODEL_SUFFIXES)}"
        )
    metres = unit_in_metres(unit)
    if up not in (None, "y", "z"):
        raise InputError(f"up is {up!r}; allowed: 'y' or 'z'")
    if kind.holds != "cad" and (deviation is not None or unique):
        raise InputError("deviation and unique are for CAD models; allowed: with " + ", ".join(CAD_SUFFIXES))
    data = read_bytes(name)
    try:
        if not data:
            raise InputError("is empty; allowed: a model")
        with np.errstate(all="ignore"):  # the mesh refuses numbers out of range
            if kind.holds == "cad":
                wanted = _millimetres(deviation)
                raw = read_cad_model(Path(name), metres, up, wanted, unique=unique)
                metres = up = None  # it is in millimetres now, with z up
            elif kind.name == "glTF":
                raw = read_scene(parse_gltf(data, name))
                if metres not in (None, raw.metres):
                    raw.notes.append(
                        f"glTF is in metres by its standard: unit {unit} counts here for lengths such as "
                        "30cm, and for STL and 3MF; the GLB keeps its numbers, which are metres elsewhere"
                    )
            else:
                raw = _READERS[kind.name](in_utf8(data), Path(name).stem)
            chosen = None if parts is None else chosen_parts(raw.parts, parts)
            return _model(name, raw, chosen, raw.metres if metres is None else metres, up or raw.up)
    except (FormatError, InputError) as error:
        raise type(error)(f"{name}: {error}") from None


def _millimetres(deviation: str | float | None) -> float | None:
    if deviation is None:
        return None
    length = parse_length(deviation, 0.001, name="deviation")
    if not 1e-6 <= length <= 1e6:
        raise InputError(f"deviation is {deviation!r}; allowed: above 0, in millimetres or with a unit")
    return length


def _model(
    name: str, raw: RawModel, chosen: Sequence[int] | None, metres: float | None, up: str
) -> ModelFile:
    """Assemble the chosen parts."""
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
        positions=_upright(raw.positions[first], up),
        triangles=triangles,
        part=part,
        parts=tuple(each.name for each in parts),
        uv=uv if uv is not None and np.isfinite(uv).all() else None,
        name=Path(name).stem,
        metres=metres,
    )
    normals = None if raw.normals is None else _unit_normals(_upright(raw.normals[mine], up), mesh)
    gltf_files = (*raw.gltf.inputs, *raw.gltf.images_beside()) if raw.gltf else ()
    return ModelFile(
        path=name,
        mesh=mesh if normals is None else replace(mesh, normals=normals),
        parts=parts,
        up=up,
        notes=tuple(dict.fromkeys(raw.notes)),
        contents=raw.contents,
        inputs=(Path(name), *raw.files, *gltf_files),
        uv=uv,
        left=tuple(part.name for number, part in enumerate(raw.parts) if number not in kept),
        gltf=raw.gltf,
        gltf_parts=tuple(raw.gltf_parts[number] for number in kept) if raw.gltf_parts else (),
        axes=None if raw.axes is None else raw.axes[mine],
        colors=None if raw.colors is None else raw.colors[mine],
    )


def _upright(vectors: FloatArray, up: str) -> FloatArray:
    """Return vectors with z up."""
    if up == "z":
        return vectors
    turned: FloatArray = np.stack([vectors[..., 0], -vectors[..., 2], vectors[..., 1]], axis=-1)
    return turned


def _unit_normals(normals: FloatArray, mesh: TriangleMesh) -> FloatArray:
    """Return normals of length 1; the triangle's own where a normal is missing."""
    largest = np.abs(normals).max(axis=2, keepdims=True)
    scaled = normals / largest  # so that squares stay in range
    unit: FloatArray = scaled / np.linalg.norm(scaled, axis=2, keepdims=True)
    bad = ~np.isfinite(unit).all(axis=2)
    unit[bad] = np.repeat(mesh.flat_normals[:, None], 3, axis=1)[bad]
    return unit
