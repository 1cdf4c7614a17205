"""The atlas: all charts' texels in one image, with gutters that hide where a chart ends.

One cell per chart: the chart and a gutter round it, filled with what lies across the edge, so that bilinear
filtering at an edge sees the same colours from both sides. Sizes and positions of cells are multiples of the
gutter, a power of two: down to mip level log2(gutter) no texel mixes two cells.
"""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from upholster.charts.seams import ChartSeam
from upholster.errors import InputError
from upholster.model.gutter import fill_gutters
from upholster.model.mesh import Mesh
from upholster.parallel import run_tasks
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels
from upholster.types import FloatArray, PixelArray, frozen_array

__all__ = ["Atlas", "AtlasCell", "build_atlas", "by_chart"]


@dataclass(frozen=True, slots=True)
class AtlasCell:
    """Where a chart lies in the atlas, in texels.

    Attributes
    ----------
    chart
        The chart.
    row, column
        Of its first texel: the gutters lie outside.
    top, left, height, width
        The cell, gutters included.
    """

    chart: Chart
    row: int
    column: int
    top: int
    left: int
    height: int
    width: int


@dataclass(frozen=True, slots=True, eq=False)
class Atlas:
    """All charts' texels in one image.

    Attributes
    ----------
    pixels
        (H, W, C) of the exemplar's dtype, read-only.
    cells
        One per chart, in the charts' order.
    gutter
        Least number of texels between a chart and its cell's border.
    """

    pixels: PixelArray
    cells: tuple[AtlasCell, ...]
    gutter: int

    def texture_coordinates(self, mesh: Mesh) -> FloatArray:
        """Return (u, v) of every vertex of `mesh`, (V, 2) in 0…1: u to the right, v downward.

        Raises
        ------
        InputError
            If a chart of the mesh is not here.
        """
        if (last := int(mesh.chart.max(initial=0))) >= len(self.cells):
            raise InputError(f"mesh has chart {last}; the atlas has 0 to {len(self.cells) - 1}")
        origin = np.array([(cell.row, cell.column) for cell in self.cells], np.float64)
        rows_columns = origin[mesh.chart] + mesh.places
        return np.ascontiguousarray((rows_columns / self.pixels.shape[:2])[:, ::-1])


def build_atlas(
    texels: Texels, seams: Sequence[ChartSeam], *, gutter: int = 16, threads: int | None = None
) -> Atlas:
    """Pack all charts in one image, and fill their gutters from the neighbours across the edges.

    Parameters
    ----------
    texels
        The charts' texels.
    seams
        How the charts meet, from either side: see `upholster.charts.seams.find_seams`.
    gutter
        Texels between a chart and the border of its cell: 1, 2, 4 … 256.
    threads
        By default one per core; used for large charts.

    Returns
    -------
    Atlas
        Cells in rows, tallest first, about as wide as high; unused area has the charts' mean colour.

    Raises
    ------
    InputError
        If `gutter` is no such power of two, or there are no charts.
    """
    if gutter not in (1, 2, 4, 8, 16, 32, 64, 128, 256):
        raise InputError(f"gutter is {gutter}; allowed: a power of two from 1 to 256")
    charts = texels.charts
    if not charts:
        raise InputError("there are no charts; allowed: at least one")
    cells, height, width = _pack(charts, gutter)
    first = texels.arrays[0]
    pixels = np.empty((height, width, first.shape[2]), first.dtype)
    _fill_unused(pixels, cells, _mean_color(texels.arrays, first.dtype))
    of_chart = by_chart(seams)

    def lay(index: int) -> None:
        cell = cells[index]
        inside = pixels[cell.top : cell.top + cell.height, cell.left : cell.left + cell.width]
        fill_gutters(
            inside, cell.row - cell.top, cell.column - cell.left, index, of_chart[index], texels.arrays
        )

    tasks: list[Callable[[], object]] = [partial(lay, index) for index in range(len(cells))]
    # Small charts are laid by Python more than by memory: threads would wait for each other.
    large = texels.count >= len(charts) << 20
    run_tasks(tasks, threads=threads if large else 1)
    return Atlas(frozen_array(pixels), cells, gutter)


def by_chart(seams: Sequence[ChartSeam]) -> dict[int, list[ChartSeam]]:
    """Return the seams of each chart that has any; none for others."""
    found: dict[int, list[ChartSeam]] = defaultdict(list)
    for seam in seams:
        found[seam.chart].append(seam)
    return found


def _pack(charts: Sequence[Chart], gutter: int) -> tuple[tuple[AtlasCell, ...], int, int]:
    """Arrange the cells in rows, tallest first; return them with the height and width of the whole."""

    def padded(size: int) -> int:
        return -(-(size + 2 * gutter) // gutter) * gutter

    sizes = [(padded(chart.height), padded(chart.width)) for chart in charts]
    order = sorted(range(len(sizes)), key=lambda index: (-sizes[index][0], -sizes[index][1], index))
    widest = max(width for _, width in sizes)
    ideal = sum(height * width for height, width in sizes) ** 0.5
    # Whole multiples of the widest cell suit charts of one size, the others those of many.
    limits = {max(widest, int(ideal * factor)) for factor in (1, 1.1, 1.25)}
    limits |= {widest * max(1, round(ideal / widest) + more) for more in (-1, 0, 1)}
    tries = [_shelves([sizes[index] for index in order], limit) for limit in sorted(limits)]
    places, height, width = min(tries, key=lambda found: (max(found[1:]), found[1] * found[2]))
    cells: dict[int, AtlasCell] = {}
    for index, (top, left) in zip(order, places, strict=True):
        cells[index] = AtlasCell(charts[index], top + gutter, left + gutter, top, left, *sizes[index])
    return tuple(cells[index] for index in range(len(charts))), height, width


def _shelves(sizes: Sequence[tuple[int, int]], limit: int) -> tuple[list[tuple[int, int]], int, int]:
    """Lay rectangles in rows no wider than `limit`; return their corners and the height and width used."""
    places = []
    top = left = shelf = used = 0
    for height, width in sizes:
        if left and left + width > limit:
            top, left, shelf = top + shelf, 0, 0
        places.append((top, left))
        left += width
        shelf = max(shelf, height)
        used = max(used, left)
    return places, top + shelf, used


def _mean_color(arrays: Sequence[PixelArray], dtype: np.dtype[np.generic]) -> NDArray[np.generic]:
    """Return the mean of every eighth texel each way: near enough for what nobody sees."""
    means = [array[::8, ::8].mean(axis=(0, 1), dtype=np.float64) for array in arrays]
    mean = np.mean(means, axis=0)
    return np.asarray(mean if dtype.kind == "f" else np.rint(mean)).astype(dtype)


def _fill_unused(pixels: PixelArray, cells: Sequence[AtlasCell], color: NDArray[np.generic]) -> None:
    """Paint what no cell covers: the right ends of the rows, and below cells lower than their row."""
    rows = sorted({cell.top for cell in cells})
    for top, bottom in pairwise([*rows, pixels.shape[0]]):
        shelf = [cell for cell in cells if cell.top == top]
        end = max(cell.left + cell.width for cell in shelf)
        pixels[top:bottom, end:] = color
        for cell in shelf:
            pixels[top + cell.height : bottom, cell.left : cell.left + cell.width] = color
