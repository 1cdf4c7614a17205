"""The hot loop of method "quilt": finds, chooses, cuts and lays blocks, one after another.

For each block, the loop finds its footprint (`place_inside_chart`, or `unfold_block` and `fit_block`), draws
the blocks under it (`look_at_frame`), chooses its source (`choose_source`, once for each symmetry that is
tried), cuts its border (`cut_block`), and writes it to the canvases (`write_frame`).
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.quilt.placement import SYMMETRIES
from upholster.runtime.jit import inline, kernel
from upholster.synthesis.quilt.kernels._block_kernels import (
    EITHER,
    MOST_NEAR,
    MULTIPLIER,
    OUTCOME,
    PHASE,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
    ChoiceScratch,
    CutScratch,
    FramePixels,
    LayNumbers,
    LayWeights,
    MatchImage,
    Span,
)
from upholster.synthesis.quilt.kernels._choice_kernels import choose_source, draw_fitting
from upholster.synthesis.quilt.kernels._frame_kernels import (
    Canvases,
    keep_to_course,
    look_at_frame,
    write_frame,
)
from upholster.synthesis.quilt.kernels._guide_kernels import penalise_off, show_all
from upholster.synthesis.quilt.kernels._phase_kernels import want_phases
from upholster.synthesis.quilt.kernels._search_kernels import draw
from upholster.synthesis.quilt.kernels._seed_kernels import cut_block
from upholster.synthesis.quilt.kernels._sheet_kernels import FieldArrays, SheetScratch, fit_block
from upholster.synthesis.quilt.kernels._unfold_kernels import (
    Footprint,
    MeshArrays,
    UnfoldScratch,
    unfold_block,
)
from upholster.synthesis.quilt.kernels._whole_kernels import ClearCells, place_inside_chart

__all__ = [
    "BlockArrays",
    "Ground",
    "LayScratch",
    "centre_step",
    "find_block",
    "lay_blocks",
    "list_near",
    "list_symmetries",
    "replay_blocks",
    "turn_frame",
    "write_block",
]

_MOST_TRIANGLES = 1 << 13
"""Maximum number of triangles of a block."""

_APART, _FOLD = 4, 2.0**20
"""Distance in pixels of the places where a block might fold what is laid, and what that costs each sample:
more than any difference."""


class Ground(NamedTuple):
    """The surface on which blocks are laid: its mesh, warp fields, clear cells and canvases."""

    mesh: MeshArrays
    field: FieldArrays
    clear: ClearCells
    canvases: Canvases


class BlockArrays(NamedTuple):
    """B blocks, in the order in which they are laid.

    `triangles` (B,) are the mesh's triangles that contain the blocks' centres, `roots` (B, 6) the centres'
    places on charts, see `fit_block`, and `spots` (B, 3) their positions in space; `scales` (B,) are frame
    pixels per model unit. `records` (B, `BLOCK_COLUMNS`) contain the requested phases and receive the
    results, see `_block_kernels`.
    """

    triangles: IntArray
    roots: FloatArray
    spots: FloatArray
    scales: FloatArray
    records: IntArray


class LayScratch(NamedTuple):
    """Scratch of one thread; `covered` and `inside` are all 0 between blocks."""

    unfold: UnfoldScratch
    sheets: SheetScratch
    found: Footprint
    pixels: FramePixels
    choice: ChoiceScratch
    cut: CutScratch
    mask: NDArray[np.uint8]
    covered: NDArray[np.uint8]
    inside: NDArray[np.uint8]
    symmetries: NDArray[np.int64]
    tried: NDArray[np.int64]
    state: NDArray[np.uint64]

    @classmethod
    def of(cls, ground: Ground, numbers: LayNumbers) -> "LayScratch":
        """Return scratch for blocks on some ground."""
        size = numbers.size
        vertices, triangles = len(ground.mesh.first) - 1, len(ground.mesh.triangles)
        guides, zones = len(ground.canvases.wanted), len(ground.canvases.zones) > 0
        return cls(
            UnfoldScratch.of(vertices, triangles),
            SheetScratch.of(triangles),
            Footprint.of(_MOST_TRIANGLES),
            FramePixels.of(size, guides, zones=zones),
            ChoiceScratch.of(numbers),
            CutScratch.of(numbers),
            np.zeros((size // numbers.cell) ** 2, np.uint8),
            np.zeros((size + 2, size + 2), np.uint8),
            np.zeros(triangles, np.uint8),
            np.zeros(8, np.int64),
            np.zeros(3, np.int64),
            np.zeros(1, np.uint64),
        )


@inline
def list_symmetries(numbers: LayNumbers, scratch: LayScratch) -> Any:
    """List the symmetries to try for a block; return their number.

    These are the two most frequent among the pixels that it overlaps, and one drawn from all that are
    allowed; on bare steps only the drawn one.
    """
    shown, tried = scratch.symmetries, scratch.tried
    tried[0] = 0
    if numbers.symmetries == 1:
        return int64(1)
    allowed, count = int64(0), int64(0)
    for s in range(8):
        allowed += numbers.symmetries >> s & 1
    for _ in range(2):
        most = int64(0)
        for s in range(1, 8):
            if shown[s] > shown[most]:
                most = s
        if shown[most] > 0:
            tried[count], shown[most] = most, 0
            count += 1
    pick = draw(scratch.state, allowed)
    for s in range(8):
        if numbers.symmetries >> s & 1:
            if pick == 0 and (count == 0 or s != tried[0]) and (count < 2 or s != tried[1]):
                tried[count] = s
                count += 1
            pick -= 1
    return count


@inline
def turn_frame(numbers: LayNumbers, symmetry: int, pixels: FramePixels) -> Span:
    """Enter the positions, relative to the source, that the frame's pixels read with a symmetry.

    Returns the span of sources with which the frame is inside the exemplar.
    """
    size = numbers.size
    half, turn = size // 2, SYMMETRIES[symmetry]
    for i in range(size):
        for j in range(size):
            pixels.ys[i, j] = turn[0] * (i - half) + turn[1] * (j - half)
            pixels.xs[i, j] = turn[2] * (i - half) + turn[3] * (j - half)
    y, x = int64(pixels.ys[0, 0]), int64(pixels.xs[0, 0])
    other_y, other_x = int64(pixels.ys[size - 1, size - 1]), int64(pixels.xs[size - 1, size - 1])
    low_y, high_y, low_x, high_x = min(y, other_y), max(y, other_y), min(x, other_x), max(x, other_x)
    return Span(
        -low_y, numbers.height - 1 - high_y, -low_x, numbers.width - 1 - high_x, low_y, high_y, low_x, high_x
    )


@inline
def list_near(blocks: BlockArrays, near: NDArray[np.int64], choice: ChoiceScratch) -> None:
    """List the sources of those `near` blocks that are laid."""
    count = int64(0)
    for m in near:
        if blocks.records[m, OUTCOME] and count < MOST_NEAR:
            choice.near[count, 0] = blocks.records[m, SOURCE_ROW]
            choice.near[count, 1] = blocks.records[m, SOURCE_COLUMN]
            count += 1
    choice.nearby[0] = count


@inline
def bar_folds(
    canvases: Canvases,
    numbers: LayNumbers,
    records: IntArray,
    symmetry: int,
    pixels: FramePixels,
    choice: ChoiceScratch,
) -> None:
    """Set `penalties` where a block would continue what is laid as its own mirror image, or turned about it.

    There both show the same pixels of the sample, which fits perfectly, and looks like a face or a butterfly.
    """
    if numbers.symmetries == 1:
        return
    penalties, step = choice.penalties, numbers.guide_step
    rows, columns = penalties.shape
    for i in range(0, numbers.size, _APART):
        for j in range(0, numbers.size, _APART):
            at = pixels.steps[i, j]
            if pixels.marks[i, j] & 1 and at >= 0 and records[canvases.owners[at], SYMMETRY] != symmetry:
                # The block would show the same pixel here.
                y = canvases.sources[at] // numbers.width - pixels.ys[i, j]
                x = canvases.sources[at] % numbers.width - pixels.xs[i, j]
                last_a, last_b = min((y + _APART) // step, rows - 1), min((x + _APART) // step, columns - 1)
                for a in range(max(0, (y - _APART) // step), last_a + 1):
                    for b in range(max(0, (x - _APART) // step), last_b + 1):
                        penalties[a, b] = _FOLD


@inline
def _choose(
    ground: Ground,
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    blocks: BlockArrays,
    n: int,
    count: int,
    scratch: LayScratch,
) -> None:
    # Chooses the source of block n with each of the listed symmetries, and keeps the cheapest. Ties go to the
    # first one. The sources of blocks nearby are listed.
    record, choice, tried = blocks.records[n], scratch.choice, scratch.tried
    least = int64(-1)
    for t in range(count):
        span = turn_frame(numbers, tried[t], scratch.pixels)
        choice.penalties[:, :] = 0.0
        penalise_off(match, numbers, span, scratch.pixels, choice)
        bar_folds(ground.canvases, numbers, blocks.records, tried[t], scratch.pixels, choice)
        want_phases(match, record[PHASE:], tried[t], choice)
        y, x, cost = choose_source(match, numbers, weights, scratch.state, span, scratch.pixels, choice)
        if least < 0 or cost < least:
            least = cost
            record[SOURCE_ROW], record[SOURCE_COLUMN], record[SYMMETRY] = y, x, tried[t]
    if record[SYMMETRY] != tried[count - 1]:
        turn_frame(numbers, int64(record[SYMMETRY]), scratch.pixels)


@inline
def centre_step(canvases: Canvases, root: FloatArray) -> Any:
    """Return the step at a block's centre."""
    k = int64(root[0])
    return canvases.firsts[k] + int64(root[1]) * canvases.widths[k] + int64(root[2])


@inline
def write_block(
    canvases: Canvases,
    numbers: LayNumbers,
    blocks: BlockArrays,
    n: int,
    mask: NDArray[np.uint8],
    triangles: int,
    scratch: LayScratch,
) -> None:
    """Write block n, and always its centre, even if that step falls between two pixels of the frame."""
    record, centre = blocks.records[n], centre_step(canvases, blocks.roots[n])
    write_frame(canvases, numbers, n, record, mask, scratch.found, triangles)
    if canvases.owners[centre] < 0:
        canvases.owners[centre], canvases.sheets[centre] = n, 0
        canvases.sources[centre] = record[SOURCE_ROW] * numbers.width + record[SOURCE_COLUMN]


@inline
def _lay_block(
    ground: Ground,
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    blocks: BlockArrays,
    n: int,
    near: NDArray[np.int64],
    triangles: int,
    scratch: LayScratch,
) -> None:
    # Chooses, cuts and writes block n, whose footprint of `triangles` triangles is in `scratch`.
    record, pixels, canvases = blocks.records[n], scratch.pixels, ground.canvases
    laid, bare = look_at_frame(
        canvases,
        match,
        blocks.records,
        scratch.found,
        triangles,
        scratch.inside,
        scratch.covered,
        pixels,
        scratch.symmetries,
    )
    if numbers.course.spare > 0.0:
        laid, bare = keep_to_course(numbers, record, scratch.covered, pixels)
    centre = centre_step(canvases, blocks.roots[n])
    if bare == 0 and canvases.owners[centre] >= 0:
        return
    scratch.choice.zone[0] = canvases.zones[centre] % EITHER if canvases.zones.shape[0] else 0
    scratch.choice.avoid[0] = canvases.sources[centre] if canvases.owners[centre] < 0 else -1
    count = list_symmetries(numbers, scratch)
    record[OUTCOME] = 1 if laid else 2
    if laid:
        # Where a region must differ, the seed decides alone.
        list_near(blocks, near[:0] if scratch.choice.avoid[0] >= 0 else near, scratch.choice)
        _choose(ground, match, numbers, weights, blocks, n, count, scratch)
    else:
        span = turn_frame(numbers, scratch.tried[0], pixels)
        want_phases(match, record[PHASE:], scratch.tried[0], scratch.choice)
        scratch.choice.penalties[:, :] = 0.0
        penalise_off(match, numbers, span, pixels, scratch.choice)
        y, x = draw_fitting(match, numbers, weights, scratch.state, span, scratch.choice)
        record[SOURCE_ROW], record[SOURCE_COLUMN], record[SYMMETRY] = y, x, scratch.tried[0]
    y, x = int64(record[SOURCE_ROW]), int64(record[SOURCE_COLUMN])
    if laid:
        cut_block(scratch.covered, match, numbers, y * numbers.width + x, pixels, scratch.cut, scratch.mask)
    else:
        show_all(match, numbers, y * numbers.width + x, pixels, scratch.mask)
    write_block(canvases, numbers, blocks, n, scratch.mask, triangles, scratch)


@inline
def find_block(
    ground: Ground,
    half: float,
    blocks: BlockArrays,
    n: int,
    fits: FloatArray,
    scratch: LayScratch,
) -> tuple[Any, Any]:
    """Find the footprint of block n; return its number of triangles, and its number of sheets.

    `half` is half the block's side in frame pixels; `blocks.scales` are frame pixels per model unit.
    """
    root = blocks.roots[n]
    count = place_inside_chart(ground.field, ground.clear, root, half, scratch.found, fits)
    if count > 0:
        return count, int64(1)
    found, sheets = unfold_block(
        *(ground.mesh, int64(blocks.triangles[n]), blocks.spots[n], half, blocks.scales[n]),
        *(scratch.unfold, scratch.found),
    )
    pieces = fit_block(
        *(ground.mesh, ground.field, root, half),
        *(scratch.found, (found, sheets), scratch.sheets, fits),
    )
    return found, int64(pieces)


@kernel
def replay_blocks(
    ground: Ground,
    numbers: LayNumbers,
    blocks: BlockArrays,
    order: NDArray[np.int64],
    masks: NDArray[np.uint8],
    fits: FloatArray,
    pieces: NDArray[np.int64],
    scratch: LayScratch,
) -> None:
    """Write blocks that were laid earlier, in an order: only their footprints are computed again.

    `masks` (blocks, cells) are the cells that they show; `fits` and `pieces` are as in `lay_blocks`. Blocks
    without a triangle, −1, are left out.
    """
    for n in order:
        if blocks.triangles[n] >= 0:
            count, pieces[n] = find_block(ground, 0.5 * numbers.size, blocks, n, fits[n], scratch)
            write_block(ground.canvases, numbers, blocks, n, masks[n], int64(count), scratch)


@kernel
def lay_blocks(
    ground: Ground,
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    blocks: BlockArrays,
    part: tuple[int, int],
    firsts: NDArray[np.int64],
    near: NDArray[np.int64],
    seed: np.uint64,
    fits: FloatArray,
    pieces: NDArray[np.int64],
    masks: NDArray[np.uint8],
    stop: NDArray[np.uint8],
    scratch: LayScratch,
) -> None:
    """Find, choose, cut and lay the blocks in the range `part`, from, to, one after another.

    A block that would show nothing new is left out. The source of a block on bare steps is drawn from all
    that fit. The source of any other block is chosen by the blocks that it continues, and the block is cut
    where it differs least from them. What nearby blocks show costs more: those of block n are
    ``near[firsts[n] : firsts[n + 1]]``. Each block has its own random
    generator; `seed` is that of the first one. `fits` (blocks, `MOST_SHEETS`, `FIT`) and `pieces` (blocks,)
    receive the sheets' fits and the number of sheets, `masks` (blocks, cells) the cells that show. The loop
    ends early once `stop` (1,) is not 0.
    """
    for n in range(part[0], part[1]):
        if stop[0]:
            return
        own = n - part[0]
        scratch.state[0] = seed + np.uint64(own) * np.uint64(MULTIPLIER)
        blocks.records[n, OUTCOME] = 0
        count, pieces[own] = find_block(ground, 0.5 * numbers.size, blocks, n, fits[own], scratch)
        own_near = near[firsts[n] : firsts[n + 1]]
        _lay_block(ground, match, numbers, weights, blocks, n, own_near, count, scratch)
        for m in range(masks.shape[1]):
            masks[own, m] = scratch.mask[m]
