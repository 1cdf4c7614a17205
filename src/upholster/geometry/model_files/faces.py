"""Cutting a file's polygons into triangles, in the order of the file."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError, InputError
from upholster.base.types import FloatArray
from upholster.geometry.meshes.triangle_mesh import MAX_TRIANGLES
from upholster.geometry.model_files.model_file import ModelPart
from upholster.geometry.model_files.polygons import MAX_CORNERS, cut_polygons
from upholster.geometry.model_files.raw_model import RawModel
from upholster.geometry.model_files.text_numbers import numbers_of

__all__ = ["CutFaces", "Faces", "check_corners", "cut_faces", "listed_faces", "model_of_faces"]


@dataclass(eq=False)
class Faces:
    """Polygons with the same number of corners.

    Attributes
    ----------
    number
        (P,) int64: the number of each face in the file.
    corners
        (P, n) int64: their vertices.
    """

    number: NDArray[np.int64]
    corners: NDArray[np.int64]


@dataclass(eq=False)
class CutFaces:
    """Triangles from polygons, in the order of the file.

    Attributes
    ----------
    triangles
        (T, 3) int32: their vertices.
    face
        (T,) int64: their face in the file.
    group, row
        (T,) int64: the group of `Faces` with that face, and its row there.
    corner
        (T, 3) int64: which of that face's corners they use.
    """

    triangles: NDArray[np.int32]
    face: NDArray[np.int64]
    group: NDArray[np.int64]
    row: NDArray[np.int64]
    corner: NDArray[np.int64]

    def of_corners(self, arrays: Sequence[NDArray[np.float64]]) -> FloatArray:
        """Return the values of arrays (P, n, c), one for each group, at the triangles' corners: (T, 3, c)."""
        out = np.empty((*self.corner.shape, arrays[0].shape[2]))
        for number, array in enumerate(arrays):
            mine = self.group == number
            out[mine] = array[self.row[mine, None], self.corner[mine]]
        return out


def listed_faces(rows: Sequence[bytes]) -> list[Faces]:
    """Read faces from lines with a count and that many vertices; the rest of a line is ignored.

    Raises
    ------
    FormatError, InputError
        If a line has fewer vertices, or a face has too few or too many corners.
    """
    by_sides: dict[int, tuple[list[int], list[bytes]]] = {}
    for number, row in enumerate(rows):
        words = row.split()
        sides = int(words[0]) if words[0].isdigit() and len(words[0]) < 6 else -1
        if len(words) <= sides or sides < 0:
            said = words[0][:12].decode("ascii", "replace")
            raise FormatError(f"face {number} has {len(words) - 1} vertices after {said!r}")
        at, texts = by_sides.setdefault(sides, ([], []))
        at.append(number)
        texts.append(b" ".join(words[1 : sides + 1]))
    out = []
    for sides, (at, texts) in by_sides.items():
        if sides >= 3:
            table = numbers_of(b"\n".join(texts), "its vertices", partial(_face, at))
            table = table.reshape(-1, sides)
            out.append(Faces(np.array(at), _whole(table)))
    return out


def _face(numbers: Sequence[int], row: int) -> str:
    return f"face {numbers[row]}"


def _whole(table: FloatArray) -> NDArray[np.int64]:
    if not (np.abs(table) < 2**31).all() or (table != np.floor(table)).any():
        raise FormatError("a face names a vertex by a number that is not an integer")
    return table.astype(np.int64)


def check_corners(sides: int) -> None:
    """Raise InputError for a polygon of too many corners."""
    if sides > MAX_CORNERS:
        raise InputError(f"a face has {sides} corners; allowed: {MAX_CORNERS}")


def cut_faces(positions: FloatArray, groups: Sequence[Faces]) -> CutFaces:
    """Cut faces into triangles, in the order of the file.

    Raises
    ------
    FormatError, InputError
        If there are none or too many, or they name vertices that do not exist.
    """
    total = sum(len(group.number) * (group.corners.shape[1] - 2) for group in groups)
    if not 1 <= total <= MAX_TRIANGLES:
        raise InputError(f"it has {total} triangles; allowed: 1 to {MAX_TRIANGLES}")
    parts = []
    for number, group in enumerate(groups):
        low, high = int(group.corners.min()), int(group.corners.max())
        if low < 0 or high >= len(positions):
            wrong = low if low < 0 else high
            raise FormatError(f"a face names vertex {wrong}; there are {len(positions)}")
        check_corners(group.corners.shape[1])
        cut = cut_polygons(positions, group.corners)
        rows, each = len(cut), cut.shape[1]
        row = np.repeat(np.arange(rows), each)
        corner = cut.reshape(-1, 3)
        parts.append(
            (group.corners[row[:, None], corner], group.number[row], np.full(len(row), number), row, corner)
        )
    joined = [np.concatenate(each) for each in zip(*parts, strict=True)]
    order = np.argsort(joined[1], kind="stable")
    triangles, face, group_of, row, corner = (array[order] for array in joined)
    return CutFaces(triangles.astype(np.int32), face, group_of, row, corner)


def model_of_faces(positions: FloatArray, groups: Sequence[Faces], parts: list[ModelPart]) -> RawModel:
    """Return faces as a model of one part."""
    cut = cut_faces(positions, groups)
    return RawModel(
        np.ascontiguousarray(positions), cut.triangles, np.zeros(len(cut.triangles), np.int32), parts
    )
