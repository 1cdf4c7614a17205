"""CAD files as models: their triangles become a glTF scene, so that all operations on models apply.

A body is a mesh, with a node for each of its placements. Its faces of one colour, one layer and one name form
a primitive: a part.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upholster.base.display import number_of
from upholster.base.errors import InputError
from upholster.base.files import read_bytes
from upholster.base.types import FloatArray, IntArray
from upholster.geometry.cad.exact_body import ExactBody, exact_body
from upholster.geometry.gltf.gltf import Gltf, Json
from upholster.geometry.model_files.gltf_scene import read_scene
from upholster.geometry.model_files.model_file import ModelPart, named_parts
from upholster.geometry.model_files.raw_model import RawModel
from upholster.geometry.model_files.units import unit_in_metres
from upholster.geometry.occt.process import read_cad
from upholster.geometry.occt.records import BodyRecord, CadRecord, FaceRecord

__all__ = ["CadState", "cad_scene", "cad_state", "read_cad_model"]

_METRES = 0.001
"""CAD files are read in millimetres, glTF is in metres."""

_MOST_NAMES = 100
"""Greatest number of named faces in a body that become parts; with more, names do not make parts."""

_LISTED = 5


def read_cad_model(
    path: Path,
    unit: float | None,
    up: str | None,
    deviation: float | None,
    *,
    unique: bool,
) -> RawModel:
    """Read a CAD file as a model.

    Parameters
    ----------
    path
        The file.
    unit
        Length of its unit in metres, if the file itself states none; by default a millimetre.
    up
        The file's upward axis, "y" or "z"; by default z.
    deviation
        Greatest distance of triangles from the faces, in millimetres; by default a two-thousandth of the
        size.
    unique
        Whether to cover each placement of a shape separately.

    Raises
    ------
    InputError
        If it cannot be read, or states another unit.
    """
    record = read_cad(
        path,
        deviation=deviation,
        unique=unique,
        unit=None if unit is None else 1000.0 * unit,
    )
    bodies = [exact_body(body, record.deviation) for body in record.bodies]
    if not any(len(face) for body in bodies for face in body.triangles):
        raise InputError("none of its faces can be covered; allowed: a model with one")
    raw = cad_scene(record, bodies, up or "z")
    raw.notes = [*_notes(record, bodies), *raw.notes]
    raw.files = [Path(file) for file in record.files]
    return raw


@dataclass(frozen=True, eq=False)
class CadState:
    """The contents of a CAD file, and which of its faces can be covered.

    Attributes
    ----------
    record
        The contents, with few triangles.
    patches
        Number of rational Bézier patches of its faces.
    plain
        Names of the faces that cannot be covered.
    inexact
        Names of faces that are covered, but not exactly as in the file, with the reason.
    """

    record: CadRecord
    patches: int
    plain: list[str]
    inexact: list[str]


def cad_state(path: str, *, unit: str | None = None) -> CadState:
    """Read the contents of a CAD file.

    Parameters
    ----------
    path
        The file.
    unit
        As for `upholster.geometry.model_files.model_reader.read_model`.

    Raises
    ------
    InputError
        As for `read_model`.
    """
    metres = unit_in_metres(unit)
    _ = read_bytes(path)  # checks that it exists and is not a folder
    try:
        record = read_cad(Path(path), unit=None if metres is None else 1000.0 * metres, coarse=True)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    state = CadState(record, 0, [], [])
    patches = 0
    for body in record.bodies:
        exact = exact_body(body, record.deviation)
        for face, own, problem in zip(body.faces, exact.faces, exact.problems, strict=True):
            name = f"{body.name}: {_called(face, body)}"
            patches += 0 if own is None else own.patches
            if face.plain:
                state.plain.append(f"{name} ({face.plain})")
            elif problem:
                state.inexact.append(f"{name} ({problem})")
            elif face.approximated > 0:
                state.inexact.append(f"{name} (within {face.approximated:.2g} mm)")
    return replace(state, patches=patches)


def cad_scene(record: CadRecord, bodies: Sequence[ExactBody], up: str) -> RawModel:
    """Put bodies in a glTF scene and read it like any glTF file, but in millimetres."""
    build = _Builder()
    nodes: list[int] = []
    faces_of: list[tuple[BodyRecord, list[int]]] = []
    axes = []
    for body, exact in zip(record.bodies, bodies, strict=True):
        groups = _groups(body, exact)
        if not groups:
            continue
        primitives = [build.primitive(exact, body, faces) for faces in groups]
        mesh = build.add("meshes", {"name": body.name, "primitives": primitives})
        for place in body.places:
            matrix = np.vstack([place.matrix, [0, 0, 0, 1]])
            matrix[:3, 3] *= _METRES
            node: Json = {"name": place.name, "mesh": mesh}
            if (matrix != np.eye(4)).any():
                node["matrix"] = matrix.T.ravel().tolist()
            nodes.append(build.add("nodes", node))
        faces_of += [(body, faces) for faces in groups]
        axes += [_axes(body, exact, faces, up) for faces in groups]
    root: Json = {"name": "model", "children": nodes}
    if up == "z":
        root["rotation"] = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]
    build.json["scenes"] = [{"nodes": [build.add("nodes", root)]}]
    build.json["scene"] = 0
    raw = read_scene(build.document())
    raw.positions = raw.positions / _METRES
    raw.metres = _METRES
    raw.contents = {}
    raw.parts = _named(raw.parts, faces_of)
    raw.axes = np.concatenate(axes)
    return raw


def _named(parts: Sequence[ModelPart], faces_of: Sequence[tuple[BodyRecord, list[int]]]) -> list[ModelPart]:
    """Return parts named after their faces' names and layers."""
    labels, names = [], []
    for part, (body, faces) in zip(parts, faces_of, strict=True):
        face = body.faces[faces[0]]
        place = body.places[0].name or body.name
        labels.append((f"{place}/{face.name}" if face.name else place, part.material))
        own = (
            *part.names,
            body.name,
            *(place.name for place in body.places),
            face.name,
            face.layer or body.layer,
        )
        names.append(tuple(name for name in dict.fromkeys(own) if name))
    return [
        replace(part, name=name, names=own)
        for part, name, own in zip(parts, named_parts(labels), names, strict=True)
    ]


def _groups(body: BodyRecord, exact: ExactBody) -> list[list[int]]:
    """Return the faces of each part: those with the same name, colour and layer."""
    named = len(Counter(face.name for face in body.faces)) <= _MOST_NAMES
    out: dict[tuple[str, str, str], list[int]] = {}
    for number, face in enumerate(body.faces):
        if len(exact.triangles[number]):
            key = (face.name if named else "", face.colour or body.colour, face.layer or body.layer)
            out.setdefault(key, []).append(number)
    return list(out.values())


def _axes(body: BodyRecord, exact: ExactBody, faces: list[int], up: str) -> FloatArray:
    """Return the axis of some faces for each of their triangles, (T, 2, 3), at the body's first placement."""
    place = body.places[0].matrix
    out = []
    for number in faces:
        face = body.faces[number]
        axis = np.zeros((2, 3))
        if face.axis is not None:
            axis[0] = place[:, :3] @ face.axis[0] + place[:, 3]
            axis[1] = place[:, :3] @ face.axis[1]
        if up == "y":
            axis = np.stack([axis[:, 0], -axis[:, 2], axis[:, 1]], axis=1)
        out.append(np.broadcast_to(axis, (len(exact.triangles[number]), 2, 3)))
    return np.concatenate(out)


class _Builder:
    """A glTF document under construction."""

    def __init__(self) -> None:
        self.json: Json = {"asset": {"version": "2.0", "generator": "upholster"}}
        self._data = bytearray()
        self._materials: dict[str, int] = {}

    def add(self, kind: str, item: Json) -> int:
        """Add an object to one of the lists, and return its number."""
        found: list[Json] = self.json.setdefault(kind, [])
        found.append(item)
        return len(found) - 1

    def primitive(self, exact: ExactBody, body: BodyRecord, faces: list[int]) -> Json:
        """Add the triangles of some faces of a body."""
        positions, normals, triangles = [], [], []
        first = 0
        for number in faces:
            face = body.faces[number]
            positions.append(exact.positions[face.vertices])
            normals.append(exact.normals[number])
            triangles.append(exact.triangles[number] + first)
            first += len(face.vertices)
        one = body.faces[faces[0]]
        entry: Json = {
            "attributes": {
                "POSITION": self._accessor(np.concatenate(positions) * _METRES, "VEC3", bounds=True),
                "NORMAL": self._accessor(np.concatenate(normals), "VEC3"),
            },
            "indices": self._accessor(np.concatenate(triangles).ravel(), "SCALAR"),
            "material": self._material(one.colour or body.colour),
        }
        return entry

    def document(self) -> Gltf:
        """Return the document."""
        self.json["buffers"] = [{"byteLength": len(self._data)}]
        return Gltf(self.json, bytes(self._data), Path())

    def _accessor(self, values: FloatArray | IntArray, kind: str, *, bounds: bool = False) -> int:
        array: NDArray[np.generic] = values.astype("<f4" if kind == "VEC3" else "<u4")
        data = np.ascontiguousarray(array).tobytes()
        view = {"buffer": 0, "byteOffset": len(self._data), "byteLength": len(data)}
        view["target"] = 34962 if kind == "VEC3" else 34963
        self._data += data
        entry: Json = {
            "bufferView": self.add("bufferViews", view),
            "componentType": 5126 if kind == "VEC3" else 5125,
            "count": len(array),
            "type": kind,
        }
        if bounds:
            entry |= {"min": np.min(array, axis=0).tolist(), "max": np.max(array, axis=0).tolist()}
        return self.add("accessors", entry)

    def _material(self, colour: str) -> int:
        """Return a plain material of a colour, grey if there is none."""
        if colour not in self._materials:
            coded = np.array([int(colour[k : k + 2], 16) if colour else 190 for k in (1, 3, 5)]) / 255.0
            linear = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
            look = {"baseColorFactor": [*linear.tolist(), 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7}
            entry: Json = {"pbrMetallicRoughness": look, "doubleSided": True}
            if colour:
                entry["name"] = colour
            self._materials[colour] = self.add("materials", entry)
        return self._materials[colour]


def _notes(record: CadRecord, bodies: Sequence[ExactBody]) -> list[str]:
    """List what the user should know about a CAD file's faces."""
    notes = list(dict.fromkeys(record.notes))
    notes.append(f"triangles are within {record.deviation:.3g} mm of the faces (--deviation sets it)")
    if not record.unit:
        notes.append("the file states no unit: millimetres assumed (--unit)")
    faces = [(body, face) for body in record.bodies for face in body.faces]
    plain = [f"{body.name}: {_called(face, body)}" for body, face in faces if face.plain]
    if plain:
        listed = ", ".join(plain[:_LISTED]) + (" …" if len(plain) > _LISTED else "")
        left = f"{len(plain)} of {number_of(len(faces), 'face')} left plain, without triangles"
        notes.append(f"{left}: {listed}")
    near = [face.approximated for _, face in faces if face.approximated > 0]
    if near:
        notes.append(
            f"{number_of(len(near), 'face is', 'faces are')} not rational: approximated by rational surfaces "
            f"within {max(near):.2g} mm"
        )
    failed = sum(bool(problem) for body in bodies for problem in body.problems) - len(plain)
    if failed > 0:
        notes.append(
            f"{number_of(failed, 'face is', 'faces are')} taken from Open CASCADE's triangles, because "
            "patches do not fit"
        )
    return notes


def _called(face: FaceRecord, body: BodyRecord) -> str:
    return face.name or f"{face.kind} {body.faces.index(face) + 1}"
