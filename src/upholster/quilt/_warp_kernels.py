"""Painting through warp fields, exactly: the arithmetic every decoder repeats (CONVENTIONS.md, "Painting").

Integer samples lie side by side in words of 64 bits, as lanes of 16 or 32 bits (see
`upholster.quilt.pyramid`), so that one multiplication weights several channels of a pixel; the canvas has
the same lanes. No lane ever overflows: a weighted sum is at most sample · 256.
"""

from typing import Any

import numpy as np
from numba import types
from numba.extending import overload
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.quilt._field_kernels import matrix_at
from upholster.quilt._paint_kernels import fill_weights
from upholster.types import PixelArray

__all__ = ["settle_strip", "warp_strip"]


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
    """Write where the texels of a row from `column` on lie in a level of the pyramid, in 1/16 pixel.

    All in 32 bits, which blocks of at most 2048 texels a side cannot leave. Between two nodes M is linear
    along the row, so that its numerator needs one multiplication.
    """
    last_i, last_j = matrices.shape[0] - 1, matrices.shape[1] - 1
    i = margin + (row >> 5)
    up, low = np.int32(32 - (row & 31)), np.int32(row & 31)
    # Beyond the last node it holds.
    above, below = matrices[min(i, last_i)], matrices[min(i + 1, last_i)]
    y = np.int32(row - placement.row)
    t0, t1, t2, t3 = (
        np.int32(symmetry[0]),
        np.int32(symmetry[1]),
        np.int32(symmetry[2]),
        np.int32(symmetry[3]),
    )
    k, half, nine, ten = np.int32(level[4]), np.int32(256), np.int32(9), np.int32(10)
    source_row, source_column = np.int32(placement.source_row + 8), np.int32(placement.source_column + 8)
    most_row, most_column = np.int32(16 * level[2]), np.int32(16 * level[3])
    start = 0
    while start < rows.shape[0]:
        first = column + start
        stop = min(rows.shape[0], start + 32 - (first & 31))
        j = margin + (first >> 5)
        beside, j, right = min(j + 1, last_j), min(j, last_j), first & 31
        left0, right0 = above[j, 0] * up + below[j, 0] * low, above[beside, 0] * up + below[beside, 0] * low
        left1, right1 = above[j, 1] * up + below[j, 1] * low, above[beside, 1] * up + below[beside, 1] * low
        left2, right2 = above[j, 2] * up + below[j, 2] * low, above[beside, 2] * up + below[beside, 2] * low
        left3, right3 = above[j, 3] * up + below[j, 3] * low, above[beside, 3] * up + below[beside, 3] * low
        m0, d0 = np.int32(left0 * 32 + 512), np.int32(right0 - left0)
        m1, d1 = np.int32(left1 * 32 + 512), np.int32(right1 - left1)
        m2, d2 = np.int32(left2 * 32 + 512), np.int32(right2 - left2)
        m3, d3 = np.int32(left3 * 32 + 512), np.int32(right3 - left3)
        some_rows, some_columns = rows[start:stop], columns[start:stop]
        x0 = np.int32(first - placement.column)
        for n in range(stop - start):
            along, x = np.int32(right + n), np.int32(x0 + n)
            a0 = np.int32((np.int32(m0 + d0 * along) >> ten) + centre[0])
            a1 = np.int32((np.int32(m1 + d1 * along) >> ten) + centre[1])
            a2 = np.int32((np.int32(m2 + d2 * along) >> ten) + centre[2])
            a3 = np.int32((np.int32(m3 + d3 * along) >> ten) + centre[3])
            v = np.int32(np.int32(a0 * y + a1 * x + half) >> nine)
            w = np.int32(np.int32(a2 * y + a3 * x + half) >> nine)
            r = np.int32((np.int32(source_row + t0 * v + t1 * w) >> k) - 8)
            c = np.int32((np.int32(source_column + t2 * v + t3 * w) >> k) - 8)
            # Beyond the image lies its rim.
            some_rows[n] = min(max(r, np.int32(0)), most_row)
            some_columns[n] = min(max(c, np.int32(0)), most_column)
        start = stop


@kernel
def warp_strip(
    placements: Any,
    cells: NDArray[np.uint8],
    matrices: NDArray[np.int32],
    margin: int,
    symmetries: NDArray[np.int64],
    words: PixelArray,
    per_pixel: int,
    bits: int,
    levels: NDArray[np.int64],
    chosen: NDArray[np.int64],
    scratch: NDArray[np.int32],
    first_row: int,
    canvas: PixelArray,
) -> None:
    """Paint placements on some rows of a chart with a field, `first_row` on.

    `words` are a pyramid's, `per_pixel` of them a pixel, in lanes of `bits` bits (of no meaning for floats),
    and `levels` (n, 5) tells of each level its first word, words per row, last row, last column and number;
    `chosen` is the place there of each placement's. `scratch` is (4, h, w) for the largest placement, and
    `canvas` is (rows, columns · per_pixel).
    """
    weights, spare = scratch[0], scratch[1]
    width = canvas.shape[1] // per_pixel
    canvas[:] = 0
    for m in range(placements.shape[0]):
        placement = placements[m]
        top, left = placement.row - placement.height // 2, placement.column - placement.width // 2
        row0, row1 = max(top, first_row), min(top + placement.height, first_row + canvas.shape[0])
        column0, column1 = max(left, 0), min(left + placement.width, width)
        if row0 >= row1 or column0 >= column1:
            continue
        fill_weights(placement, cells, weights, spare)
        centre = matrix_at(matrices, margin, placement.row, placement.column)
        symmetry, level = symmetries[placement.symmetry], levels[chosen[m]]
        base, stride = level[0], level[1]
        size = column1 - column0
        rows, columns = scratch[2, 0, :size], scratch[3, 0, :size]
        for row in range(row0, row1):
            _trace_row(
                matrices,
                margin,
                row,
                column0,
                centre,
                placement,
                symmetry,
                level,
                rows,
                columns,
            )
            part = weights[row - top, column0 - left : column1 - left]
            line = canvas[row - first_row, column0 * per_pixel : column1 * per_pixel]
            for n in range(size):
                weight = part[n]
                if weight == 0:
                    continue
                r, c = np.int64(rows[n]), np.int64(columns[n])
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
def settle_strip(lanes: PixelArray, channels: int, out: PixelArray) -> None:
    """Round a canvas's lanes (rows, columns, lanes) to samples, once: `out` is (rows, columns · channels)."""
    for i in range(lanes.shape[0]):
        line, source = out[i], lanes[i]
        for j in range(lanes.shape[1]):
            for k in range(channels):
                line[j * channels + k] = (np.int32(source[j, k]) + np.int32(32)) >> np.int32(6)
