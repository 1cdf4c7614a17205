"""Method "quilt" over a charted surface: blocks laid one over the other, then what shows of them.

Blocks lie on even grids over the charts, then on what is still bare. They are laid region by region, see
`centres`: regions of one class side by side.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.charts.charted import ChartedSurface
from upholster.charts.mesh_layout import GUTTER
from upholster.charts.phases import PhaseField
from upholster.charts.subdivision import subdivided
from upholster.methods.quilt._block_kernels import (
    BLOCK_COLUMNS,
    LAID,
    PHASE,
    LayNumbers,
    LayWeights,
    MatchImage,
)
from upholster.methods.quilt._lay_kernels import BlockArrays, Ground, LayScratch, lay_blocks
from upholster.methods.quilt._phase_kernels import MISFIT
from upholster.methods.quilt._sheet_kernels import FIT, MOST_SHEETS
from upholster.methods.quilt.centres import Centres, Regions, centres_on
from upholster.methods.quilt.emit import Laid, emitted_quilt
from upholster.methods.quilt.ground import ground_of
from upholster.methods.quilt.match_pyramid import MatchPyramid
from upholster.methods.quilt.options import QuiltOptions
from upholster.methods.quilt.phases import WantedPhases
from upholster.parallel import check_running, run_tasks
from upholster.quilt.model import Quilt
from upholster.quilt.warp_field import WarpField
from upholster.types import FloatArray, IntArray, PixelArray, Progress

__all__ = ["synthesize_quilt"]

_COARSE = 48
_LARGEST_FRAME = 512
_SHARE = 0.75
_OVERLAP = 0.3
_SHORT = 0.4
"""Longest edge of a triangle that blocks are unfolded over, in blocks."""

_ROUNDS = 12
"""Of blocks on what is still bare."""

_MIRRORED = 1 << 5
"""The symmetry that mirrors left and right: columns count backwards."""


def synthesize_quilt(
    exemplar: PixelArray,
    surface: ChartedSurface,
    fields: tuple[WarpField, ...],
    vectors: FloatArray,
    scale: float,
    *,
    fold: int = 1,
    turns: IntArray | None = None,
    options: QuiltOptions,
    phases: WantedPhases | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Quilt:
    """Cover a charted surface with one texture.

    Parameters
    ----------
    exemplar
        (H, W, C), any number of channels; uint8, uint16 or float32.
    surface, fields
        The charts, and their warp fields.
    vectors
        (T, 3, 3), unit vectors at the triangles' corners: which way the exemplar's rows run.
    scale
        Exemplar pixels per model unit.
    fold, turns
        1, 2 or 4: so many directions, turned evenly, count as one where a block reaches from triangle to
        triangle; and (T,) the quarter turns from the warp fields to the directions, by default none, see
        `upholster.charts.turns`.
    options
        Parameters of the method.
    phases
        Of a sample that repeats: its own phases; where it shall be is found here. None: not looked at.
    seed
        0 to 2^63 − 1; the same seed gives the same quilt whatever the number of threads.
    threads, progress
        As in `upholster.parallel.run_tasks`; stage "blocks".
    """
    check_running(threads, progress)
    turns = np.zeros(len(surface.chart), np.int32) if turns is None else turns
    pyramid, numbers = _numbers(exemplar, surface, options, scale, phases)
    pixels = scale / 2**numbers.level
    fine = subdivided(surface, vectors, _SHORT * numbers.size / pixels)
    ground = ground_of(
        fine, fields, numbers.level, crease=options.crease, fold=fold, turns=turns[fine.parent]
    )
    variance = pyramid.variance
    weights = LayWeights(
        options.evenness * variance,
        options.variety * variance,
        options.tolerance,
        0.0 if phases is None else phases.weight * variance / MISFIT,
    )
    laying = _Laying(
        ground, pyramid.levels[numbers.level].match, numbers, weights, pixels, _density(surface),
        None if phases is None else phases.surface, fine.parent,
        _OVERLAP if options.overlap is None else options.overlap / options.block,
        np.random.SeedSequence(seed).generate_state(1, np.uint64)[0], threads, progress,
        pyramid.empty_usage(numbers.symmetries.bit_count()), Regions(numbers.size / pixels),
    )  # fmt: skip
    laid = laying.all_laid()
    return emitted_quilt(surface.charts, fields, exemplar.shape[:2], ground, laid, threads=threads)


@dataclass(eq=False)
class _Laying:
    """A synthesis under way."""

    ground: Ground
    match: MatchImage
    numbers: LayNumbers
    weights: LayWeights
    pixels: float  # of frames, in a model unit
    steps: float  # of charts, in a model unit
    phases: PhaseField | None
    parent: IntArray  # of triangles, among the surface's own
    overlap: float  # of blocks
    seed: np.uint64
    threads: int | None
    progress: Progress | None
    usage: FloatArray
    regions: Regions

    def __post_init__(self) -> None:
        none = np.zeros((0, 3))
        self.blocks = BlockArrays(
            np.zeros(0, np.int32), none, np.zeros((0, 6)), none, np.zeros((0, BLOCK_COLUMNS), np.int32)
        )
        self._fits: dict[int, FloatArray] = {}
        self._free: list[LayScratch] = []

    def all_laid(self) -> Laid:
        """Lay blocks on even grids, then on what is bare; return them all."""
        size = self.numbers.size
        mesh, canvases = self.ground.mesh, self.ground.canvases
        step = max(2.0, (1 - self.overlap) * size * self._steps_per_pixel())
        self.lay(centres_on(mesh, canvases, step, GUTTER + 0.35 * step, bare=False))
        step, left = 0.5 * size * self._steps_per_pixel(), np.inf
        for _ in range(_ROUNDS):
            count = int(((canvases.owners < 0) & (canvases.triangles >= 0)).sum())
            if not 0 < count < left:
                break
            left = count
            self.lay(centres_on(mesh, canvases, step, 0.5 * step, bare=True))
        fits = [self._fits[n] for n in range(len(self.blocks.records))]
        firsts = np.cumsum([0, *(len(one) for one in fits)])
        return Laid(self.blocks.records, firsts, np.concatenate(fits), self.numbers.level)

    def lay(self, centres: Centres) -> None:
        """Lay blocks."""
        first = len(self.blocks.records)
        order, classes = self.regions.enter(centres.spots, first)
        self._add(centres.chosen(order))
        for parts in classes:
            near = [self.regions.near(self.blocks.spots[start]) for start, _ in parts]
            usages = [self.usage.copy() for _ in parts]
            run_tasks(
                [
                    partial(self._lay_region, part, close, usage)
                    for part, close, usage in zip(parts, near, usages, strict=True)
                ],
                threads=self.threads,
            )
            self.usage = self.usage + sum((usage - self.usage for usage in usages), np.zeros_like(self.usage))
            if self.progress is not None:
                self.progress("blocks", parts[-1][1] - first, len(order))

    def _add(self, centres: Centres) -> None:
        records = np.zeros((len(centres.triangles), BLOCK_COLUMNS), np.int32)
        if self.phases is not None:
            wanted = self.phases.at(self.parent[centres.triangles], centres.spots)
            records[:, PHASE : PHASE + len(wanted)] = wanted.T
        new = (centres.triangles, centres.shares, centres.roots, centres.spots, records)
        self.blocks = BlockArrays(
            *(np.concatenate([old, one]) for old, one in zip(self.blocks, new, strict=True))
        )

    def _lay_region(self, part: tuple[int, int], near: NDArray[np.int64], usage: FloatArray) -> None:
        scratch = self._free.pop() if self._free else self._scratch()
        count = part[1] - part[0]
        fits, pieces = np.empty((count, MOST_SHEETS, FIT)), np.zeros(count, np.int64)
        reaches = 2.0 * self.numbers.size / self.pixels, self.pixels
        lay_blocks(
            self.ground, self.match, self.numbers, self.weights, usage, self.blocks, part, near, reaches,
            self.seed, fits, pieces, scratch,
        )  # fmt: skip
        for n in range(count):
            self._fits[part[0] + n] = fits[
                n, : pieces[n] if self.blocks.records[part[0] + n, LAID] else 0
            ].copy()
        self._free.append(scratch)

    def _scratch(self) -> LayScratch:
        mesh = self.ground.mesh
        return LayScratch.of(self.numbers, self.usage, len(mesh.first) - 1, len(mesh.triangles))

    def _steps_per_pixel(self) -> float:
        return self.steps / self.pixels


def _density(surface: ChartedSurface) -> float:
    # Steps per model unit: the mean over the charts.
    flat = surface.places[:, 1:] - surface.places[:, :1]
    steps = 0.5 * np.abs(flat[:, 0, 0] * flat[:, 1, 1] - flat[:, 0, 1] * flat[:, 1, 0])
    kept = surface.chart >= 0
    return float(np.sqrt(steps[kept].sum() / surface.mesh.areas[kept].sum()))


def _numbers(
    exemplar: PixelArray,
    surface: ChartedSurface,
    options: QuiltOptions,
    scale: float,
    phases: WantedPhases | None,
) -> tuple[MatchPyramid, LayNumbers]:
    # The exemplar's pyramid up to the level whose pixels are about a step, and sizes on that.
    shape = exemplar.shape[:2]
    last = max(0, int(np.log2(min(shape) / 16)))
    number = min(max(0, int(np.floor(np.log2(scale / _density(surface)) + 0.5))), last)
    pyramid = MatchPyramid.of(exemplar, number, None if phases is None else phases.lattice)
    level = pyramid.levels[number]
    cell = 4 if options.block >= _COARSE and options.block >> number >= 24 else 2
    wanted = min(options.block, _SHARE * min(shape)) / 2**number
    size = 2 * cell * max(2, int(np.rint(min(max(wanted, 8), _LARGEST_FRAME) / (2 * cell))))
    turns = 0b1111 if options.rotate else 1
    symmetries = turns | (turns << 4 if options.rotate else _MIRRORED) if options.mirror else turns
    return pyramid, LayNumbers(
        level.height,
        level.width,
        number,
        level.step,
        options.shortlist,
        pyramid.stride(number),
        symmetries,
        size,
        cell,
    )
