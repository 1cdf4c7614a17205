"""Laying a surface's blocks, parcel by parcel.

A parcel's task takes the triangles within some blocks of its cube and redraws the blocks that earlier parcels
have laid there. Then it lays its own blocks: on even grids over the charts, then on steps that are still
bare, in the order of `block_order`. The result of a task is small.

A bare step belongs to the last of the parcels near it: by then all of them have laid blocks on their grids.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from threading import Barrier, BrokenBarrierError

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts.mesh_layout import GUTTER
from upholster.image.elements._joint_kernels import measure_distances
from upholster.runtime.parallel import report_progress, run_tasks, stop_flag, thread_count
from upholster.synthesis.quilt.block_order import Lists, Near, distances_from, near_blocks, ranks_of
from upholster.synthesis.quilt.centres import Centres, centres_at, centres_on
from upholster.synthesis.quilt.ground import PlacedGround
from upholster.synthesis.quilt.kernels._block_kernels import (
    BLOCK_COLUMNS,
    MULTIPLIER,
    OUTCOME,
    PHASE,
    SOURCE_COLUMN,
    SOURCE_ROW,
)
from upholster.synthesis.quilt.kernels._frame_kernels import KEPT_SHEET
from upholster.synthesis.quilt.kernels._lay_kernels import BlockArrays, LayScratch, lay_blocks, replay_blocks
from upholster.synthesis.quilt.kernels._put_kernels import put_block
from upholster.synthesis.quilt.kernels._relay_kernels import (
    RelayScratch,
    cost_steps,
    relay_blocks,
    sum_around,
)
from upholster.synthesis.quilt.kernels._sheet_kernels import FIT, MOST_SHEETS
from upholster.synthesis.quilt.lay_plan import LayPlan
from upholster.synthesis.quilt.puts import piece_frame
from upholster.synthesis.quilt.steering import EITHER

__all__ = ["Drawn", "ParcelBlocks", "draw_parcel", "lay_parcel"]

_BARE = 1.0
"""Distance, in blocks, within which a parcel may cover a bare step."""

_AROUND_LAYING, _AROUND_LABELS = 3.3, 1.5
"""Distances from a parcel, in blocks, within which other parcels' blocks matter: for laying its own blocks,
and for its labels."""

_REACH = 1.2
"""Distance from a block's centre, in blocks, to the end of the surface that the block covers or compares."""

_NEAR = 1.6
"""Distance in blocks within which a block waits for earlier blocks and avoids their sources. Blocks that
touch are less than 1.5 blocks apart."""

_ROW = 2.0**20
"""A row is more steps than this after the one above it is, in the order of a flat texture."""

_AGAIN = 0.5
"""Distance of the places where laying again is tried, relative to that of blocks."""

_TIMES = 4
"""Number of times that the worst places are laid again: each time others, and all in parallel."""

_APART = 0.7
"""Distance within which only the place with the highest cost of cuts is laid again at a time, in blocks."""

_INNER = 0.35
"""Half the side of the square around such a place in which cuts must cost much, in blocks."""

_EACH = 2
"""Mean number of blocks of a rank for each thread: with fewer, starting a thread's share takes too long."""

_FEW = 64
"""Mean number of blocks between two reports of progress, at least."""

_REPORTS = 32
"""Maximum number of reports of progress, each after several ranks of blocks."""

_SIZES = 3.0
"""Number of grids for each octave of block sizes, where sizes differ."""

_NUMBERS = 2**24
"""Each parcel has a range of this many numbers for its blocks; the ranges are in the order of parcels."""


@dataclass(frozen=True, eq=False, slots=True)
class ParcelBlocks:
    """The n blocks of a parcel that show something.

    Attributes
    ----------
    numbers
        (n,) int64: their positions in the order of all blocks, ascending.
    steps
        (n, 3) int32: chart, row and column of their centres.
    spots
        (n, 3) positions of the centres in space.
    records
        (n, `BLOCK_COLUMNS`) their sources and symmetries, see `_block_kernels`.
    masks
        (n, bytes) uint8: one bit for each cell of the frame, 1 if the block shows there.
    """

    numbers: NDArray[np.int64]
    steps: IntArray
    spots: FloatArray
    records: IntArray
    masks: NDArray[np.uint8]

    def chosen(self, which: NDArray[np.bool_]) -> "ParcelBlocks":
        """Return the blocks selected by the mask `which` (n,)."""
        return ParcelBlocks(
            self.numbers[which],
            self.steps[which],
            self.spots[which],
            self.records[which],
            self.masks[which],
        )

    @classmethod
    def joined(cls, plan: LayPlan, parts: Sequence["ParcelBlocks"]) -> "ParcelBlocks":
        """Return the blocks of several parcels, in that order."""
        cells = (plan.numbers.size // plan.numbers.cell) ** 2
        return cls(
            np.concatenate([np.zeros(0, np.int64), *(part.numbers for part in parts)]),
            np.concatenate([np.zeros((0, 3), np.int32), *(part.steps for part in parts)]),
            np.concatenate([np.zeros((0, 3)), *(part.spots for part in parts)]),
            np.concatenate([np.zeros((0, BLOCK_COLUMNS), np.int32), *(part.records for part in parts)]),
            np.concatenate([np.zeros((0, -(-cells // 8)), np.uint8), *(part.masks for part in parts)]),
        )


@dataclass(frozen=True, eq=False, slots=True)
class Drawn:
    """Ground with blocks on it.

    Attributes
    ----------
    placed
        The ground.
    own
        (T,) mask of the parcel's own triangles.
    numbers, records
        (B,) and (B, `BLOCK_COLUMNS`) of the blocks, in the order in which canvases number them: see
        `ParcelBlocks`.
    firsts, fits
        (B + 1,) the index of each block's first sheet, and all sheets' fits, (S, `FIT`).
    """

    placed: PlacedGround
    own: NDArray[np.bool_]
    numbers: NDArray[np.int64]
    records: IntArray
    firsts: NDArray[np.int64]
    fits: FloatArray


def lay_parcel(
    plan: LayPlan,
    parcel: int,
    before: Sequence[ParcelBlocks],
) -> tuple[ParcelBlocks, Drawn | None]:
    """Lay the blocks of a parcel; return them, and the ground with them, None if it contains no surface.

    Progress has the stage "blocks".

    Parameters
    ----------
    plan, parcel
        The plan, and the parcel's number.
    before
        The blocks of the neighbouring parcels that were laid already, in the parcels' order.
    """
    placed = plan.ground(parcel, _AROUND_LAYING + _REACH)
    if placed is None:
        return ParcelBlocks.joined(plan, ()), None
    laying = _Laying(plan, parcel, placed)
    laying.replay(ParcelBlocks.joined(plan, before), _AROUND_LAYING)
    laying.lay_all()
    return laying.laid(), laying.drawn()


def draw_parcel(plan: LayPlan, parcel: int, parts: Sequence[ParcelBlocks]) -> Drawn | None:
    """Redraw the blocks in a parcel and next to it: `parts` are the parcel's blocks and its neighbours'."""
    placed = plan.ground(parcel, _AROUND_LABELS + _REACH)
    if placed is None:
        return None
    laying = _Laying(plan, parcel, placed)
    laying.replay(ParcelBlocks.joined(plan, parts), _AROUND_LABELS)
    return laying.drawn()


class _Laying:
    """A parcel in progress: its ground, and the blocks on it; blocks that are only redrawn come first."""

    def __init__(
        self,
        plan: LayPlan,
        parcel: int,
        placed: PlacedGround,
    ) -> None:
        self.plan, self.parcel, self.placed = plan, parcel, placed
        middles = placed.ground.mesh.corners.mean(axis=1)
        self.own = plan.parcels.of_points(middles) == parcel
        self.bare = plan.parcels.last_of_points(middles, _BARE) == parcel
        self.tile = plan.scene.charted.mesh.box if plan.scene.charted.is_tile else None
        sizes = plan.scene.sizes
        self.block = plan.numbers.size / plan.pixels * (1.0 if sizes is None else sizes.most)
        # Block 0 represents all kept steps; it has no position.
        fixed = placed.ground.canvases.fixed
        self.centres = centres_at(placed, np.full((fixed, 3), (0, -1, -1), np.int32))
        self.numbers = np.full(fixed, -1, np.int64)
        self.scales = np.full(fixed, plan.pixels)
        self.records = np.zeros((fixed, BLOCK_COLUMNS), np.int32)
        self.masks = np.zeros((fixed, (plan.numbers.size // plan.numbers.cell) ** 2), np.uint8)
        self.sheets: dict[int, tuple[NDArray[np.int64], FloatArray]] = {}
        if fixed:
            self.sheets[0] = np.zeros(fixed, np.int64), np.zeros((0, FIT))
        self.first, self.stop = fixed, stop_flag()
        self._free: list[LayScratch] = []

    def replay(self, blocks: ParcelBlocks, around: float) -> None:
        """Redraw those of some blocks whose centres are within `around` blocks of the parcel."""
        box = self.plan.parcels.box(self.parcel, around)
        if box is not None:
            blocks = blocks.chosen(((blocks.spots >= box[0]) & (blocks.spots <= box[1])).all(axis=1))
        if not len(blocks.numbers):
            return
        count = self.first = len(blocks.numbers)
        self._add(centres_at(self.placed, blocks.steps), blocks.numbers)
        self.centres.spots[:] = blocks.spots  # also for blocks that are not on this ground
        self.records[:] = blocks.records
        self.masks[:] = np.unpackbits(blocks.masks, axis=1, count=self.masks.shape[1])
        fits, pieces = np.empty((count, MOST_SHEETS, FIT)), np.zeros(count, np.int64)
        order = np.argsort(self.numbers)
        scratch = self._scratch()
        replay_blocks(
            self.placed.ground, self.plan.numbers, self._arrays(), order, self.masks, fits, pieces, scratch,
        )  # fmt: skip
        self._keep(0, fits, pieces)
        self._free.append(scratch)

    def lay_all(self) -> None:
        """Lay the pieces that the user put, then blocks on even grids, then blocks on bare steps."""
        self._put_all()
        numbers = self.plan.numbers
        across = numbers.size / self.plan.pixels * self.plan.density  # a block, in steps
        apart = max(2.0, (1 - self.plan.overlap) * across)
        self.lay(self._on_grids(apart))
        # Each block shows at least its centre, so no step is bare after a grid of single steps.
        step = 0.5 * across * (1.0 if self.plan.scene.sizes is None else self.plan.scene.sizes.most)
        while len((centres := centres_on(self.placed, self.bare, step, 0.5 * step, bare=True)).steps):
            self.lay(centres)
            step = max(1.0, 0.5 * step)
        if self.plan.scene.steering.differs:
            return  # its places would look as before
        places = self._on_grids(_AGAIN * apart)
        for _ in range(_TIMES):
            worst = self._costly(places)
            self.lay(places.chosen(worst), again=True)
            places = places.chosen(~worst)

    def _put_all(self) -> None:
        # Lays the pieces that the user put, and fixes them.
        for number, piece in enumerate(self.plan.scene.steering.put):
            n = len(self.records)
            frame = piece_frame(piece, self.plan.numbers)
            self._add(
                centres_at(self.placed, np.array([piece.step], np.int32)), np.array([-2 - number], np.int64)
            )
            self.records[n, [SOURCE_ROW, SOURCE_COLUMN, OUTCOME]] = *frame.source, 2
            fits = np.empty((1, MOST_SHEETS, FIT))
            pieces = put_block(
                self.placed.ground, frame.numbers, self._arrays(), n, piece.turn(), frame.half, frame.mask,
                fits[0], LayScratch.of(self.placed.ground, frame.numbers),
            )  # fmt: skip
            self._keep(n, fits, np.array([pieces]))
            canvases = self.placed.ground.canvases._replace(fixed=n + 1)
            self.placed = replace(self.placed, ground=self.placed.ground._replace(canvases=canvases))

    def _on_grids(self, step: float) -> Centres:
        # Centres `step` steps apart, times the factor by which the sample is enlarged there.
        if self.plan.scene.sizes is None:
            return centres_on(self.placed, self.own, step, GUTTER + 0.35 * step, bare=False)
        middles = self.placed.ground.mesh.corners.mean(axis=1)
        sizes = self.plan.scene.sizes.at(self.placed.parent, middles)
        finer = np.rint(np.log2(sizes) * _SIZES).astype(np.int64)
        parts = []
        for number in np.unique(finer[self.own]).tolist():
            wide = max(2.0, step * 2.0 ** (number / _SIZES))
            own = self.own & (finer == number)
            parts.append(centres_on(self.placed, own, wide, GUTTER + 0.35 * wide, bare=False))
        found = centres_at(self.placed, np.zeros((0, 3), np.int32))
        for part in parts:
            found = found.with_more(part)
        return found

    def lay(self, centres: Centres, *, again: bool = False) -> None:
        """Lay blocks with these centres; `again`: over others, where cuts then cost less."""
        first, count = len(self.records), len(centres.steps)
        if not count:
            return
        spots = np.concatenate([self._laid_spots(), centres.spots])
        near = near_blocks(spots, _NEAR * self.block, self.tile, first=first)
        away = self._distances(near, centres, again)[first:]
        ranks = ranks_of(near, first, np.argsort(away, kind="stable"))
        order = np.lexsort((away, ranks))
        names = np.concatenate([np.arange(first), first + np.argsort(order)])
        self._add(centres.chosen(order), _NUMBERS * self.parcel + first - self.first + np.arange(count))
        earlier = None if again else near.earlier(names, first)
        self._lay_ranks(first, first + np.cumsum(np.bincount(ranks)), earlier)

    def _costly(self, centres: Centres) -> NDArray[np.bool_]:
        # Those of some centres around which cuts cost much, and more than around all others near them.
        plan, ground = self.plan, self.placed.ground
        canvases, costs = ground.canvases, np.zeros(len(ground.canvases.owners))
        cost_steps(ground, plan.match, plan.numbers, self.records, costs)
        found, least = np.zeros(len(centres.steps)), plan.weights.relay * plan.numbers.size
        pixel = plan.density / self._scales_at(centres)  # in steps
        reach = np.maximum(1, np.rint(_INNER * plan.numbers.size * pixel)).astype(np.int64)
        sum_around(canvases, costs, centres.roots, reach, found)
        found /= pixel
        near = near_blocks(centres.spots, _APART * self.block, self.tile)
        rows, highest = np.flatnonzero(np.diff(near.firsts)), np.zeros(len(found))
        highest[rows] = np.maximum.reduceat(found[near.others], near.firsts[rows])
        worst: NDArray[np.bool_] = (found >= highest) & (found > least)
        return worst

    def _laid_spots(self) -> FloatArray:
        # The positions of the blocks so far; block 0, if it represents kept steps, is far from all others.
        spots = self.centres.spots.copy()
        if self.plan.before is not None:
            spots[0] = self.placed.ground.mesh.corners.min(axis=(0, 1)) - 4 * _NEAR * self.block
        return spots

    def _distances(self, near: Near, centres: Centres, again: bool) -> FloatArray:
        # The order of the new blocks, as values for all blocks: how far each is from what is laid already.
        if again:  # in any order: like this, few ranks follow each other
            return np.append(np.zeros(len(self.records)), _scattered(len(centres.steps)))
        if self.plan.in_rows:
            return np.append(np.zeros(len(self.records)), centres.steps[:, 1:] @ np.array([_ROW, 1.0]))
        known = np.where(self.records[:, OUTCOME] != 0, 0.0, np.inf)
        if self.plan.before is not None:
            known[0] = np.inf
        triangles = np.concatenate([self.centres.triangles, centres.triangles])
        normals = self.placed.ground.mesh.normals[triangles]
        return distances_from(near, normals, np.concatenate([known, self._from_kept(centres)]))

    def _from_kept(self, centres: Centres) -> FloatArray:
        # The distance of each centre from kept steps on its chart; infinite if none is near it.
        away = np.full(len(centres.steps), np.inf)
        if self.plan.before is None:
            return away
        canvases = self.placed.ground.canvases
        for chart in np.unique(centres.steps[:, 0]).tolist():
            shape = canvases.heights[chart], canvases.widths[chart]
            window = slice(canvases.firsts[chart], canvases.firsts[chart] + shape[0] * shape[1])
            kept, steps = (canvases.sheets[window] == KEPT_SHEET).reshape(shape), np.empty(shape, np.int32)
            measure_distances(kept.view(np.uint8), steps)
            mine = centres.steps[:, 0] == chart
            rows, columns = centres.roots[mine, 1:3].astype(np.int64).T
            away[mine] = steps[rows, columns] / (3 * self.plan.density)
        return np.where(away < _NEAR * self.block, away, np.inf)

    def _lay_ranks(self, first: int, stops: NDArray[np.int64], near: Lists | None) -> None:
        # Lays blocks from `first` on, rank by rank; `stops` are the ends of the ranks. Without lists of the
        # blocks near each, blocks are laid over others.
        count, starts = int(stops[-1]) - first, np.append(first, stops[:-1])
        workers = max(1, min(thread_count(), count // (_EACH * len(stops))))
        parts = max(1, min(_REPORTS, len(stops), count // _FEW))
        for ranks in np.array_split(np.column_stack([starts, stops]), parts):
            own, ends = ranks.tolist(), Barrier(workers)
            if workers == 1:  # one after another, without a call for each rank
                own = [(own[0][0], own[-1][1])]
            tasks = [partial(self._share_ranks, own, near, (n, workers), ends) for n in range(workers)]
            run_tasks(tasks, threads=workers)
            report_progress("blocks", int(ranks[-1, 1]) - first, count)

    def _share_ranks(
        self, ranks: list[tuple[int, int]], near: Lists | None, share: tuple[int, int], ends: Barrier
    ) -> None:
        # Lays one thread's share of some ranks: part n of `workers`. All threads end a rank together.
        n, workers = share
        try:
            for start, stop in ranks:
                own = [start + (stop - start) * k // workers for k in (n, n + 1)]
                if own[0] < own[1]:
                    self._lay_part((own[0], own[1]), near)
                if workers > 1:
                    ends.wait()
        except BrokenBarrierError:
            return  # another thread's error is raised
        except BaseException:
            ends.abort()
            raise

    def laid(self) -> ParcelBlocks:
        """Return the parcel's own blocks."""
        kept = self.first + np.flatnonzero(self.records[self.first :, OUTCOME])
        return ParcelBlocks(
            self.numbers[kept],
            self.centres.steps[kept],
            self.centres.spots[kept],
            self.records[kept],
            np.packbits(self.masks[kept], axis=1),
        )

    def drawn(self) -> Drawn:
        """Return the ground in its current state."""
        parts = [self.sheets[start] for start in sorted(self.sheets)]
        counts = np.concatenate([np.zeros(1, np.int64), *(count for count, _ in parts)])
        fits = np.concatenate([np.zeros((0, FIT)), *(own for _, own in parts)])
        return Drawn(self.placed, self.own, self.numbers, self.records, np.cumsum(counts), fits)

    def _add(self, centres: Centres, numbers: NDArray[np.int64]) -> None:
        records = np.zeros((len(numbers), BLOCK_COLUMNS), np.int32)
        zones = self._zones_at(centres)
        for zone, phases in enumerate(self.plan.scene.phases, 1):
            mine = np.flatnonzero(zones == zone)
            if phases is not None and len(mine):
                wanted = phases.at(self.placed.parent[centres.triangles[mine]], centres.spots[mine])
                records[mine, PHASE : PHASE + len(wanted)] = wanted.T
        masks = np.zeros((len(numbers), self.masks.shape[1]), np.uint8)
        self.scales = np.concatenate([self.scales, self._scales_at(centres)])
        self.centres = self.centres.with_more(centres)
        self.numbers = np.concatenate([self.numbers, numbers])
        self.records = np.concatenate([self.records, records])
        self.masks = np.concatenate([self.masks, masks])

    def _scales_at(self, centres: Centres) -> FloatArray:
        # Frame pixels per model unit at each centre.
        scales = np.full(len(centres.steps), self.plan.pixels)
        if self.plan.scene.sizes is None:
            return scales
        factors: FloatArray = self.plan.scene.sizes.at(self.placed.parent[centres.triangles], centres.spots)
        return scales / factors

    def _zones_at(self, centres: Centres) -> NDArray[np.uint8]:
        # The zone that each block shows; 1 if there are no zones.
        canvases = self.placed.ground.canvases
        if not len(canvases.zones):
            return np.ones(len(centres.steps), np.uint8)
        chart, at = centres.roots[:, 0].astype(np.int64), centres.roots[:, 1:3].astype(np.int64)
        step = canvases.firsts[chart] + at[:, 0] * canvases.widths[chart] + at[:, 1]
        return np.maximum(canvases.zones[step] % EITHER, 1)

    def _arrays(self) -> BlockArrays:
        own = self.centres
        return BlockArrays(own.triangles, own.roots, own.spots, self.scales, self.records)

    def _lay_part(self, part: tuple[int, int], near: Lists | None) -> None:
        plan, (start, stop) = self.plan, part
        scratch = self._free.pop() if self._free else self._scratch()
        fits, pieces = np.empty((stop - start, MOST_SHEETS, FIT)), np.zeros(stop - start, np.int64)
        ground, blocks, masks = self.placed.ground, self._arrays(), self.masks[start:stop]
        # A block's generator follows from its number.
        seed = np.uint64((plan.seed + int(self.numbers[start]) * MULTIPLIER) % 2**64)
        if near is None:
            relay_blocks(
                ground, plan.match, plan.numbers, plan.weights, blocks, part,
                seed, fits, pieces, masks, self.stop, scratch, RelayScratch.of(plan.numbers),
            )  # fmt: skip
        else:
            lay_blocks(
                ground, plan.match, plan.numbers, plan.weights, blocks, part, near[0], near[1],
                seed, fits, pieces, masks, self.stop, scratch,
            )  # fmt: skip
        self._keep(start, fits, pieces)
        self._free.append(scratch)

    def _keep(self, start: int, fits: FloatArray, pieces: NDArray[np.int64]) -> None:
        counts = np.where(self.records[start : start + len(pieces), OUTCOME], pieces, 0)
        self.sheets[start] = counts, fits[np.arange(MOST_SHEETS) < counts[:, None]]

    def _scratch(self) -> LayScratch:
        return LayScratch.of(self.placed.ground, self.plan.numbers)


def _scattered(count: int) -> FloatArray:
    # Numbers in an order that looks random: Fibonacci hashing.
    found: FloatArray = (np.arange(count, dtype=np.uint64) * np.uint64(MULTIPLIER)).astype(np.float64)
    return found
