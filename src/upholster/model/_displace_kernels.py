"""Kernels of displaced meshes: evaluating the height map, bisecting edges, moving vertices.

A *side* is an edge as seen from one triangle: number 3·triangle + k runs from corner k to corner k + 1. The
sides of one edge form a ring by `Growing.next_side`, so an edge may have any number of triangles.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.runtime.jit import inline, kernel, shared

__all__ = ["MOST_STEPS", "Growing", "HeightField", "measure_spacing", "move_vertices", "refine_triangles"]

MOST_STEPS = 16
"""Greatest number of texels of the finest level along an edge, and of steps in which it is compared with the
map."""

_TOO_LONG = 1e20  # times their length: long sides come before all others, longest first
_MITRE = 0.5  # least cosine between a crease's sides and its vertex's direction in the mitre


class HeightField(NamedTuple):
    """The displacement of the surface at each place of each chart."""

    values: NDArray[np.float32]  # heights, level by level, chart by chart
    levels: NDArray[np.int64]  # (charts, levels, 3): first value, height, width
    texel: float  # chart texels per texel of level 0
    amount: float  # displacement at height 1, in model units
    mid: float  # the height that does not move
    kept: NDArray[np.float64]  # (2, 3): least and greatest corner of the box that does not move
    falloff: float  # model units around the box over which the displacement sets in


class Growing(NamedTuple):
    """Triangles while edges are bisected: arrays with spare room."""

    positions: NDArray[np.float64]  # (V, 3)
    corners: NDArray[np.int32]  # (T, 3)
    places: NDArray[np.float32]  # (T, 3, 2): of the corners on the triangle's chart, in texels
    normals: NDArray[np.float32]  # (T, 3, 3): displacement of the corners at height 1, per side of a crease
    chart: NDArray[np.int32]  # (T,); −1: without texture
    edges: NDArray[np.int32]  # (T, 3): the edge of each side
    next_side: NDArray[np.int32]  # (3·T,)
    side: NDArray[np.int32]  # (E,): one side of each edge; −1: removed
    keys: NDArray[np.float32]  # (E,) of the heap: errors times lengths
    heap: NDArray[np.int32]  # (E,): edges, the largest key first


@inline
def kept_weight(field: HeightField, x: float, y: float, z: float) -> float:
    """Return the share of the displacement at a point: 0 in the kept box, 1 beyond the falloff."""
    low, high = field.kept[0], field.kept[1]
    dx = max(low[0] - x, x - high[0], 0.0)
    dy = max(low[1] - y, y - high[1], 0.0)
    dz = max(low[2] - z, z - high[2], 0.0)
    t = math.sqrt(dx * dx + dy * dy + dz * dz)
    if t >= field.falloff:
        return 1.0
    t /= field.falloff
    return t * t * (3.0 - 2.0 * t)


@inline
def height_at(field: HeightField, chart: int, level: int, row: float, column: float) -> float:
    """Return the height at a place on a chart, in texels, bilinear between texels of one level."""
    first, height, width = field.levels[chart, level]
    texel = field.texel * (1 << level)
    r = min(max(row / texel - 0.5, 0.0), height - 1.0)
    c = min(max(column / texel - 0.5, 0.0), width - 1.0)
    top, left = int(r), int(c)
    bottom, right = min(top + 1, height - 1), min(left + 1, width - 1)
    r -= top
    c -= left
    values = field.values
    upper = values[first + top * width + left] * (1.0 - c) + values[first + top * width + right] * c
    lower = values[first + bottom * width + left] * (1.0 - c) + values[first + bottom * width + right] * c
    return float(upper * (1.0 - r) + lower * r)


@inline
def filtered_height(field: HeightField, chart: int, spacing: float, row: float, column: float) -> float:
    """Return the height at a place, averaged for vertices that are `spacing` texels apart.

    Interpolates between two levels; the coarser one's texels are half the spacing or more (Williams 1983).
    """
    most = field.levels.shape[1] - 1
    detail = min(max(math.log2(max(spacing / field.texel, 1e-9)) - 1.0, 0.0), float(most))
    level = min(int(detail), most)
    found = height_at(field, chart, level, row, column)
    share = detail - level
    if share > 0.0:
        found += share * (height_at(field, chart, level + 1, row, column) - found)
    return found


@inline
def side_length(mesh: Growing, triangle: int, k: int) -> float:
    """Return the length of a side on its chart, in texels."""
    last = (k + 1) % 3
    rows = mesh.places[triangle, last, 0] - mesh.places[triangle, k, 0]
    columns = mesh.places[triangle, last, 1] - mesh.places[triangle, k, 1]
    return math.sqrt(rows * rows + columns * columns)


@shared
def side_error(mesh: Growing, field: HeightField, triangle: int, k: int) -> float:
    """Return how far the displacement along a side is from linear, in model units; large for long sides."""
    chart = mesh.chart[triangle]
    if chart < 0:
        return 0.0
    length = side_length(mesh, triangle, k) / field.texel
    if length > MOST_STEPS:
        return _TOO_LONG * length
    steps = math.ceil(length)
    if steps < 2:
        return 0.0
    last = (k + 1) % 3
    a, b = mesh.positions[mesh.corners[triangle, k]], mesh.positions[mesh.corners[triangle, last]]
    row, column = mesh.places[triangle, k, 0], mesh.places[triangle, k, 1]
    rows, columns = mesh.places[triangle, last, 0] - row, mesh.places[triangle, last, 1] - column
    worst = 0.0
    first = (height_at(field, chart, 0, row, column) - field.mid) * kept_weight(field, a[0], a[1], a[2])
    end = height_at(field, chart, 0, row + rows, column + columns) - field.mid
    end *= kept_weight(field, b[0], b[1], b[2])
    for step in range(1, steps):
        t = step / steps
        here = height_at(field, chart, 0, row + t * rows, column + t * columns) - field.mid
        here *= kept_weight(
            field, a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])
        )
        worst = max(worst, abs(here - (first + t * (end - first))))
    return worst * abs(field.amount)


@shared
def edge_error(mesh: Growing, field: HeightField, edge: int) -> tuple[float, float]:
    """Return the largest error of an edge's sides, and that of error times length; only the edge matters."""
    start = mesh.side[edge]
    side, worst, weight = start, 0.0, 0.0
    while True:
        error = side_error(mesh, field, side // 3, side % 3)
        worst = max(worst, error)
        weight = max(weight, error * side_length(mesh, side // 3, side % 3))
        side = mesh.next_side[side]
        if side == start:
            return worst, weight


@inline
def is_longer(mesh: Growing, side: int, other: int) -> bool:
    """Return whether a side is longer than another in space; ties are broken consistently."""
    a, b = mesh.corners[side // 3, side % 3], mesh.corners[side // 3, (side % 3 + 1) % 3]
    c, d = mesh.corners[other // 3, other % 3], mesh.corners[other // 3, (other % 3 + 1) % 3]
    x, y = mesh.positions[a], mesh.positions[b]
    z, w = mesh.positions[c], mesh.positions[d]
    one = (x[0] - y[0]) ** 2 + (x[1] - y[1]) ** 2 + (x[2] - y[2]) ** 2
    two = (z[0] - w[0]) ** 2 + (z[1] - w[1]) ** 2 + (z[2] - w[2]) ** 2
    if one != two:
        return bool(one > two)
    if max(a, b) != max(c, d):
        return bool(max(a, b) > max(c, d))
    return bool(min(a, b) > min(c, d))


@inline
def longest_side(mesh: Growing, triangle: int) -> int:
    """Return the longest side of a triangle."""
    best = 3 * triangle
    for side in range(best + 1, best + 3):
        if is_longer(mesh, side, best):
            best = side
    return best


@inline
def push(mesh: Growing, size: int, edge: int, key: float) -> int:
    """Add an edge to the heap; return the heap's new size. Among equal keys the older edge comes first."""
    at = size
    while at > 0:
        above = (at - 1) >> 1
        if mesh.keys[above] > key or (mesh.keys[above] == key and mesh.heap[above] < edge):
            break
        mesh.keys[at], mesh.heap[at] = mesh.keys[above], mesh.heap[above]
        at = above
    mesh.keys[at], mesh.heap[at] = key, edge
    return size + 1


@inline
def drop_first(mesh: Growing, size: int) -> int:
    """Remove the heap's first edge; return its new size."""
    size -= 1
    key, edge = mesh.keys[size], mesh.heap[size]
    at = 0
    while True:
        below = 2 * at + 1
        if below >= size:
            break
        right = below + 1
        if right < size and (
            mesh.keys[right] > mesh.keys[below]
            or (mesh.keys[right] == mesh.keys[below] and mesh.heap[right] < mesh.heap[below])
        ):
            below = right
        if key > mesh.keys[below] or (key == mesh.keys[below] and edge < mesh.heap[below]):
            break
        mesh.keys[at], mesh.heap[at] = mesh.keys[below], mesh.heap[below]
        at = below
    mesh.keys[at], mesh.heap[at] = key, edge
    return size


@inline
def replace_side(mesh: Growing, old: int, new: int) -> None:
    """Transfer a side's place in its ring, and its edge, to another side."""
    edge = mesh.edges[old // 3, old % 3]
    mesh.edges[new // 3, new % 3] = edge
    if mesh.side[edge] == old:
        mesh.side[edge] = new
    before = old
    while mesh.next_side[before] != old:
        before = mesh.next_side[before]
    if before == old:
        mesh.next_side[new] = new
    else:
        mesh.next_side[new] = mesh.next_side[old]
        mesh.next_side[before] = new


@inline
def join_side(mesh: Growing, edge: int, side: int) -> None:
    """Add a side to the ring of an edge, which may have none yet."""
    mesh.edges[side // 3, side % 3] = edge
    if mesh.side[edge] < 0:
        mesh.side[edge] = side
        mesh.next_side[side] = side
    else:
        mesh.next_side[side] = mesh.next_side[mesh.side[edge]]
        mesh.next_side[mesh.side[edge]] = side


@inline
def set_middle(mesh: Growing, triangle: int, corner: int, source: int, k: int) -> None:
    """Set a corner's place and normal to those of the midpoint of a triangle's side k."""
    last = (k + 1) % 3
    for axis in range(2):
        mesh.places[triangle, corner, axis] = 0.5 * (
            mesh.places[source, k, axis] + mesh.places[source, last, axis]
        )
    for axis in range(3):
        mesh.normals[triangle, corner, axis] = 0.5 * (
            mesh.normals[source, k, axis] + mesh.normals[source, last, axis]
        )


@inline
def copy_corner(mesh: Growing, triangle: int, corner: int, source: int, k: int) -> None:
    """Copy a corner of another triangle to a corner of a triangle."""
    mesh.corners[triangle, corner] = mesh.corners[source, k]
    for axis in range(2):
        mesh.places[triangle, corner, axis] = mesh.places[source, k, axis]
    for axis in range(3):
        mesh.normals[triangle, corner, axis] = mesh.normals[source, k, axis]


@shared
def bisect(mesh: Growing, edge: int, counts: NDArray[np.int64]) -> None:
    """Cut an edge, and each of its triangles, at its middle. `counts`: current vertices, triangles, edges.

    The new edges are the last ones: the halves, then one across each triangle.
    """
    start = mesh.side[edge]
    a, b = mesh.corners[start // 3, start % 3], mesh.corners[start // 3, (start % 3 + 1) % 3]
    middle = counts[0]
    counts[0] += 1
    for axis in range(3):
        mesh.positions[middle, axis] = 0.5 * (mesh.positions[a, axis] + mesh.positions[b, axis])
    half_a, half_b = counts[2], counts[2] + 1
    counts[2] += 2
    mesh.side[half_a] = mesh.side[half_b] = mesh.side[edge] = -1
    side = start
    while True:
        following = mesh.next_side[side]
        old, k = side // 3, side % 3
        last, top = (k + 1) % 3, (k + 2) % 3
        new, across = counts[1], counts[2]
        counts[1] += 1
        counts[2] += 1
        mesh.side[across] = -1
        from_a = mesh.corners[old, k] == a
        # The new triangle is (middle, last, top); the old one becomes (first, middle, top).
        mesh.chart[new] = mesh.chart[old]
        mesh.corners[new, 0] = middle
        set_middle(mesh, new, 0, old, k)
        copy_corner(mesh, new, 1, old, last)
        copy_corner(mesh, new, 2, old, top)
        copy_corner(mesh, old, last, new, 0)
        replace_side(mesh, 3 * old + last, 3 * new + 1)
        join_side(mesh, half_a if from_a else half_b, 3 * old + k)
        join_side(mesh, half_b if from_a else half_a, 3 * new)
        join_side(mesh, across, 3 * old + last)
        join_side(mesh, across, 3 * new + 2)
        side = following
        if side == start:
            return


@inline
def longest_nearby(mesh: Growing, edge: int) -> tuple[int, int]:
    """Return the longest edge of an edge's triangles, and how many triangles the edge itself has."""
    start = mesh.side[edge]
    side, best, count = start, start, 0
    while True:
        longest = longest_side(mesh, side // 3)
        if is_longer(mesh, longest, best):
            best = longest
        count += 1
        side = mesh.next_side[side]
        if side == start:
            return mesh.edges[best // 3, best % 3], count


@kernel
def refine_triangles(
    mesh: Growing, field: HeightField, tolerance: float, most: int, counts: NDArray[np.int64]
) -> float:
    """Bisect edges until all errors are below a tolerance, or the limit of triangles is reached.

    The edge with the largest error times length comes first. This avoids spending triangles on single texels
    of grain while larger triangles have almost the same error. An edge is cut only if it is the longest of
    its triangles; otherwise their longest edges are cut first (Rivara 1997). So triangles keep their shape,
    and there are no cracks. `counts` has vertices, triangles and edges; triangles end at `most`. Returns the
    largest remaining error.
    """
    size = 0
    for edge in range(counts[2]):
        error, weight = edge_error(mesh, field, edge)
        if error > tolerance:
            size = push(mesh, size, edge, weight)
    while size > 0:
        wanted = mesh.heap[0]
        if mesh.side[wanted] < 0:
            size = drop_first(mesh, size)
            continue
        edge, count = wanted, 0
        while True:
            longer, count = longest_nearby(mesh, edge)
            if longer == edge:
                break
            edge = longer
        if counts[1] + count > most:
            break
        made = counts[2]
        bisect(mesh, edge, counts)
        for each in range(made, counts[2]):
            error, weight = edge_error(mesh, field, each)
            if error > tolerance:
                size = push(mesh, size, each, weight)
    worst = 0.0
    for at in range(size):
        if mesh.side[mesh.heap[at]] >= 0:
            worst = max(worst, edge_error(mesh, field, mesh.heap[at])[0])
    return worst


@kernel
def measure_spacing(mesh: Growing, count: int, spacing: NDArray[np.float32]) -> None:
    """Find the shortest side in texels at each vertex: `spacing`, filled with large numbers on entry."""
    for triangle in range(count):
        if mesh.chart[triangle] >= 0:
            for k in range(3):
                length = side_length(mesh, triangle, k)
                for corner in (k, (k + 1) % 3):
                    vertex = mesh.corners[triangle, corner]
                    spacing[vertex] = min(spacing[vertex], length)


@inline
def corner_angle(mesh: Growing, triangle: int, k: int) -> float:
    """Return a triangle's angle at a corner, in radians; 0 if it is degenerate."""
    x = mesh.positions[mesh.corners[triangle, k]]
    y = mesh.positions[mesh.corners[triangle, (k + 1) % 3]]
    z = mesh.positions[mesh.corners[triangle, (k + 2) % 3]]
    ax, ay, az = y[0] - x[0], y[1] - x[1], y[2] - x[2]
    bx, by, bz = z[0] - x[0], z[1] - x[1], z[2] - x[2]
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return math.atan2(math.sqrt(cx * cx + cy * cy + cz * cz), ax * bx + ay * by + az * bz)


@kernel
def move_vertices(
    mesh: Growing,
    field: HeightField,
    counts: NDArray[np.int64],
    spacing: NDArray[np.float32],
    sums: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Displace vertices into `out` (V, 3), with `spacing` from `measure_spacing`; `sums` (V, 7) begins as 0.

    A vertex moves along the mean of its corners' normals, weighted by their angles, by the mean of its
    charts' heights. Where corners' normals differ, at creases, it moves farther, so that the adjacent faces
    move by that height (a mitre): at most twice as far.
    """
    for triangle in range(counts[1]):
        chart = mesh.chart[triangle]
        for k in range(3):
            vertex, angle = mesh.corners[triangle, k], corner_angle(mesh, triangle, k)
            height = field.mid
            if chart >= 0:
                row, column = mesh.places[triangle, k, 0], mesh.places[triangle, k, 1]
                height = filtered_height(field, chart, spacing[vertex], row, column)
            own, normal = sums[vertex], mesh.normals[triangle, k]
            length = math.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
            if length > 0.0:
                for axis in range(3):
                    own[axis] += angle * normal[axis] / length
                own[3] += angle * height
                own[4] += angle
                own[6] += angle * length
            if chart < 0:
                own[5] = 1.0
    for vertex in range(counts[0]):
        own = sums[vertex]
        length = math.sqrt(own[0] * own[0] + own[1] * own[1] + own[2] * own[2])
        distance = 0.0
        if own[4] > 0.0 and length > 1e-6 * own[4] and own[5] == 0.0:
            x, y, z = mesh.positions[vertex]
            # The length of the unit normals' mean is their mean cosine with its direction.
            distance = field.amount * (own[3] / own[4] - field.mid) * kept_weight(field, x, y, z)
            distance *= own[6] / own[4] / max(length / own[4], _MITRE) / length
        for axis in range(3):
            out[vertex, axis] = mesh.positions[vertex, axis] + distance * own[axis]
