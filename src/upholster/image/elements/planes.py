"""The planes of a sample in which structure is sought: its brightness, and the directions of its edges."""

import math

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray

__all__ = ["Plane", "balanced", "planes", "reduced"]

Plane = NDArray[np.int64]
"""(H, W): one whole number per pixel, of mean 0."""

_MOST = 65535
"""Floats are scaled to 0 up to this value."""

_UNIT = 4096
"""Value of an edge of infinite strength."""

_USUAL = 3
"""An edge this many times as strong as usual counts half of that."""


_LOUD = 256
"""Root mean square of planes that are correlated."""

_EDGE = 0.5
"""Weight of each plane of edges; that of the colours together is 1."""


def reduced(exemplar: PixelArray, by: int) -> NDArray[np.int64]:
    """Return sums of `by` × `by` pixels of a sample, in whole numbers: (H // by, W // by, C) int64.

    Floats are scaled from their smallest to their largest value.
    """
    low, scale = 0.0, 1.0
    if exemplar.dtype.kind == "f":
        low, high = float(exemplar.min()), float(exemplar.max())
        scale = _MOST / (high - low) if high > low else 0.0
    height, width = exemplar.shape[0] // by, exemplar.shape[1] // by
    total = np.zeros((height, width, exemplar.shape[2]), np.int64)
    for i in range(by):
        for j in range(by):
            part = exemplar[i : by * height : by, j : by * width : by]
            if exemplar.dtype.kind == "f":
                part = np.rint((part.astype(np.float64) - low) * scale).astype(np.int64)
            total += part
    return total


def planes(colors: NDArray[np.int64]) -> list[Plane]:
    """Return brightness, and three planes of edges: their strength, and it times cosine and sine of 2·angle.

    A pattern's elements may differ in colour, which hides a wave of brightness; their edges are alike.
    Elements that are horizontal and vertical in turn, as in a herringbone, differ in the angle of their
    edges alone. Strong edges count little more than those of usual strength.

    Parameters
    ----------
    colors
        (H, W, C).
    """
    down, right = np.zeros_like(colors), np.zeros_like(colors)
    down[1:-1] = colors[2:] - colors[:-2]
    right[:, 1:-1] = colors[:, 2:] - colors[:, :-2]
    upright = (down * down - right * right).sum(axis=2)
    slanted = 2 * (down * right).sum(axis=2)
    square = (down * down + right * right).sum(axis=2)
    strength = np.sqrt(square.astype(np.float64))
    usual = max(1, int(np.rint(strength).sum()) // strength.size)
    # From 0 to 1, ¼ at the usual strength; divided by the square for the angles.
    scaled = _UNIT * strength / (strength + _USUAL * usual)
    share = scaled / np.maximum(square, 1)
    edges = (np.rint(part).astype(np.int64) for part in (upright * share, slanted * share, scaled))
    # In stacked maps the colours come first; the green of a normal map does not count.
    brightness = colors[:, :, :3].sum(axis=2)
    return [plane - int(plane.sum()) // plane.size for plane in (brightness, *edges)]


def balanced(colors: NDArray[np.int64]) -> list[Plane]:
    """Return planes for the autocorrelation: colours together weigh as much as the three planes of edges.

    They are slightly smoothed, so that a shift by half a pixel is as good as one by a whole pixel.
    """
    tones = [_smooth(colors[:, :, k]) for k in range(min(3, colors.shape[2]))]
    return _scaled(tones, 1.0) + [
        part for plane in planes(colors)[1:] for part in _scaled([_smooth(plane)], _EDGE)
    ]


def _smooth(plane: Plane) -> Plane:
    for _ in range(2):
        padded = np.pad(plane, ((1, 1), (0, 0)), mode="edge")
        plane = (padded[:-2] + 2 * padded[1:-1] + padded[2:]).T
    return plane


def _scaled(parts: list[Plane], weight: float) -> list[Plane]:
    # Without their means, and with a variance of `weight` in all, in units of _LOUD². Planes that are equal
    # everywhere are left out.
    parts = [part - int(part.sum()) // part.size for part in parts]
    largest = max(int(np.abs(part).max()) for part in parts)
    if largest == 0:
        return []
    parts = [part * 2**15 // largest for part in parts]
    variance = sum(int((part * part).sum()) for part in parts) / parts[0].size
    if variance == 0:
        return []
    scale = _LOUD * math.sqrt(weight / variance)
    parts = [np.rint(part * scale).astype(np.int64) for part in parts]
    return [part for part in parts if part.any()]
