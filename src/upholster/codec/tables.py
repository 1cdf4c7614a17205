"""The integer tables that coder and decoder share (SPEC.md, "Tables")."""

import math

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import frozen_array

__all__ = ["POINTS", "QUANTA", "RECIPROCALS", "SQUASH", "STRETCH", "THRESHOLDS"]


def _table(values: list[int]) -> NDArray[np.int32]:
    return frozen_array(np.array(values, np.int32))


def _squash(x: int) -> int:
    return min(65520, max(16, round(65536 / (1 + math.exp(-x / 256)))))


def _stretch(p: int) -> int:
    q = (p + 0.5) / 4096
    return min(2047, max(-2047, round(256 * math.log(q / (1 - q)))))


def _point(ones: int) -> int:
    # Average position of a value in its interval if values fall off exponentially and `ones` of 64 are above
    # the middle.
    q = min(0.499, (ones + 0.5) / 64)
    r = -2 * math.log(q / (1 - q))
    return round(64 * min(0.55, max(0.3, 1 / r - 1 / (math.exp(r) - 1))))


STRETCH = _table([_stretch(p) for p in range(4096)])
"""Probability in 1/4096 → logit in 1/256, −2047 to 2047."""

SQUASH = _table([_squash(x - 2048) for x in range(4096)])
"""Logit in 1/256 plus 2048 → probability in 1/65536."""

RECIPROCALS = _table([round(16384 / (n + 1.6)) for n in range(1024)])
"""How far a counter that has seen n bits moves toward the next one, in 1/16384."""

QUANTA = _table([0] + [min(15, 1 + math.floor(2 * math.log2(t / 2 + 0.5) + 0.5)) for t in range(1, 256)])
"""Score in units of the current plane → 0 … 15, two steps per octave."""

THRESHOLDS = _table([26214, 13107, 6554, 3277, 1638, 786])
"""Least probability of significance, in 1/65536, of each likely pass: 0.4, 0.2, 0.1, 0.05, 0.025, 0.012."""

POINTS = _table([_point(ones) for ones in range(65)])
"""Reconstruction point in 1/64 of the interval, by how many of 64 refinement bits were 1."""
