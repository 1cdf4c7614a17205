"""What a source costs that shows a landmark of the sample which was shown near by before."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline
from upholster.types import FloatArray, IntArray, int64

__all__ = ["LandmarkUses", "penalise_landmarks", "shown_landmarks"]

_WITHIN = 0.4
"""Of a block: what lies so near to its middle is surely shown; the rest may be cut away."""


class LandmarkUses(NamedTuple):
    """Where landmarks of the sample are shown.

    `marks` (n, 3), n at most 63, are their rows and columns on the level that is looked at, and how much they
    count, 256 at most. `shown` (blocks,) has bit k where a block shows landmark k, `places` (blocks, 3) are
    where blocks lie, in exemplar pixels on the surface: first `before` blocks of other charts, then those of
    the chart that is laid. Of these the last `look` are looked at. What is nearer than `reach` costs;
    `period` is how far it is round a tile, infinite where there is none. `weight` is what a landmark costs
    shown twice in one place, and `usual` how many times that it costs where landmarks are spread evenly.
    `costs` (n,) and `lattice`, of the shape of usage for one symmetry, are scratch.
    """

    marks: IntArray
    shown: NDArray[np.int64]
    places: FloatArray
    before: int
    look: int
    reach: float
    period: tuple[float, float]
    weight: float
    usual: float
    costs: FloatArray
    lattice: FloatArray


@inline
def shown_landmarks(uses: LandmarkUses, row: int, column: int, tall: int, wide: int) -> Any:
    """Return which landmarks a block of tall × wide pixels shows whose centre reads at a pixel."""
    bits = int64(0)
    for k in range(uses.marks.shape[0]):
        within = (
            abs(uses.marks[k, 0] - row) <= _WITHIN * tall and abs(uses.marks[k, 1] - column) <= _WITHIN * wide
        )
        if within:
            bits |= int64(1) << k
    return bits


@inline
def _add_cost(uses: LandmarkUses, m: int, place: FloatArray) -> None:
    # What block m shows costs the more, the nearer it is.
    bits = uses.shown[m]
    if bits == 0:
        return
    y, x = abs(uses.places[m, 0] - place[0]), abs(uses.places[m, 1] - place[1])
    z = uses.places[m, 2] - place[2]
    y, x = min(y, abs(uses.period[0] - y)), min(x, abs(uses.period[1] - x))
    share = 1.0 - (y * y + x * x + z * z) / (uses.reach * uses.reach)
    if share > 0.0:
        for k in range(uses.marks.shape[0]):
            if bits >> k & 1:
                uses.costs[k] += share * share


@inline
def penalise_landmarks(
    uses: LandmarkUses, step: int, n: int, tall: int, wide: int, penalties: FloatArray
) -> None:
    """Add to each place what a block of tall × wide pixels costs there for the landmarks that it shows.

    It is block n of its chart. `penalties` are those of every `step`-th pixel. A landmark that is shown less
    near by than is usual costs less than a place without one: none is shown less often in all.
    """
    if uses.marks.shape[0] == 0 or uses.weight <= 0.0:
        return
    uses.costs[:] = 0.0
    first, last = uses.before, uses.before + n
    place = uses.places[last]
    for m in range(first):
        _add_cost(uses, m, place)
    recent = max(first, last - uses.look)
    for m in range(recent, last):
        _add_cost(uses, m, place)
    if uses.period[0] < np.inf:  # the first ones lie beyond the opposite edge
        for m in range(first, min(recent, first + uses.look)):
            _add_cost(uses, m, place)
    lattice, high, broad = uses.lattice, _WITHIN * tall, _WITHIN * wide
    lattice[:] = 0.0
    for k in range(uses.marks.shape[0]):
        row, column = uses.marks[k, 0], uses.marks[k, 1]
        cost = uses.weight * uses.marks[k, 2] / 256.0 * (uses.costs[k] - uses.usual)
        i0, i1 = max(0, int64(np.ceil((row - high) / step))), int64(np.floor((row + high) / step)) + 1
        j0, j1 = max(0, int64(np.ceil((column - broad) / step))), int64(np.floor((column + broad) / step)) + 1
        for i in range(i0, min(i1, lattice.shape[0])):
            for j in range(j0, min(j1, lattice.shape[1])):
                lattice[i, j] += cost
    least = 0.0
    for i in range(lattice.shape[0]):
        for j in range(lattice.shape[1]):
            least = min(least, lattice[i, j])
    for i in range(lattice.shape[0]):
        for j in range(lattice.shape[1]):
            penalties[i, j] += lattice[i, j] - least
