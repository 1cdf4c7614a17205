"""Pages of an atlas: every chart lies on one of them, whole, apart from the others, and is found there."""

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from patch_charts import patch_charts

from upholster.base.errors import InputError
from upholster.charts.chart_seams import find_seams
from upholster.charts.tessellation.mesh import tessellate
from upholster.geometry.built_in.cyclide import ring_cyclide, torus
from upholster.model.atlas import Atlas, build_atlas
from upholster.model.normal_atlas import build_normal_atlas
from upholster.model.packing import pack_charts
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels

SIZES = st.lists(st.tuples(st.integers(1, 90), st.integers(1, 90)), min_size=1, max_size=40)


@given(
    sizes=SIZES, gutter=st.integers(0, 20), limit=st.sampled_from([64, 128, 130, 300]), exact=st.booleans()
)
def test_every_chart_lies_on_one_page_apart_from_others(
    sizes: Any, gutter: int, limit: int, exact: bool
) -> None:
    charts = [Chart(n, *size) for n, size in enumerate(sizes)]
    step = 1 << max(0, gutter.bit_length() - 1)
    largest = max(-(-(max(size) + 2 * gutter) // step) * step for size in sizes)
    if exact and largest > limit:
        with pytest.raises(InputError, match=f"atlas_size is {limit}, which holds charts of"):
            pack_charts(charts, gutter=gutter, size=limit)
        return
    layout = pack_charts(charts, gutter=gutter, **{"size" if exact else "limit": limit})
    taken = np.zeros((sum(page.height for page in layout.pages), 600), int)
    for cell, chart in zip(layout.cells, charts, strict=True):
        page = layout.pages[cell.page]
        assert cell.chart is chart
        assert page.top <= cell.top <= cell.top + cell.height <= page.top + page.height
        assert 0 <= cell.left <= cell.left + cell.width <= page.width
        assert min(cell.row - cell.top, cell.column - cell.left) == gutter
        assert cell.row + chart.height + gutter <= cell.top + cell.height
        assert cell.column + chart.width + gutter <= cell.left + cell.width
        # Down to this level texels of a mip map lie in one cell: also beside a page's upper left corner.
        assert not any(n % step for n in (cell.top - page.top, cell.left, cell.height, cell.width))
        taken[cell.top : cell.top + cell.height, cell.left : cell.left + cell.width] += 1
    assert taken.max() == 1
    assert [page.top for page in layout.pages] == np.cumsum([0, *(p.height for p in layout.pages)])[
        :-1
    ].tolist()
    for number, page in enumerate(layout.pages):
        inside = [cell for cell in layout.cells if cell.page == number]
        assert inside
        if exact:
            assert (page.height, page.width) == (limit, limit)
        elif max(page.height, page.width) > limit:
            assert len(inside) == 1  # a chart above the limit has a page of its own


def test_pages_are_used_well() -> None:
    """Many charts of all sizes: all pages but the last are four fifths full."""
    rng = np.random.default_rng(3)
    charts = [Chart(n, *size) for n, size in enumerate(rng.integers(20, 120, (300, 2)).tolist())]
    layout = pack_charts(charts, gutter=4, limit=512)
    assert len(layout.pages) > 4
    for number in range(len(layout.pages) - 1):
        area = sum(cell.height * cell.width for cell in layout.cells if cell.page == number)
        assert area > 0.8 * 512**2


@pytest.mark.parametrize("count", [1, 3, 40])
def test_sides_may_be_powers_of_two(count: int) -> None:
    rng = np.random.default_rng(count)
    charts = [Chart(0, *map(int, rng.integers(8, 300, 2))) for _ in range(count)]
    (page,) = pack_charts(charts, gutter=4, powers=True).pages
    (plain,) = pack_charts(charts, gutter=4).pages
    for side in (page.height, page.width):
        assert side & (side - 1) == 0
    assert page.height * page.width <= 4 * plain.height * plain.width
    pages = pack_charts(charts, gutter=4, powers=True, limit=512).pages
    assert all(side & (side - 1) == 0 for page in pages for side in (page.height, page.width))


def test_what_fits_lies_on_one_page() -> None:
    charts = [Chart(n, 100, 100) for n in range(16)]
    assert pack_charts(charts, limit=576).pages == pack_charts(charts).pages
    assert len(pack_charts(charts).pages) == 1
    assert len(pack_charts(charts, limit=575).pages) == 2
    large = pack_charts([*charts, Chart(16, 9008, 16)])
    assert [(page.height, page.width) for page in large.pages] == [(9040, 48), (144, 16 * 144)]


def split(limit: int) -> tuple[Any, Texels, Atlas, Atlas]:
    """A ring's atlas of several pages, and on one page."""
    surface = ring_cyclide()
    rng = np.random.default_rng(4)
    charts = patch_charts(surface, rng.integers(20, 70, (16, 2)).tolist())
    texels = Texels(charts, tuple(rng.integers(0, 256, (c.height, c.width, 3), np.uint8) for c in charts))
    seams = find_seams(surface, charts)
    atlas = build_atlas(texels, seams, pack_charts(charts, limit=limit))
    return surface, texels, atlas, build_atlas(texels, seams)


def test_texels_and_gutters_are_those_of_one_page() -> None:
    surface, texels, atlas, whole = split(256)
    assert len(atlas.pages) > 2
    seams = find_seams(surface, texels.charts)
    assert len(whole.pages) == 1
    assert np.shares_memory(whole.images()[0], whole.pixels)
    turned = [
        build_normal_atlas(surface, texels, seams, pack_charts(texels.charts, limit=limit))
        for limit in (256, None)
    ]
    for one, other in ((atlas, whole), turned):
        images = one.images()
        for cell, same, array in zip(one.cells, other.cells, texels.arrays, strict=True):
            top = cell.top - one.pages[cell.page].top
            found = images[cell.page][top : top + cell.height, cell.left : cell.left + cell.width]
            expected = other.pixels[same.top : same.top + same.height, same.left : same.left + same.width]
            np.testing.assert_array_equal(found, expected)
            np.testing.assert_array_equal(found[16 : 16 + array.shape[0], 16 : 16 + array.shape[1]], array)
    for number, page in enumerate(atlas.pages):
        mine = [array for array, cell in zip(texels.arrays, atlas.cells, strict=True) if cell.page == number]
        mean = np.rint(np.mean([array[::8, ::8].mean(axis=(0, 1)) for array in mine], axis=0))
        free = np.ones(atlas.pixels.shape[:2], bool)
        free[: page.top] = free[page.top + page.height :] = False
        for cell in atlas.cells:
            free[cell.top : cell.top + cell.height, cell.left : cell.left + cell.width] = False
        assert free.any()
        assert (atlas.pixels[free] == mean).all()


def test_vertices_find_their_texels() -> None:
    surface, texels, atlas, _ = split(256)
    mesh = tessellate(surface, texels.charts, quads=400)
    page, uv = atlas.page_coordinates(mesh)
    assert uv.min() > 0
    assert uv.max() < 1
    polygons = mesh.all_triangles()
    assert (page[polygons] == page[polygons[:, :1]]).all()
    images = atlas.images()
    for vertex in range(0, len(uv), 7):
        row, column = np.minimum(
            mesh.places[vertex], np.array(texels.arrays[mesh.chart[vertex]].shape[:2]) - 0.5
        )
        expected = texels.arrays[mesh.chart[vertex]][int(row), int(column)]
        image = images[page[vertex]]
        inside = uv[vertex] * image.shape[1::-1] - np.array(
            [mesh.places[vertex, 1] - column, mesh.places[vertex, 0] - row]
        )
        x, y = np.floor(inside + 1e-9).astype(int)
        np.testing.assert_array_equal(image[y, x], expected)


@pytest.mark.parametrize("gutter", [0, 3, 40])
def test_any_padding(gutter: int) -> None:
    surface = torus()
    charts = patch_charts(surface, [(30, 20)] * 16)
    rng = np.random.default_rng(5)
    texels = Texels(charts, tuple(rng.integers(0, 256, (30, 20, 3), np.uint8) for _ in charts))
    seams = find_seams(surface, charts)
    for atlas in (
        build_atlas(texels, seams, pack_charts(charts, gutter=gutter)),
        build_normal_atlas(surface, texels, seams, pack_charts(charts, gutter=gutter, size=256)),
    ):
        for cell, array in zip(atlas.cells, texels.arrays, strict=True):
            found = atlas.pixels[cell.row : cell.row + 30, cell.column : cell.column + 20]
            np.testing.assert_array_equal(found, array)


def test_what_would_fit_does() -> None:
    """The number of texels that the message names fits, and is not far below what fits."""
    charts = [Chart(0, 400, 1000), Chart(1, 300, 300)]
    with pytest.raises(InputError) as refused:
        pack_charts(charts, size=512)
    said = re.search(
        r"holds charts of 480 .*1000 x 400 texels; .* at most ([\d,]+) texels in all", str(refused.value)
    )
    assert said is not None
    share = (int(said[1].replace(",", "")) / 490_000) ** 0.5
    pack_charts([Chart(0, round(400 * share), round(1000 * share))], size=512)
    assert 1000 * share > 430


def test_there_are_not_too_many_pages() -> None:
    with pytest.raises(InputError, match="the atlas would have 1001 pages; allowed: 1000"):
        pack_charts([Chart(n, 40, 40) for n in range(1001)], size=64, gutter=8)
