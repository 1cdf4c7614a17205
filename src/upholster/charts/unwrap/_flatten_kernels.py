"""Hot loops of flattening: as rigid as possible, then flipping inverted triangles back one by one."""

import numpy as np

from upholster.base.types import FloatArray, IntArray
from upholster.runtime.jit import allocating_kernel, inline, kernel


@kernel
def rest_shapes(corners: FloatArray, least: float, shapes: FloatArray) -> None:
    """Place each triangle in the plane separately.

    ``corners`` (T, 3, 3). ``shapes`` (T, 3) receives length, x and height: corner 0 is at (0, 0), corner 1 at
    (length, 0) and corner 2 at (x, height). The height is at least ``least`` times the longest edge.
    """
    for t in range(len(corners)):
        ab, ac, dot, bc = 0.0, 0.0, 0.0, 0.0
        for k in range(3):
            u, v = corners[t, 1, k] - corners[t, 0, k], corners[t, 2, k] - corners[t, 0, k]
            ab += u * u
            ac += v * v
            dot += u * v
            bc += (v - u) ** 2
        floor = least * np.sqrt(max(ab, ac, bc))
        length = max(np.sqrt(ab), floor)
        x = dot / length if ab > 0.0 else 0.0
        shapes[t, 0], shapes[t, 1] = length, x
        shapes[t, 2] = max(np.sqrt(max(ac - x * x, 0.0)), floor)


@inline
def _jacobian(
    shape: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray
) -> tuple[float, float, float, float]:
    """Return a triangle's map to parameters: derivatives (s by x, s by y, t by x, t by y)."""
    length, x, height = shape[0], shape[1], shape[2]
    sx, tx = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    return sx, (c[0] - a[0] - sx * x) / height, tx, (c[1] - a[1] - tx * x) / height


@allocating_kernel
def unfold(across: IntArray, shapes: FloatArray, vertex: IntArray, start: int, points: FloatArray) -> None:
    """Unfold a piece triangle by triangle from one of them, each over the edge at which it is reached.

    ``across``, ``shapes`` and ``vertex`` (N, 3) are those of the piece's triangles, numbered within it;
    ``points`` (V, 2) receives the result. Exact if the piece is developable.
    """
    placed = np.zeros(len(points), np.bool_)
    seen = np.zeros(len(across), np.bool_)
    queue = np.empty(len(across), np.int32)
    length, x, height = shapes[start, 0], shapes[start, 1], shapes[start, 2]
    a, b, c = vertex[start, 0], vertex[start, 1], vertex[start, 2]
    points[a, 0], points[a, 1], points[b, 0], points[b, 1] = 0.0, 0.0, length, 0.0
    points[c, 0], points[c, 1] = x, height
    placed[a], placed[b], placed[c] = True, True, True
    queue[0], seen[start] = start, True
    at, end = 0, 1
    while at < end:
        triangle = queue[at]
        at += 1
        for k in range(3):
            if across[triangle, k] < 0 or seen[across[triangle, k] // 3]:
                continue
            other, edge = across[triangle, k] // 3, across[triangle, k] % 3
            seen[other] = True
            queue[end] = other
            end += 1
            third = vertex[other, (edge + 2) % 3]
            if not placed[third]:
                placed[third] = True
                _third_corner(shapes[other], edge, vertex[other], points, third)


@inline
def _third_corner(shape: FloatArray, edge: int, corners: IntArray, points: FloatArray, third: int) -> None:
    px, py = _rest_corner(shape, edge)
    qx, qy = _rest_corner(shape, (edge + 1) % 3)
    rx, ry = _rest_corner(shape, (edge + 2) % 3)
    ux, uy, vx, vy = qx - px, qy - py, rx - px, ry - py
    along, up = ux * vx + uy * vy, ux * vy - uy * vx
    square = ux * ux + uy * uy
    p, q = points[corners[edge]], points[corners[(edge + 1) % 3]]
    ds, dt = q[0] - p[0], q[1] - p[1]
    points[third, 0] = p[0] + (ds * along - dt * up) / square
    points[third, 1] = p[1] + (dt * along + ds * up) / square


@inline
def _rest_corner(shape: FloatArray, corner: int) -> tuple[float, float]:
    if corner == 0:
        return 0.0, 0.0
    if corner == 1:
        return shape[0], 0.0
    return shape[1], shape[2]


@allocating_kernel
def relax(
    shapes: FloatArray, vertex: IntArray, points: FloatArray, rounds: int, steps: int, tolerance: float
) -> None:
    """Flatten a piece as rigidly as possible (Liu et al. 2008, "A local/global approach").

    ``shapes`` and ``vertex`` (N, 3) as for `unfold`; ``points`` (V, 2) in and out. Each round finds the best
    rotation of every triangle, then solves for the points by conjugate gradients with the diagonal as
    preconditioner: at most ``steps``, until residuals have fallen to ``tolerance`` of the round's first.
    """
    count = len(points)
    weight = np.empty((len(vertex), 3))
    diagonal = np.zeros(count)
    for t in range(len(vertex)):
        for k in range(3):
            px, py = _rest_corner(shapes[t], k)
            qx, qy = _rest_corner(shapes[t], (k + 1) % 3)
            rx, ry = _rest_corner(shapes[t], (k + 2) % 3)
            weight[t, k] = (
                0.5 * ((px - rx) * (qx - rx) + (py - ry) * (qy - ry)) / (shapes[t, 0] * shapes[t, 2])
            )
            diagonal[vertex[t, k]] += weight[t, k]
            diagonal[vertex[t, (k + 1) % 3]] += weight[t, k]
    residual, search = np.empty((count, 2)), np.empty((count, 2))
    image = np.empty((count, 2))
    for _ in range(rounds):
        residual[:] = 0.0
        _turned_edges(shapes, vertex, weight, points, residual)
        _solve(vertex, weight, diagonal, points, residual, search, image, steps, tolerance)


@inline
def _turned_edges(
    shapes: FloatArray, vertex: IntArray, weight: FloatArray, points: FloatArray, residual: FloatArray
) -> None:
    """Fill in the residuals of the points' equations, with each triangle in its best rotation."""
    for t in range(len(vertex)):
        a, b, c = points[vertex[t, 0]], points[vertex[t, 1]], points[vertex[t, 2]]
        sx, sy, tx, ty = _jacobian(shapes[t], a, b, c)
        cosine, sine = sx + ty, tx - sy
        size = np.sqrt(cosine * cosine + sine * sine)
        if size > 0.0:
            cosine, sine = cosine / size, sine / size
        else:
            cosine, sine = 1.0, 0.0
        for k in range(3):
            i, j = vertex[t, k], vertex[t, (k + 1) % 3]
            px, py = _rest_corner(shapes[t], k)
            qx, qy = _rest_corner(shapes[t], (k + 1) % 3)
            x, y = qx - px, qy - py
            ds = weight[t, k] * (cosine * x - sine * y - (points[j, 0] - points[i, 0]))
            dt = weight[t, k] * (sine * x + cosine * y - (points[j, 1] - points[i, 1]))
            residual[i, 0] -= ds
            residual[i, 1] -= dt
            residual[j, 0] += ds
            residual[j, 1] += dt


@inline
def _solve(
    vertex: IntArray,
    weight: FloatArray,
    diagonal: FloatArray,
    points: FloatArray,
    residual: FloatArray,
    search: FloatArray,
    image: FloatArray,
    steps: int,
    tolerance: float,
) -> None:
    """Add the solution for the residuals to the points: preconditioned conjugate gradients, both columns."""
    count = len(points)
    for axis in range(2):
        size, first = 0.0, 0.0
        for v in range(count):
            search[v, axis] = residual[v, axis] / diagonal[v]
            size += residual[v, axis] * search[v, axis]
        first = size
        for _ in range(steps):
            if size <= tolerance * tolerance * first or size <= 0.0:
                break
            for v in range(count):
                image[v, axis] = 0.0
            for t in range(len(vertex)):
                for k in range(3):
                    i, j = vertex[t, k], vertex[t, (k + 1) % 3]
                    flow = weight[t, k] * (search[i, axis] - search[j, axis])
                    image[i, axis] += flow
                    image[j, axis] -= flow
            along = 0.0
            for v in range(count):
                along += search[v, axis] * image[v, axis]
            if not along > 0.0:
                break
            pace, before = size / along, size
            size = 0.0
            for v in range(count):
                points[v, axis] += pace * search[v, axis]
                residual[v, axis] -= pace * image[v, axis]
                size += residual[v, axis] * residual[v, axis] / diagonal[v]
            for v in range(count):
                search[v, axis] = residual[v, axis] / diagonal[v] + size / before * search[v, axis]


@allocating_kernel
def untangle(shapes: FloatArray, vertex: IntArray, points: FloatArray, least: float, sweeps: int) -> int:
    """Move points one by one until no triangle is flipped or degenerate; return the number that still are.

    Each is moved against the gradient of the symmetric Dirichlet energy of its triangles. In it, determinants
    at or below zero count as a small positive number (Garanzha et al. 2021, "Foldover-free maps in 50 lines
    of code"). Only points at triangles with a determinant below ``least`` are moved, and the points around
    them.
    """
    count = len(points)
    first = np.zeros(count + 1, np.int32)
    for t in range(len(vertex)):
        for k in range(3):
            first[vertex[t, k] + 1] += 1
    for v in range(count):
        first[v + 1] += first[v]
    ring, filled = np.empty(3 * len(vertex), np.int32), first.copy()
    for t in range(len(vertex)):
        for k in range(3):
            ring[filled[vertex[t, k]]] = t
            filled[vertex[t, k]] += 1
    near = np.zeros(count, np.int32)
    bad, before, at_first, epsilon = 0, 0, 0, 0.1
    for sweep in range(sweeps):
        bad = 0
        for t in range(len(vertex)):
            if not _determinant(shapes[t], vertex[t], points) > least:
                bad += 1
                for k in range(3):
                    near[vertex[t, k]] = sweep + 1
        if sweep == 0:
            at_first = bad
        if bad == 0 or 10 * bad > len(vertex) or (sweep >= 6 and 2 * bad > at_first):
            break  # done, or hopeless
        _around(vertex, near, sweep + 1)
        if sweep > 0 and bad >= before:
            epsilon = max(epsilon * 0.7, 1e-4)
        before = bad
        for v in range(count):
            if near[v] == sweep + 1 or near[v] == -sweep - 1:
                _improve(shapes, vertex, points, v, ring[first[v] : first[v + 1]], epsilon)
    return bad


@inline
def _around(vertex: IntArray, near: IntArray, mark: int) -> None:
    for t in range(len(vertex)):
        if near[vertex[t, 0]] == mark or near[vertex[t, 1]] == mark or near[vertex[t, 2]] == mark:
            for k in range(3):
                if near[vertex[t, k]] != mark:
                    near[vertex[t, k]] = -mark


@inline
def _determinant(shape: FloatArray, corners: IntArray, points: FloatArray) -> float:
    sx, sy, tx, ty = _jacobian(shape, points[corners[0]], points[corners[1]], points[corners[2]])
    out: float = sx * ty - sy * tx
    return out


@inline
def _energy(
    shapes: FloatArray, vertex: IntArray, points: FloatArray, ring: IntArray, epsilon: float
) -> float:
    total = 0.0
    for place in range(len(ring)):
        t = ring[place]
        a, b, c = points[vertex[t, 0]], points[vertex[t, 1]], points[vertex[t, 2]]
        sx, sy, tx, ty = _jacobian(shapes[t], a, b, c)
        det = sx * ty - sy * tx
        square = sx * sx + sy * sy + tx * tx + ty * ty
        held = 0.5 * (det + np.sqrt(epsilon * epsilon + det * det))
        total += (square + square / (held * held)) * shapes[t, 0] * shapes[t, 2]
    return total


@inline
def _improve(
    shapes: FloatArray, vertex: IntArray, points: FloatArray, v: int, ring: IntArray, epsilon: float
) -> None:
    """Move one point to a lower energy: a Newton step by finite differences, halved until it falls."""
    step = 1e300
    for place in range(len(ring)):
        t = ring[place]
        step = min(step, 1e-4 * min(shapes[t, 0], shapes[t, 2]))
    s, t0 = points[v, 0], points[v, 1]
    here = _energy(shapes, vertex, points, ring, epsilon)
    points[v, 0] = s + step
    right = _energy(shapes, vertex, points, ring, epsilon)
    points[v, 0] = s - step
    left = _energy(shapes, vertex, points, ring, epsilon)
    points[v, 0], points[v, 1] = s, t0 + step
    up = _energy(shapes, vertex, points, ring, epsilon)
    points[v, 1] = t0 - step
    down = _energy(shapes, vertex, points, ring, epsilon)
    points[v, 0], points[v, 1] = s + step, t0 + step
    both = _energy(shapes, vertex, points, ring, epsilon)
    gs, gt = (right - left) / (2 * step), (up - down) / (2 * step)
    hss, htt = (right - 2 * here + left) / (step * step), (up - 2 * here + down) / (step * step)
    hst = (both - right - up + here) / (step * step)
    trace, det = hss + htt, hss * htt - hst * hst
    lower = 0.5 * (trace - np.sqrt(max(trace * trace - 4 * det, 0.0)))
    lift = max(0.0, 1e-3 * abs(trace) - lower)
    hss, htt = hss + lift, htt + lift
    det = hss * htt - hst * hst
    ds, dt = -gs, -gt
    if det > 0.0:
        ds, dt = -(htt * gs - hst * gt) / det, -(hss * gt - hst * gs) / det
    for _ in range(20):
        points[v, 0], points[v, 1] = s + ds, t0 + dt
        if _energy(shapes, vertex, points, ring, epsilon) < here:
            return
        ds, dt = 0.5 * ds, 0.5 * dt
    points[v, 0], points[v, 1] = s, t0


@kernel
def singular_values(shapes: FloatArray, corners: FloatArray, values: FloatArray) -> None:
    """Compute how triangles are stretched: smallest (negative if flipped) and largest singular value, (T, 2).

    ``corners`` (T, 3, 2) are their parameters.
    """
    for t in range(len(shapes)):
        sx, sy, tx, ty = _jacobian(shapes[t], corners[t, 0], corners[t, 1], corners[t, 2])
        plus = np.sqrt((sx + ty) ** 2 + (tx - sy) ** 2)
        minus = np.sqrt((sx - ty) ** 2 + (tx + sy) ** 2)
        values[t, 0], values[t, 1] = 0.5 * (plus - minus), 0.5 * (plus + minus)


@allocating_kernel
def count_crossings(ends: FloatArray, pairs: IntArray) -> int:
    """Return the number of pairs of segments that cross and have no common end.

    ``ends`` (N, 2, 2); ``pairs`` (N, 2) are the numbers of their ends. Uses cells about as wide as a segment.
    """
    count = len(ends)
    low_s, low_t, high_s, high_t, mean = 1e300, 1e300, -1e300, -1e300, 0.0
    for n in range(count):
        for e in range(2):
            low_s, high_s = min(low_s, ends[n, e, 0]), max(high_s, ends[n, e, 0])
            low_t, high_t = min(low_t, ends[n, e, 1]), max(high_t, ends[n, e, 1])
        mean += abs(ends[n, 1, 0] - ends[n, 0, 0]) + abs(ends[n, 1, 1] - ends[n, 0, 1])
    cell = max(mean / count, (high_s - low_s + high_t - low_t) / 512, 1e-300)
    rows, columns = int((high_s - low_s) / cell) + 1, int((high_t - low_t) / cell) + 1
    first = np.zeros(rows * columns + 1, np.int32)
    for n in range(count):
        for r in range(
            int((min(ends[n, 0, 0], ends[n, 1, 0]) - low_s) / cell),
            int((max(ends[n, 0, 0], ends[n, 1, 0]) - low_s) / cell) + 1,
        ):
            for c in range(
                int((min(ends[n, 0, 1], ends[n, 1, 1]) - low_t) / cell),
                int((max(ends[n, 0, 1], ends[n, 1, 1]) - low_t) / cell) + 1,
            ):
                first[r * columns + c + 1] += 1
    for place in range(rows * columns):
        first[place + 1] += first[place]
    listed, filled = np.empty(first[rows * columns], np.int32), first.copy()
    found = 0
    for n in range(count):
        for r in range(
            int((min(ends[n, 0, 0], ends[n, 1, 0]) - low_s) / cell),
            int((max(ends[n, 0, 0], ends[n, 1, 0]) - low_s) / cell) + 1,
        ):
            for c in range(
                int((min(ends[n, 0, 1], ends[n, 1, 1]) - low_t) / cell),
                int((max(ends[n, 0, 1], ends[n, 1, 1]) - low_t) / cell) + 1,
            ):
                place = r * columns + c
                for other in range(first[place], filled[place]):
                    m = listed[other]
                    if (
                        pairs[m, 0] != pairs[n, 0]
                        and pairs[m, 0] != pairs[n, 1]
                        and pairs[m, 1] != pairs[n, 0]
                        and pairs[m, 1] != pairs[n, 1]
                    ):
                        found += _cross(ends[m], ends[n])
                listed[filled[place]] = n
                filled[place] += 1
    return found


@inline
def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    out: float = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return out


@inline
def _cross(one: FloatArray, other: FloatArray) -> int:
    a, b = _turn(one[0], one[1], other[0]), _turn(one[0], one[1], other[1])
    c, d = _turn(other[0], other[1], one[0]), _turn(other[0], other[1], one[1])
    # segments that only touch, up to rounding, do not cross
    edge = 1e-9 * (abs(a) + abs(b) + abs(c) + abs(d))
    apart = (a > edge and b < -edge) or (a < -edge and b > edge)
    return int(apart and ((c > edge and d < -edge) or (c < -edge and d > edge)))
