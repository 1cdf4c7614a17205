"""Painting through warp fields, exactly: the arithmetic every decoder repeats (CONVENTIONS.md, "Painting").

Integer samples lie side by side in words of 64 bits, as lanes of 16 or 32 bits (see
`upholster.quilt.pyramid`), so that one multiplication weights several channels of a pixel; the canvas has
the same lanes. No lane ever overflows: a weighted sum is at most sample · 256.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.extending import overload
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.quilt._field_kernels import displacement_row
from upholster.quilt._paint_kernels import fill_weights, mask_window
from upholster.types import PixelArray, int64

__all__ = ["PyramidWords", "settle_strip", "warp_strip"]


class PyramidWords(NamedTuple):
    """A pyramid's samples, `per_pixel` words a pixel, in lanes of `bits` bits (of no meaning for floats).

    `levels` (n, 5) tells of each level its first word, words per row, last row, last column and number.
    """

    words: PixelArray
    per_pixel: int
    bits: int
    levels: NDArray[np.int64]


def _mix(
    words: PixelArray,
    at: Any,
    beside: Any,
    below: Any,
    weights: tuple[Any, Any, Any, Any],
    bits: Any,
) -> Any:
    """Return the canvas's word for a pixel's word and those beside and below it, weighted in 1/256."""
    raise NotImplementedError  # compiled only


def _lay(old: Any, new: Any, weight: Any, bits: Any) -> Any:
    """Return `weight`/256 of `new` over `old`, lane by lane."""
    raise NotImplementedError  # compiled only


@overload(_mix, strict=False)
def _mix_overload(words: Any, at: Any, beside: Any, below: Any, weights: Any, bits: Any) -> Any:
    if isinstance(words.dtype, types.Integer):

        def mix(words: Any, at: Any, beside: Any, below: Any, weights: Any, bits: Any) -> Any:
            total = (
                words[at] * np.uint64(weights[0])
                + words[at + beside] * np.uint64(weights[1])
                + words[at + below] * np.uint64(weights[2])
                + words[at + below + beside] * np.uint64(weights[3])
            )
            # 6 fractional bits are left; what a shift carries into the lane below is masked away.
            if bits == 16:
                return ((total + np.uint64(0x0002000200020002)) >> np.uint64(2)) & np.uint64(
                    0x3FFF3FFF3FFF3FFF
                )
            return ((total + np.uint64(0x0000000200000002)) >> np.uint64(2)) & np.uint64(0x3FFFFFFF3FFFFFFF)

        return mix

    def mix_floats(words: Any, at: Any, beside: Any, below: Any, weights: Any, bits: Any) -> Any:
        unit = np.float32(1 / 256)
        return (
            words[at] * (np.float32(weights[0]) * unit)
            + words[at + beside] * (np.float32(weights[1]) * unit)
            + words[at + below] * (np.float32(weights[2]) * unit)
            + words[at + below + beside] * (np.float32(weights[3]) * unit)
        )

    return mix_floats


@overload(_lay, strict=False)
def _lay_overload(old: Any, new: Any, weight: Any, bits: Any) -> Any:
    if isinstance(old, types.Integer):

        def lay(old: Any, new: Any, weight: Any, bits: Any) -> Any:
            # Every other lane at a time, to make room for 8 more bits.
            if bits == 16:
                step, mask, half = np.uint64(16), np.uint64(0x0000FFFF0000FFFF), np.uint64(0x0000008000000080)
            else:
                step, mask, half = np.uint64(32), np.uint64(0x00000000FFFFFFFF), np.uint64(0x80)
            of_new, of_old = np.uint64(weight), np.uint64(256 - weight)
            even = (((old & mask) * of_old + (new & mask) * of_new + half) >> np.uint64(8)) & mask
            odd = (
                ((old >> step & mask) * of_old + (new >> step & mask) * of_new + half) >> np.uint64(8)
            ) & mask
            return even | odd << step

        return lay

    def lay_floats(old: Any, new: Any, weight: Any, bits: Any) -> Any:
        unit = np.float32(1 / 256)
        return old * (np.float32(256 - weight) * unit) + new * (np.float32(weight) * unit)

    return lay_floats


@inline
def _trace_row(
    matrices: NDArray[np.int32],
    margin: int,
    row: int,
    column: int,
    centre: tuple[np.int32, np.int32, np.int32, np.int32],
    placement: Any,
    symmetry: NDArray[np.int64],
    level: NDArray[np.int64],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
) -> None:
    """Write where the texels of a row from `column` on lie in a level of the pyramid, in 1/16 pixel."""
    displacement_row(
        matrices,
        margin,
        centre,
        row - placement.row,
        row,
        column,
        column - placement.column,
        rows,
        columns,
    )
    s0, s1, s2, s3 = (
        np.int32(symmetry[0]),
        np.int32(symmetry[1]),
        np.int32(symmetry[2]),
        np.int32(symmetry[3]),
    )
    k, eight = np.int32(level[4]), np.int32(8)
    source_row, source_column = np.int32(placement.source_row + 8), np.int32(placement.source_column + 8)
    most_row, most_column = np.int32(16 * level[2]), np.int32(16 * level[3])
    for n in range(rows.shape[0]):
        y, x = rows[n], columns[n]
        r = np.int32((np.int32(source_row + s0 * y + s1 * x) >> k) - eight)
        c = np.int32((np.int32(source_column + s2 * y + s3 * x) >> k) - eight)
        # Beyond the image lies its rim.
        rows[n] = min(max(r, np.int32(0)), most_row)
        columns[n] = min(max(c, np.int32(0)), most_column)


@inline
def _paint_row(
    line: PixelArray,
    pyramid: PyramidWords,
    level: NDArray[np.int64],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    weights: NDArray[np.int32],
) -> None:
    # Paints a row of texels that lie at (rows, columns) of a level, in 1/16 pixel.
    words, per_pixel, bits = pyramid.words, pyramid.per_pixel, pyramid.bits
    base, stride = level[0], level[1]
    for n in range(rows.shape[0]):
        weight = weights[n]
        if weight == 0:
            continue
        r, c = int64(rows[n]), int64(columns[n])
        y, x = r & 15, c & 15
        both = x * y
        shares = (256 - 16 * (x + y) + both, 16 * x - both, 16 * y - both, both)
        at = base + (r >> 4) * stride + (c >> 4) * per_pixel
        for k in range(per_pixel):
            new = _mix(words, np.uintp(at + k), np.uintp(per_pixel), np.uintp(stride), shares, bits)
            if weight != 256:
                new = _lay(line[n * per_pixel + k], new, weight, bits)
            line[n * per_pixel + k] = new


@kernel
def warp_strip(
    placements: Any,
    centres: NDArray[np.int32],
    chosen: NDArray[np.int64],
    cells: NDArray[np.uint8],
    matrices: NDArray[np.int32],
    margin: int,
    symmetries: NDArray[np.int64],
    pyramid: PyramidWords,
    scratch: NDArray[np.int32],
    first_row: int,
    tall: int,
    canvas: PixelArray,
) -> None:
    """Paint placements on some rows of a chart of `tall` rows, from `first_row` on.

    `centres` (n, 4) are their centre matrices and `chosen` their levels, by place in the pyramid. `matrices`
    and `margin` are the warp field's. `scratch` is (4, `weight_rows`, width of the widest placement), and
    `canvas` is (rows, columns · words a pixel).
    """
    weights, spare, per_pixel = scratch[0], scratch[1], pyramid.per_pixel
    width = canvas.shape[1] // per_pixel
    for row in range(canvas.shape[0]):
        line = canvas[row]
        for x in range(line.shape[0]):
            line[x] = 0
    for m in range(placements.shape[0]):
        placement = placements[m]
        top, left = placement.row - placement.height // 2, placement.column - placement.width // 2
        row0, row1 = max(top, first_row), min(top + placement.height, first_row + canvas.shape[0])
        column0, column1 = max(left, int64(0)), min(left + placement.width, width)
        if row0 >= row1 or column0 >= column1:
            continue
        window = mask_window(placement, tall, width) if placement.mask == 2 else (0, 0, 0, 0)
        first_i, first_j = fill_weights(placement, cells, window, row0 - top, row1 - top, weights, spare)
        m0, m1, m2, m3 = centres[m, 0], centres[m, 1], centres[m, 2], centres[m, 3]
        centre = int64(m0), int64(m1), int64(m2), int64(m3)
        symmetry, level = symmetries[placement.symmetry], pyramid.levels[chosen[m]]
        rows, columns = scratch[2, 0, : column1 - column0], scratch[3, 0, : column1 - column0]
        for row in range(row0, row1):
            _trace_row(matrices, margin, row, column0, centre, placement, symmetry, level, rows, columns)
            part = weights[row - top - first_i, column0 - left - first_j : column1 - left - first_j]
            line = canvas[row - first_row, column0 * per_pixel : column1 * per_pixel]
            _paint_row(line, pyramid, level, rows, columns, part)


@kernel
def settle_strip(lanes: PixelArray, channels: int, out: PixelArray) -> None:
    """Round a canvas's lanes (rows, columns, lanes) to samples, once: `out` is (rows, columns · channels)."""
    for i in range(lanes.shape[0]):
        line, source = out[i], lanes[i]
        for j in range(lanes.shape[1]):
            for k in range(channels):
                line[j * channels + k] = (np.int32(source[j, k]) + np.int32(32)) >> np.int32(6)
