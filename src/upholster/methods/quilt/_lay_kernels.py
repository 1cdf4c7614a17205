"""The hot loop of method "quilt": blocks, each found, chosen, cut and laid, one after another.

A block's steps: where it lies (`lie_whole`, or `unfold_block` and `fit_block`), what is there
(`look_at_frame`), what it shows (`choose_source`, for each symmetry that it is tried with), its border
(`cut_block`), and `write_frame`.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.methods.quilt._block_kernels import (
    EITHER,
    LAID,
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
    splat_tent,
)
from upholster.methods.quilt._choice_kernels import choose_source, draw_fitting, first_of, penalise_used
from upholster.methods.quilt._frame_kernels import Canvases, look_at_frame, write_frame
from upholster.methods.quilt._guide_kernels import penalise_off, show_all
from upholster.methods.quilt._phase_kernels import want_phases
from upholster.methods.quilt._search_kernels import draw
from upholster.methods.quilt._seed_kernels import cut_block
from upholster.methods.quilt._sheet_kernels import FieldArrays, SheetScratch, fit_block
from upholster.methods.quilt._unfold_kernels import Footprint, MeshArrays, UnfoldScratch, unfold_block
from upholster.methods.quilt._whole_kernels import ClearCells, lie_whole
from upholster.quilt.placement import SYMMETRIES
from upholster.types import FloatArray, IntArray, int64

__all__ = ["BlockArrays", "Ground", "LayScratch", "find_block", "lay_blocks", "replay_blocks"]

_MOST_TRIANGLES = 1 << 13
"""Of a block."""

_NEAR = 2.0
"""Blocks: so near lie others whose sources cost more."""


class Ground(NamedTuple):
    """What blocks are laid on."""

    mesh: MeshArrays
    field: FieldArrays
    clear: ClearCells
    canvases: Canvases


class BlockArrays(NamedTuple):
    """Blocks, in the order in which they are laid, B of them.

    `triangles` (B,) are those of the mesh in which their centres lie, `roots` (B, 6) where that is on a
    chart, see `fit_block`, and `spots` (B, 3) in space; `scales` (B,) are frame pixels per model unit.
    `records` (B, `BLOCK_COLUMNS`) receive what is found, see `_block_kernels`; they have the wanted phases.
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
    def of(cls, ground: Ground, numbers: LayNumbers, usage: FloatArray) -> "LayScratch":
        """Return scratch for blocks on some ground."""
        size = numbers.size
        vertices, triangles = len(ground.mesh.first) - 1, len(ground.mesh.triangles)
        guides, zones = len(ground.canvases.wanted), len(ground.canvases.zones) > 0
        return cls(
            UnfoldScratch.of(vertices, triangles),
            SheetScratch.of(triangles),
            Footprint.of(_MOST_TRIANGLES),
            FramePixels.of(size, guides, zones=zones),
            ChoiceScratch.of(numbers, usage),
            CutScratch.of(numbers),
            np.zeros((size // numbers.cell) ** 2, np.uint8),
            np.zeros((size + 2, size + 2), np.uint8),
            np.zeros(triangles, np.uint8),
            np.zeros(8, np.int64),
            np.zeros(3, np.int64),
            np.zeros(1, np.uint64),
        )


@inline
def _list_symmetries(numbers: LayNumbers, scratch: LayScratch) -> Any:
    # Lists the symmetries that a block is tried with: the two that most of what it overlaps shows, and one
    # drawn from all that are allowed. Returns how many; where nothing is laid, the drawn one alone.
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
def _turn_frame(numbers: LayNumbers, symmetry: int, pixels: FramePixels) -> Span:
    # Enters where the frame's pixels read with a symmetry, from the source; returns where that may be, so
    # that the frame lies inside the exemplar.
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
def _penalise_near(
    numbers: LayNumbers,
    weight: float,
    blocks: BlockArrays,
    n: int,
    near: NDArray[np.int64],
    reach: float,
    penalties: FloatArray,
) -> None:
    # What blocks near by have used costs more; `near` (k, 2) are those that may be near, from, to.
    spots, records, tall = blocks.spots, blocks.records, numbers.size // 2 + 1
    for k in range(near.shape[0]):
        for m in range(near[k, 0], min(near[k, 1], n)):
            x, y, z = (
                spots[m, 0] - spots[n, 0],
                spots[m, 1] - spots[n, 1],
                spots[m, 2] - spots[n, 2],
            )
            if records[m, LAID] and x * x + y * y + z * z < reach * reach:
                row, column = int64(records[m, SOURCE_ROW]), int64(records[m, SOURCE_COLUMN])
                splat_tent(penalties, numbers.usage_step, row, column, tall, tall, weight)


@inline
def _choose(
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    usage: FloatArray,
    blocks: BlockArrays,
    n: int,
    near: NDArray[np.int64],
    reach: float,
    count: int,
    scratch: LayScratch,
) -> None:
    # Chooses the source of block n with each of the symmetries listed, and keeps the cheapest, the first of
    # equals.
    record, choice, tried = blocks.records[n], scratch.choice, scratch.tried
    least = int64(-1)
    for t in range(count):
        span = _turn_frame(numbers, tried[t], scratch.pixels)
        first = first_of(numbers, tried[t], choice.penalties.shape[0])
        penalise_used(usage, first, weights, choice.penalties)
        if weights.variety > 0.0:
            _penalise_near(numbers, weights.variety, blocks, n, near, reach, choice.penalties)
        penalise_off(match, numbers, span, scratch.pixels, choice)
        want_phases(match, record[PHASE:], tried[t], choice)
        y, x, cost = choose_source(match, numbers, weights, scratch.state, span, scratch.pixels, choice)
        if least < 0 or cost < least:
            least = cost
            record[SOURCE_ROW], record[SOURCE_COLUMN], record[SYMMETRY] = y, x, tried[t]
    if record[SYMMETRY] != tried[count - 1]:
        _turn_frame(numbers, int64(record[SYMMETRY]), scratch.pixels)


@inline
def _centre(canvases: Canvases, root: FloatArray) -> Any:
    # The step in which a block has its centre.
    k = int64(root[0])
    return canvases.firsts[k] + int64(root[1]) * canvases.widths[k] + int64(root[2])


@inline
def _write(
    canvases: Canvases,
    numbers: LayNumbers,
    blocks: BlockArrays,
    n: int,
    mask: NDArray[np.uint8],
    triangles: int,
    scratch: LayScratch,
) -> None:
    # Writes block n. Its centre is never left bare: a step may lie between two pixels of the frame.
    record, centre = blocks.records[n], _centre(canvases, blocks.roots[n])
    write_frame(canvases, numbers, n, record, mask, scratch.found, triangles)
    if canvases.owners[centre] < 0:
        canvases.owners[centre], canvases.sheets[centre] = n, 0
        canvases.sources[centre] = record[SOURCE_ROW] * numbers.width + record[SOURCE_COLUMN]


@inline
def _settle(
    ground: Ground,
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    usage: FloatArray,
    blocks: BlockArrays,
    n: int,
    near: NDArray[np.int64],
    reach: float,
    triangles: int,
    scratch: LayScratch,
) -> None:
    # Chooses, cuts and writes block n, whose footprint is found, so many triangles.
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
    centre = _centre(canvases, blocks.roots[n])
    if bare == 0 and canvases.owners[centre] >= 0:
        return
    scratch.choice.zone[0] = canvases.zones[centre] % EITHER if canvases.zones.shape[0] else 0
    count = _list_symmetries(numbers, scratch)
    record[LAID] = 1 if laid else 2
    if laid:
        _choose(match, numbers, weights, usage, blocks, n, near, reach, count, scratch)
    else:
        span = _turn_frame(numbers, scratch.tried[0], pixels)
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
    _write(canvases, numbers, blocks, n, scratch.mask, triangles, scratch)
    rows = scratch.choice.penalties.shape[0]
    first = first_of(numbers, int64(record[SYMMETRY]), rows)
    splat_tent(usage[first : first + rows], numbers.usage_step, y, x, numbers.size, numbers.size, 1.0)


@inline
def find_block(
    ground: Ground,
    half: float,
    blocks: BlockArrays,
    n: int,
    fits: FloatArray,
    scratch: LayScratch,
) -> tuple[Any, Any]:
    """Find where block n lies; return how many triangles that takes, and how many sheets.

    `half` is half its side in frame pixels, of which `scale` are a model unit.
    """
    root = blocks.roots[n]
    count = lie_whole(ground.field, ground.clear, root, half, scratch.found, fits)
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
    """Write blocks that were laid before, in an order: where they lie is found again, nothing else.

    `masks` (blocks, cells) is what they show; `fits` and `pieces` as in `lay_blocks`. Those without a
    triangle, −1, are left out.
    """
    for n in order:
        if blocks.triangles[n] >= 0:
            count, pieces[n] = find_block(ground, 0.5 * numbers.size, blocks, n, fits[n], scratch)
            _write(ground.canvases, numbers, blocks, n, masks[n], int64(count), scratch)


@kernel
def lay_blocks(
    ground: Ground,
    match: MatchImage,
    numbers: LayNumbers,
    weights: LayWeights,
    usage: FloatArray,
    blocks: BlockArrays,
    part: tuple[int, int],
    near: NDArray[np.int64],
    seed: np.uint64,
    fits: FloatArray,
    pieces: NDArray[np.int64],
    masks: NDArray[np.uint8],
    stop: NDArray[np.uint8],
    scratch: LayScratch,
) -> None:
    """Find, choose, cut and lay some blocks, from, to, one after another.

    A block that shows nothing new is left out. One on nothing is drawn from all sources that fit; any other
    is chosen by what it continues, and cut where the two differ least. `usage` counts how much each part of
    the exemplar is used, every `usage_step` pixels, for each symmetry that is allowed, one below the other.
    `near` (k, 2) are blocks that may lie near, from, to. Each block draws from its own generator, which
    follows from `seed`. `fits` (blocks, `MOST_SHEETS`, `FIT`) and `pieces` (blocks,) receive how sheets read,
    and how many there are, `masks` (blocks, cells) which cells are shown. It ends early once `stop` (1,) is
    not 0.
    """
    for n in range(part[0], part[1]):
        if stop[0]:
            return
        own = n - part[0]
        scratch.state[0] = seed + np.uint64(n) * np.uint64(0xD1342543DE82EF95)
        blocks.records[n, LAID] = 0
        count, pieces[own] = find_block(ground, 0.5 * numbers.size, blocks, n, fits[own], scratch)
        reach = _NEAR * numbers.size / blocks.scales[n]
        _settle(
            *(ground, match, numbers, weights, usage, blocks, n, near, reach),
            *(count, scratch),
        )
        for m in range(masks.shape[1]):
            masks[own, m] = scratch.mask[m]
