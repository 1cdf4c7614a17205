"""The size of a repeating sample changed a little, so that a whole number of periods goes round a model."""

from collections.abc import Sequence

import numpy as np

from upholster.charts.axis_directions import Round
from upholster.lattice import Lattice
from upholster.types import FloatArray

__all__ = ["MOST_CHANGE", "fitted"]

MOST_CHANGE = 0.03
"""Of the sample's size, at most."""

_STEPS = 600
_LEAST = 0.2
"""Share of a wave that must go round, for it to count: others run along."""

_PREFERRED = 1e-3
"""How much a change of `MOST_CHANGE` costs, in squares of periods that are left over."""


def fitted(lattice: Lattice, rounds: Sequence[Round], pixels: float, *, along: bool) -> tuple[float, float]:
    """Return by what factor to change a sample's size, and how far from whole the periods are then.

    Parameters
    ----------
    lattice
        At which waves the sample repeats.
    rounds
        Where the model closes round an axis.
    pixels
        Of the sample on a model unit, before.
    along
        Whether the sample's rows run along the axes: then its columns go round.

    Returns
    -------
    factor
        Within 3 % of 1.
    left
        Root of the mean square, over the area, of what is left of a period; 0 is a whole number everywhere.
    """
    steps = lattice.waves[:, 0 if along else 1]
    sizes = np.linalg.norm(lattice.waves, axis=1)
    steps = np.abs(steps[np.abs(steps) > _LEAST * sizes])
    lengths, areas = np.array([one.length for one in rounds]), np.array([one.area for one in rounds])
    if not len(steps) or not len(lengths):
        return 1.0, 0.0
    factors = np.linspace(1 - MOST_CHANGE, 1 + MOST_CHANGE, _STEPS + 1)
    cycles = lengths[:, None, None] * pixels * steps[:, None] / factors
    square = _squares(cycles, areas)
    costs = square + _PREFERRED * ((factors - 1) / MOST_CHANGE) ** 2
    best = int(costs.argmin())
    return float(factors[best]), float(np.sqrt(square[best]))


def _squares(cycles: FloatArray, areas: FloatArray) -> FloatArray:
    off = ((cycles - np.rint(cycles)) ** 2).mean(axis=1)
    mean: FloatArray = (areas / areas.sum()) @ off
    return mean
