"""Hot loops over the triangles of a mesh: regions, what vertices have of their triangles."""

import numpy as np
from numpy.typing import NDArray

from upholster.jit import allocating_kernel, inline, kernel
from upholster.types import FloatArray, IntArray

ComplexArray = NDArray[np.complex128]

_CARRY_ROUNDS = 10
"""How often directions that were carried are brought to the mean of those beside them."""

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
    """Give numbers to the pieces that hang together, in the order of triangles; return how many.

    `across` (T, 3) is the triangle beyond each edge, −1 for none; `part` (T,) gets the numbers.
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
    """Turn directions by 1/`fold` of a turn, in place, until they agree along trees breadth first.

    `across` and `edges` (T, 3): the triangle beyond each edge, −1 for none, and the edge's number in
    `carried` (E,), which leads from the edge's first triangle to its second; the first has the lower number.
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
    """Find the triangle nearest to each point, and how far away it is.

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
    """Return a point's distance from a triangle: from its inside, or the nearest of its edges."""
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
    beside: float = np.sqrt(best)
    return beside


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
    """Find for each triangle the point whose surroundings it lies in, and how near it is.

    The surroundings of a point are the triangles within `radius` of it that hang together with its seed.
    `which` (T,) gets the number of the nearest such point, −1 for none; `nearness` (T,) 1 at the seed, 0 at
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
    """Carry directions from seeds over the triangles round them, straight on as on a sheet unrolled.

    Each reaches the triangles for which `which` has its number and `nearness` is more than `least`, see
    `near_by`, as far as they hang together with its seed. `z` (T,) has the seeds' directions, numbers of size
    1 in their triangles' planes, 0 elsewhere, and gets the others. A triangle has the mean of what comes from
    the sides, which differs where the surface is curved; `across`, `edges`, `carried` and `weights` are those
    of `PlaneFrames`.
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
                z[t] = _from_beside(across, edges, carried, weights, which, n, t, z)
            for k in range(3):
                other = across[t, k]
                if other >= 0 and not seen[other] and which[other] == n and nearness[other] > least:
                    queue[waiting], seen[other] = other, True
                    waiting += 1
        for _ in range(_CARRY_ROUNDS):
            for m in range(1, waiting):
                z[queue[m]] = _from_beside(across, edges, carried, weights, which, n, queue[m], z)


@inline
def _from_beside(
    across: IntArray,
    edges: IntArray,
    carried: ComplexArray,
    weights: FloatArray,
    which: IntArray,
    n: int,
    t: int,
    z: ComplexArray,
) -> complex:
    # The mean of the directions beside a triangle that come from the same seed, itself if they cancel out.
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
    """Sum up what a field turns round each vertex, in radians: 0 where it goes on as on a plane.

    `corners` (T, 3) angles of the triangles, `turned` (T, 3) how far the field turns over each edge beside
    being carried, counter-clockwise. `out` (V,) gets 2π less the corners plus the turns, of each ring of
    triangles that is closed; vertices without any get 0.
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
            # Each ring counts once, from its lowest triangle on.
            if closed and lowest == start:
                out[triangles[start, corner]] += total


@kernel
def corner_fans(neighbours: IntArray, fan: IntArray) -> int:
    """Give numbers to the fans of triangles round vertices; return how many.

    `neighbours` (T, 3): triangle · 3 + edge beyond each edge over which a field goes on, −1 for none. `fan`
    (T, 3) gets for each triangle's corner the number of the fan that it belongs to: the triangles round its
    vertex that hang together.
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
    """Turn vectors (N, 3) about normals (N, 3) to the branches nearest to `vectors` (N, 3), in place."""
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
    """Average the triangles' vectors at their vertices, each in the branch nearest to the heaviest's.

    `vectors` (T, 3) unit tangents, `weights` (T,) positive, `normals` (V, 3) unit or zero, `out` (V, 3) unit
    tangents (zero at vertices of no triangle), `heaviest` (V,) room for the heaviest triangles' numbers.
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
    """Return the branch of a vector that is nearest to another one, `like`."""
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
