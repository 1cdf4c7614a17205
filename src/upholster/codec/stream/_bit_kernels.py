"""Coding flags and numbers, each bit by one counter, with a log of what changed (SPEC.md, section 5).

Encoder and decoder are the same loops. A loop returns how far it came: a decoder stops if the received bytes
do not determine the next symbol, and continues when there are more. An incomplete record is undone first
(`undo`), so that only complete ones count.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import int64
from upholster.codec._model_kernels import adapted, settle
from upholster.codec.tables import RECIPROCALS
from upholster.runtime.jit import inline, shared

__all__ = [
    "LOG",
    "MISSING",
    "NUMBER_COUNTERS",
    "BitCoder",
    "begin",
    "code_counted",
    "code_number",
    "undo",
]

LOG = 8192
"""Length of the log of a record's changes."""

MISSING = -(1 << 40)
"""Returned instead of a number: the received bytes do not determine it."""

_LIMIT = 255
_CONTEXTS, _LENGTHS = 8, 35
_LONGER = _CONTEXTS
_SIGN = _LONGER + _CONTEXTS * _LENGTHS
_DIGITS = _SIGN + _CONTEXTS
NUMBER_COUNTERS = _DIGITS + _LENGTHS * 64
"""Number of counters for a kind of number."""

_RECIPROCALS = np.asarray(RECIPROCALS, np.int32)


class BitCoder(NamedTuple):
    """The coder's state (see `_model_kernels` of the codec), the bytes, the counters, and the log.

    log[0] counts the changed counters; then follow (place, previous value) of each.
    """

    state: NDArray[np.int64]
    data: NDArray[np.uint8]
    counters: NDArray[np.int32]
    log: NDArray[np.int64]


@shared
def code_counted(coder: BitCoder, place: int, encoding: bool, bit: int) -> int:
    """Code a bit with one counter; a decoder logs the changes. −1 if bytes are missing."""
    counter = int64(coder.counters[place])
    found = int64(settle(coder.state, coder.data, min(65520, max(16, counter >> 14)), encoding, bit))
    if found < 0:
        return -1
    if not encoding:
        log = coder.log
        n = log[0]
        log[1 + 2 * n], log[2 + 2 * n] = place, counter
        log[0] = n + 1
    coder.counters[place] = adapted(counter, found, _LIMIT, _RECIPROCALS, 0)
    return int(found)


@inline
def begin(coder: BitCoder, kept: NDArray[np.int64]) -> None:
    """Begin a record: keep the state, and empty the log."""
    for n in range(kept.shape[0]):
        kept[n] = coder.state[n]
    coder.log[0] = 0


@inline
def undo(coder: BitCoder, kept: NDArray[np.int64]) -> None:
    """Undo all changes since the beginning of a record."""
    log = coder.log
    for n in range(kept.shape[0]):
        coder.state[n] = kept[n]
    for n in range(log[0] - 1, -1, -1):
        coder.counters[log[1 + 2 * n]] = log[2 + 2 * n]


@shared
def code_number(coder: BitCoder, kind: int, context: int, encoding: bool, value: int) -> Any:
    # A signed number within ±2^35, coded as: whether it is 0; the bit length of its magnitude, in unary; the
    # sign; the bits below the first, of which six are modelled.
    base = kind * NUMBER_COUNTERS
    bit = code_counted(coder, base + context, encoding, 1 if value != 0 else 0)
    if bit <= 0:
        return 0 if bit == 0 else MISSING
    magnitude = abs(value)
    length = int64(0)
    while length < _LENGTHS - 1:
        more = 1 if magnitude >> (length + 1) else 0
        bit = code_counted(coder, base + _LONGER + context * _LENGTHS + length, encoding, more)
        if bit < 0:
            return MISSING
        if bit == 0:
            break
        length += 1
    sign = code_counted(coder, base + _SIGN + context, encoding, 1 if value < 0 else 0)
    if sign < 0:
        return MISSING
    node, result = int64(1), int64(1)
    for b in range(length):
        place = base + _DIGITS + length * 64 + (node if b < 6 else 0)
        bit = code_counted(coder, place, encoding, (magnitude >> (length - 1 - b)) & 1)
        if bit < 0:
            return MISSING
        node = 2 * node + bit
        result = 2 * result + bit
    return -result if sign else result
