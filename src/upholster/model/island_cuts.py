"""Cutting islands that are larger than a page of the atlas, and none of the charts over them.

A piece of an island shows a window of its island's chart, so texels and quilt stay as they are. Cuts run
between triangles. A triangle that is larger than a page is halved first, and its neighbours with it, so that
no gaps open.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.base.vectors import unit_vectors
from upholster.charts.mesh_layout import chart_places
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels

__all__ = ["IslandCuts", "cut_islands"]

_PART = 0.25
"""Greatest side of halved triangles, as a share of a page's: pieces of larger ones leave more room unused."""

_Window = tuple[int, slice, slice]
"""A chart's number, and rows and columns on it."""


@dataclass(frozen=True, eq=False, slots=True)
class IslandCuts:
    """A surface whose islands fit a page.

    Attributes
    ----------
    surface
        The surface: pieces of islands are its islands.
    charts
        The chart of each piece.
    windows
        For each piece its island's chart, and the rows and columns of it that are the piece's chart.
    halved
        Whether the surface has more triangles than before.
    """

    surface: MeshSurface
    charts: tuple[Chart, ...]
    windows: tuple[_Window, ...]
    halved: bool

    def texels(self, of: Texels) -> Texels:
        """Return texels of the uncut charts as texels of the pieces' charts."""
        arrays = tuple(of.arrays[chart][rows, columns] for chart, rows, columns in self.windows)
        return replace(of, charts=self.charts, arrays=arrays)


def cut_islands(surface: MeshSurface, charts: Sequence[Chart], most: float, margin: int) -> IslandCuts:
    """Cut islands into pieces of at most `most` texels each way.

    Parameters
    ----------
    surface, charts
        The islands, and the chart over each.
    most
        Greatest height and width of a piece's triangles, in texels.
    margin
        Texels around a piece's triangles that its chart shows as well, as far as the island's chart has them.
    """
    whole = _with_fitting_triangles(surface, charts, most)
    places = chart_places(whole, charts)
    low, high = places.min(axis=1), places.max(axis=1)
    laid = np.flatnonzero(whole.island >= 0)
    by_island = np.split(
        laid[np.argsort(whole.island[laid], kind="stable")],
        np.cumsum(np.bincount(whole.island[laid]))[:-1],
    )
    island = whole.island.copy()
    windows: list[_Window] = []
    for number, mine in enumerate(by_island):
        for piece in _pieces(mine, low, high, most):
            island[piece] = len(windows)
            box = low[piece].min(axis=0), high[piece].max(axis=0)
            windows.append((number, *_window(charts[number], *box, margin)))
    return IslandCuts(
        replace(whole, island=island),
        tuple(_part(charts[of], n, rows, columns) for n, (of, rows, columns) in enumerate(windows)),
        tuple(windows),
        whole is not surface,
    )


def _pieces(
    triangles: NDArray[np.intp], low: FloatArray, high: FloatArray, most: float
) -> list[NDArray[np.intp]]:
    """Split triangles, each with its box, until the box of each piece is small enough."""
    waiting, found = [triangles], []
    while waiting:
        one = waiting.pop()
        start, sides = low[one].min(axis=0), high[one].max(axis=0) - low[one].min(axis=0)
        axis = int(np.argmax(sides))
        if sides[axis] <= most:
            found.append(one)
            continue
        # Pieces are full pages as far as possible: the rests of several islands share a page.
        full = math.ceil(sides[axis] / most) // 2 * most
        first = high[one, axis] <= start[axis] + full
        waiting += [one[~first], one[first]]
    return found


def _window(chart: Chart, low: FloatArray, high: FloatArray, margin: int) -> tuple[slice, slice]:
    """Return rows and columns of a chart around a box, in texels."""
    shape = (chart.height, chart.width)
    first = np.clip(np.floor(low).astype(int) - margin, 0, np.array(shape) - 1).tolist()
    stop = np.clip(np.ceil(high).astype(int) + margin, 1, shape).tolist()
    rows, columns = (slice(a, max(a + 1, b)) for a, b in zip(first, stop, strict=True))
    return rows, columns


def _part(chart: Chart, number: int, rows: slice, columns: slice) -> Chart:
    """Return the chart of a window of a chart, on the same grid of texels."""
    by_s, by_t = (chart.s1 - chart.s0) / chart.height, (chart.t1 - chart.t0) / chart.width
    return Chart(
        number,
        rows.stop - rows.start,
        columns.stop - columns.start,
        chart.s0 + by_s * rows.start,
        chart.s0 + by_s * rows.stop,
        chart.t0 + by_t * columns.start,
        chart.t0 + by_t * columns.stop,
    )


def _with_fitting_triangles(surface: MeshSurface, charts: Sequence[Chart], most: float) -> MeshSurface:
    """Return a surface without triangles of more than this many texels each way; unchanged if it has none."""
    mesh = surface.mesh
    # At corners: places on charts, parameters, and normals and texture coordinates if there are any.
    columns = [chart_places(surface, charts), surface.parameters, mesh.normals, mesh.uv]
    values = np.concatenate([column for column in columns if column is not None], axis=2)
    triangles, positions, parent = mesh.triangles, mesh.positions, np.arange(len(mesh.triangles))
    too_large = _larger(values, most)
    while (large := too_large[parent] & _larger(values, _PART * most)).any():
        places = values[large, :, :2]
        lengths = np.linalg.norm(np.roll(places, -1, axis=1) - places, axis=2)
        ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
        longest = ends[large, np.argmax(lengths, axis=1)]
        wanted = np.unique(np.sort(longest, axis=1), axis=0)
        positions = np.concatenate([positions, positions[wanted].mean(axis=1)])
        triangles, values, parent = _halved(triangles, values, parent, wanted, len(positions))
    if len(triangles) == len(mesh.triangles):
        return surface
    order = np.argsort(parent, kind="stable")
    triangles, values, parent = triangles[order], values[order], parent[order]
    normals, uv = mesh.normals, mesh.uv
    if normals is not None:
        normals = unit_vectors(values[:, :, 4:7], least=1e-3, instead=normals[parent])
    if uv is not None:
        uv = values[:, :, -2:]
    finer = replace(
        mesh, positions=positions, triangles=triangles, part=mesh.part[parent], normals=normals, uv=uv
    )
    return MeshSurface(finer, surface.island[parent], values[:, :, 2:4])


def _larger(values: FloatArray, side: float) -> NDArray[np.bool_]:
    """Return which triangles are more than this many texels high or wide."""
    return np.asarray((np.ptp(values[:, :, :2], axis=1) > side).any(axis=1))


def _halved(
    triangles: IntArray, values: FloatArray, parent: NDArray[np.intp], edges: IntArray, count: int
) -> tuple[IntArray, FloatArray, NDArray[np.intp]]:
    """Halve all triangles at these edges (E, 2), whose midpoints are the last ones of `count` vertices.

    A triangle with several of them is halved several times.
    """
    wanted = edges.astype(np.int64) @ [count, 1]
    while True:
        ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
        keys = ends.astype(np.int64) @ [count, 1]
        at = np.isin(keys, wanted)
        cut = np.flatnonzero(at.any(axis=1))
        if not len(cut):
            return triangles, values, parent
        a = np.argmax(at[cut], axis=1)
        b = (a + 1) % 3
        middles = count - len(wanted) + np.searchsorted(wanted, keys[cut, a])
        between = 0.5 * (values[cut, a] + values[cut, b])
        other, other_values, new = triangles[cut], values[cut], np.arange(len(cut))
        triangles, values = triangles.copy(), values.copy()
        triangles[cut, b], values[cut, b] = middles, between
        other[new, a], other_values[new, a] = middles, between
        triangles = np.concatenate([triangles, other])
        values = np.concatenate([values, other_values])
        parent = np.concatenate([parent, parent[cut]])
