"""Coding numbers bit by bit over the coder of `upholster.codec`, with a log of what changed.

Encoder and decoder are the same loops. A loop returns how far it came: a decoder stops where the bytes at
hand do not determine the next symbol, and goes on from there when there are more; a record that was begun is
taken back first (`undo`), so that only whole ones count.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS, WEIGHTS, code_bit
from upholster.jit import inline, shared
from upholster.types import int64

__all__ = [
    "LOG",
    "MISSING",
    "MIXERS",
    "NUMBER_COUNTERS",
    "NUMBER_MIXERS",
    "START",
    "BitCoder",
    "begin",
    "code_number",
    "logged_bit",
    "undo",
]

LOG = 8192
"""Length of the log of a record's changes."""

NUMBER_MIXERS = 5
"""Mixers that a kind of number takes."""

MIXERS = NUMBER_MIXERS * 24
START = WEIGHTS + 8 * MIXERS
"""Where the counters start in the model."""

NUMBER_COUNTERS = 8 + 40 + 40 * 64
MISSING = -(1 << 40)
"""In place of a number: the bytes at hand do not determine it."""


class BitCoder(NamedTuple):
    """The coder's state, the bytes, the adaptive model (see `_model_kernels` of the codec), and the log.

    log[0] counts the numbers of the model that changed, then come (place, value before) of each.
    """

    state: NDArray[np.int64]
    data: NDArray[np.uint8]
    a: NDArray[np.int32]
    log: NDArray[np.int64]


@inline
def logged_bit(
    coder: BitCoder,
    inputs: int,
    mixer: int,
    encoding: bool,
    bit: int,
) -> int:
    """Code a bit of a record, see `code_bit`; a decoder enters in the log what changes."""
    a = coder.a
    if not encoding:
        log = coder.log
        n = log[0]
        for k in range(inputs):
            for place in (int64(a[CONTEXTS + k]), WEIGHTS + 8 * mixer + k):
                log[1 + 2 * n], log[2 + 2 * n] = place, a[place]
                n += 1
        log[0] = n
    return code_bit(coder.state, coder.data, coder.a, inputs, mixer, 255, encoding, bit)


@inline
def begin(coder: BitCoder, kept: NDArray[np.int64]) -> None:
    """Begin a record: keep the state, and empty the log."""
    for n in range(kept.shape[0]):
        kept[n] = coder.state[n]
    coder.log[0] = 0


@inline
def undo(coder: BitCoder, kept: NDArray[np.int64]) -> None:
    """Take everything back since a record began."""
    log = coder.log
    for n in range(kept.shape[0]):
        coder.state[n] = kept[n]
    for n in range(log[0] - 1, -1, -1):
        coder.a[log[1 + 2 * n]] = log[2 + 2 * n]


@shared
def code_number(
    coder: BitCoder,
    kind: int,
    context: int,
    encoding: bool,
    value: int,
) -> Any:
    # A signed number within ±2^34 as: is it 0; the bit length of its magnitude, in unary; the sign; the bits
    # below the first, of which six are modelled.
    a = coder.a
    base = kind * NUMBER_COUNTERS
    mixer = NUMBER_MIXERS * kind
    a[CONTEXTS + 0] = START + base + context
    bit = logged_bit(coder, 1, mixer, encoding, 1 if value != 0 else 0)
    if bit <= 0:
        return 0 if bit == 0 else MISSING
    magnitude = abs(value)
    length = int64(0)
    while length < 34:
        a[CONTEXTS + 0] = START + base + 8 + length
        more = 1 if magnitude >> (length + 1) else 0
        bit = logged_bit(coder, 1, mixer + 1, encoding, more)
        if bit < 0:
            return MISSING
        if bit == 0:
            break
        length += 1
    a[CONTEXTS + 0] = START + base + 4
    sign = logged_bit(coder, 1, mixer + 2, encoding, 1 if value < 0 else 0)
    if sign < 0:
        return MISSING
    node, result = int64(1), int64(1)
    for b in range(length):
        a[CONTEXTS + 0] = START + base + 48 + length * 64 + (node if b < 6 else 0)
        bit = logged_bit(
            coder,
            1,
            mixer + (3 if b < 6 else 4),
            encoding,
            (magnitude >> (length - 1 - b)) & 1,
        )
        if bit < 0:
            return MISSING
        node = 2 * node + bit
        result = 2 * result + bit
    return -result if sign else result
