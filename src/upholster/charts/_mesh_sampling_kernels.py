"""Sampling the triangles of a mesh's charts."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.runtime.jit import allocating_kernel, inline, kernel

__all__ = [
    "corner_lists",
    "distances_over_edges",
    "fill_nodes",
    "join_turns",
    "splat_matrices",
    "square_axes",
]

_CANCELLED = 0.02
"""A mean whose determinant is less than this share of its triangles' determinant gives no direction."""


@kernel
def splat_matrices(
    places: FloatArray,
    chart: IntArray,
    matrices: FloatArray,
    spacing: float,
    step: float,
    shapes: NDArray[np.int64],
    nodes: FloatArray,
    sums: FloatArray,
) -> None:
    """Add triangles' matrices to the surrounding nodes, with tent weights in proportion to area.

    `places` (T, 3, 2) are the corners' row and column on their charts, in texels from the first texel's
    centre. `matrices` (T, 3, 4) are the matrices at the corners, linear in between; within a triangle they
    differ only by a rotation. Triangles are sampled at their centroid and at integer multiples of `spacing`.
    Nodes are `step` texels apart; the second one of a row or column is at 0. `shapes` (charts, 3) hold each
    chart's first node, rows and columns; `nodes` (nodes, 4) are the nodes' matrices, bilinear in between.
    `sums` (nodes, 7) receive weighted matrices, weights, and weighted determinants: the triangles' own, and
    those of the matrices interpolated from the nodes.
    """
    for t in range(places.shape[0]):
        k = chart[t]
        if k < 0:
            continue
        p = places[t]
        y1, x1, y2, x2 = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
        area = y1 * x2 - x1 * y2
        if area <= 0.0:
            continue
        f = matrices[t]
        determinant = f[0, 0] * f[0, 3] - f[0, 1] * f[0, 2]
        low_y, high_y = min(p[0, 0], p[1, 0], p[2, 0]), max(p[0, 0], p[1, 0], p[2, 0])
        low_x, high_x = min(p[0, 1], p[1, 1], p[2, 1]), max(p[0, 1], p[1, 1], p[2, 1])
        i0, i1 = int64(np.ceil(low_y / spacing)), int64(np.floor(high_y / spacing)) + 1
        j0, j1 = int64(np.ceil(low_x / spacing)), int64(np.floor(high_x / spacing)) + 1
        first, rows, columns = shapes[k, 0], shapes[k, 1], shapes[k, 2]
        for i in range(i0 - 1, i1):
            for j in range(j0, j1) if i >= i0 else range(1):
                if i < i0:  # the middle, once
                    y, x = (p[0, 0] + p[1, 0] + p[2, 0]) / 3.0, (p[0, 1] + p[1, 1] + p[2, 1]) / 3.0
                    weight = min(0.5 * area, spacing * spacing)
                    b, c = 1.0 / 3.0, 1.0 / 3.0
                else:
                    y, x, weight = i * spacing, j * spacing, spacing * spacing
                    b = ((y - p[0, 0]) * x2 - (x - p[0, 1]) * y2) / area
                    c = (y1 * (x - p[0, 1]) - x1 * (y - p[0, 0])) / area
                    if b < 0.0 or c < 0.0 or b + c > 1.0:
                        continue
                r, s = max(y / step + 1.0, 0.0), max(x / step + 1.0, 0.0)
                a, d = min(int64(r), rows - 2), min(int64(s), columns - 2)
                down, right = min(r - a, 1.0), min(s - d, 1.0)
                m0, m1, m2, m3 = 0.0, 0.0, 0.0, 0.0
                for e in range(4):
                    share = (down if e & 1 else 1.0 - down) * (right if e & 2 else 1.0 - right)
                    at = first + (a + (e & 1)) * columns + d + (e >> 1)
                    m0, m1 = m0 + share * nodes[at, 0], m1 + share * nodes[at, 1]
                    m2, m3 = m2 + share * nodes[at, 2], m3 + share * nodes[at, 3]
                shown = m0 * m3 - m1 * m2
                for e in range(4):
                    share = (down if e & 1 else 1.0 - down) * (right if e & 2 else 1.0 - right)
                    at = first + (a + (e & 1)) * columns + d + (e >> 1)
                    share *= weight
                    for m in range(4):
                        sums[at, m] += share * ((1.0 - b - c) * f[0, m] + b * f[1, m] + c * f[2, m])
                    sums[at, 4] += share
                    sums[at, 5] += share * determinant
                    sums[at, 6] += share * shown


@inline
def _enter_means(sums: FloatArray, size: float, node: FloatArray) -> bool:
    # Writes a node's mean matrix, 0 where no sample is near or the matrices cancel. Returns whether it is
    # usable.
    weight, m = sums[4], node
    for k in range(4):
        m[k] = sums[k] / weight if weight > 0.0 else 0.0
    determinant = m[0] * m[3] - m[1] * m[2]
    known = weight > 0.0 and determinant > _CANCELLED * size * size
    # A mean of matrices that differ by rotations is too small.
    larger = np.sqrt(sums[5] / weight / determinant) if known else 0.0
    for k in range(4):
        m[k] *= larger
    return bool(known)


@inline
def _enter_around(
    nodes: FloatArray, rounds: IntArray, shape: tuple[int, int, int], at: tuple[int, int], now: int
) -> bool:
    # Writes the mean of the adjacent nodes that were known in the previous round, if there are any.
    first, rows, columns = shape
    i, j = at
    m, count = nodes[first + i * columns + j], 0.0
    for k in range(4):
        m[k] = 0.0
    for a in range(max(i - 1, 0), min(i + 2, rows)):
        for b in range(max(j - 1, 0), min(j + 2, columns)):
            adjacent = first + a * columns + b
            if 0 <= rounds[adjacent] < now:
                count += 1.0
                for k in range(4):
                    m[k] += nodes[adjacent, k]
    if count == 0.0:
        return False
    for k in range(4):
        m[k] /= count
    return True


@kernel
def fill_nodes(
    sums: FloatArray, shapes: NDArray[np.int64], sizes: FloatArray, nodes: FloatArray, rounds: IntArray
) -> None:
    """Fill charts' node matrices (nodes, 4) with means, or from neighbours where there is no usable mean.

    A node has no usable mean where no triangle is near or the matrices cancel. `sums` and `shapes` are those
    of `splat_matrices`. `sizes` (charts,) are approximate square roots of the determinants of each chart's
    matrices. Nodes without a mean take the mean of adjacent nodes, round after round. `rounds` (nodes,)
    receives the round of each node, 0 for means. On a chart without any mean all matrices are upright, have
    the chart's size, and count as round 1.
    """
    for chart in range(shapes.shape[0]):
        first, rows, columns = shapes[chart, 0], shapes[chart, 1], shapes[chart, 2]
        size, known = sizes[chart], int64(0)
        for n in range(first, first + rows * columns):
            rounds[n] = 0 if _enter_means(sums[n], size, nodes[n]) else -1
            known += rounds[n] == 0
        now = int64(1)
        if known == 0:
            known = rows * columns
            for n in range(first, first + known):
                rounds[n], nodes[n, 1], nodes[n, 2] = 1, 0.0, 0.0
                nodes[n, 0] = nodes[n, 3] = size
        while known < rows * columns:
            for i in range(rows):
                for j in range(columns):
                    n = first + i * columns + j
                    if rounds[n] >= 0 or not _enter_around(
                        nodes, rounds, (first, rows, columns), (i, j), now
                    ):
                        continue
                    rounds[n] = now
                    known += 1
                    m = nodes[n]
                    if m[0] * m[3] - m[1] * m[2] <= _CANCELLED * size * size:
                        m[0] = m[3] = size
                        m[1] = m[2] = 0.0
            now += 1


@kernel
def distances_over_edges(triangles: IntArray, lengths: FloatArray, away: FloatArray) -> None:
    """Lower `away` (V,) to the distances along edges of `lengths` (T, 3) from the vertices where it is 0."""
    count = triangles.shape[0]
    changed, forward = True, True
    while changed:
        changed = False
        for n in range(count):
            t = n if forward else count - 1 - n
            for k in range(3):
                a, b, length = triangles[t, k], triangles[t, (k + 1) % 3], lengths[t, k]
                if away[a] + length < away[b]:
                    away[b], changed = away[a] + length, True
                elif away[b] + length < away[a]:
                    away[a], changed = away[b] + length, True
        forward = not forward


@allocating_kernel
def join_turns(first: IntArray, second: IntArray, jumps: IntArray, turns: IntArray) -> None:
    """Find the quarter turns, 0 to 3, between triangles along a spanning tree built from edges in order.

    Across edge n, from triangle `first[n]` to `second[n]`, the turns increase by `jumps[n]`. `turns` (T,)
    receives each triangle's turn relative to the first triangle of its connected component.
    """
    # Union-find: `turns` holds each triangle's turn relative to its parent.
    parent = np.arange(turns.shape[0])
    turns[:] = 0
    for n in range(first.shape[0]):
        a, b, between = int64(first[n]), int64(second[n]), int64(jumps[n])
        a, up = _root_of(parent, turns, a)
        b, down = _root_of(parent, turns, b)
        if a != b:
            # The turn of b's root relative to a's, so that second is `between` from first.
            parent[b], turns[b] = a, (up + between - down) % 4
    for t in range(turns.shape[0]):
        root, total = _root_of(parent, turns, t)
        parent[t], turns[t] = root, total


@inline
def _root_of(parent: NDArray[np.int64], turns: IntArray, t: int) -> tuple[int, int]:
    # The root of a triangle and the turn relative to it. Every second triangle on the path gets a nearer
    # parent.
    total = int64(0)
    while parent[t] != t:
        above = parent[t]
        if parent[above] != above:
            turns[t] = (turns[t] + turns[above]) % 4
            parent[t] = parent[above]
        total += turns[t]
        t = parent[t]
    return t, total % 4


@kernel
def square_axes(
    along: FloatArray, normals: FloatArray, positions: FloatArray, triangles: IntArray, down: FloatArray
) -> None:
    """Project vectors `along` (T, 3) into triangles' planes and normalize them; write the clockwise normals.

    `down` (T, 3) receives unit vectors 90° clockwise from `along`. A vector without a component in the plane
    becomes the triangle's first edge. `normals` (T, 3) have unit length.
    """
    for t in range(along.shape[0]):
        n, v, w = normals[t], along[t], down[t]
        off = v[0] * n[0] + v[1] * n[1] + v[2] * n[2]
        x, y, z = v[0] - off * n[0], v[1] - off * n[1], v[2] - off * n[2]
        length = np.sqrt(x * x + y * y + z * z)
        if length < 1e-6:
            a, b = positions[triangles[t, 0]], positions[triangles[t, 1]]
            x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            length = np.sqrt(x * x + y * y + z * z)
        length = max(length, 1e-300)
        v[0], v[1], v[2] = x / length, y / length, z / length
        w[0], w[1] = v[1] * n[2] - v[2] * n[1], v[2] * n[0] - v[0] * n[2]
        w[2] = v[0] * n[1] - v[1] * n[0]


@kernel
def corner_lists(vertices: IntArray, first: NDArray[np.int64], listed: IntArray) -> None:
    """List the triangles (T, 3) at each vertex: vertex v's are from ``first[v]`` up to ``first[v + 1]``.

    `first` has one entry more than there are vertices, `listed` three per triangle.
    """
    first[:] = 0
    count = vertices.shape[0]
    for t in range(count):
        for k in range(3):
            first[vertices[t, k]] += 1
    total = int64(0)
    for v in range(len(first)):
        total += first[v]
        first[v] = total  # where the list ends: it is filled from there
    for t in range(count - 1, -1, -1):
        for k in range(2, -1, -1):
            v = vertices[t, k]
            first[v] -= 1
            listed[first[v]] = t
