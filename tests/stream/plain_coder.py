"""Section 5.1 of SPEC.md in plain Python: the arithmetic coder, numbers, and a file's bytes."""

import math
from collections import defaultdict
from typing import Any

STRETCH = [
    min(2047, max(-2047, round(256 * math.log(q / (1 - q))))) for q in ((p + 0.5) / 4096 for p in range(4096))
]
SQUASH = [min(65520, max(16, round(65536 / (1 + math.exp(-x / 256))))) for x in range(-2048, 2048)]
RECIPROCALS = [round(16384 / (n + 1.6)) for n in range(1024)]
MASK = 2**32 - 1


class PlainCoder:
    """The arithmetic coder over a whole stream; bytes behind its end are 0.

    `weight` is what mixers start with; None: 72090 // (number of inputs). Counters and mixers go by name.
    """

    def __init__(self, data: Any, weight: Any, limit: Any) -> None:
        self.data = iter(data + bytes(8))
        self.low, self.high, self.code = 0, MASK, 0
        for _ in range(4):
            self.code = self.code << 8 | next(self.data)
        self.weight, self.limit = weight, limit
        self.counters: Any = defaultdict(lambda: [2**19, 0])
        self.weights: Any = {}

    def bit(self, inputs: Any, mixer: Any) -> Any:
        counters = [self.counters[key] for key in inputs]
        logits = [STRETCH[counter[0] >> 8] for counter in counters]
        weights = self.weights.setdefault(mixer, [self.weight or 72090 // len(inputs)] * len(inputs))
        total = sum(weight * logit for weight, logit in zip(weights, logits, strict=False))
        chance = SQUASH[2048 + max(-2047, min(2047, total >> 16))]
        span = self.high - self.low
        middle = self.low + (span >> 16) * chance + ((span & 65535) * chance >> 16)
        bit = int(self.code <= middle)
        if bit:
            self.high = middle
        else:
            self.low = middle + 1
        while self.low >> 24 == self.high >> 24:
            self.low = self.low << 8 & MASK
            self.high = (self.high << 8 | 255) & MASK
            self.code = (self.code << 8 | next(self.data, 0)) & MASK
        error = (bit << 16) - chance
        for k, logit in enumerate(logits):
            weights[k] += (logit * error + 8192) >> 14
        target = 2**20 - 1 if bit else 0
        for counter in counters:
            counter[0] += (((target - counter[0]) >> 4) * RECIPROCALS[counter[1]]) >> 10
            counter[1] = min(counter[1] + 1, self.limit)
        return bit

    def number(self, f: Any, context: Any) -> Any:
        """A number of kind `f`."""
        if not self.bit([("zero", f, context)], ("number", f, 0)):
            return 0
        length = 0
        while length < 34 and self.bit([("longer", f, length)], ("number", f, 1)):
            length += 1
        negative = self.bit([("zero", f, 4)], ("number", f, 2))
        node = value = 1
        for b in range(length):
            key = ("digit", f, length, node if b < 6 else 0)
            bit = self.bit([key], ("number", f, 3 if b < 6 else 4))
            node, value = 2 * node + bit, 2 * value + bit
        return -value if negative else value


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
