"""Method "quilt": one texture over the whole surface, chart after chart, block after block.

Charts are covered in rounds: those of one round do not touch. A chart begins with what its finished
neighbours' blocks leave on it (`upholster.methods.quilt.transfer`); then its own blocks go on from there in
raster order, each the best match of what it overlaps, cut along the least difference (`lay_quilt`). Where a
neighbour is still to come, blocks reach beyond the edge, for the neighbour to go on from.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.charts.schedule import schedule
from upholster.charts.seams import Transition, find_seams, transitions
from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.methods.quilt.grid import BlockGrid
from upholster.methods.quilt.lay import lay_chart
from upholster.methods.quilt.match_pyramid import MatchPyramid
from upholster.methods.quilt.transfer import BlockTransfer, ChartPlacements, joined
from upholster.options import SynthesisOptions
from upholster.parallel import run_tasks
from upholster.quilt.model import Chart, Quilt
from upholster.quilt.warp_field import WarpField, node_count
from upholster.types import FloatArray, PixelArray, Progress

__all__ = ["QuiltOptions", "synthesize_quilt"]


@dataclass(frozen=True, slots=True, kw_only=True)
class QuiltOptions(SynthesisOptions):
    """Options of method "quilt", all settled.

    Attributes
    ----------
    block
        Side of a block in exemplar pixels.
    """

    block: int = 40


def synthesize_quilt(
    exemplar: PixelArray,
    surface: Surface,
    charts: Sequence[Chart],
    fields: Sequence[WarpField | None] | None = None,
    *,
    options: QuiltOptions | None = None,
    wrap: bool = False,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Quilt:
    """Cover a surface with one texture.

    Parameters
    ----------
    exemplar
        (H, W, C), any number of channels; uint8, uint16 or float32.
    surface
        The surface.
    charts, fields
        The layout, see `upholster.charts.layout` and `upholster.charts.directions`; without fields, a
        texel is an exemplar pixel.
    options
        Parameters of the method.
    wrap
        Whether the one chart's opposite edges meet, so that it tiles.
    seed
        0 to 2^63 − 1; the same seed gives the same quilt whatever the number of threads.
    threads, progress
        As in `upholster.parallel.run_tasks`; stage "blocks".

    Raises
    ------
    InputError
        If something is out of range or does not fit together.
    """
    options = options or QuiltOptions()
    if not 0 <= seed < 2**63:
        raise InputError(f"seed is {seed}; allowed: 0 to 2^63 - 1")
    if wrap and len(charts) != 1:
        raise InputError(f"{len(charts)} charts can not wrap; allowed: 1")
    if not fields:
        fields = (None,) * len(charts)
    if len(charts) > 1:
        # What is transferred from chart to chart may begin between pixels and end beyond the exemplar.
        fields = [field or _identity(chart) for field, chart in zip(fields, charts, strict=True)]
    grids = [
        BlockGrid.of(chart, field, exemplar.shape[:2], options.block, options.overlap, wrap=wrap)
        for chart, field in zip(charts, fields, strict=True)
    ]
    match_pyramid = MatchPyramid.of(exemplar, max(grid.level for grid in grids))
    found = () if wrap else find_seams(surface, charts)
    onto: list[list[Transition]] = [[] for _ in charts]
    for transition in transitions(surface, charts, found):
        if transition.seam.chart != transition.seam.other_chart:
            onto[transition.seam.other_chart].append(transition)
    cells = tuple(grid.cell for grid in grids)
    transfer = BlockTransfer(
        charts, fields, onto, (exemplar.shape[0], exemplar.shape[1]), cells, grids[0].feather
    )
    seeds = [
        int(child.generate_state(1, np.uint64)[0])
        for child in np.random.SeedSequence(seed).spawn(len(charts))
    ]
    weights = np.array(
        [
            options.evenness * match_pyramid.variance,
            options.variety * match_pyramid.variance,
            options.tolerance,
        ]
    )
    finished: list[ChartPlacements | None] = [None] * len(charts)
    usage = match_pyramid.empty_usage()
    done = 0

    def report(_stage: str, count: int, _total: int) -> None:
        if progress is not None:
            progress("blocks", done + count, len(charts))

    for members in schedule(surface, charts, found) if not wrap else [[0]]:
        results: list[tuple[ChartPlacements, FloatArray] | None] = [None] * len(members)

        def cover(
            k: int,
            members: list[int] = members,
            results: list[tuple[ChartPlacements, FloatArray] | None] = results,
            done: int = done,
            usage: FloatArray = usage,
        ) -> None:
            n = members[k]
            results[k] = lay_chart(
                n,
                grids[n],
                transfer.transferred_onto(n, finished),
                transfer.open_sides(n, finished),
                transfer.closed(n, finished),
                match_pyramid,
                usage,
                weights,
                shortlist=options.shortlist,
                wrap=wrap,
                seed=seeds[n],
                number=(done + k) << 32,
            )

        run_tasks([partial(cover, k) for k in range(len(members))], threads=threads, progress=report)
        # Every chart of a round counted on from the same state.
        before = usage
        for n, result in zip(members, results, strict=True):
            assert result is not None
            finished[n] = result[0]
            usage = usage + (result[1] - before)
        done += len(members)
    whole = joined([laid for laid in finished if laid is not None])
    placed = whole.placements[_touching(whole.placements, charts)]
    shape = exemplar.shape[0], exemplar.shape[1]
    return Quilt(tuple(charts), shape, placed, whole.cells, tuple(fields) if any(fields) else ())


def _touching(placed: NDArray[np.void], charts: Sequence[Chart]) -> NDArray[np.bool_]:
    # What was transferred as far as a chart's surroundings, for its neighbours to see, need not be painted.
    sizes = np.array([(chart.height, chart.width) for chart in charts])[placed["chart"]]
    top, left = placed["row"] - placed["height"] // 2, placed["column"] - placed["width"] // 2
    inside = (top < sizes[:, 0]) & (left < sizes[:, 1])
    found: NDArray[np.bool_] = inside & (top + placed["height"] > 0) & (left + placed["width"] > 0)
    return found


def _identity(chart: Chart) -> WarpField:
    shape = node_count(chart.height, 1), node_count(chart.width, 1), 4
    return WarpField(np.zeros(shape, np.int16))
