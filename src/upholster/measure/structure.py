"""Whether a result repeats at the distances its exemplar does: autocorrelation peaks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from upholster.elements.autocorrelation import RADIUS, correlation_peaks, shifted_products
from upholster.measure.fidelity import WINDOW, check_alike, looked_at
from upholster.measure.samples import coded
from upholster.types import FloatArray, PixelArray

__all__ = ["Peak", "Structure", "structure"]

MOST_PEAKS = 4
LEAST_HEIGHT = 0.05


@dataclass(frozen=True, slots=True)
class Peak:
    """A distance at which a texture repeats.

    Attributes
    ----------
    row, column
        The shift in pixels: row > 0, or row = 0 and column > 0 (the opposite shift is the same).
    height
        Correlation of the texture with itself at this shift, up to 1.
    """

    row: int
    column: int
    height: float


@dataclass(frozen=True, slots=True)
class Structure:
    """The strongest peaks of the autocorrelation, and how much of the exemplar's is kept.

    Attributes
    ----------
    exemplar, result
        Up to four peaks each, highest first; none if nothing repeats.
    kept
        For each of the exemplar's peaks, the highest correlation of the result within 3 pixels of it.
    loss
        Mean over the exemplar's peaks of their height minus the kept height: 0 is equal, negative if the
        result repeats more strongly. None if the exemplar has no peak.
    """

    exemplar: tuple[Peak, ...]
    result: tuple[Peak, ...]
    kept: tuple[float, ...]
    loss: float | None


def structure(results: Sequence[PixelArray], exemplar: PixelArray) -> Structure:
    """Compare the shifts at which result and exemplar repeat.

    Both are reduced to one channel, the exemplar's first principal component of sRGB-coded colour. The
    autocorrelation at shift d is the mean of x(p)·x(p + d) over all places where both exist; x has mean 0 and
    variance 1, and shifts go up to half the exemplar's sides, 256 at most. A peak is the highest value within
    3 pixels, at least 0.05, other than the centre. At most 2 Mtexels of each are examined, in windows of at
    most 512².

    Parameters
    ----------
    results
        One or more (h, w, C) arrays: a flat result, or a model's charts.
    exemplar
        (H, W, C), of the same number of channels.

    Returns
    -------
    Structure
        Peaks of both, and their difference.

    Raises
    ------
    InputError
        If numbers of channels differ or an array is smaller than 7 pixels each way.

    References
    ----------
    Lin, Hays, Wu, Liu, Kwatra: Quantitative evaluation of near regular texture synthesis algorithms, CVPR
    2006, on judging regularity by the lattice of a texture.
    """
    check_alike(results, exemplar)
    samples, sample = looked_at(results), looked_at([exemplar])
    rows, columns = (
        min(exemplar.shape[side] // 2, WINDOW // 2, max(part.shape[side] for part in samples) - 1)
        for side in (0, 1)
    )
    axis = _main_color(sample)
    theirs = _autocorrelation([coded(part) @ axis for part in sample], (rows, columns))
    ours = _autocorrelation([coded(part) @ axis for part in samples], (rows, columns))
    peaks, found = _peaks(theirs), _peaks(ours)
    kept = tuple(_highest_near(ours, peak) for peak in peaks)
    lost = [peak.height - height for peak, height in zip(peaks, kept, strict=True)]
    return Structure(peaks, found, kept, float(np.mean(lost)) if lost else None)


def _main_color(parts: Sequence[PixelArray]) -> FloatArray:
    """Return the direction in which colours vary most: (C,), of length 1."""
    colors = np.concatenate([coded(part).reshape(-1, part.shape[2]) for part in parts]).astype(np.float64)
    colors -= colors.mean(axis=0)
    axis: FloatArray = np.linalg.eigh(colors.T @ colors)[1][:, -1]
    return axis


def _autocorrelation(planes: Sequence[FloatArray], half: tuple[int, int]) -> FloatArray:
    """Return the correlation at shifts of 0…half rows and −half…half columns: (half + 1, 2·half + 1)."""
    count = sum(plane.size for plane in planes)
    mean = sum(float(plane.sum()) for plane in planes) / count
    variance = sum(float(((plane - mean) ** 2).sum()) for plane in planes) / count
    if variance < 1e-12:  # constant, so nothing repeats
        return np.zeros((half[0] + 1, 2 * half[1] + 1))
    total, pairs = np.zeros((half[0] + 1, 2 * half[1] + 1)), np.zeros((half[0] + 1, 2 * half[1] + 1))
    rows, columns = np.arange(half[0] + 1)[:, None], np.arange(-half[1], half[1] + 1)
    for plane in planes:
        height, width = plane.shape
        total += shifted_products(plane - mean, half)
        pairs += np.maximum(height - rows, 0) * np.maximum(width - np.abs(columns), 0)
    correlation: FloatArray = np.where(pairs > 0, total / np.maximum(pairs, 1) / variance, 0)
    return correlation


def _peaks(correlation: FloatArray) -> tuple[Peak, ...]:
    rows, columns = correlation_peaks(correlation, LEAST_HEIGHT)
    heights = correlation[rows, correlation.shape[1] // 2 + columns]
    order = np.argsort(-heights, kind="stable")[:MOST_PEAKS]
    return tuple(Peak(int(rows[n]), int(columns[n]), float(heights[n])) for n in order)


def _highest_near(correlation: FloatArray, peak: Peak) -> float:
    middle = correlation.shape[1] // 2
    rows = slice(max(0, peak.row - RADIUS), peak.row + RADIUS + 1)
    columns = slice(max(0, middle + peak.column - RADIUS), middle + peak.column + RADIUS + 1)
    return float(correlation[rows, columns].max())
