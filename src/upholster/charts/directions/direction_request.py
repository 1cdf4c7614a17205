"""The direction asked for on each triangle of a mesh."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import ComplexArray, FloatArray
from upholster.charts.directions.direction import Direction, TriangleVectors
from upholster.charts.directions.field_solution import spread_evenly
from upholster.charts.directions.frames import PlaneFrames, power
from upholster.charts.directions.level_directions import (
    laid_over,
    requested_at_corners,
    shading_normals,
    vectors_at,
)
from upholster.geometry.meshes.triangle_mesh import TriangleMesh

__all__ = ["BY_WORD", "DirectionRequest", "direction_request", "level_confidence", "prior_of"]

SHARP = 30.0
"""Degrees above which an edge is sharp for the direction ``edges``, unless a crease angle is given."""

_VECTOR = (0.02, 0.2)
"""Sines of the angle between a vector and the normal: up to the first ignored, from the second followed
closely."""

_LEVEL = (0.03, 0.3)
"""The same for slopes, for the direction ``level``: nearly flat parts are better filled smoothly."""

_BENT = (0.3, 3.0)
"""The same for the difference of the principal curvatures times the model's size."""

_CURVED_OVER = 0.01
"""Length, as a share of the model's size, over which curvature is averaged."""


@dataclass(frozen=True, slots=True)
class DirectionRequest:
    """The direction asked for on each triangle.

    Attributes
    ----------
    power
        (T,) complex: directions to the power of `fold`, of size 1 where `confidence` is above 0.
    confidence
        (T,) 0 to 1.
    fold
        1, 2 or 4: opposite directions, or those at right angles too, count as one.
    least
        A region follows its requests if they cover at least this share of its area: on a flat side, a few bad
        triangles may have requests by accident.
    corners
        (T, 3, 3) the directions asked for at the triangles' corners, in their planes; lengths are
        confidences. None where directions are known only for triangles.
    drawn
        (T,) where a stroke sets it; None without strokes.
    """

    power: ComplexArray
    confidence: FloatArray
    fold: int = 1
    least: float = 1e-3
    corners: FloatArray | None = None
    drawn: NDArray[np.bool_] | None = None


def direction_request(
    mesh: TriangleMesh, frames: PlaneFrames, direction: Direction, crease: float | None
) -> DirectionRequest:
    """Return the directions asked for on each triangle.

    Raises
    ------
    InputError
        If vectors are not finite, have another shape, or are nowhere along the surface.
    """
    if direction.kind in BY_WORD:
        return BY_WORD[direction.kind](mesh, frames, direction, crease)
    shaded = shading_normals(mesh, crease)
    normals = _mean_normals(frames, shaded)
    vectors = vectors_at(mesh, direction.vectors)
    lying = vectors - np.einsum("ij,ij->i", vectors, normals)[:, None] * normals
    whole = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    strength = np.minimum(whole, 1.0) if direction.weighted else 1.0
    request = _projected(frames, laid_over(lying, normals, frames.normals), whole, _VECTOR)
    request = replace(request, confidence=request.confidence * strength)
    if not request.confidence.any():
        raise InputError(
            f"direction {direction.text!r} is nowhere along the surface; allowed: one that is somewhere"
        )
    if isinstance(direction.vectors, TriangleVectors):
        return request
    return replace(request, corners=_corners(mesh, direction, shaded, _VECTOR))


def _corners(
    mesh: TriangleMesh, direction: Direction, shaded: FloatArray, limits: tuple[float, float]
) -> FloatArray:
    asked = requested_at_corners(mesh, direction, normals=shaded)
    assert asked is not None
    if direction.weighted:  # in the triangles' planes, lengths are weights
        return asked
    length = np.sqrt(np.einsum("tki,tki->tk", asked, asked))[..., None]
    corners: FloatArray = asked * (_stepped(length, *limits) / np.maximum(length, 1e-300))
    return corners


def _mean_normals(frames: PlaneFrames, shaded: FloatArray) -> FloatArray:
    """Return the triangles' unit normals (T, 3) on the smooth surface, from their corners' (T, 3, 3)."""
    normals = shaded.mean(axis=1)
    length = np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, None]
    near = length[:, 0] * 0.5 < np.einsum("ij,ij->i", normals, frames.normals)
    return np.where(near[:, None], normals / np.where(length > 0, length, 1.0), frames.normals)


def _level(
    mesh: TriangleMesh, frames: PlaneFrames, direction: Direction, crease: float | None
) -> DirectionRequest:
    shaded = shading_normals(mesh, crease)
    normals = _mean_normals(frames, shaded)
    level = laid_over(np.cross((0.0, 0.0, 1.0), normals), normals, frames.normals)
    request = _projected(frames, level, 1.0, _LEVEL)
    return replace(request, corners=_corners(mesh, direction, shaded, _LEVEL))


def _nowhere(mesh: TriangleMesh, *_: object) -> DirectionRequest:
    count = len(mesh.triangles)
    return DirectionRequest(np.zeros(count, np.complex128), np.zeros(count))


def _along_curvature(mesh: TriangleMesh, frames: PlaneFrames, *_: object) -> DirectionRequest:
    """Return the directions of greatest curvature, with outward curvature positive.

    Each triangle's shape operator is the derivative of its vertices' normals over it. Half the difference of
    its eigenvalues, turned by twice the first one's angle, is a field of fold 2 and is averaged as such.

    References
    ----------
    S. Rusinkiewicz: Estimating curvatures and their derivatives on triangle meshes, 3DPVT 2004; F. Knöppel et
    al., 2013, section 3.3.
    """
    normals = frames.mean_normals(mesh.triangles, len(mesh.positions))[mesh.triangles]
    points = [frames.numbers(mesh.corners[:, k] - mesh.corners[:, 0]) for k in (1, 2)]
    bends = [frames.numbers(normals[:, k] - normals[:, 0]) for k in (1, 2)]
    (p, q), (m, n) = points, bends
    area = np.maximum(p.real * q.imag - p.imag * q.real, 1e-9 * frames.areas)
    # n(x, y) is linear: its derivatives by x and by y, as complex numbers.
    by_x, by_y = (m * q.imag - n * p.imag) / area, (n * p.real - m * q.real) / area
    twice = 0.5 * (by_x.real - by_y.imag) + 0.5j * (by_x.imag + by_y.real)
    length = np.sqrt(twice.real**2 + twice.imag**2)
    most = 2.0 / np.sqrt(frames.areas)  # a triangle cannot be bent more than a small ball
    twice = twice * (most / np.maximum(length, most))
    twice = spread_evenly(frames, twice, 2, _CURVED_OVER * mesh.size)
    length = np.sqrt(twice.real**2 + twice.imag**2)
    unit = np.where(length > 0, twice / np.where(length > 0, length, 1.0), 1.0)
    return DirectionRequest(unit, _stepped(2 * length * mesh.size, *_BENT), 2)


def _along_edges(
    mesh: TriangleMesh, frames: PlaneFrames, _direction: Direction, crease: float | None
) -> DirectionRequest:
    """Return the directions of sharp edges and borders, in the adjacent triangles.

    An edge's weight is its length relative to its triangle: a small hole does not turn a large triangle.
    """
    sharp = SHARP if crease is None else crease
    bend = np.einsum("ti,tki->tk", frames.normals, frames.normals[mesh.neighbours // 3])
    is_sharp = (mesh.neighbours < 0) | (bend < np.cos(np.radians(sharp)))
    lengths = np.linalg.norm(np.roll(mesh.corners, -1, axis=1) - mesh.corners, axis=2)
    share = (lengths / np.maximum(lengths.max(axis=1), 1e-300)[:, None]) ** 2
    total = (np.where(is_sharp, share, 0.0) * power(frames.along, 4)).sum(axis=1)
    length = np.sqrt(total.real**2 + total.imag**2)
    unit = np.where(length > 0, total / np.where(length > 0, length, 1.0), 1.0)
    return DirectionRequest(unit, np.minimum(2 * length, 1.0), 4)


def level_confidence(upright: FloatArray) -> FloatArray:
    """Return the confidence of ``level``, 0 to 1, for unit normals with these upward components."""
    return _stepped(np.sqrt(np.maximum(1.0 - upright * upright, 0.0)), *_LEVEL)


def prior_of(frames: PlaneFrames) -> ComplexArray:
    """Return the default (T,) where nothing else decides: level, or along x on flat ground."""
    return frames.numbers(np.cross((0.0, 0.0, 1.0), frames.normals) + np.array([0.1, 0.01, 0.0]))


def _projected(
    frames: PlaneFrames, vectors: FloatArray, whole: FloatArray | float, limits: tuple[float, float]
) -> DirectionRequest:
    """Return vectors (T, 3) in the triangles' planes, confident by the share left of their length `whole`."""
    z = frames.numbers(vectors)
    length = np.sqrt(z.real**2 + z.imag**2)
    some = length > 0
    share = np.where(some, length, 0.0) / np.where(some, whole, 1.0)
    return DirectionRequest(z / np.where(some, length, 1.0), _stepped(share, *limits))


def _stepped(x: FloatArray, low: float, high: float) -> FloatArray:
    """Return 0 up to `low`, 1 from `high` on, and a smooth transition in between."""
    step = np.clip((x - low) / (high - low), 0, 1)
    stepped: FloatArray = step * step * (3 - 2 * step)
    return stepped


BY_WORD: dict[str, Callable[[TriangleMesh, PlaneFrames, Direction, float | None], DirectionRequest]] = {
    "level": _level,
    "smooth": _nowhere,
    "curvature": _along_curvature,
    "edges": _along_edges,
}
"""What a mesh's triangles ask for, by the words that all surfaces have: see `DIRECTIONS`."""
