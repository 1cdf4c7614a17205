"""The passes in SPEC.md, section 7.2, are Python: they decode what the program decodes."""

import re
from math import exp, floor, log, log2
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upholster.codec.ezw import decode, encode
from upholster.codec.header import ImageHeader
from upholster.codec.partial_image import ImageDecoder

ROOT = Path(__file__).parents[2]
STRETCH = [
    min(2047, max(-2047, round(256 * log(q / (1 - q))))) for q in ((p + 0.5) / 4096 for p in range(4096))
]
SQUASH = [min(65520, max(16, round(65536 / (1 + exp(-x / 256))))) for x in range(-2048, 2048)]
AROUND = [
    (-1, 0),
    (1, 0),
    (0, -1),
    (0, 1),
    (-1, -1),
    (1, -1),
    (-1, 1),
    (1, 1),
    (-2, 0),
    (2, 0),
    (0, -2),
    (0, 2),
]
"""Neighbours, in steps along p and q."""


class Coder:
    """The arithmetic decoder of section 5.1, in the same words."""

    def __init__(self, data: bytes) -> None:
        self.data, self.place = data + bytes(4), 4
        self.low, self.high, self.code = 0, 2**32 - 1, int.from_bytes(self.data[:4], "big")
        self.counters: dict[Any, list[int]] = {}
        self.mixers: dict[Any, list[int]] = {}

    def counter(self, name: Any) -> list[int]:
        return self.counters.setdefault(name, [2**19, 0])

    def chance(self, name: Any) -> int:
        return self.counter(name)[0] >> 4

    def bit(self, names: Any, mixer: Any, weight: int, limit: int) -> int:
        inputs = [self.counter(name) for name in names]
        weights = self.mixers.setdefault(mixer, [weight] * len(inputs))
        logits = [STRETCH[counter[0] >> 8] for counter in inputs]
        x = sum(w * s for w, s in zip(weights, logits, strict=True)) >> 16
        chance = SQUASH[2048 + min(2047, max(-2047, x))]
        span = self.high - self.low
        middle = self.low + (span >> 16) * chance + ((span & 65535) * chance >> 16)
        bit = int(self.code <= middle)
        self.low, self.high = (self.low, middle) if bit else (middle + 1, self.high)
        while self.low >> 24 == self.high >> 24:
            byte = self.data[self.place] if self.place < len(self.data) else 0
            self.code = (self.code << 8 | byte) & 0xFFFFFFFF
            self.low, self.high = self.low << 8 & 0xFFFFFFFF, (self.high << 8 | 255) & 0xFFFFFFFF
            self.place += 1
        for k, logit in enumerate(logits):
            weights[k] += (logit * ((bit << 16) - chance) + 8192) >> 14
        for counter in inputs:
            counter[0] += (
                (((2**20 - 1 if bit else 0) - counter[0]) >> 4) * round(16384 / (counter[1] + 1.6))
            ) >> 10
            counter[1] = min(counter[1] + 1, limit)
        return bit


def places(header: ImageHeader) -> tuple[dict[Any, tuple[int, int, int]], int]:
    """Return first coefficient, rows and columns by (level, kind, channel), and how many there are."""
    sizes = [(header.height, header.width)]
    for _ in range(header.levels):
        sizes.append(tuple(-(-side // 2) for side in sizes[-1]))  # type: ignore[arg-type]
    kinds = [(header.levels, 0, *sizes[-1])]
    for level in range(header.levels, 0, -1):
        (rows, columns), (low_rows, low_columns) = sizes[level - 1], sizes[level]
        kinds += [
            (level, 1, low_rows, columns - low_columns),
            (level, 2, rows - low_rows, low_columns),
            (level, 3, rows - low_rows, columns - low_columns),
        ]
    bands, count = {}, 0
    for level, kind, rows, columns in kinds:
        for channel in range(header.channels):
            bands[level, kind, channel] = (count, rows, columns)
            count += rows * columns
    return bands, count


def tree(header: ImageHeader) -> tuple[list[int], tuple[Any, ...], dict[Any, tuple[int, int, int]], int]:
    """Return roots, the lists of section 7.2, bands, and the number of coefficients."""
    bands, n = places(header)

    def at(level: int, kind: int, channel: int, i: int, j: int) -> int:
        first, rows, columns = bands.get((level, kind, channel), (0, 0, 0))
        return first + i * columns + j if 0 <= i < rows and 0 <= j < columns else n

    numbers = [[0] * (n + 1) for _ in range(4)]
    parent, following = [n] * (n + 1), [n] * (n + 1)
    lists: list[list[list[int]]] = [[[] for _ in range(n + 1)] for _ in range(4)]
    for (level, kind, channel), (first, rows, columns) in bands.items():
        for i in range(rows):
            for j in range(columns):
                x = first + i * columns + j
                low = max(0, level + 1 - (kind > 0) - (kind == 3)) if header.exact and header.levels else 0
                for of, value in zip(numbers, (level, kind, channel, low), strict=True):
                    of[x] = value
                following[x] = at(level, kind, channel + 1, i, j)
                below = [at(level, k, channel, i, j) for k in (1, 2, 3) if level] if kind == 0 else []
                if kind:
                    below = [
                        at(level - 1, kind, channel, 2 * i + a, 2 * j + b) for a in (0, 1) for b in (0, 1)
                    ]
                    below = below if level > 1 else []
                others = [at(level, k, channel, i, j) for k in (1, 2, 3) if kind and k != kind]
                earlier = [at(level, kind, channel - m, i, j) for m in (1, 2, 3) if m <= channel]
                turned = [(p, q) if kind == 2 else (q, p) for p, q in AROUND]
                around = [at(level, kind, channel, i + a, j + b) for a, b in turned]
                lists[0][x] = [y for y in below if y < n]
                lists[1][x], lists[2][x], lists[3][x] = others, earlier, around
                for y in lists[0][x]:
                    parent[y] = x
    in_order = sorted(bands, key=lambda band: (-band[0], band[2], band[1]))
    spans = [bands[band] for band in in_order]
    roots = [
        x for first, rows, columns in spans for x in range(first, first + rows * columns) if parent[x] == n
    ]
    return roots, (*numbers, parent, following, *lists), bands, n


@pytest.mark.parametrize("name", ["colour8", "lossless", "odd"])
def test_the_passes_of_the_specification_run(name: str) -> None:
    block = re.search(
        r"```python\n(def passes\(.*?)```", (ROOT / "SPEC.md").read_text(encoding="utf-8"), re.DOTALL
    )
    assert block
    space: dict[str, Any] = {"floor": floor, "log2": log2}
    exec(block[1], space)
    if name == "odd":
        image = np.random.default_rng(1).integers(0, 256, (7, 5, 4)).cumsum(axis=0).astype(np.uint8)
        data = encode(image, sample_quality="lossless", levels=2)
    else:
        data = (ROOT / "tests" / "vectors" / f"{name}.ezw").read_bytes()
    header = ImageHeader.parse(data[4:])
    assert header.exact
    roots, lists, bands, n = tree(header)
    payload = data[4 + header.length :]
    known, sign, _, _ = space["passes"](Coder(payload), header.plane, n, header.levels, roots, lists)
    decoder = ImageDecoder(header)
    decoder.feed(payload)
    assert decoder.complete
    assert (decoder.image() == decode(data).image).all()
    for band in decoder._coefficients.tree.bands:
        first, rows, columns = bands[band.level, band.kind, band.channel]
        found = np.array(known[first : first + rows * columns]) * (
            1 - 2 * (np.array(sign[first : first + rows * columns]) == 2)
        )
        np.testing.assert_array_equal(found.reshape(rows, columns), decoder._coefficients.values(band))
