"""Coding one bit: prediction mixed from several contexts, and the binary arithmetic coder.

Everything is integer arithmetic within 53 bits, so that a decoder in any language gets the same bits.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.runtime.jit import inline, kernel

__all__ = [
    "BYTES_DONE",
    "BYTES_HERE",
    "CODE",
    "CONTEXTS",
    "COUNTERS",
    "HIGH",
    "LOW",
    "MIXERS",
    "QUANTA_AT",
    "STATE_SIZE",
    "STRETCH_AT",
    "THRESHOLDS_AT",
    "UNKNOWN_BITS",
    "WEIGHTS",
    "adapted",
    "code_bit",
    "settle",
]

# Positions in the coder's state, an int64 array. The interval is [LOW, HIGH], 32 bits each. A decoder's CODE
# holds the available bytes, missing ones as 0; SLACK is the most that they could add. BYTES_DONE counts bytes
# written or read.
LOW, HIGH, CODE, UNKNOWN_BITS, BYTES_DONE, BYTES_HERE = 0, 1, 2, 3, 4, 5
STATE_SIZE = 30


# The adaptive model is one int32 array: the tables of `upholster.codec.tables`, the contexts of one
# prediction (positions of counters) and their logits, mixing weights in 1/65536, 8 per mixer, and counters. A
# counter is the probability of a 1 in 1/2^20, times 1024, plus the number of bits it has seen.
STRETCH_AT, SQUASH_AT, RECIPROCALS_AT, QUANTA_AT, THRESHOLDS_AT = 0, 4096, 8192, 9216, 9472
CONTEXTS, LOGITS, WEIGHTS = 9480, 9488, 9496
MIXERS = 39
COUNTERS = WEIGHTS + 8 * MIXERS


@inline
def settle(state: NDArray[np.int64], data: NDArray[np.uint8], chance: Any, encoding: bool, bit: int) -> int:
    """Encode `bit`, or decode one, that is 1 with a chance in 1/65536; return it, or -1 as `code_bit`."""
    low, high = state[LOW], state[HIGH]
    span = high - low
    middle = low + (span >> 16) * chance + (((span & 0xFFFF) * chance) >> 16)
    if not encoding:
        if state[CODE] + state[UNKNOWN_BITS] <= middle:
            bit = 1
        elif state[CODE] > middle:
            bit = 0
        else:
            return -1
    if bit:
        high = middle
    else:
        low = middle + 1
    while (low ^ high) & 0xFF000000 == 0:
        done = state[BYTES_DONE]
        if encoding:
            data[done] = high >> 24
        else:
            state[CODE] = (state[CODE] << 8) & 0xFFFFFFFF
            state[UNKNOWN_BITS] = (state[UNKNOWN_BITS] << 8) & 0xFFFFFFFF
            if done < state[BYTES_HERE]:
                state[CODE] |= data[done]
            else:
                state[UNKNOWN_BITS] |= 255
        state[BYTES_DONE] = done + 1
        low = (low << 8) & 0xFFFFFFFF
        high = ((high << 8) & 0xFFFFFFFF) | 255
    state[LOW], state[HIGH] = low, high
    return bit


@inline
def adapted(counter: int, bit: int, limit: int, reciprocals: NDArray[np.int32], first: int) -> int:
    """Return a counter after one more bit; the reciprocals' table begins at `first`."""
    seen = counter & 1023
    probability = counter >> 10
    target = (1 << 20) - 1 if bit else 0
    probability += (((target - probability) >> 4) * reciprocals[first + seen]) >> 10
    return (probability << 10) | min(seen + 1, limit)


@kernel
def code_bit(
    state: NDArray[np.int64],
    data: NDArray[np.uint8],
    a: NDArray[np.int32],
    inputs: int,
    mixer: int,
    limit: int,
    encoding: bool,
    bit: int,
) -> int:
    """Encode `bit`, or decode one; return it, or -1 if the available bytes do not determine it.

    The first `inputs` contexts predict, weighted by `mixer`; counters adapt as if they had seen at most
    `limit` bits.
    """
    total = 0
    weights = WEIGHTS + 8 * mixer
    for k in range(inputs):
        logit = a[STRETCH_AT + (a[a[CONTEXTS + k]] >> 18)]
        a[LOGITS + k] = logit
        total += np.int64(a[weights + k]) * logit
    total = min(2047, max(-2047, total >> 16))
    chance = np.int64(a[SQUASH_AT + 2048 + total])
    bit = settle(state, data, chance, encoding, bit)
    if bit < 0:
        return -1
    error = (bit << 16) - chance
    for k in range(inputs):
        a[weights + k] += (a[LOGITS + k] * error + 8192) >> 14
        a[a[CONTEXTS + k]] = adapted(a[a[CONTEXTS + k]], bit, limit, a, RECIPROCALS_AT)
    return bit
