"""Coding flags and numbers of a mesh; errors are kept in its status (SPEC.md, section 5.4)."""

from typing import Any

from upholster.base.types import int64
from upholster.codec.stream._bit_kernels import MISSING, NUMBER_COUNTERS, BitCoder, code_counted, code_number
from upholster.codec.stream.mesh._mesh_arrays import LACKING, STATUS, WRONG, CodedMesh
from upholster.runtime.jit import inline, shared

__all__ = [
    "ISLAND",
    "LEFTOVER",
    "MESH_COUNTERS",
    "PART",
    "PLAIN",
    "SEAM",
    "START_VERTEX",
    "VERTEX",
    "code_flag",
    "code_leftover",
    "code_within",
    "next_corner",
]

VERTEX, ISLAND, PART, PLAIN, LEFTOVER = 0, 1, 2, 3, 4
"""Kinds of numbers: coordinates and parameters without a prediction; from `LEFTOVER` on residuals of
predictions, of coordinates, then of parameters, each by the bit length of the neighbours' residuals."""

_LONGEST = 8
_KINDS = LEFTOVER + 2 * (_LONGEST + 1)

_FLAGS = _KINDS * NUMBER_COUNTERS
SEAM, START_VERTEX = 64, 65
"""Places of flags: earlier places code the operation at an edge, eight for each degree."""

MESH_COUNTERS = _FLAGS + START_VERTEX + 1


@inline
def next_corner(corner: int) -> int:
    """Return the next corner of a triangle."""
    return int(corner - 2 if corner % 3 == 2 else corner + 1)


@shared
def code_flag(coder: BitCoder, mesh: CodedMesh, place: int, encoding: bool, flag: bool) -> bool:
    """Code a flag; False if bytes are missing."""
    coder.log[0] = 0
    bit = code_counted(coder, _FLAGS + place, encoding, 1 if flag else 0)
    if bit < 0:
        mesh.counts[STATUS] = LACKING
    return bit == 1


@shared
def code_within(
    coder: BitCoder,
    mesh: CodedMesh,
    kind: int,
    guess: int,
    most: tuple[int, int],
    encoding: bool,
    value: int,
) -> Any:
    """Code a number within bounds as its difference from a guess; returns the least one on failure."""
    coder.log[0] = 0
    left = code_number(coder, kind, 0, encoding, int64(value - guess) if encoding else int64(0))
    found = guess + left
    if left == MISSING:
        mesh.counts[STATUS] = LACKING
    elif found < most[0] or found > most[1]:
        mesh.counts[STATUS] = WRONG
    else:
        return found
    return int64(most[0])


@inline
def code_leftover(
    coder: BitCoder,
    mesh: CodedMesh,
    what: int,
    beside: int,
    guess: int,
    most: tuple[int, int],
    encoding: bool,
    value: int,
) -> Any:
    """Code a coordinate (0) or a parameter (1) with a good guess; `beside` sums others' residuals."""
    length, rest = 0, int64(beside)
    while rest > 0 and length < _LONGEST:
        rest >>= 1
        length += 1
    kind = LEFTOVER + what * (_LONGEST + 1) + length
    return code_within(coder, mesh, kind, guess, most, encoding, value)
