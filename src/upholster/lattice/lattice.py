"""The lattice of a sample: the waves at which it repeats, and their phases at every pixel."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from upholster.types import FloatArray, PixelArray, frozen_array

__all__ = ["Lattice", "find_lattice"]

TURN = 65536
"""Units of phase in a turn."""

_LEAST_PERIODS = 3
_LEAST_PERIOD = 4.0
_PEAKS = 10
_GATE = 0.7
_STEPS = 3


@dataclass(frozen=True, eq=False)
class Lattice:
    """One or two waves at which a sample repeats surely.

    Attributes
    ----------
    waves
        (n, 2) float64, n = 1 or 2: the generators' wave vectors, in cycles per pixel of the sample (row,
        column). Every wave at which the sample repeats is nearly a sum of whole multiples of these.
    phases
        (n, H, W) int16: the sample's own phase at each pixel, in units of a 65,536th of a turn; it wraps as
        int16 does. It grows by `waves` on average, and follows the sample where that is irregular.
    certainty
        (n,) 0 to 1: how surely the sample repeats. Waves that are not sure are left out.
    """

    waves: FloatArray
    phases: NDArray[np.int16]
    certainty: FloatArray

    def __post_init__(self) -> None:
        for array in (self.waves, self.phases, self.certainty):
            frozen_array(array)


def find_lattice(exemplar: PixelArray) -> Lattice | None:
    """Find the one or two waves at which a sample repeats.

    Parameters
    ----------
    exemplar
        (H, W, C), as `upholster.synthesize` takes it.

    Returns
    -------
    Lattice or None
        None where nothing repeats surely.
    """
    plane = _plane(exemplar)
    if min(plane.shape) < 16 or not plane.any():  # a small sample, or one colour
        return None
    waves, powers = _peaks(plane)
    if not len(waves):
        return None
    chosen = _chosen(waves, powers)
    found = [_followed(plane, wave) for wave in chosen]
    sure = [n for n, (_, _, certainty) in enumerate(found) if certainty >= _GATE]
    if not sure:
        return None
    return Lattice(
        np.stack([found[n][0] for n in sure]),
        np.stack([found[n][1] for n in sure]),
        np.array([found[n][2] for n in sure]),
    )


def _plane(exemplar: PixelArray) -> FloatArray:
    colors = exemplar[:, :, : exemplar.shape[2] - (exemplar.shape[2] in (2, 4))]
    plane: FloatArray = colors.sum(axis=2, dtype=np.float64)
    plane -= plane.mean()
    return plane


def _peaks(plane: FloatArray) -> tuple[FloatArray, FloatArray]:
    # Waves (n, 2) at which the spectrum is highest, and their power, highest first.
    height, width = plane.shape
    window = np.hanning(height + 2)[1:-1, None] * np.hanning(width + 2)[1:-1]
    size = 2 * height, 2 * width
    power = np.abs(np.fft.fft2((plane - plane.mean()) * window, size)) ** 2
    f, g = np.fft.fftfreq(size[0])[:, None], np.fft.fftfreq(size[1])
    allowed = (np.abs(f) * height + np.abs(g) * width >= _LEAST_PERIODS) & (
        np.hypot(f, g) <= 1 / _LEAST_PERIOD
    )
    allowed &= (f > 0) | ((f == 0) & (g > 0))
    highest = power
    for axis in (0, 1):
        shifted = [np.roll(highest, step, axis) for step in range(-3, 4)]
        highest = np.maximum.reduce(shifted)
    i, j = np.nonzero(allowed & (power == highest))
    order = np.argsort(-power[i, j], kind="stable")[:_PEAKS]
    i, j = i[order], j[order]
    return np.stack([f[i, 0], g[j]], axis=1), power[i, j]


def _chosen(waves: FloatArray, powers: FloatArray) -> list[FloatArray]:
    # The two that explain most: peaks at whole combinations of them.
    best: tuple[int, ...] = (0,)
    value = 0.0
    step = np.mgrid[-4:5, -4:5].reshape(2, -1).T
    for a, b in combinations(range(len(waves)), 2):
        pair = waves[[a, b]]
        sine = abs(np.linalg.det(pair)) / (np.linalg.norm(pair[0]) * np.linalg.norm(pair[1]))
        if sine < 0.3:
            continue
        made = step @ pair
        away = np.linalg.norm(waves[:, None] - made, axis=2).min(axis=1)
        explained = float(powers[away < 0.15 * np.linalg.norm(pair, axis=1).min()].sum())
        if explained > 1.05 * value:
            best, value = (a, b), explained
    return [waves[n] for n in best]


def _followed(plane: FloatArray, wave: FloatArray) -> tuple[FloatArray, NDArray[np.int16], float]:
    # The wave, refined; its phase at each pixel; and how sure it is.
    height, width = plane.shape
    rows, columns = np.arange(height)[:, None], np.arange(width)
    sigma = 1.0 / float(np.hypot(*wave))
    weights = _smoothed(np.ones((height, width)), sigma)
    for _ in range(_STEPS + 1):
        turns = rows * wave[0] + columns * wave[1]
        product = plane * np.exp(-2j * np.pi * turns)
        low = (_smoothed(product.real, sigma) + 1j * _smoothed(product.imag, sigma)) / weights
        down = np.angle((low[1:] * low[:-1].conj()).sum()) / (2 * np.pi)
        right = np.angle((low[:, 1:] * low[:, :-1].conj()).sum()) / (2 * np.pi)
        wave, used = wave + np.array([down, right]), wave
    turns = rows * used[0] + columns * used[1] + np.angle(low) / (2 * np.pi)
    phases = np.rint(turns * TURN).astype(np.int64).astype(np.int16)
    size = np.abs(low)
    steady = 1 - float((size < 0.4 * np.median(size)).mean()) / 0.1
    return used, phases, max(0.0, steady)


def _smoothed(plane: FloatArray, sigma: float) -> FloatArray:
    # A Gaussian of `sigma` pixels; nothing beyond the borders.
    reach = int(3 * sigma + 1)
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    taps /= taps.sum()
    padded = np.pad(plane, reach)
    out = np.zeros((plane.shape[0], padded.shape[1]))
    for k, tap in enumerate(taps):
        out += tap * padded[k : k + plane.shape[0]]
    found = np.zeros_like(plane)
    for k, tap in enumerate(taps):
        found += tap * out[:, k : k + plane.shape[1]]
    return found
