"""Coding a mesh's triangles and vertex positions: encoder and decoder are the same loop (SPEC.md, 5.4).

A front of edges runs over the mesh. For one edge after another, an operation is coded: a triangle with a new
vertex is beyond, one that closes a neighbouring edge too, none …
"""

from typing import Any

from upholster.base.types import int64
from upholster.codec.stream._bit_kernels import BitCoder
from upholster.codec.stream.mesh._mesh_arrays import (
    BORDER,
    OPEN,
    STACKED,
    STATUS,
    TRIANGLES,
    VERTICES,
    WRONG,
    CodedMesh,
    Origin,
)
from upholster.codec.stream.mesh._mesh_number_kernels import (
    PLAIN,
    START_VERTEX,
    VERTEX,
    code_flag,
    code_leftover,
    code_within,
    next_corner,
)
from upholster.runtime.jit import inline, kernel, shared

__all__ = ["code_triangles"]

NEW, CLOSES_BEFORE, CLOSES_AFTER, NONE, KNOWN = 0, 1, 2, 3, 4
"""Operations at an edge of the front: the triangle beyond has a new vertex; it also closes the edge before;
it also closes the edge after; there is none; it has another known vertex."""


@inline
def _can_close(mesh: CodedMesh, gate: int, beside: int, beyond: int) -> bool:
    # Whether one triangle can close the gate and the adjacent edge `beside`, whose other neighbour is
    # `beyond`.
    return bool(mesh.twins[beside] == OPEN and beside != gate and beyond != gate)


@inline
def _next_gate(mesh: CodedMesh) -> int:
    # Take the open edge that was added last; −1 if there is none.
    counts = mesh.counts
    while counts[STACKED] > 0:
        counts[STACKED] -= 1
        edge = mesh.stack[counts[STACKED]]
        if mesh.twins[edge] == OPEN:
            return int(edge)
    return -1


@inline
def _add(mesh: CodedMesh, edge: int) -> None:
    # An edge of a new triangle comes to the front.
    mesh.leaving[mesh.vertices[next_corner(edge)]] = edge
    mesh.stack[mesh.counts[STACKED]] = edge
    mesh.counts[STACKED] += 1


@inline
def _link(mesh: CodedMesh, before: int, after: int) -> None:
    mesh.after[before], mesh.before[after] = after, before


@inline
def _glue(mesh: CodedMesh, edge: int, other: int) -> None:
    mesh.twins[edge], mesh.twins[other] = other, edge


@inline
def _enter(mesh: CodedMesh, origin: Origin, encoding: bool, source: int) -> None:
    # Adds a triangle whose vertices are known; `source` is the encoder's corner that becomes its first.
    t = mesh.counts[TRIANGLES]
    mesh.counts[TRIANGLES] = t + 1
    for k in range(3):
        vertex = mesh.vertices[3 * t + k]
        mesh.degrees[vertex] = min(7, int64(mesh.degrees[vertex]) + 1)
    if encoding:
        origin.done[source // 3] = 1
        origin.corners[t] = source


@shared
def _new_vertex(
    coder: BitCoder,
    mesh: CodedMesh,
    origin: Origin,
    beside: tuple[int, int, int],
    encoding: bool,
    source: int,
) -> int:
    # A new vertex, at the fourth corner of a parallelogram; `beside`: its edge's ends and the vertex across.
    v, p, left = mesh.counts[VERTICES], mesh.positions, mesh.position_leftovers
    if v == p.shape[0]:
        mesh.counts[STATUS] = WRONG
        return 0
    mesh.counts[VERTICES] = v + 1
    a, b, c = beside
    most = int64(0), int64(mesh.limits[0])
    for k in range(3):
        wanted = int64(origin.positions[source, k]) if encoding else int64(0)
        if a >= 0:
            guess = int64(p[a, k]) + p[b, k] - p[c, k]
            around = abs(int64(left[a, k])) + abs(int64(left[b, k]))
            p[v, k] = code_leftover(coder, mesh, 0, around, guess, most, encoding, wanted)
            left[v, k] = p[v, k] - guess
        else:
            guess = int64(p[v - 1, k]) if v > 0 else int64(0)
            p[v, k] = code_within(coder, mesh, PLAIN, guess, most, encoding, wanted)
    if encoding:
        origin.number[source] = v
    return int(v)


@inline
def _known_vertex(coder: BitCoder, mesh: CodedMesh, origin: Origin, encoding: bool, source: int) -> int:
    last = int64(mesh.counts[VERTICES] - 1)
    wanted = int64(origin.number[source]) if encoding else int64(0)
    return int(code_within(coder, mesh, VERTEX, last, (int64(0), last), encoding, wanted))


@shared
def _code_start(coder: BitCoder, mesh: CodedMesh, origin: Origin, encoding: bool) -> None:
    # A triangle that the front does not reach; the new front runs around it the other way.
    first = int64(3 * mesh.counts[TRIANGLES])
    at = int64(0)
    if encoding:
        while origin.done[origin.first[0]]:
            origin.first[0] += 1
        at = int64(origin.first[0])
    for k in range(3):
        source = int64(origin.triangles[at, k]) if encoding else int64(0)
        new = bool(encoding and origin.number[source] < 0)
        if code_flag(coder, mesh, START_VERTEX, encoding, new):
            mesh.vertices[first + k] = _new_vertex(coder, mesh, origin, (-1, -1, -1), encoding, source)
        else:
            mesh.vertices[first + k] = _known_vertex(coder, mesh, origin, encoding, source)
        if mesh.counts[STATUS] < 0:
            return
    _enter(mesh, origin, encoding, 3 * at)
    for k in range(2, -1, -1):
        _add(mesh, first + k)
        _link(mesh, next_corner(first + k), first + k)


@inline
def _across(origin: Origin, gate: int) -> int:
    # In an encoder's mesh, the corner that begins the gate in the adjacent triangle; −1 if none is left.
    first = origin.corners[gate // 3]
    across = origin.neighbours[first // 3, (first + gate) % 3]
    return -1 if across < 0 or origin.done[across // 3] else int(across)


@inline
def _choose(mesh: CodedMesh, origin: Origin, gate: int, across: int) -> int:
    # For an encoder: chooses the operation at the gate.
    if across < 0:
        return NONE
    vertex = origin.number[origin.triangles[across // 3, (across + 2) % 3]]
    if vertex < 0:
        return NEW
    before, after = mesh.before[gate], mesh.after[gate]
    if vertex == mesh.vertices[next_corner(before)] and _can_close(mesh, gate, before, mesh.before[before]):
        return CLOSES_BEFORE
    if vertex == mesh.vertices[after] and _can_close(mesh, gate, after, mesh.after[after]):
        return CLOSES_AFTER
    return KNOWN


@inline
def _code_operation(coder: BitCoder, mesh: CodedMesh, gate: int, encoding: bool, wanted: int) -> int:
    place = 8 * int64(mesh.degrees[mesh.vertices[next_corner(gate)]])
    found = 0
    while found < KNOWN and code_flag(coder, mesh, place + found, encoding, wanted > found):
        found += 1
    return found


@shared
def _advance(mesh: CodedMesh, gate: int, closing: tuple[bool, bool], jump: int) -> None:
    # Replaces the edges that a new triangle closes by its other edges.
    first = int64(mesh.twins[gate])
    left, right = int64(mesh.before[gate]), int64(mesh.after[gate])
    if closing[1]:
        _glue(mesh, right, first + 1)
        right = int64(mesh.after[right])
    else:
        _add(mesh, first + 1)
        _link(mesh, first + 1, right)
        right = first + 1
    if closing[0]:
        _glue(mesh, left, first + 2)
        left = int64(mesh.before[left])
    else:
        _add(mesh, first + 2)
        _link(mesh, left, first + 2)
        left = first + 2
    if jump >= 0:
        _link(mesh, mesh.before[jump], right)
        right = int64(jump)
    _link(mesh, left, right)


@shared
def _code_gate(coder: BitCoder, mesh: CodedMesh, origin: Origin, gate: int, encoding: bool) -> None:
    vertices = mesh.vertices
    across = _across(origin, gate) if encoding else 0
    operation = _code_operation(
        coder, mesh, gate, encoding, _choose(mesh, origin, gate, across) if encoding else 0
    )
    if operation == NONE:
        mesh.twins[gate] = BORDER
        return
    source = int64(origin.triangles[across // 3, (across + 2) % 3]) if encoding else int64(0)
    before, after, jump = mesh.before[gate], mesh.after[gate], int64(-1)
    can_before = _can_close(mesh, gate, before, mesh.before[before])
    can_after = _can_close(mesh, gate, after, mesh.after[after])
    tail, head = int64(vertices[next_corner(gate)]), int64(vertices[gate])
    if operation == NEW:
        across_gate = int64(vertices[next_corner(next_corner(gate))])
        vertex = _new_vertex(coder, mesh, origin, (tail, head, across_gate), encoding, source)
    elif operation == KNOWN:
        vertex = _known_vertex(coder, mesh, origin, encoding, source)
        jump = int64(mesh.leaving[vertex])
        if jump >= 0 and (mesh.twins[jump] >= 0 or jump == gate):
            jump = int64(-1)
    else:
        vertex = vertices[next_corner(before)] if operation == CLOSES_BEFORE else vertices[after]
        if not (can_before if operation == CLOSES_BEFORE else can_after):
            mesh.counts[STATUS] = WRONG
    if mesh.counts[STATUS] < 0:
        return
    first = 3 * mesh.counts[TRIANGLES]
    vertices[first], vertices[first + 1], vertices[first + 2] = tail, head, vertex
    _enter(mesh, origin, encoding, across)
    closes = operation in (CLOSES_BEFORE, CLOSES_AFTER)
    _glue(mesh, gate, first)
    closing = (
        closes and can_before and vertices[next_corner(before)] == vertex,
        closes and can_after and vertices[after] == vertex,
    )
    _advance(mesh, gate, closing, jump)


@kernel
def code_triangles(
    coder: BitCoder, mesh: CodedMesh, origin: Origin, encoding: bool, start: int, stop: int
) -> Any:
    """Code triangles up to, not including, `stop`, and their new vertices."""
    while mesh.counts[TRIANGLES] < stop and mesh.counts[STATUS] == 0:
        gate = _next_gate(mesh)
        if gate < 0:
            _code_start(coder, mesh, origin, encoding)
        else:
            _code_gate(coder, mesh, origin, gate, encoding)
