"""OFF files: vertices and polygons as text.

References
----------
Geomview manual: Object File Format, OFF, COFF, NOFF and STOFF headers.
"""

import re

import numpy as np

from upholster.base.errors import FormatError
from upholster.geometry.gltf.colors import as_colors, largest_color
from upholster.geometry.meshes.triangle_mesh import MAX_TRIANGLES
from upholster.geometry.model_files.faces import listed_faces, model_of_faces
from upholster.geometry.model_files.model_file import ModelPart
from upholster.geometry.model_files.raw_model import RawModel
from upholster.geometry.model_files.text_numbers import numbers_of

__all__ = ["read_off"]

_COMMENT = re.compile(rb"#[^\r\n]*")
_HEAD = re.compile(rb"(ST)?(C)?(N)?(4)?(n)?OFF")
_MAX_VERTICES = 3 * MAX_TRIANGLES


def read_off(data: bytes, name: str) -> RawModel:
    """Read an OFF file: one part, named after the file. Colours of faces are ignored.

    Raises
    ------
    FormatError
        If it violates the format, or is binary or of another dimension.
    """
    lines = _COMMENT.sub(b"", data).split(b"\n")
    numbers = [number for number, line in enumerate(lines, 1) if line.strip()]
    rows = [lines[number - 1] for number in numbers]
    words = rows[0].split() if rows else []
    head = _HEAD.fullmatch(words[0]) if words else None
    if head is None or head[4] or head[5] or b"BINARY" in words:
        raise FormatError("it does not begin with OFF, COFF, NOFF or STOFF in text")
    # The counts may be on the first line or on the next one.
    counts, rows = (
        (words[1:], rows[1:]) if len(words) > 1 else (rows[1].split() if len(rows) > 1 else [], rows[2:])
    )
    at = 0 if len(words) > 1 else 1
    sizes = numbers_of(b" ".join(counts), "the counts", lambda _: f"line {numbers[at]}")
    if len(sizes) < 2 or not 3 <= sizes[0] <= _MAX_VERTICES or not 1 <= sizes[1] <= MAX_TRIANGLES:
        raise FormatError(
            f"its counts are {b' '.join(counts)[:40].decode('ascii', 'replace')!r}; allowed: 3 to "
            f"{_MAX_VERTICES} vertices, 1 to {MAX_TRIANGLES} faces"
        )
    vertices, faces = int(sizes[0]), int(sizes[1])
    if len(rows) < vertices + faces:
        raise FormatError(f"it has {len(rows)} lines; announced: {vertices} vertices and {faces} faces")
    head_lines = len(numbers) - len(rows)
    table = numbers_of(
        b"\n".join(rows[:vertices]), "vertices", lambda row: f"line {numbers[head_lines + row]}"
    )
    width = len(table) // vertices
    if len(table) != width * vertices or width < 3:
        raise FormatError(
            f"its {vertices} vertices have {len(table)} numbers; allowed: equally many, 3 or more"
        )
    table = table.reshape(vertices, width)
    listed = rows[vertices:]
    groups = listed_faces(listed if len(listed) == faces else _joined(listed, faces))
    model = model_of_faces(table[:, :3], groups, [ModelPart(name)])
    column = 3 + (3 if head[3] else 0)
    if head[3] and width >= 6:
        model.normals = table[:, 3:6][model.triangles]
    if head[2] and width >= column + 3:
        colors = table[:, column:]
        model.colors = as_colors(colors, largest_color(colors))[model.triangles]
    if head[1] and width >= column + 2:
        uv = table[:, -2:][model.triangles]
        model.uv = np.stack([uv[..., 0], 1.0 - uv[..., 1]], axis=-1)
    return model


def _joined(rows: list[bytes], faces: int) -> list[bytes]:
    """Return one line per face: some programs break a face over several lines, and edges may follow."""
    out: list[bytes] = []
    rest = iter(rows)
    for row in rest:
        if len(out) == faces:
            break
        words = row.split()
        sides = int(words[0]) if words[0].isdigit() and len(words[0]) < 6 else 0
        while len(words) <= sides and (more := next(rest, None)) is not None:
            words += more.split()
        out.append(b" ".join(words))
    if len(out) < faces:
        raise FormatError(f"it has {len(out)} faces; announced: {faces}")
    return out
