"""The ground on which maps are evaluated, and its steps in batches."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts._step_kernels import StepGrid, interpolate, locate_steps
from upholster.charts.charted_surface import ChartedSurface
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.model_files.model_file import ModelFile
from upholster.quilt.chart import Chart
from upholster.runtime.parallel import run_tasks, thread_count
from upholster.runtime.stages import stage

__all__ = ["AtSteps", "MapGround", "Steps", "over_steps", "triangles_at_steps"]

_BAND = 1 << 17
"""Approximate number of steps in a batch."""


@dataclass(frozen=True)
class MapGround:
    """The surface on which a map is evaluated, with everything that maps need of it.

    Attributes
    ----------
    charted
        The triangles, and the charts whose steps get values.
    model
        The file that its mesh was read from; otherwise None.
    surface
        The surface under the charts. The mesh of a `MeshSurface` is the charted surface's.
    is_flat
        Whether it is a flat texture: see `upholster.charts.charted_surface.charted_plane`.
    """

    charted: ChartedSurface
    model: ModelFile | None
    surface: AnySurface
    is_flat: bool


@dataclass(frozen=True, eq=False, slots=True)
class Steps:
    """Some steps of one chart that are on the surface.

    Attributes
    ----------
    charted
        The surface.
    number, chart
        The number of their chart, and the chart.
    places
        (n, 2) float64: row and column of the steps' centres on the chart.
    triangles
        (n,) int32: the triangle that contains each step or is next to it.
    """

    charted: ChartedSurface
    number: int
    chart: Chart
    places: FloatArray
    triangles: IntArray

    def mean_of(self, corners: FloatArray) -> FloatArray:
        """Interpolate values (T, 3, k) at the triangles' corners to the steps, (n, k)."""
        out = np.empty((len(self.triangles), corners.shape[2]))
        interpolate(self.places, self.triangles, self.charted.places, corners, out)
        return out

    def nearest_of(self, corners: NDArray[Any]) -> NDArray[Any]:
        """Return values (T, 3, …) at the corners nearest to the steps, (n, …)."""
        away = ((self.charted.places[self.triangles] - self.places[:, None]) ** 2).sum(axis=2)
        found: NDArray[Any] = corners[self.triangles, away.argmin(axis=1)]
        return found


AtSteps = Callable[[Steps], NDArray[Any]]
"""A function from steps to a value for each, (n,)."""


@stage
def triangles_at_steps(charted: ChartedSurface) -> tuple[IntArray, ...]:
    """Return the triangle that contains the centre of each chart's steps, (height, width) int32.

    For steps off the surface, up to three quarters of a step away, it is the nearest triangle; beyond, −1.
    """
    shapes = np.array([(chart.height, chart.width) for chart in charted.charts], np.int64).reshape(-1, 2)
    heights, widths = np.ascontiguousarray(shapes.T)
    ends = np.cumsum(heights * widths)
    grid = StepGrid(ends - heights * widths, heights, widths)
    count, parts = int(ends[-1]), thread_count()
    triangles, away = np.full(count, -1, np.int32), np.full(count, np.inf, np.float32)
    middles, chart = charted.places - 0.5, charted.chart.astype(np.int32)
    tasks = [partial(locate_steps, middles, chart, grid, triangles, (n, parts), away) for n in range(parts)]
    run_tasks(tasks)
    parts_of = np.split(triangles, ends[:-1])
    return tuple(part.reshape(shape) for part, shape in zip(parts_of, shapes.tolist(), strict=True))


def over_steps(
    charted: ChartedSurface,
    at: AtSteps,
    nothing: NDArray[Any],
) -> tuple[NDArray[Any], ...]:
    """Return a function's values at all steps, (height, width) for each chart.

    Parameters
    ----------
    charted
        The surface.
    at
        Called with some steps of one chart at a time, in several threads.
    nothing
        The value off the surface; its type is that of the results.
    """
    triangles = triangles_at_steps(charted)
    out = tuple(np.full(each.shape, nothing) for each in triangles)

    def band(number: int, top: int, bottom: int) -> None:
        rows = triangles[number][top:bottom]
        row, column = np.nonzero(rows >= 0)
        if len(row):
            places = np.stack([row + (top + 0.5), column + 0.5], axis=1)
            steps = Steps(charted, number, charted.charts[number], places, rows[row, column])
            out[number][top:bottom][row, column] = at(steps)

    tasks = []
    for number, each in enumerate(triangles):
        high = max(1, _BAND // each.shape[1])
        tasks += [partial(band, number, top, top + high) for top in range(0, each.shape[0], high)]
    run_tasks(tasks)
    return out
