"""Coding seams, islands, parts and parameters: encoder and decoder are the same loop (SPEC.md, 5.4)."""

from typing import Any

import numpy as np

from upholster.base.types import int64
from upholster.codec.stream._bit_kernels import BitCoder
from upholster.codec.stream.mesh._mesh_arrays import (
    LAST_ISLAND,
    LAST_PART,
    MOST_PARAMETER,
    STATUS,
    CodedMesh,
    Origin,
)
from upholster.codec.stream.mesh._mesh_number_kernels import (
    ISLAND,
    PART,
    PLAIN,
    SEAM,
    code_flag,
    code_leftover,
    code_within,
    next_corner,
)
from upholster.geometry._union_kernels import root_of, unite
from upholster.runtime.jit import inline, kernel, shared

__all__ = ["code_islands", "code_seams"]


@inline
def _corner_of(origin: Origin, corner: int) -> Any:
    # The encoder's corner for a coded corner.
    first = int64(origin.corners[corner // 3])
    return first - first % 3 + (first + corner) % 3


@inline
def _is_same(origin: Origin, one: int, other: int) -> bool:
    # Whether two corners of an encoder's mesh have the same parameters.
    here, there = _corner_of(origin, one), _corner_of(origin, other)
    q = origin.parameters
    return bool(
        q[here // 3, here % 3, 0] == q[there // 3, there % 3, 0]
        and q[here // 3, here % 3, 1] == q[there // 3, there % 3, 1]
    )


@inline
def _is_seam(origin: Origin, edge: int, twin: int) -> bool:
    here, there = origin.corners[edge // 3] // 3, origin.corners[twin // 3] // 3
    groups = origin.groups
    if groups[here, 0] != groups[there, 0] or groups[here, 1] != groups[there, 1]:
        return True
    if groups[here, 0] < 0:
        return False
    return not (_is_same(origin, edge, next_corner(twin)) and _is_same(origin, next_corner(edge), twin))


@kernel
def code_seams(
    coder: BitCoder, mesh: CodedMesh, origin: Origin, encoding: bool, start: int, stop: int
) -> Any:
    """Code which edges of triangles from `start` to `stop` are seams; join what meets at the others."""
    for edge in range(3 * start, 3 * stop):
        twin = int64(mesh.twins[edge])
        if twin < 0 or twin > edge:
            continue
        wanted = bool(encoding and _is_seam(origin, edge, twin))
        if not code_flag(coder, mesh, SEAM, encoding, wanted):
            unite(mesh.pieces, edge // 3, twin // 3)
            unite(mesh.wedges, edge, next_corner(twin))
            unite(mesh.wedges, next_corner(edge), twin)


@inline
def _turned(mesh: CodedMesh, corner: int, beside: tuple[int, int], known: tuple[int, int]) -> tuple[int, int]:
    # Predicted parameters of a corner, from the triangle's shape and the parameters of its two other corners,
    # whose places are in `known`. The order of all operations is part of the format.
    p, q = mesh.positions, mesh.parameters
    wa, wb = known
    a, b, c = mesh.vertices[beside[0]], mesh.vertices[beside[1]], mesh.vertices[corner]
    ex, ey, ez = int64(p[b, 0]) - p[a, 0], int64(p[b, 1]) - p[a, 1], int64(p[b, 2]) - p[a, 2]
    dx, dy, dz = int64(p[c, 0]) - p[a, 0], int64(p[c, 1]) - p[a, 1], int64(p[c, 2]) - p[a, 2]
    square = ex * ex + ey * ey + ez * ez
    if square == 0:
        return int64(q[wa, 0]), int64(q[wa, 1])
    nx, ny, nz = float(ey * dz - ez * dy), float(ez * dx - ex * dz), float(ex * dy - ey * dx)
    along = float(ex * dx + ey * dy + ez * dz) / float(square)
    up = np.sqrt(nx * nx + ny * ny + nz * nz) / float(square)
    s, r = float(int64(q[wb, 0]) - q[wa, 0]), float(int64(q[wb, 1]) - q[wa, 1])
    most = float(MOST_PARAMETER)
    fs = float(q[wa, 0]) + (along * s - up * r)
    ft = float(q[wa, 1]) + (along * r + up * s)
    fs, ft = min(most, max(-most, fs)), min(most, max(-most, ft))
    return int64(np.floor(fs + 0.5)), int64(np.floor(ft + 0.5))


@shared
def _code_parameters(coder: BitCoder, mesh: CodedMesh, origin: Origin, corner: int, encoding: bool) -> None:
    q, left = mesh.parameters, mesh.parameter_leftovers
    first = root_of(mesh.wedges, corner)
    if first < corner:
        for j in range(2):
            q[corner, j], left[corner, j] = q[first, j], left[first, j]
        return
    beside = next_corner(corner), next_corner(next_corner(corner))
    a, b = root_of(mesh.wedges, beside[0]), root_of(mesh.wedges, beside[1])
    is_guessed = a < corner and b < corner
    guess = int64(0), int64(0)
    if is_guessed:
        guess = _turned(mesh, corner, beside, (a, b))
    elif corner > 0:
        guess = int64(q[corner - 1, 0]), int64(q[corner - 1, 1])
    source = _corner_of(origin, corner) if encoding else int64(0)
    most = int64(-MOST_PARAMETER), int64(MOST_PARAMETER)
    for j in range(2):
        wanted = int64(origin.parameters[source // 3, source % 3, j]) if encoding else int64(0)
        if is_guessed:
            around = abs(int64(left[a, j])) + abs(int64(left[b, j]))
            q[corner, j] = code_leftover(coder, mesh, 1, around, guess[j], most, encoding, wanted)
            left[corner, j] = q[corner, j] - guess[j]
        else:
            q[corner, j] = code_within(coder, mesh, PLAIN, guess[j], most, encoding, wanted)


@inline
def _code_groups(coder: BitCoder, mesh: CodedMesh, origin: Origin, t: int, encoding: bool) -> None:
    # Island and part of a triangle: those of the first one in its piece, or coded relative to the last ones.
    counts, groups = mesh.counts, mesh.groups
    first = root_of(mesh.pieces, t)
    if first < t:
        groups[t, 0], groups[t, 1] = groups[first, 0], groups[first, 1]
        return
    source = origin.corners[t] // 3 if encoding else 0
    island, part = int64(0), int64(0)
    if encoding:
        island, part = int64(origin.groups[source, 0]), int64(origin.groups[source, 1])
    within = int64(-1), int64(mesh.limits[1] - 1)
    counts[LAST_ISLAND] = code_within(coder, mesh, ISLAND, counts[LAST_ISLAND] + 1, within, encoding, island)
    if mesh.limits[2] > 1:
        within = int64(0), int64(mesh.limits[2] - 1)
        counts[LAST_PART] = code_within(coder, mesh, PART, counts[LAST_PART], within, encoding, part)
    groups[t, 0], groups[t, 1] = counts[LAST_ISLAND], counts[LAST_PART]


@kernel
def code_islands(
    coder: BitCoder, mesh: CodedMesh, origin: Origin, encoding: bool, start: int, stop: int
) -> Any:
    """Code islands, parts and parameters of triangles from `start` to, not including, `stop`."""
    for t in range(start, stop):
        _code_groups(coder, mesh, origin, t, encoding)
        if mesh.groups[t, 0] >= 0:
            for corner in range(3 * t, 3 * t + 3):
                _code_parameters(coder, mesh, origin, corner, encoding)
        if mesh.counts[STATUS] < 0:
            return
