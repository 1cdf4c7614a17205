"""Method "paper": the paper's synthesis, step by step (its sections 4.1 to 4.4; our readings: docs/paper.md).

Each chart is covered on its own, block by block in raster order; then *edge blocks* mend every shared edge.
What is chosen goes into placements. The charts' texels exist here only in working form, as canvases to match
against.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.geometry import SharedEdge, Surface
from upholster.methods.paper._paper_kernels import lay_blocks, lay_edge_blocks
from upholster.methods.paper.edges import EdgeMap, color_classes, edge_map
from upholster.methods.paper.matching import Candidates
from upholster.options import SynthesisOptions
from upholster.parallel import run_tasks
from upholster.quilt._paint_kernels import SYMMETRIES
from upholster.quilt.model import (
    MASK_CUT,
    MASK_NONE,
    MASK_RAMP,
    PLACEMENT,
    SIDE_LEFT,
    SIDE_TOP,
    Chart,
    Quilt,
)
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
        (H, W, C) uint8, uint16 or float32, at least one block each way.
    surface
        The surface: its shared edges are mended.
    charts
        One chart per patch, in order, each at least a block each way.
    options
        Parameters of the method.
    seed
        Chooses each chart's first block; the same seed gives the same quilt whatever the number of threads.
    threads, progress
        As in `upholster.parallel.run_tasks`; stages "blocks" and "seams".

    Raises
    ------
    InputError
        If the exemplar or a chart is smaller than a block.

    References
    ----------
    Shet, Bez, Edirisinghe: Progressive texture synthesis on geometric surfaces parametrised by bi-quadratic
    rational Bézier patches, sections 4.1 to 4.4.
    """
    options = options or PaperOptions()
    for name, (height, width) in [
        ("exemplar", exemplar.shape[:2]),
        *((f"chart {n}", (chart.height, chart.width)) for n, chart in enumerate(charts)),
    ]:
        if min(height, width) < options.block:
            raise InputError(
                f"{name} is {width}×{height}; allowed: at least a block ({options.block}) each way"
            )
    if not 0 <= seed < 2**63:
        raise InputError(f"seed is {seed}; allowed: 0 to 2^63 - 1")
    candidates = Candidates.of(exemplar, block=options.block, levels=options.levels)
    firsts = [
        int(np.random.default_rng(child).integers(candidates.count))
        for child in np.random.SeedSequence(seed).spawn(len(charts))
    ]
    placed = [_block_placements(n, chart, options) for n, chart in enumerate(charts)]
    canvases = _canvases(charts, candidates) if options.seams else None

    def cover(n: int) -> None:
        canvas = canvases[n] if canvases is not None else _canvases([charts[n]], candidates)[0]
        _cover_chart(canvas, charts[n], placed[n], firsts[n], candidates, options)

    run_tasks(
        [partial(cover, n) for n in range(len(charts))], threads=threads, progress=progress, stage="blocks"
    )
    cells = np.zeros(0, np.uint8)
    if canvases is not None:
        mended, cells = _mend_seams(surface, charts, canvases, candidates, options, threads, progress)
        placed += mended
    placements = np.concatenate(placed)
    order = np.argsort(placements["chart"], kind="stable")
    return Quilt(tuple(charts), (exemplar.shape[0], exemplar.shape[1]), placements[order], cells)


def _block_placements(index: int, chart: Chart, options: PaperOptions) -> NDArray[np.void]:
    # Blocks in raster order, each a step of block - overlap after the one before; the last ones reach beyond
    # the chart.
    step = options.block - options.overlap
    rows, columns = (max(1, -(-(size - options.overlap) // step)) for size in (chart.height, chart.width))
    placements = np.zeros((rows, columns), PLACEMENT)
    placements["chart"] = index
    placements["row"] = (np.arange(rows) * step + options.block // 2)[:, None]
    placements["column"] = np.arange(columns) * step + options.block // 2
    placements["height"] = placements["width"] = options.block
    placements["cells"] = -1
    placements["mask"] = MASK_RAMP
    placements["mask"][0, 0] = MASK_NONE
    placements["ramp"] = options.overlap
    placements["sides"][1:] |= SIDE_TOP
    placements["sides"][:, 1:] |= SIDE_LEFT
    return placements.reshape(-1)


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
    chart: Chart,
    placements: NDArray[np.void],
    first: int,
    candidates: Candidates,
    options: PaperOptions,
) -> None:
    step = options.block - options.overlap
    across = max(1, -(-(chart.width - options.overlap) // step))
    down = len(placements) // across
    # Few blocks a call: between two calls, Python can be interrupted.
    chunk = max(1, _BLOCKS_PER_CALL // across)
    for start in range(0, down, chunk):
        lay_blocks(
            canvas,
            placements,
            across,
            start,
            min(start + chunk, down),
            first,
            candidates.working,
            candidates.channels,
            candidates.tile,
            options.overlap,
            candidates.table,
            candidates.grid[1],
            *candidates.shape,
            SYMMETRIES,
            np.zeros(0, np.uint8),
        )


def _mend_seams(
    surface: Surface,
    charts: Sequence[Chart],
    canvases: Sequence[Canvas],
    candidates: Candidates,
    options: PaperOptions,
    threads: int | None,
    progress: Progress | None,
) -> tuple[list[NDArray[np.void]], NDArray[np.uint8]]:
    maps = [_mendable(edge, charts, options.block) for edge in surface.shared]
    edges = [found for found in maps if found is not None]
    if len(edges) < len(maps):
        logger.info(
            "%d of %d shared edges meet at different texel sizes and are not mended",
            len(maps) - len(edges),
            len(maps),
        )
    side = 2 * options.block // candidates.tile
    strips = [_edge_placements(edge, options, side * side) for edge in edges]
    masks = [np.zeros(2 * len(strip[0]) * side * side, np.uint8) for strip in strips]
    done = 0

    def report(_stage: str, count: int, _total: int) -> None:
        if progress is not None:
            progress("seams", done + count, len(edges))

    # Edges of one round have no chart in common: they can be mended side by side, in any order.
    schedule = color_classes([(edge.chart_a, edge.chart_b) for edge in edges])
    for members in schedule:
        tasks: list[Callable[[], object]] = [
            partial(_mend_edge, edges[n], strips[n], masks[n], charts, canvases, candidates) for n in members
        ]
        run_tasks(tasks, threads=threads, progress=report)
        done += len(members)
    mended, offset = [], 0
    ordered = [n for members in schedule for n in members]
    for n in ordered:
        for strip in strips[n]:
            strip["cells"] += offset
            mended.append(strip)
        offset += len(masks[n])
    return mended, np.concatenate([np.zeros(0, np.uint8), *(masks[n] for n in ordered)])


def _mendable(edge: SharedEdge, charts: Sequence[Chart], block: int) -> EdgeMap | None:
    found = edge_map(edge, charts[edge.patch], charts[edge.other_patch])
    return found if found is not None and found.length >= block else None


def _edge_placements(
    edge: EdgeMap, options: PaperOptions, cells: int
) -> tuple[NDArray[np.void], NDArray[np.void]]:
    # Edge blocks from the start of the edge, a step apart; the last one is moved back to end with it.
    block, half, step = options.block, options.block // 2, options.block - options.overlap
    count = -(-(edge.length - options.overlap) // step)
    along = edge.start + np.minimum(np.arange(count) * step, edge.length - block) + half
    on_a = np.zeros(count, PLACEMENT)
    on_a["chart"] = edge.chart_a
    on_a["row"], on_a["column"] = (along, edge.line) if edge.along_rows else (edge.line, along)
    on_a["cells"] = np.arange(count) * 2 * cells
    on_a["height"] = on_a["width"] = block
    on_a["mask"], on_a["cell"], on_a["feather"] = MASK_CUT, 2**options.levels // 2, FEATHER_PASSES
    on_b = on_a.copy()
    on_b["chart"] = edge.chart_b
    on_b["symmetry"] = edge.turn_b
    on_b["cells"] += cells
    # The rectangle's far corners, seen from B: its top left one is where the centre is counted from.
    near = edge.to_b(on_a["row"] - half, on_a["column"] - half)
    far = edge.to_b(on_a["row"] + half - 1, on_a["column"] + half - 1)
    on_b["row"] = np.minimum(near[0], far[0]) + half
    on_b["column"] = np.minimum(near[1], far[1]) + half
    return on_a, on_b


def _mend_edge(
    edge: EdgeMap,
    strips: tuple[NDArray[np.void], NDArray[np.void]],
    cells: NDArray[np.uint8],
    charts: Sequence[Chart],
    canvases: Sequence[Canvas],
    candidates: Candidates,
) -> None:
    a, b = edge.chart_a, edge.chart_b
    for start in range(0, len(strips[0]), _BLOCKS_PER_CALL):
        lay_edge_blocks(
            canvases[a],
            canvases[b],
            (charts[a].height, charts[a].width),
            (charts[b].height, charts[b].width),
            edge.map_b,
            edge.along_rows,
            *strips,
            cells,
            start,
            min(start + _BLOCKS_PER_CALL, len(strips[0])),
            candidates.working,
            candidates.channels,
            candidates.tile,
            candidates.table,
            candidates.grid[1],
            *candidates.shape,
            SYMMETRIES,
        )
