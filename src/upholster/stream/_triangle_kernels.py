"""Coding which vertices a mesh's triangles have: encoder and decoder are the same loop (SPEC.md, 5.4).

A front runs over the mesh. At one of its edges after the other it is told what lies beyond: a triangle with a
new vertex, one that closes this edge and a neighbouring one, none …
"""

from upholster.codec._model_kernels import CONTEXTS, code_bit
from upholster.jit import inline, kernel, shared
from upholster.stream._bit_kernels import MISSING, START, BitCoder
from upholster.stream._front_kernels import (
    AFTER,
    BEFORE,
    BEHIND,
    BORDER,
    EDGES,
    GONE,
    HEAD,
    JOINED,
    MOST_DELAYS,
    OPERATIONS,
    SOURCE,
    STATE,
    TAIL,
    Front,
    add_edge,
    can_close,
    delay,
    link,
    next_gate,
)
from upholster.stream._mesh_arrays import LACKING, TRIANGLES, VERTICES, WRONG, Mesh, Origin
from upholster.stream._mesh_number_kernels import OPERATION, OPERATION_MIXER, code_choice, code_plain
from upholster.types import int64

__all__ = ["code_triangles"]

NEW, RIGHT, LEFT, BOTH, NONE, LATER, JOIN, KNOWN = 0, 1, 2, 3, 4, 5, 6, 7
"""What lies beyond an edge of the front: a triangle with a new vertex; one that closes the edge after it too,
the one before, both; none; what is told later; one whose vertex another edge of the front begins at; one with
another known vertex."""

_JUMP, _VERTEX = 0, 1
_START_VERTEX = 0


@inline
def _degree(front: Front, vertex: int) -> int:
    return int(min(9, int64(front.degrees[vertex])))


@shared
def _code_operation(coder: BitCoder, mesh: Mesh, front: Front, gate: int, encoding: bool, wanted: int) -> int:
    a, edges, counts = coder.a, front.edges, front.counts
    right, left = can_close(front, gate, AFTER), can_close(front, gate, BEFORE)
    before, after = edges[gate, BEFORE], edges[gate, AFTER]
    both = right and left and before != after and edges[before, TAIL] == edges[after, HEAD]
    sides = (2 if left else 0) + (1 if right else 0)
    at_ends = _degree(front, edges[gate, TAIL]) * 10 + _degree(front, edges[gate, HEAD])
    beyond = _degree(front, edges[before, TAIL]) * 10 + _degree(front, edges[after, HEAD])
    last = int64(counts[OPERATIONS])
    places = (
        START + OPERATION + (at_ends * 4 + sides) * 8,
        START + OPERATION + 4096 + ((last & 511) * 4 + sides) * 8,
        START + OPERATION + 4096 + 16384 + (beyond * 8 + (last & 7)) * 8,
    )
    found = int64(KNOWN)
    for k in range(KNOWN):
        if (
            (k == NEW and mesh.counts[VERTICES] == mesh.positions.shape[0])
            or (k == RIGHT and not right)
            or (k == LEFT and not left)
            or (k == BOTH and not both)
            or (k == LATER and front.delays[gate] == MOST_DELAYS)
        ):
            continue
        for n in range(3):
            a[CONTEXTS + n] = places[n] + k
        asked = 1 if wanted == k else 0
        bit = code_bit(coder.state, coder.data, a, 3, OPERATION_MIXER + k, 255, encoding, asked)
        if bit < 0:
            return LACKING
        if bit == 1:
            found = int64(k)
            break
    counts[OPERATIONS] = (last * 8 + found) & 511
    return int(found)


@inline
def _choose(mesh: Mesh, front: Front, origin: Origin, gate: int) -> int:
    # An encoder's choice: what lies beyond the gate.
    edges = front.edges
    source = edges[gate, SOURCE]
    if source < 0 or origin.done[source // 3]:
        return NONE
    triangle = source // 3
    before, after = edges[gate, BEFORE], edges[gate, AFTER]
    right = can_close(front, gate, AFTER) and edges[after, SOURCE] // 3 == triangle
    left = can_close(front, gate, BEFORE) and edges[before, SOURCE] // 3 == triangle
    if right and left and before != after:
        return BOTH
    if right:
        return RIGHT
    if left:
        return LEFT
    vertex = origin.number[origin.triangles[triangle, (source + 2) % 3]]
    if vertex < 0:
        return NEW
    leaving = origin.leaving[vertex]
    if leaving < 0 or edges[leaving, STATE] == GONE or leaving == gate:
        return KNOWN
    if front.delays[gate] == MOST_DELAYS or origin.delayed_at[gate] == mesh.counts[TRIANGLES]:
        return JOIN
    origin.delayed_at[gate] = mesh.counts[TRIANGLES]
    return LATER


@inline
def _new_vertex(mesh: Mesh, origin: Origin, encoding: bool, source: int) -> int:
    n = mesh.counts[VERTICES]
    mesh.counts[VERTICES] = n + 1
    if encoding:
        origin.number[source], origin.vertices[n] = n, source
    return int(n)


@inline
def _known_vertex(coder: BitCoder, mesh: Mesh, origin: Origin, encoding: bool, source: int) -> int:
    n = mesh.counts[VERTICES]
    back = code_plain(coder, _VERTEX, encoding, n - 1 - origin.number[source] if encoding else 0)
    if back == MISSING:
        return LACKING
    return int(n - 1 - back) if 0 <= back < n else WRONG


@inline
def _start_vertex(coder: BitCoder, mesh: Mesh, origin: Origin, encoding: bool, source: int) -> int:
    # A vertex of a triangle that the front does not lead to.
    n = mesh.counts[VERTICES]
    if n == 0:
        return _new_vertex(mesh, origin, encoding, source)
    if n < mesh.positions.shape[0]:
        wanted = 1 if encoding and origin.number[source] < 0 else 0
        new = code_choice(coder, _START_VERTEX, 0, 0, encoding, wanted)
        if new < 0:
            return LACKING
        if new == 1:
            return _new_vertex(mesh, origin, encoding, source)
    return _known_vertex(coder, mesh, origin, encoding, source)


@inline
def _enter(mesh: Mesh, front: Front, origin: Origin, corners: tuple[int, int, int], source: int) -> int:
    # A further triangle; `source` is an encoder's corner that is its first, −1 in a decoder.
    t = mesh.counts[TRIANGLES]
    mesh.counts[TRIANGLES] = t + 1
    for k in range(3):
        vertex, corner = corners[k], 3 * t + k
        mesh.triangles[t, k] = vertex
        mesh.earlier_corners[corner], mesh.latest_corner[vertex] = mesh.latest_corner[vertex], corner
        front.degrees[vertex] = min(255, int64(front.degrees[vertex]) + 1)
    if source >= 0:
        origin.done[source // 3] = 1
        origin.corners[t] = source
    return int(t)


@inline
def _add(mesh: Mesh, front: Front, origin: Origin, corner: int, source: int) -> int:
    # The edge of the front beyond the edge that begins at a corner; `source` is the triangle's first corner
    # in an encoder's mesh, −1 in a decoder.
    t, k = corner // 3, corner % 3
    tail, head = mesh.triangles[t, (k + 1) % 3], mesh.triangles[t, k]
    across = int64(-1)
    if source >= 0:
        across = int64(origin.neighbours[source // 3, (source + k) % 3])
    edge = add_edge(front, tail, head, corner, across)
    if source >= 0:
        origin.leaving[tail] = edge
    return edge


@shared
def _code_start(coder: BitCoder, mesh: Mesh, front: Front, origin: Origin, encoding: bool) -> int:
    source = int64(-1)
    if encoding:
        at = origin.first[0]
        while origin.done[at]:
            at += 1
        origin.first[0] = at
        source = int64(3 * at)
    a = _start_vertex(coder, mesh, origin, encoding, origin.triangles[source // 3, 0] if encoding else 0)
    if a < 0:
        return a
    b = _start_vertex(coder, mesh, origin, encoding, origin.triangles[source // 3, 1] if encoding else 0)
    if b < 0:
        return b
    c = _start_vertex(coder, mesh, origin, encoding, origin.triangles[source // 3, 2] if encoding else 0)
    if c < 0:
        return c
    found = int64(a), int64(b), int64(c)
    t = _enter(mesh, front, origin, found, source)
    # The front runs round the triangle the other way.
    last = _add(mesh, front, origin, 3 * t + 2, source)
    middle = _add(mesh, front, origin, 3 * t + 1, source)
    first = _add(mesh, front, origin, 3 * t, source)
    link(front, last, middle)
    link(front, middle, first)
    link(front, first, last)
    front.counts[OPERATIONS] = 0
    return 0


@shared
def _vertex_of(
    coder: BitCoder, mesh: Mesh, front: Front, origin: Origin, gate: int, operation: int, encoding: bool
) -> int:
    # The third vertex of the triangle beyond the gate.
    edges = front.edges
    if operation == RIGHT:
        return int(edges[edges[gate, AFTER], HEAD])
    if operation in (LEFT, BOTH):
        return int(edges[edges[gate, BEFORE], TAIL])
    apex = int64(0)
    if encoding:
        source = edges[gate, SOURCE]
        apex = int64(origin.triangles[source // 3, (source + 2) % 3])
    if operation == NEW:
        return _new_vertex(mesh, origin, encoding, apex)
    if operation == KNOWN:
        return _known_vertex(coder, mesh, origin, encoding, apex)
    total = front.counts[EDGES]
    wanted = total - 1 - origin.leaving[origin.number[apex]] if encoding else int64(0)
    back = code_plain(coder, _JUMP, encoding, wanted)
    if back == MISSING:
        return LACKING
    joined = total - 1 - back
    if back < 0 or joined < 0 or joined == gate or edges[joined, STATE] == GONE:
        return WRONG
    front.counts[JOINED] = joined
    return int(edges[joined, TAIL])


@inline
def _glue(mesh: Mesh, front: Front, edge: int, corner: int) -> None:
    # The triangle with this corner closes an edge of the front.
    behind = front.edges[edge, BEHIND]
    mesh.twins[corner], mesh.twins[behind] = behind, corner
    front.edges[edge, STATE] = GONE


@shared
def _advance(mesh: Mesh, front: Front, origin: Origin, gate: int, operation: int, t: int) -> None:
    # Put the edges beyond a new triangle in the place of those that it closes.
    edges = front.edges
    source = edges[gate, SOURCE]
    before, after = int64(edges[gate, BEFORE]), int64(edges[gate, AFTER])
    _glue(mesh, front, gate, 3 * t)
    if operation == BOTH:
        _glue(mesh, front, after, 3 * t + 1)
        _glue(mesh, front, before, 3 * t + 2)
        if edges[before, BEFORE] != after:
            link(front, edges[before, BEFORE], edges[after, AFTER])
    elif operation == RIGHT:
        _glue(mesh, front, after, 3 * t + 1)
        first = _add(mesh, front, origin, 3 * t + 2, source)
        link(front, before, first)
        link(front, first, edges[after, AFTER])
    elif operation == LEFT:
        _glue(mesh, front, before, 3 * t + 2)
        last = _add(mesh, front, origin, 3 * t + 1, source)
        link(front, edges[before, BEFORE], last)
        link(front, last, after)
    else:
        last = _add(mesh, front, origin, 3 * t + 1, source)
        first = _add(mesh, front, origin, 3 * t + 2, source)
        link(front, before, first)
        link(front, last, after)
        if operation == JOIN:
            joined = front.counts[JOINED]
            link(front, edges[joined, BEFORE], last)
            link(front, first, joined)
        else:
            link(front, first, last)


@shared
def _code_gate(coder: BitCoder, mesh: Mesh, front: Front, origin: Origin, gate: int, encoding: bool) -> int:
    edges = front.edges
    wanted = _choose(mesh, front, origin, gate) if encoding else 0
    operation = _code_operation(coder, mesh, front, gate, encoding, wanted)
    if operation < 0:
        return operation
    if operation == NONE:
        edges[gate, STATE] = BORDER
        return 0
    if operation == LATER:
        delay(front, gate)
        return 0
    vertex = _vertex_of(coder, mesh, front, origin, gate, operation, encoding)
    if vertex < 0:
        return vertex
    corners = int64(edges[gate, TAIL]), int64(edges[gate, HEAD]), int64(vertex)
    t = _enter(mesh, front, origin, corners, edges[gate, SOURCE] if encoding else int64(-1))
    _advance(mesh, front, origin, gate, operation, t)
    return 0


@kernel
def code_triangles(
    coder: BitCoder, mesh: Mesh, front: Front, origin: Origin, encoding: bool, stop: int
) -> int:
    """Code triangles up to, not including, `stop`; return 0, or what is wrong, `LACKING` or `WRONG`."""
    while mesh.counts[TRIANGLES] < stop:
        gate = next_gate(front)
        if gate < 0:
            status = _code_start(coder, mesh, front, origin, encoding)
        else:
            status = _code_gate(coder, mesh, front, origin, gate, encoding)
        if status < 0:
            return int(status)
    return 0
