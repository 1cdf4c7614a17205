"""The tone of a chart's cells: it evens out broad differences across cuts (SPEC.md, section 8).

Painting in two bands (P. Burt, E. Adelson, *A multiresolution spline with application to image mosaics*, ACM
Transactions on Graphics 2(4), 1983): details change from one placement to the next within a cell, and broad
shades over several cells. A cell's *tone* is the mean of the broad shades of all placements around it, less
that of its own placement. Painting adds it. It is 0 wherever no cut is near.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray
from upholster.quilt._field_kernels import matrix_between, reading
from upholster.quilt._reading_kernels import PyramidWords, Readings, bilinear, pixels_at
from upholster.runtime.jit import by_type, inline, is_float, kernel, shared

__all__ = ["HALVINGS", "MOST_OTHERS", "REACH", "Nodes", "Scratch", "cell_tones", "tone_at"]

REACH = 7
"""How many cells away, each way, a placement counts."""

MOST_OTHERS = 8
"""How many other placements count around a cell: the first ones, row after row."""

HALVINGS = 3
"""Broad shades are read from a level that is halved this many times more than that of details."""

_WIDTH = REACH + 1  # weights along a row or column are 1, 2 … 8 … 2, 1: 64 together
_BEFORE = np.cumsum([0, *range(1, _WIDTH), *range(_WIDTH, 0, -1)])  # the sum of the first ones


class Nodes(NamedTuple):
    """A warp field's nodes and margin, and the centres of rows and columns of cells in 1/16 step."""

    matrices: NDArray[np.int32]
    margin: int
    rows: NDArray[np.int64]
    columns: NDArray[np.int64]


class Scratch(NamedTuple):
    """Scratch space: see `cell_tones`."""

    runs: NDArray[np.int32]
    found: NDArray[np.int32]
    shades: PixelArray


def _shade(words: Any, at: Any, n: Any, y: Any, x: Any, bits: Any) -> Any:
    """Return four pixels' n-th channel, weighted by fractions in 1/16; integers as numbers of 16 bits."""
    raise NotImplementedError  # compiled only


def _weighted(difference: Any, weight: Any) -> Any:
    """Return a difference times a whole weight."""
    raise NotImplementedError  # compiled only


def _settled(total: Any, fade: Any) -> Any:
    """Return a cell's tone from a weighted sum of differences, faded in 1/256."""
    raise NotImplementedError  # compiled only


def tone_at(tones: Any, n: Any, f: Any, g: Any, value: Any, bits: Any) -> Any:
    """Return a texel's n-th value with the tone between four cells, (2, 2, channels).

    It is f of 16 down and g of 16 to the right from the first one's centre.
    """
    raise NotImplementedError  # compiled only


@by_type(_shade)
def _shade_overload(words: Any, at: Any, n: Any, y: Any, x: Any, bits: Any) -> Any:
    if is_float(words.dtype):

        def plain(words: Any, at: Any, n: Any, y: Any, x: Any, bits: Any) -> Any:
            return bilinear(words, at, n, y, x)

        return plain

    def lane(words: Any, at: Any, n: Any, y: Any, x: Any, bits: Any) -> Any:
        lanes = 64 // bits
        word = bilinear(words, at, n // lanes, y, x) >> np.uint64(bits * (n % lanes))
        if bits == 16:
            return np.int32(word & np.uint64(0xFFFF))
        return np.int32(((word & np.uint64(0xFFFFFFFF)) + np.uint64(128)) >> np.uint64(8))

    return lane


@by_type(_weighted)
def _weighted_overload(difference: Any, weight: Any) -> Any:
    if is_float(difference):
        return lambda difference, weight: difference * np.float32(weight)
    return lambda difference, weight: difference * weight


@by_type(_settled)
def _settled_overload(total: Any, fade: Any) -> Any:
    if is_float(total):
        return lambda total, fade: total * (np.float32(fade) * np.float32(2.0**-20))
    return lambda total, fade: ((total >> 8) * fade + 2048) >> 12


@by_type(tone_at)
def _tone_at_overload(tones: Any, n: Any, f: Any, g: Any, value: Any, bits: Any) -> Any:
    if not is_float(tones.dtype):

        def add(tones: Any, n: Any, f: Any, g: Any, value: Any, bits: Any) -> Any:
            above = tones[0, 0, n] * (16 - g) + tones[0, 1, n] * g
            below = tones[1, 0, n] * (16 - g) + tones[1, 1, n] * g
            shift, top = (16, 255) if bits == 16 else (8, 65535)
            tone = (above * (16 - f) + below * f + (1 << (shift - 1))) >> shift
            return min(max(np.int64(value) + tone, 0), top)

        return add

    def add_floats(tones: Any, n: Any, f: Any, g: Any, value: Any, bits: Any) -> Any:
        unit = np.float32(1 / 256)
        tone = (
            tones[0, 0, n] * (np.float32((16 - f) * (16 - g)) * unit)
            + tones[0, 1, n] * (np.float32((16 - f) * g) * unit)
            + tones[1, 0, n] * (np.float32(f * (16 - g)) * unit)
            + tones[1, 1, n] * (np.float32(f * g) * unit)
        )
        return value + tone

    return add_floats


@inline
def _around(centre: Any, size: Any) -> tuple[Any, Any, Any]:
    """Return the first and last of the cells around one along an axis, and the sum of their weights."""
    first, last = max(centre - REACH, 0), min(centre + REACH, size - 1)
    return first, last, _BEFORE[last - centre + REACH + 1] - _BEFORE[first - centre + REACH]


@shared
def _others(
    labels: NDArray[np.int32], runs: NDArray[np.int32], i: Any, j: Any, found: NDArray[np.int32]
) -> Any:
    """List the other placements around a cell, and their weights, in `found`; return how many."""
    own, count = labels[i, j], 0
    top, bottom, _ = _around(i, labels.shape[0])
    left, right, _ = _around(j, labels.shape[1])
    for r in range(top, bottom + 1):
        c = left
        while c <= right:
            one, stop = labels[r, c], min(c + runs[r % runs.shape[0], c], right + 1)
            if one != own:
                n = 0
                while n < count and found[n, 0] != one:
                    n += 1
                if n == count and count < MOST_OTHERS:
                    found[n, 0], found[n, 1] = one, 0
                    count += 1
                if n < count:
                    along = _BEFORE[stop - j + REACH] - _BEFORE[c - j + REACH]
                    found[n, 1] += (_WIDTH - abs(r - i)) * along
            c = stop
    return count


@shared
def _read_shades(
    readings: Readings, one: Any, matrix: Any, place: Any, pyramid: PyramidWords, out: PixelArray
) -> None:
    """Read the broad shades, (channels,), that a placement has at a place; `matrix` is the field's there."""
    table, number = pyramid.table, readings.levels[one]
    number -= table[number, 3] & 1
    for _ in range(HALVINGS):
        if number + 2 < table.shape[0] and table[number + 2, 3] > table[number, 3]:
            number += 2
    turn, shift = readings.symmetries[one], table[number, 3] >> 1
    down = min(max(place[0] - readings.centres[one, 0], -16383), 16383)
    right = min(max(place[1] - readings.centres[one, 1], -16383), 16383)
    r, c = reading(readings.matrices[one], matrix, down, right)
    row = ((readings.sources[one, 0] + turn[0] * r + turn[1] * c + 8) >> shift) - 8
    column = ((readings.sources[one, 1] + turn[2] * r + turn[3] * c + 8) >> shift) - 8
    at, y, x = pixels_at(pyramid, table[number], row, column)
    for n in range(out.shape[0]):
        out[n] = _shade(pyramid.words, at, n, y, x, pyramid.bits)


@inline
def _find_runs(labels: NDArray[np.int32], i: Any, runs: NDArray[np.int32]) -> None:
    """Write, for each cell of row i, how many cells from it on to the right have its label."""
    last = labels.shape[1] - 1
    runs[last] = 1
    for j in range(last - 1, -1, -1):
        runs[j] = runs[j + 1] + 1 if labels[i, j] == labels[i, j + 1] else 1


@kernel
def cell_tones(
    labels: NDArray[np.int32],
    first: tuple[int, int],
    nodes: Nodes,
    readings: Readings,
    pyramid: PyramidWords,
    scratch: Scratch,
    out: PixelArray,
) -> None:
    """Fill `out`, (rows, columns, channels), with the tones of cells from `first`, (row, column), on.

    `out` is int32 for integer samples, in 1/256 sample of 8 bits or in samples of 16; else float32.
    `scratch.runs` is (2·REACH + 1, columns of cells), `scratch.found` (MOST_OTHERS, 2) and `scratch.shades`
    (2, channels) of out's dtype.
    """
    runs, found, shades = scratch.runs, scratch.found, scratch.shades
    known = max(first[0] - REACH, 0)
    for n in range(out.shape[0]):
        i = first[0] + n
        _, bottom, down = _around(i, labels.shape[0])
        while known <= bottom:
            _find_runs(labels, known, runs[known % runs.shape[0]])
            known += 1
        for m in range(out.shape[1]):
            j = first[1] + m
            _, _, across = _around(j, labels.shape[1])
            fade = min(max(down * across - 2560, 0) >> 2, 256)
            for k in range(out.shape[2]):
                out[n, m, k] = 0
            count = _others(labels, runs, i, j, found) if fade else 0
            if count == 0:
                continue
            place = nodes.rows[i], nodes.columns[j]
            matrix = matrix_between(nodes.matrices, nodes.margin, place[0], place[1])
            _read_shades(readings, labels[i, j], matrix, place, pyramid, shades[0])
            for other in range(count):
                _read_shades(readings, found[other, 0], matrix, place, pyramid, shades[1])
                for k in range(out.shape[2]):
                    out[n, m, k] += _weighted(shades[1, k] - shades[0, k], found[other, 1])
            for k in range(out.shape[2]):
                out[n, m, k] = _settled(out[n, m, k], fade)
