"""Method "quilt" over a mesh: charts of any shape, blocks unfolded over them from their centres.

Synthesis works on *working charts* of about a texel a pixel, whatever the density of the final ones. Blocks
lie on even grids over each island, the largest first; then others on what is still bare. Where a block lies
and how its sheets read is found beforehand, for many blocks at once; choosing, cutting and laying follows one
block after another.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.charts.subdivision import subdivided
from upholster.geometry import MeshSurface
from upholster.methods.quilt._block_kernels import LayNumbers, LayScratch, LayWeights, MatchImage, Span
from upholster.methods.quilt.match_pyramid import MatchPyramid
from upholster.methods.quilt.mesh._frame_kernels import Canvases, lay_frames, mark_needed
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
from upholster.methods.quilt.options import QuiltOptions
from upholster.parallel import check_running
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.quilt.placement import LARGEST_WARPED, MASK_CUT, MASK_NONE, PLACEMENT
from upholster.quilt.plans import PlacementList
from upholster.quilt.warp_field import UNIT, WarpField
from upholster.types import FloatArray, IntArray, PixelArray, Progress

__all__ = ["synthesize_mesh"]

_COARSE = 48
_LARGEST_FRAME = 512
_SHARE = 0.75
_OVERLAP = 0.3
_SHORT = 0.25
"""Longest edge of a triangle that blocks are unfolded over, in blocks."""

_ROUNDS = 12
"""Of blocks on what is still bare."""

_BLOCKS_PER_CALL = 64
_PAINTED_BEYOND = 3.0
"""Texels beyond the mesh that blocks paint."""


@dataclass(frozen=True, eq=False, slots=True)
class _Frame:
    """Sizes of blocks: side and its mask's cells in frame pixels, their level, how many a model unit has.

    `texels` are final texels per working texel, which is a frame pixel on the surface.
    """

    size: int
    cell: int
    feather: int
    level: int
    scale: float
    texels: float


def synthesize_mesh(
    exemplar: PixelArray,
    surface: MeshSurface,
    charts: Sequence[Chart],
    fields: Sequence[WarpField],
    vectors: FloatArray,
    scale: float,
    *,
    options: QuiltOptions,
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
        (V, 3), unit vectors at the mesh's vertices: which way the exemplar's rows run.
    scale
        Exemplar pixels per model unit.
    options
        Parameters of the method.
    seed
        0 to 2^63 − 1; the same seed gives the same quilt whatever the number of threads.
    threads, progress
        As in `upholster.parallel.run_tasks`; stage "blocks".
    """
    check_running(threads, progress)
    density = charts[0].height / (charts[0].s1 - charts[0].s0)
    frame = _frame(exemplar.shape[:2], options.block, scale, density)
    laying = _Laying.of(exemplar, surface, charts, fields, vectors, frame, options, seed, threads)
    laying.lay(laying.grid_centres(), progress)
    for _ in range(_ROUNDS):
        bare = laying.bare_centres()
        if not len(bare.triangles):
            break
        laying.lay(bare, progress)
    placed, cells = laying.placements()
    shape = exemplar.shape[0], exemplar.shape[1]
    return Quilt(tuple(charts), shape, PlacementList(placed, cells), tuple(fields), surface, seed)


def _frame(shape: tuple[int, ...], block: int, scale: float, density: float) -> _Frame:
    last = max(0, int(np.log2(min(shape[:2]) / 16)))
    level = min(max(0, int(np.floor(np.log2(scale / density) + 0.5))), last)
    coarse = block >= _COARSE
    cell, feather = (4, 3) if coarse else (2, 2)
    cell = cell if block >> level >= 24 else 2
    wanted = min(block, _SHARE * min(shape[:2])) / 2**level
    size = 2 * cell * max(2, int(np.rint(min(max(wanted, 8), _LARGEST_FRAME) / (2 * cell))))
    pixels = scale / 2**level
    return _Frame(size, cell, feather, level, pixels, density / pixels)


@dataclass(eq=False)
class _Laying:
    """A synthesis under way."""

    surface: MeshSurface
    charts: Sequence[Chart]
    fields: Sequence[WarpField]
    shape: tuple[int, int]
    frame: _Frame
    mesh: MeshArrays
    field: FieldArrays
    canvases: Canvases
    match: MatchImage
    numbers: LayNumbers
    weights: LayWeights
    span: Span
    usage: FloatArray
    state: NDArray[np.uint64]
    scratch: LayScratch
    threads: int | None
    footprints: list[Footprints]
    centres: FloatArray
    blocks: IntArray
    masks: NDArray[np.uint8]

    @classmethod
    def of(
        cls,
        exemplar: PixelArray,
        surface: MeshSurface,
        charts: Sequence[Chart],
        fields: Sequence[WarpField],
        vectors: FloatArray,
        frame: _Frame,
        options: QuiltOptions,
        seed: int,
        threads: int | None,
    ) -> "_Laying":
        """Begin."""
        fine = subdivided(surface, vectors, _SHORT * frame.size / frame.scale)
        working = tuple(_working(chart, frame) for chart in charts)
        mesh = mesh_arrays(fine, working)
        pyramid = MatchPyramid.of(exemplar, frame.level)
        level = pyramid.levels[frame.level]
        numbers = _numbers(frame, pyramid, options)
        usage = pyramid.empty_usage()
        canvases = _canvases(working, level.channels)
        mark_needed(mesh, canvases)
        scratch = LayScratch.of(numbers, usage)
        texels, half = scratch.texels, frame.size // 2
        texels.rows[:], texels.columns[:] = np.arange(frame.size + 2), np.arange(frame.size + 2)
        texels.ys[:] = np.arange(frame.size)[:, None] - half
        texels.xs[:] = np.arange(frame.size) - half
        variance = pyramid.variance
        return cls(
            surface,
            charts,
            fields,
            (exemplar.shape[0], exemplar.shape[1]),
            frame,
            mesh,
            field_arrays(fields, frame.texels, frame.level),
            canvases,
            MatchImage(level.image, level.plane),
            numbers,
            LayWeights(options.evenness * variance, options.variety * variance, options.tolerance),
            Span(
                half,
                level.height - half,
                half,
                level.width - half,
                -half,
                half - 1,
                -half,
                half - 1,
            ),
            usage,
            np.array([int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])], np.uint64),
            scratch,
            threads,
            [],
            np.zeros((0, 3)),
            np.zeros((0, 3), np.int32),
            np.zeros((0, (frame.size // frame.cell) ** 2), np.uint8),
        )

    def grid_centres(self) -> Centres:
        """Return the centres of even grids over the islands, the largest first: texels of the mesh."""
        step = max(2.0, (1 - _OVERLAP) * self.frame.size)
        areas = np.zeros(len(self.charts))
        kept = self.surface.island >= 0
        np.add.at(areas, self.surface.island[kept], self.surface.mesh.areas[kept])
        order = np.argsort(-areas, kind="stable")
        found = []
        for chart in order.tolist():
            rows, columns = np.nonzero(self._needed(chart))
            if not len(rows):
                continue
            i = np.floor((rows - rows.min() - 0.35 * step) / step + 0.5).astype(np.int64)
            j = np.floor((columns - columns.min() - 0.35 * step) / step + 0.5).astype(np.int64)
            y, x = rows.min() + (i + 0.35) * step, columns.min() + (j + 0.35) * step
            away = (rows - y) ** 2 + (columns - x) ** 2
            by_cell = np.lexsort((away, j, i))
            new = np.ones(len(by_cell), bool)
            new[1:] = (np.diff(i[by_cell]) != 0) | (np.diff(j[by_cell]) != 0)
            chosen = by_cell[new]
            found.append(np.stack([np.full(len(chosen), chart), rows[chosen], columns[chosen]], axis=1))
        return self._centres(np.concatenate(found) if found else np.zeros((0, 3), np.int64))

    def bare_centres(self) -> Centres:
        """Return centres for what is bare still: one in each square half as large as a block."""
        step = self.frame.size // 2
        found = []
        for chart in range(len(self.charts)):
            start, shape = self._place(chart)
            part = slice(start, start + shape[0] * shape[1])
            bare = (self.canvases.needed[part] == 1) & (self.canvases.covered[part] == 0)
            rows, columns = np.nonzero(bare.reshape(shape))
            keys = rows // step * (shape[1] // step + 1) + columns // step
            count = np.unique(keys, return_counts=True)[1]
            order = np.argsort(keys, kind="stable")
            middle = order[np.cumsum(count) - count + count // 2]
            found.append(np.stack([np.full(len(middle), chart), rows[middle], columns[middle]], axis=1))
        return self._centres(np.concatenate(found))

    def lay(self, centres: Centres, progress: Progress | None) -> None:
        """Lay blocks, in order."""
        count, before = len(centres.triangles), len(self.blocks)
        half = 0.5 * self.frame.size
        found = find_footprints(self.mesh, self.field, centres, half, self.frame.scale, threads=self.threads)
        self.footprints.append(found)
        corners = self.mesh.positions[self.mesh.triangles[centres.triangles]]
        self.centres = np.concatenate([self.centres, (centres.shares[:, :, None] * corners).sum(axis=1)])
        self.blocks = np.concatenate([self.blocks, np.zeros((count, 3), np.int32)])
        self.masks = np.concatenate([self.masks, np.zeros((count, self.masks.shape[1]), np.uint8)])
        order = np.arange(before + count, dtype=np.int64) - before
        covered = np.zeros((self.frame.size + 2,) * 2, np.uint8)
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
                self.state,
                self.centres,
                2.0 * self.frame.size / self.frame.scale,
                order,
                (start, stop),
                found.tuple(),
                self.blocks,
                self.masks,
                covered,
                self.scratch,
            )
            if progress is not None:
                progress("blocks", stop - before, count)

    def placements(self) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
        """Return all placements, chart after chart in the order of laying, and their masks' cells."""
        parts, cells, before, end = [self._base()], [], 0, 0
        for found in self.footprints:
            count = len(found.firsts) - 1
            sheets, own = self._sheets(found, before, count)
            parts.append(self._placed(found, sheets, before, end))
            cells.append(own)
            end += len(own)
            before += count
        placed = np.concatenate(parts)
        placed = placed[np.argsort(placed["chart"], kind="stable")]
        return placed, np.concatenate(cells) if cells else np.zeros(0, np.uint8)

    def _base(self) -> NDArray[np.void]:
        # Whole blocks under all others, so that what lies beyond the mesh has the texture's colours.
        side = LARGEST_WARPED
        parts = []
        for number, chart in enumerate(self.charts):
            rows, columns = (np.arange(0, size, side) for size in (chart.height, chart.width))
            for row in rows.tolist():
                for column in columns.tolist():
                    one = np.zeros(1, PLACEMENT)
                    height, width = min(side, chart.height - row), min(side, chart.width - column)
                    one["chart"], one["height"], one["width"] = number, height, width
                    one["row"], one["column"] = row + height // 2, column + width // 2
                    one["first_cell"], one["mask"] = -1, MASK_NONE
                    parts.append(one)
        base = np.concatenate(parts)
        base["source_row"], base["source_column"] = 8 * self.shape[0], 8 * self.shape[1]
        return base

    def _sheets(
        self, found: Footprints, before: int, count: int
    ) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
        laid = before + np.flatnonzero(self.blocks[before : before + count, 2])
        order = np.arange(before + count, dtype=np.int64) - before
        shapes = np.array([(chart.height, chart.width) for chart in self.charts], np.int64)
        frame = self.frame
        numbers = MaskNumbers(
            frame.texels,
            _final_cell(frame),
            frame.feather,
            LARGEST_WARPED,
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
                self.field,
                shapes,
                numbers,
                laid,
                order,
                (done, len(laid)),
                found.tuple(),
                found.fits,
                self.masks,
                boxes,
                sheets,
                cells,
                filled,
            )
            if done == len(laid):
                break
            sheets = np.concatenate([sheets, np.zeros_like(sheets)])
            cells = np.concatenate([cells, np.zeros_like(cells)])
        return sheets[: filled[0]], cells[: filled[1]].copy()

    def _placed(
        self, found: Footprints, sheets: NDArray[np.int64], before: int, first_cell: int
    ) -> NDArray[np.void]:
        # Sheets as placements: their centres are whole texels, and sources and matrices whole units.
        frame = self.frame
        block, sheet = sheets[:, 0], sheets[:, 7]
        fit = found.fits[block - before, sheet]
        placed = np.zeros(len(sheets), PLACEMENT)
        for n, name in enumerate(("chart", "row", "column", "height", "width", "first_cell"), start=1):
            placed[name] = sheets[:, n]
        placed["first_cell"] += first_cell
        moved = np.stack([(placed[name] + 0.5) / frame.texels - 0.5 for name in ("row", "column")], axis=1)
        moved -= fit[:, 2:4]
        here = self._matrices_at(placed)
        mean = 0.5 * (fit[:, 6:10] + here)
        shown = fit[:, 4:6] + (mean.reshape(-1, 2, 2) @ moved[:, :, None])[..., 0]
        unit = 16 << frame.level
        for axis, name in enumerate(("source_row", "source_column")):
            source = self.blocks[block, axis] + np.rint(unit * shown[:, axis]).astype(np.int64)
            placed[name] = np.clip(source, 0, 16 * (self.shape[axis] - 1))
        matrices = fit[:, 6:10] * ((1 << frame.level) / frame.texels) * UNIT
        placed["matrix"] = np.rint(np.where((sheet > 0)[:, None], matrices, 0)).astype(np.int32)
        placed["centred"] = sheet > 0
        placed["mask"], placed["mask_cell"], placed["feather"] = MASK_CUT, _final_cell(frame), frame.feather
        return placed

    def _matrices_at(self, placed: NDArray[np.void]) -> FloatArray:
        # The charts' own M at placements' centres, in frame pixels per working texel.
        out = np.empty((len(placed), 4))
        for chart in np.unique(placed["chart"]).tolist():
            own = placed["chart"] == chart
            out[own] = self.fields[chart].integers_at(placed["row"][own], placed["column"][own])
        return out * (self.frame.texels / (UNIT << self.frame.level))

    def _place(self, chart: int) -> tuple[int, tuple[int, int]]:
        canvases = self.canvases
        shape = int(canvases.heights[chart]), int(canvases.widths[chart])
        return int(canvases.firsts[chart]), shape

    def _needed(self, chart: int) -> NDArray[np.uint8]:
        start, shape = self._place(chart)
        return self.canvases.needed[start : start + shape[0] * shape[1]].reshape(shape)

    def _centres(self, texels: NDArray[np.int64]) -> Centres:
        # Blocks' centres from working texels (chart, row, column), moved to the nearest final texels.
        frame = self.frame
        final = np.rint((texels[:, 1:] + 0.5) * frame.texels - 0.5)
        places = (final + 0.5) / frame.texels - 0.5
        triangles, shares = _located(self.mesh, texels[:, 0], places)
        inside = (shares[:, :, None] * self.mesh.places[triangles]).sum(axis=1)
        roots = np.zeros((len(texels), 5))
        roots[:, 0], roots[:, 1:3] = texels[:, 0], places
        matrices = self._matrices_near(texels[:, 0], final).reshape(-1, 2, 2)
        roots[:, 3:] = (matrices @ (places - inside)[:, :, None])[..., 0]
        return Centres(triangles.astype(np.int32), shares, roots)

    def _matrices_near(self, chart: NDArray[np.int64], final: FloatArray) -> FloatArray:
        placed = np.zeros(len(chart), PLACEMENT)
        placed["chart"], placed["row"], placed["column"] = chart, final[:, 0], final[:, 1]
        return self._matrices_at(placed)


def _working(chart: Chart, frame: _Frame) -> Chart:
    # The same chart with working texels: the rectangle a little larger, from the same corner.
    height, width = (int(np.ceil(size / frame.texels)) + 1 for size in (chart.height, chart.width))
    s1, t1 = chart.s0 + height / frame.scale, chart.t0 + width / frame.scale
    return replace(chart, height=height, width=width, s1=s1, t1=t1)


def _final_cell(frame: _Frame) -> int:
    return min(255, max(1, int(np.rint(frame.cell * frame.texels))))


def _canvases(working: Sequence[Chart], channels: int) -> Canvases:
    sizes = np.array([(chart.height, chart.width) for chart in working], np.int64)
    firsts = np.cumsum([0, *(sizes[:, 0] * sizes[:, 1]).tolist()])
    count = int(firsts[-1])
    return Canvases(
        np.zeros((count, channels), np.uint8),
        np.zeros(count, np.uint8),
        np.zeros(count, np.uint8),
        firsts[:-1].astype(np.int64),
        sizes[:, 0].copy(),
        sizes[:, 1].copy(),
    )


def _numbers(frame: _Frame, pyramid: MatchPyramid, options: QuiltOptions) -> LayNumbers:
    level = pyramid.levels[frame.level]
    return LayNumbers(
        height=level.height,
        width=level.width,
        channels=level.channels,
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


def _located(
    mesh: MeshArrays, chart: NDArray[np.int64], places: FloatArray
) -> tuple[NDArray[np.intp], FloatArray]:
    # The triangle of a chart nearest to each place, and the place's barycentric coordinates, brought into it.
    triangles, shares = np.zeros(len(places), np.intp), np.zeros((len(places), 3))
    for number in np.unique(chart).tolist():
        own = np.flatnonzero(mesh.chart == number)
        flat = mesh.places[own]
        wanted = np.flatnonzero(chart == number)
        for n in wanted.tolist():
            near, inside = _nearest(flat, places[n])
            triangles[n], shares[n] = own[near], inside
    return triangles, shares


def _nearest(flat: FloatArray, place: FloatArray) -> tuple[int, Any]:
    first, second = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    to = place - flat[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    safe = np.where(area > 1e-12, area, 1.0)
    b = np.maximum((to[:, 0] * second[:, 1] - to[:, 1] * second[:, 0]) / safe, 0)
    c = np.maximum((first[:, 0] * to[:, 1] - first[:, 1] * to[:, 0]) / safe, 0)
    total = np.maximum(b + c, 1.0)
    b, c = b / total, c / total
    away = ((to - b[:, None] * first - c[:, None] * second) ** 2).sum(axis=1)
    away[area <= 1e-12] = np.inf
    near = int(np.argmin(away))
    return near, (1 - b[near] - c[near], b[near], c[near])
