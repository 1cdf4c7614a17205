"""Painting a window of a chart, exactly: the arithmetic every decoder repeats (SPEC.md, section 8)."""

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.extending import overload
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.quilt._field_kernels import node_row, reading
from upholster.types import PixelArray

__all__ = ["Layer", "Levels", "Places", "Readings", "paint_window"]


class Places(NamedTuple):
    """Where the rows (or columns) of a window lie: (n,) each, in 1/16 step, and of a layer's cells the first
    of the two round it and how far it is from its centre to the next one's, in 1/16.
    """

    at: NDArray[np.int64]
    cell: NDArray[np.int64]
    part: NDArray[np.int64]


class Layer(NamedTuple):
    """A layer's labels, and the rows and columns of a window on it."""

    labels: NDArray[np.int32]
    rows: Places
    columns: Places


class Readings(NamedTuple):
    """Placements of a chart: (n, 2) centres and sources, (n, 4) centre matrices and symmetries, (n,) levels."""

    centres: NDArray[np.int64]
    sources: NDArray[np.int64]
    matrices: NDArray[np.int64]
    symmetries: NDArray[np.int64]
    levels: NDArray[np.int64]


class Levels(NamedTuple):
    """A pyramid's samples, pixel by pixel, and (n, 4) of each level its first sample, height, width, number."""

    samples: PixelArray
    table: NDArray[np.int64]


def _bilinear(samples: Any, at: Any, shares: Any) -> Any:
    """Return four samples' sum, weighted in 1/256: of integers 256 times their mean."""
    raise NotImplementedError  # compiled only


def _share(value: Any, weight: Any) -> Any:
    """Return what `_bilinear` gave, weighted in 1/256: of integers 256 times that."""
    raise NotImplementedError  # compiled only


def _settled(total: Any, below: Any, rest: Any) -> Any:
    """Return a sample: `total` of all weights, and what lies below with the `rest` of them; rounded once."""
    raise NotImplementedError  # compiled only


@overload(_bilinear, strict=False)
def _bilinear_overload(samples: Any, at: Any, shares: Any) -> Any:
    if isinstance(samples.dtype, types.Integer):
        return lambda samples, at, shares: (
            np.int64(samples[at[0]]) * shares[0]
            + np.int64(samples[at[1]]) * shares[1]
            + np.int64(samples[at[2]]) * shares[2]
            + np.int64(samples[at[3]]) * shares[3]
        )

    def floats(samples: Any, at: Any, shares: Any) -> Any:
        unit = np.float32(1 / 256)
        return (
            samples[at[0]] * (np.float32(shares[0]) * unit)
            + samples[at[1]] * (np.float32(shares[1]) * unit)
            + samples[at[2]] * (np.float32(shares[2]) * unit)
            + samples[at[3]] * (np.float32(shares[3]) * unit)
        )

    return floats


@overload(_share, strict=False)
def _share_overload(value: Any, weight: Any) -> Any:
    if isinstance(value, types.Integer):
        return lambda value, weight: value * weight
    return lambda value, weight: value * (np.float32(weight) * np.float32(1 / 256))


@overload(_settled, strict=False)
def _settled_overload(total: Any, below: Any, rest: Any) -> Any:
    if isinstance(total, types.Integer):
        return lambda total, below, rest: (np.int64(below) * (rest * 256) + total + 32768) >> 16
    return lambda total, below, rest: below * (np.float32(rest) * np.float32(1 / 256)) + total


@inline
def _mirrored(place: Any, size: Any) -> Any:
    if 0 <= place < size:
        return place
    place %= 2 * size
    return place if place < size else 2 * size - 1 - place


@inline
def _add(
    total: PixelArray,
    one: Any,
    readings: Readings,
    levels: Levels,
    place: tuple[Any, Any],
    here: Any,
    weight: Any,
) -> None:
    # Adds what a placement reads at a place to `total`, one number a channel.
    first = (
        readings.matrices[one, 0],
        readings.matrices[one, 1],
        readings.matrices[one, 2],
        readings.matrices[one, 3],
    )
    down = min(max(place[0] - readings.centres[one, 0], -16383), 16383)
    right = min(max(place[1] - readings.centres[one, 1], -16383), 16383)
    y, x = reading(first, here, down, right)
    turn = readings.symmetries[one]
    base, height, width, k = levels.table[readings.levels[one]]
    r = ((readings.sources[one, 0] + turn[0] * y + turn[1] * x + 8) >> k) - 8
    c = ((readings.sources[one, 1] + turn[2] * y + turn[3] * x + 8) >> k) - 8
    y, x = r & 15, c & 15
    both, channels = y * x, total.shape[0]
    shares = (256 - 16 * (y + x) + both, 16 * x - both, 16 * y - both, both)
    r, c = r >> 4, c >> 4
    top, bottom = base + _mirrored(r, height) * width * channels, base + _mirrored(r + 1, height) * width * channels
    left, beside = _mirrored(c, width) * channels, _mirrored(c + 1, width) * channels
    for channel in range(channels):
        at = (top + left + channel, top + beside + channel, bottom + left + channel, bottom + beside + channel)
        total[channel] += _share(_bilinear(levels.samples, at, shares), weight)


@inline
def _mix(
    total: PixelArray, layer: Layer, t: Any, u: Any, readings: Readings, levels: Levels, here: Any
) -> Any:
    # Sums what the four cells round a texel show, and returns the weight of those that show anything.
    i, j = layer.rows.cell[t], layer.columns.cell[u]
    f, g = layer.rows.part[t], layer.columns.part[u]
    place = (layer.rows.at[t], layer.columns.at[u])
    labels = layer.labels
    named = (labels[i, j], labels[i, j + 1], labels[i + 1, j], labels[i + 1, j + 1])
    for channel in range(total.shape[0]):
        total[channel] = 0
    if named[0] == named[1] and named[0] == named[2] and named[0] == named[3]:
        if named[0] < 0:
            return 0
        _add(total, named[0], readings, levels, place, here, 256)
        return 256
    shares = ((16 - f) * (16 - g), (16 - f) * g, f * (16 - g), f * g)
    shown = 0
    for k in range(4):
        seen = named[k] < 0
        for before in range(k):
            seen = seen or named[before] == named[k]
        if seen:
            continue
        weight = shares[k]
        for behind in range(k + 1, 4):
            if named[behind] == named[k]:
                weight += shares[behind]
        if weight:
            shown += weight
            _add(total, named[k], readings, levels, place, here, weight)
    return shown


@kernel
def paint_window(
    first: Layer,
    second: Layer,
    readings: Readings,
    matrices: NDArray[np.int32],
    margin: int,
    levels: Levels,
    line: NDArray[np.int64],
    total: PixelArray,
    out: PixelArray,
) -> None:
    """Paint a window of a chart into `out`, (rows, columns, channels).

    `second` has no labels where there is one layer. `matrices` and `margin` are the warp field's; `line`
    (columns of nodes, 4) and `total` (channels, int64 or float32) are scratch.
    """
    nodes = matrices.shape[1]
    for t in range(out.shape[0]):
        i, below, down = node_row(matrices, margin, first.rows.at[t])
        for j in range(nodes):
            for k in range(4):
                line[j, k] = (matrices[i, j, k] * (512 - down) + matrices[below, j, k] * down + 256) >> 9
        for u in range(out.shape[1]):
            x = first.columns.at[u] - 8
            j, right = margin + (x >> 9), x & 511
            if j < 0:
                j, right = np.int64(0), np.int64(0)
            elif j >= nodes - 1:
                j, right = np.int64(nodes - 1), np.int64(0)
            beside, left = min(j + 1, nodes - 1), 512 - right
            here = (
                (line[j, 0] * left + line[beside, 0] * right + 256) >> 9,
                (line[j, 1] * left + line[beside, 1] * right + 256) >> 9,
                (line[j, 2] * left + line[beside, 2] * right + 256) >> 9,
                (line[j, 3] * left + line[beside, 3] * right + 256) >> 9,
            )
            _mix(total, first, t, u, readings, levels, here)
            texel = out[t, u]
            for channel in range(texel.shape[0]):
                texel[channel] = 0
                texel[channel] = _settled(total[channel], texel[channel], 0)
            if second.labels.shape[0]:
                shown = _mix(total, second, t, u, readings, levels, here)
                if shown:
                    for channel in range(texel.shape[0]):
                        texel[channel] = _settled(total[channel], texel[channel], 256 - shown)
