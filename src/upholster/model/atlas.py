"""The atlas: all charts' texels in one image, with gutters that hide the ends of charts.

On patches there is one cell per chart: the chart and a gutter around it. The gutter is filled from the
neighbour across the edge, so that bilinear filtering at an edge sees the same colours from both sides. Sizes
and positions of cells are multiples of the largest power of two in the gutter. So down to mip level
log2(gutter), rounded down, no texel mixes two cells. On meshes the same is true of each island's own squares
(`upholster.model.islands`). They are cut from its chart, which extends beyond the island and continues the
texture there.

If the texels are too many for one texture, there are several pages. In the image they are stacked vertically.
"""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, PixelArray, frozen_array
from upholster.charts.chart_seams import ChartSeam
from upholster.charts.tessellation.mesh import Mesh
from upholster.model.gutter import fill_gutters, shown_beyond
from upholster.model.packing import AtlasCell, AtlasLayout, AtlasPage, gutter_depths, pack_charts
from upholster.quilt.model import Texels
from upholster.runtime.parallel import run_tasks

__all__ = ["Atlas", "build_atlas", "build_page", "by_chart", "page_windows"]


@dataclass(frozen=True, slots=True, eq=False)
class Atlas:
    """All charts' texels in one image.

    Attributes
    ----------
    pixels
        (H, W, C) of the exemplar's dtype, read-only: all pages, stacked vertically.
    cells
        One cell per chart, in the charts' order.
    pages
        The parts of `pixels` that are separate textures.
    """

    pixels: PixelArray
    cells: tuple[AtlasCell, ...]
    pages: tuple[AtlasPage, ...]

    def images(self) -> tuple[PixelArray, ...]:
        """Return the image of each page, (height, width, C)."""
        return tuple(
            np.ascontiguousarray(self.pixels[page.top : page.top + page.height, : page.width])
            for page in self.pages
        )

    def texture_coordinates(self, mesh: Mesh) -> FloatArray:
        """Return (u, v) of every vertex of `mesh` in `pixels`, (V, 2) in 0…1: u to the right, v downward.

        Raises
        ------
        InputError
            If a chart of the mesh is not in the atlas.
        """
        return np.ascontiguousarray((self._layout.rows_columns(mesh) / self.pixels.shape[:2])[:, ::-1])

    def page_coordinates(self, mesh: Mesh) -> tuple[IntArray, FloatArray]:
        """Return the page of every vertex of `mesh`, (V,) int32, and (u, v) on it, (V, 2) in 0…1.

        All vertices of a polygon are on one page, because they belong to one chart.

        Raises
        ------
        InputError
            As for `texture_coordinates`.
        """
        return self._layout.page_coordinates(mesh)

    @property
    def _layout(self) -> AtlasLayout:
        return AtlasLayout(self.cells, self.pages)


def build_atlas(
    texels: Texels,
    seams: Sequence[ChartSeam],
    layout: AtlasLayout | None = None,
) -> Atlas:
    """Place all charts in one image, and fill their gutters from the neighbours across the edges.

    Parameters
    ----------
    texels
        The charts' texels.
    seams
        Where the charts meet, from both sides: see `upholster.charts.chart_seams.find_seams`.
    layout
        The charts' places, by default those of `upholster.model.packing.pack_charts`.

    Returns
    -------
    Atlas
        Parts of a page that no chart covers have the mean colour of its charts.

    Raises
    ------
    InputError
        As for `pack_charts`.
    """
    layout = pack_charts(texels.charts) if layout is None else layout
    cells, pages = layout.cells, layout.pages
    first = texels.arrays[0]
    height, width = pages[-1].top + pages[-1].height, max(page.width for page in pages)
    pixels = np.empty((height, width, first.shape[2]), first.dtype)
    of_chart = by_chart(seams)
    tasks: list[Callable[[], object]] = []
    for number, page in enumerate(pages):
        own = pixels[page.top : page.top + page.height]
        mine = layout.on_page(number)
        _fill(own, _mean_color([texels.arrays[n] for n in mine]))
        tasks += [partial(_lay, own, page.top, mine[n], n, of_chart[n], texels.arrays) for n in mine]
    # Placing small charts is limited by Python, not by memory: threads would wait for each other.
    large = texels.count >= len(cells) << 20
    run_tasks(tasks, threads=None if large else 1)
    return Atlas(frozen_array(pixels), cells, pages)


def build_page(
    layout: AtlasLayout,
    number: int,
    seams: Mapping[int, Sequence[ChartSeam]],
    arrays: Mapping[int, PixelArray],
) -> PixelArray:
    """Return the image of one page, (height, width, C), as `build_atlas` makes it.

    Parameters
    ----------
    layout, number
        All pages, and the number of this one.
    seams
        Each chart's, see `by_chart`.
    arrays
        Texels of the charts on the page, and of other charts the windows of `page_windows`.
    """
    page, cells = layout.pages[number], layout.on_page(number)
    first = arrays[next(iter(cells))]
    pixels = np.empty((page.height, page.width, first.shape[2]), first.dtype)
    _fill(pixels, _mean_color([arrays[n] for n in cells]))
    for n, cell in cells.items():
        _lay(pixels, page.top, cell, n, seams.get(n, ()), arrays)
    return pixels


def page_windows(
    layout: AtlasLayout, number: int, seams: Mapping[int, Sequence[ChartSeam]]
) -> dict[int, list[tuple[slice, slice]]]:
    """Return the texels on other pages that a page's gutters show: rows and columns, by chart."""
    cells, found = layout.on_page(number), defaultdict[int, list[tuple[slice, slice]]](list)
    for n, cell in cells.items():
        depths = gutter_depths(cell)
        for seam in seams.get(n, ()):
            if seam.other_chart not in cells:
                other = layout.cells[seam.other_chart].chart
                found[seam.other_chart].append(shown_beyond(seam, depths[seam.edge], other))
    return found


def _lay(
    pixels: PixelArray,
    top: int,
    cell: AtlasCell,
    n: int,
    seams: Sequence[ChartSeam],
    arrays: Sequence[PixelArray] | Mapping[int, PixelArray],
) -> None:
    """Write a chart and its gutters into its page; the page's first row is row `top` of the atlas."""
    inside = pixels[cell.top - top : cell.top - top + cell.height, cell.left : cell.left + cell.width]
    if cell.stencil is None:
        fill_gutters(inside, cell.row - cell.top, cell.column - cell.left, n, seams, arrays)
    else:
        _lay_island(inside, cell, cell.stencil, arrays[n])


def _lay_island(inside: PixelArray, cell: AtlasCell, stencil: NDArray[np.bool_], texels: PixelArray) -> None:
    """Write an island's own squares into its cell; beyond its chart the outermost texel is repeated."""
    above, before = cell.row - cell.top, cell.column - cell.left
    below = cell.height - above - texels.shape[0]
    after = cell.width - before - texels.shape[1]
    beyond = [(max(above, 0), max(below, 0)), (max(before, 0), max(after, 0)), (0, 0)]
    shown = np.pad(texels, beyond, mode="edge")[max(-above, 0) :, max(-before, 0) :]
    side = cell.height // len(stencil)
    own = np.repeat(np.repeat(stencil, side, axis=0), side, axis=1)
    # Copying a texel as one item, not channel by channel, is twenty times as fast.
    texel = f"V{texels.shape[2] * texels.itemsize}"
    to, of = inside.view(texel)[:, :, 0], shown[: cell.height, : cell.width].view(texel)[:, :, 0]
    np.copyto(to, of, where=own)


def _fill(pixels: PixelArray, color: NDArray[np.generic]) -> None:
    """Fill a page, row by row: NumPy would write a single colour three numbers at a time."""
    pixels[:1] = color
    pixels[1:] = pixels[:1]


def by_chart(seams: Sequence[ChartSeam]) -> dict[int, list[ChartSeam]]:
    """Return the seams of each chart that has any."""
    found: dict[int, list[ChartSeam]] = defaultdict(list)
    for seam in seams:
        found[seam.chart].append(seam)
    return found


def _mean_color(arrays: Sequence[PixelArray]) -> NDArray[np.generic]:
    """Return the mean of every eighth texel each way: accurate enough for invisible texels."""
    dtype = arrays[0].dtype
    means = [array[::8, ::8].mean(axis=(0, 1), dtype=np.float64) for array in arrays]
    mean = np.mean(means, axis=0)
    return np.asarray(mean if dtype.kind == "f" else np.rint(mean)).astype(dtype)
