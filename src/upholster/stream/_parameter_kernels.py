"""Coding the parameters of a mesh's wedges: encoder and decoder are the same loop (SPEC.md, section 5.4)."""

from typing import NamedTuple

import numpy as np

from upholster.jit import inline, kernel, shared
from upholster.stream._bit_kernels import MISSING, BitCoder
from upholster.stream._mesh_arrays import LACKING, MOST_PARAMETER, WRONG, Mesh
from upholster.stream._mesh_number_kernels import bit_length, code_leftover, code_plain, sign_of, size_class
from upholster.types import int64

__all__ = ["code_parameters"]

_PARAMETER = 5
_AXIS = 3


@inline
def _turned(mesh: Mesh, t: int, k: int) -> tuple[int, int]:
    # Where the parameters of corner k should lie, from those of the two others and the triangle's shape. The
    # order of all operations is part of the format.
    p, q = mesh.positions, mesh.parameters
    a, b, c = mesh.triangles[t, (k + 1) % 3], mesh.triangles[t, (k + 2) % 3], mesh.triangles[t, k]
    wa, wb = mesh.corner_wedges[3 * t + (k + 1) % 3], mesh.corner_wedges[3 * t + (k + 2) % 3]
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


class _Guess(NamedTuple):
    """The mean of guesses of s and t, of how many, and how far apart they lie.

    Then sizes and signs of what the guesses of wedges beside left over, and the size of an edge.
    """

    s: int
    t: int
    known: int
    spread: int
    left_s: int
    left_t: int
    sign_s: int
    sign_t: int
    size: int


@inline
def _guess(mesh: Mesh, w: int) -> _Guess:
    q, left = mesh.parameters, mesh.parameter_leftovers
    s, r, count, spread, size = int64(0), int64(0), int64(0), int64(0), int64(0)
    last_s, last_r, one = int64(0), int64(0), int64(-1)
    left_s, left_t, sign_s, sign_t = int64(0), int64(0), int64(0), int64(0)
    corner = int64(mesh.wedge_corners[w])
    while corner >= 0:
        t, k = corner // 3, corner % 3
        wa = int64(mesh.corner_wedges[3 * t + (k + 1) % 3])
        wb = int64(mesh.corner_wedges[3 * t + (k + 2) % 3])
        if wa < w and wb < w:
            gs, gt = _turned(mesh, t, k)
            if count > 0:
                spread = max(spread, abs(gs - last_s) + abs(gt - last_r))
            last_s, last_r = gs, gt
            s, r, count = s + gs, r + gt, count + 1
            left_s += abs(int64(left[wa, 0])) + abs(int64(left[wb, 0]))
            left_t += abs(int64(left[wa, 1])) + abs(int64(left[wb, 1]))
            sign_s += left[wa, 0] + left[wb, 0]
            sign_t += left[wa, 1] + left[wb, 1]
            size = abs(int64(q[wa, 0]) - q[wb, 0]) + abs(int64(q[wa, 1]) - q[wb, 1])
        elif wa < w:
            one = max(one, wa)
        elif wb < w:
            one = max(one, wb)
        corner = int64(mesh.wedge_next[corner])
    if count == 0:
        if one >= 0:
            s, r = int64(q[one, 0]), int64(q[one, 1])
        return _Guess(s, r, count, spread, left_s, left_t, sign_s, sign_t, size)
    s, r = (2 * s + count) // (2 * count), (2 * r + count) // (2 * count)
    return _Guess(s, r, count, spread, left_s // count, left_t // count, sign_s, sign_t, size)


@shared
def _code_wedge(coder: BitCoder, mesh: Mesh, w: int, encoding: bool) -> int:
    q, left = mesh.parameters, mesh.parameter_leftovers
    guess = _guess(mesh, w)
    before = int64(0)
    for j in range(2):
        value = guess.s if j == 0 else guess.t
        wanted = int64(q[w, j]) - value if encoding else int64(0)
        if guess.known == 0:
            rest = code_plain(coder, _PARAMETER, encoding, wanted)
        else:
            known = guess.left_s if j == 0 else guess.left_t
            sign = sign_of(guess.sign_s if j == 0 else guess.sign_t)
            places = (
                min(31, size_class(known)),
                min(3, guess.known) * 32 + min(31, size_class(guess.spread)),
                before if j > 0 else 32 + min(15, bit_length(left[w - 1, 0])),
                min(15, bit_length(guess.size)) * 16 + min(15, bit_length(left[w - 1, j])),
            )
            signs = (
                sign * 9 + sign_of(left[w - 1, j]) * 3 + (sign_of(left[w, 0]) if j > 0 else 0),
                min(31, size_class(guess.spread)),
            )
            rest = code_leftover(coder, _AXIS + j, places, signs, encoding, wanted)
        if rest == MISSING:
            return LACKING
        if abs(value + rest) > MOST_PARAMETER:
            return WRONG
        q[w, j] = value + rest
        left[w, j] = rest if guess.known > 0 else 0
        before = min(31, bit_length(rest))
    return 0


@kernel
def code_parameters(coder: BitCoder, mesh: Mesh, encoding: bool, start: int, stop: int) -> int:
    """Code parameters of wedges from `start` to `stop`, return 0 or what is wrong; an encoder has them."""
    for w in range(start, stop):
        status = _code_wedge(coder, mesh, w, encoding)
        if status < 0:
            return int(status)
    return 0
