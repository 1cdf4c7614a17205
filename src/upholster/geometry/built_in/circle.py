"""The full circle as rational quadratic arcs."""

import math

import numpy as np

from upholster.base.types import FloatArray

__all__ = ["circle_arcs", "unit_circle"]


def unit_circle(steps: int) -> FloatArray:
    """Return (cos, sin) of the angles 2π·k/steps, shape (steps + 1, 2).

    Exact at multiples of a quarter turn, and the last row equals the first: shapes built from it close
    exactly.
    """
    table = np.empty((steps + 1, 2))
    for k in range(steps):
        quarter, rest = divmod(4 * k, steps)
        angle = 0.5 * math.pi * rest / steps
        c, s = math.cos(angle), math.sin(angle)
        table[k] = [(c, s), (-s, c), (-c, -s), (s, -c)][quarter]
    table[steps] = table[0]
    return table


def circle_arcs(spans: int) -> FloatArray:
    """Return the unit circle as `spans` ≥ 3 equal arcs, counter-clockwise from (1, 0).

    Returns
    -------
    FloatArray
        Homogeneous control points (x·w, y·w, w), shape (spans, 3, 3); weights 1, cos(π/spans), 1.

    References
    ----------
    L. Piegl and W. Tiller, *The NURBS Book*, 2nd edition, section 7.3.
    """
    table = unit_circle(2 * spans)
    arcs = np.ones((spans, 3, 3))
    arcs[:, 0, :2] = table[0:-1:2]
    arcs[:, 1, :2] = table[1::2]
    arcs[:, 1, 2] = math.cos(math.pi / spans)
    arcs[:, 2, :2] = table[2::2]
    return arcs
