"""Painting a window of a chart, exactly: the arithmetic every decoder repeats (SPEC.md, section 8).

Integer samples lie side by side in words of 64 bits, as lanes of 16 or 32 bits, so that one multiplication
weights several channels of a pixel. No lane overflows: bytes take 16 bits with a pixel's weights of 256, and
24 with the labels' weights, for which every other lane is spread; samples of 16 bits take 32 with both.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.extending import overload
from numpy.typing import NDArray

from upholster.jit import inline, kernel, shared
from upholster.quilt._field_kernels import node_row, reading
from upholster.types import PixelArray

__all__ = ["Field", "Layer", "Places", "PyramidWords", "Readings", "paint_window"]


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


class PyramidWords(NamedTuple):
    """A pyramid's samples, see `upholster.quilt.pyramid.Pyramid`: `bits` is a lane's, of no meaning for floats."""

    words: PixelArray
    per_pixel: int
    bits: int
    table: NDArray[np.int64]


class Field(NamedTuple):
    """A warp field: its nodes' matrices and margin, and `line`, (columns of nodes, 4): scratch for a row."""

    matrices: NDArray[np.int32]
    margin: int
    line: NDArray[np.int64]


_HALVES = np.uint64(0x0000FFFF0000FFFF)


def _bilinear(words: Any, at: Any, k: Any, y: Any, x: Any) -> Any:
    """Return the k-th words of four pixels, weighted by fractions in 1/16: of integers 256 times their mean."""
    raise NotImplementedError  # compiled only


def _settle(word: Any, texel: Any, k: Any, bits: Any) -> Any:
    """Write to a texel what a single placement shows: `_bilinear`'s k-th word."""
    raise NotImplementedError  # compiled only


def _gather(total: Any, word: Any, k: Any, bits: Any, weight: Any) -> Any:
    """Add `_bilinear`'s k-th word to sums, weighted in 1/256."""
    raise NotImplementedError  # compiled only


def _settle_sums(total: Any, texel: Any, bits: Any, rest: Any) -> Any:
    """Write sums to a texel, over what is there with `rest`/256 of it; rounded once."""
    raise NotImplementedError  # compiled only


@overload(_bilinear, strict=False)
def _bilinear_overload(words: Any, at: Any, k: Any, y: Any, x: Any) -> Any:
    if isinstance(words.dtype, types.Integer):

        def mixed(words: Any, at: Any, k: Any, y: Any, x: Any) -> Any:
            both = y * x
            return (
                words[at[0] + k] * np.uint64(256 - 16 * (y + x) + both)
                + words[at[1] + k] * np.uint64(16 * x - both)
                + words[at[2] + k] * np.uint64(16 * y - both)
                + words[at[3] + k] * np.uint64(both)
            )

        return mixed

    def floats(words: Any, at: Any, k: Any, y: Any, x: Any) -> Any:
        both, unit = y * x, np.float32(1 / 256)
        return (
            words[at[0] + k] * (np.float32(256 - 16 * (y + x) + both) * unit)
            + words[at[1] + k] * (np.float32(16 * x - both) * unit)
            + words[at[2] + k] * (np.float32(16 * y - both) * unit)
            + words[at[3] + k] * (np.float32(both) * unit)
        )

    return floats


@overload(_settle, strict=False)
def _settle_overload(word: Any, texel: Any, k: Any, bits: Any) -> Any:
    if isinstance(word, types.Integer):

        def settle(word: Any, texel: Any, k: Any, bits: Any) -> Any:
            lanes = 64 // bits
            word = word + (np.uint64(0x0080008000800080) if bits == 16 else np.uint64(0x0000008000000080))
            mask = np.uint64(0xFF) if bits == 16 else np.uint64(0xFFFF)
            for n in range(min(lanes, texel.shape[0] - lanes * k)):
                texel[lanes * k + n] = (word >> np.uint64(bits * n + 8)) & mask

        return settle

    def settle_float(word: Any, texel: Any, k: Any, bits: Any) -> Any:
        texel[k] = word

    return settle_float


@overload(_gather, strict=False)
def _gather_overload(total: Any, word: Any, k: Any, bits: Any, weight: Any) -> Any:
    if isinstance(word, types.Integer):

        def gather(total: Any, word: Any, k: Any, bits: Any, weight: Any) -> Any:
            if bits == 16:
                total[2 * k] += (word & _HALVES) * np.uint64(weight)
                total[2 * k + 1] += ((word >> np.uint64(16)) & _HALVES) * np.uint64(weight)
            else:
                total[k] += word * np.uint64(weight)

        return gather

    def gather_floats(total: Any, word: Any, k: Any, bits: Any, weight: Any) -> Any:
        total[k] += word * (np.float32(weight) * np.float32(1 / 256))

    return gather_floats


@overload(_settle_sums, strict=False)
def _settle_sums_overload(total: Any, texel: Any, bits: Any, rest: Any) -> Any:
    if isinstance(total.dtype, types.Integer):

        def settle(total: Any, texel: Any, bits: Any, rest: Any) -> Any:
            for n in range(texel.shape[0]):
                if bits == 16:
                    word, shift = total[2 * (n >> 2) + (n & 1)], 16 * (n & 2)
                else:
                    word, shift = total[n >> 1], 32 * (n & 1)
                own = (word >> np.uint64(shift)) & np.uint64(0xFFFFFFFF)
                texel[n] = (np.uint64(texel[n]) * np.uint64(256 * rest) + own + np.uint64(32768)) >> np.uint64(16)

        return settle

    def settle_floats(total: Any, texel: Any, bits: Any, rest: Any) -> Any:
        for n in range(texel.shape[0]):
            below = texel[n] * (np.float32(rest) * np.float32(1 / 256)) if rest else np.float32(0)
            texel[n] = below + total[n]

    return settle_floats


@inline
def _mirrored(place: Any, size: Any) -> Any:
    if 0 <= place < size:
        return place
    place %= 2 * size
    return place if place < size else 2 * size - 1 - place


@inline
def _matrix(field: Field, place: Any) -> Any:
    """Return M at a place of the row that `field.line` is for."""
    line, last = field.line, field.line.shape[0] - 1
    x = place - 8
    j, right = field.margin + (x >> 9), x & 511
    if j < 0:
        j, right = np.int64(0), np.int64(0)
    elif j >= last:
        j, right = np.int64(last), np.int64(0)
    beside, left = min(j + 1, last), 512 - right
    return (
        (line[j, 0] * left + line[beside, 0] * right + 256) >> 9,
        (line[j, 1] * left + line[beside, 1] * right + 256) >> 9,
        (line[j, 2] * left + line[beside, 2] * right + 256) >> 9,
        (line[j, 3] * left + line[beside, 3] * right + 256) >> 9,
    )


@inline
def _pixels(readings: Readings, one: Any, pyramid: PyramidWords, row: Any, column: Any, here: Any) -> Any:
    """Return the words of the four pixels that a placement reads at a place, and its fractions between them."""
    m = readings.matrices[one]
    down = min(max(row - readings.centres[one, 0], -16383), 16383)
    right = min(max(column - readings.centres[one, 1], -16383), 16383)
    y, x = reading((m[0], m[1], m[2], m[3]), here, down, right)
    turn = readings.symmetries[one]
    base, height, width, k = pyramid.table[readings.levels[one]]
    r = ((readings.sources[one, 0] + turn[0] * y + turn[1] * x + 8) >> k) - 8
    c = ((readings.sources[one, 1] + turn[2] * y + turn[3] * x + 8) >> k) - 8
    y, x, r, c, each = r & 15, c & 15, r >> 4, c >> 4, np.int64(pyramid.per_pixel)
    if 0 <= r < height - 1 and 0 <= c < width - 1:
        at = base + (r * width + c) * each
        return (at, at + each, at + width * each, at + (width + 1) * each), y, x
    top, bottom = base + _mirrored(r, height) * width * each, base + _mirrored(r + 1, height) * width * each
    left, beside = _mirrored(c, width) * each, _mirrored(c + 1, width) * each
    return (top + left, top + beside, bottom + left, bottom + beside), y, x


@shared
def _paint_run(
    layer: Layer,
    one: Any,
    t: Any,
    ends: tuple[Any, Any],
    readings: Readings,
    field: Field,
    pyramid: PyramidWords,
    out: PixelArray,
) -> None:
    # Paints texels of a row that show one placement alone.
    row = layer.rows.at[t]
    for u in range(ends[0], ends[1]):
        column = layer.columns.at[u]
        at, y, x = _pixels(readings, one, pyramid, row, column, _matrix(field, column))
        texel = out[t, u]
        for k in range(pyramid.per_pixel):
            _settle(_bilinear(pyramid.words, at, k, y, x), texel, k, pyramid.bits)


@shared
def _paint_mixed(
    layer: Layer,
    named: Any,
    t: Any,
    ends: tuple[Any, Any],
    readings: Readings,
    field: Field,
    pyramid: PyramidWords,
    total: PixelArray,
    out: PixelArray,
) -> None:
    # Paints texels of a row that show several placements, between the same four cells; −1 shows what is there.
    row, f = layer.rows.at[t], layer.rows.part[t]
    for u in range(ends[0], ends[1]):
        column, g = layer.columns.at[u], layer.columns.part[u]
        shares = ((16 - f) * (16 - g), (16 - f) * g, f * (16 - g), f * g)
        here, shown = _matrix(field, column), 0
        for n in range(total.shape[0]):
            total[n] = 0
        for n in range(4):
            one, weight, seen = named[n], 0, named[n] < 0
            for before in range(n):
                seen = seen or named[before] == one
            if seen:
                continue
            for behind in range(n, 4):
                if named[behind] == one:
                    weight += shares[behind]
            if weight:
                shown += weight
                at, y, x = _pixels(readings, one, pyramid, row, column, here)
                for k in range(pyramid.per_pixel):
                    _gather(total, _bilinear(pyramid.words, at, k, y, x), k, pyramid.bits, weight)
        if shown:
            _settle_sums(total, out[t, u], pyramid.bits, 256 - shown)


@inline
def _named(labels: NDArray[np.int32], i: Any, j: Any) -> Any:
    return labels[i, j], labels[i, j + 1], labels[i + 1, j], labels[i + 1, j + 1]


@inline
def _alike(named: Any) -> Any:
    return named[0] == named[1] and named[0] == named[2] and named[0] == named[3]


@shared
def _paint_row(
    layer: Layer,
    t: Any,
    readings: Readings,
    field: Field,
    pyramid: PyramidWords,
    total: PixelArray,
    out: PixelArray,
) -> None:
    # Paints a row of texels: runs between the same cells, or of cells that name one placement.
    i, cells, u = layer.rows.cell[t], layer.columns.cell, 0
    while u < out.shape[1]:
        named, start = _named(layer.labels, i, cells[u]), u
        while u < out.shape[1] and cells[u] == cells[start]:
            u += 1
        if not _alike(named):
            _paint_mixed(layer, named, t, (start, u), readings, field, pyramid, total, out)
            continue
        while u < out.shape[1]:
            further = _named(layer.labels, i, cells[u])
            if further[0] != named[0] or not _alike(further):
                break
            j = cells[u]
            while u < out.shape[1] and cells[u] == j:
                u += 1
        if named[0] >= 0:
            _paint_run(layer, named[0], t, (start, u), readings, field, pyramid, out)


@kernel
def paint_window(
    first: Layer,
    second: Layer,
    readings: Readings,
    field: Field,
    pyramid: PyramidWords,
    total: PixelArray,
    out: PixelArray,
) -> None:
    """Paint a window of a chart into `out`, (rows, columns, channels), which is 0.

    `second` has no labels where there is one layer. `total`, scratch, is (2 · words a pixel,) of their dtype.
    """
    matrices, line = field.matrices, field.line
    for t in range(out.shape[0]):
        i, below, down = node_row(matrices, field.margin, first.rows.at[t])
        for j in range(line.shape[0]):
            for k in range(4):
                line[j, k] = (matrices[i, j, k] * (512 - down) + matrices[below, j, k] * down + 256) >> 9
        _paint_row(first, t, readings, field, pyramid, total, out)
        if second.labels.shape[0]:
            _paint_row(second, t, readings, field, pyramid, total, out)
