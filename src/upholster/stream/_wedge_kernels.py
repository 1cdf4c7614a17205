"""Coding parts, islands and wedges of a mesh: encoder and decoder are the same loop (SPEC.md, 5.4)."""

from typing import Any

from upholster.jit import inline, kernel, shared
from upholster.stream._bit_kernels import MISSING, BitCoder
from upholster.stream._mesh_arrays import LACKING, LAST_GROUPS, WEDGES, WRONG, Mesh, Origin
from upholster.stream._mesh_number_kernels import code_choice, code_plain
from upholster.types import int64

__all__ = ["code_wedges"]

_LOOKED_AT = 8
"""Wedges of a vertex that are looked at."""

_GROUPS = 3
_GOES_ON, _THIS_WEDGE, _GROUP = 1, 2, 3
_NEW, _FAILED = -1, -3


@inline
def _is_wedge(mesh: Mesh, origin: Origin, wedge: int, corner: int) -> bool:
    # Whether a wedge has the parameters of an encoder's corner.
    q = origin.parameters[corner // 3, corner % 3]
    return bool(mesh.parameters[wedge, 0] == q[0] and mesh.parameters[wedge, 1] == q[1])


@inline
def _corner_of(origin: Origin, corner: int, encoding: bool) -> Any:
    # An encoder's corner of a coded one.
    if not encoding:
        return int64(0)
    first = int64(origin.corners[corner // 3])
    return first - first % 3 + (first + corner) % 3


@inline
def _before(mesh: Mesh, t: int, k: int) -> Any:
    # The corner across edge k of a triangle, if its triangle comes before; else −1.
    twin = int64(mesh.twins[3 * t + k])
    return twin if twin < 3 * t else int64(-1)


@shared
def _code_group(coder: BitCoder, mesh: Mesh, t: int, which: int, encoding: bool, wanted: int) -> Any:
    # Island or part of a triangle: that of one beside it, or told by how far it is from the last one told.
    kind, asked = int64(which * 3), int64(0)
    first, second = int64(-2), int64(-2)
    for k in range(3):
        twin = _before(mesh, t, k)
        if twin < 0:
            continue
        near = int64(mesh.groups[twin // 3, which])
        if near in (first, second):
            continue
        second, first = first, near
        bit = code_choice(coder, _GROUP, kind + asked, 0, encoding, 1 if wanted == near else 0)
        if bit < 0:
            return MISSING
        if bit == 1:
            return near
        asked += 1
    last = mesh.counts[LAST_GROUPS + which]
    value = code_plain(coder, _GROUPS + which, encoding, wanted - last - 1)
    if value == MISSING:
        return MISSING
    mesh.counts[LAST_GROUPS + which] = last + 1 + value
    return last + 1 + value


@shared
def _code_wedge(coder: BitCoder, mesh: Mesh, origin: Origin, corner: int, first: int, encoding: bool) -> int:
    # Which wedge a corner has: `first`, that of a triangle beside it, is looked at first, −1 for none.
    vertex, island = mesh.triangles[corner // 3, corner % 3], mesh.groups[corner // 3, 0]
    source = _corner_of(origin, corner, encoding)
    asked, wedge = int64(0), int64(first if first >= 0 else mesh.latest_wedge[vertex])
    for looked in range(_LOOKED_AT):
        if wedge < 0:
            break
        if mesh.wedge_island[wedge] == island and not (looked > 0 and wedge == first):
            near = 8 if looked == 0 and first >= 0 else 0
            wanted = 1 if encoding and _is_wedge(mesh, origin, wedge, source) else 0
            bit = code_choice(coder, _THIS_WEDGE, near + min(7, asked), 0, encoding, wanted)
            if bit < 0:
                return _FAILED
            if bit == 1:
                return int(wedge)
            asked += 1
        listed = mesh.latest_wedge[vertex] if looked == 0 and first >= 0 else mesh.earlier_wedges[wedge]
        wedge = int64(listed)
    return _NEW


@inline
def _beside(mesh: Mesh, t: int, k: int) -> Any:
    # The wedge of corner k on the triangle across the edge that begins or ends there, −1 where there is none.
    twin = _before(mesh, t, k)
    if twin >= 0:
        return int64(mesh.corner_wedges[twin - twin % 3 + (twin + 1) % 3])
    twin = _before(mesh, t, (k + 2) % 3)
    return int64(mesh.corner_wedges[twin]) if twin >= 0 else int64(-1)


@inline
def _enter(mesh: Mesh, corner: int, wedge: int) -> None:
    mesh.corner_wedges[corner] = wedge
    mesh.wedge_next[corner], mesh.wedge_corners[wedge] = mesh.wedge_corners[wedge], corner


@inline
def _new_wedge(mesh: Mesh, origin: Origin, corner: int, encoding: bool) -> int:
    w = mesh.counts[WEDGES]
    if w == mesh.parameters.shape[0]:
        return WRONG
    mesh.counts[WEDGES] = w + 1
    vertex = mesh.triangles[corner // 3, corner % 3]
    mesh.earlier_wedges[w], mesh.latest_wedge[vertex] = mesh.latest_wedge[vertex], w
    mesh.wedge_island[w] = mesh.groups[corner // 3, 0]
    if encoding:
        source = _corner_of(origin, corner, True)
        for j in range(2):
            mesh.parameters[w, j] = origin.parameters[source // 3, source % 3, j]
    return int(w)


@inline
def _goes_on(mesh: Mesh, origin: Origin, t: int, twin: int) -> bool:
    # Whether an encoder's triangle has island and wedges of its neighbour across its first edge.
    other = twin // 3
    source = _corner_of(origin, 3 * t, True)
    if origin.groups[source // 3, 0] != mesh.groups[other, 0]:
        return False
    if mesh.groups[other, 0] < 0:
        return True
    tail, head = mesh.corner_wedges[3 * other + (twin + 1) % 3], mesh.corner_wedges[twin]
    return _is_wedge(mesh, origin, tail, source) and _is_wedge(
        mesh, origin, head, _corner_of(origin, 3 * t + 1, True)
    )


@inline
def _code_goes_on(coder: BitCoder, mesh: Mesh, origin: Origin, t: int, twin: int, encoding: bool) -> int:
    several, closing = int64(0), int64(0)
    for k in range(2):
        wedge = mesh.latest_wedge[mesh.triangles[t, k]]
        several += 1 if wedge >= 0 and mesh.earlier_wedges[wedge] >= 0 else 0
        closing += 1 if _before(mesh, t, k + 1) >= 0 else 0
    wanted = 1 if encoding and _goes_on(mesh, origin, t, twin) else 0
    return code_choice(coder, _GOES_ON, several, 3 * several + closing, encoding, wanted)


@shared
def _code_triangle(coder: BitCoder, mesh: Mesh, origin: Origin, t: int, encoding: bool) -> int:
    source = _corner_of(origin, 3 * t, encoding) // 3
    if mesh.limits[2] > 1:
        part = _code_group(
            coder, mesh, t, 1, encoding, int64(origin.groups[source, 1]) if encoding else int64(0)
        )
        if part == MISSING:
            return LACKING
        if part < 0 or part >= mesh.limits[2]:
            return WRONG
        mesh.groups[t, 1] = part
    twin, goes_on = _before(mesh, t, 0), int64(0)
    if twin >= 0:
        goes_on = int64(_code_goes_on(coder, mesh, origin, t, twin, encoding))
        if goes_on < 0:
            return LACKING
    if goes_on == 1:
        island = int64(mesh.groups[twin // 3, 0])
    else:
        island = int64(
            _code_group(
                coder, mesh, t, 0, encoding, int64(origin.groups[source, 0]) if encoding else int64(0)
            )
        )
    if island == MISSING:
        return LACKING
    if island < -1 or island >= mesh.limits[1]:
        return WRONG
    mesh.groups[t, 0] = island
    if island < 0:
        return 0
    if goes_on == 1:
        _enter(mesh, 3 * t, mesh.corner_wedges[twin - twin % 3 + (twin + 1) % 3])
        _enter(mesh, 3 * t + 1, mesh.corner_wedges[twin])
    return _code_rest(coder, mesh, origin, t, 2 if goes_on == 1 else 0, encoding)


@inline
def _code_rest(coder: BitCoder, mesh: Mesh, origin: Origin, t: int, start: int, encoding: bool) -> int:
    # The wedges of a triangle from a corner on.
    for k in range(start, 3):
        wedge = _code_wedge(coder, mesh, origin, 3 * t + k, _beside(mesh, t, k), encoding)
        if wedge == _FAILED:
            return LACKING
        if wedge == _NEW:
            wedge = _new_wedge(mesh, origin, 3 * t + k, encoding)
            if wedge < 0:
                return WRONG
        _enter(mesh, 3 * t + k, wedge)
    return 0


@kernel
def code_wedges(coder: BitCoder, mesh: Mesh, origin: Origin, encoding: bool, start: int, stop: int) -> int:
    """Code parts, islands and wedges of triangles from `start` to `stop`; return 0, or what is wrong."""
    for t in range(start, stop):
        status = _code_triangle(coder, mesh, origin, t, encoding)
        if status < 0:
            return int(status)
    return 0
