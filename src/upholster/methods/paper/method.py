"""Method "paper": the paper's synthesis, step by step (its sections 4.1 to 4.4; our readings: docs/paper.md).

Each chart is covered on its own, block by block in raster order; then *edge blocks* repair every shared edge.
What is chosen goes into a plan. The charts' texels exist here only in working form, as canvases to match
against.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.methods.paper._paper_kernels import lay_blocks, lay_edge_blocks
from upholster.methods.paper.edges import color_classes, strip_along
from upholster.methods.paper.matching import Candidates
from upholster.options import SynthesisOptions
from upholster.parallel import run_tasks
from upholster.quilt import Chart, Quilt
from upholster.methods.quilt.masked import SYMMETRIES
from upholster.methods.quilt.old_plans import StripLayout, StripPlan
from upholster.types import PixelArray, Progress

__all__ = ["PaperOptions", "synthesize_paper"]

logger = logging.getLogger(__name__)

FEATHER_PASSES = 2
_BLOCKS_PER_CALL = 256

Canvas = NDArray[np.uint16]


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperOptions(SynthesisOptions):
    """Options of method "paper", all settled.

    Attributes
    ----------
    block
        Side of a block in texels. The paper's edge blocks are 32; 64 is the other reading of its section 4.3.
    edge_block
        Side of an edge block in texels; None is that of a block.
    overlap
        Width in texels of the overlap with the block before.
    """

    method: str = "paper"
    block: int = 32
    overlap: int = 8


def synthesize_paper(
    exemplar: PixelArray,
    surface: Surface,
    charts: Sequence[Chart],
    *,
    options: PaperOptions | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Quilt:
    """Cover a surface by the paper's method.

    Parameters
    ----------
    exemplar
        (H, W, C) uint8, uint16 or float32, at least one block and one edge block each way.
    surface
        The surface: its shared edges are repaired.
    charts
        One chart per patch, in order, each at least a block and an edge block each way.
    options
        Parameters of the method.
    seed
        Chooses each chart's first block; the same seed gives the same quilt whatever the number of threads.
    threads, progress
        As in `upholster.parallel.run_tasks`; stages "blocks" and "seams".

    Raises
    ------
    InputError
        If the exemplar or a chart is smaller than a block or an edge block.

    References
    ----------
    Shet, Bez, Edirisinghe: Progressive texture synthesis on geometric surfaces parametrised by bi-quadratic
    rational Bézier patches, sections 4.1 to 4.4.
    """
    options = options or PaperOptions()
    _check_room(exemplar, charts, options)
    if not 0 <= seed < 2**63:
        raise InputError(f"seed is {seed}; allowed: 0 to 2^63 - 1")
    candidates = Candidates.of(exemplar, block=options.block, levels=options.levels)
    firsts = [
        int(np.random.default_rng(child).integers(candidates.count))
        for child in np.random.SeedSequence(seed).spawn(len(charts))
    ]
    layout, classes = _layout(surface, charts, exemplar.shape[:2], options)
    blocks = [layout.chart_blocks(n, np.zeros(layout.block_grid(n), np.int32)) for n in range(len(charts))]
    canvases = _canvases(charts, candidates) if options.seams else None

    def cover(n: int) -> None:
        canvas = canvases[n] if canvases is not None else _canvases([charts[n]], candidates)[0]
        _cover_chart(canvas, layout, n, blocks[n], firsts[n], candidates)

    run_tasks(
        [partial(cover, n) for n in range(len(charts))], threads=threads, progress=progress, stage="blocks"
    )
    masks: list[NDArray[np.uint8]] = []
    if canvases is not None:
        at_edges = replace(candidates, block=layout.edge_block)
        strips, masks = _mend_seams(layout, classes, canvases, at_edges, threads, progress)
        blocks += strips
    chosen = np.concatenate([layout.chosen(placed) for placed in blocks])
    plan = StripPlan(layout, chosen, np.concatenate([np.zeros(0, np.uint8), *masks]))
    return Quilt(tuple(charts), layout.exemplar_shape, plan)


def _check_room(exemplar: PixelArray, charts: Sequence[Chart], options: PaperOptions) -> None:
    # Raises InputError where a block or an edge block is larger than the exemplar or a chart.
    name, most = "a block", options.block
    if options.seams and options.edge_block is not None and options.edge_block > most:
        name, most = "an edge block", options.edge_block
    for what, (height, width) in [
        ("exemplar", exemplar.shape[:2]),
        *((f"chart {n}", (chart.height, chart.width)) for n, chart in enumerate(charts)),
    ]:
        if min(height, width) < most:
            raise InputError(f"{what} is {width}×{height}; allowed: at least {name} ({most}) each way")


def _layout(
    surface: Surface, charts: Sequence[Chart], shape: tuple[int, ...], options: PaperOptions
) -> tuple[StripLayout, list[list[int]]]:
    # Where blocks and strips lie, and the strips, as numbers, in classes that have no chart in common.
    edge_block = options.block if options.edge_block is None else options.edge_block
    found = [strip_along(edge, charts, edge_block) for edge in surface.shared if options.seams]
    strips = [strip for strip in found if strip is not None]
    if len(strips) < len(found):
        logger.info(
            "%d of %d shared edges meet at different texel sizes and are not repaired",
            len(found) - len(strips),
            len(found),
        )
    classes = color_classes([(strip.a, strip.b) for strip in strips])
    ordered = tuple(strips[n] for members in classes for n in members)
    ends = np.cumsum([0, *map(len, classes)]).tolist()
    cell, feather = (2**options.levels // 2, FEATHER_PASSES) if strips else (0, 0)
    layout = StripLayout(
        tuple(charts),
        (shape[0], shape[1]),
        options.block,
        edge_block,
        options.overlap,
        2**options.levels,
        cell,
        feather,
        ordered,
    )
    return layout, [list(range(*ends[n : n + 2])) for n in range(len(classes))]


def _canvases(charts: Sequence[Chart], candidates: Candidates) -> list[Canvas]:
    # Padded to whole tiles. All in one piece of memory, which goes back to the system in one piece.
    tile = candidates.tile
    shapes = [
        (-(-chart.height // tile) * tile, -(-chart.width // tile) * tile * candidates.channels)
        for chart in charts
    ]
    ends = np.cumsum([0, *(rows * samples for rows, samples in shapes)])
    memory = np.zeros(ends[-1], np.uint16)
    return [memory[ends[n] : ends[n + 1]].reshape(shape) for n, shape in enumerate(shapes)]


def _cover_chart(
    canvas: Canvas,
    layout: StripLayout,
    index: int,
    placements: NDArray[np.void],
    first: int,
    candidates: Candidates,
) -> None:
    down, across = layout.block_grid(index)
    # Few blocks a call: between two calls, Python can be interrupted.
    chunk = max(1, _BLOCKS_PER_CALL // across)
    for start in range(0, down, chunk):
        lay_blocks(
            canvas,
            placements,
            across,
            (start, min(start + chunk, down)),
            first,
            layout.overlap,
            candidates.numbers,
            candidates.working,
            candidates.table,
            SYMMETRIES,
        )


def _mend_seams(
    layout: StripLayout,
    classes: Sequence[Sequence[int]],
    canvases: Sequence[Canvas],
    candidates: Candidates,
    threads: int | None,
    progress: Progress | None,
) -> tuple[list[NDArray[np.void]], list[NDArray[np.uint8]]]:
    # The strips' blocks on their charts A, and their masks, rows along the edge.
    counts = [layout.blocks_along(strip) for strip in layout.strips]
    strips = [layout.strip_blocks(n, np.zeros(count, np.int32)) for n, count in enumerate(counts)]
    masks = [np.zeros((count, layout.side, layout.side), np.uint8) for count in counts]
    done = 0

    def report(_stage: str, count: int, _total: int) -> None:
        if progress is not None:
            progress("seams", done + count, len(strips))

    # Edges of one class have no chart in common: they can be repaired side by side, in any order.
    for members in classes:
        tasks: list[Callable[[], object]] = [
            partial(_mend_edge, layout, n, strips[n], masks[n], canvases, candidates) for n in members
        ]
        run_tasks(tasks, threads=threads, progress=report)
        done += len(members)
    turned = [
        grids if strip.along_rows else grids.swapaxes(1, 2)
        for strip, grids in zip(layout.strips, masks, strict=True)
    ]
    return [on_a for on_a, _ in strips], [grids.reshape(-1) for grids in turned]


def _mend_edge(
    layout: StripLayout,
    index: int,
    blocks: tuple[NDArray[np.void], NDArray[np.void]],
    masks: NDArray[np.uint8],
    canvases: Sequence[Canvas],
    candidates: Candidates,
) -> None:
    strip = layout.strips[index]
    a, b = layout.charts[strip.a], layout.charts[strip.b]
    for start in range(0, len(masks), _BLOCKS_PER_CALL):
        lay_edge_blocks(
            (canvases[strip.a], canvases[strip.b]),
            ((a.height, a.width), (b.height, b.width)),
            layout.maps[index],
            strip.along_rows,
            blocks,
            masks,
            (start, min(start + _BLOCKS_PER_CALL, len(masks))),
            candidates.numbers,
            candidates.working,
            candidates.table,
            SYMMETRIES,
        )
