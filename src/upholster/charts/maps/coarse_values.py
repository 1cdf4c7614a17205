"""Values that are expensive to compute: computed at some steps, and spread over the others.

Each chart is cut into square cells; the step nearest to a cell's middle represents it. Values are bilinear
between the middles of cells. Two cells of an island do not influence each other if they are far apart in
space, as on both sides of a gap, or face different ways, as on both sides of an edge.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.maps._map_kernels import ALIKE, middle_steps, spread
from upholster.charts.maps.map_ground import AtSteps, Steps, triangles_at_steps

__all__ = ["CLASSES", "CoarseCells", "SurfacePoints", "coarse_cells", "spread_over_steps"]

MOST_POINTS = 250_000
"""Greatest number of cells with a step on the surface, over all charts."""

CLASSES = 16
"""Number of classes of cells; each square of four cells a side has one of each class."""

_TENT = (1, 2, 2, 2, 1)
"""Weights of adjacent cells: with these, each row and each column of classes has the same total weight."""

_INWARD = 1e-3
"""Share of the way by which points are moved towards the centroids of their triangles."""

_STRETCH = 1.5
"""Cells influence each other up to this many times their distance on the chart, measured in space."""


@dataclass(frozen=True, eq=False, slots=True)
class SurfacePoints:
    """Points on a surface.

    Attributes
    ----------
    positions
        (n, 3) in model units.
    normals
        (n, 3): unit normals of their triangles.
    kind
        (n,) the class of the cell that each point represents, 0 to `CLASSES` − 1.
    """

    positions: FloatArray
    normals: FloatArray
    kind: NDArray[np.int64]


@dataclass(frozen=True, eq=False, slots=True)
class CoarseCells:
    """A chart's cells.

    Attributes
    ----------
    stride
        Width of a cell in steps.
    on
        (rows, columns): cells with a step on the surface.
    positions, normals
        (rows, columns, 3) that step's position, and its triangle's normal; NaN for other cells.
    length
        (rows, columns) greatest length of a cell in space.
    """

    stride: int
    on: NDArray[np.bool_]
    positions: FloatArray
    normals: FloatArray
    length: FloatArray


def coarse_cells(charted: ChartedSurface) -> tuple[CoarseCells, ...]:
    """Cut charts into cells of as few steps as `MOST_POINTS` allows: 1, 2, 4 … each way."""
    triangles = triangles_at_steps(charted)
    count, stride = sum(int((each >= 0).sum()) for each in triangles), 1
    while count > stride * stride * MOST_POINTS:  # an upper limit, as if all cells were full
        stride *= 2
    found = [_middles(each, stride) for each in triangles]
    while sum(int((each[..., 0] >= 0).sum()) for each in found) > MOST_POINTS:
        stride *= 2
        found = [_middles(each, stride) for each in triangles]
    corners = charted.mesh.positions[charted.mesh.triangles]
    longest = np.linalg.norm(charted.steps, axis=1).max(axis=1)
    out = []
    for number, (each, middles) in enumerate(zip(triangles, found, strict=True)):
        on = middles[..., 0] >= 0
        row, column = middles[on].T
        mine = each[row, column]
        places = middles[on].astype(np.float64) + 0.5
        steps = Steps(charted, number, charted.charts[number], places, mine)
        positions, length = np.full((*on.shape, 3), np.nan), np.zeros(on.shape)
        normals = positions.copy()
        # Points exactly on an edge may be on either side of another triangle by chance.
        positions[on] = (1 - _INWARD) * steps.mean_of(corners) + _INWARD * corners[mine].mean(axis=1)
        normals[on], length[on] = charted.mesh.flat_normals[mine], stride * longest[mine]
        out.append(CoarseCells(stride, on, positions, normals, length))
    return tuple(out)


def _middles(triangles: IntArray, stride: int) -> NDArray[np.int64]:
    found = np.empty((*(-(-side // stride) for side in triangles.shape), 2), np.int64)
    middle_steps(triangles, stride, found)
    return found


def spread_over_steps(
    cells: Sequence[CoarseCells], evaluate: Callable[[SurfacePoints], FloatArray]
) -> AtSteps:
    """Return a function that evaluates cells' values at steps.

    Parameters
    ----------
    cells
        The cells of a surface's charts.
    evaluate
        A function from points (n, 3) to a value each. The values of one class may be rough if those of all
        classes together are not: they are smoothed over four cells.
    """
    kinds = [np.indices(each.on.shape) % 4 for each in cells]
    own = [(4 * kind[0] + kind[1])[each.on] for kind, each in zip(kinds, cells, strict=True)]
    positions = np.concatenate([each.positions[each.on] for each in cells])
    normals = np.concatenate([each.normals[each.on] for each in cells])
    found = evaluate(SurfacePoints(positions, normals, np.concatenate(own)))
    values = []
    for each, part in zip(cells, np.split(found, np.cumsum([len(one) for one in own])[:-1]), strict=True):
        grid = np.full(each.on.shape, np.nan)
        grid[each.on] = part
        values.append(_smoothed(each, grid))
    reach = [_STRETCH * (np.sqrt(2) + 1) * each.length for each in cells]

    def at(steps: Steps) -> NDArray[np.float32]:
        mine, out = cells[steps.number], np.empty(len(steps.triangles), np.float32)
        k = steps.number
        spread(steps.places, mine.stride, values[k], mine.positions, mine.normals, reach[k], out)
        return out

    return at


def _smoothed(cells: CoarseCells, values: FloatArray) -> NDArray[np.float32]:
    """Return means over adjacent cells, weighted by `_TENT` each way; NaN where there is no cell."""
    total, weights = np.zeros(values.shape), np.zeros(values.shape)
    height, width = values.shape
    half = len(_TENT) // 2
    for down in range(-half, half + 1):
        for right in range(-half, half + 1):
            here = np.s_[max(0, -down) : height - max(0, down), max(0, -right) : width - max(0, right)]
            there = np.s_[max(0, down) : height + min(0, down), max(0, right) : width + min(0, right)]
            reach = _STRETCH * (np.hypot(down, right) + 1) * cells.length[here]
            away = np.linalg.norm(cells.positions[here] - cells.positions[there], axis=2)
            alike = (cells.normals[here] * cells.normals[there]).sum(axis=2) >= ALIKE
            counts = alike & (away <= reach) if down or right else cells.on  # false where there is no cell
            weight = np.where(counts, _TENT[half + down] * _TENT[half + right], 0)
            total[here] += np.where(counts, values[there], 0.0) * weight
            weights[here] += weight
    return np.where(weights > 0, total / np.maximum(weights, 1), np.nan).astype(np.float32)
