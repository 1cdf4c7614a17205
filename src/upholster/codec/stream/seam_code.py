"""Seams between edges of faces, and edges that are a point, as integers (SPEC.md, section 2)."""

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise

from upholster.codec.stream.byte_reader import ByteReader, varint
from upholster.geometry.patches.face import Face
from upholster.geometry.patches.face_seams import FaceSeam
from upholster.geometry.patches.surface import Surface

__all__ = ["pack_seams", "parse_seams"]

MAX_SEAMS = 2**20

_UNIT = 2**30
"""Units of a patch's edge."""

_OPPOSED, _POINT = 1, 2
_PARTIAL = 3
"""Kinds of a seam: 0, or one of these; plus `_PARTIAL` if it does not consist of complete edges."""

_Interval = list[int]
"""Edge, low, high."""


def pack_seams(surface: Surface) -> bytes:
    """Return the seams of a surface's faces, and their collapsed edges, as bytes; empty if there are none.

    Raises
    ------
    InputError
        If more than two edges claim one interval.
    """
    rows = [
        (
            _OPPOSED * seam.opposed,
            _interval(seam.face, seam.edge, seam.start, seam.stop),
            _interval(seam.other_face, seam.other_edge, *sorted((seam.other_start, seam.other_stop))),
        )
        for seam in surface.face_shared
    ] + [(_POINT, one) for one in _points(surface)]
    _trim([interval for _, *intervals in rows for interval in intervals])
    kept = [row for row in rows if all(low < high for _, low, high in row[1:])]
    head = varint(len(kept)) if kept else b""
    return head + b"".join(_packed(surface.faces, kind, intervals) for kind, *intervals in kept)


def parse_seams(fields: ByteReader, faces: Sequence[Face]) -> tuple[FaceSeam, ...]:
    """Read the seams of a surface's faces, sorted; none if no bytes are left.

    Raises
    ------
    FormatError
        If a number is not allowed, or two seams overlap.
    """
    taken: dict[int, list[tuple[int, int]]] = defaultdict(list)
    seams = []
    for _ in range(fields.varint("number of seams", min(MAX_SEAMS, fields.left), 1) if fields.left else 0):
        partial, kind = divmod(fields.byte("kind of a seam", _PARTIAL + _POINT), _PARTIAL)
        edges = [
            fields.varint("edge of a face", 4 * len(faces) - 1) for _ in range(1 if kind == _POINT else 2)
        ]
        ends = []
        for edge in edges:
            low, high = _parse_interval(fields, _length(faces, edge), partial)
            taken[edge].append((low, high))
            ends.append((low / _UNIT, high / _UNIT))
        if kind != _POINT:
            a, b = edges
            other = ends[1][::-1] if kind == _OPPOSED else ends[1]
            seams.append(FaceSeam(a // 4, a % 4, *ends[0], b // 4, b % 4, *other))
    for parts in taken.values():
        if any(before[1] > after[0] for before, after in pairwise(sorted(parts))):
            raise fields.error("seams overlap; allowed: one after the other along an edge")
    return tuple(sorted(seams, key=lambda one: (one.face, one.edge, one.start)))


def _parse_interval(fields: ByteReader, length: int, partial: int) -> tuple[int, int]:
    if not partial:
        return 0, length
    low = fields.varint("where a seam begins", length - 1)
    return low, low + fields.varint("extent of a seam", length - low, 1)


def _interval(face: int, edge: int, low: float, high: float) -> _Interval:
    return [4 * face + edge, round(low * _UNIT), round(high * _UNIT)]


def _points(surface: Surface) -> list[_Interval]:
    """Return the intervals in which edges of faces are a point, merged along the edges."""
    found: list[_Interval] = []
    for patch, edge in surface.degenerate:
        face, row, column = surface.place(patch)
        last = surface.faces[face].rows - 1, surface.faces[face].columns - 1
        if (row, column)[edge % 2] == (0, last[1], last[0], 0)[edge]:
            at = (column, row)[edge % 2]
            found.append(_interval(face, edge, at, at + 1))
    joined: list[_Interval] = []
    for one in sorted(found):
        if joined and joined[-1][0] == one[0] and joined[-1][2] == one[1]:
            joined[-1][2] = one[2]
        else:
            joined.append(one)
    return joined


def _trim(intervals: Sequence[_Interval]) -> None:
    """Let intervals that overlap on an edge, by about the tolerance, begin where the previous one ends."""
    edge, covered = -1, 0
    for one in sorted(intervals):
        if one[0] != edge:
            edge, covered = one[0], 0
        one[1] = max(one[1], covered)
        covered = max(covered, one[2])


def _packed(faces: Sequence[Face], kind: int, intervals: Sequence[_Interval]) -> bytes:
    whole = all([low, high] == [0, _length(faces, edge)] for edge, low, high in intervals)
    out = bytes([kind + _PARTIAL * (not whole)]) + b"".join(varint(edge) for edge, _, _ in intervals)
    return out + (b"" if whole else b"".join(varint(low) + varint(high - low) for _, low, high in intervals))


def _length(faces: Sequence[Face], edge: int) -> int:
    face = faces[edge // 4]
    return _UNIT * (face.rows if edge % 2 else face.columns)
