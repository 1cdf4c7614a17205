"""Frames: the squares of pixels in which blocks are chosen and cut, and the canvases on which they are laid.

The blocks that are laid under a new one are drawn into its frame. There a source is chosen and cut as on a
flat texture. Then the block's new steps are written to the canvases of all charts that it reaches.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.charts._step_kernels import CLOSE, bounds, clamped
from upholster.quilt.placement import SYMMETRIES
from upholster.runtime.jit import inline, kernel
from upholster.synthesis.quilt.kernels._block_kernels import (
    PHASE,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
    CourseRule,
    FramePixels,
    LayNumbers,
    MatchImage,
)
from upholster.synthesis.quilt.kernels._unfold_kernels import Footprint

__all__ = [
    "BESIDE",
    "FIXED",
    "KEPT_SHEET",
    "LAID",
    "Canvases",
    "bound_places",
    "keep_to_course",
    "look_at_frame",
    "nearest_steps",
    "write_frame",
]

LAID, BESIDE, FIXED = 1, 2, 8
"""Marks of a frame's pixel: a block is laid there; the pixel is off the surface or the footprint; and, with
`LAID`, the laid block must not change there. 0: bare."""

KEPT_SHEET = 255
"""On a canvas, the sheet of kept steps, which show another quilt and no block of this run."""


class Canvases(NamedTuple):
    """The charts' steps, one chart after another: step (r, c) of chart k at ``firsts[k] + r·widths[k] + c``.

    `owners` is the block that each step shows, −1 for none, `sheets` is the sheet of that block, and
    `sources` the pixel of the exemplar, row · width + column; at bare steps the pixel that they showed before
    they are laid again, −1 for none. `triangles` is the triangle that contains the
    step's centre or is right next to it, −1 for none. `heights` and `widths` are the charts' sizes. The first
    `fixed` blocks do not change. `wanted` (K, steps) are the values that guides request, 0 without a request,
    and `zones` (steps,) is the requested zone of the exemplar, 0 for any; (0,): there are no zones.
    """

    owners: IntArray
    sheets: NDArray[np.uint8]
    sources: IntArray
    triangles: IntArray
    firsts: NDArray[np.int64]
    heights: NDArray[np.int64]
    widths: NDArray[np.int64]
    fixed: int
    wanted: NDArray[np.uint8]
    zones: NDArray[np.uint8]


@kernel
def bound_places(chart: IntArray, places: FloatArray, low: FloatArray, high: FloatArray) -> None:
    """Write the least and the greatest row and column (charts, 2) of the places (T, 3, 2) on each chart.

    ``low > high`` for charts without places.
    """
    low[:, :], high[:, :] = np.inf, -np.inf
    for t in range(places.shape[0]):
        n = chart[t]
        if n < 0:
            continue
        for k in range(3):
            for axis in range(2):
                low[n, axis] = min(low[n, axis], places[t, k, axis])
                high[n, axis] = max(high[n, axis], places[t, k, axis])


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
    """Find in each square of a chart the step on the surface nearest to the square's middle.

    Squares are `step` steps wide; the first one's middle is at `shift` on the chart. `grid` (3, 2) is the
    chart's step where the canvas begins, the first square of the search, and the chart's last square.
    Candidates are the steps in triangles that are `wanted` (T,), and with `bare` only those without a block.
    `away` and `found` (rows, columns) receive the squared distance and the step's number on the canvas, −1
    for none.
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
def _ask(canvases: Canvases, match: MatchImage, pixels: FramePixels) -> None:
    # Enters the requests at the frame's pixels, and the cost of the laid pixels by them.
    size = pixels.steps.shape[0]
    for i in range(size):
        for j in range(size):
            at, off = pixels.steps[i, j], np.int32(0)
            if at < 0:
                continue
            if pixels.zones.shape[0]:
                pixels.zones[i, j] = canvases.zones[at]
            for k in range(pixels.wanted.shape[0]):
                wanted = canvases.wanted[k, at]
                pixels.wanted[k, i, j] = wanted
                if wanted > 0 and canvases.owners[at] >= 0:
                    off += match.costs[k, abs(int64(match.guides[k, canvases.sources[at]]) - int64(wanted))]
            if pixels.off.shape[0]:
                pixels.off[i, j] = off


@inline
def _draw(
    canvases: Canvases,
    match: MatchImage,
    records: IntArray,
    found: Footprint,
    n: int,
    inside: NDArray[np.uint8],
    covered: NDArray[np.uint8],
    pixels: FramePixels,
    symmetries: NDArray[np.int64],
) -> None:
    # Draws the blocks that are laid under one triangle of a block into the frame.
    size = covered.shape[0] - 2
    half = size // 2 + 1
    u, p, t, k = found.maps[n], found.places[n], int64(found.triangles[n]), int64(found.charts[n])
    y1, x1, y2, x2 = u[1, 0] - u[0, 0], u[1, 1] - u[0, 1], u[2, 0] - u[0, 0], u[2, 1] - u[0, 1]
    area = y1 * x2 - x1 * y2
    if abs(area) < 1e-9:
        return
    top, bottom = bounds(u[0, 0] + half, u[1, 0] + half, u[2, 0] + half, 0.0, size + 2)
    left, right = bounds(u[0, 1] + half, u[1, 1] + half, u[2, 1] + half, 0.0, size + 2)
    for i in range(top, bottom):
        for j in range(left, right):
            y, x = i - half - u[0, 0], j - half - u[0, 1]
            b, d = (y * x2 - x * y2) / area, (y1 * x - x1 * y) / area
            if b < -1e-9 or d < -1e-9 or b + d > 1.0 + 1e-9:
                continue
            r = int64(np.floor(p[0, 0] + b * (p[1, 0] - p[0, 0]) + d * (p[2, 0] - p[0, 0]) + 0.5))
            c = int64(np.floor(p[0, 1] + b * (p[1, 1] - p[0, 1]) + d * (p[2, 1] - p[0, 1]) + 0.5))
            if t >= 0:  # unfolded triangles are on the chart
                r, c = min(max(r, 0), canvases.heights[k] - 1), min(max(c, 0), canvases.widths[k] - 1)
            elif r < 0 or c < 0 or r >= canvases.heights[k] or c >= canvases.widths[k]:
                continue
            at = canvases.firsts[k] + r * canvases.widths[k] + c
            there = canvases.triangles[at]
            if there < 0 or (t >= 0 and there != t and inside[there] == 0):
                continue
            owner = canvases.owners[at]
            covered[i, j] = 0 if owner < 0 else LAID if owner >= canvases.fixed else LAID | FIXED
            if 0 < i <= size and 0 < j <= size:
                pixels.steps[i - 1, j - 1] = at
                if owner >= 0:
                    pixels.old[i - 1, j - 1] = match.image[canvases.sources[at]]
                    symmetries[records[owner, SYMMETRY]] += 1


@inline
def look_at_frame(
    canvases: Canvases,
    match: MatchImage,
    records: IntArray,
    found: Footprint,
    count: int,
    inside: NDArray[np.uint8],
    covered: NDArray[np.uint8],
    pixels: FramePixels,
    symmetries: NDArray[np.int64],
) -> tuple[int, int]:
    """Draw the blocks under a block into its frame; return the number of laid and of bare pixels.

    Bare pixels are on the surface and show no block. `covered` is the frame with a rim of one pixel,
    `symmetries` (8,) receives the number of pixels with each symmetry. `inside` (triangles,) is scratch,
    all 0.
    """
    size = covered.shape[0] - 2
    covered[:, :], symmetries[:] = BESIDE, 0
    pixels.wanted[:, :, :], pixels.zones[:, :], pixels.steps[:, :] = 0, 0, -1
    for n in range(count):
        if found.triangles[n] >= 0:
            inside[found.triangles[n]] = found.sheets[n] >= 0
    for n in range(count):
        if found.sheets[n] >= 0:
            _draw(canvases, match, records, found, n, inside, covered, pixels, symmetries)
    for n in range(count):
        if found.triangles[n] >= 0:
            inside[found.triangles[n]] = 0
    if pixels.wanted.shape[0] or pixels.zones.shape[0]:
        _ask(canvases, match, pixels)
    laid, bare = int64(0), int64(0)
    for i in range(size):
        for j in range(size):
            mark = covered[i + 1, j + 1]
            pixels.marks[i, j] = mark
            laid += mark & LAID
            bare += mark == 0
    return laid, bare


@inline
def _place_in_course(course: CourseRule, record: IntArray) -> Any:
    # Where a block's centre is in its course, 0 to 1 from joint to joint.
    place = (course.first * record[PHASE] + course.second * record[PHASE + 1]) / 65536.0 - course.joint
    return place - np.floor(place)


@inline
def _is_beyond(course: CourseRule, place: float, down: int, right: int, laid: Any) -> Any:
    # Whether a pixel of a frame is beyond the block's course; `place` is that of the centre.
    here, spare = place + course.down * down + course.right * right, 0.0 if laid else course.spare
    return here < -spare or here > 1.0 + spare


@inline
def keep_to_course(
    numbers: LayNumbers, record: IntArray, covered: NDArray[np.uint8], pixels: FramePixels
) -> tuple[int, int]:
    """Mark what is beyond a block's course as off the footprint; return how many pixels are laid and bare."""
    place, size = _place_in_course(numbers.course, record), numbers.size
    laid, bare = int64(0), int64(0)
    for i in range(size + 2):
        for j in range(size + 2):
            down, right = i - size // 2 - 1, j - size // 2 - 1
            if _is_beyond(numbers.course, place, down, right, covered[i, j] & LAID):
                covered[i, j] = BESIDE
            if 0 < i <= size and 0 < j <= size:
                pixels.marks[i - 1, j - 1] = covered[i, j]
                laid += covered[i, j] & LAID
                bare += covered[i, j] == 0
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
    slips, place = numbers.course.spare > 0.0, _place_in_course(numbers.course, record)
    turn, source_row, source_column = SYMMETRIES[record[SYMMETRY]], record[SOURCE_ROW], record[SOURCE_COLUMN]
    for n in range(count):
        if found.sheets[n] < 0:
            continue
        u, p, t, k = found.maps[n], found.places[n], int64(found.triangles[n]), int64(found.charts[n])
        y1, x1, y2, x2 = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
        area = y1 * x2 - x1 * y2
        if area <= 1e-12:
            continue
        beyond = CLOSE if t >= 0 else 0.0
        top, bottom = bounds(p[0, 0], p[1, 0], p[2, 0], beyond, canvases.heights[k])
        left, right = bounds(p[0, 1], p[1, 1], p[2, 1], beyond, canvases.widths[k])
        for r in range(top, bottom):
            for c in range(left, right):
                at = canvases.firsts[k] + r * canvases.widths[k] + c
                if canvases.triangles[at] < 0 or (t >= 0 and canvases.triangles[at] != t):
                    continue
                y, x = r - p[0, 0], c - p[0, 1]
                b, d = (y * x2 - x * y2) / area, (y1 * x - x1 * y) / area
                if t >= 0:
                    b, d = clamped(b, d)
                elif b < -1e-9 or d < -1e-9 or b + d > 1.0 + 1e-9:
                    continue
                down = int64(np.floor(u[0, 0] + b * (u[1, 0] - u[0, 0]) + d * (u[2, 0] - u[0, 0]) + 0.5))
                along = int64(np.floor(u[0, 1] + b * (u[1, 1] - u[0, 1]) + d * (u[2, 1] - u[0, 1]) + 0.5))
                i, j = down + half, along + half
                if i < 0 or j < 0 or i >= size or j >= size or mask[i // cell * across + j // cell] == 0:
                    continue
                if 0 <= canvases.owners[at] < canvases.fixed:
                    continue
                if slips and _is_beyond(numbers.course, place, down, along, canvases.owners[at] >= 0):
                    continue
                row = min(max(source_row + turn[0] * down + turn[1] * along, 0), numbers.height - 1)
                column = min(max(source_column + turn[2] * down + turn[3] * along, 0), numbers.width - 1)
                canvases.owners[at] = block
                canvases.sheets[at] = found.sheets[n]
                canvases.sources[at] = row * numbers.width + column
