"""Placing each chart in the atlas: charts with gutters, in rows, on one page or several."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.charts.tessellation.mesh import Mesh
from upholster.model.island_cuts import IslandCuts
from upholster.quilt.chart import Chart

__all__ = [
    "GUTTER",
    "MAX_GUTTER",
    "MAX_PAGES",
    "PAGE_LIMIT",
    "AtlasCell",
    "AtlasLayout",
    "AtlasPage",
    "check_charts_fit",
    "check_page_count",
    "gutter_depths",
    "pack_charts",
    "power_of_two",
]

PAGE_LIMIT = 8192
"""Most texels of a page each way: any graphics card and any image format accepts this."""

MAX_PAGES = 1000
MAX_GUTTER = 256

_SURE = 0.98
"""Factor of the sides that a message calls allowed, because places of charts are rounded."""

GUTTER = 16
"""Default gutter in texels around a chart of patches."""

_Size = tuple[int, int]


@dataclass(frozen=True, slots=True)
class AtlasCell:
    """A chart's place in the atlas, in texels.

    Attributes
    ----------
    chart
        The chart.
    row, column
        The place of its first texel; the gutters are outside.
    top, left, height, width
        The cell, gutters included.
    page
        The number of the cell's page. Rows count from the top of the first page.
    stencil
        For an island of a mesh: which squares of the cell are its own, (rows, columns); others may belong to
        other islands. The stencil begins at the cell's first square, which need not contain the chart's first
        texel. None: the complete cell belongs to the chart.
    """

    chart: Chart
    row: int
    column: int
    top: int
    left: int
    height: int
    width: int
    page: int
    stencil: NDArray[np.bool_] | None = None


@dataclass(frozen=True, slots=True)
class AtlasPage:
    """A part of the atlas that is a separate texture: `height` rows from row `top` on, `width` columns."""

    top: int
    height: int
    width: int


@dataclass(frozen=True, slots=True)
class AtlasLayout:
    """Cells of all charts, in the charts' order, and their pages, stacked vertically.

    If islands of a mesh were larger than a page, `cuts` has their pieces, and the cells are those of the
    pieces' charts.
    """

    cells: tuple[AtlasCell, ...]
    pages: tuple[AtlasPage, ...]
    cuts: IslandCuts | None = None

    def on_page(self, number: int) -> dict[int, AtlasCell]:
        """Return the cells of a page by their charts' numbers."""
        return {n: cell for n, cell in enumerate(self.cells) if cell.page == number}

    def page_coordinates(self, mesh: Mesh) -> tuple[IntArray, FloatArray]:
        """Return the page of every vertex of `mesh`, (V,) int32, and (u, v) on it, (V, 2) in 0…1.

        All vertices of a polygon are on one page, because they belong to one chart.

        Raises
        ------
        InputError
            If a chart of the mesh is not in the atlas.
        """
        rows_columns = self.rows_columns(mesh)
        page = np.array([cell.page for cell in self.cells], np.int32)[mesh.chart]
        first = np.array([(page.top, 0) for page in self.pages])[page]
        shape = np.array([(page.height, page.width) for page in self.pages])[page]
        return page, np.ascontiguousarray(((rows_columns - first) / shape)[:, ::-1])

    def rows_columns(self, mesh: Mesh) -> FloatArray:
        """Return row and column of every vertex of `mesh` in the complete atlas, (V, 2); errors as above."""
        if (last := int(mesh.chart.max(initial=0))) >= len(self.cells):
            raise InputError(f"mesh has chart {last}; the atlas has 0 to {len(self.cells) - 1}")
        origin = np.array([(cell.row, cell.column) for cell in self.cells], np.float64)
        return np.asarray(origin[mesh.chart] + mesh.places)


def gutter_depths(cell: AtlasCell) -> tuple[int, int, int, int]:
    """Return the depths of a cell's gutters beyond each edge of its chart, in texels."""
    row, column = cell.row - cell.top, cell.column - cell.left
    return row, cell.width - column - cell.chart.width, cell.height - row - cell.chart.height, column


def pack_charts(
    charts: Sequence[Chart],
    *,
    gutter: int | None = None,
    size: int | None = None,
    limit: int | None = None,
    powers: bool = False,
) -> AtlasLayout:
    """Arrange charts and their gutters in rows, tallest first, on as few pages as possible.

    Parameters
    ----------
    charts
        The charts; they are neither rotated nor rescaled.
    gutter
        Least number of texels between a chart and the border of its cell: 0 to 256, by default 16. Sizes and
        positions of cells are multiples of the largest power of two in it.
    size
        Height and width of every page; by default pages are as large as their contents.
    limit
        Without `size`: the most texels of a page each way; by default 8192. If everything fits on one page,
        there is one, about as wide as high. A larger chart has a page of its own, as large as it needs.
    powers
        Without `size`: whether sides of pages are powers of two.

    Raises
    ------
    InputError
        If `gutter` is out of range, there are no charts, a chart is larger than `size`, or there would be
        more than 1000 pages.
    """
    gutter = GUTTER if gutter is None else gutter
    check_charts_fit(charts, gutter)
    step = 1 << max(0, gutter.bit_length() - 1)

    def padded(side: int) -> int:
        return -(-(side + 2 * gutter) // step) * step

    sizes = [(padded(chart.height), padded(chart.width)) for chart in charts]
    order = sorted(range(len(sizes)), key=lambda index: (-sizes[index][0], -sizes[index][1], index))
    tallest_first = [sizes[index] for index in order]
    if size is None:
        limit = PAGE_LIMIT if limit is None else limit
        rounded = power_of_two if powers else int
        places, shapes = _on_one_page(tallest_first, rounded)
        if max(shapes[0]) > limit:
            places, shapes = _on_pages(tallest_first, limit)
        shapes = [(rounded(height), rounded(width)) for height, width in shapes]
    else:
        texels = sum(chart.height * chart.width for chart in charts)
        _check_fit(charts, size, max(map(max, sizes)), texels=texels, padding=2 * gutter, step=step)
        places, shapes = _on_pages(tallest_first, size)
        shapes = [(size, size)] * len(shapes)
    check_page_count(len(shapes))
    tops = list(accumulate((height for height, _ in shapes), initial=0))
    cells: dict[int, AtlasCell] = {}
    for index, (page, top, left) in zip(order, places, strict=True):
        top += tops[page]
        row, column = top + gutter, left + gutter
        cells[index] = AtlasCell(charts[index], row, column, top, left, *sizes[index], page)
    return AtlasLayout(
        tuple(cells[index] for index in range(len(charts))),
        tuple(AtlasPage(top, *shape) for top, shape in zip(tops, shapes, strict=False)),
    )


def check_charts_fit(charts: Sequence[Chart], gutter: int) -> None:
    """Raise InputError if there are no charts, or the gutter is out of range."""
    if not 0 <= gutter <= MAX_GUTTER:
        raise InputError(f"gutter is {gutter}; allowed: 0 to {MAX_GUTTER}")
    if not charts:
        raise InputError("there are no charts; allowed: at least one")


def check_page_count(count: int) -> None:
    """Raise InputError if there are too many pages."""
    if count > MAX_PAGES:
        raise InputError(
            f"the atlas would have {count} pages; allowed: {MAX_PAGES}: larger pages, or fewer texels"
        )


def _check_fit(
    charts: Sequence[Chart], size: int, largest: int, *, texels: int, padding: int, step: int
) -> None:
    """Raise InputError if the largest cell exceeds a page; name a number of texels with which it fits.

    Parameters
    ----------
    charts
        The charts in the cells.
    size, largest
        Sides of a page and of the largest cell, in texels.
    texels
        The number of texels that the user asked for, or that the surface has.
    padding, step
        Texels of a cell's side that are no chart's, and the number of which a side is a multiple: these stay
        as they are with fewer texels.
    """
    if largest <= size:
        return
    chart = max(charts, key=lambda chart: max(chart.height, chart.width))
    # Less two texels, because places on charts are rounded; and less the margin.
    share = max(0.0, _SURE * (size - padding - step - 2) / (largest - padding))
    fitting, factor = _rounded_down(texels * share**2), _rounded_down(100 * share) / 100
    raise InputError(
        f"atlas_size is {size}, which holds charts of {size - padding} with the padding, and one has "
        f"{chart.width} x {chart.height} texels; allowed: a larger atlas_size, or at most {fitting:,} texels "
        f"in all (now {texels:,}), or a density {factor:g} times the present one"
    )


def _rounded_down(number: float) -> int:
    """Round a number down to its first two digits."""
    digits = str(int(number))
    return int(digits[:2].ljust(len(digits), "0"))


def power_of_two(side: int) -> int:
    """Return the smallest power of two that is at least `side`."""
    return 1 << (side - 1).bit_length()


def _on_one_page(
    sizes: Sequence[_Size], rounded: Callable[[int], int]
) -> tuple[list[tuple[int, int, int]], list[_Size]]:
    """Return (page, top, left) of each rectangle on one page, and that page's size before rounding."""
    widest = max(width for _, width in sizes)
    ideal = sum(height * width for height, width in sizes) ** 0.5
    # Multiples of the widest cell suit charts of one size, the other widths suit many sizes.
    limits = {max(widest, int(ideal * factor)) for factor in (1, 1.1, 1.25)}
    limits |= {widest * max(1, round(ideal / widest) + more) for more in (-1, 0, 1)}
    limits |= {max(widest, rounded(limit)) for limit in limits}
    tries = [_shelves(sizes, limit) for limit in sorted(limits)]

    def cost(found: tuple[list[tuple[int, int]], int, int]) -> tuple[int, int, int]:
        height, width = rounded(found[1]), rounded(found[2])
        return max(height, width), height * width, found[1] * found[2]

    places, height, width = min(tries, key=cost)
    return [(0, top, left) for top, left in places], [(height, width)]


def _shelves(sizes: Sequence[_Size], limit: int) -> tuple[list[tuple[int, int]], int, int]:
    """Place rectangles in rows no wider than `limit`; return their corners and the height and width used."""
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


def _on_pages(sizes: Sequence[_Size], limit: int) -> tuple[list[tuple[int, int, int]], list[_Size]]:
    """Return (page, top, left) of rectangles, tallest first, and the size used on each page.

    Each goes into the first row that has room, or else a new row on the first page that has room (hybrid
    first fit: F. R. K. Chung, M. R. Garey, D. S. Johnson: On packing two-dimensional bins, 1982).
    """
    places: list[tuple[int, int, int]] = []
    rows: list[list[int]] = []  # page, top, first free column
    used: list[_Size] = []
    open_pages: list[int] = []
    for height, width in sizes:
        if max(height, width) > limit:
            places.append((len(used), 0, 0))
            used.append((height, width))
            continue
        row = next((row for row in rows if row[2] + width <= limit), None)
        if row is None:
            page = next((page for page in open_pages if used[page][0] + height <= limit), len(used))
            if page == len(used):
                used.append((0, 0))
                open_pages.append(page)
            row = [page, used[page][0], 0]
            rows.append(row)
            used[page] = (used[page][0] + height, used[page][1])
        page, top, left = row
        places.append((page, top, left))
        row[2] += width
        used[page] = (used[page][0], max(used[page][1], row[2]))
    return places, used
