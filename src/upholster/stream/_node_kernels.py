"""Coding the nodes of warp fields: encoder and decoder are the same loop (SPEC.md, section 5.3)."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS
from upholster.jit import allocating_kernel, inline
from upholster.stream._bit_kernels import MISSING, START, BitCoder, begin, logged_bit, undo
from upholster.types import int64

__all__ = ["LONGEST", "NODE_COUNTERS", "NODE_INPUTS", "code_nodes"]

_STEPS = 6
LONGEST = 20
"""Magnitudes from here on are told in ten plain bits."""

_GUESSES, _BEFORE, _ROUND = 4 * 125 * _STEPS, 4 * 75 * _STEPS, 4 * 16 * (LONGEST + 1)
_PLAIN = _GUESSES + _BEFORE + _ROUND
NODE_COUNTERS = _PLAIN + 1
NODE_INPUTS = [3] * 12 + [1]
"""How many contexts each mixer weighs: of each component the zero, the sign, the magnitude; plain bits."""

_PLAIN_BITS = 10


@inline
def _clip(value: int, most: int) -> int:
    return min(most, max(-most, value))


class Guess(NamedTuple):
    """What a number of a node is likely to be, and how far three other guesses lie from that."""

    value: int
    x: int
    y: int
    z: int


@inline
def _wrapped(change: int) -> int:
    # An angle's change, the short way round.
    return ((change + 128) & 255) - 128


@inline
def _guess(nodes: NDArray[np.int16], first: NDArray[np.int16], i: int, j: int, k: int) -> Guess:
    x, y, z = int64(0), int64(0), int64(0)
    if i == 0 and j == 0:
        guess = int64(first[k])
    elif i == 0:
        guess = int64(nodes[0, j - 1, k])
        if j > 1:
            x = guess - nodes[0, j - 2, k]
    elif j == 0:
        guess = int64(nodes[i - 1, 0, k])
        if i > 1:
            y = guess - nodes[i - 2, 0, k]
        if nodes.shape[1] > 1:
            z = int64(nodes[i - 1, 1, k]) - guess
    else:
        west, north = int64(nodes[i, j - 1, k]), int64(nodes[i - 1, j, k])
        guess = west + north - nodes[i - 1, j - 1, k]
        if j > 1:
            x = 2 * west - nodes[i, j - 2, k] - guess
        if i > 1:
            y = 2 * north - nodes[i - 2, j, k] - guess
        if j + 1 < nodes.shape[1]:
            # The slope down the next column, as steep as beside it.
            z = west + nodes[i - 1, j + 1, k] - north - guess
    if k == 2:
        x, y, z = _wrapped(x), _wrapped(y), _wrapped(z)
    return Guess(guess, x, y, z)


@inline
def _places(left: NDArray[np.int16], guess: Guess, i: int, j: int, k: int) -> tuple[int, int, int]:
    # Where the three contexts of a number's first symbol lie, by the other guesses, and by what guesses left
    # over round it.
    beside = int64(left[i, j - 1, k]) if j > 0 else int64(0)
    above = int64(left[i - 1, j, k]) if i > 0 else int64(0)
    corner = int64(left[i - 1, j + 1, k]) if i > 0 and j + 1 < left.shape[1] else int64(0)
    before = int64(left[i, j, k - 1]) if k > 0 else int64(0)
    guesses = (_clip(guess.x, 2) + 2) * 25 + (_clip(guess.y, 2) + 2) * 5 + _clip(guess.z, 2) + 2
    around = (_clip(beside, 2) + 2) * 15 + (_clip(above, 2) + 2) * 3 + _clip(before, 1) + 1
    spread = min(15, abs(beside) + abs(above) + abs(corner))
    return (
        START + (k * 125 + guesses) * _STEPS,
        START + _GUESSES + (k * 75 + around) * _STEPS,
        START + _GUESSES + _BEFORE + (k * 16 + spread) * (LONGEST + 1),
    )


@inline
def _code_plain(coder: BitCoder, number: int, encoding: bool) -> Any:
    a = coder.a
    a[CONTEXTS + 0] = START + _PLAIN
    found = int64(0)
    for b in range(_PLAIN_BITS - 1, -1, -1):
        bit = logged_bit(coder, 1, 12, encoding, (number >> b) & 1)
        if bit < 0:
            return MISSING
        found = 2 * found + bit
    return found


@inline
def _code_residual(
    coder: BitCoder, places: tuple[int, int, int], k: int, residual: int, encoding: bool
) -> Any:
    # What a guess leaves over: is it 0; its sign; is it more than 1, than 2, …
    a = coder.a
    magnitude, found, sign = abs(residual), int64(0), int64(0)
    for step in range(LONGEST + 1):
        near = min(step, _STEPS - 1)
        a[CONTEXTS + 0], a[CONTEXTS + 1] = places[0] + near, places[1] + near
        a[CONTEXTS + 2] = places[2] + step
        asked = residual < 0 if step == 1 else magnitude > max(0, step - 1)
        mixer = 3 * k + min(step, 2)
        bit = logged_bit(coder, 3, mixer, encoding, 1 if asked else 0)
        if bit < 0:
            return MISSING
        if step == 1:
            sign = bit
        elif bit == 0:
            break
        else:
            found += 1
    if found == LONGEST:
        more = _code_plain(coder, magnitude - found, encoding)
        if more == MISSING:
            return MISSING
        found += more
    return -found if sign else found


@allocating_kernel
def code_nodes(
    coder: BitCoder,
    nodes: NDArray[np.int16],
    left: NDArray[np.int16],
    first: NDArray[np.int16],
    limits: NDArray[np.int64],
    start: int,
    encoding: bool,
) -> int:
    """Code a chart's nodes (rows, columns, 4) from number `start` of them on, four to a node.

    `left`, of the same shape, is what guesses left over, of the numbers before `start`; `first` (4,) is the
    guess for the first node. `limits` are the greatest sizes and shear, either way. Returns the first number
    that the bytes at hand do not determine, or -1 if one breaks a limit.
    """
    kept = np.empty_like(coder.state)
    columns = nodes.shape[1]
    for place in range(start, nodes.size):
        i, j, k = place // (4 * columns), place // 4 % columns, place % 4
        guess = _guess(nodes, first, i, j, k)
        residual = nodes[i, j, k] - guess.value if encoding else int64(0)
        if k == 2:
            residual = _wrapped(residual)
        begin(coder, kept)
        residual = _code_residual(coder, _places(left, guess, i, j, k), k, residual, encoding)
        if residual == MISSING:
            undo(coder, kept)
            return place
        left[i, j, k] = residual
        value = guess.value + residual
        if k == 2:
            value &= 255
        elif abs(value) > limits[k]:
            return -1
        nodes[i, j, k] = value
    return int(nodes.size)
