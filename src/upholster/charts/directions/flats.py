"""Flat faces of a mesh that end sharply, as a box's lid or a bolt's head.

What is round is flat nowhere: a facet of it goes on over edges that bend little. What is flat, and ends at
sharp edges, at narrow roundings or at borders, is a face of its own, whatever file its triangles come from.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.charts.directions._kernels import regions
from upholster.charts.directions.asked import SMOOTH
from upholster.charts.directions.frames import PlaneFrames
from upholster.geometry import TriangleMesh
from upholster.types import FloatArray, IntArray

__all__ = ["Border", "flat_faces", "mean_planes"]

_FLAT = 2.0
"""Degrees by which normals of a flat face differ from their mean, at most."""

_LINKS = (_FLAT, 0.1 * _FLAT, _FLAT)
"""Degrees up to which triangles side by side are one, round by round. A fine rounding bends by less than the
first; chamfers end at the faces that the rounds before have found."""

_CHAMFER = 30.0
"""Degrees: edges to a face that bend by so much are sharp."""

_SHARP = 0.8
"""Part of its border at which a flat face ends sharply, at least."""

_ROUNDING = 1e-6
"""Of cosines: what bends by just so much as is told is sharp."""

_STEPS = 256
"""Triangles beyond a border over which the surface is followed, at most."""

_ROOM = 1 << 18
"""Edges of a border from which the surface is followed at a time: so much memory that takes."""


@dataclass(frozen=True, eq=False)
class Border:
    """Edges of triangles of faces that lie beside other triangles, or beside none.

    Attributes
    ----------
    triangle, edge
        (B,) which edge of which triangle.
    face
        (B,) the number of its face.
    line
        (B, 3) from the edge's start to its end.
    length
        (B,) in model units.
    """

    triangle: NDArray[np.intp]
    edge: NDArray[np.intp]
    face: IntArray
    line: FloatArray
    length: FloatArray

    @classmethod
    def of(cls, mesh: TriangleMesh, face: IntArray) -> "Border":
        """Return the edges round faces, whose numbers triangles have in `face` (T,), −1 for none."""
        beyond = np.where(mesh.neighbours >= 0, face[mesh.neighbours // 3], -1)
        triangle, edge = np.nonzero((face[:, None] >= 0) & (beyond != face[:, None]))
        line = mesh.corners[triangle, (edge + 1) % 3] - mesh.corners[triangle, edge]
        return cls(triangle, edge, face[triangle], line, _lengths(line))

    def some(self, first: int, last: int) -> "Border":
        """Return the edges from one number up to another."""
        own = slice(first, last)
        return Border(self.triangle[own], self.edge[own], self.face[own], self.line[own], self.length[own])


def flat_faces(mesh: TriangleMesh, frames: PlaneFrames) -> IntArray:
    """Return the number of the flat face to which each triangle belongs, (T,), −1 for none.

    A face's normals lie within 2° of their mean. Most of its border is sharp: the surface ends there, or
    turns by 60° or more within as much as the face is wide (area over half its border); to another face, as
    from a chamfer, 30° are enough.
    """
    number = np.full(len(mesh.triangles), -1, np.int32)
    count = 0
    for link in _LINKS:
        face, planes = _level_pieces(mesh, frames, number, np.cos(np.radians(link)))
        border = Border.of(mesh, face)
        around = np.bincount(border.face, border.length, len(planes))
        areas = np.bincount(face[face >= 0], frames.areas[face >= 0], len(planes))
        width = 2 * areas / np.maximum(around, 1e-300)
        sharp = np.concatenate(
            [
                _is_sharp(mesh, frames, border.some(first, first + _ROOM), planes, width)
                for first in range(0, max(len(border.face), 1), _ROOM)
            ]
        )
        sharp |= _at_faces(mesh, frames, border, number)
        bounded = np.bincount(border.face, border.length * sharp, len(planes)) >= _SHARP * around
        kept = np.where(bounded, count + np.cumsum(bounded) - 1, -1)
        number = np.where(face >= 0, np.append(kept, -1)[face], number).astype(np.int32)
        count += int(bounded.sum())
    return number


def mean_planes(frames: PlaneFrames, face: IntArray) -> FloatArray:
    """Return unit normals of faces (F, 3), the means of those of their triangles (T,)."""
    inside = face >= 0
    count = int(face.max(initial=-1)) + 1
    weighted = frames.areas[inside, None] * frames.normals[inside]
    total: FloatArray = np.stack([np.bincount(face[inside], part, count) for part in weighted.T], axis=1)
    return np.asarray(total / np.maximum(_lengths(total), 1e-300)[:, None])


def _level_pieces(
    mesh: TriangleMesh, frames: PlaneFrames, taken: IntArray, link: float
) -> tuple[IntArray, FloatArray]:
    """Return the pieces (T,) of what is not taken that are flat, −1 elsewhere, and their normals."""
    normals, beyond = frames.normals, mesh.neighbours // 3
    linked = (mesh.neighbours >= 0) & (np.einsum("ti,tki->tk", normals, normals[beyond]) >= link)
    free = taken < 0
    linked &= free[:, None] & free[beyond]
    piece = np.empty(len(normals), np.int32)
    count = regions(np.where(linked, beyond, -1).astype(np.int32), piece)
    planes = mean_planes(frames, piece)
    off = np.einsum("ij,ij->i", normals, planes[piece]) < np.cos(np.radians(_FLAT))
    bent = np.bincount(piece, off | ~free, count) > 0
    kept = np.where(bent, -1, np.cumsum(~bent) - 1)
    return kept[piece].astype(np.int32), planes[~bent]


def _at_faces(mesh: TriangleMesh, frames: PlaneFrames, border: Border, number: IntArray) -> NDArray[np.bool_]:
    """Return which edges (B,) bend sharply to a face whose `number` (T,) is known."""
    met = mesh.neighbours[border.triangle, border.edge]
    bend = np.einsum("ij,ij->i", frames.normals[border.triangle], frames.normals[met // 3])
    bent: NDArray[np.bool_] = bend <= np.cos(np.radians(_CHAMFER)) + _ROUNDING
    return bent & (met >= 0) & (number[met // 3] >= 0)


class _Walk(NamedTuple):
    """Ways straight over the surface: which, where, whereto, how far yet, and the edge to be crossed next.

    `met` is triangle · 3 + edge beyond it, −1 for none; `line` runs along it, its triangle to the left.
    """

    number: NDArray[np.intp]
    at: FloatArray
    way: FloatArray
    left: FloatArray
    met: IntArray
    line: FloatArray

    def only(self, these: NDArray[np.bool_]) -> "_Walk":
        """Return some of the ways."""
        number, at, way, left = self.number[these], self.at[these], self.way[these], self.left[these]
        return _Walk(number, at, way, left, self.met[these], self.line[these])


def _is_sharp(
    mesh: TriangleMesh, frames: PlaneFrames, border: Border, planes: FloatArray, width: FloatArray
) -> NDArray[np.bool_]:
    """Return at which edges of a border (B,) a face ends sharply: see `flat_faces`.

    From the middle of each edge the surface is followed straight on.
    """
    sharp = np.zeros(len(border.face), np.bool_)
    least = np.cos(np.radians(SMOOTH)) + _ROUNDING
    way = np.cross(border.line, frames.normals[border.triangle])
    walk = _Walk(
        np.arange(len(sharp)),
        mesh.corners[border.triangle, border.edge] + 0.5 * border.line,
        way / np.maximum(_lengths(way), 1e-300)[:, None],
        width[border.face],
        mesh.neighbours[border.triangle, border.edge],
        border.line,
    )
    for _ in range(_STEPS):
        normals, own = frames.normals[walk.met // 3], planes[border.face[walk.number]]
        ends = (walk.met < 0) | (np.einsum("ij,ij->i", normals, own) <= least)
        sharp[walk.number[ends]] = True
        walk = walk.only(~ends)
        walk = _crossed(mesh, frames, walk._replace(way=_unfolded(walk, normals[~ends])))
        walk = walk.only(walk.left > 0)
        if not len(walk.number):
            break
    return sharp


def _unfolded(walk: _Walk, normals: FloatArray) -> FloatArray:
    """Return ways (N, 3) in the planes, of unit normals (N, 3), beyond the edges that they cross."""
    unit = walk.line / np.maximum(_lengths(walk.line), 1e-300)[:, None]
    along = np.einsum("ij,ij->i", walk.way, unit)
    across = np.sqrt(np.maximum(1 - along**2, 0))
    return np.asarray(along[:, None] * unit + across[:, None] * np.cross(unit, normals))


def _crossed(mesh: TriangleMesh, frames: PlaneFrames, walk: _Walk) -> _Walk:
    """Return ways as they go on from the other side of the triangles in which they are."""
    triangle, entered = np.divmod(walk.met, 3)
    corners, row = mesh.corners[triangle], np.arange(len(triangle))
    best, leaves = np.full(len(row), np.inf), (entered + 1) % 3
    for turn in (1, 2):
        edge = (entered + turn) % 3
        start = corners[row, edge]
        inward = np.cross(frames.normals[triangle], corners[row, (edge + 1) % 3] - start)
        speed = -np.einsum("ij,ij->i", walk.way, inward)
        away = np.maximum(np.einsum("ij,ij->i", walk.at - start, inward), 0.0)
        after = np.where(speed > 0, away / np.where(speed > 0, speed, 1.0), np.inf)
        leaves = np.where(after < best, edge, leaves)
        best = np.minimum(best, after)
    step = np.where(np.isfinite(best), best, walk.left)
    line = corners[row, (leaves + 1) % 3] - corners[row, leaves]
    at, met = walk.at + step[:, None] * walk.way, mesh.neighbours[triangle, leaves]
    return _Walk(walk.number, at, walk.way, walk.left - step, met, line)


def _lengths(vectors: FloatArray) -> FloatArray:
    found: FloatArray = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    return found
