"""Coding what guesses of a mesh's numbers leave over, and flags (SPEC.md, section 5.4)."""

from typing import Any

from upholster.codec._model_kernels import CONTEXTS, code_bit
from upholster.jit import inline, shared
from upholster.stream._bit_kernels import MISSING, NUMBER_COUNTERS, START, BitCoder, code_number
from upholster.types import int64

__all__ = [
    "CHOICE",
    "CHOICE_MIXER",
    "KINDS",
    "MESH_COUNTERS",
    "MESH_INPUTS",
    "OPERATION",
    "OPERATION_MIXER",
    "bit_length",
    "code_choice",
    "code_leftover",
    "code_plain",
    "sign_of",
    "size_class",
]

KINDS = 6
"""Kinds of numbers that have no guess worth the name, see `code_plain`."""

LONGEST = 32
_CONTEXTS = 512
"""Contexts of each of four inputs, for lengths."""

_SIGNS = 256

_AXES = 5
"""x, y, z of positions, s, t of parameters."""

_LENGTHS = KINDS * NUMBER_COUNTERS
_SIGN = _LENGTHS + _AXES * 4 * _CONTEXTS * LONGEST
_DIGITS = _SIGN + _AXES * 2 * _SIGNS
OPERATION = _DIGITS + _AXES * 2 * LONGEST * 8 * 8 + LONGEST
CHOICE = OPERATION + 4096 + 16384 + 8192
MESH_COUNTERS = CHOICE + 2 * 256

_FIRST = 5 * KINDS
OPERATION_MIXER = _FIRST + 8 * _AXES
CHOICE_MIXER = OPERATION_MIXER + 8
MESH_INPUTS = [1] * _FIRST + ([4] * 6 + [2, 2]) * _AXES + [3] * 8 + [2] * 4


@inline
def bit_length(value: int) -> Any:
    """Return how many bits a number has; of a negative one its magnitude."""
    rest, length = abs(int64(value)), int64(0)
    while rest > 0:
        rest >>= 1
        length += 1
    return length


@inline
def size_class(value: int) -> Any:
    """Return a number's magnitude in half octaves: 0 for 0, 1 for 1, 2, 3 for 2, 3, then two a doubling."""
    length = bit_length(value)
    if length < 2:
        return length
    return 2 * length - 2 + ((abs(int64(value)) >> (length - 2)) & 1)


@inline
def sign_of(value: int) -> Any:
    """Return 0, 1, 2 for a number that is 0, positive, negative."""
    return int64(0) if value == 0 else int64(1) if value > 0 else int64(2)


@inline
def code_plain(coder: BitCoder, kind: int, encoding: bool, value: int) -> Any:
    """Code a signed number, see `code_number`."""
    coder.log[0] = 0
    return code_number(coder, kind, 0, encoding, int64(value))


@shared
def code_choice(coder: BitCoder, kind: int, first: int, second: int, encoding: bool, bit: int) -> int:
    """Code a flag of a kind, 0 to 7, from two contexts below 32."""
    a = coder.a
    a[CONTEXTS + 0] = START + CHOICE + kind * 32 + first
    a[CONTEXTS + 1] = START + CHOICE + 256 + kind * 32 + second
    return code_bit(coder.state, coder.data, a, 2, CHOICE_MIXER + kind, 255, encoding, bit)


@shared
def code_leftover(
    coder: BitCoder,
    axis: int,
    places: tuple[int, int, int, int],
    signs: tuple[int, int],
    encoding: bool,
    value: int,
) -> Any:
    """Code a signed number within ±2^31: its bit length, from four contexts; its sign, from two; its bits.

    Contexts are below 512, those of signs below 256.
    """
    a = coder.a
    mixer = _FIRST + 8 * axis
    length, magnitude = int64(0), abs(int64(value))
    full = bit_length(magnitude)
    while length < LONGEST - 1:
        for k in range(4):
            place = (axis * 4 + k) * _CONTEXTS + places[k]
            a[CONTEXTS + k] = START + _LENGTHS + place * LONGEST + length
        more = 1 if full > length else 0
        bit = code_bit(coder.state, coder.data, a, 4, mixer + min(5, length), 255, encoding, more)
        if bit < 0:
            return MISSING
        if bit == 0:
            break
        length += 1
    if length == 0:
        return int64(0)
    for k in range(2):
        a[CONTEXTS + k] = START + _SIGN + (axis * 2 + k) * _SIGNS + signs[k]
    negative = code_bit(coder.state, coder.data, a, 2, mixer + 6, 255, encoding, 1 if value < 0 else 0)
    if negative < 0:
        return MISSING
    found, low = int64(1), min(7, places[0] >> 2)
    for b in range(length - 2, -1, -1):
        place = (axis * LONGEST + length) * 64
        if length - 2 - b < 3:
            a[CONTEXTS + 0] = START + _DIGITS + place + found
            a[CONTEXTS + 1] = START + _DIGITS + _AXES * LONGEST * 64 + place + low * 8 + found
            bit = code_bit(coder.state, coder.data, a, 2, mixer + 7, 255, encoding, (magnitude >> b) & 1)
        else:
            a[CONTEXTS + 0] = START + _DIGITS + 2 * _AXES * LONGEST * 64 + b
            bit = code_bit(coder.state, coder.data, a, 1, mixer + 7, 255, encoding, (magnitude >> b) & 1)
        if bit < 0:
            return MISSING
        found = 2 * found + bit
    return -found if negative else found
