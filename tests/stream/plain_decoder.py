"""Sections 5.1 to 5.4 of SPEC.md in plain Python integers, written from the text: an oracle."""

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
    """The arithmetic coder of section 5.1 over a whole stream; bytes behind its end are 0."""

    def __init__(self, data: Any, weight: Any) -> None:
        self.data = iter(data + bytes(8))
        self.low, self.high, self.code = 0, MASK, 0
        for _ in range(4):
            self.code = self.code << 8 | next(self.data)
        self.counters: Any = defaultdict(lambda: [2**19, 0])
        self.weights: Any = defaultdict(lambda: weight)

    def bit(self, inputs: Any, mixer: Any, limit: Any) -> Any:
        counters = [self.counters[key] for key in inputs]
        logits = [STRETCH[counter[0] >> 8] for counter in counters]
        total = sum(self.weights[mixer, k] * logit for k, logit in enumerate(logits))
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
            self.weights[mixer, k] += (logit * error + 8192) >> 14
        target = 2**20 - 1 if bit else 0
        for counter in counters:
            counter[0] += (((target - counter[0]) >> 4) * RECIPROCALS[counter[1]]) >> 10
            counter[1] = min(counter[1] + 1, limit)
        return bit


def _hash(x: Any, y: Any, z: Any) -> Any:
    return ((2654435761 * x + 2246822519 * y + 3266489917 * z) % 2**32) >> 16


def sources(data: Any, runs: Any, jump: Any, grid: Any) -> Any:
    """Section 5.2: candidates of runs (blocks, blocks across, 1 for strips)."""
    coder = PlainCoder(data, 18022)
    rows, columns = grid
    out = []
    for count, across, strip in runs:
        found: list[int] = []
        modes: list[int] = []
        for n in range(count):
            left, left_mode = (found[n - 1], modes[n - 1]) if n % across else (-1, 3)
            top, top_mode = (found[n - across], modes[n - across]) if n >= across else (-1, 3)
            onward = left + jump if left >= 0 and left % columns + jump < columns else -1
            downward = top + jump * columns if top >= 0 and top + jump * columns < rows * columns else -1
            equal = onward == downward
            choice, mode = None, 0
            for side, guess in ((0, onward), (1, downward)):
                if choice is None and guess >= 0 and not (side and equal):
                    flag = ("F", strip, side, left_mode, top_mode, equal)
                    hashed = ("B", _hash(left, top, 5000 + side))
                    if coder.bit([flag, hashed], (strip, side), 255):
                        choice, mode = guess, side + 1
            if choice is None:
                bits_row, bits_column = (rows - 1).bit_length(), (columns - 1).bit_length()
                node, row = 1, 0
                for b in range(bits_row + bits_column):
                    if b == bits_row:
                        row, node = node - 2**bits_row, 1
                    second = b >= bits_row
                    place = node + 4096 * (1 + row) if second else node
                    inputs = [
                        ("T", second, node & 2047),
                        ("A", _hash(place, left + 1, strip)),
                        ("B", _hash(place, top + 1, 7 + strip)),
                        ("C", _hash(place, left + 1, top + 19)),
                    ]
                    mixer = (strip, "tree", onward >= 0, downward >= 0, second)
                    node = 2 * node + coder.bit(inputs, mixer, 255)
                if bits_column == 0:
                    row, node = node - 2**bits_row, 1
                choice = row * columns + node - 2**bits_column
            found.append(choice)
            modes.append(mode)
        out += found
    return out


def fields(data: Any, count: Any) -> Any:
    """Section 5.3: placements of a general plan, 13 fields each."""
    coder = PlainCoder(data, 72090)

    def number(f: Any, context: Any) -> Any:
        if not coder.bit([("zero", f, context)], (f, 0), 255):
            return 0
        length = 0
        while length < 34 and coder.bit([("longer", f, length)], (f, 1), 255):
            length += 1
        negative = coder.bit([("zero", f, 4)], (f, 2), 255)
        node = value = 1
        for b in range(length):
            key = ("digit", f, length, node if b < 6 else 0)
            bit = coder.bit([key], (f, 3 if b < 6 else 4), 255)
            node, value = 2 * node + bit, 2 * value + bit
        return -value if negative else value

    out, before, expected = [], [0] * 13, 0
    for n in range(count):
        record: list[int] = []
        differed = [0, 0]
        for f in range(13):
            guess = before[f]
            if f in (10, 11) and n:
                guess += record[f - 10] - before[f - 10]
            if f == 12:
                guess = expected if record[5] == 2 else -1
            value = number(f, 2 * differed[-2] + differed[-1])
            differed.append(int(value != 0))
            record.append(guess + value)
        if record[5] == 2:
            expected = record[12] + -(-record[2] // record[8]) * -(-record[3] // record[8])
        out.append(record)
        before = record
    return out


def masks(data: Any, shapes: Any) -> Any:
    """Section 5.4: masks of (rows, columns, place in the strip), one after another, as one flat list."""
    coder = PlainCoder(data, 24030)
    out = []
    for rows, columns, place in shapes:
        mask: dict[tuple[int, int], int] = defaultdict(int)
        for i in range(rows):
            for j in range(columns):
                w, n, nw, ne = mask[i, j - 1], mask[i - 1, j], mask[i - 1, j - 1], mask[i - 1, j + 1]
                near = w + 2 * n + 4 * nw + 8 * ne
                around = near + 16 * mask[i, j - 2] + 32 * mask[i - 2, j]
                end = 0 if i == 0 else 2 if i == rows - 1 else 1
                inputs = [
                    ("I", min(i, 63), min(j, 63), place, w, n),
                    ("J", around, min(15, 16 * j // columns), i == 0),
                    ("K", near, min(j, 63), end),
                ]
                mask[i, j] = coder.bit(inputs, i == 0, 400)
        out += [mask[i, j] for i in range(rows) for j in range(columns)]
    return out
