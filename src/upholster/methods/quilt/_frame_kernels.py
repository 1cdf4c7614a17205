"""Frames: the squares of pixels in which blocks are chosen and cut, and the canvases on which they lie.

What is laid under a block is drawn into its frame; there a source is chosen and cut as on a flat texture; then
the block's new steps are written to the canvases of all charts that it reaches.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.methods.quilt._block_kernels import SYMMETRY, FramePixels, LayNumbers
from upholster.methods.quilt._sheet_kernels import MISFIT
from upholster.methods.quilt._unfold_kernels import Footprint, MeshArrays
from upholster.quilt.placement import SYMMETRIES
from upholster.types import FloatArray, IntArray, int64

__all__ = ["Canvases", "locate_steps", "look_at_frame", "nearest_steps", "write_frame"]

KEPT = 3
"""Marks of a frame's pixel that is laid and stays."""

_NONE = 6
"""Marks of a frame's pixel beside the surface: not to change, nothing there."""

KEPT = 3
"""Marks of a pixel that is laid and stays."""

_WORSE = 1 | 1 << 4
"""Marks of a frame's pixel, with its rim, that is laid, and that the block shows truer."""

_TRUER = 5
"""A block is truer than what is laid if its misfit is less than so many eighths of that."""

_RIM = 8
"""A block takes nothing in such a part of its side from its rim: the cut against what stays needs room."""

_CLOSE = 0.75
"""Texels: a texel so near to a triangle belongs to it."""


class Canvases(NamedTuple):
    """The charts' steps, one chart after another: step (r, c) of chart k at ``firsts[k] + r·widths[k] + c``.

    `owners` is the block that shows there, −1 for none, `sheets` on which of its sheets, `sources` which pixel of
    the exemplar that is, row · width + column, and `shown` (steps, 2) where in the block, in 1/16 frame pixel from
    its centre. `misfits` is that of its triangle there; `triangles` in which triangle a step's middle lies, or
    right beside it, −1 for none. `heights` and `widths` are the charts'.
    """

    owners: IntArray
    sheets: NDArray[np.uint8]
    sources: IntArray
    shown: NDArray[np.int16]
    misfits: NDArray[np.uint8]
    triangles: IntArray
    firsts: NDArray[np.int64]
    heights: NDArray[np.int64]
    widths: NDArray[np.int64]


@inline
def _clamped(b: float, c: float) -> tuple[float, float]:
    # The barycentric coordinates of a place near a triangle, brought into it.
    b, c = max(b, 0.0), max(c, 0.0)
    total = b + c
    return (b / total, c / total) if total > 1.0 else (b, c)


@inline
def _bounds(a: float, b: float, c: float, beyond: float, size: int) -> tuple[int, int]:
    # Which whole numbers lie between three numbers, and at most `beyond` outside them: from, to.
    low = int64(np.ceil(min(a, b, c) - beyond))
    return max(low, 0), min(int64(np.floor(max(a, b, c) + beyond)) + 1, size)


@kernel
def locate_steps(mesh: MeshArrays, canvases: Canvases, away: NDArray[np.float32]) -> None:
    """Write to `triangles` in which triangle each step's middle lies, or to which it is nearest and close.

    `away` (steps,) is scratch, infinite at first.
    """
    for t in range(mesh.triangles.shape[0]):
        k = int64(mesh.chart[t])
        if k < 0:
            continue
        p = mesh.places[t]
        y1, x1, y2, x2 = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
        area = y1 * x2 - x1 * y2
        if area <= 1e-12:
            continue
        top, bottom = _bounds(p[0, 0], p[1, 0], p[2, 0], _CLOSE, canvases.heights[k])
        left, right = _bounds(p[0, 1], p[1, 1], p[2, 1], _CLOSE, canvases.widths[k])
        for r in range(top, bottom):
            for c in range(left, right):
                y, x = r - p[0, 0], c - p[0, 1]
                b0, d0 = (y * x2 - x * y2) / area, (y1 * x - x1 * y) / area
                b, d = _clamped(b0, d0)
                away_y, away_x = y - b * y1 - d * y2, x - b * x1 - d * x2
                far = np.float32(away_y * away_y + away_x * away_x)
                at = canvases.firsts[k] + r * canvases.widths[k] + c
                if far <= _CLOSE * _CLOSE and far < away[at]:
                    away[at] = far
                    canvases.triangles[at] = t


@kernel
def nearest_steps(
    canvases: Canvases,
    chart: int,
    wanted: NDArray[np.uint8],
    bare: bool,
    step: float,
    shift: float,
    grid: NDArray[np.int64],
    away: FloatArray,
    found: IntArray,
) -> None:
    """Find in each square of a chart the step on the surface that lies nearest to its middle.

    Squares are `step` steps wide; the first one's middle is at `shift` on the chart. `grid` (3, 2) is the
    chart's step with which the canvas begins, the first square that is looked at, and the chart's last one. Of
    the steps in triangles that are `wanted` (T,), or if `bare` of those that no block shows. `away` and `found`
    (rows, columns) receive its squared distance and the step's number on the canvas, −1 for none.
    """
    first, width = canvases.firsts[chart], canvases.widths[chart]
    away[:], found[:] = np.inf, -1
    for r in range(canvases.heights[chart]):
        i = min(max(int64((r + grid[0, 0] - shift) / step + 0.5), 0), grid[2, 0])
        y = r + grid[0, 0] - shift - i * step
        i -= grid[1, 0]
        for c in range(width):
            at = first + r * width + c
            t = canvases.triangles[at]
            if t < 0 or wanted[t] == 0 or (bare and canvases.owners[at] >= 0):
                continue
            j = min(max(int64((c + grid[0, 1] - shift) / step + 0.5), 0), grid[2, 1])
            x = c + grid[0, 1] - shift - j * step
            j -= grid[1, 1]
            if y * y + x * x < away[i, j]:
                away[i, j] = y * y + x * x
                found[i, j] = r * width + c


@inline
def _keep_off(row: int, column: int, margin: int, marks: NDArray[np.uint8]) -> None:
    # Something is laid right beyond a place of the frame, which the block does not reach: what is laid beside
    # that place stays, and what is bare up to `margin` pixels from it, but for the frame's middle, is left to
    # a block that reaches over it.
    size = marks.shape[0]
    half, free, reach = size // 2, size // 4, max(margin, 1)
    for i in range(max(row - reach, 0), min(row + reach + 1, size)):
        for j in range(max(column - reach, 0), min(column + reach + 1, size)):
            away = max(abs(i - row), abs(j - column))
            if marks[i, j] == 1 and away <= 1:
                marks[i, j] = KEPT
            elif marks[i, j] == 0 and away <= margin and max(abs(i - half), abs(j - half)) > free:
                marks[i, j] = _NONE


@inline
def _mind_rim(covered: NDArray[np.uint8], margin: int, marks: NDArray[np.uint8]) -> None:
    # Keeps off the frame's rim where something is laid right beyond it; room is needed only where the block
    # would end there, with nothing laid under its rim to cut against.
    size = marks.shape[0]
    for n in range(size):
        if covered[0, n + 1] & 1:
            _keep_off(-1, n, margin if covered[1, n + 1] == 0 else 0, marks)
        if covered[size + 1, n + 1] & 1:
            _keep_off(size, n, margin if covered[size, n + 1] == 0 else 0, marks)
        if covered[n + 1, 0] & 1:
            _keep_off(n, -1, margin if covered[n + 1, 1] == 0 else 0, marks)
        if covered[n + 1, size + 1] & 1:
            _keep_off(n, size, margin if covered[n + 1, size] == 0 else 0, marks)


@inline
def _is_laid_beyond(mesh: MeshArrays, canvases: Canvases, across: int, share: float) -> Any:
    # Whether something is laid a texel from a place of an edge inside a triangle.
    t, k = across // 3, across % 3
    p, m, w = mesh.places[t], (k + 1) % 3, (k + 2) % 3
    y, x = p[m, 0] + share * (p[k, 0] - p[m, 0]), p[m, 1] + share * (p[k, 1] - p[m, 1])
    away_y, away_x = p[w, 0] - y, p[w, 1] - x
    step = min(1.0 / max(np.sqrt(away_y * away_y + away_x * away_x), 1e-9), 0.5)
    chart = int64(mesh.chart[t])
    r = min(max(int64(np.floor(y + step * away_y + 0.5)), 0), canvases.heights[chart] - 1)
    c = min(max(int64(np.floor(x + step * away_x + 0.5)), 0), canvases.widths[chart] - 1)
    return canvases.owners[canvases.firsts[chart] + r * canvases.widths[chart] + c] >= 0


@inline
def _mind_ends(
    mesh: MeshArrays,
    canvases: Canvases,
    found: Footprint,
    count: int,
    inside: NDArray[np.uint8],
    margin: int,
    marks: NDArray[np.uint8],
) -> None:
    # Keeps off the edges where the footprint ends, though the surface goes on, and something is laid beyond.
    size = marks.shape[0]
    half = size // 2
    for n in range(count):
        if found.sheets[n] < 0:
            continue
        u, t = found.maps[n], found.triangles[n]
        for k in range(3):
            across, m = mesh.neighbours[t, k], (k + 1) % 3
            if across < 0 or inside[across // 3] or mesh.chart[across // 3] < 0:
                continue
            if max(u[k, 0], u[m, 0]) < -half - 2 or min(u[k, 0], u[m, 0]) > half + 1:
                continue
            if max(u[k, 1], u[m, 1]) < -half - 2 or min(u[k, 1], u[m, 1]) > half + 1:
                continue
            y, x = u[m, 0] - u[k, 0], u[m, 1] - u[k, 1]
            places = int64(np.sqrt(y * y + x * x)) + 1
            for step in range(places):
                share = (step + 0.5) / places
                i = int64(np.floor(u[k, 0] + share * y + 0.5)) + half
                j = int64(np.floor(u[k, 1] + share * x + 0.5)) + half
                if -2 < i <= size and -2 < j <= size and _is_laid_beyond(mesh, canvases, across, share):
                    _keep_off(i, j, margin, marks)


@inline
def _compared(before: int, now: int, takes: bool) -> int:
    # What a laid pixel is to a block, by their misfits: it stays where it is much truer, and the block's is
    # off; the block takes it where it is off by twice as much, and the block's is much truer: what is taken
    # is cut anew, and that shows at seams. Else the cut decides.
    if now > MISFIT and 8 * before < _TRUER * now:
        return KEPT
    if takes and before > 2 * MISFIT and 8 * now < _TRUER * before:
        return _WORSE
    return 1


@inline
def _draw(
    canvases: Canvases,
    image: NDArray[np.int32],
    records: IntArray,
    found: Footprint,
    n: int,
    inside: NDArray[np.uint8],
    covered: NDArray[np.uint8],
    sources: IntArray,
    pixels: FramePixels,
    symmetries: NDArray[np.int64],
) -> None:
    # Draws into the frame what is laid under one triangle of a block.
    size = covered.shape[0] - 2
    half, rim = size // 2 + 1, size // _RIM
    u, p, t, k = found.maps[n], found.places[n], int64(found.triangles[n]), int64(found.charts[n])
    y1, x1, y2, x2 = u[1, 0] - u[0, 0], u[1, 1] - u[0, 1], u[2, 0] - u[0, 0], u[2, 1] - u[0, 1]
    area = y1 * x2 - x1 * y2
    if abs(area) < 1e-9:
        return
    top, bottom = _bounds(u[0, 0] + half, u[1, 0] + half, u[2, 0] + half, 0.0, size + 2)
    left, right = _bounds(u[0, 1] + half, u[1, 1] + half, u[2, 1] + half, 0.0, size + 2)
    for i in range(top, bottom):
        for j in range(left, right):
            y, x = i - half - u[0, 0], j - half - u[0, 1]
            b, d = (y * x2 - x * y2) / area, (y1 * x - x1 * y) / area
            if b < -1e-9 or d < -1e-9 or b + d > 1.0 + 1e-9:
                continue
            r = int64(np.floor(p[0, 0] + b * (p[1, 0] - p[0, 0]) + d * (p[2, 0] - p[0, 0]) + 0.5))
            c = int64(np.floor(p[0, 1] + b * (p[1, 1] - p[0, 1]) + d * (p[2, 1] - p[0, 1]) + 0.5))
            if t >= 0:  # what is unfolded lies on the chart
                r, c = min(max(r, 0), canvases.heights[k] - 1), min(max(c, 0), canvases.widths[k] - 1)
            elif r < 0 or c < 0 or r >= canvases.heights[k] or c >= canvases.widths[k]:
                continue
            at = canvases.firsts[k] + r * canvases.widths[k] + c
            there = canvases.triangles[at]
            if there < 0 or (t >= 0 and there != t and inside[there] == 0):
                continue
            owner = canvases.owners[at]
            covered[i, j] = 0
            if owner >= 0:
                inner = rim < i <= size - rim and rim < j <= size - rim
                covered[i, j] = _compared(int64(canvases.misfits[at]), int64(found.misfits[n]), inner)
                if 0 < i <= size and 0 < j <= size:
                    sources[i - 1, j - 1] = canvases.sources[at]
                    pixels.old[i - 1, j - 1] = image[canvases.sources[at]]
                    symmetries[records[owner, SYMMETRY]] += 1


@inline
def look_at_frame(
    mesh: MeshArrays,
    canvases: Canvases,
    image: NDArray[np.int32],
    records: IntArray,
    found: Footprint,
    count: int,
    margin: int,
    inside: NDArray[np.uint8],
    covered: NDArray[np.uint8],
    sources: IntArray,
    pixels: FramePixels,
    symmetries: NDArray[np.int64],
) -> tuple[int, int]:
    """Draw into a frame what is laid under a block; return how many of its pixels are laid, how many bare.

    Bare are those on the surface where nothing is, but for what is left to other blocks. `covered` is the frame
    with a rim of one pixel, `symmetries` (8,) receives how many pixels show each. What is laid and much truer to
    the field than the block stays; what is much less true counts as neither laid nor bare, but goes.
    """
    size = covered.shape[0] - 2
    covered[:, :], symmetries[:] = _NONE, 0
    for n in range(count):
        if found.triangles[n] >= 0:
            inside[found.triangles[n]] = found.sheets[n] >= 0
    for n in range(count):
        if found.sheets[n] >= 0:
            _draw(canvases, image, records, found, n, inside, covered, sources, pixels, symmetries)
    for i in range(size):
        for j in range(size):
            pixels.marks[i, j] = covered[i + 1, j + 1] if covered[i + 1, j + 1] != _WORSE else 0
    _mind_rim(covered, margin, pixels.marks)
    if found.triangles[0] >= 0:
        _mind_ends(mesh, canvases, found, count, inside, margin, pixels.marks)
    for n in range(count):
        if found.triangles[n] >= 0:
            inside[found.triangles[n]] = 0
    laid, bare = int64(0), int64(0)
    for i in range(size):
        for j in range(size):
            laid += pixels.marks[i, j] & 5 == 1
            bare += pixels.marks[i, j] == 0 and covered[i + 1, j + 1] == 0
    return laid, bare


@inline
def write_frame(
    canvases: Canvases,
    numbers: LayNumbers,
    block: int,
    record: IntArray,
    mask: NDArray[np.uint8],
    found: Footprint,
    count: int,
) -> None:
    """Write a block's new steps to the canvases of the charts that it reaches."""
    size, cell = numbers.size, numbers.cell
    half, across = size // 2, size // cell
    turn = SYMMETRIES[record[SYMMETRY]]
    for n in range(count):
        if found.sheets[n] < 0:
            continue
        u, p, t, k = found.maps[n], found.places[n], int64(found.triangles[n]), int64(found.charts[n])
        y1, x1, y2, x2 = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
        area = y1 * x2 - x1 * y2
        if area <= 1e-12:
            continue
        beyond = _CLOSE if t >= 0 else 0.0
        top, bottom = _bounds(p[0, 0], p[1, 0], p[2, 0], beyond, canvases.heights[k])
        left, right = _bounds(p[0, 1], p[1, 1], p[2, 1], beyond, canvases.widths[k])
        for r in range(top, bottom):
            for c in range(left, right):
                at = canvases.firsts[k] + r * canvases.widths[k] + c
                if canvases.triangles[at] < 0 or (t >= 0 and canvases.triangles[at] != t):
                    continue
                y, x = r - p[0, 0], c - p[0, 1]
                b, d = (y * x2 - x * y2) / area, (y1 * x - x1 * y) / area
                if t >= 0:
                    b, d = _clamped(b, d)
                elif b < -1e-9 or d < -1e-9 or b + d > 1.0 + 1e-9:
                    continue
                shown_y = u[0, 0] + b * (u[1, 0] - u[0, 0]) + d * (u[2, 0] - u[0, 0])
                shown_x = u[0, 1] + b * (u[1, 1] - u[0, 1]) + d * (u[2, 1] - u[0, 1])
                down, along = int64(np.floor(shown_y + 0.5)), int64(np.floor(shown_x + 0.5))
                i, j = down + half, along + half
                if i < 0 or j < 0 or i >= size or j >= size or mask[i // cell * across + j // cell] == 0:
                    continue
                row = min(max(record[0] + turn[0] * down + turn[1] * along, 0), numbers.height - 1)
                column = min(max(record[1] + turn[2] * down + turn[3] * along, 0), numbers.width - 1)
                canvases.owners[at] = block
                canvases.sheets[at] = found.sheets[n]
                canvases.sources[at] = row * numbers.width + column
                canvases.shown[at, 0] = int64(np.floor(16.0 * shown_y + 0.5))
                canvases.shown[at, 1] = int64(np.floor(16.0 * shown_x + 0.5))
                canvases.misfits[at] = found.misfits[n]
