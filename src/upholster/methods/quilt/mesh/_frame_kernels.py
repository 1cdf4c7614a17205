"""Laying a block on charts of any shape: in its *frame*, a square of pixels about its centre.

What is laid under a block is drawn into its frame through the block map; there a source is chosen and cut as
on a flat chart; then the block's new texels are written to the canvases of all charts that it reaches.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.methods.quilt._block_kernels import (
    BlockTexels,
    ChoiceScratch,
    LayNumbers,
    LayScratch,
    LayWeights,
    MatchImage,
    Span,
    pixel_at,
    position_of,
    splat_tent,
)
from upholster.methods.quilt._choice_kernels import choose_source, draw_in_phase, penalise_used
from upholster.methods.quilt._landmark_kernels import LandmarkUses, penalise_landmarks, shown_landmarks
from upholster.methods.quilt._phase_kernels import want_phases
from upholster.methods.quilt._seed_kernels import cut_block
from upholster.methods.quilt.mesh._sheet_kernels import MISFIT
from upholster.methods.quilt.mesh._unfold_kernels import MeshArrays
from upholster.types import FloatArray, IntArray, int64

__all__ = [
    "COST",
    "FRAME_COLUMNS",
    "KEPT",
    "Canvases",
    "lay_frames",
    "locate_texels",
    "look_at_frame",
    "nearest_texels",
    "write_frame",
]

COST = 5
"""Column of a block's record, of `FRAME_COLUMNS`: what its cut costs, in 16ths of squared differences."""
FRAME_COLUMNS = COST + 1

_DEAREST = int64(2**31 - 1)

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
    """The working charts, one after another: texel (r, c) of chart k at ``firsts[k] + r·widths[k] + c``.

    `pixels` is what is laid, `sources` which pixel of the exemplar that is, row · width +
    column, and `misfits` that of its triangle in the block that shows it; `covered` is 1 where something is,
    `triangles` in which triangle a texel's centre lies, −1 for none. `heights` and `widths` are the charts'.
    """

    pixels: NDArray[np.int32]
    sources: IntArray
    covered: NDArray[np.uint8]
    triangles: IntArray
    firsts: NDArray[np.int64]
    heights: NDArray[np.int64]
    widths: NDArray[np.int64]
    misfits: NDArray[np.uint8]


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
def locate_texels(mesh: MeshArrays, canvases: Canvases) -> None:
    """Write to `triangles` in which triangle each texel's centre lies."""
    for t in range(mesh.triangles.shape[0]):
        k = mesh.chart[t]
        if k < 0:
            continue
        p = mesh.places[t]
        y1, x1, y2, x2 = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
        area = y1 * x2 - x1 * y2
        if area == 0.0:
            continue
        top, bottom = _bounds(p[0, 0], p[1, 0], p[2, 0], 0.0, canvases.heights[k])
        left, right = _bounds(p[0, 1], p[1, 1], p[2, 1], 0.0, canvases.widths[k])
        for r in range(top, bottom):
            for c in range(left, right):
                y, x = r - p[0, 0], c - p[0, 1]
                b, d = (y * x2 - x * y2) / area, (y1 * x - x1 * y) / area
                if b >= 0.0 and d >= 0.0 and b + d <= 1.0:
                    canvases.triangles[canvases.firsts[k] + r * canvases.widths[k] + c] = t


@kernel
def nearest_texels(
    canvases: Canvases, chart: int, step: float, shift: float, bare: bool, away: FloatArray, found: IntArray
) -> None:
    """Find in each square of a chart the texel on the mesh that lies nearest to its middle.

    Squares are `step` texels wide; the first one's middle is at `shift`. Of all texels, or if `bare` of those
    that are not covered. `away` and `found` (rows, columns) receive its squared distance and the texel's
    number on the chart, −1 for none.
    """
    first, width = canvases.firsts[chart], canvases.widths[chart]
    away[:], found[:] = np.inf, -1
    for r in range(canvases.heights[chart]):
        i = min(max(int64((r - shift) / step + 0.5), 0), away.shape[0] - 1)
        y = r - shift - i * step
        for c in range(width):
            at = first + r * width + c
            if canvases.triangles[at] < 0 or (bare and canvases.covered[at]):
                continue
            j = min(max(int64((c - shift) / step + 0.5), 0), away.shape[1] - 1)
            x = c - shift - j * step
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
    return canvases.covered[canvases.firsts[chart] + r * canvases.widths[chart] + c] == 1


@inline
def _mind_ends(
    mesh: MeshArrays,
    canvases: Canvases,
    triangles: IntArray,
    maps: Any,
    sheets: IntArray,
    first: int,
    stop: int,
    inside: NDArray[np.uint8],
    margin: int,
    marks: NDArray[np.uint8],
) -> None:
    # Keeps off the edges where the footprint ends, though the surface goes on, and something is laid beyond.
    size = marks.shape[0]
    half = size // 2
    for n in range(first, stop):
        inside[triangles[n]] = sheets[n] >= 0
    for n in range(first, stop):
        if sheets[n] < 0:
            continue
        u, t = maps[n], triangles[n]
        for k in range(3):
            across, m = mesh.neighbours[t, k], (k + 1) % 3
            if across < 0 or inside[across // 3] or mesh.chart[across // 3] < 0:
                continue
            if max(u[k, 0], u[m, 0]) < -half - 2 or min(u[k, 0], u[m, 0]) > half + 1:
                continue
            if max(u[k, 1], u[m, 1]) < -half - 2 or min(u[k, 1], u[m, 1]) > half + 1:
                continue
            y, x = u[m, 0] - u[k, 0], u[m, 1] - u[k, 1]
            count = int64(np.sqrt(y * y + x * x)) + 1
            for step in range(count):
                share = (step + 0.5) / count
                i = int64(np.floor(u[k, 0] + share * y + 0.5)) + half
                j = int64(np.floor(u[k, 1] + share * x + 0.5)) + half
                if -2 < i <= size and -2 < j <= size and _is_laid_beyond(mesh, canvases, across, share):
                    _keep_off(i, j, margin, marks)
    for n in range(first, stop):
        inside[triangles[n]] = 0


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
def look_at_frame(
    mesh: MeshArrays,
    canvases: Canvases,
    triangles: IntArray,
    maps: Any,
    sheets: IntArray,
    misfits: NDArray[np.uint8],
    first: int,
    stop: int,
    covered: NDArray[np.uint8],
    sources: IntArray,
    inside: NDArray[np.uint8],
    margin: int,
    takes: bool,
    scratch: LayScratch,
) -> tuple[int, int]:
    """Draw into a frame what is laid under a block; return how many of its pixels are laid, how many bare.

    Bare are those on the mesh where nothing is, but for what is left to other blocks. `covered` is the frame
    with a rim of one pixel; the rest as in `lay_frames`, and `first`, `stop` what of the footprints is the
    block's. What is laid and much truer to the field than the block stays; if `takes`, what is much less true
    counts as neither laid nor bare, but goes.
    """
    texels = scratch.texels
    size = covered.shape[0] - 2
    half = size // 2 + 1  # of the pixel that reads at the source, on the frame with its rim
    rim = size // _RIM
    for i in range(size + 2):
        for j in range(size + 2):
            covered[i, j] = _NONE
    for n in range(first, stop):
        if sheets[n] < 0:
            continue
        u, t = maps[n], triangles[n]
        p, k = mesh.places[t], int64(mesh.chart[t])
        y1, x1, y2, x2 = u[1, 0] - u[0, 0], u[1, 1] - u[0, 1], u[2, 0] - u[0, 0], u[2, 1] - u[0, 1]
        area = y1 * x2 - x1 * y2
        if abs(area) < 1e-9:
            continue
        top, bottom = _bounds(u[0, 0] + half, u[1, 0] + half, u[2, 0] + half, 0.0, size + 2)
        left, right = _bounds(u[0, 1] + half, u[1, 1] + half, u[2, 1] + half, 0.0, size + 2)
        for i in range(top, bottom):
            for j in range(left, right):
                y, x = i - half - u[0, 0], j - half - u[0, 1]
                b, d = (y * x2 - x * y2) / area, (y1 * x - x1 * y) / area
                if b < -1e-9 or d < -1e-9 or b + d > 1.0 + 1e-9:
                    continue
                row = p[0, 0] + b * (p[1, 0] - p[0, 0]) + d * (p[2, 0] - p[0, 0])
                column = p[0, 1] + b * (p[1, 1] - p[0, 1]) + d * (p[2, 1] - p[0, 1])
                r = min(max(int64(np.floor(row + 0.5)), 0), canvases.heights[k] - 1)
                c = min(max(int64(np.floor(column + 0.5)), 0), canvases.widths[k] - 1)
                at = canvases.firsts[k] + r * canvases.widths[k] + c
                covered[i, j] = canvases.covered[at]
                if covered[i, j]:
                    inner = rim < i <= size - rim and rim < j <= size - rim
                    before, now = int64(canvases.misfits[at]), int64(misfits[n])
                    covered[i, j] = _compared(before, now, takes and inner)
                if canvases.covered[at] and 0 < i <= size and 0 < j <= size:
                    sources[i - 1, j - 1] = canvases.sources[at]
                    texels.old[i - 1, j - 1] = canvases.pixels[at]
    for i in range(size):
        for j in range(size):
            texels.marks[i, j] = covered[i + 1, j + 1] if covered[i + 1, j + 1] != _WORSE else 0
    _mind_rim(covered, margin, texels.marks)
    _mind_ends(mesh, canvases, triangles, maps, sheets, first, stop, inside, margin, texels.marks)
    laid, bare = int64(0), int64(0)
    for i in range(size):
        for j in range(size):
            laid += texels.marks[i, j] & 5 == 1
            bare += texels.marks[i, j] == 0 and covered[i + 1, j + 1] == 0
    return laid, bare


@inline
def write_frame(
    mesh: MeshArrays,
    canvases: Canvases,
    image: NDArray[np.int32],
    numbers: LayNumbers,
    source: tuple[int, int],
    mask: NDArray[np.uint8],
    triangles: IntArray,
    maps: Any,
    sheets: IntArray,
    misfits: NDArray[np.uint8],
    first: int,
    stop: int,
) -> None:
    """Write a block's new texels to the canvases of the charts that it reaches; `source` is the pixel."""
    size, cell = numbers.block_height, numbers.mask_cell
    half, across = size // 2, size // cell
    for n in range(first, stop):
        if sheets[n] < 0:
            continue
        u, t = maps[n], triangles[n]
        p, k = mesh.places[t], int64(mesh.chart[t])
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
                if b != b0 or d != d0:
                    away_y, away_x = y - b * y1 - d * y2, x - b * x1 - d * x2
                    if away_y * away_y + away_x * away_x > _CLOSE * _CLOSE:
                        continue
                down = int64(np.floor(u[0, 0] + b * (u[1, 0] - u[0, 0]) + d * (u[2, 0] - u[0, 0]) + 0.5))
                along = int64(np.floor(u[0, 1] + b * (u[1, 1] - u[0, 1]) + d * (u[2, 1] - u[0, 1]) + 0.5))
                i, j = down + half, along + half
                if i < 0 or j < 0 or i >= size or j >= size:
                    continue
                at = canvases.firsts[k] + r * canvases.widths[k] + c
                if mask[i // cell * across + j // cell] == 0:
                    continue
                place = min(max(source[0] + down, 0), numbers.height - 1) * numbers.width
                place += min(max(source[1] + along, 0), numbers.width - 1)
                canvases.covered[at] = 1
                canvases.misfits[at] = misfits[n]
                canvases.sources[at] = place
                canvases.pixels[at] = image[place]


@inline
def _list_continued(
    numbers: LayNumbers, span: Span, texels: BlockTexels, sources: IntArray, choice: ChoiceScratch
) -> Any:
    # Enters before candidate 2 what continues the nearest laid pixels to the left of the frame's middle and
    # above it, or to the right and below; returns the first candidate.
    half, start = numbers.block_height // 2, int64(2)
    for side in range(2):
        choice.continued[side, 0] = -1
        for n in range(1, 2 * half):
            away = -((n + 1) // 2) if n & 1 else n // 2
            i, j = (half, half + away) if side == 0 else (half + away, half)
            if i < 0 or j < 0 or i >= 2 * half or j >= 2 * half or texels.marks[i, j] != 1:
                continue
            y = sources[i, j] // numbers.width - texels.ys[i, j]
            x = sources[i, j] % numbers.width - texels.xs[i, j]
            if span.first_y <= y <= span.last_y and span.first_x <= x <= span.last_x:
                start -= 1
                choice.kept[start] = y * numbers.width + x
            break
    return start


@inline
def _penalise_near(
    numbers: LayNumbers,
    weight: float,
    near: FloatArray,
    blocks: IntArray,
    n: int,
    reach: float,
    penalties: NDArray[np.float64],
) -> None:
    # What blocks near by have used costs more; `near` (blocks, 3) are their centres.
    size = numbers.block_height
    for m in range(n):
        x, y, z = near[m, 0] - near[n, 0], near[m, 1] - near[n, 1], near[m, 2] - near[n, 2]
        if blocks[m, 2] and x * x + y * y + z * z < reach * reach:
            row, column = (
                pixel_at(int64(blocks[m, 0]), numbers.level),
                pixel_at(int64(blocks[m, 1]), numbers.level),
            )
            splat_tent(penalties, numbers.usage_step, row, column, size // 2 + 1, size // 2 + 1, weight)


@kernel
def lay_frames(
    mesh: MeshArrays,
    canvases: Canvases,
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    span: Span,
    usage: NDArray[np.float64],
    uses: LandmarkUses,
    state: NDArray[np.uint64],
    near: FloatArray,
    reach: float,
    order: NDArray[np.int64],
    part: tuple[int, int],
    footprint: tuple[NDArray[np.int64], IntArray, NDArray[np.float32], IntArray, NDArray[np.uint8]],
    blocks: IntArray,
    masks: NDArray[np.uint8],
    covered: NDArray[np.uint8],
    sources: IntArray,
    inside: NDArray[np.uint8],
    margin: int,
    scratch: LayScratch,
) -> None:
    """Choose, cut and lay some blocks, from, to, one after another.

    `footprint` is what `unfold_blocks` found, firsts, triangles, maps and sheets, and the misfits; `order`
    (blocks,) tells which of its blocks each one is. `near` (all blocks, 3) are centres in space, and `reach`
    how far blocks are near. `uses` tells where all blocks show landmarks. `blocks` (all blocks,
    `FRAME_COLUMNS`) receive the source's row and column in 1/16 pixel, and 1 if the block was laid, 2 if on
    nothing, 0 if it was not needed; then they have the phases that are wanted at their centres, and receive
    what the cut costs.
    `masks` (all blocks, cells) receive which cells are new. Where a block ends beside what is laid it leaves
    `margin` pixels bare. `covered` (size + 2, size + 2), `sources` (size, size) and `inside` (triangles,),
    all 0, are scratch; `scratch.texels` has `rows`, `columns`, `ys` and `xs` of a frame.
    """
    firsts, triangles, maps, sheets, misfits = footprint
    texels = scratch.texels
    for n in range(part[0], part[1]):
        block, mask = blocks[n], masks[n]
        first, stop = firsts[order[n]], firsts[order[n] + 1]
        block[2], block[COST] = 0, 0
        laid, bare = look_at_frame(
            *(mesh, canvases, triangles, maps, sheets, misfits, first, stop),
            *(covered, sources, inside, margin, True, scratch),
        )
        if bare == 0:
            continue
        want_phases(match, block[3:], int64(0), scratch.choice)
        if laid == 0:
            block[2] = 2
            y, x = draw_in_phase(match, numbers, state, span, scratch.choice)
            block[0], block[1] = position_of(y, numbers.level), position_of(x, numbers.level)
            for at in range(mask.shape[0]):
                mask[at] = 1
        else:
            block[2] = 1
            choice = scratch.choice
            penalise_used(usage, int64(0), weights.evenness, choice.penalties)
            if weights.variety > 0.0:
                _penalise_near(numbers, weights.variety, near, blocks, n, reach, choice.penalties)
                side = numbers.block_height
                penalise_landmarks(uses, numbers.usage_step, n, side, side, choice.penalties)
            start = _list_continued(numbers, span, texels, sources, choice)
            block[0], block[1], _ = choose_source(match, numbers, weights, state, span, texels, choice, start)
        y, x = pixel_at(int64(block[0]), numbers.level), pixel_at(int64(block[1]), numbers.level)
        if laid:
            base = y * numbers.width + x
            cost = cut_block(
                *(covered, match.image, numbers, int64(0), int64(0), base, texels, scratch.cut, mask)
            )
            block[COST] = min(cost >> 4, _DEAREST)
        write_frame(
            *(mesh, canvases, match.image, numbers, (y, x), mask),
            *(triangles, maps, sheets, misfits, first, stop),
        )
        splat_tent(usage, numbers.usage_step, y, x, numbers.block_height, numbers.block_width, 1.0)
        uses.shown[n] = shown_landmarks(uses, y, x, numbers.block_height, numbers.block_width)
