"""Method "quilt" over a mesh: charts of any shape, blocks unfolded over them from their centres.

Synthesis works on *working charts* of about a texel a pixel, whatever the density of the final ones. Blocks
lie on even grids over each island, the largest first; then others on what is still bare. Where a block lies
and how its sheets read is found beforehand, for many blocks at once; choosing, cutting and laying follows one
block after another.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from upholster.charts.charted import ChartedSurface
from upholster.charts.mesh_layout import GUTTER
from upholster.charts.phases import MeshPhases, mesh_phases
from upholster.charts.subdivision import Subdivided, subdivided
from upholster.methods.quilt._block_kernels import LayNumbers, LayScratch, LayWeights, MatchImage, Span
from upholster.methods.quilt._landmark_kernels import LandmarkUses
from upholster.methods.quilt._phase_kernels import MISFIT
from upholster.methods.quilt.emit import LABEL_CELL, emitted_quilt
from upholster.methods.quilt.landmarks import mesh_uses
from upholster.methods.quilt.masked import BLOCK, LARGEST_BLOCK, MATRIX_UNIT
from upholster.methods.quilt.match_pyramid import MatchPyramid
from upholster.methods.quilt.mesh._frame_kernels import (
    FRAME_COLUMNS,
    Canvases,
    lay_frames,
    locate_texels,
    nearest_texels,
)
from upholster.methods.quilt.mesh._mask_kernels import SHEET, MaskNumbers, mask_sheets
from upholster.methods.quilt.mesh._sheet_kernels import MOST_SHEETS, FieldArrays
from upholster.methods.quilt.mesh._unfold_kernels import MeshArrays
from upholster.methods.quilt.mesh.footprints import (
    Centres,
    Footprints,
    field_arrays,
    find_footprints,
    mesh_arrays,
)
from upholster.methods.quilt.mesh.frames import Frame, Lot, enter_frame, frame_span
from upholster.methods.quilt.mesh.refinement import RefinedMesh, dearest, larger_frame, refine_lot
from upholster.methods.quilt.options import QuiltOptions
from upholster.methods.quilt.phases import WantedPhases
from upholster.methods.quilt.transfer import ChartPlacements
from upholster.parallel import check_running, run_tasks
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.quilt.placement import SYMMETRIES
from upholster.quilt.warp_field import UNIT, WarpField
from upholster.types import FloatArray, IntArray, PixelArray, Progress

__all__ = ["synthesize_mesh"]

_COARSE = 48
_LARGEST_FRAME = 512
_SHARE = 0.75
_OVERLAP = 0.3
_SHORT = 0.4
"""Longest edge of a triangle that blocks are unfolded over, in blocks."""

_ROUNDS = 12
"""Of blocks on what is still bare."""

_MARGIN = 0.2
"""What a block leaves bare where it ends beside what is laid, in blocks: one that lies over it has room to
cut on both sides."""

_CELL = 0.25
"""Side of a cell of the phases, in blocks."""

_BLOCKS_PER_CALL = 64
_BLOCKS_PER_MASKING = 256
_FIRST_CELL = 6
"""Column of a sheet's first cell."""
_NO_SHEETS = np.zeros((0, SHEET), np.int64), np.zeros(0, np.uint8)
_PAINTED_BEYOND = 3.0
"""Texels beyond the mesh that blocks paint."""


def synthesize_mesh(
    exemplar: PixelArray,
    surface: ChartedSurface,
    fields: Sequence[WarpField],
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
    """Cover a mesh with one texture.

    Parameters
    ----------
    exemplar
        (H, W, C), any number of channels; uint8, uint16 or float32.
    surface, charts, fields
        The layout, see `upholster.charts.mesh_layout`.
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
    charts = surface.charts
    frame = _frame(exemplar.shape[:2], options.block, scale, _density(surface))
    turns = np.zeros(len(surface.chart), np.int32) if turns is None else turns
    fine = subdivided(surface, vectors, _SHORT * frame.size / frame.scale)
    working = tuple(_working(chart, frame) for chart in charts)
    mesh = mesh_arrays(fine, frame.texels, options.crease, fold, turns[fine.parent])
    laying = _Laying.of(
        exemplar, surface, charts, fields, fine, working, mesh, frame, scale, options, phases, seed, threads
    )
    margin = max(2 * frame.cell, int(_MARGIN * frame.size + 0.5))
    laying.lay(laying.grid_centres(), margin, progress)
    left = np.inf
    for k in range(_ROUNDS):
        bare = laying.bare_centres()
        if len(bare.triangles) >= left:
            break
        left = len(bare.triangles)
        laying.lay(bare, margin if k < _ROUNDS // 2 else 0, progress)
    laying.refine(options.effort, progress)
    placed, cells = laying.placements()
    shape = exemplar.shape[0], exemplar.shape[1]
    ends = np.searchsorted(placed["chart"], np.arange(len(charts) + 1))
    none = np.zeros(len(placed), np.int64)
    laid = [
        ChartPlacements(placed[start:stop], cells, none[start:stop], none[start:stop])
        for start, stop in pairwise(ends.tolist())
    ]
    return emitted_quilt(charts, fields, shape, laid, cell=LABEL_CELL, threads=threads)


def _density(surface: ChartedSurface) -> float:
    # Steps per model unit: the mean over the charts.
    flat = surface.places[:, 1:] - surface.places[:, :1]
    steps = 0.5 * np.abs(flat[:, 0, 0] * flat[:, 1, 1] - flat[:, 0, 1] * flat[:, 1, 0])
    kept = surface.chart >= 0
    return float(np.sqrt(steps[kept].sum() / surface.mesh.areas[kept].sum()))


def _frame(shape: tuple[int, ...], block: int, scale: float, density: float) -> Frame:
    last = max(0, int(np.log2(min(shape[:2]) / 16)))
    level = min(max(0, int(np.floor(np.log2(scale / density) + 0.5))), last)
    cell = 4 if block >= _COARSE and block >> level >= 24 else 2
    wanted = min(block, _SHARE * min(shape[:2])) / 2**level
    size = 2 * cell * max(2, int(np.rint(min(max(wanted, 8), _LARGEST_FRAME) / (2 * cell))))
    pixels = scale / 2**level
    return Frame(size, cell, level, pixels, density / pixels)


@dataclass(eq=False)
class _Laying:
    """A synthesis under way."""

    surface: ChartedSurface
    charts: Sequence[Chart]
    fields: Sequence[WarpField]
    shape: tuple[int, int]
    frame: Frame
    mesh: MeshArrays
    field: FieldArrays
    canvases: Canvases
    phases: MeshPhases | None
    match: MatchImage
    numbers: LayNumbers
    weights: LayWeights
    span: Span
    usage: FloatArray
    uses: LandmarkUses
    state: NDArray[np.uint64]
    scratch: LayScratch
    threads: int | None
    parts: list[tuple[Centres, Footprints]]
    centres: FloatArray
    blocks: IntArray
    masks: NDArray[np.uint8]
    added: Lot | None = None

    @classmethod
    def of(
        cls,
        exemplar: PixelArray,
        surface: ChartedSurface,
        charts: Sequence[Chart],
        fields: Sequence[WarpField],
        fine: Subdivided,
        working: Sequence[Chart],
        mesh: MeshArrays,
        frame: Frame,
        scale: float,
        options: QuiltOptions,
        wanted: WantedPhases | None,
        seed: int,
        threads: int | None,
    ) -> "_Laying":
        """Begin, on working charts and the mesh that lies on them, with shorter edges."""
        pyramid = MatchPyramid.of(exemplar, frame.level, None if wanted is None else wanted.lattice)
        level = pyramid.levels[frame.level]
        numbers = _numbers(frame, pyramid, options)
        usage = pyramid.empty_usage()
        canvases = _canvases(working)
        locate_texels(mesh, canvases)
        scratch = LayScratch.of(numbers, usage)
        enter_frame(scratch.texels)
        variance = pyramid.variance
        phase = 0.0 if wanted is None else wanted.weight * variance / MISFIT
        return cls(
            surface,
            charts,
            fields,
            (exemplar.shape[0], exemplar.shape[1]),
            frame,
            mesh,
            field_arrays(fields, frame.texels, frame.level),
            canvases,
            None if wanted is None else _phases(fine, wanted, scale, options.block),
            level.match,
            numbers,
            LayWeights(options.evenness * variance, options.variety * variance, options.tolerance, phase),
            frame_span(numbers),
            usage,
            mesh_uses(pyramid.form, options.variety * variance, frame.level, usage.shape),
            np.array([int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])], np.uint64),
            scratch,
            threads,
            [],
            np.zeros((0, 3)),
            np.zeros((0, FRAME_COLUMNS), np.int32),
            np.zeros((0, frame.cells), np.uint8),
        )

    def grid_centres(self) -> Centres:
        """Return the centres of even grids over the islands, the largest first: texels of the mesh."""
        kept = self.surface.chart >= 0
        areas = np.bincount(self.surface.chart[kept], self.surface.mesh.areas[kept], len(self.charts))
        order = np.argsort(-areas, kind="stable")
        step = max(2.0, (1 - _OVERLAP) * self.frame.size)
        return self._centres(order, step, GUTTER / self.frame.texels + 0.35 * step, bare=False)

    def bare_centres(self) -> Centres:
        """Return centres for what is bare still: one in each square half as large as a block."""
        step = 0.5 * self.frame.size
        return self._centres(np.arange(len(self.charts)), step, 0.5 * step, bare=True)

    def lay(self, centres: Centres, margin: int, progress: Progress | None) -> None:
        """Lay blocks, in order; they leave `margin` pixels bare where they end beside what is laid."""
        count, before = len(centres.triangles), len(self.blocks)
        half = 0.5 * self.frame.size
        found = find_footprints(self.mesh, self.field, centres, half, self.frame.scale, threads=self.threads)
        self.parts.append((centres, found))
        corners = self.mesh.positions[self.mesh.triangles[centres.triangles]]
        self.centres = np.concatenate([self.centres, (centres.shares[:, :, None] * corners).sum(axis=1)])
        self.blocks = np.concatenate([self.blocks, np.zeros((count, FRAME_COLUMNS), np.int32)])
        if self.phases is not None:
            wanted = self.phases.at(centres.triangles, self.centres[before:])
            self.blocks[before:, 3 : 3 + len(wanted)] = wanted.T
        self.masks = np.concatenate([self.masks, np.zeros((count, self.masks.shape[1]), np.uint8)])
        self._know(self.centres[before:])
        order = np.arange(before + count, dtype=np.int64) - before
        covered = np.zeros((self.frame.size + 2,) * 2, np.uint8)
        sources = np.zeros((self.frame.size,) * 2, np.int32)
        inside = np.zeros(len(self.mesh.triangles), np.uint8)
        for start in range(before, before + count, _BLOCKS_PER_CALL):
            stop = min(start + _BLOCKS_PER_CALL, before + count)
            lay_frames(
                self.mesh,
                self.canvases,
                self.match,
                self.numbers,
                self.weights,
                self.span,
                self.usage,
                self.uses,
                self.state,
                self.centres,
                2.0 * self.frame.size / self.frame.scale,
                order,
                (start, stop),
                found.tuple(),
                self.blocks,
                self.masks,
                covered,
                sources,
                inside,
                margin,
                self.scratch,
            )
            if progress is not None:
                progress("blocks", stop - before, count)

    def refine(self, effort: int, progress: Progress | None) -> None:
        """Lay other sources where the cuts of laid blocks cost most, see `refinement`."""
        of = dearest(self.blocks, effort)
        if not len(of):
            return
        frame = larger_frame(self.frame, self.numbers.height, self.numbers.width)
        laid = [centres for centres, _ in self.parts]
        centres = Centres(
            np.concatenate([one.triangles for one in laid])[of],
            np.concatenate([one.shares for one in laid])[of],
            np.concatenate([one.roots for one in laid])[of],
        )
        half = 0.5 * frame.size
        found = find_footprints(self.mesh, self.field, centres, half, frame.scale, threads=self.threads)
        lot = Lot(frame, found, self.blocks[of], np.zeros((len(of), frame.cells), np.uint8))
        self._know(self.centres[of])
        mesh = RefinedMesh(
            *(self.mesh, self.canvases, self.match, self.weights, self.usage, self.uses, self.state)
        )
        refine_lot(lot, mesh, len(self.blocks), self.numbers, progress)
        self.added = lot

    def _know(self, centres: FloatArray) -> None:
        # Makes room for landmarks that further blocks show.
        pixels = self.frame.scale * (1 << self.frame.level)  # per unit
        self.uses = self.uses._replace(
            places=np.concatenate([self.uses.places, pixels * centres]),
            shown=np.concatenate([self.uses.shown, np.zeros(len(centres), np.int64)]),
        )

    def placements(self) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
        """Return all placements, chart after chart in the order of laying, and their masks' cells."""
        lots, before = [], 0
        for _, found in self.parts:
            own = slice(before, before + len(found.firsts) - 1)
            lots.append(Lot(self.frame, found, self.blocks[own], self.masks[own]))
            before = own.stop
        parts, cells, end = [np.zeros(0, BLOCK)], [], 0
        for lot in [*lots, self.added]:
            if lot is not None:
                sheets, own_cells = self._sheets(lot)
                parts.append(self._placed(lot, sheets, end))
                cells.append(own_cells)
                end += len(own_cells)
        placed = np.concatenate(parts)
        placed = placed[np.argsort(placed["chart"], kind="stable")]
        return placed, np.concatenate(cells) if cells else np.zeros(0, np.uint8)

    def _sheets(self, lot: Lot) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
        # All sheets of laid blocks, in order, and their masks' cells; part by part, on all threads.
        laid = np.flatnonzero(lot.blocks[:, 2])
        parts = [laid[n : n + _BLOCKS_PER_MASKING] for n in range(0, len(laid), _BLOCKS_PER_MASKING)]
        made: list[tuple[NDArray[np.int64], NDArray[np.uint8]]] = [_NO_SHEETS] * len(parts)

        def mask(number: int) -> None:
            made[number] = self._masked(lot, parts[number])

        run_tasks([partial(mask, number) for number in range(len(parts))], threads=self.threads)
        end = 0
        for sheets, cells in made:
            sheets[:, _FIRST_CELL] += end
            end += len(cells)
        both = [_NO_SHEETS, *made]
        return np.concatenate([sheets for sheets, _ in both]), np.concatenate([cells for _, cells in both])

    def _masked(self, lot: Lot, laid: NDArray[np.intp]) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
        order = np.arange(len(lot.blocks), dtype=np.int64)
        shapes = np.array([(chart.height, chart.width) for chart in self.charts], np.int64)
        frame, found = lot.frame, lot.footprints
        numbers = MaskNumbers(
            frame.texels,
            LABEL_CELL,
            LARGEST_BLOCK,
            _PAINTED_BEYOND,
            frame.size,
            frame.cell,
        )
        sheets = np.zeros((4 * len(laid) + 16, SHEET), np.int64)
        cells = np.zeros(8 * len(laid) * (frame.size // frame.cell + 4) ** 2 + 4096, np.uint8)
        filled, boxes, done = np.zeros(2, np.int64), np.empty((MOST_SHEETS, 4)), 0
        while True:
            done = mask_sheets(
                self.mesh,
                self.canvases,
                self.field,
                shapes,
                numbers,
                laid,
                order,
                (done, len(laid)),
                found.tuple(),
                found.fits,
                lot.masks,
                boxes,
                sheets,
                cells,
                filled,
            )
            if done == len(laid):
                break
            sheets = np.concatenate([sheets, np.zeros_like(sheets)])
            cells = np.concatenate([cells, np.zeros_like(cells)])
        return sheets[: filled[0]].copy(), cells[: filled[1]].copy()

    def _placed(self, lot: Lot, sheets: NDArray[np.int64], first_cell: int) -> NDArray[np.void]:
        # Sheets as placements: their centres are whole texels, and sources and matrices whole units.
        frame = lot.frame
        block, sheet = sheets[:, 0], sheets[:, 7]
        fit = lot.footprints.fits[block, sheet]
        placed = np.zeros(len(sheets), BLOCK)
        for n, name in enumerate(("chart", "row", "column", "height", "width", "first_cell"), start=1):
            placed[name] = sheets[:, n]
        placed["first_cell"] += first_cell
        moved = np.stack([(placed[name] + 0.5) / frame.texels - 0.5 for name in ("row", "column")], axis=1)
        moved -= fit[:, 2:4]
        here = self._matrices_at(placed)
        # What follows is in the chart's own sense: the placement's symmetry turns it to the block's.
        turns = fit[:, 10].astype(np.intp)
        placed["symmetry"] = turns
        turn = SYMMETRIES.reshape(-1, 2, 2)[turns]
        own_centre = (turn.transpose(0, 2, 1) @ fit[:, 6:10].reshape(-1, 2, 2)).reshape(-1, 4)
        mean = 0.5 * turn @ (own_centre + here).reshape(-1, 2, 2)
        shown = fit[:, 4:6] + (mean @ moved[:, :, None])[..., 0]
        fraction = 16 << frame.level
        for axis, name in enumerate(("source_row", "source_column")):
            source = lot.blocks[block, axis] + np.rint(fraction * shown[:, axis]).astype(np.int64)
            placed[name] = np.clip(source, 0, 16 * (self.shape[axis] - 1))
        unit = (1 << frame.level) / frame.texels * UNIT
        own = np.rint(here * unit)
        matrices = own + MATRIX_UNIT * np.rint((own_centre * unit - own) / MATRIX_UNIT)
        centred = (sheet > 0) | (matrices != own).any(axis=1)
        placed["matrix"] = np.where(centred[:, None], matrices, 0).astype(np.int32)
        placed["centred"] = centred
        placed["mask_cell"] = LABEL_CELL
        return placed

    def _matrices_at(self, placed: NDArray[np.void]) -> FloatArray:
        # The charts' own M at placements' centres, in frame pixels per working texel.
        out = np.empty((len(placed), 4))
        for chart in np.unique(placed["chart"]).tolist():
            own = placed["chart"] == chart
            out[own] = self.fields[chart].integers_at(placed["row"][own], placed["column"][own])
        return out * (self.frame.texels / (UNIT << self.frame.level))

    def _centres(self, charts: NDArray[np.intp], step: float, shift: float, *, bare: bool) -> Centres:
        # Blocks' centres: the texels of the mesh nearest to the middles of squares, moved to final texels.
        frame, canvases, parts = self.frame, self.canvases, [np.zeros((0, 3), np.int64)]
        for chart in charts.tolist():
            sizes = canvases.heights[chart], canvases.widths[chart]
            shape = [max(1, int((size - shift) / step + 1.5)) for size in sizes]
            away, found = np.empty(shape), np.empty(shape, np.int32)
            nearest_texels(canvases, chart, step, shift, bare, away, found)
            rows, columns = np.divmod(found[found >= 0].astype(np.int64), sizes[1])
            parts.append(np.stack([np.full(len(rows), chart), rows, columns], axis=1))
        texels = np.concatenate(parts)
        chart = texels[:, 0]
        triangles = canvases.triangles[
            canvases.firsts[chart] + texels[:, 1] * canvases.widths[chart] + texels[:, 2]
        ]
        final = np.rint((texels[:, 1:] + 0.5) * frame.texels - 0.5)
        places = (final + 0.5) / frame.texels - 0.5
        shares = _shares(self.mesh.places[triangles], places)
        inside = (shares[:, :, None] * self.mesh.places[triangles]).sum(axis=1)
        turns = self.mesh.turns[triangles]
        roots = np.zeros((len(texels), 6))
        roots[:, 0], roots[:, 1:3] = chart, places
        roots[:, 5] = turns
        matrices = SYMMETRIES.reshape(-1, 2, 2)[turns] @ self._matrices_near(chart, final).reshape(-1, 2, 2)
        roots[:, 3:5] = (matrices @ (places - inside)[:, :, None])[..., 0]
        return Centres(triangles, shares, roots)

    def _matrices_near(self, chart: NDArray[np.int64], final: FloatArray) -> FloatArray:
        placed = np.zeros(len(chart), BLOCK)
        placed["chart"], placed["row"], placed["column"] = chart, final[:, 0], final[:, 1]
        return self._matrices_at(placed)


def _phases(fine: Subdivided, wanted: WantedPhases, scale: float, block: int) -> MeshPhases:
    side = _CELL * block / scale
    return mesh_phases(fine.surface, fine.vectors, scale, wanted.lattice.waves, side)


def _working(chart: Chart, frame: Frame) -> Chart:
    # The same chart with working texels: the rectangle a little larger, from the same corner.
    height, width = (int(np.ceil(size / frame.texels)) + 1 for size in (chart.height, chart.width))
    s1, t1 = chart.s0 + height / frame.scale, chart.t0 + width / frame.scale
    return replace(chart, height=height, width=width, s1=s1, t1=t1)


def _canvases(working: Sequence[Chart]) -> Canvases:
    sizes = np.array([(chart.height, chart.width) for chart in working], np.int64)
    firsts = np.cumsum([0, *(sizes[:, 0] * sizes[:, 1]).tolist()])
    count = int(firsts[-1])
    return Canvases(
        np.zeros(count, np.int32),
        np.zeros(count, np.int32),
        np.zeros(count, np.uint8),
        np.full(count, -1, np.int32),
        firsts[:-1].astype(np.int64),
        sizes[:, 0].copy(),
        sizes[:, 1].copy(),
        np.zeros(count, np.uint8),
    )


def _numbers(frame: Frame, pyramid: MatchPyramid, options: QuiltOptions) -> LayNumbers:
    level = pyramid.levels[frame.level]
    return LayNumbers(
        height=level.height,
        width=level.width,
        level=frame.level,
        step=level.step,
        shortlist=options.shortlist,
        usage_step=pyramid.stride(frame.level),
        symmetries=1,
        margin=0,
        origin_row=0,
        origin_column=0,
        wrap=0,
        block_height=frame.size,
        block_width=frame.size,
        mask_cell=frame.cell,
        across=1,
        sample=1,
        need_top=0,
        need_bottom=frame.size,
        need_left=0,
        need_right=frame.size,
    )


def _shares(flat: FloatArray, places: FloatArray) -> FloatArray:
    # Barycentric coordinates of places in triangles (n, 3, 2), brought into them.
    first, second, to = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0], places - flat[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    b = np.maximum((to[:, 0] * second[:, 1] - to[:, 1] * second[:, 0]) / area, 0)
    c = np.maximum((first[:, 0] * to[:, 1] - first[:, 1] * to[:, 0]) / area, 0)
    total = np.maximum(b + c, 1.0)
    out: FloatArray = np.stack([1 - (b + c) / total, b / total, c / total], axis=1)
    return out
