"""Warp fields (SPEC.md, sections 3 and 5.3) in plain Python: nodes and matrices."""

import math
from typing import Any

from plain_coder import EndError, PlainCoder

COSINES = [round(2**14 * math.cos(2 * math.pi * k / 256)) for k in range(256)]
POWERS = [round(2**14 * 2 ** (k / 32)) for k in range(32)]

ORIGIN = 8
"""Where node 0 lies, in 1/16 step."""


class PlainField:
    """M over a chart, from its nodes (rows of columns of four numbers) and margin."""

    def __init__(self, nodes: Any, margin: Any) -> None:
        self.margin, self.m = margin, [[matrix_of(*node) for node in row] for row in nodes]

    def at(self, row: Any, column: Any) -> Any:
        """M at a place in 1/16 step: between rows first, then between columns."""
        places = []
        for place, count in ((row, len(self.m)), (column, len(self.m[0]))):
            i, f = self.margin + (place - ORIGIN >> 9), (place - ORIGIN) & 511
            if i < 0:
                i = f = 0
            if i >= count - 1:
                i, f = count - 1, 0
            places.append((i, min(i + 1, count - 1), f))
        (i, below, f), (j, beside, g) = places
        m = self.m
        left = [(a * (512 - f) + b * f + 256) >> 9 for a, b in zip(m[i][j], m[below][j], strict=True)]
        right = [
            (a * (512 - f) + b * f + 256) >> 9 for a, b in zip(m[i][beside], m[below][beside], strict=True)
        ]
        return [(a * (512 - g) + b * g + 256) >> 9 for a, b in zip(left, right, strict=True)]


def matrix_of(b: Any, a: Any, phi: Any, shear: Any) -> Any:
    def size(x: Any) -> Any:
        return (POWERS[x % 32] << (6 + x // 32)) >> 6

    def cosine(k: Any) -> Any:
        return COSINES[k % 256]

    def sine(k: Any) -> Any:
        return COSINES[(k - 64) % 256]

    return [
        (size(b) * sine(phi + shear + 64) + 2**15) >> 16,
        (size(a) * sine(phi) + 2**15) >> 16,
        (size(b) * cosine(phi + shear + 64) + 2**15) >> 16,
        (size(a) * cosine(phi) + 2**15) >> 16,
    ]


def nodes(data: Any, shapes: Any) -> Any:
    """Section 5.3: nodes of charts with fields, of (rows, columns) each; what has not come is its guess."""
    teller, found = Teller(data), [{} for _ in shapes]
    for s in (4, 2, 1):
        for n, (rows, columns) in enumerate(shapes):
            before = found[n - 1][0, 0] if n else (0, 0, 0, 0)
            for place, guess in order(found[n], rows, columns, s, before):
                found[n][place] = teller.node(guess)
    return [
        [[mine[i, j] for j in range(columns)] for i in range(rows)]
        for mine, (rows, columns) in zip(found, shapes, strict=True)
    ]


def order(found: Any, rows: Any, columns: Any, s: Any, before: Any) -> Any:
    """Yield the nodes of step s with their guesses, each when all that it needs is in `found`."""
    if s == 4:
        for i in range(0, rows, 4):
            for j in range(0, columns, 4):
                yield (i, j), found[i, j - 4] if j else found[i - 4, 0] if i else before
        return
    for i in range(s, rows, 2 * s):
        for j in range(0, columns, 2 * s):
            yield (i, j), between(found[i - s, j], found.get((i + s, j)))
    for i in range(0, rows, s):
        for j in range(s, columns, 2 * s):
            yield (i, j), between(found[i, j - s], found.get((i, j + s)))


def between(x: Any, y: Any) -> Any:
    if y is None:
        return x
    apart = [q - p for p, q in zip(x, y, strict=True)]
    apart[2] = (apart[2] + 128) % 256 - 128
    return [p + ((d + 1) >> 1) for p, d in zip(x, apart, strict=True)]


MOST = 192, 192, 2**40, 56


class Teller:
    """Tells one node after another."""

    def __init__(self, data: Any) -> None:
        self.coder: Any = PlainCoder(data)
        self.rest = [0] * 4

    def node(self, guess: Any) -> Any:
        rest = [0] * 4
        try:
            for k in range(4):
                context = 2 * min(3, abs(self.rest[k])) + (k > 0 and rest[k - 1] != 0)
                rest[k] = self.coder.number(k, context)
                assert abs(guess[k] + rest[k]) <= MOST[k]
        except EndError:
            rest = [0] * 4
        self.rest = rest
        b, a, phi, shear = (x + r for x, r in zip(guess, rest, strict=True))
        return b, a, phi % 256, shear
