"""Painting one placement, exactly: the arithmetic every decoder repeats (CONVENTIONS.md, "Painting").

Images are flattened to (rows, columns · channels), so that inner loops run over contiguous samples. Integer
canvases hold 6 fractional bits; weights run from 0 to 256; float canvases use the same formula without
rounding.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.extending import overload
from numpy.typing import NDArray

from upholster.jit import inline, kernel, shared
from upholster.types import PixelArray, int64

__all__ = [
    "fill_weights",
    "lay_placement",
    "mask_window",
    "paint_strip",
    "trace_owners",
    "weight_rows",
    "window_of",
]

FRACTION_BITS = 6
_MOST_FEATHER, _MOST_CELL = 16, 255

# A feather pass in 1/256, in 32 bits throughout.
_SIDE, _MIDDLE, _HALF, _EIGHT = np.int32(51), np.int32(154), np.int32(128), np.int32(8)


class Part(NamedTuple):
    """The rows and columns of a chart, from, to, on which a placement is painted."""

    row0: int
    row1: int
    column0: int
    column1: int


def _lift(sample: Any) -> Any:
    """Return a sample as the canvas holds it."""
    return sample * 64 if isinstance(sample, (int, np.integer)) else sample


def _blend(old: Any, new: Any, weight: Any) -> Any:
    """Return `weight`/256 of `new` over `old`, both as the canvas holds them."""
    if isinstance(old, (int, np.integer)):
        return (old * (256 - weight) + new * weight + 128) >> 8
    return old * ((256 - weight) / 256) + new * (weight / 256)


def _settle(value: Any) -> Any:
    """Return a canvas value as a sample: rounded once, at the end."""
    return (value + 32) >> FRACTION_BITS if isinstance(value, (int, np.integer)) else value


@overload(_lift, strict=False)
def _lift_overload(sample: Any) -> Any:
    if isinstance(sample, types.Integer):
        return lambda sample: np.int32(sample) << np.int32(6)
    return lambda sample: sample


@overload(_blend, strict=False)
def _blend_overload(old: Any, new: Any, weight: Any) -> Any:
    if isinstance(old, types.Integer):
        return lambda old, new, weight: (
            (
                np.int32(old) * (np.int32(256) - np.int32(weight))
                + np.int32(new) * np.int32(weight)
                + np.int32(128)
            )
            >> np.int32(8)
        )
    return lambda old, new, weight: (
        old * (np.float32(256 - weight) * np.float32(1 / 256))
        + new * (np.float32(weight) * np.float32(1 / 256))
    )


@overload(_settle, strict=False)
def _settle_overload(value: Any) -> Any:
    if isinstance(value, types.Integer):
        return lambda value: (np.int32(value) + np.int32(32)) >> np.int32(6)
    return lambda value: value


@inline
def _smooth(weights: NDArray[np.int32], spare: NDArray[np.int32], height: int, width: int) -> None:
    # One feather pass: (.2, .6, .2) down the columns, then along the rows; the rim repeats itself.
    for i in range(height):
        above, line, below = weights[max(i - 1, 0)], weights[i], weights[min(i + 1, height - 1)]
        out = spare[i]
        for j in range(width):
            out[j] = (_SIDE * (above[j] + below[j]) + _MIDDLE * line[j] + _HALF) >> _EIGHT
    for i in range(height):
        line, out = spare[i], weights[i]
        last = width - 1
        out[0] = (_SIDE * (line[0] + line[min(1, last)]) + _MIDDLE * line[0] + _HALF) >> _EIGHT
        left, middle, right = line[: last - 1], line[1:last], line[2:]
        inner = out[1:last]
        for j in range(last - 1):
            inner[j] = (_SIDE * (left[j] + right[j]) + _MIDDLE * middle[j] + _HALF) >> _EIGHT
        if last > 0:
            out[last] = (_SIDE * (line[last - 1] + line[last]) + _MIDDLE * line[last] + _HALF) >> _EIGHT


@inline
def _ramp_weight(placement: Any, i: int, j: int) -> Any:
    weight: Any = 256
    if placement.mask == 1:
        ramp = int64(placement.ramp)
        if placement.sides & 1 and i < ramp:
            weight = (2 * i + 1) * 128 // ramp
        if placement.sides & 2 and j < ramp:
            weight = (weight * ((2 * j + 1) * 128 // ramp)) >> 8
    return weight


@inline
def window_of(
    low: tuple[Any, Any], size: tuple[Any, Any], cell: Any, reach: Any, tall: Any, wide: Any
) -> tuple[Any, Any, Any, Any]:
    """Return the window of a mask on a chart of `tall` × `wide` texels: rows, columns of cells, from, to.

    The block's first texel is `low`, its size `size`; feathering carries `reach` texels far. The same as
    `upholster.quilt.placement.mask_windows`.
    """
    rows, columns = (size[0] + cell - 1) // cell, (size[1] + cell - 1) // cell
    i0, j0 = max(min((-reach - low[0]) // cell, rows), 0), max(min((-reach - low[1]) // cell, columns), 0)
    i1 = max(min((tall + reach - low[0] + cell - 1) // cell, rows), i0)
    j1 = max(min((wide + reach - low[1] + cell - 1) // cell, columns), j0)
    return i0, i1, j0, j1


@inline
def mask_window(placement: Any, tall: Any, wide: Any) -> tuple[Any, Any, Any, Any]:
    """Return the window of a placement with a cut mask, see `window_of`."""
    height, width = int64(placement.height), int64(placement.width)
    low = (placement.row - height // 2, placement.column - width // 2)
    cell, reach = int64(placement.mask_cell), int64(placement.feather)
    return window_of(low, (height, width), cell, reach, tall, wide)


@shared
def fill_weights(
    placement: Any,
    cells: NDArray[np.uint8],
    window: tuple[Any, Any, Any, Any],
    start: Any,
    stop: Any,
    weights: NDArray[np.int32],
    spare: NDArray[np.int32],
) -> tuple[Any, Any]:
    """Write the weights, 0 to 256, of rows [start, stop) of a placement's rectangle.

    Those of a cut mask are written for its window alone, and for as many rows more as feathering needs.
    `weights` and `spare` hold so many rows, see `weight_rows`, as wide as the placement. Returns which texel
    of the rectangle the first weight is for.
    """
    height, width = int64(placement.height), int64(placement.width)
    if placement.mask != 2:
        for i in range(start, stop):
            for j in range(width):
                weights[i - start, j] = _ramp_weight(placement, i, j)
        return int64(start), int64(0)
    cell, reach = int64(placement.mask_cell), int64(placement.feather)
    i0, i1, j0, j1 = window
    first_cell, across = int64(placement.first_cell), j1 - j0
    # Beyond these cells nothing is carried into the rows.
    above = max(i0, (start - reach) // cell)
    i1 = min(i1, (stop + reach + cell - 1) // cell)
    first_cell, i0 = first_cell + (above - i0) * across, above
    height, width = min(i1 * cell, height) - i0 * cell, min(j1 * cell, width) - j0 * cell
    for i in range(height):
        line = weights[i]
        if i % cell:
            above = weights[i - 1]
            for j in range(width):
                line[j] = above[j]
            continue
        first = first_cell + i // cell * across
        for a in range(across):
            weight = np.int32(cells[first + a]) << 8
            for j in range(a * cell, min((a + 1) * cell, width)):
                line[j] = weight
    for _ in range(placement.feather):
        _smooth(weights, spare, height, width)
    return i0 * cell, j0 * cell


def weight_rows(rows: int, height: int) -> int:
    """Return how many rows of weights `fill_weights` writes at most for `rows` rows of placements so high."""
    return min(height, rows + 2 * (_MOST_FEATHER + _MOST_CELL))


@inline
def _copy_rows(
    canvas: PixelArray, first_row: int, part: Part, placement: Any, exemplar: PixelArray, channels: int
) -> None:
    # Paints an upright placement that is whole, or ramped at its top and left.
    top, left = placement.row - placement.height // 2, placement.column - placement.width // 2
    ramp = int64(placement.ramp) if placement.mask == 1 and placement.sides & 2 else int64(0)
    inner = min(max(left + ramp, part.column0), part.column1)
    source_row, source_column = placement.source_row >> 4, placement.source_column >> 4
    source0 = (source_column + part.column0 - placement.column) * channels
    split, size = (inner - part.column0) * channels, (part.column1 - part.column0) * channels
    for row in range(part.row0, part.row1):
        # Slices count from 0, which lets the compiler use vector instructions.
        line = canvas[row - first_row, part.column0 * channels : part.column1 * channels]
        source = exemplar[source_row + row - placement.row, source0 : source0 + size]
        for column in range(part.column0, inner):
            weight = _ramp_weight(placement, row - top, column - left)
            for x in range((column - part.column0) * channels, (column - part.column0 + 1) * channels):
                line[x] = _blend(line[x], _lift(source[x]), weight)
        weight = _ramp_weight(placement, row - top, ramp)
        line, source = line[split:], source[split:]
        if weight == 256:
            for x in range(line.shape[0]):
                line[x] = _lift(source[x])
        else:
            for x in range(line.shape[0]):
                line[x] = _blend(line[x], _lift(source[x]), weight)


@inline
def _blend_row(
    line: PixelArray, exemplar: PixelArray, source_row: int, source_column: int, step: Any, weights: Any
) -> None:
    # Paints a row of any other placement: its first texel reads a pixel, each next one `step` further.
    channels = line.shape[0] // weights.shape[0]
    if step[0] == 0 and step[1] == 1:
        source = exemplar[source_row, source_column * channels :]
        for n in range(weights.shape[0]):
            weight = weights[n]
            if weight != 0:
                for x in range(n * channels, (n + 1) * channels):
                    line[x] = _blend(line[x], _lift(source[x]), weight)
        return
    for n in range(weights.shape[0]):
        weight = weights[n]
        if weight != 0:
            source = exemplar[source_row + step[0] * n]
            x = (source_column + step[1] * n) * channels
            for k in range(channels):
                line[n * channels + k] = _blend(line[n * channels + k], _lift(source[x + k]), weight)


@shared
def lay_placement(
    canvas: PixelArray,
    first_row: int,
    columns: int,
    placement: Any,
    cells: NDArray[np.uint8],
    window: tuple[Any, Any, Any, Any],
    exemplar: PixelArray,
    channels: int,
    symmetries: NDArray[np.int64],
    weights: NDArray[np.int32],
    spare: NDArray[np.int32],
) -> None:
    """Paint one placement on the rows of a chart that `canvas` holds, clipped to it.

    All of its texels lie on whole pixels inside the exemplar.

    `canvas` is (rows, ≥ columns · channels), its row 0 being the chart's `first_row`; `exemplar` is
    (H, W · channels); `weights` and `spare` are scratch, see `fill_weights`.
    """
    top, left = placement.row - placement.height // 2, placement.column - placement.width // 2
    part = Part(
        max(top, first_row),
        min(top + placement.height, first_row + canvas.shape[0]),
        max(left, int64(0)),
        min(left + placement.width, columns),
    )
    if part.row0 >= part.row1 or part.column0 >= part.column1:
        return
    if placement.symmetry == 0 and placement.mask != 2:
        _copy_rows(canvas, first_row, part, placement, exemplar, channels)
        return
    first_i, first_j = fill_weights(
        placement, cells, window, part.row0 - top, part.row1 - top, weights, spare
    )
    symmetry = symmetries[placement.symmetry]
    source_row, source_column = placement.source_row >> 4, placement.source_column >> 4
    right = part.column0 - placement.column
    for row in range(part.row0, part.row1):
        down = row - placement.row
        _blend_row(
            canvas[row - first_row, part.column0 * channels : part.column1 * channels],
            exemplar,
            source_row + symmetry[0] * down + symmetry[1] * right,
            source_column + symmetry[2] * down + symmetry[3] * right,
            (symmetry[1], symmetry[3]),
            weights[row - top - first_i, part.column0 - left - first_j : part.column1 - left - first_j],
        )


@kernel
def paint_strip(
    placements: Any,
    cells: NDArray[np.uint8],
    exemplar: PixelArray,
    channels: int,
    symmetries: NDArray[np.int64],
    scratch: NDArray[np.int32],
    first_row: int,
    tall: int,
    canvas: PixelArray,
    out: PixelArray,
) -> None:
    """Paint placements on some rows of a chart of `tall` rows, from `first_row` on, into `out`.

    `canvas` is scratch of the same shape (rows, columns · channels), in the canvas dtype; `scratch` is
    (2, `weight_rows`, width of the widest placement).
    """
    columns = out.shape[1] // channels
    for i in range(canvas.shape[0]):
        line = canvas[i]
        for x in range(line.shape[0]):
            line[x] = 0
    for n in range(placements.shape[0]):
        placement = placements[n]
        window = mask_window(placement, tall, columns) if placement.mask == 2 else (0, 0, 0, 0)
        lay_placement(
            canvas,
            first_row,
            columns,
            placement,
            cells,
            window,
            exemplar,
            channels,
            symmetries,
            scratch[0],
            scratch[1],
        )
    for i in range(canvas.shape[0]):
        source, line = canvas[i], out[i]
        for x in range(line.shape[0]):
            line[x] = _settle(source[x])


@kernel
def trace_owners(
    placements: Any,
    cells: NDArray[np.uint8],
    sizes: tuple[int, int, int, int],
    scratch: NDArray[np.int32],
    owners: NDArray[np.int32],
) -> None:
    """Write to `owners` which of a chart's placements gives each texel most of its colour.

    That is the last one that covers the texel with at least half of the weight; -1 where none does. `sizes`:
    the chart's height and width, and the row and column of the first texel of `owners` (rows, columns).
    """
    tall, wide, first_row, first_column = sizes
    weights, spare = scratch[0], scratch[1]
    for row in range(owners.shape[0]):
        for column in range(owners.shape[1]):
            owners[row, column] = -1
    for n in range(placements.shape[0]):
        placement = placements[n]
        window = mask_window(placement, tall, wide) if placement.mask == 2 else (0, 0, 0, 0)
        top, left = placement.row - placement.height // 2, placement.column - placement.width // 2
        row0, row1 = max(top, first_row), min(top + placement.height, first_row + owners.shape[0])
        column0, column1 = (
            max(left, first_column),
            min(left + placement.width, first_column + owners.shape[1]),
        )
        if row0 >= row1 or column0 >= column1:
            continue
        first_i, first_j = fill_weights(placement, cells, window, row0 - top, row1 - top, weights, spare)
        for row in range(row0, row1):
            for column in range(column0, column1):
                if weights[row - top - first_i, column - left - first_j] >= 128:
                    owners[row - first_row, column - first_column] = n
