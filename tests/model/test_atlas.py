from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from patch_charts import patch_charts

from upholster.base.errors import InputError
from upholster.charts.chart_seams import find_seams
from upholster.charts.layout import density_layout
from upholster.charts.tessellation.mesh import face_parameters, tessellate
from upholster.geometry.built_in.cyclide import ring_cyclide, torus
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.revolution import cylinder, vase
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface
from upholster.model.atlas import Atlas, build_atlas, build_page, by_chart, page_windows
from upholster.model.packing import pack_charts
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels
from upholster.runtime.parallel import running


def painted(surface: Surface, charts: Sequence[Chart]) -> Texels:
    """Charts that show a smooth function of the place in space, float32."""
    arrays = []
    for chart in charts:
        s, t = face_parameters(chart, np.arange(chart.height) + 0.5, np.arange(chart.width) + 0.5)
        place = surface.faces[chart.face].points_grid(s, t) / surface.size * 4
        arrays.append((np.sin(place) + np.cos(1.3 * place[:, :, ::-1])).astype(np.float32))
    return Texels(tuple(charts), tuple(arrays))


def packed(surface: Surface, texels: Texels, **options: Any) -> Atlas:
    layout = pack_charts(texels.charts, **options)
    return build_atlas(texels, find_seams(surface, texels.charts), layout)


def noisy(surface: Surface, height: int, width: int, channels: int = 3) -> Texels:
    rng = np.random.default_rng(4)
    charts = patch_charts(surface, [(height, width)] * len(surface.patches))
    shape = (height, width, channels)
    return Texels(charts, tuple(rng.integers(0, 256, shape, dtype=np.uint8) for _ in charts))


def turned(surface: Surface) -> Surface:
    """The same surface with its patches' parameters turned about, so that edges of all numbers meet."""
    rng = np.random.default_rng(8)
    patches: list[RationalPatch] = []
    for patch in surface.patches:
        for axis in (0, 1):
            patch = patch.reverse(axis) if rng.integers(2) else patch
        patches.append(patch.transpose() if rng.integers(2) else patch)
    return Surface(patches)


def split(surface: Surface, *which: int) -> Surface:
    """The same surface with some patches cut in two: T-junctions."""
    patches: list[RationalPatch] = []
    for index, patch in enumerate(surface.patches):
        patches += patch.split(s=0.5) if index in which else [patch]
    return Surface(patches)


CLOSED = {
    "cyclide": ring_cyclide(),
    "cyclide turned": turned(ring_cyclide()),
    "sphere of six": sphere(),
    "sphere of six turned": turned(sphere()),
    "octants": sphere(tiling="octants"),
    "octants turned": turned(sphere(tiling="octants")),
    "torus": torus(),
    "cut cyclide": split(ring_cyclide(), 0, 5, 6),
    "cut and turned": turned(split(ring_cyclide(), 3, 9)),
}


def steps(image: Any, *, axis: int) -> Any:
    return np.abs(np.diff(image, axis=axis)).max(initial=0)


@pytest.mark.parametrize("name", CLOSED)
def test_gutters_continue_the_picture(name: str) -> None:
    """A smooth picture of space stays smooth across every edge: no step is much larger than inside charts."""
    surface = CLOSED[name]
    texels = painted(surface, patch_charts(surface, [(64, 64)] * len(surface.patches)))
    inside = max(steps(array, axis=axis) for array in texels.arrays for axis in (0, 1))
    atlas = packed(surface, texels, gutter=4)
    for n, cell in enumerate(atlas.cells):
        rows, columns = slice(cell.row, cell.row + 64), slice(cell.column, cell.column + 64)
        np.testing.assert_array_equal(atlas.pixels[rows, columns], texels.arrays[n])
        # With four texels beyond each edge, corners left out; a degenerate edge repeats: no steps there.
        tall = atlas.pixels[cell.row - 4 : cell.row + 68, columns]
        wide = atlas.pixels[rows, cell.column - 4 : cell.column + 68]
        assert max(steps(tall, axis=0), steps(tall, axis=1)) <= 2.1 * inside, n
        assert max(steps(wide, axis=0), steps(wide, axis=1)) <= 2.1 * inside, n


@pytest.mark.parametrize("name", ["cyclide turned", "cyclide", "sphere of six", "octants"])
def test_gutters_continue_between_charts_of_different_size(name: str) -> None:
    surface = CLOSED[name]
    if name == "cyclide turned":
        rng = np.random.default_rng(2)
        charts = patch_charts(surface, rng.integers(40, 90, (16, 2)).tolist())
    else:
        charts = density_layout(surface, texels=60_000)
    texels = painted(surface, charts)
    inside = max(steps(array, axis=axis) for array in texels.arrays for axis in (0, 1))
    for cell in (atlas := packed(surface, texels, gutter=8)).cells:
        chart = cell.chart
        band = atlas.pixels[
            cell.row - 2 : cell.row + chart.height + 2, cell.column : cell.column + chart.width
        ]
        assert steps(band, axis=0) <= 2.1 * inside
        band = atlas.pixels[
            cell.row : cell.row + chart.height, cell.column - 2 : cell.column + chart.width + 2
        ]
        assert steps(band, axis=1) <= 2.1 * inside


def bilinear(pixels: Any, uv: Any) -> Any:
    """Texture look-up as a graphics card does it at level 0."""
    height, width = pixels.shape[:2]
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    c, r = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - c)[:, None], (y - r)[:, None]
    p = pixels.astype(float)
    top = p[r, c] * (1 - fx) + p[r, c + 1] * fx
    return top * (1 - fy) + (p[r + 1, c] * (1 - fx) + p[r + 1, c + 1] * fx) * fy


@pytest.mark.parametrize(
    "name", ["cyclide", "cyclide turned", "sphere of six turned", "octants turned", "torus"]
)
def test_both_sides_of_an_edge_look_the_same(name: str) -> None:
    """Vertices at one place, on different patches, get the same colour, though the texels are noise."""
    surface = CLOSED[name]
    atlas = packed(surface, noisy(surface, 32, 32))
    charts = [cell.chart for cell in atlas.cells]
    mesh = tessellate(surface, charts, quads=300 * len(charts))
    colors = bilinear(atlas.pixels, atlas.texture_coordinates(mesh))
    rim = ((mesh.places == 0) | (mesh.places == 32)).sum(axis=1) == 1  # on an edge, in no corner
    for patch, edge in surface.degenerate:  # at a pole everything meets; charts are patches
        end = mesh.places[:, edge % 2] == (0 if edge in (0, 3) else 32)
        rim &= ~((mesh.chart == patch) & end)
    _, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    order = np.argsort(place.ravel(), kind="stable")
    order = order[rim[order]]
    same = place.ravel()[order][1:] == place.ravel()[order][:-1]
    one, other = order[1:][same], order[:-1][same]
    crossing = mesh.chart[one] != mesh.chart[other]
    assert crossing.sum() > 60
    np.testing.assert_allclose(colors[one[crossing]], colors[other[crossing]], atol=1e-6)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("surface", [plane(), cylinder(), vase()], ids=lambda surface: surface.name)
def test_borders_repeat_the_edge(surface: Surface, dtype: Any) -> None:
    texels = noisy(surface, 20, 28)
    texels = Texels(texels.charts, tuple(array.astype(dtype) for array in texels.arrays))
    atlas = packed(surface, texels, gutter=4)
    assert atlas.pixels.dtype == dtype
    checked = 0
    for n, (cell, array) in enumerate(zip(atlas.cells, texels.arrays, strict=True)):
        bottom, right = cell.row + 20, cell.column + 28
        beyond = {
            0: (atlas.pixels[cell.top : cell.row, cell.column : right], array[:1]),
            1: (atlas.pixels[cell.row : bottom, right : cell.left + cell.width], array[:, -1:]),
            2: (atlas.pixels[bottom : cell.top + cell.height, cell.column : right], array[-1:]),
            3: (atlas.pixels[cell.row : bottom, cell.left : cell.column], array[:, :1]),
        }
        for edge, (gutter, expected) in beyond.items():
            if not surface.neighbours(n, edge):
                np.testing.assert_array_equal(gutter, np.broadcast_to(expected, gutter.shape))
                checked += 1
    assert checked


def test_corners_blend_what_meets_there() -> None:
    surface = ring_cyclide()
    texels = noisy(surface, 32, 32, 1)
    for cell in (atlas := packed(surface, texels, gutter=8)).cells:
        for row in (cell.row - 1, cell.row + 32):
            for column in (cell.column - 1, cell.column + 32):
                beside = atlas.pixels[row, column + (1 if column < cell.column else -1), 0]
                below = atlas.pixels[row + (1 if row < cell.row else -1), column, 0]
                mean = (int(beside) + int(below)) / 2
                assert abs(int(atlas.pixels[row, column, 0]) - mean) <= 0.5


@pytest.mark.parametrize("threads", [1, 2])
def test_one_color_everywhere(threads: int) -> None:
    """No gutter, corner or unused texel brings in anything else."""
    surface = split(ring_cyclide(), 1)
    rng = np.random.default_rng(1)
    charts = patch_charts(surface, rng.integers(8, 70, (17, 2)).tolist())
    color = np.array([10, 200, 77, 255], np.uint8)
    arrays = tuple(np.broadcast_to(color, (chart.height, chart.width, 4)) for chart in charts)
    with running(threads):
        atlas = packed(surface, Texels(charts, arrays))
    assert (atlas.pixels == color).all()
    assert not atlas.pixels.flags.writeable


@given(
    sizes=st.lists(st.tuples(st.integers(1, 130), st.integers(1, 130)), min_size=1, max_size=12),
    gutter=st.sampled_from([1, 4, 16]),
)
def test_cells_do_not_overlap_and_lie_on_the_mip_grid(sizes: Any, gutter: int) -> None:
    patch = plane().patches[0]
    apart = [type(patch)(patch.net + 3.0 * np.array([k, 0, 0, 0])) for k in range(len(sizes))]
    charts = tuple(Chart(k, *size) for k, size in enumerate(sizes))
    atlas = packed(
        Surface(apart),
        Texels(charts, tuple(np.zeros((*size, 1), np.uint8) for size in sizes)),
        gutter=gutter,
    )
    taken = np.zeros(atlas.pixels.shape[:2], int)
    for cell, size in zip(atlas.cells, sizes, strict=True):
        assert [
            n % gutter for n in (cell.top, cell.left, cell.height, cell.width, cell.row, cell.column)
        ] == [0] * 6
        assert (cell.chart.height, cell.chart.width) == size
        assert cell.row - cell.top >= gutter <= cell.column - cell.left
        assert cell.top + cell.height - cell.row - size[0] >= gutter
        assert cell.left + cell.width - cell.column - size[1] >= gutter
        taken[cell.top : cell.top + cell.height, cell.left : cell.left + cell.width] += 1
    assert taken.max() == 1
    # Near-square: no longer than what a square of twice the area, or the largest cell, needs.
    largest = max(max(cell.height, cell.width) for cell in atlas.cells)
    assert max(taken.shape) <= (2 * taken.sum()) ** 0.5 + largest


def test_sixteen_charts_make_a_square() -> None:
    atlas = packed(ring_cyclide(), noisy(ring_cyclide(), 64, 64))
    assert atlas.pixels.shape == (4 * 96, 4 * 96, 3)


def test_texture_coordinates() -> None:
    surface = torus()
    rng = np.random.default_rng(7)
    charts = patch_charts(surface, rng.integers(20, 60, (16, 2)).tolist())[::-1]
    atlas = packed(surface, Texels(charts, tuple(np.zeros((c.height, c.width, 3), np.uint8) for c in charts)))
    mesh = tessellate(surface, charts, quads=16 * 25)
    uv = atlas.texture_coordinates(mesh)
    assert uv.shape == (len(mesh.positions), 2)
    height, width = atlas.pixels.shape[:2]
    for n, cell in enumerate(atlas.cells):
        mine = mesh.chart == n
        np.testing.assert_allclose(uv[mine, 0] * width, cell.column + mesh.places[mine, 1])
        np.testing.assert_allclose(uv[mine, 1] * height, cell.row + mesh.places[mine, 0])


def test_what_does_not_fit() -> None:
    surface = plane()
    texels = noisy(surface, 32, 32)
    for gutter in (-16, -1, 257, 512):
        with pytest.raises(InputError, match=rf"gutter is {gutter}; allowed: 0 to 256"):
            packed(surface, texels, gutter=gutter)
    with pytest.raises(InputError, match="there are no charts"):
        build_atlas(Texels((), ()), ())
    with pytest.raises(InputError, match="mesh has chart 5; the atlas has 0 to 0"):
        packed(surface, texels).texture_coordinates(tessellate(sphere(), quads=16))


def test_a_page_by_itself_is_that_of_the_atlas() -> None:
    surface = turned(ring_cyclide(6, 2, 3))
    charts = density_layout(surface, texels=60_000)
    texels = painted(surface, charts)
    size = 128
    atlas = packed(surface, texels, gutter=6, size=size)
    seams, layout = by_chart(find_seams(surface, charts)), pack_charts(charts, gutter=6, size=size)
    assert len(atlas.pages) > 4
    for number, image in enumerate(atlas.images()):
        # Of charts elsewhere only what the gutters show is known: the rest is not a number.
        arrays = {n: texels.arrays[n] for n in layout.on_page(number)}
        for n, windows in page_windows(layout, number, seams).items():
            arrays[n] = np.full_like(texels.arrays[n], np.nan)
            for window in windows:
                arrays[n][window] = texels.arrays[n][window]
        np.testing.assert_array_equal(build_page(layout, number, seams, arrays), image)
