"""Flat faces of a mesh with sharp borders, like a box's lid or a bolt's head.

A facet of a curved surface is not one: it continues over edges that bend little. A flat region that ends at
sharp edges, at narrow roundings or at borders is a face of its own, whatever file its triangles come from.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import ComplexArray, FloatArray, IntArray
from upholster.charts.directions._flat_kernels import Facets, mark_sharp
from upholster.charts.directions._kernels import regions
from upholster.charts.directions.frames import PlaneFrames
from upholster.charts.directions.level_directions import SMOOTH
from upholster.geometry.meshes.triangle_mesh import TriangleMesh

__all__ = ["FaceBorder", "flat_faces", "mean_planes"]

_FLAT = 2.0
"""Greatest angle, in degrees, between a flat face's normals and their mean."""

_LINKS = (_FLAT, 0.1 * _FLAT, _FLAT)
"""Greatest angle, in degrees, between adjacent triangles of one face, for each round. Fine roundings bend by
less than the first; chamfers end at the faces that earlier rounds have found."""

_TOP = 20.0
"""Greatest angle, in degrees, between the vertical and the normals of a top, or of a bottom."""

_SQUARE, _LONG = 1 / 3, 1 / 2
"""A top has sides like a cushion's if the mean of their directions is at least the first, where quarter turns
count as one, and at most the second, where half turns do. A round one has 0, a long strip nearly 1."""

_CHAMFER = 30.0
"""Degrees: an edge between two faces is sharp if it bends by this much."""

_SHARP = 0.8
"""Least share of its border at which a flat face ends sharply."""

_ROUNDING = 1e-6
"""Tolerance of cosines: an edge that bends by exactly the limit is sharp."""


@dataclass(frozen=True, eq=False)
class FaceBorder:
    """Edges of faces' triangles that have a triangle outside the face, or none, on the other side.

    Attributes
    ----------
    triangle, edge
        (B,) the triangle, and the number of its edge.
    face
        (B,) the number of the triangle's face.
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
    def of(cls, mesh: TriangleMesh, face: IntArray) -> "FaceBorder":
        """Return the edges around faces; `face` (T,) holds each triangle's face number, −1 for none."""
        beyond = np.where(mesh.neighbours >= 0, face[mesh.neighbours // 3], -1)
        triangle, edge = np.nonzero((face[:, None] >= 0) & (beyond != face[:, None]))
        line = mesh.corners[triangle, (edge + 1) % 3] - mesh.corners[triangle, edge]
        return cls(triangle, edge, face[triangle], line, _lengths(line))


def flat_faces(mesh: TriangleMesh, frames: PlaneFrames, *, tops: bool = False) -> IntArray:
    """Return the number of the flat face to which each triangle belongs, (T,), −1 for none.

    A face's normals are within 2° of their mean. Most of its border is sharp: the surface ends there, or
    turns by 60° or more within the face's width (area over half its border). Next to another face, as at a
    chamfer, 30° are enough. With `tops`, domed tops and bottoms with four sides are faces, too, like
    a cushion's: their normals are within 20° of the vertical.
    """
    number = np.full(len(mesh.triangles), -1, np.int32)
    bend = np.einsum("ti,tki->tk", frames.normals, frames.normals[mesh.neighbours // 3])
    count = 0
    for link in (*_LINKS, None) if tops else _LINKS:
        if link is None:
            face, planes = _tops(mesh, frames, number)
        else:
            linked = (mesh.neighbours >= 0) & (bend >= np.cos(np.radians(link)))
            face, planes = _level_pieces(mesh, frames, number, linked)
        border = FaceBorder.of(mesh, face)
        around = np.bincount(border.face, border.length, len(planes))
        areas = np.bincount(face[face >= 0], frames.areas[face >= 0], len(planes))
        width = np.divide(2 * areas, around, out=np.zeros(len(planes)), where=around > 0)
        sharp = _is_sharp(mesh, frames, border, planes, width)
        sharp |= _at_faces(mesh, bend, border, number)
        bounded = np.bincount(border.face, border.length * sharp, len(planes)) >= _SHARP * around
        # Two triangles with the same edges have no border, neither have triangles that are points.
        bounded &= around > 0
        kept = np.where(bounded, count + np.cumsum(bounded) - 1, -1)
        number = np.where(face >= 0, np.append(kept, -1)[face], number).astype(np.int32)
        count += int(bounded.sum())
    return number


def mean_planes(frames: PlaneFrames, face: IntArray) -> FloatArray:
    """Return unit normals of faces (F, 3), the means of their triangles' normals."""
    inside = face >= 0
    count = int(face.max(initial=-1)) + 1
    weighted = frames.areas[inside, None] * frames.normals[inside]
    total: FloatArray = np.stack([np.bincount(face[inside], part, count) for part in weighted.T], axis=1)
    return np.asarray(total / np.maximum(_lengths(total), 1e-300)[:, None])


def _level_pieces(
    mesh: TriangleMesh, frames: PlaneFrames, taken: IntArray, linked: NDArray[np.bool_]
) -> tuple[IntArray, FloatArray]:
    """Return the flat pieces (T,) among triangles that are not taken, −1 elsewhere, and their normals.

    Triangles of a piece are connected over `linked` edges, (T, 3).
    """
    normals, beyond = frames.normals, mesh.neighbours // 3
    free = taken < 0
    linked = linked & free[:, None] & free[beyond]
    piece = np.empty(len(normals), np.int32)
    count = regions(np.where(linked, beyond, -1).astype(np.int32), piece)
    planes = mean_planes(frames, piece)
    off = np.einsum("ij,ij->i", normals, planes[piece]) < np.cos(np.radians(_FLAT))
    bent = np.bincount(piece, off | ~free, count) > 0
    kept = np.where(bent, -1, np.cumsum(~bent) - 1)
    return kept[piece].astype(np.int32), planes[~bent]


def _tops(mesh: TriangleMesh, frames: PlaneFrames, taken: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the tops and bottoms (T,) among triangles not yet taken, −1 elsewhere, and their normals."""
    upright, beyond = frames.normals[:, 2], mesh.neighbours // 3
    free = (taken < 0) & (np.abs(upright) >= np.cos(np.radians(_TOP)))
    linked = (mesh.neighbours >= 0) & free[:, None] & free[beyond] & (upright[:, None] * upright[beyond] > 0)
    piece = np.empty(len(upright), np.int32)
    count = regions(np.where(linked, beyond, -1).astype(np.int32), piece)
    kept = np.bincount(piece, free, count) > 0
    border = FaceBorder.of(mesh, np.where(kept[piece], piece, -1).astype(np.int32))
    kept &= _has_four_sides(frames.normals, border, count)
    face = np.where(kept, np.cumsum(kept) - 1, -1)[piece].astype(np.int32)
    return face, mean_planes(frames, face)


def _has_four_sides(normals: FloatArray, border: FaceBorder, count: int) -> NDArray[np.bool_]:
    """Return which of `count` faces slope to four sides: see `_SQUARE`."""
    out = normals[border.triangle, 0] + 1j * normals[border.triangle, 1]
    out /= np.maximum(np.abs(out), 1e-300)
    around = np.maximum(np.bincount(border.face, border.length, count), 1e-300)

    def mean(turned: ComplexArray) -> FloatArray:
        parts = (np.bincount(border.face, border.length * part, count) for part in (turned.real, turned.imag))
        found: FloatArray = np.hypot(*parts) / around
        return found

    return (mean(out**4) >= _SQUARE) & (mean(out**2) <= _LONG)


def _at_faces(
    mesh: TriangleMesh, bend: FloatArray, border: FaceBorder, number: IntArray
) -> NDArray[np.bool_]:
    """Return which edges (B,) bend sharply, by cosines (T, 3), to a face that has a `number` (T,) already."""
    met = mesh.neighbours[border.triangle, border.edge]
    bent: NDArray[np.bool_] = bend[border.triangle, border.edge] <= np.cos(np.radians(_CHAMFER)) + _ROUNDING
    return bent & (met >= 0) & (number[met // 3] >= 0)


def _is_sharp(
    mesh: TriangleMesh, frames: PlaneFrames, border: FaceBorder, planes: FloatArray, width: FloatArray
) -> NDArray[np.bool_]:
    """Return the edges of a border (B,) at which a face ends sharply: see `flat_faces`."""
    sharp = np.empty(len(border.face), np.bool_)
    edges = np.stack([border.triangle, border.edge, border.face], axis=1).astype(np.int64)
    facets = Facets(mesh.positions, mesh.triangles, mesh.neighbours, frames.normals)
    least = np.cos(np.radians(SMOOTH)) + _ROUNDING
    mark_sharp(facets, edges, planes, width, least, np.empty((5, 3)), sharp)
    return sharp


def _lengths(vectors: FloatArray) -> FloatArray:
    found: FloatArray = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    return found
