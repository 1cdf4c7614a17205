"""Parcels: cubes of space into which a large surface is cut, so that no task ever holds all of it.

Parcels are laid outward from one end of the surface, as blocks are, see `block_order`. A parcel waits for its
earlier neighbours only: parcels of one rank are independent tasks. A small surface is one parcel; so is a
tile of any size.
"""

from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.subdivision import subdivided
from upholster.synthesis.quilt.block_order import distances_from, near_blocks, ranks_of

__all__ = ["MOST_WHOLE", "Parcels"]

SIDE = 2048
"""Minimum side of a parcel, in steps."""

MOST_WHOLE = 2**25
"""A surface with at most this many steps is one parcel."""

BLOCKS = 32
"""Minimum side of a parcel, in blocks: it also redraws about four blocks on each side."""

_TOUCHING = 1.8
"""Cubes whose first corners are less than this far apart, in sides, touch: at most √3."""

_FINE = 8
"""To find the parcels that triangles meet, triangles are cut to a parcel's side divided by this number."""


@dataclass(frozen=True, eq=False, slots=True)
class Parcels:
    """The parcels of a surface, numbered in the order in which they are laid.

    Attributes
    ----------
    origin
        (3,) the first cube's corner with the lowest coordinates.
    side
        Side of a cube, in model units.
    block
        Side of a block, in model units.
    cubes
        (P, 3) int64: the index of each parcel's cube along each axis.
    ranks
        For each rank the number of its first parcel, and that of the parcel after its last.
    charts
        For each parcel the charts that may have triangles in it.
    numbers
        (cubes along each axis) int32: the number of each cube's parcel, −1 for none.
    """

    origin: FloatArray
    side: float
    block: float
    cubes: NDArray[np.int64]
    ranks: tuple[tuple[int, int], ...]
    charts: tuple[tuple[int, ...], ...]
    numbers: IntArray

    @classmethod
    def of(
        cls, surface: ChartedSurface, vectors: FloatArray, block: float, steps_per_unit: float
    ) -> "Parcels":
        """Cut a surface; `block` is a block's side in model units."""
        low, high = surface.mesh.box
        steps = sum(chart.height * chart.width for chart in surface.charts)
        side = max(SIDE / steps_per_unit, BLOCKS * block)
        shape = np.maximum(np.ceil((high - low) / side).astype(np.int64), 1)
        if surface.is_tile or steps <= MOST_WHOLE or shape.prod() == 1:
            charts = tuple(range(len(surface.charts)))
            one = np.zeros((1, 3), np.int64)
            return cls(low, float(np.inf), block, one, ((0, 1),), (charts,), np.zeros((1, 1, 1), np.int32))
        origin: FloatArray = 0.5 * (low + high - side * shape)  # the surface is centred in the cubes
        fine = subdivided(surface, vectors, side / _FINE).surface
        met = _met(fine, origin, side, shape)
        cubes = np.unique(met[:, 1:], axis=0)
        near = near_blocks(cubes.astype(np.float64), _TOUCHING)
        away = distances_from(near, np.ones((len(cubes), 1)), np.full(len(cubes), np.inf))
        rank = ranks_of(near, 0, np.argsort(away, kind="stable"))
        order = np.lexsort((away, rank))
        cubes, rank = cubes[order], rank[order]
        numbers = np.full(shape, -1, np.int32)
        numbers[tuple(cubes.T)] = np.arange(len(cubes), dtype=np.int32)
        charts_of: list[list[int]] = [[] for _ in cubes]
        for chart, *cube in met.tolist():
            charts_of[numbers[tuple(cube)]].append(chart)
        firsts = [0, *(np.flatnonzero(np.diff(rank)) + 1).tolist(), len(cubes)]
        ranks = tuple(pairwise(firsts))
        return cls(origin, side, block, cubes, ranks, tuple(map(tuple, charts_of)), numbers)

    def __len__(self) -> int:
        """Return the number of parcels."""
        return len(self.cubes)

    def box(self, n: int, blocks: float) -> FloatArray | None:
        """Return a parcel's cube, enlarged by `blocks` blocks: (2, 3), from, to; None: all of the surface."""
        if len(self) == 1:
            return None
        reach, low = blocks * self.block, self.origin + self.side * self.cubes[n]
        return np.stack([low - reach, low + self.side + reach])

    def near(self, n: int) -> list[int]:
        """Return a parcel and its neighbours, in the order of parcels."""
        around = self.cubes[n] + np.array(list(product((-1, 0, 1), repeat=3)))
        around = around[((around >= 0) & (around < self.numbers.shape)).all(axis=1)]
        return sorted(n for n in self.numbers[tuple(around.T)].tolist() if n >= 0)

    def of_points(self, points: FloatArray) -> IntArray:
        """Return the parcels of points (m, 3); −1 for none."""
        if len(self) == 1:
            return np.zeros(len(points), np.int32)
        cubes = np.floor((points - self.origin) / self.side).astype(np.int64)
        found: IntArray = self.numbers[tuple(np.clip(cubes, 0, np.array(self.numbers.shape) - 1).T)]
        return found

    def last_of_points(self, points: FloatArray, blocks: float) -> IntArray:
        """Return for each of some points (m, 3) the last parcel within `blocks` blocks of it; −1 for none."""
        last = self.of_points(points)
        if len(self) > 1:
            for way in product((-1, 1), repeat=3):
                last = np.maximum(last, self.of_points(points + blocks * self.block * np.array(way)))
        return last


def _met(
    surface: ChartedSurface, origin: FloatArray, side: float, shape: NDArray[np.int64]
) -> NDArray[np.int64]:
    # The cubes that triangles' bounding boxes meet: (m, 4) chart and cube, without duplicates. Triangles are
    # smaller than cubes.
    corners = (surface.mesh.corners - origin) / side
    low = np.clip(np.floor(corners.min(axis=1) - 1e-9), 0, shape - 1).astype(np.int64)
    high = np.clip(np.floor(corners.max(axis=1) + 1e-9), 0, shape - 1).astype(np.int64)
    parts = [np.column_stack([surface.chart, np.where(way, high, low)]) for way in product((0, 1), repeat=3)]
    met: NDArray[np.int64] = np.unique(np.concatenate(parts), axis=0)
    return met
