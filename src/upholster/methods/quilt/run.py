"""Laying the charts of a quilt, one at a time: what it needs, and what each leaves to those after it.

A chart is laid from the run, which stays the same, and from what finished charts have left: their overhangs,
where they show landmarks, and how much of the exemplar is used. Nothing else goes from chart to chart, so
that charts can be laid in other processes as well.
"""

from collections.abc import Sequence, Set
from dataclasses import dataclass
from functools import partial

import numpy as np

from upholster.charts.phases import PhaseField
from upholster.charts.schedule import schedule
from upholster.charts.seams import ChartSeam, find_seams
from upholster.charts.transitions import Transition, transitions
from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.methods.quilt._phase_kernels import MISFIT
from upholster.methods.quilt.grid import BlockGrid, coarse_cells
from upholster.methods.quilt.landmarks import LandmarkRules, ShownBlocks
from upholster.methods.quilt.lay import lay_chart
from upholster.methods.quilt.masked import touches
from upholster.methods.quilt.match_pyramid import MatchPyramid
from upholster.methods.quilt.options import QuiltOptions
from upholster.methods.quilt.phases import Phases, WantedPhases
from upholster.methods.quilt.transfer import BlockTransfer, ChartPlacements
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import WarpField
from upholster.types import FloatArray, PixelArray

__all__ = ["LaidPart", "Progressing", "QuiltRun", "lay_one", "planned"]

_TURNING = 20.0
"""Texels: side of blocks on charts about a corner of which the direction turns. Larger ones would be bent,
and could not be shown on the chart beside."""

_MIRRORED = 1 << 5
"""The symmetry that mirrors left and right: columns count backwards."""


@dataclass(frozen=True, eq=False, slots=True)
class QuiltRun:
    """What stays the same while charts are laid.

    Attributes
    ----------
    charts, fields
        The layout.
    classes
        The charts in the order in which they are laid: those of one class side by side.
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
    density
        Texels for a step of the charts, each way: of `Quilt`.
    """

    charts: tuple[Chart, ...]
    fields: tuple[WarpField, ...]
    classes: list[list[int]]
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
    density: float

    def before(self, number: int) -> list[int]:
        """Return the charts that are laid before the class of that number, in the order of laying."""
        return [n for members in self.classes[:number] for n in members]


@dataclass(eq=False, slots=True)
class Progressing:
    """What charts that are laid leave to others.

    Attributes
    ----------
    overhangs
        Of finished charts, see `BlockTransfer.overhang`; None elsewhere.
    shown
        Where finished charts show landmarks, None elsewhere.
    usage
        How much of the exemplar has been used, by all classes that are done.
    """

    overhangs: list[ChartPlacements | None]
    shown: list[ShownBlocks | None]
    usage: FloatArray

    @classmethod
    def of(cls, run: QuiltRun) -> "Progressing":
        """Return what there is before the first chart."""
        count = len(run.charts)
        return cls([None] * count, [None] * count, run.match_pyramid.empty_usage(run.symmetries.bit_count()))

    def enter(self, members: Sequence[int], parts: Sequence["LaidPart"]) -> None:
        """Enter the charts of a class that is done; usage is that of all, each counted from one state."""
        total = self.usage
        for n, part in zip(members, parts, strict=True):
            self.overhangs[n], self.shown[n] = part.overhang, part.shown
            total = total + (part.usage - self.usage)
        self.usage = total


@dataclass(frozen=True, eq=False, slots=True)
class LaidPart:
    """What one chart leaves to others: its overhang, where it shows landmarks, and usage with its own.

    For reports also how many placements touch a chart.
    """

    overhang: ChartPlacements
    shown: ShownBlocks
    usage: FloatArray
    placements: int


def lay_one(run: QuiltRun, n: int, number: int, so_far: Progressing) -> tuple[ChartPlacements, LaidPart]:
    """Lay a chart of the class of that number.

    Of `so_far` those overhangs are looked at that `BlockTransfer.asked_of` tells, and all that is shown.
    """
    done = len(run.before(number))
    laid, usage, shown = lay_chart(
        n,
        run.grids[n],
        run.transfer,
        so_far.overhangs,
        run.match_pyramid,
        so_far.usage,
        run.weights,
        phases=run.phases,
        landmarks=run.landmarks,
        shown=so_far.shown,
        shortlist=run.shortlist,
        symmetries=run.symmetries,
        wrap=run.wrap,
        seed=run.seeds[n],
        number=(done + run.classes[number].index(n)) << 32,
        effort=run.effort,
    )
    count = int(touches(laid.placements, run.charts[n]).sum())
    return laid, LaidPart(run.transfer.overhang(n, laid), shown, usage, count)


def planned(
    exemplar: PixelArray,
    surface: Surface,
    charts: Sequence[Chart],
    fields: Sequence[WarpField] | None = None,
    *,
    options: QuiltOptions | None = None,
    phases: WantedPhases | None = None,
    wrap: bool = False,
    turning: Set[int] = frozenset(),
    seed: int = 0,
    density: float = 1.0,
) -> QuiltRun:
    """Settle all that charts are laid by; parameters as of `synthesize_quilt`.

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
    # A block that is transferred may begin between pixels and end beyond the exemplar.
    copied = len(charts) == 1 and fields[0].is_identity and not seams
    shape = exemplar.shape[0], exemplar.shape[1]
    symmetries = _symmetries(options)
    # A quarter turn changes height and width.
    fitting = (min(shape), min(shape)) if options.rotate else shape
    coarse = coarse_cells(charts, fields, {options.block}, in_step=phases is not None)
    fit = partial(BlockGrid.of, overlap=options.overlap, copied=copied, wrap=wrap)
    grids = [
        fit(chart, field, fitting, options.block, most=most, coarse=coarse[options.block])
        for chart, field, most in zip(charts, fields, _largest_blocks(charts, seams, turning), strict=True)
    ]
    lattice, surface_phases = (None, None) if phases is None else (phases.lattice, phases.surface)
    assert not isinstance(surface_phases, PhaseField)
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
    transfer = BlockTransfer(charts, fields, onto, around, shape, cells)
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
    return QuiltRun(
        tuple(charts),
        fields,
        classes,
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
        density,
    )


def _symmetries(options: QuiltOptions) -> int:
    # Which symmetries blocks may have, a bit for each: see `upholster.quilt.placement.SYMMETRIES`.
    turns = 0b1111 if options.rotate else 1
    return turns | (turns << 4 if options.rotate else _MIRRORED) if options.mirror else turns


def _largest_blocks(
    charts: Sequence[Chart], seams: Sequence[ChartSeam], turning: Set[int]
) -> list[tuple[float, float]]:
    # The largest height and width of a block: where a chart meets itself, one fits in between; and where the
    # direction turns, it turns by little inside a block.
    most = [[_TURNING if n in turning else np.inf] * 2 for n in range(len(charts))]
    for seam in seams:
        if seam.chart == seam.other_chart:
            chart = charts[seam.chart]
            most[seam.chart][seam.edge & 1] = chart.width if seam.edge & 1 else chart.height
    return [(min(512.0, tall), min(512.0, wide)) for tall, wide in most]
