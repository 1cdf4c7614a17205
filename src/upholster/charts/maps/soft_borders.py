"""Maps whose borders are softened over a width: means over the surroundings of each place, in space."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.charts.maps.map_ground import MapGround, Steps, over_steps
from upholster.charts.maps.shapes import corners_of
from upholster.runtime.parallel import run_alone

__all__ = ["softened"]

_CELLS = 3
"""Cells of space from a place to the end of its surroundings, each way."""

_MOST_CELLS = 2**23
"""Greatest number of cells of the bounding box; a narrower width is widened until they suffice."""


def softened(
    values: Sequence[NDArray[np.float32]], ground: MapGround, width: float
) -> tuple[NDArray[np.float32], ...]:
    """Return a map's mean over a cube of space around each step, approximately of the wanted width.

    A border between 0 and 1 becomes a ramp of that width, over seams as elsewhere.

    Parameters
    ----------
    values
        For each chart (height, width); NaN where the map has no value: these steps have no weight.
    ground
        The surface.
    width
        In model units, above 0.

    Returns
    -------
    tuple of ndarray
        For each chart (height, width); NaN where the map has no value nearby.
    """
    mesh = ground.charted.mesh
    corners, low, size = corners_of(mesh), mesh.box[0], mesh.box[1] - mesh.box[0]
    cell = max(width / (2 * _CELLS + 1), float(np.prod(np.maximum(size, 1e-12)) / _MOST_CELLS) ** (1 / 3))
    cell = max(cell, float(size.max()) / _MOST_CELLS ** (1 / 2))
    shape = (np.floor(size / cell).astype(np.int64) + 2 * _CELLS + 2).tolist()
    sums, counts = np.zeros(shape, np.float64), np.zeros(shape, np.float64)

    def add(steps: Steps) -> NDArray[np.float32]:
        row, column = steps.places.astype(np.int64).T
        own: NDArray[np.float32] = values[steps.number][row, column]
        asked = np.isfinite(own)
        at = tuple(((steps.mean_of(corners)[asked] - low) / cell).astype(np.int64).T + _CELLS)
        np.add.at(sums, at, own[asked])
        np.add.at(counts, at, 1.0)
        return own

    run_alone(over_steps, ground.charted, add, np.array(np.nan, np.float32))  # sums are shared
    for axis in range(3):
        sums, counts = (_box_sums(grid, axis) for grid in (sums, counts))

    def mean(steps: Steps) -> NDArray[np.float32]:
        at = (steps.mean_of(corners) - low) / cell + _CELLS - 0.5
        found = _between(counts, at)
        near = np.where(found > 0, _between(sums, at) / np.maximum(found, 1e-12), np.nan)
        return np.asarray(near, np.float32)

    return over_steps(ground.charted, mean, np.array(np.nan, np.float32))


def _box_sums(grid: FloatArray, axis: int) -> FloatArray:
    # The sum over this many cells before and after each cell along an axis.
    pad = [(_CELLS + 1, _CELLS) if n == axis else (0, 0) for n in range(3)]
    sums = np.cumsum(np.pad(grid, pad), axis=axis)
    count, width = grid.shape[axis], 2 * _CELLS + 1
    ends: list[FloatArray] = [np.take(sums, range(k, k + count), axis) for k in (width, 0)]
    return np.maximum(ends[0] - ends[1], 0.0)


def _between(grid: FloatArray, at: FloatArray) -> FloatArray:
    # Trilinear interpolation between the middles of cells.
    low = np.clip(np.floor(at).astype(np.int64), 0, np.array(grid.shape) - 2)
    share, out = np.clip(at - low, 0.0, 1.0), np.zeros(len(at))
    for corner in np.ndindex(2, 2, 2):
        weight = np.where(corner, share, 1 - share).prod(axis=1)
        out += weight * grid[tuple((low + corner).T)]
    return out
