"""Coding where a mesh's vertices lie: encoder and decoder are the same loop (SPEC.md, section 5.4)."""

from typing import NamedTuple

from upholster.jit import inline, kernel, shared
from upholster.stream._bit_kernels import MISSING, BitCoder
from upholster.stream._mesh_arrays import LACKING, WRONG, Mesh, Origin
from upholster.stream._mesh_number_kernels import bit_length, code_leftover, code_plain, sign_of, size_class
from upholster.types import int64

__all__ = ["code_positions"]

_AXIS = 2


class _Guess(NamedTuple):
    """A coordinate's guess, the mean of how many, how far apart; what neighbours left over, and its sign."""

    value: int
    known: int
    spread: int
    left: int
    sign: int


@inline
def _guess(mesh: Mesh, v: int, k: int) -> _Guess:
    # The mean of the parallelograms that known triangles across suggest.
    p, left = mesh.positions, mesh.position_leftovers
    total, count, low, high = int64(0), int64(0), int64(1 << 40), int64(-(1 << 40))
    around, signs, known = int64(0), int64(0), int64(0)
    corner = int64(mesh.latest_corner[v])
    while corner >= 0:
        t, n = corner // 3, corner % 3
        a, b = int64(mesh.triangles[t, (n + 1) % 3]), int64(mesh.triangles[t, (n + 2) % 3])
        if a < v:
            around += abs(int64(left[a, k]))
            signs += left[a, k]
            known += 1
        if b < v:
            around += abs(int64(left[b, k]))
            signs += left[b, k]
            known += 1
        if a < v and b < v:
            twin = int64(mesh.twins[3 * t + (n + 1) % 3])
            if twin >= 0:
                across = int64(mesh.triangles[twin // 3, (twin + 2) % 3])
                if across < v:
                    value = int64(p[a, k]) + p[b, k] - p[across, k]
                    total += value
                    count += 1
                    low, high = min(low, value), max(high, value)
        corner = int64(mesh.earlier_corners[corner])
    if known > 0:
        around = 2 * around // known
    if count == 0:
        return _Guess(int64(p[v - 1, k]) if v > 0 else int64(0), count, int64(0), around, int64(0))
    return _Guess((2 * total + count) // (2 * count), count, high - low, around, sign_of(signs))


@shared
def _code_vertex(coder: BitCoder, mesh: Mesh, origin: Origin, v: int, encoding: bool) -> int:
    p, left = mesh.positions, mesh.position_leftovers
    before = int64(0)
    for k in range(3):
        guess = _guess(mesh, v, k)
        wanted = int64(origin.positions[origin.vertices[v], k]) - guess.value if encoding else int64(0)
        if guess.known == 0:
            value = code_plain(coder, _AXIS, encoding, wanted)
        else:
            places = (
                min(31, size_class(guess.left)),
                min(3, guess.known) * 32 + min(31, size_class(guess.spread)),
                before if k > 0 else 31 + min(15, bit_length(left[v - 1, 0])),
                min(15, bit_length(left[v - 1, k])) * 16 + min(15, bit_length(left[v - 2, k])),
            )
            signs = (
                guess.sign * 9 + sign_of(left[v - 1, k]) * 3 + (sign_of(left[v, 0]) if k > 0 else 0),
                min(31, size_class(guess.spread)),
            )
            value = code_leftover(coder, k, places, signs, encoding, wanted)
        if value == MISSING:
            return LACKING
        found = guess.value + value
        if found < 0 or found > mesh.limits[0]:
            return WRONG
        left[v, k] = value if guess.known > 0 else 0
        p[v, k] = found
        before = before * 22 + min(21, bit_length(value))
    return 0


@kernel
def code_positions(coder: BitCoder, mesh: Mesh, origin: Origin, encoding: bool, start: int, stop: int) -> int:
    """Code vertices from `start` to, not including, `stop`; return 0, or what is wrong."""
    for v in range(start, stop):
        status = _code_vertex(coder, mesh, origin, v, encoding)
        if status < 0:
            return int(status)
    return 0
