"""Wavefront OBJ files: objects, groups and materials as parts, polygons, and the attributes of vertices.

References
----------
Wavefront Technologies: Object Files (.obj), Appendix B1 of the Advanced Visualizer manual.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError, InputError
from upholster.base.types import FloatArray
from upholster.geometry.gltf.colors import as_colors, largest_color
from upholster.geometry.model_files.faces import CutFaces, Faces, check_corners, cut_faces
from upholster.geometry.model_files.model_file import MAX_PARTS, ModelPart, named_parts
from upholster.geometry.model_files.raw_model import RawModel
from upholster.geometry.model_files.text_numbers import numbers_of

__all__ = ["read_obj"]

_Label = tuple[str, str, str]
"""Object, group, material."""

_Counts = tuple[int, int, int]


@dataclass(eq=False)
class _Lines:
    """The lines of a file by kind. Faces form runs: consecutive lines with nothing else in between."""

    data: bytes
    v: list[bytes] = field(default_factory=list)
    vt: list[bytes] = field(default_factory=list)
    vn: list[bytes] = field(default_factory=list)
    f: list[bytes] = field(default_factory=list)
    runs: list[tuple[int, _Label, _Counts]] = field(default_factory=list)

    def place(self, kind: str, row: int) -> str:
        """Return the place in the file of a line of a kind, for errors."""
        words = (b"f", b"fo") if kind == "f" else (kind.encode(),)
        continued = False
        for number, line in enumerate(self.data.split(b"\n"), 1):
            if not continued and line.split(None, 1)[:1] in [[word] for word in words]:
                row -= 1
                if row < 0:
                    return f"line {number}"
            continued = line.rstrip(b"\r").endswith(b"\\")
        return f"a {kind} line"


def read_obj(data: bytes, name: str) -> RawModel:
    """Read an OBJ file. Each combination of object, group and material is a part.

    Raises
    ------
    FormatError
        If it violates the format.
    InputError
        If it has no faces, or too many.
    """
    lines = _sorted_lines(data)
    if not lines.f:
        raise InputError("it has no faces; allowed: at least one")
    labels = list(dict.fromkeys(label for _, label, _ in lines.runs))
    if len(labels) > MAX_PARTS:
        raise InputError(f"it has {len(labels)} parts; allowed: {MAX_PARTS}")
    vertices = _table(lines, "v", (3, 4, 6, 7))
    positions = vertices[:, :3]
    coordinates = _table(lines, "vt", (1, 2, 3))
    normals = _table(lines, "vn", (3,))
    groups, pointers = _read_faces(lines, (len(positions), len(coordinates), len(normals)))
    cut = cut_faces(positions, groups)
    run_starts = np.array([start for start, _, _ in lines.runs])
    run_of = np.searchsorted(run_starts, cut.face, side="right") - 1
    number_of = {label: number for number, label in enumerate(labels)}
    part = np.array([number_of[label] for _, label, _ in lines.runs], np.int32)[run_of]
    uv = normal = None
    if len(coordinates):
        padded = np.concatenate([coordinates, np.zeros((len(coordinates), 1))], axis=1)[:, :2]
        uv = _at_corners(cut, [each[:, :, 0] for each in pointers], padded)
        uv = np.stack([uv[..., 0], 1.0 - uv[..., 1]], axis=-1)
    if len(normals):
        normal = _at_corners(cut, [each[:, :, 1] for each in pointers], normals)
    model = _by_part(positions, cut, part, [_part(label, name) for label in labels], uv, normal)
    if vertices.shape[1] in (6, 7):  # x y z r g b, or x y z w r g b
        colors = vertices[:, -3:]
        model.colors = as_colors(colors, largest_color(colors))[model.triangles]
    return model


def _by_part(
    positions: FloatArray,
    cut: CutFaces,
    part: NDArray[np.int32],
    labels: list[tuple[str, ModelPart]],
    uv: FloatArray | None,
    normals: FloatArray | None,
) -> RawModel:
    """Collect the triangles of each part; parts without any are dropped."""
    used, inverse = np.unique(part, return_inverse=True)
    part = inverse.reshape(-1).astype(np.int32)
    order = np.argsort(part, kind="stable")
    labels = [labels[number] for number in used]
    names = named_parts([(label, each.material) for label, each in labels])
    parts = [
        ModelPart(name, each.material, each.names) for name, (_, each) in zip(names, labels, strict=True)
    ]
    objects = {label: number for number, label in enumerate(dict.fromkeys(each.names[0] for each in parts))}
    owner = np.zeros(len(positions), np.int32)
    of_part = np.array([objects[each.names[0]] for each in parts], np.int32)
    owner[cut.triangles] = of_part[part][:, None]
    return RawModel(
        positions,
        cut.triangles[order],
        part[order],
        parts,
        owner=owner,
        uv=None if uv is None else uv[order],
        normals=None if normals is None else normals[order],
        up="y",
    )


def _part(label: _Label, file: str) -> tuple[str, ModelPart]:
    """Return a part's name before names are made unique, and the part."""
    solid, group, material = label
    shown = solid or group or file
    if solid and group and group not in (solid, "default"):
        shown = f"{solid}/{group}"
    names = tuple(dict.fromkeys(each for each in (solid or file, group) if each))
    return shown, ModelPart(shown, material, names)


def _sorted_lines(data: bytes) -> _Lines:
    """Sort lines by their first word."""
    found = _Lines(data)
    if b"\\" in data:
        data = data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    v, vt, vn, f = found.v, found.vt, found.vn, found.f
    label: _Label = ("", "", "")
    new_run = True
    for line in data.split(b"\n"):
        head = line[:2]
        if head == b"v ":
            v.append(line[2:])
        elif head == b"f ":
            if new_run:
                found.runs.append((len(f), label, (len(v), len(vt), len(vn))))
                new_run = False
            f.append(line[2:])
            continue
        elif head == b"vt":
            vt.append(line[2:])
        elif head == b"vn":
            vn.append(line[2:])
        else:
            words = line.split(None, 1)
            if not words or words[0][:1] == b"#":
                continue
            label = _other_line(words, label, found)
            new_run = True
            continue
        new_run = True
    return found


def _other_line(words: list[bytes], label: _Label, found: _Lines) -> _Label:
    """Process a line that names something, or a usual line in an unusual form."""
    rest = words[1] if len(words) > 1 else b""
    text = " ".join(rest.decode("utf-8", "replace").split())[:200]
    solid, group, material = label
    match words[0]:
        case b"o":
            return text, "", material
        case b"g":
            return solid, text, material
        case b"usemtl":
            return solid, group, text
        case b"v":
            found.v.append(rest)
        case b"f" | b"fo":
            found.runs.append((len(found.f), label, (len(found.v), len(found.vt), len(found.vn))))
            found.f.append(rest)
    return label


def _table(found: _Lines, kind: str, widths: tuple[int, ...]) -> FloatArray:
    """Return the numbers of lines of a kind, (n, as many as every line has)."""
    lines: list[bytes] = getattr(found, kind)
    if not lines:
        return np.zeros((0, widths[0]))
    lines = [line.split(b"#")[0] if b"#" in line else line for line in lines]
    least = min(len(line.split()) for line in (lines[0], lines[-1]))
    values = numbers_of(b"\n".join(lines), f"numbers of {kind}", lambda row: found.place(kind, row))
    if least in widths and len(values) == least * len(lines):
        return values.reshape(len(lines), -1)
    rows = [line.split() for line in lines]
    counts = [len(row) for row in rows]
    least = min(counts)
    if least < widths[0]:
        place = found.place(kind, counts.index(least))
        raise FormatError(f"{place}: {kind} has {least} numbers; allowed: {' or '.join(map(str, widths))}")
    return np.array([[float(word) for word in row[:least]] for row in rows])


def _read_faces(lines: _Lines, totals: _Counts) -> tuple[list[Faces], list[NDArray[np.int64]]]:
    """Return faces by number of corners; and their corners' indices of vt and vn, (P, n, 2), -1 for none."""
    buckets: dict[tuple[int, int], tuple[list[int], list[bytes]]] = {}
    for number, line in enumerate(lines.f):
        if b"#" in line:
            line = line.split(b"#")[0]
        sides = len(line.split())
        if sides < 3:
            continue  # a point or a line
        form, uneven = divmod(line.count(b"/"), sides)
        if uneven:  # corners written in several ways in one face
            line, form = _evened(line), 2
        at, texts = buckets.setdefault((sides, form), ([], []))
        at.append(number)
        texts.append(line)
    starts = np.array([start for start, _, _ in lines.runs])
    before = np.array([counts for _, _, counts in lines.runs], np.int64)
    groups, pointers = [], []
    for (sides, form), (at, texts) in buckets.items():
        check_corners(sides)
        rows = np.array(at)
        known = before[np.searchsorted(starts, rows, side="right") - 1]
        table = _numbers(texts, sides, form, partial(_face_place, lines, at))
        absolute = np.full((len(rows), sides, 3), -1, np.int64)
        for column in range(table.shape[2]):
            given = table[:, :, column]
            index = np.where(given < 0, given + known[:, column, None], given - 1)
            wrong = (index >= totals[column]) | ((given < 0) & (index < 0))
            if wrong.any():
                row, corner = np.argwhere(wrong)[0].tolist()
                raise FormatError(
                    f"{lines.place('f', at[row])}: a face names {('v', 'vt', 'vn')[column]} "
                    f"{given[row, corner]}; there are {totals[column]}"
                )
            absolute[:, :, column] = index
        if (zeros := (absolute[:, :, 0] < 0).any(axis=1)).any():
            place = lines.place("f", at[int(zeros.argmax())])
            raise FormatError(f"{place}: a face names vertex 0; allowed: 1 and more, or -1 and less")
        groups.append(Faces(rows, absolute[:, :, 0]))
        pointers.append(absolute[:, :, 1:])
    if not groups:
        raise InputError("it has no faces of three corners or more; allowed: at least one")
    return groups, pointers


def _face_place(lines: _Lines, faces: list[int], row: int) -> str:
    return lines.place("f", faces[row])


def _numbers(texts: list[bytes], sides: int, form: int, place: Callable[[int], str]) -> NDArray[np.int64]:
    """Return the indices of faces (P, n, 1 to 3), 0 where one is missing."""
    joined = b" \n".join([*texts, b""])
    marks = joined.translate(None, b"0123456789+-").split()
    if form > 2 or (set(marks), len(marks)) != (({b"/" * form}, len(texts) * sides) if form else (set(), 0)):
        joined, form = b" \n".join([*map(_evened, texts), b""]), 2
    joined = joined.replace(b"//", b"/0/").replace(b"/ ", b"/0 ")
    values = numbers_of(joined.replace(b"/", b" "), "corners of a face", place)
    if len(values) != len(texts) * sides * (form + 1) or (np.abs(values) >= 1 << 31).any():
        raise FormatError("corners of faces are written in an unknown way; allowed: v, v/vt, v//vn, v/vt/vn")
    if (broken := values != np.floor(values)).any():
        row = int(broken.argmax()) // (sides * (form + 1))
        raise FormatError(f"{place(row)}: corners of a face are not whole numbers")
    return values.astype(np.int64).reshape(len(texts), sides, form + 1)


def _evened(line: bytes) -> bytes:
    """Rewrite the corners of a face with two slashes each."""
    words = [word.split(b"/") for word in line.split()]
    return b" ".join(b"/".join([part or b"0" for part in [*word, b"", b""][:3]]) for word in words)


def _at_corners(cut: CutFaces, numbers: list[NDArray[np.int64]], table: FloatArray) -> FloatArray:
    """Return the rows of a table that corners refer to, NaN for corners without an index: (T, 3, c)."""
    padded = np.concatenate([table, np.full((1, table.shape[1]), np.nan)])
    return cut.of_corners([padded[each] for each in numbers])
