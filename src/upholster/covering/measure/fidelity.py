"""Whether a result looks like its exemplar close up, by the distributions of small patches."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import PixelArray
from upholster.covering.measure.samples import SEED, chosen_windows, coded

__all__ = ["check_alike", "sliced_wasserstein"]

SIDE = 7
"""Side of a patch of pixels."""

LEVELS = 4
DIRECTIONS = 128
MOST_PATCHES = 2**14
MOST_TEXELS = 2**21
_WINDOW = 512

Image = NDArray[np.float32]


def sliced_wasserstein(results: Sequence[PixelArray], exemplar: PixelArray) -> tuple[float, ...]:
    """Measure how far apart the distributions of 7×7 patches are, at four scales.

    Both are split into a Laplacian pyramid of four levels (the last is the low-pass remainder) of sRGB-coded
    values from 0 to 1, all channels alike. On each level, all 7×7 patches, or 16,384 drawn at random, are
    projected on 128 fixed random directions of unit length, and the 1-Wasserstein distances of the
    projections are averaged. Colours are not normalised, so shifts of brightness count. At most 2 Mtexels of
    each are examined. Levels on which either has less than 7 pixels are left out.

    Parameters
    ----------
    results
        One or more (h, w, C) arrays: a flat result, or a model's charts.
    exemplar
        (H, W, C), of the same number of channels.

    Returns
    -------
    tuple of float
        The distance on each level, finest first, in the samples' unit: 0 is equal, a few thousandths are
        within the noise of two samples of one texture. Their mean is the usual single figure.

    Raises
    ------
    InputError
        If numbers of channels differ or an array is smaller than 7 pixels each way.

    References
    ----------
    Rabin, Peyré, Delon, Bernot: Wasserstein barycenter and its application to texture mixing, SSVM 2011, on
    sliced distances; Karras, Aila, Laine, Lehtinen: Progressive growing of GANs, ICLR 2018, section 5, on
    7×7 patches of a Laplacian pyramid.
    """
    check_alike(results, exemplar)
    sides = [_looked_at(results), _looked_at([exemplar])]
    # If charts differ in size, the largest decides how many levels there are.
    largest = min(max(min(part.shape[:2]) for part in parts) for parts in sides)
    levels = next(n for n in range(LEVELS, 0, -1) if -(-largest // 2 ** (n - 1)) >= SIDE)
    ours, theirs = (_levels(parts, levels) for parts in sides)
    rng = np.random.default_rng(SEED)
    directions = rng.standard_normal((SIDE * SIDE * exemplar.shape[2], DIRECTIONS), dtype=np.float32)
    directions /= np.linalg.norm(directions, axis=0)
    return tuple(
        _distance(_projected(mine, directions), _projected(other, directions))
        for mine, other in zip(ours, theirs, strict=True)
    )


def check_alike(results: Sequence[PixelArray], exemplar: PixelArray) -> None:
    """Raise InputError unless there are results with the exemplar's channels, all at least 7×7 pixels."""
    if not results:
        raise InputError("there are no results to measure; allowed: at least one array")
    for name, array in [("sample", exemplar), *((f"result {n}", array) for n, array in enumerate(results))]:
        if array.ndim != 3 or min(array.shape[:2]) < SIDE:
            raise InputError(f"{name} has shape {array.shape}; allowed: (h, w, C) from {SIDE}×{SIDE}")
        if array.shape[2] != exemplar.shape[2]:
            raise InputError(
                f"{name} has {array.shape[2]} channels, the sample {exemplar.shape[2]}; allowed: as many"
            )


def _looked_at(arrays: Sequence[PixelArray]) -> list[PixelArray]:
    """Return views of the parts that fidelity is measured on: up to 2 Mtexels, in windows of at most 512²."""
    windows = chosen_windows([array.shape for array in arrays], side=_WINDOW, most=MOST_TEXELS)
    return [window.of(arrays[window.index]) for window in windows]


def _levels(parts: Sequence[PixelArray], count: int) -> list[list[Image]]:
    """Return the pyramids of all parts, level by level, without levels smaller than a patch."""
    levels: list[list[Image]] = [[] for _ in range(count)]
    for part in parts:
        for level, image in enumerate(_pyramid(coded(part), count)):
            if min(image.shape[:2]) >= SIDE:
                levels[level].append(image)
    return levels


def _pyramid(image: Image, levels: int) -> list[Image]:
    """Return the Laplacian pyramid (Burt and Adelson 1983), binomial filters of five taps, edges mirrored."""
    bands = []
    for _ in range(levels - 1):
        coarse = _halved(_halved(image, 0), 1)
        finer = _doubled(_doubled(coarse, 0, image.shape[0]), 1, image.shape[1])
        bands.append(image - finer)
        image = coarse
    return [*bands, image]


def _halved(image: Image, axis: int) -> Image:
    lines = image.swapaxes(0, axis)
    # np.pad is slow along one axis, and only two rows on either side are needed.
    size = len(lines)
    order = np.abs(np.arange(-2, size + 2))
    order = np.where(order >= size, 2 * size - 2 - order, order)
    padded = lines[order]
    even = [padded[k : k + size : 2] for k in range(5)]
    half = (even[0] + even[4] + 4 * (even[1] + even[3]) + 6 * even[2]) * np.float32(1 / 16)
    return half.swapaxes(0, axis)


def _doubled(image: Image, axis: int, size: int) -> Image:
    lines = image.swapaxes(0, axis)
    padded = np.concatenate([lines[:1], lines, lines[-1:]])
    out = np.empty((2 * len(lines), *lines.shape[1:]), np.float32)
    out[0::2] = (padded[:-2] + 6 * padded[1:-1] + padded[2:]) * np.float32(1 / 8)
    out[1::2] = (padded[1:-1] + padded[2:]) * np.float32(1 / 2)
    return out[:size].swapaxes(0, axis)


def _projected(images: Sequence[Image], directions: Image) -> Image:
    """Return patches of some images, or a random part of them, on each direction: sorted, (D, patches)."""
    views = [np.lib.stride_tricks.sliding_window_view(image, (SIDE, SIDE), axis=(0, 1)) for image in images]
    counts = [view.shape[0] * view.shape[1] for view in views]
    ends = np.cumsum(counts)
    total = int(ends[-1])
    wanted = np.arange(total)
    if total > MOST_PATCHES:
        wanted = np.sort(np.random.default_rng(SEED).integers(0, total, MOST_PATCHES))
    cuts = np.searchsorted(wanted, ends)
    patches, start, before = [], 0, 0
    for view, cut, end in zip(views, cuts.tolist(), ends.tolist(), strict=True):
        rows, columns = np.divmod(wanted[start:cut] - before, view.shape[1])
        patches.append(view[rows, columns].reshape(cut - start, math.prod(view.shape[2:])))
        start, before = cut, end
    return np.sort((np.concatenate(patches) @ directions).T, axis=1)


def _distance(one: Image, other: Image) -> float:
    """Return the mean 1-Wasserstein distance of the rows, each the sorted samples of one distribution."""
    count = max(one.shape[1], other.shape[1])
    middles = (np.arange(count) + 0.5) / count
    a, b = (side[:, (middles * side.shape[1]).astype(np.int64)] for side in (one, other))
    return float(np.abs(a - b).mean(dtype=np.float64))
