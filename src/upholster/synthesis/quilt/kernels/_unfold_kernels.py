"""Unfolding a mesh around a block's centre: the triangles that the block covers, and their places in it.

The centre's triangle is placed in its own plane. The other vertices follow in the order of their distance.
Each is placed, with true lengths, by a triangle whose other two corners are settled: an exponential map by
unfolding. The block map also follows the direction field: ``u = ρ/2·(I + R(−δ))·ℓ`` for an unfolded place ℓ,
where δ is the field's turn.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.runtime.jit import inline, shared

__all__ = ["Footprint", "MeshArrays", "UnfoldScratch", "unfold_block"]

_REACH = 1.45
"""Half a block's diagonal and a little more, in units of half its side."""

_TORN = 2.5
"""A triangle is torn if unfolding changes its area or a squared length by more than this factor."""

_SHORT = 1.0 / 256.0
"""Squared length of an edge, relative to the adjacent side, below which its direction is not reliable."""

_FLOOD = 4.0
"""Unfolding has collapsed if it has covered more than this many times the area of the disk within reach."""

_MOST_SETTLED = 1 << 13

_AGREES = 0.7
"""Minimum cosine of the angle between two triangles' directions at a vertex for them to be one field."""

_TRIM = 0.35
"""A triangle stays in a block if the block map's derivative there, in the field's axes, differs by less than
this from the identity. A smaller value makes directions and sizes more accurate, but needs more blocks. Cuts
between blocks then cross seams more often and are visible."""

_OFF = 0.5
"""A triangle also stays if no place of it is off by more than this many frame pixels. Otherwise narrow
triangles at seams would end blocks."""


class MeshArrays(NamedTuple):
    """A mesh in the kernels' form; V vertices, T triangles.

    `corners` (T, 3, 3) are positions, `triangles` (T, 3) vertices and `neighbours` (T, 3) are as in
    `TriangleMesh`; `first` (V + 1,) and `around` list the triangles around each vertex. Positions belong to
    corners, not to vertices, because opposite edges of a tile meet. `vectors` (T, 3, 3) is the direction
    field at corners; `normals`, `along` and `down` (T, 3) are each triangle's normal and the field's two axes
    in its plane. `places` (T, 3, 2) are the row and column of each corner on its chart in steps, with steps'
    centres at integers; `chart` (T,) is that chart, −1 for none. `seam` (T, 3) numbers the edges on seams, −1
    for other edges; `crossing` (seams, 2, 2) is each one's transition of texel steps. `spread` (V,) is a
    third of the area around a vertex. `fold` is that of the field: 1, 2 or 4 evenly rotated directions count
    as one; `turns` (T,) are the quarter turns from the charts' warp fields to `along` and `down`.
    """

    corners: FloatArray
    triangles: IntArray
    neighbours: IntArray
    first: NDArray[np.int64]
    around: IntArray
    vectors: FloatArray
    normals: FloatArray
    along: FloatArray
    down: FloatArray
    places: FloatArray
    chart: IntArray
    seam: IntArray
    crossing: FloatArray
    spread: FloatArray
    fold: int
    turns: IntArray


class Footprint(NamedTuple):
    """Scratch: the footprint of a block, triangle by triangle; triangles of one sheet are consecutive.

    For each triangle: its number in the mesh, −1 if it is a part of a block that was not unfolded; its chart;
    the `places` (n, 3, 2) of its corners there; `maps` (n, 3, 2), the corners' places in the frame, relative
    to the block's centre; and its sheet, −1 for none. `corners` (64, 4) is scratch.
    """

    triangles: IntArray
    charts: IntArray
    places: FloatArray
    maps: FloatArray
    sheets: IntArray
    corners: FloatArray

    @classmethod
    def of(cls, most: int) -> "Footprint":
        """Return arrays for at most `most` triangles."""
        return cls(
            np.empty(most, np.int32),
            np.empty(most, np.int32),
            np.empty((most, 3, 2)),
            np.empty((most, 3, 2)),
            np.empty(most, np.int32),
            np.empty((64, 4)),
        )


class UnfoldScratch(NamedTuple):
    """Scratch of one thread: for vertices `state`, `flat`, `turned` and `u`; `local` for triangles; lists.

    `flat` is x, y and the number of averaged places. Between calls `state` is all 0, and `local` is all −1.
    """

    state: NDArray[np.uint8]
    flat: FloatArray
    turned: FloatArray
    u: FloatArray
    touched: IntArray
    keys: FloatArray
    heap: IntArray
    local: IntArray
    near: IntArray
    queue: IntArray

    @classmethod
    def of(cls, vertices: int, triangles: int) -> "UnfoldScratch":
        """Return scratch for a mesh."""
        return cls(
            np.zeros(vertices, np.uint8),
            np.empty((vertices, 3)),
            np.empty((vertices, 2)),
            np.empty((vertices, 2)),
            np.empty(vertices, np.int32),
            np.empty(8 * vertices + 64),
            np.empty(8 * vertices + 64, np.int32),
            np.full(triangles, -1, np.int32),
            np.empty(triangles, np.int32),
            np.empty(triangles, np.int32),
        )


@inline
def _push(keys: FloatArray, heap: IntArray, size: int, key: float, vertex: int) -> int:
    at = size
    while at > 0:
        above = (at - 1) >> 1
        if keys[above] < key or (keys[above] == key and heap[above] <= vertex):
            break
        keys[at], heap[at] = keys[above], heap[above]
        at = above
    keys[at], heap[at] = key, vertex
    return size + 1


@inline
def _pop(keys: FloatArray, heap: IntArray, size: int) -> int:
    # Removes the least entry; returns the new size.
    size -= 1
    key, vertex = keys[size], heap[size]
    at = 0
    while True:
        child = 2 * at + 1
        if child >= size:
            break
        right = child + 1
        if right < size and (
            keys[right] < keys[child] or (keys[right] == keys[child] and heap[right] < heap[child])
        ):
            child = right
        if key < keys[child] or (key == keys[child] and vertex <= heap[child]):
            break
        keys[at], heap[at] = keys[child], heap[child]
        at = child
    keys[at], heap[at] = key, vertex
    return size


@inline
def _edge(mesh: MeshArrays, t: int, k: int, m: int) -> tuple[float, float, float]:
    p = mesh.corners[t]
    return p[m, 0] - p[k, 0], p[m, 1] - p[k, 1], p[m, 2] - p[k, 2]


@inline
def _dot(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inline
def _doubled_area(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    return float(np.sqrt(x * x + y * y + z * z))


@inline
def _place_third(mesh: MeshArrays, flat: FloatArray, t: int, k: int) -> tuple[bool, float, float]:
    # The place of the corner opposite to a triangle's edge k, to the left of that flat edge. Lengths are
    # those in space: otherwise an edge that unfolding shortened would shorten all triangles that follow.
    m, o = (k + 1) % 3, (k + 2) % 3
    i, j = mesh.triangles[t, k], mesh.triangles[t, m]
    edge, side = _edge(mesh, t, k, m), _edge(mesh, t, k, o)
    squared = _dot(edge, edge)
    dx, dy = flat[j, 0] - flat[i, 0], flat[j, 1] - flat[i, 1]
    if squared <= _SHORT * _dot(side, side) or dx * dx + dy * dy <= 0.01 * squared:
        return False, 0.0, 0.0
    length = np.sqrt((dx * dx + dy * dy) / squared)
    share, height = _dot(side, edge) / squared - 0.5, _doubled_area(edge, side) / squared
    dx, dy = dx / length, dy / length
    x = 0.5 * (flat[i, 0] + flat[j, 0]) + share * dx - height * dy
    return True, x, 0.5 * (flat[i, 1] + flat[j, 1]) + share * dy + height * dx


@inline
def _settle_neighbours(
    mesh: MeshArrays, scratch: UnfoldScratch, best: int, within: float, touched: int, size: int
) -> tuple[int, int]:
    # Places the third corners of triangles around a vertex that was just settled, if an end of the settled
    # edge is within the squared distance `within`: triangles beyond do not meet the block.
    state, flat = scratch.state, scratch.flat
    for n in range(mesh.first[best], mesh.first[best + 1]):
        t = mesh.around[n]
        for k in range(3):
            i, j, w = mesh.triangles[t, k], mesh.triangles[t, (k + 1) % 3], mesh.triangles[t, (k + 2) % 3]
            if state[i] != 2 or state[j] != 2 or state[w] == 2 or (i != best and j != best):
                continue
            if min(flat[i, 0] ** 2 + flat[i, 1] ** 2, flat[j, 0] ** 2 + flat[j, 1] ** 2) > within:
                continue
            sound, x, y = _place_third(mesh, flat, t, k)
            if not sound:
                continue
            edge = _edge(mesh, t, k, (k + 1) % 3)
            apart = (flat[w, 0] - x) ** 2 + (flat[w, 1] - y) ** 2
            if state[w] == 0:
                state[w] = 1
                flat[w, 0], flat[w, 1], flat[w, 2] = x, y, 1.0
                scratch.touched[touched] = w
                touched += 1
            elif apart < 0.25 * _dot(edge, edge):
                m = flat[w, 2]  # the places agree: take their mean
                flat[w, 0], flat[w, 1] = (m * flat[w, 0] + x) / (m + 1.0), (m * flat[w, 1] + y) / (m + 1.0)
                flat[w, 2] = m + 1.0
            elif x * x + y * y < flat[w, 0] ** 2 + flat[w, 1] ** 2:
                flat[w, 0], flat[w, 1], flat[w, 2] = x, y, 1.0
            else:
                continue
            if size < scratch.heap.shape[0]:
                size = _push(scratch.keys, scratch.heap, size, flat[w, 0] ** 2 + flat[w, 1] ** 2, w)
    return touched, size


@inline
def _unfold(
    mesh: MeshArrays, scratch: UnfoldScratch, centre: int, point: Any, axis: Any, reach: float
) -> Any:
    # Flattens the triangles that have a corner within `reach` of a point of triangle `centre`, with x along
    # `axis`. Returns the number of vertices that were placed.
    state, flat, keys, heap = scratch.state, scratch.flat, scratch.keys, scratch.heap
    normal = mesh.normals[centre]
    up0 = normal[1] * axis[2] - normal[2] * axis[1]
    up1 = normal[2] * axis[0] - normal[0] * axis[2]
    up2 = normal[0] * axis[1] - normal[1] * axis[0]
    touched, size, settled, area = int64(0), int64(0), int64(0), 0.0
    for k in range(3):
        v = mesh.triangles[centre, k]
        a, b, c = (
            mesh.corners[centre, k, 0] - point[0],
            mesh.corners[centre, k, 1] - point[1],
            mesh.corners[centre, k, 2] - point[2],
        )
        flat[v, 0], flat[v, 1] = a * axis[0] + b * axis[1] + c * axis[2], a * up0 + b * up1 + c * up2
        flat[v, 2], state[v] = 1.0, 1
        scratch.touched[touched] = v
        touched += 1
        size = _push(keys, heap, size, flat[v, 0] ** 2 + flat[v, 1] ** 2, v)
    while size > 0:
        key, best = keys[0], heap[0]
        size = _pop(keys, heap, size)
        if state[best] == 2 or key != flat[best, 0] ** 2 + flat[best, 1] ** 2:
            continue  # settled, or moved since
        state[best] = 2
        settled += 1
        area += mesh.spread[best] if key <= reach * reach else 0.0
        if settled > _MOST_SETTLED or area > _FLOOD * np.pi * reach * reach:
            break
        touched, size = _settle_neighbours(mesh, scratch, best, reach * reach, touched, size)
    return touched


@inline
def _is_whole(mesh: MeshArrays, flat: FloatArray, t: int) -> Any:
    # Whether unfolding preserves the size and shape of a triangle approximately.
    a, b, c = mesh.triangles[t, 0], mesh.triangles[t, 1], mesh.triangles[t, 2]
    e, g, h = _edge(mesh, t, 0, 1), _edge(mesh, t, 0, 2), _edge(mesh, t, 1, 2)
    ex, ey = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
    gx, gy = flat[c, 0] - flat[a, 0], flat[c, 1] - flat[a, 1]
    area, there = _doubled_area(e, g), ex * gy - ey * gx
    if there < area / _TORN or there > area * _TORN:
        return False
    ee, gg, hh = _dot(e, e), _dot(g, g), _dot(h, h)
    fe, fg, fh = ex * ex + ey * ey, gx * gx + gy * gy, (gx - ex) ** 2 + (gy - ey) ** 2
    low = ee <= _TORN * fe and gg <= _TORN * fg and hh <= _TORN * fh
    return low and fe <= _TORN * ee and fg <= _TORN * gg and fh <= _TORN * hh


@inline
def _nearest_turn(x: float, y: float, fold: int) -> tuple[float, float]:
    # The direction nearest to the block's own, (1, 0), among those that count as one.
    if fold == 4 and abs(y) > abs(x):
        x, y = y, -x
    if fold > 1 and x < 0.0:
        x, y = -x, -y
    return x, y


@inline
def _add_turns(mesh: MeshArrays, scratch: UnfoldScratch, t: int) -> None:
    # Adds the direction field in a flat triangle to its corners, weighted by area.
    flat = scratch.flat
    a, b, c = mesh.triangles[t, 0], mesh.triangles[t, 1], mesh.triangles[t, 2]
    e, g = _edge(mesh, t, 0, 1), _edge(mesh, t, 0, 2)
    ex, ey = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
    gx, gy = flat[c, 0] - flat[a, 0], flat[c, 1] - flat[a, 1]
    ee, gg, eg = _dot(e, e), _dot(g, g), _dot(e, g)
    determinant = ee * gg - eg * eg
    if determinant <= 0.0:
        return
    weight = 1.0 / np.sqrt(determinant)
    for k in range(3):
        v = mesh.triangles[t, k]
        d = (mesh.vectors[t, k, 0], mesh.vectors[t, k, 1], mesh.vectors[t, k, 2])
        de, dg = _dot(d, e), _dot(d, g)
        p, q = (gg * de - eg * dg) * weight, (ee * dg - eg * de) * weight
        x, y = _nearest_turn(p * ex + q * gx, p * ey + q * gy, mesh.fold)
        old = scratch.turned[v]
        both = np.sqrt((x * x + y * y) * (old[0] * old[0] + old[1] * old[1]))
        if x * old[0] + y * old[1] >= _AGREES * both:  # otherwise the field jumps: keep the nearer side
            old[0], old[1] = old[0] + x, old[1] + y


@inline
def _map_vertices(scratch: UnfoldScratch, touched: int, scale: float) -> None:
    # Writes the block map at flat vertices: rows down, columns to the right, in frame pixels.
    for n in range(touched):
        v = scratch.touched[n]
        x, y = scratch.flat[v, 0], scratch.flat[v, 1]
        c, s = scratch.turned[v, 0], scratch.turned[v, 1]
        length = np.sqrt(c * c + s * s)
        c, s = (c / length, s / length) if length > 1e-12 else (1.0, 0.0)
        scratch.u[v, 0] = -0.5 * scale * (y + c * y - s * x)
        scratch.u[v, 1] = 0.5 * scale * (x + c * x + s * y)


@inline
def _is_true(mesh: MeshArrays, scratch: UnfoldScratch, t: int, scale: float) -> Any:
    # Whether the block map shows a triangle approximately in the field's direction and at true size.
    a, b, c = mesh.triangles[t, 0], mesh.triangles[t, 1], mesh.triangles[t, 2]
    e, g, u = _edge(mesh, t, 0, 1), _edge(mesh, t, 0, 2), scratch.u
    right, down = mesh.along[t], mesh.down[t]
    er, ed = (
        e[0] * right[0] + e[1] * right[1] + e[2] * right[2],
        e[0] * down[0] + e[1] * down[1] + e[2] * down[2],
    )
    gr, gd = (
        g[0] * right[0] + g[1] * right[1] + g[2] * right[2],
        g[0] * down[0] + g[1] * down[1] + g[2] * down[2],
    )
    determinant = scale * (ed * gr - er * gd)
    if determinant <= 0.0:
        return False
    ud, ur = u[b, 0] - u[a, 0], u[b, 1] - u[a, 1]
    vd, vr = u[c, 0] - u[a, 0], u[c, 1] - u[a, 1]
    m00, m01 = (ud * gr - vd * er) / determinant, (vd * ed - ud * gd) / determinant
    m10, m11 = (ur * gr - vr * er) / determinant, (vr * ed - ur * gd) / determinant
    # The rotation in the matrix; the remainder does not rotate.
    like, turn = _nearest_turn(m00 + m11, m10 - m01, mesh.fold)
    size = m00 * m00 + m01 * m01 + m10 * m10 + m11 * m11
    if size - 2.0 * like + 2.0 < _TRIM * _TRIM:
        return True
    if like <= abs(turn):
        return False
    # The error of the edges, for the nearest branch of the field.
    if mesh.fold == 4 and abs(m10 - m01) > abs(m00 + m11):
        ud, ur, vd, vr = ur, -ud, vr, -vd
    if mesh.fold > 1 and ud * ed + ur * er + vd * gd + vr * gr < 0.0:
        ud, ur, vd, vr = -ud, -ur, -vd, -vr
    ud, ur, vd, vr = ud - scale * ed, ur - scale * er, vd - scale * gd, vr - scale * gr
    most = max(ud * ud + ur * ur, vd * vd + vr * vr, (vd - ud) ** 2 + (vr - ur) ** 2)
    return most < _OFF * _OFF


@inline
def _reaches(mesh: MeshArrays, scratch: UnfoldScratch, t: int, half: float) -> bool:
    # Whether a part of a triangle may be in the block's square.
    u = scratch.u
    a, b, c = mesh.triangles[t, 0], mesh.triangles[t, 1], mesh.triangles[t, 2]
    for axis in range(2):
        if min(u[a, axis], u[b, axis], u[c, axis]) > half or max(u[a, axis], u[b, axis], u[c, axis]) < -half:
            return False
    return True


@inline
def _list_near(
    mesh: MeshArrays, scratch: UnfoldScratch, centre: int, touched: int, scale: float, half: float
) -> Any:
    # Lists the triangles that the block shows without much distortion; marks them in `local` with −2.
    near, count = scratch.near, int64(0)
    for n in range(touched):
        v = scratch.touched[n]
        scratch.turned[v, 0], scratch.turned[v, 1] = 0.0, 0.0
    for n in range(touched):
        v = scratch.touched[n]
        for m in range(mesh.first[v], mesh.first[v + 1]):
            t = mesh.around[m]
            a, b, c = mesh.triangles[t, 0], mesh.triangles[t, 1], mesh.triangles[t, 2]
            if a != v or mesh.chart[t] < 0:
                continue  # each is listed at its first corner
            flat = scratch.state[a] and scratch.state[b] and scratch.state[c]
            if flat and (t == centre or _is_whole(mesh, scratch.flat, t)):
                near[count] = t
                count += 1
                _add_turns(mesh, scratch, t)
    _map_vertices(scratch, touched, scale)
    kept = int64(0)
    for n in range(count):
        t = near[n]
        if t == centre or (_is_true(mesh, scratch, t, scale) and _reaches(mesh, scratch, t, half)):
            scratch.local[t] = -2
            near[kept] = t
            kept += 1
    return kept


@inline
def _spread(mesh: MeshArrays, scratch: UnfoldScratch, centre: int, sheets: IntArray) -> tuple[int, int]:
    # Orders the triangles that are connected with the centre into `queue`, sheet by sheet: pieces that no
    # seam cuts. Triangles where a sheet may begin wait in `near`, whose list is no longer needed: its
    # triangles are marked in `local`.
    local, queue, waiting = scratch.local, scratch.queue, scratch.near
    head, tail, first, last, sheet = int64(0), int64(0), int64(0), int64(0), int64(0)
    waiting[0], last = centre, int64(1)
    while first < last:
        start = waiting[first]
        first += 1
        if local[start] != -2 or tail == sheets.shape[0]:
            continue
        local[start] = tail
        queue[tail], sheets[tail] = start, sheet
        tail += 1
        while head < tail:
            t = queue[head]
            head += 1
            for k in range(3):
                across = mesh.neighbours[t, k]
                if across < 0 or local[across // 3] != -2:
                    continue
                other = across // 3
                if mesh.seam[t, k] >= 0:
                    if last < waiting.shape[0]:
                        waiting[last] = other
                        last += 1
                elif mesh.chart[other] == mesh.chart[t] and tail < sheets.shape[0]:
                    local[other] = tail
                    queue[tail], sheets[tail] = other, sheet
                    tail += 1
        sheet += 1
    return tail, sheet


@shared
def unfold_block(
    mesh: MeshArrays,
    centre: int,
    spot: FloatArray,
    half: float,
    scale: float,
    scratch: UnfoldScratch,
    out: Footprint,
) -> tuple[int, int]:
    """Find the footprint of a block; return its number of triangles, and its number of sheets.

    `centre` is a triangle, `spot` (3,) a place in it or right next to it; `half` is half a block's side in
    frame pixels, `scale` is frame pixels per model unit.
    """
    touched = _unfold(mesh, scratch, centre, spot, mesh.along[centre], _REACH * half / scale)
    _list_near(mesh, scratch, centre, touched, scale, half)
    found, pieces = _spread(mesh, scratch, centre, out.sheets)
    found = min(found, int64(out.triangles.shape[0]))
    for m in range(found):
        t = scratch.queue[m]
        out.triangles[m], out.charts[m] = t, mesh.chart[t]
        for k in range(3):
            v = mesh.triangles[t, k]
            for axis_number in range(2):
                out.places[m, k, axis_number] = mesh.places[t, k, axis_number]
                out.maps[m, k, axis_number] = scratch.u[v, axis_number]
    for m in range(touched):
        v = scratch.touched[m]
        scratch.state[v] = 0
        for k in range(mesh.first[v], mesh.first[v + 1]):
            scratch.local[mesh.around[k]] = -1
    return found, pieces
