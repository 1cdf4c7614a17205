"""Method "paper": the paper's synthesis, step by step (its sections 4.1 to 4.4; our readings: docs/paper.md).

Each chart is covered separately, block by block in raster order; then *edge blocks* repair every shared edge.
The chosen blocks become placements and label maps. The charts' texels exist here only in working form, as
canvases to match against.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.types import IntArray, PixelArray
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart
from upholster.quilt.labels import LabelMap, label_shape
from upholster.quilt.model import Quilt
from upholster.runtime.parallel import run_tasks
from upholster.synthesis.paper._paper_kernels import (
    EdgeBlocks,
    SharedCharts,
    lay_chart_blocks,
    lay_edge_blocks,
)
from upholster.synthesis.paper.layers import Layer, block_layer, edge_placements, on_cells
from upholster.synthesis.paper.matching import Candidates
from upholster.synthesis.paper.strips import Strip, block_count, color_classes, strip_along

__all__ = ["PaperOptions", "synthesize_paper"]

logger = logging.getLogger(__name__)

_BLOCKS_PER_CALL = 256

Canvas = NDArray[np.uint16]


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperOptions(SynthesisOptions):
    """Options of method "paper", with all values set.

    Attributes
    ----------
    block
        Side of a block in texels. The paper's edge blocks are 32; 64 is the other reading of its section 4.3.
    edge_block
        Side of an edge block in texels; None: that of a block.
    overlap
        Width in texels of the overlap with the previous block.
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
) -> Quilt:
    """Cover a surface by the paper's method. Progress has the stages "blocks" and "seams".

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
    chosen = [np.zeros(_block_grid(chart, options), np.int32) for chart in charts]
    canvases = _canvases(charts, candidates) if options.seams else None

    def cover(n: int) -> None:
        canvas = canvases[n] if canvases is not None else _canvases([charts[n]], candidates)[0]
        _cover_chart(canvas, chosen[n], candidates.tile_of(firsts[n]), options, candidates)

    run_tasks([partial(cover, n) for n in range(len(charts))], stage="blocks")
    block, overlap, shape = options.block, options.overlap, exemplar.shape[:2]
    layers = [
        [block_layer(chart, candidates.pixels(found), block=block, overlap=overlap, shape=shape)]
        for chart, found in zip(charts, chosen, strict=True)
    ]
    if canvases is not None:
        seams = _Seams.of(surface, charts, options, candidates)
        seams.mend(canvases)
        for n, layer in enumerate(seams.layers(shape)):
            layers[n].append(layer)
    return _quilt(charts, shape, layers)


def _quilt(charts: Sequence[Chart], shape: tuple[int, ...], layers: Sequence[Sequence[Layer]]) -> Quilt:
    # Numbers of placements continue from a chart's first layer to its second.
    parts, labels = [], []
    for n, own in enumerate(layers):
        count, maps = 0, []
        for index, (placed, layer) in enumerate(own):
            placed["chart"], placed["layer"] = n, index
            numbers = np.where(layer.labels < 0, -1, layer.labels + count).astype(np.int32)
            maps.append(replace(layer, labels=numbers))
            count += len(placed)
            parts.append(placed)
        labels.append(tuple(maps))
    return Quilt(tuple(charts), (shape[0], shape[1]), np.concatenate(parts), tuple(labels))


def _block_grid(chart: Chart, options: PaperOptions) -> tuple[int, int]:
    # Rows and columns of blocks on a chart.
    block, overlap = options.block, options.overlap
    return block_count(chart.height, block, overlap), block_count(chart.width, block, overlap)


def _check_room(exemplar: PixelArray, charts: Sequence[Chart], options: PaperOptions) -> None:
    # Raises InputError if a block or an edge block is larger than the exemplar or a chart.
    name, most = "a block", options.block
    if options.seams and options.edge_block is not None and options.edge_block > most:
        name, most = "an edge block", options.edge_block
    for what, (height, width) in [
        ("exemplar", exemplar.shape[:2]),
        *((f"chart {n}", (chart.height, chart.width)) for n, chart in enumerate(charts)),
    ]:
        if min(height, width) < most:
            raise InputError(f"{what} is {width}×{height}; allowed: at least {name} ({most}) each way")


def _canvases(charts: Sequence[Chart], candidates: Candidates) -> list[Canvas]:
    # Padded to whole tiles. All in one piece of memory, which is returned to the system in one piece.
    tile = candidates.tile
    shapes = [
        (-(-chart.height // tile) * tile, -(-chart.width // tile) * tile * candidates.channels)
        for chart in charts
    ]
    ends = np.cumsum([0, *(rows * samples for rows, samples in shapes)])
    memory = np.zeros(ends[-1], np.uint16)
    return [memory[ends[n] : ends[n + 1]].reshape(shape) for n, shape in enumerate(shapes)]


def _cover_chart(
    canvas: Canvas, chosen: IntArray, first: int, options: PaperOptions, candidates: Candidates
) -> None:
    # Few blocks per call: between two calls, Python can be interrupted.
    down, across = chosen.shape
    chunk = max(1, _BLOCKS_PER_CALL // across)
    for start in range(0, down, chunk):
        lay_chart_blocks(
            canvas,
            chosen,
            (start, min(start + chunk, down)),
            first,
            (options.block, options.overlap),
            candidates.numbers,
            candidates.working,
            candidates.table,
        )


@dataclass(frozen=True, eq=False)
class _Seams:
    """The edge blocks along all shared edges.

    Attributes
    ----------
    charts
        The layout.
    strips
        The strip of each edge.
    blocks
        The blocks of each strip; their labels continue from strip to strip.
    classes
        The strips, as numbers, in classes that have no chart in common, in the order of processing.
    labels
        Label map of each chart's second layer.
    candidates
        Candidates for blocks of this size.
    """

    charts: Sequence[Chart]
    strips: Sequence[Strip]
    blocks: Sequence[EdgeBlocks]
    classes: Sequence[Sequence[int]]
    labels: Sequence[IntArray]
    candidates: Candidates

    @classmethod
    def of(
        cls, surface: Surface, charts: Sequence[Chart], options: PaperOptions, candidates: Candidates
    ) -> "_Seams":
        """Find the edges whose texels match one to one, and the positions of their blocks."""
        side = options.block if options.edge_block is None else options.edge_block
        cell = 2**options.levels // 2
        found = [strip_along(edge, charts, side) for edge in surface.shared]
        strips = [strip for strip in found if strip is not None]
        if len(strips) < len(found):
            logger.info(
                "%d of %d shared edges meet at different texel sizes and are not repaired",
                len(found) - len(strips),
                len(found),
            )
        corners = [strip.corners(charts[strip.a], side, options.overlap) for strip in strips]
        numbers = np.cumsum([0, *(2 * len(part) for part in corners)]).tolist()
        blocks = [
            EdgeBlocks(part, np.zeros(len(part), np.int32), number, side, cell)
            for part, number in zip(corners, numbers[:-1], strict=True)
        ]
        labels = [np.full(label_shape(chart.height, chart.width, cell), -1, np.int32) for chart in charts]
        classes = color_classes([(strip.a, strip.b) for strip in strips])
        return cls(charts, strips, blocks, classes, labels, replace(candidates, block=side))

    def mend(self, canvases: Sequence[Canvas]) -> None:
        """Choose and cut all edge blocks, and add them to canvases and labels."""
        done = 0
        # Edges of one class have no chart in common, so they can be repaired in parallel, in any order.
        for members in self.classes:
            tasks = [partial(self._mend_edge, n, canvases) for n in members]
            run_tasks(tasks, stage="seams", share=(done, len(tasks), len(self.strips)))
            done += len(members)

    def _mend_edge(self, index: int, canvases: Sequence[Canvas]) -> None:
        strip, blocks = self.strips[index], self.blocks[index]
        a, b = self.charts[strip.a], self.charts[strip.b]
        charts = SharedCharts(
            canvases[strip.a],
            canvases[strip.b],
            self.labels[strip.a],
            self.labels[strip.b],
            (a.height, a.width),
            (b.height, b.width),
            strip.map_to_b(a, b),
            strip.along_rows,
        )
        count, found = len(blocks.corners), self.candidates
        for start in range(0, count, _BLOCKS_PER_CALL):
            members = (start, min(start + _BLOCKS_PER_CALL, count))
            lay_edge_blocks(charts, blocks, members, found.numbers, found.working, found.table)

    def layers(self, shape: tuple[int, ...]) -> list[Layer]:
        """Return each chart's second layer; none if there are no edge blocks at all."""
        if not self.strips:
            return []
        placed = [
            edge_placements(
                strip, self.charts, blocks.side, blocks.corners, self.candidates.pixels(blocks.chosen)
            )
            for strip, blocks in zip(self.strips, self.blocks, strict=True)
        ]
        flat = np.concatenate(placed).reshape(-1)
        return [on_cells(flat, LabelMap(self.blocks[0].cell, part), shape) for part in self.labels]
