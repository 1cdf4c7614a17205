"""Nodes of a warp field round a corner about which the direction turns: fitted from inside the chart."""

from typing import NamedTuple

import numpy as np

from upholster.charts.tangents import node_texels
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import FIELD_STEP, node_count
from upholster.types import FloatArray

__all__ = ["Corner", "fitted_at_corner"]

NODES = 2
"""As many nodes from the corner on, each way, are fitted: to places of one more."""

EVEN = 0.02
"""What a difference from node to node weighs beside one from what a place asks for: so nodes are settled
beside which the chart has no places."""

LEAST_AREA = 0.2
"""Of what is found at a node: less is not sound, and nodes stay as found."""


class Corner(NamedTuple):
    """A corner of a chart: whether it is that of its last row, and of its last column."""

    down: bool
    right: bool


def fitted_at_corner(found: FloatArray, chart: Chart, margin: int, corner: Corner, finer: int) -> FloatArray:
    """Return matrices at a chart's nodes, those near a corner fitted to what is asked inside the chart.

    Parameters
    ----------
    found
        (R, C, 2, 2): what is asked at places, `finer` of them from node to node, each way.
    chart, margin
        As for its warp field.
    corner
        About which the direction turns.
    finer
        Places from node to node.

    Returns
    -------
    ndarray
        (rows, columns, 2, 2): as found, but round the corner.
    """
    nodes = found[::finer, ::finer].copy()
    hats, places, near = [], [], []
    for texels, last in ((chart.height, corner.down), (chart.width, corner.right)):
        at, count = node_texels(texels, margin, finer), node_count(texels, margin)
        away = np.abs(at - (texels - 0.5 if last else -0.5))
        hats.append(np.maximum(0.0, 1 - np.abs(np.arange(len(at))[:, None] / finer - np.arange(count))))
        places.append((at >= -0.5) & (at <= texels - 0.5) & (away < FIELD_STEP * (NODES + 1)))
        near.append((away < FIELD_STEP * NODES)[::finer])
    free = np.outer(*near).ravel()
    used = np.outer(*places)
    asked = np.einsum("ai,bj->abij", *hats)[used].reshape(int(used.sum()), -1)
    even = np.sqrt(EVEN) * _differences(*nodes.shape[:2])
    even = even[(even[:, free] != 0).any(axis=1)]
    rows = np.concatenate([asked, even])
    wanted = np.concatenate([found[used].reshape(-1, 4), np.zeros((len(even), 4))])
    flat = nodes.reshape(-1, 4)
    wanted -= rows[:, ~free] @ flat[~free]
    mine = rows[:, free]
    fitted = np.linalg.solve(mine.T @ mine, mine.T @ wanted)
    least = LEAST_AREA * np.abs(np.linalg.det(flat[free].reshape(-1, 2, 2)))
    if (np.linalg.det(fitted.reshape(-1, 2, 2)) > least).all():
        flat[free] = fitted
    return flat.reshape(nodes.shape)


def _differences(rows: int, columns: int) -> FloatArray:
    """Return the matrix that takes the nodes of a grid to what they differ by from those beside them."""
    number = np.arange(rows * columns).reshape(rows, columns)
    pairs = np.concatenate(
        [
            np.stack([number[1:].ravel(), number[:-1].ravel()], axis=1),
            np.stack([number[:, 1:].ravel(), number[:, :-1].ravel()], axis=1),
        ]
    )
    out = np.zeros((len(pairs), rows * columns))
    out[np.arange(len(pairs)), pairs[:, 0]] = 1.0
    out[np.arange(len(pairs)), pairs[:, 1]] = -1.0
    return out
