"""Method "quilt": one texture over the whole surface, chart after chart, block after block.

Charts are laid in colour classes: those of one class do not touch. A chart first gets the blocks that reach
it from its finished neighbours (`upholster.methods.quilt.transfer`). Then come its own blocks in raster
order, each a good match of what it overlaps, cut along the least difference (`upholster.methods.quilt.lay`);
then others over the worst cuts (`upholster.methods.quilt.refinement`).
Where a neighbour is not laid yet, blocks reach beyond the edge and are transferred to it later.
"""

from collections.abc import Sequence, Set
from functools import partial

from upholster.geometry import Surface
from upholster.methods.quilt.emit import LABEL_CELL, emitted_quilt, tile_cell
from upholster.methods.quilt.options import QuiltOptions
from upholster.methods.quilt.phases import WantedPhases
from upholster.methods.quilt.run import LaidPart, Progressing, QuiltRun, lay_one, planned
from upholster.methods.quilt.transfer import ChartPlacements
from upholster.parallel import run_tasks
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.quilt.warp_field import WarpField
from upholster.types import PixelArray, Progress

__all__ = ["emitted", "lay_all", "synthesize_quilt"]


def synthesize_quilt(
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
    turning
        Charts about a corner of which the direction turns: their blocks are small.
    seed
        0 to 2^63 − 1; the same seed gives the same quilt whatever the number of threads.
    threads, progress
        As in `upholster.parallel.run_tasks`; stage "blocks".

    Raises
    ------
    InputError
        If something is out of range or does not fit together.
    """
    run = planned(
        exemplar, surface, charts, fields,
        options=options, phases=phases, wrap=wrap, turning=turning, seed=seed,
    )  # fmt: skip
    finished = lay_all(run, threads=threads, progress=progress)
    return emitted(run, finished, (exemplar.shape[0], exemplar.shape[1]), threads=threads)


def lay_all(
    run: QuiltRun, *, threads: int | None = None, progress: Progress | None = None
) -> list[ChartPlacements]:
    """Lay all charts in this process; return each one's placements."""
    finished: list[ChartPlacements | None] = [None] * len(run.charts)
    so_far = Progressing.of(run)
    for number, members in enumerate(run.classes):
        parts: list[LaidPart | None] = [None] * len(members)
        done = len(run.before(number))

        def lay(k: int, number: int = number, parts: list[LaidPart | None] = parts) -> None:
            n = run.classes[number][k]
            finished[n], parts[k] = lay_one(run, n, number, so_far)

        def report(_stage: str, count: int, _total: int, done: int = done) -> None:
            if progress is not None:
                progress("blocks", done + count, len(run.charts))

        run_tasks([partial(lay, k) for k in range(len(members))], threads=threads, progress=report)
        so_far.enter(members, [part for part in parts if part is not None])
    return [laid for laid in finished if laid is not None]


def emitted(
    run: QuiltRun,
    laid: Sequence[ChartPlacements],
    exemplar_shape: tuple[int, int],
    *,
    threads: int | None = None,
) -> Quilt:
    """Return the quilt of all charts' placements."""
    cell = tile_cell(run.charts[0]) if run.wrap else LABEL_CELL
    return emitted_quilt(run.charts, run.fields, exemplar_shape, laid, cell=cell, threads=threads)
