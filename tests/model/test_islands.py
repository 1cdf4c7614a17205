"""Islands of a mesh in an atlas: by shapes that interlock, each apart from all others."""

from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from upholster.base.errors import InputError
from upholster.charts.mesh_layout import GUTTER, chart_places, mesh_charts
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.model import islands
from upholster.model.atlas import build_atlas
from upholster.model.islands import island_padding, pack_atlas, pack_islands
from upholster.model.mesh_on_charts import mesh_on_charts
from upholster.model.packing import AtlasLayout, pack_charts
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels


def of_triangles(corners: Any, island: Any) -> MeshSurface:
    """A surface of triangles in the plane, (T, 3, 2), each on its island."""
    corners = np.asarray(corners, float)
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    turned = one[:, 0] * other[:, 1] < one[:, 1] * other[:, 0]
    corners[turned] = corners[turned][:, ::-1]
    positions = np.concatenate([corners, np.zeros((*corners.shape[:2], 1))], axis=2).reshape(-1, 3)
    triangles = np.arange(len(positions), dtype=np.int32).reshape(-1, 3)
    return MeshSurface(TriangleMesh(positions, triangles), np.asarray(island, np.int32), corners)


def scattered(seed: int, count: int, size: float = 60.0) -> tuple[MeshSurface, tuple[Chart, ...]]:
    """Islands of a few triangles that lie about: concave, with holes, in pieces; a texel is a unit."""
    rng = np.random.default_rng(seed)
    pieces = rng.integers(1, 5, count)
    island = np.repeat(np.arange(count), pieces)
    sizes = size * rng.uniform(0.1, 1.0, count)[island]
    corners = rng.uniform(0, 1, (len(island), 3, 2)) * sizes[:, None, None]
    surface = of_triangles(corners, island)
    return surface, mesh_charts(surface, 1.0)


def points_on(
    surface: MeshSurface, charts: Any, layout: AtlasLayout, rng: Any, count: int
) -> tuple[Any, Any]:
    """Points on triangles in the whole atlas, corners among them: row and column (n, 2), and islands (n,)."""
    share = np.concatenate([np.eye(3), rng.dirichlet((1, 1, 1), count)])
    places = np.einsum("kc,tca->tka", share, chart_places(surface, charts)).reshape(-1, 2)
    island = np.repeat(surface.island, len(share))
    origin = np.array([(cell.row, cell.column) for cell in layout.cells])
    return places + origin[island], island


def owners(layout: AtlasLayout) -> Any:
    """The island that each texel of the whole atlas is, (H, W); -1: none. Fails where it is two."""
    pages = layout.pages
    owner = np.full((pages[-1].top + pages[-1].height, max(page.width for page in pages)), -1)
    for n, cell in enumerate(layout.cells):
        assert cell.stencil is not None
        page, side = pages[cell.page], cell.height // len(cell.stencil)
        assert cell.width == side * cell.stencil.shape[1]
        assert not any(place % side for place in (cell.top - page.top, cell.left))
        assert page.top <= cell.top <= cell.top + cell.height <= page.top + page.height
        assert 0 <= cell.left <= cell.left + cell.width <= page.width
        inside = owner[cell.top : cell.top + cell.height, cell.left : cell.left + cell.width]
        own = np.repeat(np.repeat(cell.stencil, side, axis=0), side, axis=1)
        assert (inside[own] == -1).all(), n
        inside[own] = n
    return owner


@given(
    seed=st.integers(0, 10**6),
    count=st.integers(1, 25),
    gutter=st.sampled_from([0, 1, 3, 4, 16, None]),
    pages=st.sampled_from(
        [{}, {"powers": True}, {"limit": 128}, {"size": 250}, {"limit": 70, "powers": True}]
    ),
)
def test_islands_lie_apart(seed: int, count: int, gutter: int | None, pages: Any) -> None:
    """Around each point of a triangle so many texels are its island's as are half of the gutter."""
    surface, charts = scattered(seed, count)
    layout = pack_islands(surface, charts, gutter=gutter, **pages)
    owner = owners(layout)
    points, island = points_on(surface, charts, layout, np.random.default_rng(seed), 12)
    reach = max(1, 4 if gutter is None else gutter) / 2 - 1e-6
    for down, right in product((-1, -0.4, 0.3, 1), repeat=2):
        rows, columns = np.floor(points + np.array([down, right]) * reach).astype(int).T
        assert (owner[rows, columns] == island).all()
    for number, page in enumerate(layout.pages):
        inside = layout.on_page(number)
        assert inside
        if "size" in pages:
            assert (page.height, page.width) == (250, 250)
        if "powers" in pages:
            assert all(side & (side - 1) == 0 for side in (page.height, page.width))
        if "limit" in pages and max(page.height, page.width) > pages["limit"] and "powers" not in pages:
            assert len(inside) == 1


@given(seed=st.integers(0, 10**6), gutter=st.sampled_from([1, 2, 5, 8, 16]))
def test_no_mip_level_mixes_islands(seed: int, gutter: int) -> None:
    """Down to the level of the gutter, what filtering reads on a triangle is its island's colour alone."""
    surface, charts = scattered(seed, 12)
    layout = pack_islands(surface, charts, gutter=gutter)
    texels = Texels(
        charts, tuple(np.full((c.height, c.width, 1), n, np.float32) for n, c in enumerate(charts))
    )
    image = build_atlas(texels, (), layout).pixels[:, :, 0].astype(float)
    image[owners(layout) < 0] = np.nan  # would show in all that it is mixed into
    points, island = points_on(surface, charts, layout, np.random.default_rng(seed), 30)
    for level in range(gutter.bit_length()):
        at = points / 2**level - 0.5
        first = np.floor(at).astype(int)
        share = at - first
        read = np.zeros(len(at))
        for down, right in product((0, 1), repeat=2):
            weight = np.abs(1 - down - share[:, 0]) * np.abs(1 - right - share[:, 1])
            # Textures repeat: what lies beyond a border is read at the opposite one.
            rows, columns = (first[:, 0] + down) % image.shape[0], (first[:, 1] + right) % image.shape[1]
            read += np.where(weight > 1e-9, weight * image[rows, columns], 0.0)
        np.testing.assert_allclose(read, island, atol=1e-6)
        height, width = image.shape[0] // 2, image.shape[1] // 2
        image = image[: 2 * height, : 2 * width].reshape(height, 2, width, 2).mean(axis=(1, 3))


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_texels_are_those_of_the_charts(dtype: Any) -> None:
    surface, charts = scattered(3, 15)
    rng = np.random.default_rng(5)
    arrays = tuple(rng.integers(0, 256, (c.height, c.width, 3)).astype(dtype) for c in charts)
    layout = pack_islands(surface, charts, gutter=32)  # squares reach beyond the charts, too
    atlas = build_atlas(Texels(charts, arrays), (), layout)
    assert atlas.pixels.dtype == dtype
    owner = owners(layout)
    for n, (cell, array) in enumerate(zip(atlas.cells, arrays, strict=True)):
        rows, columns = np.nonzero(owner == n)
        row, column = (
            (rows - cell.row).clip(0, len(array) - 1),
            (columns - cell.column).clip(0, array.shape[1] - 1),
        )
        np.testing.assert_array_equal(atlas.pixels[rows, columns], array[row, column])
    assert min(cell.row - cell.top for cell in atlas.cells) > 0
    mean = np.mean([array[::8, ::8].mean(axis=(0, 1)) for array in arrays], axis=0)
    mean = mean if dtype == np.float32 else np.rint(mean)
    np.testing.assert_allclose(
        atlas.pixels[owner < 0], np.broadcast_to(mean, ((owner < 0).sum(), 3)), rtol=1e-5
    )
    mesh = mesh_on_charts(surface, charts)
    places = atlas.texture_coordinates(mesh) * atlas.pixels.shape[1::-1]
    assert (owner[places[:, 1].astype(int), places[:, 0].astype(int)] == mesh.chart).all()


def test_shapes_take_less_room_than_rectangles() -> None:
    """Triangles that fill half of their rectangles interlock; a small one lies in the hole of a frame."""
    half = of_triangles([[[0, 0], [0, 200], [200, 0]], [[200, 200], [0, 200], [200, 0]]], [0, 1])
    (page,) = pack_islands(half, mesh_charts(half, 1.0), gutter=4).pages
    assert page.height * page.width < 1.3 * 200**2
    ring = np.array([[0, 0], [0, 200], [200, 200], [200, 0]], float)
    inner = 0.75 * (ring - 100) + 100
    frame = [[ring[k], ring[k - 1], inner[k]] for k in range(4)] + [
        [ring[k - 1], inner[k - 1], inner[k]] for k in range(4)
    ]
    framed = of_triangles([*frame, 0.3 * ring[:3]], [0] * 8 + [1])
    layout = pack_islands(framed, mesh_charts(framed, 1.0), gutter=4)
    assert [(page.height, page.width) for page in layout.pages] == [(204, 204)]


def test_patches_are_packed_as_rectangles() -> None:
    from upholster.charts.layout import density_layout
    from upholster.geometry.built_in.revolution import vase

    charts = density_layout(vase(), texels=30_000)
    assert pack_atlas(vase(), charts, gutter=4) == pack_charts(charts, gutter=4)
    assert pack_atlas(vase(), charts) == pack_charts(charts, gutter=16)
    assert all(cell.stencil is None for cell in pack_charts(charts).cells)


@pytest.mark.parametrize(
    ("texels", "padding"), [(100, 4), (1e6, 4), (3e6, 8), (8e6, 8), (2e7, 16), (1e9, 16)]
)
def test_the_padding_follows_the_texels(texels: float, padding: int) -> None:
    assert island_padding(texels) == padding


def test_many_texels_do_not_make_many_squares() -> None:
    """Without padding a square is a texel on small pages, and more on larger ones."""
    for side, squares in ((100.0, 1), (800.0, 2), (1500.0, 4)):
        surface = of_triangles([[[0, 0], [0, side], [side, 0]], [[side, side], [side, 0], [0, side]]], [0, 0])
        (cell,) = pack_islands(surface, mesh_charts(surface, 1.0), gutter=0).cells
        assert cell.stencil is not None
        assert cell.height // len(cell.stencil) == squares


@pytest.mark.slow(reason="builds many models")
def test_what_does_not_fit() -> None:
    surface, charts = scattered(1, 10)
    for gutter in (-1, 257):
        with pytest.raises(InputError, match=rf"gutter is {gutter}; allowed: 0 to 256"):
            pack_islands(surface, charts, gutter=gutter)
    long = of_triangles([[[0, 0], [0, 300], [20, 0]]], [0])
    (page,) = pack_islands(long, mesh_charts(long, 0.81), gutter=4, size=256).pages
    (page,) = pack_islands(long, mesh_charts(long, 1.0), gutter=4, limit=256).pages
    assert (page.height, page.width) == (24, 304)
    many = of_triangles(np.tile([[0, 0], [0, 50], [50, 0]], (1001, 1, 1)), np.arange(1001))
    with pytest.raises(InputError, match="the atlas would have 1001 pages; allowed: 1000"):
        pack_islands(many, mesh_charts(many, 1.0), size=64, gutter=8)


def test_what_lies_on_no_island_shows_a_texel_of_the_first() -> None:
    surface = of_triangles(np.tile([[0, 0], [0, 50], [50, 0]], (3, 1, 1)), [-1, 0, 1])
    charts = mesh_charts(surface, 1.0)
    mesh = mesh_on_charts(surface, charts)
    plain = mesh.triangles[0]
    assert (mesh.chart[plain] == 0).all()
    assert (mesh.places[plain] - GUTTER > 1).all()
    assert ((mesh.places[plain] - GUTTER).sum(axis=1) < 50).all()


def plainly_laid(masks: Any, order: Any, size: tuple[int, int], together: bool) -> Any:
    """What `lay_stencils` does, square by square."""
    page = np.zeros(size, bool)
    places, since = np.full((len(masks), 2), -1), dict[tuple[int, int], int]()
    for n in order:
        height, width = masks[n].shape
        free = [
            (row, column)
            for row in range(since.get((height, width), 0), size[0] - height + 1)
            for column in range(size[1] - width + 1)
            if not (page[row : row + height, column : column + width] & masks[n]).any()
        ]
        if free:
            row, column = places[n] = free[0]
            page[row : row + height, column : column + width] |= masks[n]
            since[height, width] = row
        elif together:
            break
        else:
            since[height, width] = size[0]
    return places


@given(
    seed=st.integers(0, 10**6),
    count=st.integers(1, 30),
    size=st.tuples(st.integers(1, 40), st.integers(1, 140)),
    together=st.booleans(),
)
def test_stencils_lie_in_the_first_place_that_is_free(
    seed: int, count: int, size: tuple[int, int], together: bool
) -> None:
    surface, charts = scattered(seed, count, 90.0)
    stencils = islands._stencils(surface, chart_places(surface, charts), count, 4, 1.0)
    order = np.random.default_rng(seed).permutation(count)
    found = islands._laid(stencils, order, size, together=together)
    np.testing.assert_array_equal(found, plainly_laid(stencils.masks, order, size, together))
