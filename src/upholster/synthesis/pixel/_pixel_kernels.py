"""Choosing the pixel of the exemplar whose neighbourhood fits a texel's best.

Samples are whole numbers of 8 bits in float32, so that sums of squares are exact in any order.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import int64
from upholster.runtime.jit import inline, kernel

__all__ = [
    "PARENT_REACH",
    "REACH",
    "ChosenTexels",
    "Neighbourhood",
    "PixelLevel",
    "choose_pixels",
    "similar_pixels",
]

REACH = 2
"""A neighbourhood is 5×5 texels without its middle: this many each way."""

PARENT_REACH = 1
"""On the next coarser level it is 3×3."""

_AT_ONCE = 16
"""Number of terms that are added before a candidate may be abandoned."""


class PixelLevel(NamedTuple):
    """The exemplar on one level of the pyramid, its pixels numbered row by row.

    `planes` (flat) has the samples of LL, channel after channel, then those of the next coarser level, each
    four times, so that both have one size; at the coarsest level LL alone. `inside` (pixels) is 1 where a
    complete neighbourhood is inside the exemplar: a candidate. `similar` (pixels, k): candidates that look
    alike.
    """

    planes: NDArray[np.float32]
    inside: NDArray[np.uint8]
    similar: NDArray[np.int32]
    height: int
    width: int
    channels: int


class ChosenTexels(NamedTuple):
    """The texels of a chart that are to be chosen, and its layout in the arrays of its level.

    Texel (r, c) is `first + r·stride + c`; its parent likewise. Rows run from `row` up to but excluding
    `end`, columns from `column`, both in steps of `step`. `width` is the chart's; `lone` is the pixel for a
    texel without any known neighbour.
    """

    first: int
    stride: int
    parent_first: int
    parent_stride: int
    row: int
    end: int
    column: int
    width: int
    step: int
    lone: int


class Neighbourhood(NamedTuple):
    """Scratch: the terms by which candidates are compared, and the candidates already tried.

    A candidate p is compared with `values[f]` at `planes[p + offsets[f]]`.
    """

    offsets: NDArray[np.int64]
    values: NDArray[np.float32]
    tried: NDArray[np.int64]
    costs: NDArray[np.float32]


@inline
def _add(level: PixelLevel, known: Neighbourhood, count: int, plane: int, step: int, pixel: int) -> int:
    # Adds one neighbour: all its channels.
    area = level.height * level.width
    for k in range(plane, plane + level.channels):
        known.offsets[count] = k * area + step
        known.values[count] = level.planes[k * area + pixel]
        count += 1
    return count


@inline
def _gather(
    sources: NDArray[np.int32],
    parents: NDArray[np.int32],
    at: int,
    parent_at: int,
    chart: ChosenTexels,
    level: PixelLevel,
    known: Neighbourhood,
) -> Any:
    # Collects the known neighbours of texel `at`, the nearest first; returns the number of terms.
    count: Any = 0
    for ring in range(1, REACH + 1):
        for i in range(-ring, ring + 1):
            for j in range(-ring, ring + 1):
                if max(abs(i), abs(j)) == ring:
                    pixel = sources[at + i * chart.stride + j]
                    if pixel >= 0:
                        count = _add(level, known, count, 0, i * level.width + j, pixel)
    if parents.shape[0] > 0:
        for i in range(-PARENT_REACH, PARENT_REACH + 1):
            for j in range(-PARENT_REACH, PARENT_REACH + 1):
                pixel = parents[parent_at + i * chart.parent_stride + j]
                if pixel >= 0:
                    step = 2 * (i * level.width + j)
                    count = _add(level, known, count, level.channels, step, pixel)
    return count


@inline
def _cost(level: PixelLevel, known: Neighbourhood, count: int, pixel: int, least: Any) -> Any:
    # The sum of squared differences, or any value of at least `least`.
    total = np.float32(0)
    for start in range(0, count, _AT_ONCE):
        for f in range(start, min(start + _AT_ONCE, count)):
            difference = level.planes[pixel + known.offsets[f]] - known.values[f]
            total += difference * difference
        if total >= least:
            break
    return total


@inline
def _is_new(known: Neighbourhood, count: int, pixel: int) -> bool:
    for n in range(count):
        if known.tried[n] == pixel:
            return False
    known.tried[count] = pixel
    return True


@inline
def _best_coherent(
    sources: NDArray[np.int32], at: int, stride: int, level: PixelLevel, known: Neighbourhood, count: int
) -> tuple[Any, Any]:
    # Tries the pixels that continue a neighbour's source, the texel's own, and those that look like them.
    best, least, tried = int64(-1), np.float32(np.inf), int64(0)
    for place in range(9):
        i, j = (place + 4) % 9 // 3 - 1, (place + 4) % 3 - 1  # its own first
        source = sources[at + i * stride + j]
        pixel = int64(source) - i * level.width - j
        if source < 0 or level.inside[pixel] == 0:
            continue
        for k in range(-1, level.similar.shape[1]):
            other = pixel if k < 0 else int64(level.similar[pixel, k])
            if other >= 0 and _is_new(known, tried, other):
                tried += 1
                cost = _cost(level, known, count, other, least)
                if cost < least:
                    best, least = other, cost
    return best, least


@inline
def _best_of_all(level: PixelLevel, known: Neighbourhood, count: int, best: Any, least: Any) -> Any:
    # Tries every candidate, a row at a time; the lowest number among equals, unless `best` is as good.
    planes, offsets, values = level.planes, known.offsets, known.values
    part = known.costs[: level.width - 2 * REACH]
    for row in range(REACH, level.height - REACH):
        base = row * level.width + REACH
        for n in range(part.shape[0]):
            part[n] = 0
        f = 0
        while f + 4 <= count:  # four terms per pass: a quarter of the loads and stores of the sums
            a, b = planes[base + offsets[f] :], planes[base + offsets[f + 1] :]
            c, d = planes[base + offsets[f + 2] :], planes[base + offsets[f + 3] :]
            va, vb, vc, vd = values[f], values[f + 1], values[f + 2], values[f + 3]
            for n in range(part.shape[0]):
                p, q, r, s = a[n] - va, b[n] - vb, c[n] - vc, d[n] - vd
                part[n] += (p * p + q * q) + (r * r + s * s)
            f += 4
        while f < count:
            a, va = planes[base + offsets[f] :], values[f]
            for n in range(part.shape[0]):
                p = a[n] - va
                part[n] += p * p
            f += 1
        for n in range(part.shape[0]):
            if part[n] < least:
                best, least = int64(base + n), part[n]
    return best


@kernel
def choose_pixels(
    sources: NDArray[np.int32],
    parents: NDArray[np.int32],
    chart: ChosenTexels,
    level: PixelLevel,
    known: Neighbourhood,
    full: bool,
) -> None:
    """Choose the pixels of some texels of a chart, one after another, and write them to `sources`.

    `sources` and `parents` hold the pixels of all texels of this level and, in pixels of this level, of the
    next coarser one (empty at the coarsest); −1 means unknown. A texel's candidates are the pixels that
    continue its neighbours' and its own, those that look like them, and, if `full`, all. The candidate whose
    known neighbours differ least is taken.
    """
    for row in range(chart.row, chart.end, chart.step):
        for column in range(chart.column, chart.width, chart.step):
            at = chart.first + row * chart.stride + column
            parent_at = chart.parent_first + row // 2 * chart.parent_stride + column // 2
            count = _gather(sources, parents, at, parent_at, chart, level, known)
            if count == 0:
                if sources[at] < 0:
                    sources[at] = chart.lone
                continue
            best, least = _best_coherent(sources, at, chart.stride, level, known, count)
            if full:
                best = _best_of_all(level, known, count, best, least)
            if best >= 0:
                sources[at] = best


@inline
def _keep_similar(level: PixelLevel, known: Neighbourhood, count: int, pixel: int, other: int) -> None:
    # Keeps another candidate if it is among the most similar so far, which are sorted by cost.
    similar, costs = level.similar[pixel], known.costs
    last = similar.shape[0] - 1
    if level.inside[other] == 0 or other == pixel:
        return
    cost = _cost(level, known, count, other, costs[last])
    if cost >= costs[last]:
        return
    n = last
    while n > 0 and costs[n - 1] > cost:
        costs[n], similar[n] = costs[n - 1], similar[n - 1]
        n -= 1
    costs[n], similar[n] = cost, other


@kernel
def similar_pixels(
    pixels: NDArray[np.int32],
    parents: NDArray[np.int32],
    among: NDArray[np.int32],
    chart: ChosenTexels,
    level: PixelLevel,
    known: Neighbourhood,
) -> None:
    """Fill `level.similar` for some rows of the exemplar, which is treated as a chart that shows itself.

    `pixels` and `parents` are its sources, as in `choose_pixels`. A pixel is compared with the children of
    its parent's row in `among` (parents, n), pixels of this level, −1 for none; with all pixels if `among` is
    empty. Candidates that look alike are in order, followed by −1.
    """
    for row in range(chart.row, chart.end):
        for column in range(chart.column, chart.width):
            pixel = row * chart.stride + column
            parent = row // 2 * chart.parent_stride + column // 2
            count = _gather(pixels, parents, pixel, parent, chart, level, known)
            for k in range(level.similar.shape[1]):
                level.similar[pixel, k] = -1
                known.costs[k] = np.inf
            if among.shape[0] == 0:
                for other in range(level.inside.shape[0]):
                    _keep_similar(level, known, count, pixel, other)
                continue
            for n in range(among.shape[1]):
                first = int64(among[parent, n])
                if first >= 0:
                    for child in range(4):
                        other = first + child // 2 * level.width + child % 2
                        _keep_similar(level, known, count, pixel, other)
