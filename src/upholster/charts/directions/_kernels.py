"""Hot loops over the triangles of a mesh: connected regions, and averages at vertices."""

import numpy as np

from upholster.base.types import ComplexArray, FloatArray, IntArray
from upholster.runtime.jit import allocating_kernel, inline, kernel

_CARRY_ROUNDS = 10
"""Rounds in which carried directions are set to the mean of their neighbours."""

__all__ = [
    "around_vertices",
    "carry_from",
    "comb",
    "near_by",
    "nearest_triangles",
    "regions",
    "vertex_vectors",
]


@allocating_kernel
def regions(across: IntArray, part: IntArray) -> int:
    """Assign numbers to the connected pieces, in the order of triangles; return how many there are.

    `across` (T, 3) is the triangle across each edge, −1 for none; `part` (T,) receives the numbers.
    """
    count = len(across)
    part[:] = -1
    queue = np.empty(count, np.int32)
    found = 0
    for seed in range(count):
        if part[seed] >= 0:
            continue
        part[seed] = found
        queue[0] = seed
        done, waiting = 0, 1
        while done < waiting:
            at = queue[done]
            done += 1
            for edge in range(3):
                other = across[at, edge]
                if other >= 0 and part[other] < 0:
                    part[other] = found
                    queue[waiting] = other
                    waiting += 1
        found += 1
    return found


@allocating_kernel
def comb(edges: IntArray, across: IntArray, carried: ComplexArray, z: ComplexArray, fold: int) -> None:
    """Turn directions by multiples of 1/`fold` turn, in place, so that they agree along breadth-first trees.

    `across` and `edges` (T, 3) are the triangle across each edge, −1 for none, and the edge's number in
    `carried` (E,), which maps from the edge's first triangle to its second; the first has the lower number.
    """
    count = len(across)
    seen = np.zeros(count, np.bool_)
    queue = np.empty(count, np.int32)
    for seed in range(count):
        if seen[seed]:
            continue
        seen[seed] = True
        queue[0] = seed
        done, waiting = 0, 1
        while done < waiting:
            at = queue[done]
            done += 1
            for k in range(3):
                other = across[at, k]
                if other < 0 or seen[other]:
                    continue
                seen[other] = True
                queue[waiting] = other
                waiting += 1
                turn = carried[edges[at, k]]
                wanted = z[at] * (turn if at < other else np.conj(turn))
                best, nearest, one = -2.0, z[other], z[other]
                for _ in range(fold):
                    like = one.real * wanted.real + one.imag * wanted.imag
                    if like > best:
                        best, nearest = like, one
                    one = complex(-one.imag, one.real) if fold == 4 else -one
                z[other] = nearest


@kernel
def nearest_triangles(
    corners: FloatArray,
    centres: FloatArray,
    radii: FloatArray,
    points: FloatArray,
    out: IntArray,
    away: FloatArray,
) -> None:
    """Find the triangle nearest to each point, and its distance.

    `corners` (T, 3, 3), `centres` (T, 3) with all corners within `radii` (T,), `points` (N, 3), `out` (N,).
    """
    for n in range(len(points)):
        best = 1e300
        for t in range(len(corners)):
            total = 0.0
            for axis in range(3):
                total += (points[n, axis] - centres[t, axis]) ** 2
            reach = best + radii[t]
            if total >= reach * reach:
                continue
            distance = _distance(corners, t, points, n)
            if distance < best:
                best = distance
                out[n] = t
        away[n] = best


@inline
def _distance(corners: FloatArray, t: int, points: FloatArray, n: int) -> float:
    """Return a point's distance from a triangle: from its interior, or from the nearest of its edges."""
    ee, ff, ef, ep, fp, pp = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for axis in range(3):
        e = corners[t, 1, axis] - corners[t, 0, axis]
        f = corners[t, 2, axis] - corners[t, 0, axis]
        p = points[n, axis] - corners[t, 0, axis]
        ee, ff, ef = ee + e * e, ff + f * f, ef + e * f
        ep, fp, pp = ep + e * p, fp + f * p, pp + p * p
    det = ee * ff - ef * ef
    if det > 0:
        a, b = (ff * ep - ef * fp) / det, (ee * fp - ef * ep) / det
        if a >= 0 and b >= 0 and a + b <= 1:
            inside: float = np.sqrt(max(pp - a * ep - b * fp, 0.0))
            return inside
    best = 1e300
    for edge in range(3):
        along, size = 0.0, 0.0
        for axis in range(3):
            e = corners[t, (edge + 1) % 3, axis] - corners[t, edge, axis]
            along += e * (points[n, axis] - corners[t, edge, axis])
            size += e * e
        share = min(max(along / size, 0.0), 1.0) if size > 0 else 0.0
        total = 0.0
        for axis in range(3):
            at = corners[t, edge, axis] + share * (corners[t, (edge + 1) % 3, axis] - corners[t, edge, axis])
            total += (points[n, axis] - at) ** 2
        best = min(best, total)
    outside: float = np.sqrt(best)
    return outside


@allocating_kernel
def near_by(
    across: IntArray,
    centres: FloatArray,
    seeds: IntArray,
    points: FloatArray,
    radius: float,
    which: IntArray,
    nearness: FloatArray,
) -> None:
    """Find for each triangle the nearest point in whose surroundings it is, and how near it is.

    The surroundings of a point are the triangles within `radius` that are connected to its seed. `which` (T,)
    receives the number of the nearest such point, −1 for none; `nearness` (T,) is 1 at the seed, 0 at
    `radius` and beyond.
    """
    which[:] = -1
    nearness[:] = 0.0
    seen = np.full(len(across), -1, np.int32)
    queue = np.empty(len(across), np.int32)
    for n in range(len(seeds)):
        queue[0] = seeds[n]
        seen[seeds[n]] = n
        done, waiting = 0, 1
        while done < waiting:
            t = queue[done]
            done += 1
            total = 0.0
            for axis in range(3):
                total += (points[n, axis] - centres[t, axis]) ** 2
            near = 1.0 if t == seeds[n] else max(1.0 - np.sqrt(total) / radius, 0.0)
            if near > nearness[t]:
                nearness[t] = near
                which[t] = n
            if near <= 0:
                continue
            for k in range(3):
                other = across[t, k]
                if other >= 0 and seen[other] != n:
                    seen[other] = n
                    queue[waiting] = other
                    waiting += 1


@allocating_kernel
def carry_from(
    across: IntArray,
    edges: IntArray,
    carried: ComplexArray,
    weights: FloatArray,
    seeds: IntArray,
    which: IntArray,
    nearness: FloatArray,
    least: float,
    z: ComplexArray,
) -> None:
    """Carry directions from seeds over the surrounding triangles, straight as if the surface were unrolled.

    Each seed reaches the triangles that have its number in `which`, have a `nearness` above `least`, see
    `near_by`, and are connected to it. `z` (T,) holds the seeds' directions, numbers of size 1 in their
    triangles' planes, 0 elsewhere, and receives the others. A triangle takes the mean of the directions that
    reach it from its sides; these differ where the surface is curved. `across`, `edges`, `carried` and
    `weights` are those of `PlaneFrames`.
    """
    queue = np.empty(len(across), np.int32)
    seen = np.zeros(len(across), np.bool_)
    for n in range(len(seeds)):
        if which[seeds[n]] != n:
            continue
        queue[0], seen[seeds[n]] = seeds[n], True
        done, waiting = 0, 1
        while done < waiting:
            t = queue[done]
            done += 1
            if t != seeds[n]:
                z[t] = _neighbours_mean(across, edges, carried, weights, which, n, t, z)
            for k in range(3):
                other = across[t, k]
                if other >= 0 and not seen[other] and which[other] == n and nearness[other] > least:
                    queue[waiting], seen[other] = other, True
                    waiting += 1
        for _ in range(_CARRY_ROUNDS):
            for m in range(1, waiting):
                z[queue[m]] = _neighbours_mean(across, edges, carried, weights, which, n, queue[m], z)


@inline
def _neighbours_mean(
    across: IntArray,
    edges: IntArray,
    carried: ComplexArray,
    weights: FloatArray,
    which: IntArray,
    n: int,
    t: int,
    z: ComplexArray,
) -> complex:
    # The mean direction of a triangle's neighbours that come from the same seed; its own if they cancel out.
    x, y = 0.0, 0.0
    for k in range(3):
        other = across[t, k]
        if other >= 0 and which[other] == n:
            turn, weight = carried[edges[t, k]], weights[edges[t, k]]
            one = z[other] * (turn if other < t else np.conj(turn))
            x, y = x + weight * one.real, y + weight * one.imag
    length = np.sqrt(x * x + y * y)
    return complex(x / length, y / length) if length > 1e-12 else z[t]


@kernel
def around_vertices(
    triangles: IntArray, neighbours: IntArray, corners: FloatArray, turned: FloatArray, out: FloatArray
) -> None:
    """Sum up a field's rotation around each vertex, in radians: 0 where it is continuous as on a plane.

    `corners` (T, 3) are the triangles' angles. `turned` (T, 3) are the field's counter-clockwise angles over
    each edge, relative to carrying it over. `out` (V,) receives, for each closed ring of triangles, 2π minus
    the corners plus the turns; vertices without a closed ring get 0.
    """
    out[:] = 0.0
    for start in range(len(triangles)):
        for corner in range(3):
            total, lowest = 2 * np.pi, start
            t, k = start, corner
            closed = False
            while True:
                total -= corners[t, k]
                back = (k + 2) % 3
                met = neighbours[t, back]
                if met < 0:
                    break
                total += turned[t, back]
                t, k = met // 3, met % 3
                lowest = min(lowest, t)
                if t == start and k == corner:
                    closed = True
                    break
                if lowest < start:
                    break
            # Each ring counts once, at its lowest triangle.
            if closed and lowest == start:
                out[triangles[start, corner]] += total


@kernel
def corner_fans(neighbours: IntArray, fan: IntArray) -> int:
    """Assign numbers to the fans of triangles around vertices; return how many there are.

    `neighbours` (T, 3) are triangle · 3 + edge across each edge over which a field is continuous, −1 for
    none. `fan` (T, 3) receives, for each corner of a triangle, the number of its fan: the connected triangles
    around its vertex.
    """
    fan[:] = -1
    count = 0
    for start in range(len(neighbours)):
        for corner in range(3):
            if fan[start, corner] >= 0:
                continue
            for way in range(2):
                t, k = start, corner
                while True:
                    fan[t, k] = count
                    # Counter-clockwise over the edge that ends at the vertex, then back over the other.
                    met = neighbours[t, (k + 2) % 3] if way == 0 else neighbours[t, k]
                    if met < 0:
                        break
                    t, k = met // 3, met % 3 if way == 0 else (met + 1) % 3
                    if fan[t, k] >= 0:
                        break
            count += 1
    return count


@kernel
def take_branches(vectors: FloatArray, normals: FloatArray, fold: int, turned: FloatArray) -> None:
    """Turn `turned` (N, 3) about normals (N, 3) to the branches nearest to `vectors` (N, 3), in place."""
    for n in range(len(vectors)):
        x, y, z = _nearest_branch(turned, n, vectors, n, normals, n, fold)
        turned[n, 0], turned[n, 1], turned[n, 2] = x, y, z


@kernel
def vertex_vectors(
    triangles: IntArray,
    vectors: FloatArray,
    weights: FloatArray,
    normals: FloatArray,
    fold: int,
    out: FloatArray,
    heaviest: IntArray,
) -> None:
    """Average the triangles' vectors at their vertices, each in the branch nearest to the heaviest one's.

    `vectors` (T, 3) are unit tangents, `weights` (T,) positive, `normals` (V, 3) unit or zero. `out` (V, 3)
    receives unit tangents, zero at vertices of no triangle. `heaviest` (V,) has room for the numbers of the
    heaviest triangles.
    """
    heaviest[:] = -1
    for t in range(len(triangles)):
        for k in range(3):
            v = triangles[t, k]
            if heaviest[v] < 0 or weights[t] > weights[heaviest[v]]:
                heaviest[v] = t
    out[:] = 0.0
    for t in range(len(triangles)):
        for k in range(3):
            v = triangles[t, k]
            x, y, z = _nearest_branch(vectors, t, vectors, heaviest[v], normals, v, fold)
            out[v, 0] += weights[t] * x
            out[v, 1] += weights[t] * y
            out[v, 2] += weights[t] * z
    for v in range(len(out)):
        best = heaviest[v]
        if best < 0:
            continue
        if not _made_tangent(out, v, normals, 1e-6 * weights[best]):
            for axis in range(3):
                out[v, axis] = vectors[best, axis]
            _made_tangent(out, v, normals, 0.0)


@inline
def _nearest_branch(
    vectors: FloatArray, t: int, others: FloatArray, like: int, normals: FloatArray, v: int, fold: int
) -> tuple[float, float, float]:
    """Return the branch of a vector that is nearest to the vector `like`."""
    x, y, z = vectors[t, 0], vectors[t, 1], vectors[t, 2]
    best = -2.0
    nearest = (x, y, z)
    for _ in range(fold):
        near = x * others[like, 0] + y * others[like, 1] + z * others[like, 2]
        if near > best:
            best = near
            nearest = (x, y, z)
        if fold == 2:
            x, y, z = -x, -y, -z
        else:
            x, y, z = (
                normals[v, 1] * z - normals[v, 2] * y,
                normals[v, 2] * x - normals[v, 0] * z,
                normals[v, 0] * y - normals[v, 1] * x,
            )
    return nearest


@inline
def _made_tangent(vectors: FloatArray, v: int, normals: FloatArray, least: float) -> bool:
    """Make a vector a unit tangent, in place; False if it is shorter than `least`, or zero."""
    off = 0.0
    for axis in range(3):
        off += vectors[v, axis] * normals[v, axis]
    size = 0.0
    for axis in range(3):
        vectors[v, axis] -= off * normals[v, axis]
        size += vectors[v, axis] * vectors[v, axis]
    size = np.sqrt(size)
    if not size > least:
        return False
    for axis in range(3):
        vectors[v, axis] /= size
    return True
