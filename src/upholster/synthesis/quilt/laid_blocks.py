"""The blocks on a parcel's ground, and what other tasks get of them."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.synthesis.quilt.centres import Centres, centres_at
from upholster.synthesis.quilt.ground import PlacedGround
from upholster.synthesis.quilt.kernels._block_kernels import BLOCK_COLUMNS, OUTCOME, PHASE
from upholster.synthesis.quilt.kernels._lay_kernels import BlockArrays
from upholster.synthesis.quilt.kernels._sheet_kernels import FIT, MOST_SHEETS
from upholster.synthesis.quilt.lay_plan import LayPlan
from upholster.synthesis.quilt.steering import EITHER

__all__ = ["Drawn", "LaidBlocks", "ParcelBlocks"]

_FAR = 8.0
"""Distance of block 0 from the surface, in blocks, if it represents kept steps."""

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
        return ParcelBlocks(*(getattr(self, entry.name)[which] for entry in fields(self)))

    @classmethod
    def joined(cls, plan: LayPlan, parts: Sequence["ParcelBlocks"]) -> "ParcelBlocks":
        """Return the blocks of several parcels, in that order."""
        parts = [cls.nowhere(plan, 0), *parts]
        names = [entry.name for entry in fields(cls)]
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    @classmethod
    def nowhere(cls, plan: LayPlan, count: int) -> "ParcelBlocks":
        """Return blocks that are on no ground, and far from all others."""
        low = plan.scene.charted.mesh.box[0] - _FAR * plan.parcels.block
        return cls(
            np.full(count, -1, np.int64),
            np.full((count, 3), (0, -1, -1), np.int32),
            np.tile(low, (count, 1)),
            np.zeros((count, BLOCK_COLUMNS), np.int32),
            np.zeros((count, -(-plan.cells // 8)), np.uint8),
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


class LaidBlocks:
    """The blocks on a parcel's ground, in the order in which canvases number them; `before` come first.

    Masks have one byte for each cell. `own` (T,) are the parcel's own triangles.
    """

    def __init__(self, plan: LayPlan, parcel: int, placed: PlacedGround, before: ParcelBlocks) -> None:
        self.plan, self.parcel, self.placed = plan, parcel, placed
        self.own = plan.parcels.of_points(placed.ground.mesh.corners.mean(axis=1)) == parcel
        self.centres = centres_at(placed, before.steps)
        self.scales = self.scales_at(self.centres)
        self.centres.spots[:] = before.spots  # also for blocks that are not on this ground
        self.numbers, self.records, self._first = before.numbers, before.records, len(before.numbers)
        self.masks = np.unpackbits(before.masks, axis=1, count=plan.cells)
        self._sheets: dict[int, tuple[NDArray[np.int64], FloatArray]] = {}

    def next_numbers(self, count: int) -> NDArray[np.int64]:
        """Return the positions of the next blocks in the order of all blocks."""
        return _NUMBERS * self.parcel + len(self.numbers) - self._first + np.arange(count)

    def add(self, centres: Centres, numbers: NDArray[np.int64]) -> None:
        """Add blocks with these centres, which show nothing yet."""
        records = np.zeros((len(numbers), BLOCK_COLUMNS), np.int32)
        zones = self._zones_at(centres)
        for zone, phases in enumerate(self.plan.scene.phases, 1):
            mine = np.flatnonzero(zones == zone)
            if phases is not None and len(mine):
                wanted = phases.at(self.placed.parent[centres.triangles[mine]], centres.spots[mine])
                records[mine, PHASE : PHASE + len(wanted)] = wanted.T
        self.scales = np.append(self.scales, self.scales_at(centres))
        self.centres = self.centres.with_more(centres)
        self.numbers = np.append(self.numbers, numbers)
        self.records = np.concatenate([self.records, records])
        self.masks = np.concatenate([self.masks, np.zeros((len(numbers), self.plan.cells), np.uint8)])

    def keep(self, start: int, fits: FloatArray, pieces: NDArray[np.int64]) -> None:
        """Keep the fits (n, `MOST_SHEETS`, `FIT`) of n blocks from `start` on, `pieces` (n,) of each."""
        counts = np.where(self.records[start : start + len(pieces), OUTCOME], pieces, 0)
        self._sheets[start] = counts, fits[np.arange(MOST_SHEETS) < counts[:, None]]

    @property
    def arrays(self) -> BlockArrays:
        """The blocks in the kernels' form."""
        own = self.centres
        return BlockArrays(own.triangles, own.roots, own.spots, self.scales, self.records)

    def scales_at(self, centres: Centres) -> FloatArray:
        """Return the frame pixels per model unit at each centre, (n,)."""
        sizes, scales = self.plan.scene.sizes, np.full(len(centres.steps), self.plan.pixels)
        if sizes is None:
            return scales
        return scales / sizes.at(self.placed.parent[centres.triangles], centres.spots)

    def _zones_at(self, centres: Centres) -> NDArray[np.uint8]:
        # The zone that each block shows; 1 if there are no zones.
        canvases = self.placed.ground.canvases
        if not len(canvases.zones):
            return np.ones(len(centres.steps), np.uint8)
        chart, at = centres.roots[:, 0].astype(np.int64), centres.roots[:, 1:3].astype(np.int64)
        step = canvases.firsts[chart] + at[:, 0] * canvases.widths[chart] + at[:, 1]
        return np.maximum(canvases.zones[step] % EITHER, 1)

    def of_parcel(self) -> ParcelBlocks:
        """Return the parcel's own blocks."""
        kept = self._first + np.flatnonzero(self.records[self._first :, OUTCOME])
        return ParcelBlocks(
            self.numbers[kept],
            self.centres.steps[kept],
            self.centres.spots[kept],
            self.records[kept],
            np.packbits(self.masks[kept], axis=1),
        )

    def drawn(self) -> Drawn:
        """Return the ground in its current state."""
        parts = [self._sheets[start] for start in sorted(self._sheets)]
        counts = np.concatenate([np.zeros(1, np.int64), *(count for count, _ in parts)])
        fits = np.concatenate([np.zeros((0, FIT)), *(own for _, own in parts)])
        return Drawn(self.placed, self.own, self.numbers, self.records, np.cumsum(counts), fits)
