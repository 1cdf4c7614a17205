"""PLY files, text or binary.

References
----------
G. Turk: The PLY polygon file format, 1994.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError, InputError
from upholster.base.types import FloatArray
from upholster.geometry.gltf.colors import as_colors
from upholster.geometry.meshes.triangle_mesh import MAX_TRIANGLES
from upholster.geometry.model_files._ply_kernels import walk_bytes, walk_numbers
from upholster.geometry.model_files.faces import CutFaces, Faces, check_corners, cut_faces
from upholster.geometry.model_files.model_file import ModelPart
from upholster.geometry.model_files.raw_model import RawModel
from upholster.geometry.model_files.text_numbers import numbers_of

__all__ = ["read_ply"]

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_FORMATS = ("ascii", "binary_little_endian", "binary_big_endian")
_COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
_COLORS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
_LARGEST = {"u2": 65535.0, "f4": 1.0, "f8": 1.0}
"""The number for full intensity by type of colour; 255 for other types."""

_MOST_ROWS = 3 * MAX_TRIANGLES
_MOST_PROPERTIES = 1000


@dataclass
class _Element:
    """An element of the header: its properties by name, as (type of a list's count or "", type)."""

    name: str
    count: int
    properties: dict[str, tuple[str, str]] = field(default_factory=dict)


@dataclass(eq=False)
class _Rows:
    """An element's rows: the positions of each property's items in the data."""

    element: _Element
    data: NDArray[Any]
    starts: NDArray[np.int64]
    lengths: NDArray[np.int64]
    order: str

    def items(self, name: str, rows: NDArray[np.int64], count: int) -> FloatArray:
        """Return a property's `count` items in some rows, (rows, count)."""
        column = list(self.element.properties).index(name)
        starts = self.starts[rows, column, None]
        if self.data.dtype != np.uint8:
            return np.asarray(self.data[starts + np.arange(count)], np.float64)
        kind = np.dtype(self.order + self.element.properties[name][1])
        part = np.ascontiguousarray(self.data[starts + np.arange(count * kind.itemsize)])
        return part.view(kind).astype(np.float64).reshape(len(rows), count)

    def column(self, name: str) -> FloatArray:
        """Return a property that is not a list, (rows,)."""
        return self.items(name, np.arange(len(self.starts)), 1)[:, 0]

    def counts(self, name: str) -> NDArray[np.int64]:
        """Return the number of a list's items in each row."""
        result: NDArray[np.int64] = self.lengths[:, list(self.element.properties).index(name)]
        return result


def read_ply(data: bytes, name: str) -> RawModel:
    """Read a PLY file: one part, named after the file. Colours of faces are ignored.

    Texture coordinates may belong to vertices or to the corners of faces.

    Raises
    ------
    FormatError
        If it violates the format.
    InputError
        If it has no faces.
    """
    form, elements, body = _header(data)
    rows = _rows(form, elements, body, data.count(b"\n", 0, len(data) - len(body)))
    if "vertex" not in rows or not {"x", "y", "z"} <= rows["vertex"].element.properties.keys():
        raise FormatError("it has no vertices with x, y and z")
    vertices = rows["vertex"]
    faces = rows.get("face")
    lists = [] if faces is None else faces.element.properties.keys() & {"vertex_indices", "vertex_index"}
    if faces is None or not lists:
        raise InputError("it has no faces; allowed: a mesh, not a point cloud")
    positions = _columns(vertices, ("x", "y", "z"))
    groups = _faces(faces, min(lists))
    cut = cut_faces(positions, groups)
    model = RawModel(positions, cut.triangles, np.zeros(len(cut.triangles), np.int32), [ModelPart(name)])
    own = vertices.element.properties.keys()
    if {"nx", "ny", "nz"} <= own:
        model.normals = _columns(vertices, ("nx", "ny", "nz"))[cut.triangles]
    model.colors = _colors(vertices, cut)
    pair = next((pair for pair in _COORDINATES if own >= set(pair)), None)
    uv = None
    if "texcoord" in faces.element.properties:
        if all((faces.counts("texcoord")[g.number] == 2 * g.corners.shape[1]).all() for g in groups):
            uv = cut.of_corners(
                [
                    faces.items("texcoord", g.number, 2 * g.corners.shape[1]).reshape(len(g.number), -1, 2)
                    for g in groups
                ]
            )
    elif pair is not None:
        uv = _columns(vertices, pair)[cut.triangles]
    if uv is not None:
        model.uv = np.stack([uv[..., 0], 1.0 - uv[..., 1]], axis=-1)
    return model


def _header(data: bytes) -> tuple[str, list[_Element], bytes]:
    """Return the format, the elements, and the data after the header."""
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or not 0 <= end < 1 << 20:
        raise FormatError("it does not begin with a header of PLY")
    stop = data.find(b"\n", end)
    if stop < 0:
        raise FormatError("it ends with its header")
    form, elements = "", list[_Element]()
    for line in data[:end].decode("utf-8", "replace").splitlines()[1:]:
        words = line.split()
        match words:
            case [] | ["comment" | "obj_info", *_]:
                continue
            case ["format", name, _] if name in _FORMATS:
                form = name
            case ["element", name, count] if count.isdigit() and int(count[:12]) <= _MOST_ROWS:
                elements.append(_Element(name, int(count)))
            case ["property", "list", count, kind, name] if elements and {count, kind} <= _TYPES.keys():
                elements[-1].properties[name] = (_TYPES[count], _TYPES[kind])
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].properties[name] = ("", _TYPES[kind])
            case _:
                raise FormatError(f"its header has the line {line[:60]!r}")
    if not form or sum(len(element.properties) for element in elements) > _MOST_PROPERTIES:
        raise FormatError("its header has no format, or too many properties")
    return form, elements, data[stop + 1 :]


def _rows(form: str, elements: Sequence[_Element], body: bytes, before: int) -> dict[str, _Rows]:
    """Find the rows of all elements up to the faces; `before` is the number of lines before them."""
    as_text = form == "ascii"
    order = ">" if form == "binary_big_endian" else "<"
    lines = np.zeros(1, np.int64)
    data: NDArray[Any] = np.frombuffer(body, np.uint8)
    if as_text:
        data = numbers_of(body, "its rows", lambda row: f"line {before + row + 1}")
        counts = [len(line.split()) for line in body.split(b"\n")]
        lines = np.cumsum([0, *(count for count in counts if count)])
    found: dict[str, _Rows] = {}
    for element in elements:
        layout = np.array(
            [
                (np.dtype(count).itemsize if count else 0, np.dtype(kind).itemsize)
                for count, kind in element.properties.values()
            ],
            np.int64,
        ).reshape(-1, 2)
        fits = element.count * max(1, len(layout)) <= len(data)
        if fits:
            starts = np.empty((element.count, len(layout)), np.int64)
            lengths = np.empty_like(starts)
            found[element.name] = _Rows(element, data, starts, lengths, order)
            if as_text:
                fits = element.count < len(lines) and walk_numbers(data, lines, layout, starts, lengths)
                lines = lines[element.count :]
            else:
                end = walk_bytes(data, layout, order == ">", starts, lengths)
                fits, data = end >= 0, data[max(0, end) :]
        if not fits:
            raise FormatError(f"it announces {element.count} rows of {element.name}, but has fewer")
        if element.name == "face":
            break
    return found


def _columns(rows: _Rows, names: Sequence[str]) -> FloatArray:
    return np.stack([rows.column(name) for name in names], axis=1)


def _colors(vertices: _Rows, cut: CutFaces) -> NDArray[np.float32] | None:
    """Return the vertices' colours at the triangles' corners."""
    own = vertices.element.properties
    names = next((names for names in _COLORS if own.keys() >= set(names)), None)
    if names is None:
        return None
    largest = _LARGEST.get(own[names[0]][1], 255.0)
    return as_colors(_columns(vertices, names), largest)[cut.triangles]


def _faces(rows: _Rows, name: str) -> list[Faces]:
    sides = rows.counts(name)
    groups = []
    for count in np.unique(sides[sides >= 3]):
        check_corners(int(count))
        mine = np.flatnonzero(sides == count)
        groups.append(Faces(mine, rows.items(name, mine, int(count)).astype(np.int64)))
    return groups
