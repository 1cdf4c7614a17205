"""Coding the nodes of warp fields: encoder and decoder are the same loop (SPEC.md, section 5.7)."""

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS, code_bit
from upholster.jit import inline, kernel
from upholster.stream._bit_kernels import START, BitCoder, signed

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


@kernel
def code_nodes(
    coder: BitCoder,
    nodes: NDArray[np.int16],
    first: NDArray[np.int16],
    limits: NDArray[np.int64],
    encoding: bool,
) -> int:
    """Code a chart's nodes (rows, columns, 4); `first` (4,) is the guess for the first one.

    `limits` are the greatest sizes and shear, either way. Returns 1; 0 if the bytes at hand do not determine
    all nodes, -1 if one breaks a limit.
    """
    a = coder.a
    rows, columns = nodes.shape[:2]
    left = np.zeros((rows, columns, 4), np.int16)  # what the guesses left over
    for i in range(rows):
        for j in range(columns):
            for k in range(4):
                # The guess, and how far three other guesses lie from it.
                x, y, z = 0, 0, 0
                if i == 0 and j == 0:
                    guess = signed(first[k])
                elif i == 0:
                    guess = signed(nodes[0, j - 1, k])
                    if j > 1:
                        x = guess - nodes[0, j - 2, k]
                elif j == 0:
                    guess = signed(nodes[i - 1, 0, k])
                    if i > 1:
                        y = guess - nodes[i - 2, 0, k]
                    if columns > 1:
                        z = signed(nodes[i - 1, 1, k]) - guess
                else:
                    west, north = signed(nodes[i, j - 1, k]), signed(nodes[i - 1, j, k])
                    guess = west + north - nodes[i - 1, j - 1, k]
                    if j > 1:
                        x = 2 * west - nodes[i, j - 2, k] - guess
                    if i > 1:
                        y = 2 * north - nodes[i - 2, j, k] - guess
                    if j + 1 < columns:
                        # The slope down the next column, as steep as beside it.
                        z = west + nodes[i - 1, j + 1, k] - north - guess
                if k == 2:
                    x, y, z = ((x + 128) & 255) - 128, ((y + 128) & 255) - 128, ((z + 128) & 255) - 128
                beside = signed(left[i, j - 1, k]) if j > 0 else 0
                above = signed(left[i - 1, j, k]) if i > 0 else 0
                corner = signed(left[i - 1, j + 1, k]) if i > 0 and j + 1 < columns else 0
                before = signed(left[i, j, k - 1]) if k > 0 else 0
                guesses = (_clip(x, 2) + 2) * 25 + (_clip(y, 2) + 2) * 5 + _clip(z, 2) + 2
                around = (_clip(beside, 2) + 2) * 15 + (_clip(above, 2) + 2) * 3 + _clip(before, 1) + 1
                spread = min(15, abs(beside) + abs(above) + abs(corner))
                residual = 0
                if encoding:
                    residual = nodes[i, j, k] - guess
                    if k == 2:
                        residual = ((residual + 128) & 255) - 128
                magnitude, negative, step = abs(residual), 1 if residual < 0 else 0, 0
                found, sign = 0, 0
                # Is it 0; its sign; is it more than 1, than 2, …
                while step <= LONGEST:
                    near = min(step, _STEPS - 1)
                    a[CONTEXTS + 0] = START + (k * 125 + guesses) * _STEPS + near
                    a[CONTEXTS + 1] = START + _GUESSES + (k * 75 + around) * _STEPS + near
                    a[CONTEXTS + 2] = START + _GUESSES + _BEFORE + (k * 16 + spread) * (LONGEST + 1) + step
                    asked = negative if step == 1 else (1 if magnitude > max(0, step - 1) else 0)
                    bit = code_bit(
                        coder.state, coder.data, coder.a, 3, 3 * k + min(step, 2), 255, encoding, asked
                    )
                    if bit < 0:
                        return 0
                    if step == 1:
                        sign = bit
                    else:
                        if bit == 0:
                            break
                        found += 1
                    step += 1
                if found == LONGEST:
                    a[CONTEXTS + 0] = START + _PLAIN
                    more = 0
                    for b in range(_PLAIN_BITS - 1, -1, -1):
                        bit = code_bit(
                            coder.state,
                            coder.data,
                            coder.a,
                            1,
                            12,
                            255,
                            encoding,
                            ((magnitude - found) >> b) & 1,
                        )
                        if bit < 0:
                            return 0
                        more = 2 * more + bit
                    found += more
                residual = -found if sign else found
                left[i, j, k] = residual
                value = guess + residual
                if k == 2:
                    value &= 255
                elif abs(value) > limits[k]:
                    return -1
                nodes[i, j, k] = value
    return 1
