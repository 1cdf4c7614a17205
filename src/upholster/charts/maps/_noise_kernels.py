"""Hot loop of smooth noise in space."""

import numpy as np

from upholster.base.types import FloatArray, int64
from upholster.runtime.jit import inline, kernel

__all__ = ["GRADIENTS", "add_noise"]

GRADIENTS = np.array(
    [
        *((0, y, z) for y in (1, -1) for z in (1, -1)),
        *((x, 0, z) for x in (1, -1) for z in (1, -1)),
        *((x, y, 0) for x in (1, -1) for y in (1, -1)),
        *((1, 1, 0), (-1, 1, 0), (0, -1, 1), (0, -1, -1)),
    ],
    np.float64,
)
"""(16, 3): vectors to the middles of a cube's edges, four of them twice."""


@inline
def _hashed(x: int, y: int, z: int) -> int:
    # Hash to 0 … 15, for integers from 0 to 2²⁴: products stay within 64 bits.
    h = (x * 73856093) ^ (y * 19349663) ^ (z * 83492791)
    h = ((h ^ (h >> 15)) & 0x7FFFFFFF) * 668265263
    h = ((h ^ (h >> 17)) & 0x7FFFFFFF) * 374761393
    return (h >> 20) & 15


@inline
def _faded(t: float) -> float:
    return t * t * t * (t * (t * 6.0 - 15.0) + 10.0)


@kernel
def add_noise(points: FloatArray, period: tuple[int, int, int], weight: float, out: FloatArray) -> None:
    """Add `weight` times gradient noise at points (n, 3) to `out` (n,).

    It is 0 where all coordinates are integers. With a period (d, s, e) it is the same at (x + d, y, z) and at
    (x + s, y + e, z), for any coordinates. With (0, 0, 0), coordinates must be 0 to 2²⁴.
    """
    d, s, e = period
    for n in range(points.shape[0]):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        i, j, k = int64(np.floor(x)), int64(np.floor(y)), int64(np.floor(z))
        x, y, z = x - i, y - j, z - k
        total = 0.0
        for corner in range(8):
            a, b, c = corner & 1, corner >> 1 & 1, corner >> 2
            p, q, r = i + a, j + b, k + c
            if d > 0:
                turns = q // e
                p, q = (p - turns * s) % d, q - turns * e
            h = _hashed(p, q, r)
            slope = GRADIENTS[h, 0] * (x - a) + GRADIENTS[h, 1] * (y - b) + GRADIENTS[h, 2] * (z - c)
            u = _faded(x) if a else 1.0 - _faded(x)
            v = _faded(y) if b else 1.0 - _faded(y)
            w = _faded(z) if c else 1.0 - _faded(z)
            total += u * v * w * slope
        out[n] += weight * total
