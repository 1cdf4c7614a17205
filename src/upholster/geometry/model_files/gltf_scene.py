"""The meshes of a glTF scene as triangles: each once, at its first placement."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.display import number_of
from upholster.base.errors import FormatError, InputError
from upholster.base.types import FloatArray, IntArray
from upholster.geometry.gltf.accessors import MAX_ELEMENTS, Accessor, Accessors, as_floats
from upholster.geometry.gltf.colors import as_colors
from upholster.geometry.gltf.draco import decoded_primitive
from upholster.geometry.gltf.gltf import Gltf, Json
from upholster.geometry.gltf.meshopt import meshopt_of
from upholster.geometry.meshes.triangle_mesh import MAX_TRIANGLES
from upholster.geometry.model_files.gltf_nodes import MeshPlacement, mesh_placements, vertex_matrices
from upholster.geometry.model_files.model_file import MAX_PARTS, GltfPart, ModelPart, named_parts
from upholster.geometry.model_files.raw_model import RawModel, joined_corners

__all__ = ["DRACO", "primitive_arrays", "primitive_triangles", "read_scene"]

DRACO = "KHR_draco_mesh_compression"

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_KEPT = ("animations", "skins", "cameras", "images", "materials")
_SCALES_DIFFER = 1.01


@dataclass(eq=False)
class _Piece:
    """A primitive in the scene."""

    label: str
    material: str
    part: ModelPart
    source: GltfPart
    raw: FloatArray
    positions: FloatArray
    triangles: IntArray
    uv: FloatArray | None
    normals: FloatArray | None
    colors: NDArray[np.float32] | None
    placement: MeshPlacement = field(repr=False)


def read_scene(gltf: Gltf) -> RawModel:
    """Read the triangles of the scene that a glTF file shows.

    A mesh under several nodes is read once, at the first of them. Skins are posed as the nodes are; morph
    targets are not applied. Points and lines are left out.

    Raises
    ------
    FormatError
        If the file violates the format.
    InputError
        If there are no triangles, or too many.
    """
    accessors = Accessors(gltf)
    notes: list[str] = []
    pieces: list[_Piece] = []
    total = elements = 0
    for placement in mesh_placements(gltf, accessors):
        mesh = gltf.items("meshes")[placement.mesh]
        primitives = mesh.get("primitives")
        if not isinstance(primitives, list) or not all(isinstance(each, dict) for each in primitives):
            raise FormatError(f"mesh {placement.mesh} has no primitives")
        for number, primitive in enumerate(primitives):
            if primitive.get("mode", _TRIANGLES) not in (_TRIANGLES, _STRIP, _FAN):
                continue
            try:
                piece = _piece(gltf, accessors, placement, number, primitive)
            except (FormatError, InputError) as error:
                raise type(error)(f"mesh {placement.mesh}, primitive {number}: {error}") from None
            pieces.append(piece)
            total += len(piece.triangles)
            elements += len(piece.positions)
            if total > MAX_TRIANGLES or elements > MAX_ELEMENTS or len(pieces) > MAX_PARTS:
                raise InputError(
                    f"it has more than {MAX_TRIANGLES} triangles, {MAX_ELEMENTS} vertices or {MAX_PARTS} "
                    "parts; allowed: up to that"
                )
        notes += _instance_notes(gltf, placement)
    if not pieces:
        raise InputError("it shows no triangles; allowed: at least one")
    return _together(gltf, pieces, notes)


def primitive_arrays(
    gltf: Gltf, accessors: Accessors, primitive: Json
) -> tuple[dict[str, Accessor], IntArray | None]:
    """Return a primitive's attributes by name, and its indices (n,) if it has any; decompressed.

    Raises
    ------
    FormatError, InputError
        If they violate the format, or cannot be decompressed.
    """
    attributes = primitive.get("attributes")
    if not isinstance(attributes, dict) or "POSITION" not in attributes:
        raise FormatError("it has no positions")
    arrays: dict[str, Accessor] = {}
    indices = None
    compressed = _extension(primitive, DRACO)
    if compressed is not None:
        triangles, decoded = _draco(accessors, primitive, compressed)
        indices = triangles.reshape(-1)
        for name, values in decoded.items():
            entry = gltf.item("accessors", attributes.get(name))
            arrays[name] = Accessor(values, entry.get("normalized") is True and values.dtype.kind != "f")
    elif "indices" in primitive:
        found = accessors.read(primitive["indices"], 1).values[:, 0]
        if found.dtype.kind != "u":
            raise FormatError("its indices are not whole numbers")
        if found.dtype.itemsize == 4 and found.max() >= 1 << 31:
            raise FormatError(f"it names vertex {found.max()}")
        indices = found.astype(np.int32)
    for name, index in attributes.items():
        if name not in arrays:
            arrays[name] = accessors.read(index, 1, 2, 3, 4)
    count = len(arrays["POSITION"].values)
    for name, array in arrays.items():
        if len(array.values) != count:
            raise FormatError(f"it has {count} positions and {len(array.values)} of {name[:40]}")
    if arrays["POSITION"].values.shape[1] != 3:
        raise FormatError("its positions are not of three numbers")
    if indices is not None and indices.max(initial=0) >= count:
        raise FormatError(f"it names vertex {indices.max()}; there are {count}")
    return arrays, indices


def primitive_triangles(primitive: Json, indices: IntArray | None, vertices: int) -> IntArray:
    """Return the triangles of a list, strip or fan, (T, 3)."""
    if indices is None:
        indices = np.arange(vertices, dtype=np.int32)
    mode = primitive.get("mode", _TRIANGLES)
    if mode == _TRIANGLES:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    count = max(0, len(indices) - 2)
    n = np.arange(count)
    if mode == _FAN:
        return np.stack([indices[n + 1], indices[n + 2], np.full(count, indices[0])], axis=1)
    odd = n & 1
    return np.stack([indices[n], indices[n + 1 + odd], indices[n + 2 - odd]], axis=1)


def _piece(
    gltf: Gltf, accessors: Accessors, placement: MeshPlacement, number: int, primitive: Json
) -> _Piece:
    arrays, indices = primitive_arrays(gltf, accessors, primitive)
    raw = as_floats(arrays["POSITION"])
    triangles = primitive_triangles(primitive, indices, len(raw))
    mirrored = bool(np.linalg.det(placement.matrix[:3, :3]) < 0)
    if mirrored:
        triangles = triangles[:, [0, 2, 1]]
    sets = [name for name in (f"JOINTS_{n}" for n in range(8)) if name in arrays]
    weights = [name.replace("JOINTS", "WEIGHTS") for name in sets]
    if missing := set(weights) - arrays.keys():
        raise FormatError(f"it has joints but no {min(missing)}")
    matrices = vertex_matrices(
        placement, [arrays[name] for name in sets], [arrays[name] for name in weights], len(raw)
    )
    positions = np.einsum("vij,vj->vi", np.broadcast_to(matrices, (len(raw), 3, 4))[:, :, :3], raw)
    positions += matrices[:, :, 3]
    normals = _floats(arrays, "NORMAL", 3)
    if normals is not None:
        normals = _turned_normals(normals, matrices)
    uv = _floats(arrays, "TEXCOORD_0", 2)
    colors = _colors(arrays)
    label, names = _names(gltf, placement)
    material = ""
    if "material" in primitive:
        material = _text(gltf.item("materials", primitive["material"]).get("name"))
    part = ModelPart(
        label, material, names, 1 + len(placement.others), _features(gltf, primitive, arrays, placement)
    )
    return _Piece(
        label,
        material,
        part,
        GltfPart(placement.mesh, number, np.ascontiguousarray(triangles, np.int32), mirrored),
        raw,
        positions,
        triangles,
        None if uv is None else uv[triangles],
        None if normals is None else normals[triangles],
        None if colors is None else colors[triangles],
        placement,
    )


def _floats(arrays: dict[str, Accessor], name: str, width: int) -> FloatArray | None:
    if name not in arrays:
        return None
    values = as_floats(arrays[name])
    if values.shape[1] != width:
        raise FormatError(f"{name} has {values.shape[1]} components; allowed: {width}")
    return values


def _colors(arrays: dict[str, Accessor]) -> NDArray[np.float32] | None:
    """Return the vertices' colours, (V, 3); files that this program covered before store them as _COLOR_0.

    Colours that violate the format are ignored: nothing else depends on them.
    """
    found = arrays.get("COLOR_0", arrays.get("_COLOR_0"))
    if found is None or found.values.shape[1] < 3:
        return None
    kind = found.values.dtype
    return as_colors(found.values.astype(np.float64), 1.0 if kind.kind == "f" else np.iinfo(kind).max)


def _turned_normals(normals: FloatArray, matrices: FloatArray) -> FloatArray:
    """Return normals in the scene, for any scales: transformed by the cofactor matrices."""
    a, b, c = np.moveaxis(matrices[:, :, :3], 2, 0)
    across = np.cross(b, c)
    sign = np.where((a * across).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    x, y, z = normals.T
    turned: FloatArray = sign * (
        x[:, None] * across + y[:, None] * np.cross(c, a) + z[:, None] * np.cross(a, b)
    )
    return turned


def _draco(accessors: Accessors, primitive: Json, compressed: Json) -> tuple[IntArray, dict[str, Any]]:
    wanted = compressed.get("attributes")
    known = primitive["attributes"]
    if not isinstance(wanted, dict) or not wanted.keys() <= known.keys() or "POSITION" not in wanted:
        raise FormatError("Draco's attributes are not those of the primitive")
    if not all(type(number) is int for number in wanted.values()):
        raise FormatError("Draco's attributes are not whole numbers")
    if primitive.get("mode", _TRIANGLES) != _TRIANGLES:
        raise InputError("a strip that Draco compressed is not read; allowed: lists of triangles")
    vertices, indices = accessors.count(known["POSITION"]), accessors.count(primitive.get("indices"))
    data = accessors.view(compressed.get("bufferView")).tobytes()
    return decoded_primitive(data, wanted, vertices, indices)


def _names(gltf: Gltf, placement: MeshPlacement) -> tuple[str, tuple[str, ...]]:
    """Return the name of a part's object, its node or else its mesh; and all its names."""
    node = _text(gltf.items("nodes")[placement.node].get("name"))
    mesh = _text(gltf.items("meshes")[placement.mesh].get("name"))
    return node or mesh, tuple(name for name in dict.fromkeys((node, mesh)) if name)


def _features(
    gltf: Gltf, primitive: Json, arrays: dict[str, Accessor], placement: MeshPlacement
) -> tuple[str, ...]:
    found = []
    if placement.joints is not None and "JOINTS_0" in arrays:
        found.append("skin")
    if isinstance(primitive.get("targets"), list):
        found.append(number_of(len(primitive["targets"]), "morph target"))
    if _extension(primitive, DRACO) is not None:
        found.append("Draco")
    else:
        entry = gltf.item("accessors", primitive["attributes"]["POSITION"])
        if "bufferView" in entry and meshopt_of(gltf.item("bufferViews", entry["bufferView"])) is not None:
            found.append("meshopt")
    if arrays["POSITION"].values.dtype.kind != "f":
        found.append("quantised")
    if "COLOR_0" in arrays:
        found.append("vertex colours")
    return tuple(found)


def _instance_notes(gltf: Gltf, placement: MeshPlacement) -> list[str]:
    """List consequences of a mesh's multiple placements."""
    label = _names(gltf, placement)[0] or f"mesh {placement.mesh}"
    notes = []
    first = abs(np.linalg.det(placement.matrix[:3, :3])) ** (1 / 3)
    scales = np.cbrt(np.abs(np.linalg.det(placement.others[:, :3, :3]))) / first
    differing = scales[~((scales > 1 / _SCALES_DIFFER) & (scales < _SCALES_DIFFER))]
    if len(differing):
        sizes = " to ".join(dict.fromkeys(f"{scale:.3g}" for scale in (differing.min(), differing.max())))
        notes.append(
            f"{label!r} is shown {1 + len(placement.others)} times at different sizes ({sizes} times the "
            "first): its texture has the right scale on the first"
        )
    return notes


def _together(gltf: Gltf, pieces: Sequence[_Piece], notes: list[str]) -> RawModel:
    names = named_parts([(piece.label, piece.material) for piece in pieces])
    parts = [replace(piece.part, name=name) for piece, name in zip(pieces, names, strict=True)]
    first = np.cumsum([0, *(len(piece.positions) for piece in pieces)])
    counts = [len(piece.triangles) for piece in pieces]
    bare = [name for piece, name in zip(pieces, names, strict=True) if piece.uv is None]
    if 0 < len(bare) < len(pieces):
        notes.append(
            f"{len(bare)} of {len(pieces)} parts without texture coordinates: {', '.join(bare)[:200]}"
        )
    return RawModel(
        positions=np.concatenate([piece.positions for piece in pieces]),
        triangles=np.concatenate([piece.triangles + at for piece, at in zip(pieces, first, strict=False)]),
        part=np.repeat(np.arange(len(pieces), dtype=np.int32), counts),
        parts=parts,
        same=np.concatenate([piece.raw for piece in pieces]),
        owner=np.repeat(
            np.array([piece.placement.mesh for piece in pieces], np.int32),
            [len(piece.positions) for piece in pieces],
        ),
        uv=joined_corners([piece.uv for piece in pieces], counts, 2),
        normals=joined_corners([piece.normals for piece in pieces], counts, 3),
        metres=1.0,
        up="y",
        notes=notes,
        contents={kind: len(gltf.items(kind)) for kind in _KEPT if gltf.items(kind)},
        gltf=gltf,
        gltf_parts=[piece.source for piece in pieces],
        colors=joined_corners([piece.colors for piece in pieces], counts, 3, np.float32),
    )


def _extension(entry: Json, name: str) -> Json | None:
    extensions = entry.get("extensions")
    found = extensions.get(name) if isinstance(extensions, dict) else None
    return found if isinstance(found, dict) else None


def _text(value: object) -> str:
    """Return a name on one line."""
    return " ".join(value.split())[:200] if isinstance(value, str) else ""
