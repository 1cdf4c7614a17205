"""Passes of the paper's profile: thresholds that exactly a given share of the coefficients reaches.

A pass of the coder ends at a plane, and planes are powers of two. So magnitudes are renumbered. Thresholds
T[0] < T[1] < … are all powers of two and a few more; plane P of the coded number y is the bit that says
whether a magnitude V reaches T[P]. The part above T[P] follows in the bits below, highest first:

    y = 2^P + (V − T[P])·2^(P − r[P]),  T[P] ≤ V < T[P + 1],  r[P] = ⌈log2(T[P + 1] − T[P])⌉

SPEC.md, section 7.1, defines the same for decoders.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray

__all__ = ["SHARES", "from_coded", "share_thresholds", "to_coded"]

SHARES = (0.03, 0.05, 0.07, 0.15)
"""Shares of the coefficients at which a pass ends: those of the paper's figure 13."""

_POWERS = 25
_AT_ONCE = 2**16
"""Numbers converted back at a time, because a decoder's memory is limited."""


def share_thresholds(magnitudes: NDArray[Any]) -> tuple[int, ...]:
    """Return the least magnitudes that at most 3, 5, 7 and 15 % of all reach, ascending, without repeats."""
    falling = np.append(np.sort(magnitudes, axis=None)[::-1], -1)
    counts = [max(1, round(share * magnitudes.size)) for share in SHARES]
    # If the next one is as large, the threshold is above it: a pass never has more than its share.
    least = {int(falling[n - 1]) + int(falling[n - 1] == falling[n]) for n in counts}
    return tuple(sorted(least - {0}))


def to_coded(values: NDArray[Any], thresholds: Sequence[int]) -> IntArray:
    """Return coefficients, whole numbers of any shape, in the coder's numbering; signs stay."""
    starts, bits = _passes(thresholds)
    magnitudes = np.abs(values).astype(np.int64)
    plane = np.maximum(np.searchsorted(starts, magnitudes, side="right") - 1, 0)
    coded = (1 << plane) + ((magnitudes - starts[plane]) << (plane - bits[plane]))
    return np.where(magnitudes > 0, np.copysign(coded, values), 0).astype(np.int32)


def from_coded(coded: FloatArray, thresholds: Sequence[int]) -> FloatArray:
    """Invert `to_coded`; numbers between those that it makes give the next magnitude below."""
    starts, bits = _passes(thresholds)
    found = np.zeros(coded.size)
    flat = coded.reshape(-1)
    for begin in range(0, coded.size, _AT_ONCE):
        part = flat[begin : begin + _AT_ONCE]
        magnitudes = np.abs(part)
        plane = np.maximum(np.frexp(magnitudes)[1] - 1, 0)
        above = np.floor((magnitudes - np.ldexp(1.0, plane)) * np.ldexp(1.0, bits[plane] - plane))
        whole = np.copysign(starts[plane] + above, part)
        found[begin : begin + _AT_ONCE] = np.where(magnitudes > 0, whole, 0.0)
    return found.reshape(coded.shape)


def _passes(thresholds: Sequence[int]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    # For each plane its threshold, and the number of bits that code the part above it.
    starts = np.unique([2**power for power in range(_POWERS)] + list(thresholds)).astype(np.int64)
    widths = np.diff(starts)
    bits = np.ceil(np.log2(widths)).astype(np.int64)
    return starts[:-1], bits
