"""Laying a surface's blocks, parcel by parcel.

A parcel's task takes the triangles within some blocks of its cube and redraws the blocks that earlier parcels
have laid there. Then it lays its own blocks: on even grids over the charts, then on steps that are still
bare, in the order of `lay_order`. The result of a task is small.

A bare step belongs to the last of the parcels near it: by then all of them have laid blocks on their grids.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from upholster.runtime.parallel import stop_flag
from upholster.synthesis.quilt.block_order import Lists
from upholster.synthesis.quilt.centres import Centres, centres_at, centres_on, centres_on_grids
from upholster.synthesis.quilt.kernels._block_kernels import MULTIPLIER, OUTCOME, SOURCE_COLUMN, SOURCE_ROW
from upholster.synthesis.quilt.kernels._lay_kernels import LayScratch, lay_blocks, replay_blocks
from upholster.synthesis.quilt.kernels._put_kernels import put_block
from upholster.synthesis.quilt.kernels._relay_kernels import RelayScratch, relay_blocks
from upholster.synthesis.quilt.kernels._sheet_kernels import FIT, MOST_SHEETS
from upholster.synthesis.quilt.laid_blocks import Drawn, LaidBlocks, ParcelBlocks
from upholster.synthesis.quilt.lay_order import in_order, share_ranks
from upholster.synthesis.quilt.lay_plan import LayPlan
from upholster.synthesis.quilt.puts import piece_frame
from upholster.synthesis.quilt.relaying import costly_centres

__all__ = ["draw_parcel", "lay_parcel"]

_BARE = 1.0
"""Distance, in blocks, within which a parcel may cover a bare step."""

_AROUND_LAYING, _AROUND_LABELS = 3.3, 1.5
"""Distances from a parcel, in blocks, within which other parcels' blocks matter: for laying its own blocks,
and for its labels."""

_REACH = 1.2
"""Distance from a block's centre, in blocks, to the end of the surface that the block covers or compares."""


def lay_parcel(
    plan: LayPlan, parcel: int, before: Sequence[ParcelBlocks]
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
    laying = _redrawn(plan, parcel, before, _AROUND_LAYING)
    if laying is None:
        return ParcelBlocks.joined(plan, ()), None
    laying.put_all()
    laying.lay_all()
    return laying.blocks.of_parcel(), laying.blocks.drawn()


def draw_parcel(plan: LayPlan, parcel: int, parts: Sequence[ParcelBlocks]) -> Drawn | None:
    """Redraw the blocks in a parcel and next to it: `parts` are the parcel's blocks and its neighbours'."""
    laying = _redrawn(plan, parcel, parts, _AROUND_LABELS)
    return None if laying is None else laying.blocks.drawn()


def _redrawn(plan: LayPlan, parcel: int, parts: Sequence[ParcelBlocks], around: float) -> "_Laying | None":
    # A parcel with those of some blocks that are within `around` blocks of it; None if it has no surface.
    placed = plan.ground(parcel, around + _REACH)
    if placed is None:
        return None
    before, box = ParcelBlocks.joined(plan, parts), plan.parcels.box(parcel, around)
    if box is not None:
        before = before.chosen(((before.spots >= box[0]) & (before.spots <= box[1])).all(axis=1))
    # Block 0 represents all kept steps.
    before = ParcelBlocks.joined(plan, [ParcelBlocks.nowhere(plan, placed.ground.canvases.fixed), before])
    laying = _Laying(LaidBlocks(plan, parcel, placed, before))
    laying.replay()
    return laying


class _Laying:
    """Lays blocks on a parcel's ground."""

    def __init__(self, blocks: LaidBlocks) -> None:
        self.blocks, self.plan, self._stop = blocks, blocks.plan, stop_flag()
        self._free: list[LayScratch] = []

    def replay(self) -> None:
        """Redraw the blocks that are known."""
        blocks, count = self.blocks, len(self.blocks.numbers)
        fits, pieces = np.empty((count, MOST_SHEETS, FIT)), np.zeros(count, np.int64)
        if (blocks.centres.triangles >= 0).any():
            ground, scratch, order = blocks.placed.ground, self._scratch(), np.argsort(blocks.numbers)
            replay_blocks(
                ground, self.plan.numbers, blocks.arrays, order, blocks.masks, fits, pieces, scratch
            )
            self._free.append(scratch)
        blocks.keep(0, fits, pieces)

    def put_all(self) -> None:
        """Lay the pieces that the user put, and fix them."""
        blocks = self.blocks
        for number, piece in enumerate(self.plan.scene.steering.put):
            n, ground = len(blocks.numbers), blocks.placed.ground
            frame = piece_frame(piece, self.plan.numbers)
            centre = centres_at(blocks.placed, np.array([piece.step], np.int32))
            blocks.add(centre, np.array([-2 - number], np.int64))
            blocks.records[n, [SOURCE_ROW, SOURCE_COLUMN, OUTCOME]] = *frame.source, 2
            fits = np.empty((1, MOST_SHEETS, FIT))
            pieces = put_block(
                ground, frame.numbers, blocks.arrays, n, piece.turn(), frame.half, frame.mask,
                fits[0], LayScratch.of(ground, frame.numbers),
            )  # fmt: skip
            blocks.keep(n, fits, np.array([pieces]))
            canvases = ground.canvases._replace(fixed=n + 1)
            blocks.placed = replace(blocks.placed, ground=ground._replace(canvases=canvases))

    def lay_all(self) -> None:
        """Lay blocks on even grids, then on bare steps, then again where cuts cost most."""
        plan, blocks, sizes = self.plan, self.blocks, self.plan.scene.sizes
        across = plan.numbers.size / plan.pixels * plan.steps_per_unit  # a block, in steps
        apart = max(2.0, (1 - plan.overlap) * across)
        self._lay(centres_on_grids(blocks.placed, blocks.own, apart, sizes))
        # Each block shows at least its centre, so no step is bare after a grid of single steps.
        middles = blocks.placed.ground.mesh.corners.mean(axis=1)
        bare = plan.parcels.last_of_points(middles, _BARE) == blocks.parcel
        step = 0.5 * across * (1.0 if sizes is None else sizes.most)
        while len((centres := centres_on(blocks.placed, bare, step, 0.5 * step, bare=True)).steps):
            self._lay(centres)
            step = max(1.0, 0.5 * step)
        if not plan.scene.steering.differs:  # otherwise places would look as before
            for centres in costly_centres(blocks, apart):
                self._lay(centres, again=True)

    def _lay(self, centres: Centres, *, again: bool = False) -> None:
        # Lays blocks with these centres; `again`: over others, where cuts then cost less.
        first, count = len(self.blocks.numbers), len(centres.steps)
        if count:
            order, stops, near = in_order(self.blocks, centres, again=again)
            self.blocks.add(centres.chosen(order), self.blocks.next_numbers(count))
            share_ranks(first, stops, lambda start, stop: self._lay_part(start, stop, near))

    def _lay_part(self, start: int, stop: int, near: Lists | None) -> None:
        # Lays blocks of one rank; over others if there are no lists of earlier blocks near them.
        plan, blocks, part = self.plan, self.blocks, (start, stop)
        ground, arrays, masks = blocks.placed.ground, blocks.arrays, blocks.masks[start:stop]
        scratch = self._free.pop() if self._free else self._scratch()
        fits, pieces = np.empty((stop - start, MOST_SHEETS, FIT)), np.zeros(stop - start, np.int64)
        # A block's generator follows from its number.
        seed = np.uint64((plan.seed + int(blocks.numbers[start]) * MULTIPLIER) % 2**64)
        if near is None:
            relay_blocks(
                ground, plan.match, plan.numbers, plan.weights, arrays, part,
                seed, fits, pieces, masks, self._stop, scratch, RelayScratch.of(plan.numbers),
            )  # fmt: skip
        else:
            lay_blocks(
                ground, plan.match, plan.numbers, plan.weights, arrays, part, near[0], near[1],
                seed, fits, pieces, masks, self._stop, scratch,
            )  # fmt: skip
        blocks.keep(start, fits, pieces)
        self._free.append(scratch)

    def _scratch(self) -> LayScratch:
        return LayScratch.of(self.blocks.placed.ground, self.plan.numbers)
