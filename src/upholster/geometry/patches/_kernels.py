"""Hot loops of patch evaluation. The net is contracted row by row, so a grid point costs n + 1 products."""

import numpy as np

from upholster.base.types import FloatArray
from upholster.runtime.jit import allocating_kernel, inline

TILE = 256  # columns per block: the sums stay in the L1 cache


@allocating_kernel
def grid_points(net: FloatArray, bs: FloatArray, bt: FloatArray, points: FloatArray) -> None:
    """Evaluate the points of a patch on a grid.

    ``net`` (m+1, n+1, 4), ``bs`` (S, m+1) and ``bt`` (n+1, T) Bernstein values, ``points`` (S, T, 3) out.
    """
    mp, np1, _ = net.shape
    columns = bt.shape[1]
    row = np.empty((np1, 4))
    x, y, z, w = np.empty(TILE), np.empty(TILE), np.empty(TILE), np.empty(TILE)
    for r in range(bs.shape[0]):
        for j in range(np1):
            for c in range(4):
                total = 0.0
                for i in range(mp):
                    total += bs[r, i] * net[i, j, c]
                row[j, c] = total
        for first in range(0, columns, TILE):
            width = min(TILE, columns - first)
            x[:], y[:], z[:], w[:] = 0.0, 0.0, 0.0, 0.0
            for j in range(np1):
                rx, ry, rz, rw = row[j, 0], row[j, 1], row[j, 2], row[j, 3]
                for k in range(width):
                    b = bt[j, first + k]
                    x[k] += rx * b
                    y[k] += ry * b
                    z[k] += rz * b
                    w[k] += rw * b
            for k in range(width):
                scale = 1.0 / w[k]
                points[r, first + k, 0] = x[k] * scale
                points[r, first + k, 1] = y[k] * scale
                points[r, first + k, 2] = z[k] * scale


@inline
def _basis(t: float, values: FloatArray, slopes: FloatArray) -> None:
    """Fill the Bernstein polynomials at t and their derivatives, both (degree + 1,)."""
    degree = len(values) - 1
    rest = 1.0 - t
    values[0] = 1.0
    for d in range(1, degree):
        values[d] = t * values[d - 1]
        for j in range(d - 1, 0, -1):
            values[j] = rest * values[j] + t * values[j - 1]
        values[0] *= rest
    # values now holds degree - 1, whose differences are the derivatives
    slopes[0] = -degree * values[0]
    for j in range(1, degree):
        slopes[j] = degree * (values[j - 1] - values[j])
    slopes[degree] = degree * values[degree - 1]
    values[degree] = t * values[degree - 1]
    for j in range(degree - 1, 0, -1):
        values[j] = rest * values[j] + t * values[j - 1]
    values[0] *= rest


@allocating_kernel
def evaluate(net: FloatArray, s: FloatArray, t: FloatArray, grid: bool, out: FloatArray) -> None:
    """Evaluate points and first derivatives of one patch, by the quotient rule.

    ``net`` (m+1, n+1, 4); on a grid ``s`` (S,), ``t`` (T,), ``out`` (S, T, 3, 3); scattered ``s`` and ``t``
    (N,), ``out`` (N, 1, 3, 3). The last two axes of ``out``: [point, derivative by s, by t] by [x, y, z].
    """
    mp, np1, _ = net.shape
    bs, ds, bt, dt = np.empty(mp), np.empty(mp), np.empty(np1), np.empty(np1)
    row, row_s = np.empty((np1, 4)), np.empty((np1, 4))
    h, hs, ht = np.empty(4), np.empty(4), np.empty(4)
    table, slope = np.empty((0, 0)), np.empty((0, 0))
    columns = 1
    if grid:
        columns = len(t)
        table, slope = np.empty((columns, np1)), np.empty((columns, np1))
        for k in range(columns):
            _basis(t[k], table[k], slope[k])
    for r in range(len(s)):
        _basis(s[r], bs, ds)
        for j in range(np1):
            for c in range(4):
                total, total_s = 0.0, 0.0
                for i in range(mp):
                    total += bs[i] * net[i, j, c]
                    total_s += ds[i] * net[i, j, c]
                row[j, c] = total
                row_s[j, c] = total_s
        for k in range(columns):
            if grid:
                b, d = table[k], slope[k]
            else:
                _basis(t[r], bt, dt)
                b, d = bt, dt
            h[:], hs[:], ht[:] = 0.0, 0.0, 0.0
            for j in range(np1):
                for c in range(4):
                    h[c] += b[j] * row[j, c]
                    hs[c] += b[j] * row_s[j, c]
                    ht[c] += d[j] * row[j, c]
            scale = 1.0 / h[3]
            for c in range(3):
                value = h[c] * scale
                out[r, k, 0, c] = value
                out[r, k, 1, c] = (hs[c] - value * hs[3]) * scale
                out[r, k, 2, c] = (ht[c] - value * ht[3]) * scale
