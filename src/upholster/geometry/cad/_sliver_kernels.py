"""Loops over a face's flat triangles: flipping their longest edges, or removing vertices."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.runtime.jit import inline, kernel

__all__ = ["MOST_ROUND", "Corners", "flip_slivers", "remove_slivers"]

MOST_ROUND = 64
"""Greatest number of triangles around a vertex that is removed."""

_BETTER = 1.5
"""Factor by which the height of the lower of two triangles must increase."""

_SURE = 0.01
"""The normals of flatter triangles are not reliable."""

_LEAST_COSINE = 0.3
"""Least cosine between a triangle's normal and the face's normals at its corners."""


class Corners(NamedTuple):
    """A face's vertices: positions (n, 3), the face's unit normals there (n, 3), their parameters (n, 2)."""

    positions: FloatArray
    normals: FloatArray
    uv: FloatArray


@inline
def _length(p: FloatArray, a: int, b: int) -> float:
    x, y, z = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
    return float(np.sqrt(x * x + y * y + z * z))


@inline
def _normal(p: FloatArray, a: int, b: int, c: int) -> tuple[float, float, float]:
    ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
    vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@inline
def _quality(p: FloatArray, a: int, b: int, c: int) -> float:
    # Height over longest edge.
    x, y, z = _normal(p, a, b, c)
    longest = max(_length(p, a, b), _length(p, b, c), _length(p, c, a))
    return float(np.sqrt(x * x + y * y + z * z)) / max(longest * longest, 1e-300)


@inline
def _turned(uv: FloatArray, a: int, b: int, c: int) -> float:
    first = (uv[b, 0] - uv[a, 0]) * (uv[c, 1] - uv[a, 1])
    return float(first - (uv[c, 0] - uv[a, 0]) * (uv[b, 1] - uv[a, 1]))


@inline
def _faces_right(p: FloatArray, normals: FloatArray, a: int, b: int, c: int) -> bool:
    x, y, z = _normal(p, a, b, c)
    size = float(np.sqrt(x * x + y * y + z * z))
    for corner in (a, b, c):
        n = normals[corner]
        if not n[0] * x + n[1] * y + n[2] * z > _LEAST_COSINE * size:
            return False
    return True


@inline
def _apart(p: FloatArray, a: int, b: int, c: int, d: int) -> float:
    # The distance at which the lines a–b and c–d pass each other.
    ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
    vx, vy, vz = p[d, 0] - p[c, 0], p[d, 1] - p[c, 1], p[d, 2] - p[c, 2]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = float(np.sqrt(x * x + y * y + z * z))
    wx, wy, wz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
    return float(abs(wx * x + wy * y + wz * z)) / max(size, 1e-300)


@kernel
def flip_slivers(
    corners: Corners,
    triangles: IntArray,
    neighbours: IntArray,
    least: float,
    deviation: float,
    changed: NDArray[np.bool_],
) -> int:
    """Flip the longest edges of flat triangles, in one pass; return how many were flipped.

    Parameters
    ----------
    corners
        The face's vertices.
    triangles, neighbours
        (t, 3), which is changed, and as in `TriangleMesh.neighbours`, which is not.
    least
        Triangles whose height over longest edge is less than this are flat.
    deviation
        Greatest distance between an edge and the edge that it replaces.
    changed
        (t,): triangles that no longer match `neighbours`; they are left as they are.
    """
    positions, normals, uv = corners
    turned = 0
    for t in range(len(triangles)):
        k, longest = 0, 0.0
        for edge in range(3):
            length = _length(positions, triangles[t, edge], triangles[t, (edge + 1) % 3])
            if length > longest:
                k, longest = edge, length
        across = neighbours[t, k]
        if across < 0 or changed[t] or changed[across // 3]:
            continue
        a, b, c = triangles[t, k], triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
        d = triangles[across // 3, (across % 3 + 2) % 3]
        here = _quality(positions, a, b, c)
        if here >= least or c == d:
            continue
        before = min(here, _quality(positions, b, a, d))
        after = min(_quality(positions, c, a, d), _quality(positions, d, b, c))
        if after < _BETTER * before or _apart(positions, a, b, c, d) > deviation:
            continue
        sign = _turned(uv, a, b, c) + _turned(uv, b, a, d)
        if _turned(uv, c, a, d) * sign <= 0.0 or _turned(uv, d, b, c) * sign <= 0.0:
            continue
        if not (_faces_right(positions, normals, c, a, d) and _faces_right(positions, normals, d, b, c)):
            continue
        _write(triangles, changed, t, c, a, d)
        _write(triangles, changed, across // 3, d, b, c)
        turned += 1
    return turned


@inline
def _write(triangles: IntArray, changed: NDArray[np.bool_], t: int, a: int, b: int, c: int) -> None:
    triangles[t, 0], triangles[t, 1], triangles[t, 2], changed[t] = a, b, c, True


@inline
def _walk_round(
    triangles: IntArray, neighbours: IntArray, changed: NDArray[np.bool_], t: int, k: int, ring: IntArray
) -> Any:
    # Lists the triangles around corner k of t in `ring[0]`, and the vertices at their next corners, a
    # polygon, in `ring[1]`; returns their number, 0 if they do not close.
    count, at, corner = int64(0), int64(t), int64(k)
    while count < MOST_ROUND and not changed[at]:
        ring[0, count] = at
        ring[1, count] = triangles[at, (corner + 2) % 3]
        count += 1
        across = int64(neighbours[at, (corner + 2) % 3])  # the edge that ends at the corner
        if across < 0:
            break
        at, corner = across // 3, across % 3
        if at == t:
            return count
    return int64(0)


@inline
def _is_ear(uv: FloatArray, ring: IntArray, count: int, n: int, sign: float) -> bool:
    # Whether a corner of a polygon can be cut off: it is convex, and contains no other corner.
    a, b, c = ring[2, (n + count - 1) % count], ring[2, n], ring[2, (n + 1) % count]
    if sign * _turned(uv, a, b, c) <= 0.0:
        return False
    for m in range(count):
        v = ring[2, m]
        if v in (a, b, c):
            continue
        if (
            sign * _turned(uv, a, b, v) >= 0.0
            and sign * _turned(uv, b, c, v) >= 0.0
            and sign * _turned(uv, c, a, v) >= 0.0
        ):
            return False
    return True


@inline
def _misses(positions: FloatArray, uv: FloatArray, v: int, a: int, b: int, c: int) -> float:
    # A vertex's distance from a triangle that contains its parameters; 1e300 if the triangle does not.
    area = _turned(uv, a, b, c)
    if area == 0.0:
        return 1e300
    first, second = _turned(uv, v, b, c) / area, _turned(uv, a, v, c) / area
    third = 1.0 - first - second
    if min(first, second, third) < -1e-9:
        return 1e300
    squared = 0.0
    for axis in range(3):
        there = first * positions[a, axis] + second * positions[b, axis] + third * positions[c, axis]
        squared += (there - positions[v, axis]) ** 2
    return float(np.sqrt(squared))


@inline
def _fill(
    positions: FloatArray,
    normals: FloatArray,
    uv: FloatArray,
    ring: IntArray,
    count: int,
    gone: int,
    sign: float,
    least: float,
    deviation: float,
) -> float:
    # Fills the polygon of `ring[1]` with ears, the best ones first, into `ring[3:6]`; returns how flat these
    # triangles are in total, 1e300 if it cannot be done.
    flat, away, left, made = 0.0, 1e300, int64(count), int64(0)
    for n in range(count):
        ring[2, n] = ring[1, n]
    while left > 2:
        best, ear = -1.0, int64(-1)
        for n in range(left):
            a, b, c = ring[2, (n + left - 1) % left], ring[2, n], ring[2, (n + 1) % left]
            quality = _quality(positions, a, b, c)
            if quality > best and _is_ear(uv, ring, left, n, sign):
                best, ear = quality, int64(n)
        if ear < 0:
            return 1e300
        a, b, c = ring[2, (ear + left - 1) % left], ring[2, ear], ring[2, (ear + 1) % left]
        if best > _SURE and not _faces_right(positions, normals, a, b, c):
            return 1e300
        away = min(away, _misses(positions, uv, gone, a, b, c))
        flat += max(0.0, least - best)
        ring[3, made], ring[4, made], ring[5, made] = a, b, c
        made += 1
        for n in range(ear, left - 1):
            ring[2, n] = ring[2, n + 1]
        left -= 1
    return flat if away <= deviation else 1e300


@kernel
def remove_slivers(
    corners: Corners,
    triangles: IntArray,
    neighbours: IntArray,
    least: float,
    deviation: float,
    changed: NDArray[np.bool_],
    ring: IntArray,
) -> int:
    """Remove vertices of flat triangles inside a face, in one pass; return how many were removed.

    Parameters
    ----------
    corners, triangles, neighbours, least, changed
        As for `flip_slivers`; the corners of removed triangles become −1.
    deviation
        Greatest distance of a vertex from the triangles that replace it.
    ring
        (6, `MOST_ROUND`) scratch space.
    """
    positions, normals, uv = corners
    taken = 0
    for t in range(len(triangles)):
        if changed[t] or _quality(positions, triangles[t, 0], triangles[t, 1], triangles[t, 2]) >= least:
            continue
        for k in range(3):
            gone = triangles[t, k]
            count = _walk_round(triangles, neighbours, changed, t, k, ring)
            if count < 3:
                continue
            before, sign = 0.0, 0.0
            for n in range(count):
                b, c = ring[1, n], ring[1, (n + 1) % count]
                before += max(0.0, least - _quality(positions, gone, b, c))
                sign += _turned(uv, gone, b, c)
            sign = 1.0 if sign > 0.0 else -1.0
            if _fill(positions, normals, uv, ring, count, gone, sign, least, deviation) >= before:
                continue
            for n in range(count):
                if n < count - 2:
                    _write(triangles, changed, ring[0, n], ring[3, n], ring[4, n], ring[5, n])
                else:
                    _write(triangles, changed, ring[0, n], -1, -1, -1)
            taken += 1
            break
    return taken
