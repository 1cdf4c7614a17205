"""Placing each island of a mesh in the atlas: by shape, not by rectangle, packed on one page or several.

An island's *stencil* covers all texels that its triangles read, in squares of texels on one grid over the
page. Stencils may interlock, and may be in each other's holes; each square belongs to a single island. Sides
of squares are powers of two. Down to the mip level whose texels are as large as a square, filtering anywhere
on a triangle reads only the island's own squares.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, islice, product

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, frozen_array
from upholster.charts.mesh_layout import chart_places
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.model._packing_kernels import lay_stencils, mark_squares
from upholster.model.island_cuts import cut_islands
from upholster.model.packing import (
    MAX_PAGES,
    PAGE_LIMIT,
    AtlasCell,
    AtlasLayout,
    AtlasPage,
    check_charts_fit,
    check_page_count,
    pack_charts,
    power_of_two,
)
from upholster.quilt.chart import Chart

__all__ = ["island_padding", "pack_atlas", "pack_islands"]

_LEAST_PADDING, _MOST_PADDING, _PADDINGS = 4, 16, 400
"""Default texels between islands: least, greatest, and about how many of these distances a square atlas is
wide."""

_SQUARES = 512
"""Approximate greatest number of squares of a page each way: more take longer to pack than they save."""

_WIDTHS = (1.1, 1.2, 1.3, 1.0, 1.45, 1.6, 1.8, 0.9, 0.8)
"""Widths of a page to try, as multiples of the side of a square with the stencils' area."""

_TRIES, _LEAST_TRIES = 3000, 3
"""Approximate number of stencils placed in the search for the smallest page; and least number of pages
tried."""

_LEAST_PIECE = 32
"""Least number of texels, each way, to which pieces of an island are limited."""

_Place = tuple[int, int]
_Page = tuple[dict[int, _Place], _Place]
"""Row and column of stencils on a page, and its rows and columns, in squares."""


def pack_atlas(
    surface: AnySurface,
    charts: Sequence[Chart],
    *,
    gutter: int | None = None,
    size: int | None = None,
    limit: int | None = None,
    powers: bool = False,
) -> AtlasLayout:
    """Arrange charts in an atlas: islands of a mesh by `pack_islands`, all others by `pack_charts`.

    Parameters and errors are as for these; so is the default gutter.
    """
    if isinstance(surface, MeshSurface):
        return pack_islands(surface, charts, gutter=gutter, size=size, limit=limit, powers=powers)
    return pack_charts(charts, gutter=gutter, size=size, limit=limit, powers=powers)


def pack_islands(
    surface: MeshSurface,
    charts: Sequence[Chart],
    *,
    gutter: int | None = None,
    size: int | None = None,
    limit: int | None = None,
    powers: bool = False,
) -> AtlasLayout:
    """Arrange islands by their shapes on pages as few and as small as possible.

    With `size`, islands that are larger than a page are cut, see `upholster.model.island_cuts`.

    Parameters
    ----------
    surface, charts
        The islands, and the chart over each; they are neither rotated nor rescaled.
    gutter
        Least number of texels between triangles of two islands: 0 to 256; half as many to a page's border. By
        default see `island_padding`. Squares' sides are multiples of the largest power of two in it.
    size, limit, powers
        The sizes of pages: see `upholster.model.packing.pack_charts`.

    Raises
    ------
    InputError
        As for `pack_charts`, but a chart may be larger than `size`.
    """
    places = chart_places(surface, charts)
    texels = _area(places)
    gutter = island_padding(texels) if gutter is None else gutter
    check_charts_fit(charts, gutter)
    most = size or limit or PAGE_LIMIT
    side = 1 << max(0, gutter.bit_length() - 1)
    while min(math.sqrt(texels), most) > _SQUARES * side:
        side *= 2
    reach = max(gutter, 1) / 2
    stencils, cuts = _stencils(surface, places, len(charts), side, reach), None
    if size is not None and side * int(stencils.sizes.max()) > size:
        # A stencil begins at a whole texel, at most one before its reach.
        fitting = size // side * side - 2 * reach - 1
        if fitting < _LEAST_PIECE:
            raise InputError(
                f"padding is {gutter} on pages of {size} x {size} texels, so pieces of islands would have "
                f"less than {_LEAST_PIECE} texels each way; allowed: less padding, or larger pages"
            )
        cuts = cut_islands(surface, charts, fitting, side + math.ceil(reach))
        surface, charts = cuts.surface, cuts.charts
        stencils = _stencils(surface, chart_places(surface, charts), len(charts), side, reach)
    rounded = power_of_two if powers and size is None else int
    pages = _on_pages(stencils, most, rounded)
    check_page_count(len(pages))
    shapes = [(rounded(rows * side), rounded(columns * side)) for _, (rows, columns) in pages]
    layout = _layout(charts, stencils, pages, shapes if size is None else [(size, size)] * len(pages))
    return replace(layout, cuts=cuts)


def island_padding(texels: float) -> int:
    """Return the default number of texels between two islands, 4, 8 or 16, for this many texels on the mesh.

    With it, the coarsest mip level that mixes no two islands shows the complete page in about 500 x 500
    texels.
    """
    padding = power_of_two(math.ceil(math.sqrt(texels) / _PADDINGS))
    return min(max(padding, _LEAST_PADDING), _MOST_PADDING)


@dataclass(frozen=True, eq=False, slots=True)
class _Stencils:
    """For each island: its squares, and the place on the chart, in texels, where the first of them begins.

    `sizes` (n, 2) are their rows and columns; `runs` and `spans` are inputs of `lay_stencils`.
    """

    side: int
    masks: list[NDArray[np.bool_]]
    corners: NDArray[np.int64]
    sizes: NDArray[np.int64]
    runs: NDArray[np.int64]
    spans: NDArray[np.int64]


def _area(places: FloatArray) -> float:
    """Return the number of texels that triangles cover."""
    (a, b), (c, d) = (places[:, 1:] - places[:, :1]).transpose(1, 2, 0)
    return float(np.abs(a * d - b * c).sum() / 2)


def _stencils(surface: MeshSurface, places: FloatArray, islands: int, side: int, reach: float) -> _Stencils:
    """Return the stencils: all squares within `reach` texels of a triangle."""
    laid = surface.island >= 0
    low, high = np.full((islands, 2), np.inf), np.full((islands, 2), -np.inf)
    np.minimum.at(low, surface.island[laid], places[laid].min(axis=1))
    np.maximum.at(high, surface.island[laid], places[laid].max(axis=1))
    corners = np.floor(low - reach).astype(np.int64)
    sizes = np.ceil((high + reach - corners) / side).astype(np.int64)
    firsts = np.cumsum([0, *sizes.prod(axis=1).tolist()])
    marked = np.zeros(firsts[-1], np.bool_)
    grids = np.concatenate([corners, sizes, firsts[:-1, None]], axis=1)
    mark_squares(places, surface.island, grids, float(side), reach, marked)
    runs, island = _runs(marked, firsts, sizes)
    ends = np.searchsorted(island, np.arange(islands + 1))
    # Removes rows and columns at a stencil's end that no triangle touches.
    filled = np.maximum.reduceat(runs[:, :2] + [1, 0] + runs[:, [2]] * [0, 1], ends[:-1])
    longest = runs[np.lexsort((-runs[:, 2], island))[ends[:-1]]][:, [0, 2]]
    kind = np.unique(filled, axis=0, return_inverse=True)[1].reshape(-1, 1)
    spans = np.concatenate([filled[:, :1], ends[:-1, None], ends[1:, None], longest, kind], axis=1)
    frozen_array(marked)
    masks = [
        marked[first : first + math.prod(shape)].reshape(shape)[:rows, :columns]
        for first, shape, (rows, columns) in zip(
            firsts.tolist(), sizes.tolist(), filled.tolist(), strict=False
        )
    ]
    return _Stencils(side, masks, corners, filled, runs, spans)


def _runs(
    marked: NDArray[np.bool_], firsts: NDArray[np.int64], sizes: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return runs of squares, (R, 4) as for `lay_stencils`, and the island of each, in their order."""
    columns = np.repeat(sizes[:, 1], sizes[:, 0])
    outer = np.zeros(len(marked) + 1, np.bool_)  # where rows begin, and where the last one ends
    outer[np.cumsum([0, *columns])] = True
    start = np.flatnonzero(marked & (outer[:-1] | ~np.roll(marked, 1)))
    stop = np.flatnonzero(marked & (outer[1:] | ~np.roll(marked, -1))) + 1
    island = np.searchsorted(firsts, start, side="right") - 1
    row, column = np.divmod(start - firsts[island], sizes[island, 1])
    length = stop - start
    return np.stack([row, column, length, np.frexp(length)[1] - 1], axis=1).astype(np.int64), island


def _on_pages(stencils: _Stencils, most: int, rounded: Callable[[int], int]) -> list[_Page]:
    """Place stencils on pages of at most this many texels each way; a larger one has a page of its own."""
    squares = most // stencils.side
    large = (stencils.sizes > squares).any(axis=1)
    pages: list[_Page] = [
        ({int(n): (0, 0)}, (int(stencils.sizes[n, 0]), int(stencils.sizes[n, 1])))
        for n in np.flatnonzero(large)
    ]
    left = np.flatnonzero(~large)
    while len(left) and len(pages) <= MAX_PAGES:
        page = _on_one_page(stencils, left, squares, rounded)
        if page is None:
            places = _laid(stencils, _orders(stencils, left)[0], (squares, squares), together=False)
            page = _page(stencils, left[places[left, 0] >= 0], places)
        pages.append(page)
        left = left[~np.isin(left, list(page[0]))]
    return pages


def _on_one_page(
    stencils: _Stencils, which: NDArray[np.int64], squares: int, rounded: Callable[[int], int]
) -> _Page | None:
    """Return the smallest page found that holds stencils; None if they do not fit `squares` each way."""
    area = sum(int(stencils.masks[n].sum()) for n in which)
    ideal, widest = math.sqrt(area), int(stencils.sizes[which, 1].max())
    best, smallest = None, rounded(squares * stencils.side) ** 2 + 1
    if area > squares**2:
        return None
    tries = product(_WIDTHS, _orders(stencils, which))
    for factor, order in islice(tries, max(_LEAST_TRIES, _TRIES // len(which))):
        width = rounded(max(widest, int(ideal * factor)) * stencils.side) // stencils.side
        width = min(width, squares)
        # A page that cannot be smaller than the best one is abandoned as soon as possible.
        rows = min(squares, (smallest - 1) // (rounded(width * stencils.side) * stencils.side))
        places = _laid(stencils, order, (rows, width), together=True)
        if (places[which, 0] < 0).any():
            continue
        page = _page(stencils, which, places)
        texels = math.prod(rounded(count * stencils.side) for count in page[1])
        if texels < smallest:
            best, smallest = page, texels
    return best


def _orders(stencils: _Stencils, which: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return orders in which to place stencils: highest, longest or largest first."""
    height, width = stencils.sizes[which].T
    keys = ((-width, -height), (-np.minimum(height, width), -np.maximum(height, width)), (-height * width,))
    return [which[np.lexsort((which, *key))] for key in keys]


def _laid(
    stencils: _Stencils, order: NDArray[np.int64], size: _Place, *, together: bool
) -> NDArray[np.int64]:
    """Return row and column of each stencil on a page of this many squares; -1 if it is not on the page."""
    rows, columns = size
    levels = int(stencils.runs[:, 3].max()) + 1
    taken = np.zeros((levels, rows, -(-columns // 64)), np.uint64)
    for level in range(levels):
        # Squares beyond the page are occupied: at this level from 2^level - 1 columns before its end on.
        start = max(0, columns - (1 << level) + 1)
        taken[level, :, start // 64 :] = ~np.uint64(0)
        taken[level, :, start // 64 : start // 64 + 1] <<= np.uint64(start % 64)
    count, room = len(stencils.masks), np.full(rows, columns, np.int64)
    since, places = np.zeros(count, np.int64), np.full((count, 2), -1, np.int64)
    lay_stencils(order, stencils.runs, stencils.spans, together, taken, room, since, places)
    return places


def _page(stencils: _Stencils, which: NDArray[np.int64], places: NDArray[np.int64]) -> _Page:
    """Return a page that is as large as its stencils require."""
    rows, columns = (places[which] + stencils.sizes[which]).max(axis=0).tolist()
    return {int(n): (int(places[n, 0]), int(places[n, 1])) for n in which}, (rows, columns)


def _layout(
    charts: Sequence[Chart], stencils: _Stencils, pages: Sequence[_Page], shapes: Sequence[tuple[int, int]]
) -> AtlasLayout:
    """Return the cells of stencils on pages of these heights and widths in texels."""
    side = stencils.side
    tops = list(accumulate((height for height, _ in shapes), initial=0))
    cells: dict[int, AtlasCell] = {}
    for number, (places, _) in enumerate(pages):
        for n, (row, column) in places.items():
            top, left = tops[number] + row * side, column * side
            (first, before), mask = stencils.corners[n].tolist(), stencils.masks[n]
            height, width = mask.shape[0] * side, mask.shape[1] * side
            cells[n] = AtlasCell(
                charts[n], top - first, left - before, top, left, height, width, number, mask
            )
    return AtlasLayout(
        tuple(cells[n] for n in range(len(charts))),
        tuple(AtlasPage(top, *shape) for top, shape in zip(tops, shapes, strict=False)),
    )
