"""Subdivision in plain Python: the oracle of `upholster.charts.subdivision`."""

from typing import Any

import numpy as np

Piece = tuple[tuple[int, ...], np.ndarray]
"""Vertices of a triangle or a strip, and at each corner its place and its vector, (k, 5)."""


class PlainSubdivision:
    """One triangle of a surface after another, in rounds; vertices are shared by what they lie between."""

    def __init__(self, positions: np.ndarray, longest: float) -> None:
        self.positions: list[Any] = list(positions)
        self.longest, self.narrow = longest, 0.25 * longest
        self.middles: dict[tuple[int, int], int] = {}

    def parts(self, triangle: Piece) -> list[np.ndarray]:
        """Return what a triangle is cut into: (3, 8) each, positions, places and vectors."""
        triangles, strips = [triangle], list[Piece]()
        while True:
            uneven = [one for one in strips if self._is_long(one, 0) != self._is_long(one, 2)]
            triangles += self._halves(uneven)
            strips = [one for one in strips if self._is_long(one, 0) == self._is_long(one, 2)]
            if not any(self._is_long(one, k) for one in triangles + strips for k in range(len(one[0]))):
                break
            cut = [one for one in strips if self._is_long(one, 0)]
            wholes = [self._with_middles(one) for one in cut]
            old = [one for one in strips if not self._is_long(one, 0)]
            old += [_picked(one, corners) for corners in ((0, 4, 6, 3), (4, 1, 2, 6)) for one in wholes]
            triangles, new = self._cut(triangles)
            strips = old + new
        last = triangles + self._halves(strips)
        return [np.column_stack([[self.positions[v] for v in corners], values]) for corners, values in last]

    def _length(self, piece: Piece, k: int) -> float:
        a, b = (self.positions[piece[0][(k + m) % len(piece[0])]] for m in range(2))
        return float(np.linalg.norm(b - a))

    def _is_long(self, piece: Piece, k: int) -> bool:
        return self._length(piece, k) > self.longest

    def _with_middles(self, piece: Piece) -> Piece:
        corners, values = piece
        between, vertices = [], list(corners)
        for k in range(len(corners)):
            last = (k + 1) % len(corners)
            low, high = sorted((corners[k], corners[last]))
            if (low, high) not in self.middles and self._is_long(piece, k):
                self.middles[low, high] = len(self.positions)
                self.positions.append(0.5 * (self.positions[low] + self.positions[high]))
            vertices.append(self.middles.get((low, high), -1))
            middle = 0.5 * (values[k] + values[last])
            size = np.linalg.norm(middle[2:])
            middle[2:] = middle[2:] / size if size > 1e-3 else values[k, 2:]
            between.append(middle)
        return tuple(vertices), np.concatenate([values, between])

    def _cut(self, triangles: list[Piece]) -> tuple[list[Piece], list[Piece]]:
        parts: dict[tuple[int, ...], list[Piece]] = {}
        strips: dict[int, list[Piece]] = {}
        for one in triangles:
            long = [self._is_long(one, k) for k in range(3)]
            whole = self._with_middles(one)
            if sum(long) in (0, 3):
                kinds = [(0, 1, 2)] if not sum(long) else [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]
                turn = 3 if sum(long) else -1
            else:
                turn = next(k for k in range(3) if long[k] and not long[k - 1])
                a, b, c = (int((turn + k) % 3) for k in range(3))
                ab, bc = 3 + a, 3 + b
                kinds = [(a, ab, c), (ab, b, c)] if sum(long) == 1 else [(ab, b, bc), (a, ab, bc), (a, bc, c)]
                if sum(long) == 2 and self._length(one, c) < self.narrow:
                    kinds = kinds[:1]
                    strips.setdefault(turn, []).append(_picked(whole, (a, ab, bc, c)))
            for n, corners in enumerate(kinds):
                kind = turn, sum(long), 5 - len(kinds), n
                parts.setdefault(kind, []).append(_picked(whole, corners))
        ordered = [one for kind in sorted(parts) for one in parts[kind]]
        return ordered, [one for turn in sorted(strips) for one in strips[turn]]

    def _halves(self, strips: list[Piece]) -> list[Piece]:
        first = []
        for corners, _ in strips:
            a, b, c, d = (self.positions[v] for v in corners)
            first.append(np.linalg.norm(c - a) <= np.linalg.norm(d - b))
        ways: list[tuple[tuple[int, ...], bool]] = [((0, 1, 2), True), ((0, 2, 3), True)]
        ways += [((0, 1, 3), False), ((1, 2, 3), False)]
        return [
            _picked(one, corners)
            for corners, which in ways
            for one, is_first in zip(strips, first, strict=True)
            if is_first == which
        ]


def _picked(piece: Piece, corners: tuple[int, ...]) -> Piece:
    return tuple(piece[0][k] for k in corners), piece[1][list(corners)]
