"""Lines along a field of directions, triangle by triangle."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.runtime.jit import inline, kernel

__all__ = ["DrawnField", "trace_lines"]


class DrawnField(NamedTuple):
    """A field on a mesh: corners (T, 3, 3), neighbours across edges, unit tangents (T, 3), their jumps."""

    corners: FloatArray
    neighbours: IntArray
    vectors: FloatArray
    jumps: NDArray[np.int8]


@kernel
def trace_lines(
    field: DrawnField,
    seeds: IntArray,
    starts: FloatArray,
    turns: IntArray,
    length: float,
    lines: FloatArray,
    counts: IntArray,
) -> None:
    """Follow the field from each start for a length, or until a border, a crease or the end of the array.

    `seeds` (N,) are triangles and `starts` (N, 3) points in them; `turns` (N,) are quarter turns from the
    vectors to the direction to follow. `lines` (N, room, 3) gets the points, `counts` (N,) their number.
    """
    for n in range(len(seeds)):
        t, turn, rest, came = seeds[n], turns[n], length, -1
        for axis in range(3):
            lines[n, 0, axis] = starts[n, axis]
        counts[n] = 1
        while counts[n] < lines.shape[1] and rest > 0:
            at = lines[n, counts[n] - 1]
            vx, vy, vz = _turned(field.corners, field.vectors, t, turn)
            edge, far = _way_out(field.corners, t, at, (vx, vy, vz), came)
            if edge < 0:
                break
            step = min(far, rest)
            lines[n, counts[n], 0] = at[0] + step * vx
            lines[n, counts[n], 1] = at[1] + step * vy
            lines[n, counts[n], 2] = at[2] + step * vz
            counts[n] += 1
            rest -= step
            met = field.neighbours[t, edge]
            if met < 0:
                break
            # If the vectors turn across the edge, the line turns back by the same amount to go straight.
            turn = (turn - field.jumps[t, edge]) % 4
            t, came = met // 3, met % 3


@inline
def _turned(corners: FloatArray, vectors: FloatArray, t: int, turn: int) -> tuple[float, float, float]:
    """Return a triangle's vector, turned counter-clockwise by quarter turns."""
    x, y, z = vectors[t, 0], vectors[t, 1], vectors[t, 2]
    if turn % 2:
        ax, ay, az = (
            corners[t, 1, 0] - corners[t, 0, 0],
            corners[t, 1, 1] - corners[t, 0, 1],
            corners[t, 1, 2] - corners[t, 0, 2],
        )
        bx, by, bz = (
            corners[t, 2, 0] - corners[t, 0, 0],
            corners[t, 2, 1] - corners[t, 0, 1],
            corners[t, 2, 2] - corners[t, 0, 2],
        )
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        size = max(np.sqrt(nx * nx + ny * ny + nz * nz), 1e-300)
        nx, ny, nz = nx / size, ny / size, nz / size
        x, y, z = ny * z - nz * y, nz * x - nx * z, nx * y - ny * x
    return (x, y, z) if turn < 2 else (-x, -y, -z)


@inline
def _way_out(
    corners: FloatArray, t: int, at: FloatArray, way: tuple[float, float, float], came: int
) -> tuple[int, float]:
    """Return the edge through which a line leaves a triangle, and the distance to it; −1 if it does not."""
    best, far = -1, 1e300
    for edge in range(3):
        if edge == came:
            continue
        a, b, c = edge, (edge + 1) % 3, (edge + 2) % 3
        # At right angles to the edge within the plane, away from the opposite corner.
        ee, eo = 0.0, 0.0
        for axis in range(3):
            e = corners[t, b, axis] - corners[t, a, axis]
            ee += e * e
            eo += e * (corners[t, c, axis] - corners[t, a, axis])
        if ee <= 0:
            continue
        rate, gap = 0.0, 0.0
        for axis in range(3):
            e = corners[t, b, axis] - corners[t, a, axis]
            out = eo / ee * e - (corners[t, c, axis] - corners[t, a, axis])
            rate += out * way[axis]
            gap += out * (corners[t, a, axis] - at[axis])
        if rate > 0:
            reach = max(gap / rate, 0.0)
            if reach < far:
                best, far = edge, reach
    return best, far
