"""One level of a lifted 2-D wavelet transform, forward and inverse.

Steps alternate: even ones change the odd samples from their even neighbours, odd ones the even samples from
their odd neighbours; beyond the ends the signal is mirrored. This code fixes every operation and its order,
so that any IEEE implementation without fused multiply-add gets the same bits.

Rows are transformed one by one. The steps down the columns follow immediately, each one row behind the
previous step, so that only a few rows are in use at any time and the image passes through the cache once.
"""

from typing import Any

import numpy as np

from upholster.runtime.jit import allocating_kernel, by_type, inline, is_float

__all__ = ["DAUBECHIES97", "LEGALL53", "lift_forward", "lift_inverse"]

DAUBECHIES97, LEGALL53 = 0, 1

# CDF 9/7, factored by Daubechies and Sweldens (1998); the scale makes the low-pass half's gain the square
# root of 2.
_STEPS97 = np.array([-1.586134342059924, -0.052980118572961, 0.882911075530934, 0.443506852043971])
_SCALE97 = np.array([1.149604398860241, 1 / 1.149604398860241])


def _step(kind: int, step: int, sign: int, lines: Any, to: int, left: int, right: int, count: int) -> None:
    """Add ``sign`` times a step's prediction from `count` samples at `left` and `right` to those at `to`."""
    n = np.arange(count)
    around = lines[left + n] + lines[right + n]
    if kind == DAUBECHIES97:
        lines[to + n] += (sign * _STEPS97[step]) * around
    else:
        lines[to + n] += -sign * (around >> 1) if step == 0 else sign * ((around + 2) >> 2)


def _scale(kind: int, half: int, forward: bool, lines: Any, at: int, count: int) -> None:
    """Scale `count` samples of the low-pass (0) or high-pass (1) half."""
    if kind == DAUBECHIES97:
        lines[at : at + count] *= _SCALE97[half if forward else 1 - half]


@by_type(_step)
def _step_overload(
    kind: Any, step: Any, sign: Any, lines: Any, to: Any, left: Any, right: Any, count: Any
) -> Any:
    # Places are unsigned, so that no test for negative indices is compiled, and the loops are vectorized.
    if is_float(lines.dtype):

        def real(
            kind: int, step: int, sign: int, lines: Any, to: int, left: int, right: int, count: int
        ) -> None:
            t, p, q = np.uint64(to), np.uint64(left), np.uint64(right)
            factor = sign * _STEPS97[step]
            for n in range(np.uint64(max(0, count))):
                lines[t + n] += factor * (lines[p + n] + lines[q + n])

        return real

    def whole(
        kind: int, step: int, sign: int, lines: Any, to: int, left: int, right: int, count: int
    ) -> None:
        t, p, q = np.uint64(to), np.uint64(left), np.uint64(right)
        if step == 0:
            for n in range(np.uint64(max(0, count))):
                lines[t + n] -= sign * ((lines[p + n] + lines[q + n]) >> 1)
        else:
            for n in range(np.uint64(max(0, count))):
                lines[t + n] += sign * ((lines[p + n] + lines[q + n] + 2) >> 2)

    return whole


@by_type(_scale)
def _scale_overload(kind: Any, half: Any, forward: Any, lines: Any, at: Any, count: Any) -> Any:
    if is_float(lines.dtype):

        def real(kind: int, half: int, forward: bool, lines: Any, at: int, count: int) -> None:
            factor = _SCALE97[half if forward else 1 - half]
            begin = np.uint64(at)
            for n in range(np.uint64(count)):
                lines[begin + n] *= factor

        return real

    def nothing(kind: int, half: int, forward: bool, lines: Any, at: int, count: int) -> None:
        pass

    return nothing


@inline
def _lift_halves(kind: int, step: int, sign: int, lines: Any, low: int, evens: int, odds: int) -> None:
    # One step along a line whose even samples are at `low` and odd ones after them, at least one each.
    high = low + evens
    if step % 2 == 0:
        inner = evens - 1
        _step(kind, step, sign, lines, high, low, low + 1, inner)
        if odds == evens:
            _step(kind, step, sign, lines, high + inner, low + inner, low + inner, 1)
        return
    _step(kind, step, sign, lines, low, high, high, 1)
    _step(kind, step, sign, lines, low + 1, high, high + 1, odds - 1)
    if evens > odds:
        _step(kind, step, sign, lines, low + odds, high + odds - 1, high + odds - 1, 1)


@inline
def _lift_row(
    kind: int, step: int, sign: int, lines: Any, i: int, height: int, width: int, count: int
) -> None:
    # One step on row i; `count` rows are in use, and row i is line i modulo count.
    if i < 0 or i >= height:
        return
    above = i - 1 if i > 0 else i + 1
    below = i + 1 if i + 1 < height else i - 1
    _step(kind, step, sign, lines, i % count * width, above % count * width, below % count * width, width)


@inline
def _take(lines: Any, at: int, row: Any) -> None:
    # Slices are copied in loops: Numba's own code takes a second to compile, just for an error message.
    begin = np.uint64(at)
    for n in range(np.uint64(row.shape[0])):
        row[n] = lines[begin + n]


@inline
def _put(row: Any, lines: Any, at: int) -> None:
    begin = np.uint64(at)
    for n in range(np.uint64(row.shape[0])):
        lines[begin + n] = row[n]


@allocating_kernel
def lift_forward(kind: int, steps: int, image: Any, low: Any, out: Any) -> None:
    """Transform `image` (h, w).

    LL goes to `low` (⌈h/2⌉, ⌈w/2⌉); HL, LH and HH go to the quadrants of the top left (h, w) of `out`.
    """
    height, width = image.shape
    low_rows, evens = low.shape
    odds = width - evens
    down = steps if height > 1 else 0
    count = down + 2
    lines = np.empty(count * width, image.dtype)
    for t in range(0, height + down + 1, 2):
        for i in range(max(0, t - 1), min(t + 1, height)):
            at = i % count * width
            u, v = np.uint64(i), np.uint64(at)
            w = np.uint64(at + evens)
            for n in range(np.uint64(odds)):
                lines[v + n] = image[u, n + n]
                lines[w + n] = image[u, n + n + np.uint64(1)]
            if evens > odds:
                lines[at + odds] = image[i, width - 1]
            if odds > 0:
                for step in range(steps):
                    _lift_halves(kind, step, 1, lines, at, evens, odds)
                _scale(kind, 0, True, lines, at, evens)
                _scale(kind, 1, True, lines, at + evens, odds)
        for step in range(down):
            _lift_row(kind, step, 1, lines, t - 1 - step, height, width, count)
        for i in range(max(0, t - down - 1), min(t - down + 1, height)):
            at = i % count * width
            if down > 0:
                _scale(kind, i % 2, True, lines, at, width)
            if i % 2 == 0:
                _take(lines, at, low[i // 2])
                _take(lines, at + evens, out[i // 2, evens:width])
            else:
                _take(lines, at, out[low_rows + i // 2, :width])


@allocating_kernel
def lift_inverse(kind: int, steps: int, low: Any, coefficients: Any, image: Any) -> None:
    """Invert `lift_forward`: from LL in `low` and the quadrants of `coefficients` to `image` (h, w)."""
    height, width = image.shape
    low_rows, evens = low.shape
    odds = width - evens
    down = steps if height > 1 else 0
    count = down + 2
    lines = np.empty(count * width, image.dtype)
    for t in range(1, height + down + 1, 2):
        for i in range(t - 1, min(t + 1, height)):
            at = i % count * width
            if i % 2 == 0:
                _put(low[i // 2], lines, at)
                _put(coefficients[i // 2, evens:width], lines, at + evens)
            else:
                _put(coefficients[low_rows + i // 2, :width], lines, at)
            if down > 0:
                _scale(kind, i % 2, False, lines, at, width)
        for back in range(down):
            _lift_row(kind, steps - 1 - back, -1, lines, t - 1 - back, height, width, count)
        for i in range(max(0, t - down - 1), min(t - down + 1, height)):
            at = i % count * width
            if odds > 0:
                _scale(kind, 0, False, lines, at, evens)
                _scale(kind, 1, False, lines, at + evens, odds)
                for step in range(steps - 1, -1, -1):
                    _lift_halves(kind, step, -1, lines, at, evens, odds)
            u, v = np.uint64(i), np.uint64(at)
            w = np.uint64(at + evens)
            for n in range(np.uint64(odds)):
                image[u, n + n] = lines[v + n]
                image[u, n + n + np.uint64(1)] = lines[w + n]
            if evens > odds:
                image[i, width - 1] = lines[at + odds]
