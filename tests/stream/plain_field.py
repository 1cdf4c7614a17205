"""Warp fields (SPEC.md, sections 3 and 5.3) in plain Python: nodes, matrices, where blocks read."""

import math
from typing import Any

from plain_coder import PlainCoder

COSINES = [round(2**14 * math.cos(2 * math.pi * k / 256)) for k in range(256)]
POWERS = [round(2**14 * 2 ** (k / 32)) for k in range(32)]

ORIGIN = 8
"""Where node 0 lies, in 1/16 step."""

SYMMETRIES = (
    *((1, 0, 0, 1), (0, 1, -1, 0), (-1, 0, 0, -1), (0, -1, 1, 0)),
    *((0, 1, 1, 0), (1, 0, 0, -1), (0, -1, -1, 0), (-1, 0, 0, 1)),
)


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


def displaced(first: Any, here: Any, down: Any, right: Any) -> Any:
    """Section 8: v, where `first` is a placement's centre matrix and `here` M at the place, in 1/16 step."""
    a = [p + q for p, q in zip(first, here, strict=True)]
    return tuple(
        (p * (down >> 4) + q * (right >> 4) + ((p * (down & 15) + q * (right & 15)) >> 4) + 256) >> 9
        for p, q in (a[:2], a[2:])
    )


def nodes(data: Any, shapes: Any) -> Any:
    """Section 5.3: the nodes of charts with fields, of (rows, columns) each."""
    coder, out = PlainCoder(data, 24030, 255), []
    coder.weights[12] = [72090]
    for rows, columns in shapes:
        out.append(_nodes_of(coder, rows, columns, out[-1][0][0] if out else (0, 0, 0, 0)))
    return out


def _nodes_of(coder: Any, rows: Any, columns: Any, first: Any) -> Any:
    found: Any = {}
    rest: Any = {}
    for i in range(rows):
        for j in range(columns):
            for k in range(4):
                value, rest[i, j, k] = _node(coder, found, rest, (i, j, k), columns, first)
                found[i, j, k] = value
    return [[tuple(found[i, j, k] for k in range(4)) for j in range(columns)] for i in range(rows)]


def _node(coder: Any, found: Any, rest: Any, place: Any, columns: Any, first: Any) -> Any:
    i, j, k = place

    def at(a: Any, b: Any) -> Any:
        return found.get((i + a, j + b, k)) if 0 <= j + b < columns else None

    w, n, nw, ne, ww, nn = at(0, -1), at(-1, 0), at(-1, -1), at(-1, 1), at(0, -2), at(-2, 0)
    x = y = z = 0
    if w is None and n is None:
        guess = first[k]
    elif n is None:
        guess = w
        x = 0 if ww is None else w - ww
    elif w is None:
        guess = n
        y = 0 if nn is None else n - nn
        z = 0 if ne is None else ne - n
    else:
        guess = w + n - nw
        x = 0 if ww is None else 2 * w - ww - guess
        y = 0 if nn is None else 2 * n - nn - guess
        z = 0 if ne is None else w + ne - n - guess
    if k == 2:
        x, y, z = ((hint + 128) % 256 - 128 for hint in (x, y, z))
    around = [rest.get((i + a, j + b, k), 0) for a, b in ((0, -1), (-1, 0), (-1, 1))]
    before = rest.get((i, j, k - 1), 0) if k else 0
    hints = tuple(max(-2, min(2, hint)) for hint in (x, y, z))
    context = (*(max(-2, min(2, r)) for r in around[:2]), max(-1, min(1, before)))
    spread = min(15, sum(abs(r) for r in around))
    size = negative = 0
    for step in range(21):
        short = min(step, 5)
        inputs = [("U", k, hints, short), ("V", k, context, short), ("X", k, spread, step)]
        bit = coder.bit(inputs, 3 * k + min(step, 2))
        if step == 1:
            negative = bit
        elif bit:
            size += 1
        else:
            break
    if size == 20:
        more = 0
        for _ in range(10):
            more = 2 * more + coder.bit(["ten"], 12)
        size += more
    r = -size if negative else size
    return (guess + r) % 256 if k == 2 else guess + r, r
