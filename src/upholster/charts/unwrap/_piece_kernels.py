"""Hot loops over the pieces into which a mesh is cut: connected components, and cutting one in two."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.geometry._union_kernels import root_of, unite
from upholster.runtime.jit import allocating_kernel, inline


@allocating_kernel
def number_pieces(across: IntArray, used: NDArray[np.bool_], piece: IntArray, order: IntArray) -> int:
    """Assign numbers to connected pieces, −1 where not ``used``; return the number of pieces.

    ``across`` (T, 3) as `TriangleMesh.neighbours`. ``piece`` (T,) receives the numbers, ``order`` (T,) the
    triangles piece by piece, each in the order of a search that begins at its first triangle.
    """
    piece[:] = -1
    count, end = 0, 0
    for seed in range(len(across)):
        if not used[seed] or piece[seed] >= 0:
            continue
        piece[seed] = count
        order[end] = seed
        at = end
        end += 1
        while at < end:
            triangle = order[at]
            at += 1
            for k in range(3):
                other = across[triangle, k] // 3
                if across[triangle, k] >= 0 and used[other] and piece[other] < 0:
                    piece[other] = count
                    order[end] = other
                    end += 1
        count += 1
    return count


@allocating_kernel
def number_corners(across: IntArray, order: IntArray, vertex: IntArray) -> int:
    """Assign one number to all corners that meet over edges; return how many numbers there are.

    ``order`` are the triangles in the order in which their corners are numbered; ``vertex`` (T, 3) receives
    the numbers, −1 for triangles that are not in it.
    """
    parent = np.arange(3 * len(across)).astype(np.int32)
    for triangle in range(len(across)):
        for k in range(3):
            other = across[triangle, k]
            if other > 3 * triangle + k:
                far, edge = other // 3, other % 3
                unite(parent, 3 * triangle + k, 3 * far + (edge + 1) % 3)
                unite(parent, 3 * triangle + (k + 1) % 3, 3 * far + edge)
    number = np.full(3 * len(across), -1, np.int32)
    vertex[:] = -1
    count = 0
    for place in range(len(order)):
        triangle = order[place]
        for k in range(3):
            root = root_of(parent, 3 * triangle + k)
            if number[root] < 0:
                number[root] = count
                count += 1
            vertex[triangle, k] = number[root]
    return count


@allocating_kernel
def halve(across: IntArray, centres: FloatArray, members: IntArray, side: IntArray) -> None:
    """Divide a piece into two connected halves: by which of its two ends is nearer along the surface.

    ``centres`` (T, 3) of triangles, ``members`` (N,) the piece's triangles. ``side`` (T,) is −1 for them on
    entry, 0 or 1 on return, and anything else for other triangles. The ends are as far from each other as a
    search back and forth finds.
    """
    heap_key, heap_item = np.empty(4 * len(members) + 4), np.empty(4 * len(members) + 4, np.int32)
    far = members[0]
    ends = np.empty(2, np.int32)
    for _turn in range(2):
        for place in range(len(members)):
            side[members[place]] = -1
        ends[:] = far
        far = _spread(across, centres, ends[:1], side, heap_key, heap_item)
        ends[0] = far
    for place in range(len(members)):
        side[members[place]] = -1
    ends[1] = _spread(across, centres, ends[:1], side, heap_key, heap_item)
    if ends[1] == ends[0]:
        ends[1] = members[0] if ends[0] != members[0] else members[len(members) - 1]
    for place in range(len(members)):
        side[members[place]] = -1
    _spread(across, centres, ends, side, heap_key, heap_item)


@inline
def _spread(
    across: IntArray, centres: FloatArray, seeds: IntArray, side: IntArray, key: FloatArray, item: IntArray
) -> int:
    """Give triangles with side −1 the side of the nearest seed; return the farthest triangle (Dijkstra)."""
    size = 0
    for number in range(len(seeds)):
        size = _push(key, item, size, 0.0, 2 * seeds[number] + number)
    last = seeds[0]
    while size > 0:
        distance, entry = key[0], item[0]
        size = _pop(key, item, size)
        triangle = entry // 2
        if side[triangle] != -1:
            continue
        side[triangle] = entry % 2
        last = triangle
        for k in range(3):
            other = across[triangle, k] // 3
            if across[triangle, k] >= 0 and side[other] == -1:
                step = 0.0
                for axis in range(3):
                    step += (centres[triangle, axis] - centres[other, axis]) ** 2
                size = _push(key, item, size, distance + np.sqrt(step), 2 * other + entry % 2)
    return int(last)


@inline
def _push(key: FloatArray, item: IntArray, size: int, value: float, entry: int) -> int:
    place = size
    while place > 0:
        above = (place - 1) // 2
        if key[above] < value or (key[above] == value and item[above] <= entry):
            break
        key[place], item[place] = key[above], item[above]
        place = above
    key[place], item[place] = value, entry
    return size + 1


@inline
def _pop(key: FloatArray, item: IntArray, size: int) -> int:
    size -= 1
    value, entry = key[size], item[size]
    place = 0
    while 2 * place + 1 < size:
        below = 2 * place + 1
        if below + 1 < size and (
            key[below + 1] < key[below] or (key[below + 1] == key[below] and item[below + 1] < item[below])
        ):
            below += 1
        if value < key[below] or (value == key[below] and entry <= item[below]):
            break
        key[place], item[place] = key[below], item[below]
        place = below
    key[place], item[place] = value, entry
    return size


@allocating_kernel
def count_loops(across: IntArray, vertex: IntArray, vertices: int) -> int:
    """Return the number of loops of a piece's border; its vertices are numbered from 0."""
    parent = np.arange(vertices).astype(np.int32)
    on_border = np.zeros(vertices, np.bool_)
    for triangle in range(len(across)):
        for k in range(3):
            if across[triangle, k] < 0:
                on_border[vertex[triangle, k]] = True
                unite(parent, vertex[triangle, k], vertex[triangle, (k + 1) % 3])
    loops = 0
    for v in range(vertices):
        loops += int(on_border[v] and parent[v] == v)
    return loops


@allocating_kernel
def number_links(ends: IntArray, group: IntArray) -> int:
    """Assign one number to all links that are connected by their ends; return how many numbers there are.

    ``ends`` (N, 2); ``group`` (N,) receives the numbers.
    """
    most = -1
    for n in range(len(ends)):
        most = max(most, ends[n, 0], ends[n, 1])
    parent, number = np.arange(most + 1).astype(np.int32), np.full(most + 1, -1, np.int32)
    for n in range(len(ends)):
        unite(parent, ends[n, 0], ends[n, 1])
    count = 0
    for n in range(len(ends)):
        root = root_of(parent, ends[n, 0])
        if number[root] < 0:
            number[root] = count
            count += 1
        group[n] = number[root]
    return count
