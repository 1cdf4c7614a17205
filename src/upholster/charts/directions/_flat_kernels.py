"""Walking straight across a surface from the borders of its flat faces."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.runtime.jit import inline, kernel

__all__ = ["Facets", "mark_sharp"]

_STEPS = 256
"""Most triangles to cross beyond a border."""


class Facets(NamedTuple):
    """A mesh's triangles: positions (V, 3), `triangles` and `neighbours` (T, 3), unit `normals` (T, 3)."""

    positions: FloatArray
    triangles: IntArray
    neighbours: IntArray
    normals: FloatArray


@inline
def _dot(x: FloatArray, y: FloatArray) -> float:
    product: float = x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
    return product


@inline
def _cross(x: FloatArray, y: FloatArray, out: FloatArray) -> None:
    out[0], out[1] = x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2]
    out[2] = x[0] * y[1] - x[1] * y[0]


@inline
def _enter_edge(mesh: Facets, triangle: int, edge: int, line: FloatArray) -> None:
    # From the start of a triangle's edge to its end.
    a, b = mesh.triangles[triangle, edge], mesh.triangles[triangle, (edge + 1) % 3]
    for k in range(3):
        line[k] = mesh.positions[b, k] - mesh.positions[a, k]


@inline
def _unfold(way: FloatArray, line: FloatArray, normal: FloatArray, room: FloatArray) -> None:
    # Turns a direction about the edge that it crosses, into the plane across it.
    length = max(np.sqrt(_dot(line, line)), 1e-300)
    unit, beyond = room[0], room[1]
    for k in range(3):
        unit[k] = line[k] / length
    along = _dot(way, unit)
    across = np.sqrt(max(1.0 - along * along, 0.0))
    _cross(unit, normal, beyond)
    for k in range(3):
        way[k] = along * unit[k] + across * beyond[k]


@inline
def _leave(
    mesh: Facets, met: int, at: FloatArray, way: FloatArray, left: float, room: FloatArray
) -> tuple[int, float]:
    # The edge over which a straight path leaves the triangle that it entered, and the distance to there.
    triangle, entered = met // 3, met % 3
    best, leaves = np.inf, int64((entered + 1) % 3)
    line, inward = room[0], room[1]
    for turn in range(1, 3):
        edge = (entered + turn) % 3
        _enter_edge(mesh, triangle, edge, line)
        _cross(mesh.normals[triangle], line, inward)
        speed, away = -_dot(way, inward), 0.0
        start = mesh.triangles[triangle, edge]
        for k in range(3):
            away += (at[k] - mesh.positions[start, k]) * inward[k]
        after = max(away, 0.0) / speed if speed > 0.0 else np.inf
        if after < best:
            best, leaves = after, int64(edge)
    return leaves, best if np.isfinite(best) else left


@kernel
def mark_sharp(
    mesh: Facets,
    border: NDArray[np.int64],
    planes: FloatArray,
    width: FloatArray,
    least: float,
    room: FloatArray,
    sharp: NDArray[np.bool_],
) -> None:
    """Mark edges of a border at which a face ends sharply.

    From the middle of each edge, a straight path follows the surface for the face's width. The face ends
    sharply if the surface ends there, or if the cosine between its normal and the face's falls to `least` or
    less. `border` (B, 3) are triangle, edge and face; `planes` (F, 3) are the faces' normals, `width` (F,)
    their widths. `room` (5, 3) is scratch space.
    """
    at, way, line, rest = room[0], room[1], room[2], room[3:]
    for n in range(border.shape[0]):
        triangle, edge, face = border[n, 0], border[n, 1], border[n, 2]
        _enter_edge(mesh, triangle, edge, line)
        _cross(line, mesh.normals[triangle], way)
        length = max(np.sqrt(_dot(way, way)), 1e-300)
        for k in range(3):
            way[k] /= length
            at[k] = mesh.positions[mesh.triangles[triangle, edge], k] + 0.5 * line[k]
        left, met = width[face], int64(mesh.neighbours[triangle, edge])
        sharp[n] = False
        for _ in range(_STEPS):
            if met < 0 or _dot(mesh.normals[met // 3], planes[face]) <= least:
                sharp[n] = True
                break
            _unfold(way, line, mesh.normals[met // 3], rest)
            leaves, step = _leave(mesh, met, at, way, left, rest)
            triangle = met // 3
            _enter_edge(mesh, triangle, leaves, line)
            met = int64(mesh.neighbours[triangle, leaves])
            left -= step
            if not left > 0.0:
                break
            for k in range(3):
                at[k] += step * way[k]
