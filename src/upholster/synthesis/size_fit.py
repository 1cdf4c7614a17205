"""A small change of a repeating sample's size, so that a whole number of periods goes round a model."""

from collections.abc import Sequence

import numpy as np

from upholster.charts.axis_directions import Round
from upholster.image.elements.lattice import Lattice

__all__ = ["MOST_CHANGE", "fitted"]

MOST_CHANGE = 0.03
"""Largest change, as a share of the sample's size."""

_STEPS = 600
_LEAST = 0.2
"""Share of a wave that must go round for it to count: other waves run along."""

_PREFERRED = 1e-3
"""Cost of a change of `MOST_CHANGE`, in squares of remainders of periods."""


def fitted(
    lattice: Lattice, around: Sequence[Round], along: Sequence[Round], pixels: float
) -> tuple[float, float]:
    """Return the factor by which to change a sample's size, and the remainder of periods that it leaves.

    Parameters
    ----------
    lattice
        The waves at which the sample repeats.
    around, along
        Places where the model closes around an axis: where the sample's rows go round, and where they run
        along the axis, so that its columns go round.
    pixels
        Pixels of the sample per model unit, before the change.

    Returns
    -------
    factor
        Within 3 % of 1.
    left
        Root mean square, over the area, of the remainder of a period; 0 if whole numbers fit everywhere.
    """
    sizes = np.linalg.norm(lattice.waves, axis=1)
    cycles, areas = [], []  # for each wave that goes round, on each cylinder
    for rounds, part in ((around, 1), (along, 0)):
        steps = np.abs(lattice.waves[:, part])
        for step in steps[steps > _LEAST * sizes]:
            cycles += [one.length * pixels * step for one in rounds]
            areas += [one.area for one in rounds]
    if not cycles:
        return 1.0, 0.0
    factors = np.linspace(1 - MOST_CHANGE, 1 + MOST_CHANGE, _STEPS + 1)
    off = np.array(cycles)[:, None] / factors
    square = np.average((off - np.rint(off)) ** 2, axis=0, weights=areas)
    costs = square + _PREFERRED * ((factors - 1) / MOST_CHANGE) ** 2
    best = int(costs.argmin())
    return float(factors[best]), float(np.sqrt(square[best]))
