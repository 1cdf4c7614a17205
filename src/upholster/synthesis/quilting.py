"""Method "quilt": one texture over the whole surface, chart after chart, block after block.

Charts are covered in rounds: those of one round do not touch. A chart begins with what its finished
neighbours' blocks leave on it (`upholster.synthesis.carrying`); then its own blocks go on from there in
raster order, each the best match of what it overlaps, cut along the least difference (`lay_quilt`). Where a
neighbour is still to come, blocks reach beyond the edge, for the neighbour to go on from.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.parallel import run_tasks
from upholster.synthesis.carrying import Carrying, Covering, joined
from upholster.synthesis.field import Field, node_count
from upholster.synthesis.laying import lay_chart
from upholster.synthesis.meetings import Carrier, carriers, meetings
from upholster.synthesis.quilt import Chart, Quilt
from upholster.synthesis.raster import Raster
from upholster.synthesis.rounds import rounds
from upholster.synthesis.sights import Sights
from upholster.types import FloatArray, PixelArray, Progress

__all__ = ["QuiltOptions", "synthesize_quilt"]


@dataclass(frozen=True, slots=True)
class QuiltOptions:
    """Parameters of method "quilt".

    Attributes
    ----------
    block
        Side of a block in exemplar pixels, 8 to 512.
    overlap
        Width of the overlap with blocks before, in exemplar pixels: at least 4, at most half a block; None:
        three tenths of a block.
    evenness
        How much it costs to use a part of the exemplar more than others: 0 (nothing) to 10, in variances of
        the exemplar per mean use.
    variety
        How much it costs to use a part of the exemplar again within sight of itself, likewise.
    slack
        Blocks are chosen at random among those that cost at most this many times the best: 1 to 2.
    shortlist
        Candidates that are judged at full resolution: 1 to 4096.

    Raises
    ------
    InputError
        If they are out of range or do not fit together.
    """

    block: int = 40
    overlap: int | None = None
    evenness: float = 0.2
    variety: float = 0.2
    slack: float = 1.1
    shortlist: int = 32

    def __post_init__(self) -> None:
        if not 8 <= self.block <= 512:
            raise InputError(f"block is {self.block}; allowed: 8 to 512")
        if self.overlap is not None and not 4 <= self.overlap <= self.block // 2:
            raise InputError(f"overlap is {self.overlap}; allowed: 4 to half a block ({self.block // 2})")
        for name, value in (("evenness", self.evenness), ("variety", self.variety)):
            if not 0 <= value <= 10:
                raise InputError(f"{name} is {value}; allowed: 0 to 10")
        if not 1 <= self.slack <= 2:
            raise InputError(f"slack is {self.slack}; allowed: 1 to 2")
        if not 1 <= self.shortlist <= 4096:
            raise InputError(f"shortlist is {self.shortlist}; allowed: 1 to 4096")


def synthesize_quilt(
    exemplar: PixelArray,
    surface: Surface,
    charts: Sequence[Chart],
    fields: Sequence[Field | None] | None = None,
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
        The layout, see `upholster.synthesis.layout` and `upholster.synthesis.directions`; without fields, a
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
        # What is carried from chart to chart may begin between pixels and end beyond the exemplar.
        fields = [field or _identity(chart) for field, chart in zip(fields, charts, strict=True)]
    rasters = [
        Raster.of(chart, field, exemplar.shape[:2], options.block, options.overlap, wrap=wrap)
        for chart, field in zip(charts, fields, strict=True)
    ]
    sights = Sights.of(exemplar, max(raster.level for raster in rasters))
    found = () if wrap else meetings(surface, charts)
    onto: list[list[Carrier]] = [[] for _ in charts]
    for carrier in carriers(surface, charts, found):
        if carrier.meeting.chart != carrier.meeting.other_chart:
            onto[carrier.meeting.other_chart].append(carrier)
    cells = tuple(raster.cell for raster in rasters)
    carrying = Carrying(
        charts, fields, onto, (exemplar.shape[0], exemplar.shape[1]), cells, rasters[0].feather
    )
    seeds = [
        int(child.generate_state(1, np.uint64)[0])
        for child in np.random.SeedSequence(seed).spawn(len(charts))
    ]
    weights = np.array([options.evenness * sights.variance, options.variety * sights.variance, options.slack])
    coverings: list[Covering | None] = [None] * len(charts)
    use = sights.unused()
    done = 0

    def report(_stage: str, count: int, _total: int) -> None:
        if progress is not None:
            progress("blocks", done + count, len(charts))

    for members in rounds(surface, charts, found) if not wrap else [[0]]:
        results: list[tuple[Covering, FloatArray] | None] = [None] * len(members)

        def cover(
            k: int,
            members: list[int] = members,
            results: list[tuple[Covering, FloatArray] | None] = results,
            done: int = done,
            use: FloatArray = use,
        ) -> None:
            n = members[k]
            results[k] = lay_chart(
                n,
                rasters[n],
                carrying.carried_onto(n, coverings),
                carrying.open_sides(n, coverings),
                carrying.closed(n, coverings),
                sights,
                use,
                weights,
                shortlist=options.shortlist,
                wrap=wrap,
                seed=seeds[n],
                number=(done + k) << 32,
            )

        run_tasks([partial(cover, k) for k in range(len(members))], threads=threads, progress=report)
        # Every chart of a round counted on from the same state.
        before = use
        for n, result in zip(members, results, strict=True):
            assert result is not None
            coverings[n] = result[0]
            use = use + (result[1] - before)
        done += len(members)
    whole = joined([covering for covering in coverings if covering is not None])
    placed = whole.placements[_touching(whole.placements, charts)]
    shape = exemplar.shape[0], exemplar.shape[1]
    return Quilt(tuple(charts), shape, placed, whole.cells, tuple(fields) if any(fields) else ())


def _touching(placed: NDArray[np.void], charts: Sequence[Chart]) -> NDArray[np.bool_]:
    # What was carried as far as a chart's surroundings, for its neighbours to see, need not be painted.
    sizes = np.array([(chart.height, chart.width) for chart in charts])[placed["chart"]]
    top, left = placed["row"] - placed["height"] // 2, placed["column"] - placed["width"] // 2
    inside = (top < sizes[:, 0]) & (left < sizes[:, 1])
    found: NDArray[np.bool_] = inside & (top + placed["height"] > 0) & (left + placed["width"] > 0)
    return found


def _identity(chart: Chart) -> Field:
    shape = node_count(chart.height, 1), node_count(chart.width, 1), 4
    return Field(np.zeros(shape, np.int16))
