"""From laid blocks to placements: each settled sheet's rectangle and the cells of its mask, on the charts."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.methods.quilt.mesh._frame_kernels import Canvases
from upholster.methods.quilt.mesh._sheet_kernels import MOST_SHEETS, FieldArrays, shown_at
from upholster.methods.quilt.mesh._unfold_kernels import MeshArrays
from upholster.types import FloatArray, IntArray, int64

__all__ = ["SHEET", "MaskNumbers", "mask_sheets"]

_OVER = 1.0
"""Cells that are painted beyond a sheet where the mesh goes on. More would cover what lies there, less leaves
gaps."""

SHEET = 8
"""Numbers of a sheet's placement: block, chart, row, column, height, width, first cell, sheet."""


class MaskNumbers(NamedTuple):
    """Sizes: final texels per working texel, of a mask's cell, largest side; frame and its cells.

    `gutter` final texels beyond the mesh are painted, too; where the mesh goes on, cells near the sheet only.
    """

    texels: float
    cell: int
    largest: int
    gutter: float
    frame: int
    frame_cell: int


@inline
def _boxes(
    mesh: MeshArrays,
    triangles: IntArray,
    sheets: IntArray,
    first: int,
    stop: int,
    numbers: MaskNumbers,
    boxes: FloatArray,
) -> None:
    # Of each sheet its least and greatest rows and columns, in final texels, with what is painted beyond.
    for m in range(boxes.shape[0]):
        boxes[m, 0], boxes[m, 1], boxes[m, 2], boxes[m, 3] = 1e30, 1e30, -1e30, -1e30
    for n in range(first, stop):
        if sheets[n] < 0:
            continue
        box = boxes[sheets[n]]
        for k in range(3):
            for axis in range(2):
                place = (mesh.places[triangles[n], k, axis] + 0.5) * numbers.texels - 0.5
                box[axis], box[2 + axis] = min(box[axis], place), max(box[2 + axis], place)
    for m in range(boxes.shape[0]):
        for axis in range(2):
            boxes[m, axis] -= numbers.gutter + numbers.cell
            boxes[m, 2 + axis] += numbers.gutter + numbers.cell


@inline
def _side(centre: int, low: float, high: float, size: int, cell: int) -> Any:
    # The side of a rectangle about `centre` that holds what lies between, on the chart: a multiple of `cell`.
    reach = max(centre - max(low, 0.0), min(high, size - 1.0) - centre, 1.0)
    half = (int64(reach) + cell) // cell + 1
    return 2 * half * cell


@inline
def _fill(
    mesh: MeshArrays,
    canvases: Canvases,
    field: FieldArrays,
    triangles: IntArray,
    sheets: IntArray,
    first: int,
    stop: int,
    numbers: MaskNumbers,
    fit: FloatArray,
    sheet: int,
    mask: NDArray[np.uint8],
    low: tuple[int, int],
    columns: int,
    cells: NDArray[np.uint8],
) -> Any:
    # Fills a sheet's mask, `columns` cells wide: cells near its triangles, new where the frame's mask is
    # there. Returns how many are new.
    cell, scale, rows = numbers.cell, numbers.texels, cells.shape[0] // columns
    close, near = (_OVER * cell) ** 2, (0.71 * cell + numbers.gutter) ** 2
    chart = int64(fit[1])
    canvas, wide = canvases.firsts[chart], canvases.widths[chart]
    across, half = numbers.frame // numbers.frame_cell, numbers.frame // 2
    for at in range(cells.shape[0]):
        cells[at] = 0
    filled = int64(0)
    middle = 0.5 * cell - 0.5
    for n in range(first, stop):
        if sheets[n] != sheet:
            continue
        p = mesh.places[triangles[n]]
        r0, c0 = (p[0, 0] + 0.5) * scale - 0.5, (p[0, 1] + 0.5) * scale - 0.5
        y1, x1 = (p[1, 0] - p[0, 0]) * scale, (p[1, 1] - p[0, 1]) * scale
        y2, x2 = (p[2, 0] - p[0, 0]) * scale, (p[2, 1] - p[0, 1]) * scale
        area = y1 * x2 - x1 * y2
        if area <= 1e-12:
            continue
        reach = numbers.gutter + cell
        top = r0 + min(0.0, y1, y2) - reach - low[0]
        bottom, left = r0 + max(0.0, y1, y2) + reach - low[0], c0 + min(0.0, x1, x2) - reach - low[1]
        right = c0 + max(0.0, x1, x2) + reach - low[1]
        i0, i1 = max(int64(np.floor(top / cell)), 0), min(int64(bottom / cell) + 1, rows)
        j0, j1 = max(int64(np.floor(left / cell)), 0), min(int64(right / cell) + 1, columns)
        for i in range(i0, i1):
            for j in range(j0, j1):
                at = i * columns + j
                if cells[at]:
                    continue
                row, column = low[0] + i * cell + middle, low[1] + j * cell + middle
                y, x = row - r0, column - c0
                b, d = max((y * x2 - x * y2) / area, 0.0), max((y1 * x - x1 * y) / area, 0.0)
                if b + d > 1.0:
                    b, d = b / (b + d), d / (b + d)
                y, x = y - b * y1 - d * y2, x - b * x1 - d * x2
                if y * y + x * x > near:
                    continue
                working = (row + 0.5) / scale - 0.5, (column + 0.5) / scale - 0.5
                if y * y + x * x > close:
                    r = min(max(int64(np.floor(working[0] + 0.5)), 0), canvases.heights[chart] - 1)
                    c = min(max(int64(np.floor(working[1] + 0.5)), 0), wide - 1)
                    if canvases.triangles[canvas + r * wide + c] >= 0:
                        continue
                shown = shown_at(field, fit, working[0], working[1])
                a, e = int64(np.floor(shown[0] + 0.5)) + half, int64(np.floor(shown[1] + 0.5)) + half
                if 0 <= a < numbers.frame and 0 <= e < numbers.frame:
                    new = mask[a // numbers.frame_cell * across + e // numbers.frame_cell]
                    cells[at] = new
                    filled += new
    return filled


@kernel
def mask_sheets(
    mesh: MeshArrays,
    canvases: Canvases,
    field: FieldArrays,
    shapes: NDArray[np.int64],
    numbers: MaskNumbers,
    laid: NDArray[np.int64],
    order: NDArray[np.int64],
    part: tuple[int, int],
    footprint: tuple[NDArray[np.int64], IntArray, NDArray[np.float32], IntArray, NDArray[np.uint8]],
    fits: FloatArray,
    masks: NDArray[np.uint8],
    boxes: FloatArray,
    out: NDArray[np.int64],
    cells: NDArray[np.uint8],
    filled: NDArray[np.int64],
) -> int:
    """Make the placements of some laid blocks, from, to; return the first block for which there was no room.

    `laid` (n,) are blocks in the order in which they were laid, and `order` tells which of the footprint's
    each one is; `shapes` (charts, 2) the final charts' sizes; `fits` as `fit_sheets` left them. `out` (m,
    `SHEET`) receives placements and `cells` their masks, one after another; `filled` (2,) says how many of
    each there are, before and after. `boxes` (`MOST_SHEETS`, 4) is scratch.
    """
    firsts, triangles, _, sheets, _ = footprint
    for at in range(part[0], part[1]):
        n = laid[at]
        first, stop = firsts[order[n]], firsts[order[n] + 1]
        _boxes(mesh, triangles, sheets, first, stop, numbers, boxes)
        count, end = filled[0], filled[1]
        for m in range(MOST_SHEETS):
            fit = fits[order[n], m]
            if fit[0] != 1.0 or boxes[m, 0] > boxes[m, 2]:
                continue
            chart = int64(fit[1])
            # The mask's cells are those of the label map.
            row = int64(np.rint((fit[2] + 0.5) * numbers.texels / numbers.cell)) * numbers.cell
            column = int64(np.rint((fit[3] + 0.5) * numbers.texels / numbers.cell)) * numbers.cell
            tall, wide = shapes[chart, 0], shapes[chart, 1]
            height = _side(row, boxes[m, 0], boxes[m, 2], tall, numbers.cell)
            width = _side(column, boxes[m, 1], boxes[m, 3], wide, numbers.cell)
            if height > numbers.largest or width > numbers.largest:
                continue
            low = (row - height // 2, column - width // 2)
            size = height // numbers.cell * (width // numbers.cell)
            if count == out.shape[0] or end + size > cells.shape[0]:
                return at
            new = _fill(
                mesh,
                canvases,
                field,
                triangles,
                sheets,
                first,
                stop,
                numbers,
                fit,
                m,
                masks[n],
                low,
                width // numbers.cell,
                cells[end : end + size],
            )
            if new == 0:
                continue
            out[count, 0], out[count, 1], out[count, 2], out[count, 3] = n, chart, row, column
            out[count, 4], out[count, 5], out[count, 6], out[count, 7] = height, width, end, m
            count += 1
            end += size
        filled[0], filled[1] = count, end
    return part[1]
