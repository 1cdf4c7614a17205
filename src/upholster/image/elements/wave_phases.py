"""Following a wave over a sample: its own phase everywhere."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.image.elements._lattice_kernels import add_beats, interpolate_phases, smooth_nodes
from upholster.image.elements.planes import Plane

__all__ = ["Followed", "follow", "pixel_phases", "strength"]

TURN = 2**16
_FINE = 2**32
"""Units of phase in a turn, for results and for a wave's growth from pixel to pixel."""

_COSINES = np.rint(2**14 * np.cos(2 * np.pi * np.arange(4096) / 4096)).astype(np.int64)

_FAINT = 0.1
"""A plane hardly contains a wave below this share of its root mean square."""

_CELLS = 2
"""The least number of nodes in a period."""

_REACH = 3.0
"""Where the Gaussian ends, in standard deviations; one is a period of the wave."""


@dataclass(frozen=True, eq=False)
class Followed:
    """A wave that was followed over a plane.

    Attributes
    ----------
    step
        The assumed growth of its phase per row and per column, in 2^-32 of a turn.
    cell
        Pixels between nodes.
    nodes
        (n, m) int16: how far the wave is ahead of this growth, in 2^-16 of a turn.
    """

    step: tuple[int, int]
    cell: int
    nodes: NDArray[np.int16]


def follow(plane: Plane, wave: FloatArray) -> Followed:
    """Follow a wave: shift its frequency to zero, then average the plane over about a period.

    A wave that the plane hardly contains is assumed to grow evenly.

    Parameters
    ----------
    plane
        (H, W).
    wave
        (2,) cycles per pixel.

    References
    ----------
    Demodulation is that of interferograms: Takeda, Ina, Kobayashi, JOSA 72 (1982).
    """
    period = 1.0 / float(np.hypot(wave[0], wave[1]))
    cell = max(1, int(period / _CELLS))
    step = _growth(wave)
    shape = -(-plane.shape[0] // cell), -(-plane.shape[1] // cell)
    if strength(plane, wave) < _FAINT:
        return Followed(step, cell, np.zeros(shape, np.int16))
    beats = np.zeros((2, *shape), np.int64)
    add_beats(plane, step, cell, _COSINES, beats)
    low = _smoothed(beats.astype(np.float64), period / cell)
    nodes = np.rint(np.angle(low) * (TURN / (2 * np.pi))).astype(np.int64).astype(np.int16)
    return Followed(step, cell, nodes)


def strength(plane: Plane, wave: FloatArray) -> float:
    """Return how much of a wave, in cycles per pixel, a plane contains: its share of the root mean square."""
    beats = np.zeros((2, 1, 1), np.int64)
    add_beats(plane, _growth(wave), max(plane.shape), _COSINES, beats)
    square = float(plane.size) * float((plane * plane).sum())
    size = math.sqrt(float(beats[0, 0, 0]) ** 2 + float(beats[1, 0, 0]) ** 2)
    return size / (2**14 * math.sqrt(square)) if square > 0 else 0.0


def _growth(wave: FloatArray) -> tuple[int, int]:
    return round(float(wave[0]) * _FINE), round(float(wave[1]) * _FINE)


def pixel_phases(followed: Followed, by: int, shape: tuple[int, int]) -> NDArray[np.int16]:
    """Return the phase of a followed wave at the pixels of a sample: (H, W) int16, in 2^-16 of a turn.

    Parameters
    ----------
    followed
        A wave on a reduced plane of the sample.
    by
        The side in the sample, in pixels, of one pixel of the plane.
    shape
        The sample's (height, width).
    """
    out = np.empty(shape, np.int16)
    # The middle of the reduced plane's first pixel is (by − 1)/2 of the sample's pixels farther on.
    step = round(followed.step[0] / by), round(followed.step[1] / by)
    start = -sum(step) * (by - 1) // 2
    nodes = (followed.nodes + (start >> 16)).astype(np.int16)
    interpolate_phases(nodes, followed.cell * by, step, out)
    return out


def _smoothed(nodes: FloatArray, sigma: float) -> NDArray[np.complex128]:
    # Means of real and imaginary parts over the nodes inside, weighted by a Gaussian.
    reach = int(_REACH * sigma + 1)
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    out = np.zeros_like(nodes)
    smooth_nodes(nodes, taps, np.zeros_like(nodes), out)
    sums = np.concatenate([[0.0], np.cumsum(taps)])
    weights = []
    for count in nodes.shape[1:]:
        at = np.arange(count)
        weights.append(
            sums[np.minimum(reach, count - 1 - at) + reach + 1] - sums[reach - np.minimum(reach, at)]
        )
    mean: NDArray[np.complex128] = (out[0] + 1j * out[1]) / (weights[0][:, None] * weights[1])
    return mean
