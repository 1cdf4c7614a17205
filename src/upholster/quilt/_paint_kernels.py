"""Painting a window of a chart exactly, with the arithmetic that every decoder repeats (SPEC.md, section 8).

Words of integer samples are packed as `upholster.quilt._reading_kernels` says. Bytes take 24 bits when
weighted by labels, for which every other lane is moved to a second word. 16-bit samples take 32 bits.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray
from upholster.quilt._field_kernels import node_row
from upholster.quilt._reading_kernels import PyramidWords, Readings, bilinear, pixels_at
from upholster.quilt._tone_kernels import tone_at
from upholster.runtime.jit import by_type, inline, is_float, kernel, shared

__all__ = ["Field", "Layer", "Places", "Tone", "paint_window"]


class Places(NamedTuple):
    """The places of a window's rows (or columns), (n,) each.

    `at` is in 1/16 step; `cell` is the first of the two surrounding cells; `part` is the distance from that
    cell's centre towards the next one's, in 1/16 of the distance between them.
    """

    at: NDArray[np.int32]
    cell: NDArray[np.int64]
    part: NDArray[np.int64]


class Layer(NamedTuple):
    """A layer's labels, and the rows and columns of a window on it."""

    labels: NDArray[np.int32]
    rows: Places
    columns: Places


class Tone(NamedTuple):
    """Tones of cells, (rows, columns, channels), from the cell (`row`, `column`) on; empty: none is added."""

    cells: PixelArray
    row: int
    column: int


class Field(NamedTuple):
    """A warp field: its nodes' matrices and margin; and scratch space for a row.

    `line`, (columns of nodes, 4), has M interpolated between rows of nodes; `found`, (2, texels), receives
    the places where a run reads.
    """

    matrices: NDArray[np.int32]
    margin: int
    line: NDArray[np.int64]
    found: NDArray[np.int32]


_HALVES = np.uint64(0x0000FFFF0000FFFF)


def _single(word: Any) -> Any:
    """Return what `bilinear` returns at a pixel's centre."""
    raise NotImplementedError  # compiled only


def _write(word: Any, texel: Any, k: Any, bits: Any) -> Any:
    """Write a single placement's value to a texel: `bilinear`'s k-th word."""
    raise NotImplementedError  # compiled only


def _gather(total: Any, word: Any, k: Any, bits: Any, weight: Any) -> Any:
    """Add `bilinear`'s k-th word to sums, weighted in 1/256."""
    raise NotImplementedError  # compiled only


def _write_sums(total: Any, texel: Any, bits: Any, rest: Any) -> Any:
    """Write sums to a texel, plus `rest`/256 of its present value; rounded once."""
    raise NotImplementedError  # compiled only


@by_type(_single)
def _single_overload(word: Any) -> Any:
    if not is_float(word):
        return lambda word: word * np.uint64(256)
    return lambda word: word


@by_type(_write)
def _write_overload(word: Any, texel: Any, k: Any, bits: Any) -> Any:
    if not is_float(word):

        def write(word: Any, texel: Any, k: Any, bits: Any) -> Any:
            lanes = 64 // bits
            word = word + (np.uint64(0x0080008000800080) if bits == 16 else np.uint64(0x0000008000000080))
            mask = np.uint64(0xFF) if bits == 16 else np.uint64(0xFFFF)
            for n in range(min(lanes, texel.shape[0] - lanes * k)):
                texel[lanes * k + n] = (word >> np.uint64(bits * n + 8)) & mask

        return write

    def write_float(word: Any, texel: Any, k: Any, bits: Any) -> Any:
        texel[k] = word

    return write_float


@by_type(_gather)
def _gather_overload(total: Any, word: Any, k: Any, bits: Any, weight: Any) -> Any:
    if not is_float(word):

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


@by_type(_write_sums)
def _write_sums_overload(total: Any, texel: Any, bits: Any, rest: Any) -> Any:
    if not is_float(total.dtype):

        def write(total: Any, texel: Any, bits: Any, rest: Any) -> Any:
            for n in range(texel.shape[0]):
                if bits == 16:
                    word, shift = total[2 * (n >> 2) + (n & 1)], 16 * (n & 2)
                else:
                    word, shift = total[n >> 1], 32 * (n & 1)
                own = (word >> np.uint64(shift)) & np.uint64(0xFFFFFFFF)
                texel[n] = (
                    np.uint64(texel[n]) * np.uint64(256 * rest) + own + np.uint64(32768)
                ) >> np.uint64(16)

        return write

    def write_floats(total: Any, texel: Any, bits: Any, rest: Any) -> Any:
        for n in range(texel.shape[0]):
            below = texel[n] * (np.float32(rest) * np.float32(1 / 256)) if rest else np.float32(0)
            texel[n] = below + total[n]

    return write_floats


@inline
def _trace_run(
    readings: Readings, one: Any, field: Field, row: Any, columns: NDArray[np.int32], found: NDArray[np.int32]
) -> None:
    # Writes to `found`, (2, n), where a placement reads at places of a row, in 1/16 pixel of its level. Uses
    # 32 bits, node by node, like `upholster.quilt._field_kernels.reading`.
    last, half, nine, four = field.line.shape[0] - 1, np.int32(256), np.int32(9), np.int32(4)
    m, turn = readings.matrices[one], readings.symmetries[one]
    m0, m1, m2, m3 = np.int32(m[0]), np.int32(m[1]), np.int32(m[2]), np.int32(m[3])
    t0, t1, t2, t3 = np.int32(turn[0]), np.int32(turn[1]), np.int32(turn[2]), np.int32(turn[3])
    k, eight = np.int32(readings.shifts[one]), np.int32(8)
    source_row, source_column = np.int32(readings.sources[one, 0] + 8), np.int32(readings.sources[one, 1] + 8)
    down = min(max(row - readings.centres[one, 0], -16383), 16383)
    y, u, centre = np.int32(down >> 4), np.int32(down & 15), np.int32(readings.centres[one, 1])
    least, most, mask = np.int32(-16383), np.int32(16383), np.int32(15)
    start = 0
    while start < columns.shape[0]:
        j = field.margin + ((columns[start] - 8) >> 9)
        origin = np.int32(((j - field.margin) << 9) + 8)
        stop, slope = start + 1, np.int32(1)
        if j < 0 or j >= last:
            stop, j, slope = columns.shape[0] if j >= last else stop, min(max(j, 0), last), np.int32(0)
        while stop < columns.shape[0] and columns[stop] < origin + 512:
            stop += 1
        next_column = min(j + 1, last)
        a, b = field.line[j], field.line[next_column]
        a0, a1, a2, a3 = np.int32(a[0] << 9), np.int32(a[1] << 9), np.int32(a[2] << 9), np.int32(a[3] << 9)
        b0, b1 = np.int32(b[0] - a[0]) * slope, np.int32(b[1] - a[1]) * slope
        b2, b3 = np.int32(b[2] - a[2]) * slope, np.int32(b[3] - a[3]) * slope
        places, rs, cs = columns[start:stop], found[0, start:stop], found[1, start:stop]
        for n in range(places.shape[0]):
            part = np.int32(places[n] - origin)
            c0 = np.int32(m0 + (np.int32(a0 + b0 * part + half) >> nine))
            c1 = np.int32(m1 + (np.int32(a1 + b1 * part + half) >> nine))
            c2 = np.int32(m2 + (np.int32(a2 + b2 * part + half) >> nine))
            c3 = np.int32(m3 + (np.int32(a3 + b3 * part + half) >> nine))
            right = min(max(np.int32(places[n] - centre), least), most)
            x, v = np.int32(right >> four), np.int32(right & mask)
            r = np.int32(c0 * y + c1 * x + (np.int32(c0 * u + c1 * v) >> four) + half) >> nine
            c = np.int32(c2 * y + c3 * x + (np.int32(c2 * u + c3 * v) >> four) + half) >> nine
            rs[n] = (np.int32(source_row + t0 * r + t1 * c) >> k) - eight
            cs[n] = (np.int32(source_column + t2 * r + t3 * c) >> k) - eight
        start = stop


@inline
def _first_word(
    readings: Readings, one: Any, pyramid: PyramidWords, row: Any, column: Any, count: Any
) -> Any:
    """Return the word from which a run of texels is copied; −1 if it is not copied from pixels in a row."""
    if not readings.copies[one]:
        return -1
    level = pyramid.table[readings.levels[one]]
    down, right = row - readings.centres[one, 0], column - readings.centres[one, 1]
    r, c = (readings.sources[one, 0] + down) >> 4, (readings.sources[one, 1] + right) >> 4
    inside = 0 <= r < level[1] and c >= 0 and c + count <= level[2]
    near = abs(down) < 16384 and abs(right) < 16384 and abs(right + 16 * count) < 16384
    return level[0] + (r * level[2] + c) * pyramid.per_pixel if inside and near else -1


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
    # Paints texels of a row that show only one placement.
    start, stop = ends
    word = _first_word(readings, one, pyramid, layer.rows.at[t], layer.columns.at[start], stop - start)
    if word >= 0:
        for n in range(start, stop):
            for k in range(pyramid.per_pixel):
                _write(_single(pyramid.words[word]), out[t, n], k, pyramid.bits)
                word += 1
        return
    found = field.found[:, start:stop]
    _trace_run(readings, one, field, layer.rows.at[t], layer.columns.at[start:stop], found)
    level = pyramid.table[readings.levels[one]]
    for n in range(stop - start):
        at, y, x = pixels_at(pyramid, level, np.int64(found[0, n]), np.int64(found[1, n]))
        texel = out[t, start + n]
        for k in range(pyramid.per_pixel):
            _write(bilinear(pyramid.words, at, k, y, x), texel, k, pyramid.bits)


@shared
def _paint_mixed(
    layer: Layer,
    named: Any,
    t: Any,
    ends: tuple[Any, Any],
    readings: Readings,
    field: Field,
    pyramid: PyramidWords,
    totals: PixelArray,
    out: PixelArray,
) -> None:
    # Paints texels of a row between cells that name these four placements; −1 keeps the present value.
    start, stop = ends
    found, f, columns = field.found[:, start:stop], layer.rows.part[t], layer.columns
    sums, shown = totals[start:stop], (named[0] >= 0, named[1] >= 0, named[2] >= 0, named[3] >= 0)
    for n in range(stop - start):
        for k in range(sums.shape[1]):
            sums[n, k] = 0
    for first in range(4):
        one, seen = named[first], not shown[first]
        for before in range(first):
            seen = seen or named[before] == one
        if seen:
            continue
        # Its share at a texel is left + right · part, both in 1/256.
        at_left = (16 - f) * (named[0] == one) + f * (named[2] == one)
        at_right = (16 - f) * (named[1] == one) + f * (named[3] == one)
        if at_left + at_right == 0:
            continue
        word = _first_word(readings, one, pyramid, layer.rows.at[t], columns.at[start], stop - start)
        if word >= 0:
            for n in range(stop - start):
                g = columns.part[start + n]
                for k in range(pyramid.per_pixel):
                    weight = at_left * (16 - g) + at_right * g
                    _gather(sums[n], _single(pyramid.words[word]), k, pyramid.bits, weight)
                    word += 1
            continue
        _trace_run(readings, one, field, layer.rows.at[t], columns.at[start:stop], found)
        level = pyramid.table[readings.levels[one]]
        for n in range(stop - start):
            g = columns.part[start + n]
            weight = at_left * (16 - g) + at_right * g
            if weight:
                at, y, x = pixels_at(pyramid, level, np.int64(found[0, n]), np.int64(found[1, n]))
                for k in range(pyramid.per_pixel):
                    _gather(sums[n], bilinear(pyramid.words, at, k, y, x), k, pyramid.bits, weight)
    for n in range(stop - start):
        g, rest = columns.part[start + n], 0
        if not (shown[0] and shown[1] and shown[2] and shown[3]):
            rest += (16 - f) * ((16 - g) * (not shown[0]) + g * (not shown[1]))
            rest += f * ((16 - g) * (not shown[2]) + g * (not shown[3]))
        if rest < 256:
            _write_sums(sums[n], out[t, start + n], pyramid.bits, rest)


@inline
def _named(labels: NDArray[np.int32], i: Any, j: Any) -> Any:
    return labels[i, j], labels[i, j + 1], labels[i + 1, j], labels[i + 1, j + 1]


@shared
def _paint_row(
    layer: Layer,
    t: Any,
    readings: Readings,
    field: Field,
    pyramid: PyramidWords,
    totals: PixelArray,
    out: PixelArray,
) -> None:
    # Paints a row of texels in runs between cells that name the same placements.
    i, cells, u = layer.rows.cell[t], layer.columns.cell, 0
    while u < out.shape[1]:
        named, start, alike = _named(layer.labels, i, cells[u]), u, True
        while alike and u < out.shape[1]:
            j = cells[u]
            while u < out.shape[1] and cells[u] == j:
                u += 1
            alike = u < out.shape[1] and _named(layer.labels, i, cells[u]) == named
        if not (named[0] == named[1] and named[0] == named[2] and named[0] == named[3]):
            _paint_mixed(layer, named, t, (start, u), readings, field, pyramid, totals, out)
        elif named[0] >= 0:
            _paint_run(layer, named[0], t, (start, u), readings, field, pyramid, out)


@shared
def _add_tone(layer: Layer, t: Any, tone: Tone, bits: Any, out: PixelArray) -> None:
    # Adds the tones between cells to a row of texels.
    i, f, columns = layer.rows.cell[t] - tone.row, layer.rows.part[t], layer.columns
    for u in range(out.shape[1]):
        j, g = columns.cell[u] - tone.column, columns.part[u]
        around = tone.cells[i : i + 2, j : j + 2]
        for n in range(around.shape[2]):
            out[t, u, n] = tone_at(around, n, f, g, out[t, u, n], bits)


@kernel
def paint_window(
    first: Layer,
    second: Layer,
    tone: Tone,
    readings: Readings,
    field: Field,
    pyramid: PyramidWords,
    totals: PixelArray,
    out: PixelArray,
) -> None:
    """Paint a window of a chart into `out`, (rows, columns, channels), which is 0.

    `second` has no labels if there is only one layer; `tone` is added to the first. `totals` is scratch
    space, (columns, 2 · words per pixel) of their dtype.
    """
    matrices, line = field.matrices, field.line
    for t in range(out.shape[0]):
        i, below, down = node_row(matrices, field.margin, first.rows.at[t])
        for j in range(line.shape[0]):
            for k in range(4):
                line[j, k] = (matrices[i, j, k] * (512 - down) + matrices[below, j, k] * down + 256) >> 9
        _paint_row(first, t, readings, field, pyramid, totals, out)
        if tone.cells.shape[0]:
            _add_tone(first, t, tone, pyramid.bits, out)
        if second.labels.shape[0]:
            _paint_row(second, t, readings, field, pyramid, totals, out)
