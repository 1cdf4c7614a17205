"""Method "pixel": multi-resolution neighbourhood matching, texel by texel (our readings: docs/paper.md).

A pyramid of levels is covered from coarse to fine. On the coarsest level, texels are chosen one after another
by their neighbours that are already chosen. On each following level they start as the children of the level
above, and are chosen again by all their neighbours there and above. The choice for a texel is the pixel of
the exemplar that it shows.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from upholster.base.errors import InputError
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.types import IntArray, PixelArray
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import MAX_CHART, Chart
from upholster.quilt.labels import LabelMap
from upholster.quilt.model import Quilt
from upholster.quilt.placement import PLACEMENT
from upholster.runtime.parallel import run_tasks
from upholster.synthesis.pixel._pixel_kernels import REACH, ChosenTexels, PixelLevel, choose_pixels
from upholster.synthesis.pixel.exemplar_levels import NOTHING, doubled, exemplar_levels, scratch
from upholster.synthesis.pixel.surface_levels import SurfaceLevel

__all__ = ["PixelOptions", "check_sample", "synthesize_pixel"]

LARGEST_SAMPLE = 512
"""Pixels each way, because every one of them is a candidate."""

SIMILAR = 3
"""Number of similar pixels that are tried with each one that continues a neighbour (search "coherent")."""

PASSES = {"coherent": 2, "full": 1}
"""How often all texels of a level are chosen."""

APART = REACH + 1
"""Texels this far apart, each way, are in none of each other's neighbourhoods."""

_PAIRS_PER_CALL = 2**22
_COHERENT = 64
"""A texel of coherent search costs as much as this many candidates of full search; for sizes of tasks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PixelOptions(SynthesisOptions):
    """Options of method "pixel", with all values set."""

    method: str = "pixel"


def synthesize_pixel(
    exemplar: PixelArray,
    surface: Surface,
    charts: Sequence[Chart],
    *,
    options: PixelOptions | None = None,
    seed: int = 0,
) -> Quilt:
    """Cover a surface texel by texel. Progress has the stage "texels".

    Parameters
    ----------
    exemplar
        (H, W, C) uint8, uint16 or float32, C at most 4: 5·2^levels to 512 pixels each way. Pixels beyond
        whole tiles of 2^levels pixels are not used.
    surface
        The surface: neighbourhoods continue across its shared edges.
    charts
        The layout.
    options
        Parameters of the method.
    seed
        Chooses the first texel of each chart that starts without neighbours; the same seed gives the same
        quilt whatever the number of threads.

    Raises
    ------
    InputError
        If the exemplar is too small or too large, or the seed out of range.

    References
    ----------
    Wei, Levoy: Fast texture synthesis using tree-structured vector quantization, SIGGRAPH 2000, and Texture
    synthesis over arbitrary manifold surfaces, SIGGRAPH 2001; Ashikhmin: Synthesizing natural textures, I3D
    2001, on pixels that continue a neighbour's source; Tong et al., SIGGRAPH 2002, on k-coherence; Lefebvre,
    Hoppe: Parallel controllable texture synthesis, SIGGRAPH 2005, on texels in interleaved classes.
    """
    options = options or PixelOptions()
    check_sample(exemplar.shape[:2], options.levels)
    if not 0 <= seed < 2**63:
        raise InputError(f"seed is {seed}; allowed: 0 to 2^63 - 1")
    full = options.search == "full"
    pyramid = exemplar_levels(exemplar, levels=options.levels, similar=0 if full else SIMILAR)
    layouts = [SurfaceLevel.of(surface, charts, n) for n in range(options.levels + 1)]
    tasks = _Tasks(_total(layouts, PASSES[options.search]))
    sources, above = _first_texels(layouts[-1], pyramid[-1], seed, tasks), NOTHING
    for n in range(options.levels, -1, -1):
        coarser = None if n == options.levels else layouts[n + 1]
        if coarser is not None:
            coarser.refresh(sources)
            above = doubled(sources, pyramid[n + 1].width)
            sources = _children(above, layouts[n], coarser, pyramid[n].width)
        passes = 1 if coarser is None else PASSES[options.search]
        for _ in range(passes):
            _choose_again(sources, above, layouts[n], coarser, pyramid[n], full or coarser is None, tasks)
    return _quilt(sources, layouts[0], pyramid[0].width, exemplar.shape)


def check_sample(shape: tuple[int, ...], levels: int) -> None:
    """Raise InputError unless a sample (height, width) has candidates at all levels, and not too many."""
    least = (2 * REACH + 1) << levels
    if min(shape) < least:
        raise InputError(
            f"sample is {shape[1]}x{shape[0]} pixels; allowed with {levels} levels: {least} or more each way"
        )
    if max(shape) > LARGEST_SAMPLE:
        raise InputError(
            f"sample is {shape[1]}x{shape[0]} pixels; allowed: up to {LARGEST_SAMPLE} each way, for method "
            "'pixel' searches all of them"
        )


class _Tasks:
    """Runs tasks, and reports how many texels of all have been chosen."""

    def __init__(self, total: int) -> None:
        self._total, self._done = total, 0

    def run(self, tasks: Sequence[Callable[[], object]], texels: int) -> None:
        """Run tasks that choose so many texels in total."""
        run_tasks(tasks, stage="texels", share=(self._done, texels, self._total))
        self._done += texels


def _total(layouts: Sequence[SurfaceLevel], passes: int) -> int:
    # At the coarsest level, all texels are chosen one after another, and then once more.
    return sum((2 if layout is layouts[-1] else passes) * layout.texels for layout in layouts)


def _first_texels(layout: SurfaceLevel, level: PixelLevel, seed: int, tasks: _Tasks) -> IntArray:
    # Chooses the coarsest level's texels in raster order, chart after chart, each with the previous ones
    # known.
    sources = np.full(layout.count, -1, np.int32)
    inside = np.flatnonzero(level.inside)
    for n, child in enumerate(np.random.SeedSequence(seed).spawn(len(layout.charts))):
        lone = int(inside[np.random.default_rng(child).integers(len(inside))])
        layout.refresh_chart(sources, n)
        texels = layout.charts[n].height * layout.charts[n].width
        tasks.run([partial(_scan, sources, layout, n, level, lone)], texels)
    return sources


def _scan(sources: IntArray, layout: SurfaceLevel, index: int, level: PixelLevel, lone: int) -> None:
    chart, known = layout.charts[index], scratch(level)
    rows = _rows_per_call(chart.width, level, True)
    for row in range(0, chart.height, rows):  # between two calls, Python can be interrupted
        part = ChosenTexels(
            layout.firsts[index], layout.strides[index], 0, 0, row, min(row + rows, chart.height), 0,
            chart.width, 1, lone,
        )  # fmt: skip
        choose_pixels(sources, NOTHING, part, level, known, True)


def _rows_per_call(texels: int, level: PixelLevel, full: bool) -> int:
    candidates = int(level.inside.sum()) if full else _COHERENT
    return max(1, _PAIRS_PER_CALL // (candidates * max(1, texels)))


def _children(above: IntArray, layout: SurfaceLevel, coarser: SurfaceLevel, width: int) -> IntArray:
    # The start of texels of a finer level: the four pixels below their parent's.
    sources = np.full(layout.count, -1, np.int32)
    for n, chart in enumerate(layout.charts):
        parents = coarser.on_chart(above, n).repeat(2, axis=0).repeat(2, axis=1)
        rows, columns = np.arange(chart.height)[:, None] % 2, np.arange(chart.width) % 2
        layout.on_chart(sources, n)[:] = parents[: chart.height, : chart.width] + width * rows + columns
    return sources


def _choose_again(
    sources: IntArray,
    above: IntArray,
    layout: SurfaceLevel,
    coarser: SurfaceLevel | None,
    level: PixelLevel,
    full: bool,
    tasks: _Tasks,
) -> None:
    # Texels of one class are in none of each other's neighbourhoods, and the frames do not change, so they
    # can be chosen in parallel, in any order.
    for first_row, first_column in np.ndindex(APART, APART):
        layout.refresh(sources)
        parts: list[Callable[[], object]] = []
        count = 0
        for n, chart in enumerate(layout.charts):
            parent = (0, 0) if coarser is None else (coarser.firsts[n], coarser.strides[n])
            across = len(range(first_column, chart.width, APART))
            rows = APART * _rows_per_call(across, level, full)
            for row in range(first_row, chart.height, rows):
                end = min(row + rows, chart.height)
                count += across * len(range(row, end, APART))
                chosen = ChosenTexels(
                    layout.firsts[n],
                    layout.strides[n],
                    *parent,
                    row,
                    end,
                    first_column,
                    chart.width,
                    APART,
                    -1,
                )
                parts.append(partial(_choose, sources, above, chosen, level, full))
        tasks.run(parts, count)


def _choose(sources: IntArray, above: IntArray, texels: ChosenTexels, level: PixelLevel, full: bool) -> None:
    choose_pixels(sources, above, texels, level, scratch(level), full)


def _quilt(sources: IntArray, layout: SurfaceLevel, width: int, shape: tuple[int, ...]) -> Quilt:
    # Each texel is a cell. Texels whose relative positions equal those of their pixels share a placement.
    parts, labels = [], []
    for n in range(len(layout.charts)):
        rows, columns = np.divmod(layout.on_chart(sources, n).astype(np.int64), width)
        i, j = np.indices(rows.shape)
        offsets = (rows - i + MAX_CHART) * 2 * MAX_CHART + columns - j
        _, first, numbers = np.unique(offsets, return_index=True, return_inverse=True)
        order = np.argsort(first)
        first, rank = first[order], np.argsort(order)
        placed = np.zeros(len(first), PLACEMENT)
        placed["chart"] = n
        placed["row"], placed["column"] = 16 * i.flat[first] + 8, 16 * j.flat[first] + 8
        placed["source_row"], placed["source_column"] = 16 * rows.flat[first], 16 * columns.flat[first]
        parts.append(placed)
        own = rank[numbers].reshape(rows.shape).astype(np.int32)
        labels.append((LabelMap(1, np.pad(own, 1, mode="edge")),))
    return Quilt(tuple(layout.charts), (shape[0], shape[1]), np.concatenate(parts), tuple(labels))
