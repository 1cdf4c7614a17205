"""Matrices at a chart's nodes, fitted to what is found at places between them."""

import numpy as np

from upholster.charts.corner_fit import Corner
from upholster.charts.tangents import node_texels
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import node_count
from upholster.types import FloatArray

__all__ = ["FINER", "finer_places", "matrices_at_nodes"]

_SHORT, FINER = 36, 8
"""A chart of fewer texels is looked at in so many places for each node."""

_NEAR_CHART = 2
"""Texels beyond a chart that count as those on it."""

_BEYOND = (0.002, 0.01, 0.05, 0.25)
"""What places farther away weigh: as little as leaves all matrices sound."""

_LEAST_AREA = 0.2
"""Of what is found at a node: less is not sound."""


def finer_places(chart: Chart, corner: Corner | None = None) -> tuple[int, int]:
    """Return how many places there are from node to node at which a chart is looked at, down and right."""
    down, right = (
        FINER if count < _SHORT or corner is not None else 1 for count in (chart.height, chart.width)
    )
    return down, right


def matrices_at_nodes(matrices: FloatArray, chart: Chart, margin: int) -> FloatArray:
    """Return the matrices at a chart's nodes between which all those that were found lie best.

    Where a chart is short, few nodes lie on it: they are fitted to places between them, each weighed by
    whether it lies on the chart. Where that leads astray, as round a pole, they stay as found.
    """
    down, right = finer_places(chart)
    found = matrices[::down, ::right]
    if (down, right) == (1, 1):
        return found
    least = _LEAST_AREA * np.linalg.det(found)
    for beyond in _BEYOND:
        fitted = matrices
        for axis, (count, finer) in enumerate(((chart.height, down), (chart.width, right))):
            if finer > 1:
                fit = _fit(count, margin, finer, beyond)
                fitted = np.moveaxis(np.tensordot(fit, fitted, axes=(1, axis)), 0, axis)
        sound = np.linalg.det(fitted) > least
        if sound.all():
            break
    return np.where(sound[..., None, None], fitted, found)


def _fit(texels: int, margin: int, finer: int, beyond: float) -> FloatArray:
    """Return the matrix that takes what is found at `finer` places for each node to nodes: least squares."""
    places, count = node_texels(texels, margin, finer), node_count(texels, margin)
    hats = np.maximum(0.0, 1 - np.abs(np.arange(len(places))[:, None] / finer - np.arange(count)))
    on = (places >= -_NEAR_CHART) & (places <= texels - 1 + _NEAR_CHART)
    weighed = hats * np.where(on, 1.0, beyond)[:, None]
    fit: FloatArray = np.linalg.solve(weighed.T @ hats, weighed.T)
    # Nodes beside which nothing lies on the chart stay as found.
    far = ~(hats[on] > 0).any(axis=0)
    fit[far] = np.eye(len(places))[::finer][far]
    return fit
