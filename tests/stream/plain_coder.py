"""Sections 5.1 and 5.2 of SPEC.md in plain Python: bits coded by one counter, numbers, and a file's bytes."""

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

RECIPROCALS = [round(16384 / (n + 1.6)) for n in range(1024)]
MASK = 2**32 - 1


class EndError(Exception):
    """The next bit is not determined by the bytes that have come."""


@dataclass
class PlainCounter:
    """A probability of 1, in 1/2^20, and how many bits it has seen."""

    p: int = 2**19
    n: int = 0

    def adapt(self, bit: Any, limit: Any) -> None:
        target = 2**20 - 1 if bit else 0
        self.p += (((target - self.p) >> 4) * RECIPROCALS[self.n]) >> 10
        self.n = min(self.n + 1, limit)


class PlainCoder:
    """The arithmetic coder over the bytes that have come. Counters go by name."""

    def __init__(self, data: Any) -> None:
        self.data = iter(data)
        self.low, self.high, self.code, self.unknown = 0, MASK, 0, 0
        self.ended = False
        for _ in range(4):
            self._next_byte()
        self.counters: Any = defaultdict(PlainCounter)

    def _next_byte(self) -> None:
        byte = next(self.data, None)
        self.code = (self.code << 8 | (byte or 0)) & MASK
        self.unknown = (self.unknown << 8 | (255 if byte is None else 0)) & MASK

    def bit(self, name: Any) -> Any:
        counter = self.counters[name]
        bit = self.decided(max(16, min(65520, counter.p >> 4)))
        counter.adapt(bit, 255)
        return bit

    def decided(self, chance: Any) -> Any:
        """Return the next bit, which is 1 with a chance in 1/65536."""
        span = self.high - self.low
        middle = self.low + (span >> 16) * chance + ((span & 65535) * chance >> 16)
        if self.ended:
            raise EndError
        if self.code + self.unknown <= middle:
            bit, self.high = 1, middle
        elif self.code > middle:
            bit, self.low = 0, middle + 1
        else:
            self.ended = True
            raise EndError
        while self.low >> 24 == self.high >> 24:
            self.low = self.low << 8 & MASK
            self.high = (self.high << 8 | 255) & MASK
            self._next_byte()
        return bit

    def number(self, k: Any, c: Any) -> Any:
        if not self.bit(("zero", k, c)):
            return 0
        length = 0
        while length < 34 and self.bit(("longer", k, c, length)):
            length += 1
        negative = self.bit(("sign", k, c))
        node = value = 1
        for b in range(length):
            x = self.bit(("digit", k, length, node if b < 6 else 0))
            node, value = 2 * node + x, 2 * value + x
        return -value if negative else value

    def plain(self, name: Any, bits: Any) -> Any:
        """Return a number of so many bits, highest first; the one of weight 2^k is bit((name, k))."""
        value = 0
        for k in range(bits - 1, -1, -1):
            value += self.bit((name, k)) << k
        return value


class PlainBytes:
    """A chunk's bytes, read one field after another."""

    def __init__(self, data: Any) -> None:
        self.data = iter(data)

    def byte(self) -> Any:
        return next(self.data)

    def varint(self) -> Any:
        value, shift = 0, 0
        while True:
            byte = next(self.data)
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    def end(self) -> None:
        assert next(self.data, None) is None
