"""The arithmetic coder of placements: state, counters and bytes, to write and to read piece by piece."""

import numpy as np

from upholster.codec._model_kernels import BYTES_DONE, BYTES_HERE, CODE, HIGH, LOW, STATE_SIZE, UNKNOWN_BITS
from upholster.codec.stream._bit_kernels import LOG, BitCoder

__all__ = ["BitReader", "BitWriter", "Bits"]

_HALF = (1 << 19) << 10
_LAG = 3
"""Number of bytes beyond the settled ones that a decoder usually needs for the last bit."""


class Bits:
    """Data of the kernels of `upholster.codec.stream._bit_kernels`.

    Parameters
    ----------
    counters
        Number of counters of the model; each starts at a probability of one half, without observations.
    """

    def __init__(self, counters: int) -> None:
        self.state = np.zeros(STATE_SIZE, np.int64)
        self.state[HIGH] = 0xFFFFFFFF
        self.data = np.zeros(4096, np.uint8)
        self._counters = np.full(counters, _HALF, np.int32)
        self.log = np.zeros(LOG, np.int64)

    @property
    def coder(self) -> BitCoder:
        """State, bytes, counters and log, as kernels take them."""
        return BitCoder(self.state, self.data, self._counters, self.log)


class BitWriter(Bits):
    """Writes bits; make `room` before each kernel call, `finish` at the end."""

    def room(self, bytes_: int) -> None:
        """Make room for `bytes_` bytes."""
        if int(self.state[BYTES_DONE]) + bytes_ > len(self.data):
            grown = np.zeros(2 * len(self.data) + bytes_, np.uint8)
            grown[: len(self.data)] = self.data
            self.data = grown

    @property
    def length(self) -> int:
        """Length of the output so far, in bytes, about."""
        return int(self.state[BYTES_DONE]) + _LAG

    def finish(self) -> bytes:
        """Return all bytes: the bits are read back correctly, whatever bytes follow."""
        done, low, high = (int(self.state[n]) for n in (BYTES_DONE, LOW, HIGH))
        for count in range(5):
            unit = 1 << (32 - 8 * count)
            value = -(-low // unit) * unit
            if value + unit - 1 <= high:
                break
        return self.data[:done].tobytes() + value.to_bytes(5, "big")[1 : 1 + count]


class BitReader(Bits):
    """Holds the received bytes; a symbol can be read as soon as they determine it."""

    def __init__(self, counters: int) -> None:
        super().__init__(counters)
        self.state[UNKNOWN_BITS] = 0xFFFFFFFF
        self.state[BYTES_DONE] = 4

    def feed(self, data: bytes) -> None:
        """Take further bytes."""
        state, here = self.state, int(self.state[BYTES_HERE])
        total = here + len(data)
        if total > len(self.data):
            grown = np.zeros(max(2 * len(self.data), total), np.uint8)
            grown[:here] = self.data[:here]
            self.data = grown
        self.data[here:total] = np.frombuffer(data, np.uint8)
        state[BYTES_HERE] = total
        # Bytes that the code register has assumed missing.
        done = int(state[BYTES_DONE])
        for place in range(max(here, done - 4), min(total, done)):
            shift = 8 * (done - 1 - place)
            state[CODE] |= int(self.data[place]) << shift
            state[UNKNOWN_BITS] &= ~(255 << shift)

    @property
    def unread(self) -> int:
        """Number of received bytes that no symbol has needed."""
        return max(0, int(self.state[BYTES_HERE]) - int(self.state[BYTES_DONE]))
