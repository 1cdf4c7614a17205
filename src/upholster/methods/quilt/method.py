"""Method "quilt": one texture over the whole surface, chart after chart, block after block.

Charts are laid in colour classes: those of one class do not touch. A chart first gets the blocks that reach
it from its finished neighbours (`upholster.methods.quilt.transfer`). Then come its own blocks in raster
order, each a good match of what it overlaps, cut along the least difference (`upholster.methods.quilt.lay`);
then others over the worst cuts (`upholster.methods.quilt.refinement`).
Where a neighbour is not laid yet, blocks reach beyond the edge and are transferred to it later.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from upholster.charts.schedule import schedule
from upholster.charts.seams import ChartSeam, Transition, find_seams, transitions
from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.methods.quilt._phase_kernels import MISFIT
from upholster.methods.quilt.emit import emit_list, emit_plan
from upholster.methods.quilt.grid import BlockGrid, has_coarse_cells
from upholster.methods.quilt.landmarks import LandmarkRules, ShownBlocks
from upholster.methods.quilt.lay import lay_chart
from upholster.methods.quilt.match_pyramid import MatchPyramid
from upholster.methods.quilt.options import QuiltOptions
from upholster.methods.quilt.phases import Phases, WantedPhases
from upholster.methods.quilt.transfer import BlockTransfer, ChartPlacements
from upholster.parallel import run_tasks
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.quilt.plans import Plan
from upholster.quilt.warp_field import WarpField
from upholster.types import FloatArray, PixelArray, Progress

__all__ = ["synthesize_quilt"]

_MIRRORED = 1 << 5
"""The symmetry that mirrors left and right: columns count backwards."""


def synthesize_quilt(
    exemplar: PixelArray,
    surface: Surface,
    charts: Sequence[Chart],
    fields: Sequence[WarpField] | None = None,
    *,
    options: QuiltOptions | None = None,
    phases: WantedPhases | None = None,
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
    phases
        Of a sample that repeats: where in its periods it shall be. None: it is not looked at.
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
    fields = tuple(fields) if fields else (WarpField.identity(),) * len(charts)
    seams = () if wrap else find_seams(surface, charts)
    classes = [[0]] if wrap else schedule(surface, charts, seams)
    run = _run(exemplar, surface, charts, fields, seams, options, phases, wrap, seed)
    finished: list[ChartPlacements | None] = [None] * len(charts)
    shown: list[ShownBlocks | None] = [None] * len(charts)
    usage = run.match_pyramid.empty_usage(run.symmetries.bit_count())
    done = 0
    for members in classes:
        usage = _lay_class(run, members, finished, shown, usage, done, threads, progress)
        done += len(members)
    laid = [part for part in finished if part is not None]
    order = [n for members in classes for n in members]
    plan: Plan = emit_list(charts, laid[0]) if wrap else emit_plan(charts, run.grids, laid, order)
    return Quilt(tuple(charts), (exemplar.shape[0], exemplar.shape[1]), plan, fields)


@dataclass(frozen=True, eq=False, slots=True)
class _Run:
    """What stays the same while charts are laid.

    Attributes
    ----------
    grids
        Where each chart's own blocks lie.
    transfer
        How blocks get from chart to chart.
    match_pyramid
        The exemplar as blocks are compared by it.
    weights
        Of `LayWeights`: evenness and variety, each times the exemplar's variance, the choice's tolerance,
        and what a unit of misfit costs.
    phases
        Those that the surface wants, None where none are looked at.
    landmarks
        What catches the eye in the sample.
    seeds
        Of each chart's random numbers.
    shortlist
        Candidates that are judged at full resolution.
    symmetries
        Which symmetries charts' own blocks may have, a bit for each.
    wrap
        Whether the one chart's opposite edges meet.
    effort
        How often charts are gone through to refine them.
    """

    grids: list[BlockGrid]
    transfer: BlockTransfer
    match_pyramid: MatchPyramid
    weights: FloatArray
    phases: Phases | None
    landmarks: LandmarkRules
    seeds: list[int]
    shortlist: int
    symmetries: int
    wrap: bool
    effort: int


def _run(
    exemplar: PixelArray,
    surface: Surface,
    charts: Sequence[Chart],
    fields: tuple[WarpField, ...],
    seams: Sequence[ChartSeam],
    options: QuiltOptions,
    phases: WantedPhases | None,
    wrap: bool,
    seed: int,
) -> _Run:
    # A block that is transferred may begin between pixels and end beyond the exemplar.
    copied = len(charts) == 1 and fields[0].is_identity and not seams
    shape = exemplar.shape[0], exemplar.shape[1]
    symmetries = _symmetries(options)
    # A quarter turn changes height and width.
    fitting = (min(shape), min(shape)) if options.rotate else shape
    sizes = options.block, options.overlap
    coarse = has_coarse_cells(charts, fields, options.block, in_step=phases is not None)
    grids = [
        BlockGrid.of(chart, field, fitting, *sizes, coarse=coarse, copied=copied, wrap=wrap, most=most)
        for chart, field, most in zip(charts, fields, _largest_blocks(charts, seams), strict=True)
    ]
    lattice, surface_phases = (None, None) if phases is None else (phases.lattice, phases.surface)
    match_pyramid = MatchPyramid.of(exemplar, max(grid.level for grid in grids), lattice)
    onto: list[list[Transition]] = [[] for _ in charts]
    around: list[list[Transition]] = [[] for _ in charts]
    for transition in transitions(surface, charts, seams):
        seam = transition.seam
        if seam.chart != seam.other_chart:
            onto[seam.other_chart].append(transition)
        elif abs(seam.edge - seam.other_edge) == 2:
            around[seam.chart].append(transition)
    cells = [grid.mask_cell for grid in grids]
    transfer = BlockTransfer(charts, fields, onto, around, shape, cells, grids[0].feather)
    variance = match_pyramid.variance
    phase = 0.0 if phases is None else phases.weight * variance / MISFIT
    weights = np.array([options.evenness * variance, options.variety * variance, options.tolerance, phase])
    landmarks = LandmarkRules.of(
        match_pyramid.form,
        surface,
        charts,
        fields,
        weight=options.variety * variance,
        block=options.block,
        shape=match_pyramid.empty_usage().shape,
        wrap=wrap,
    )
    seeds = [
        int(child.generate_state(1, np.uint64)[0])
        for child in np.random.SeedSequence(seed).spawn(len(charts))
    ]
    return _Run(
        grids,
        transfer,
        match_pyramid,
        weights,
        surface_phases,
        landmarks,
        seeds,
        options.shortlist,
        symmetries,
        wrap,
        options.effort,
    )


def _symmetries(options: QuiltOptions) -> int:
    # Which symmetries blocks may have, a bit for each: see `upholster.quilt.placement.SYMMETRIES`.
    turns = 0b1111 if options.rotate else 1
    return turns | (turns << 4 if options.rotate else _MIRRORED) if options.mirror else turns


def _largest_blocks(charts: Sequence[Chart], seams: Sequence[ChartSeam]) -> list[tuple[float, float]]:
    # The largest height and width of a block: where a chart meets itself, one fits in between.
    most = [[np.inf, np.inf] for _ in charts]
    for seam in seams:
        if seam.chart == seam.other_chart:
            chart = charts[seam.chart]
            most[seam.chart][seam.edge & 1] = chart.width if seam.edge & 1 else chart.height
    return [(min(512.0, tall), min(512.0, wide)) for tall, wide in most]


def _lay_class(
    run: _Run,
    members: list[int],
    finished: list[ChartPlacements | None],
    shown: list[ShownBlocks | None],
    usage: FloatArray,
    done: int,
    threads: int | None,
    progress: Progress | None,
) -> FloatArray:
    # Lays the charts of one colour class side by side, enters them among the finished ones, and returns the
    # usage with theirs: each of them counted from the same state.
    results: list[tuple[ChartPlacements, FloatArray, ShownBlocks] | None] = [None] * len(members)

    def lay(k: int) -> None:
        n = members[k]
        results[k] = lay_chart(
            n,
            run.grids[n],
            run.transfer,
            finished,
            run.match_pyramid,
            usage,
            run.weights,
            phases=run.phases,
            landmarks=run.landmarks,
            shown=shown,
            shortlist=run.shortlist,
            symmetries=run.symmetries,
            wrap=run.wrap,
            seed=run.seeds[n],
            number=(done + k) << 32,
            effort=run.effort,
        )

    def report(_stage: str, count: int, _total: int) -> None:
        if progress is not None:
            progress("blocks", done + count, len(finished))

    run_tasks([partial(lay, k) for k in range(len(members))], threads=threads, progress=report)
    total = usage
    for n, result in zip(members, results, strict=True):
        assert result is not None
        finished[n], shown[n] = result[0], result[2]
        total = total + (result[1] - usage)
    return total
