"""One level of a lifted 2-D wavelet transform, forward and inverse, in place.

Steps alternate: even ones change the odd samples from their even neighbours, odd ones the even samples from
their odd neighbours; beyond the ends the signal is mirrored. What is written here fixes every operation and
its order, so that any IEEE implementation without fused multiply-add gets the same bits.
"""

from typing import Any

import numpy as np
from numba import types
from numba.extending import overload

from upholster.jit import inline, kernel

__all__ = ["DAUBECHIES97", "HAAR", "LEGALL53", "lift_forward", "lift_inverse"]

DAUBECHIES97, LEGALL53, HAAR = 0, 1, 2

# CDF 9/7, factored by Daubechies and Sweldens (1998), scaled so that the low-pass gain is √2.
_STEPS97 = np.array([-1.586134342059924, -0.052980118572961, 0.882911075530934, 0.443506852043971])
_SCALE97 = np.array([1.149604398860241, 1 / 1.149604398860241])


def _step(kind: int, step: int, sign: int, target: Any, left: Any, right: Any) -> None:
    """Add ``sign`` times the lifting step from `left` and `right` to `target`, element by element."""
    if kind == DAUBECHIES97:
        target += (sign * _STEPS97[step]) * (left + right)
    elif kind == LEGALL53:
        target += -sign * ((left + right) >> 1) if step == 0 else sign * ((left + right + 2) >> 2)
    else:
        target += -sign * left if step == 0 else sign * (right >> 1)


def _scale(kind: int, half: int, forward: bool, line: Any) -> None:
    """Scale a line of the low-pass (0) or high-pass (1) half."""
    if kind == DAUBECHIES97:
        line *= _SCALE97[half if forward else 1 - half]


@overload(_step, strict=False)
def _step_overload(kind: Any, step: Any, sign: Any, target: Any, left: Any, right: Any) -> Any:
    if isinstance(target.dtype, types.Float):

        def real(kind: int, step: int, sign: int, target: Any, left: Any, right: Any) -> None:
            factor = sign * _STEPS97[step]
            for n in range(target.shape[0]):
                target[n] += factor * (left[n] + right[n])

        return real

    def whole(kind: int, step: int, sign: int, target: Any, left: Any, right: Any) -> None:
        if kind == 1:
            if step == 0:
                for n in range(target.shape[0]):
                    target[n] -= sign * ((left[n] + right[n]) >> 1)
            else:
                for n in range(target.shape[0]):
                    target[n] += sign * ((left[n] + right[n] + 2) >> 2)
        elif step == 0:
            for n in range(target.shape[0]):
                target[n] -= sign * left[n]
        else:
            for n in range(target.shape[0]):
                target[n] += sign * (right[n] >> 1)

    return whole


@overload(_scale, strict=False)
def _scale_overload(kind: Any, half: Any, forward: Any, line: Any) -> Any:
    if isinstance(line.dtype, types.Float):

        def real(kind: int, half: int, forward: bool, line: Any) -> None:
            factor = _SCALE97[half if forward else 1 - half]
            for n in range(line.shape[0]):
                line[n] *= factor

        return real

    def nothing(kind: int, half: int, forward: bool, line: Any) -> None:
        pass

    return nothing


@inline
def _lift_halves(kind: int, step: int, sign: int, low: Any, high: Any) -> None:
    # One step along a line whose even samples lie in `low` and odd ones in `high`, at least one each.
    evens, odds = low.shape[0], high.shape[0]
    if step % 2 == 0:
        inner = evens - 1
        _step(kind, step, sign, high[:inner], low[:inner], low[1:])
        if odds == evens:
            _step(kind, step, sign, high[inner:], low[inner:], low[inner:])
        return
    _step(kind, step, sign, low[:1], high[:1], high[:1])
    _step(kind, step, sign, low[1:odds], high[: odds - 1], high[1:])
    if evens > odds and kind != 2:
        # Haar leaves a last sample without a partner as it is.
        _step(kind, step, sign, low[odds:], high[odds - 1 :], high[odds - 1 :])


@inline
def _lift_rows(kind: int, step: int, sign: int, image: Any, height: int, width: int) -> None:
    # The same step down the columns, row by row.
    for i in range(1 - step % 2, height, 2):
        if i + 1 == height and step % 2 == 1 and kind == 2 and i % 2 == 0:
            continue
        above = i - 1 if i > 0 else i + 1
        below = i + 1 if i + 1 < height else i - 1
        _step(kind, step, sign, image[i, :width], image[above, :width], image[below, :width])


@kernel
def lift_forward(kind: int, steps: int, image: Any, height: int, width: int, spare: Any) -> None:
    """Transform the top left (height, width) of `image` in place: LL, HL, LH, HH in its quadrants.

    `spare` is as large as `image`.
    """
    evens, odds = (width + 1) // 2, width // 2
    if odds > 0:
        low, high = np.empty(evens, image.dtype), np.empty(odds, image.dtype)
        for i in range(height):
            line = image[i, :width]
            for n in range(odds):
                low[n] = line[2 * n]
                high[n] = line[2 * n + 1]
            if evens > odds:
                low[odds] = line[width - 1]
            for step in range(steps):
                _lift_halves(kind, step, 1, low, high)
            _scale(kind, 0, True, low)
            _scale(kind, 1, True, high)
            line[:evens] = low
            line[evens:] = high
    evens, odds = (height + 1) // 2, height // 2
    if odds > 0:
        for step in range(steps):
            _lift_rows(kind, step, 1, image, height, width)
        for i in range(height):
            to = spare[i // 2 + (evens if i % 2 else 0), :width]
            to[:] = image[i, :width]
            _scale(kind, i % 2, True, to)
        for i in range(height):
            image[i, :width] = spare[i, :width]


@kernel
def lift_inverse(kind: int, steps: int, image: Any, height: int, width: int, spare: Any) -> None:
    """Invert `lift_forward`."""
    evens, odds = (height + 1) // 2, height // 2
    if odds > 0:
        for i in range(height):
            to = spare[i, :width]
            to[:] = image[i // 2 + (evens if i % 2 else 0), :width]
            _scale(kind, i % 2, False, to)
        for i in range(height):
            image[i, :width] = spare[i, :width]
        for step in range(steps - 1, -1, -1):
            _lift_rows(kind, step, -1, image, height, width)
    evens, odds = (width + 1) // 2, width // 2
    if odds > 0:
        low, high = np.empty(evens, image.dtype), np.empty(odds, image.dtype)
        for i in range(height):
            line = image[i, :width]
            low[:] = line[:evens]
            high[:] = line[evens:]
            _scale(kind, 0, False, low)
            _scale(kind, 1, False, high)
            for step in range(steps - 1, -1, -1):
                _lift_halves(kind, step, -1, low, high)
            for n in range(odds):
                line[2 * n] = low[n]
                line[2 * n + 1] = high[n]
            if evens > odds:
                line[width - 1] = low[odds]
