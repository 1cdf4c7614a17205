import math
from collections import defaultdict
from itertools import pairwise

import numpy as np
import pytest

from upholster.charts import uniform_layout
from upholster.charts.halving import MOST_HALVINGS, Halving
from upholster.charts.layout import density_layout, texture_scale
from upholster.errors import InputError
from upholster.geometry import RationalPatch, Surface, plane, surface_from_spec, torus
from upholster.measure import texel_scale

EVEN = ["cyclide", "torus", "sphere", "cone", "vase"]


def total(charts):
    return sum(chart.height * chart.width for chart in charts)


@pytest.mark.parametrize("texels", [1_000_000, 4_194_304])
@pytest.mark.parametrize("spec", EVEN)
def test_texels_are_even(spec, texels):
    surface = surface_from_spec(spec)
    charts = density_layout(surface, texels=texels)
    assert texel_scale(surface, charts).spread <= 2.1
    assert total(charts) == pytest.approx(texels, rel=0.01)
    assert len(charts) <= 4 * len(surface.patches)


@pytest.mark.parametrize("spec", [*EVEN, "sphere:tiling=octants", "cone:r2=0"])
def test_charts_tile_every_patch(spec):
    surface = surface_from_spec(spec)
    rectangles = defaultdict(list)
    charts = density_layout(surface, texels=2_000_000)
    for chart in charts:
        rectangles[chart.patch].append((chart.s0, chart.s1, chart.t0, chart.t1))
        assert min(chart.height, chart.width) >= 16
    assert [chart.patch for chart in charts] == sorted(chart.patch for chart in charts)
    assert set(rectangles) == set(range(len(surface.patches)))
    for mine in rectangles.values():
        assert len(mine) <= 2**MOST_HALVINGS
        rows, columns = sorted({r[:2] for r in mine}), sorted({r[2:] for r in mine})
        assert mine == [(*r, *c) for r in rows for c in columns]
        for spans in (rows, columns):
            assert (spans[0][0], spans[-1][1]) == (0, 1)
            assert all(a[1] == b[0] for a, b in pairwise(spans))


def test_sizes_are_extents_times_density():
    (chart,) = density_layout(plane(2.0, 0.5), density=512)
    assert (chart.height, chart.width) == (256, 1024)
    surface = surface_from_spec("cylinder:r=1,h=2")
    for chart in density_layout(surface, density=200):
        assert (chart.height, chart.width) == (400, pytest.approx(200 * math.pi / 2, rel=0.01))
    # A sheared patch: texels have the asked area, not the asked sides.
    skew = RationalPatch.from_points(np.array([[[0, 0, 0], [1, 0, 0]], [[1, -1, 0], [2, -1, 0]]], float))
    (chart,) = density_layout(Surface([skew]), density=300)
    assert chart.height * chart.width == pytest.approx(300**2, rel=0.01)


def test_neighbours_are_cut_alike_where_they_are_alike():
    surface = surface_from_spec("cone")
    charts = density_layout(surface, texels=1_000_000)
    assert len({(c.height, c.width, c.s0, c.s1) for c in charts}) == len(charts) // 4


def test_a_cut_goes_on_across_opposed_edges():
    surface = surface_from_spec("sphere")
    halving = Halving(surface)
    n = halving.samples
    fellows = halving.fellows((0, 0, 0, n))
    assert len(fellows) == len({patch for patch, *_ in fellows}) == 4
    halving.cut(fellows)
    quarter = halving.fellows((0, 0, 0, n // 2))
    assert len(quarter) == 4
    # What is cut on both sides of a shared edge is one line in space.
    ends = set()
    for patch, axis, first, last in quarter:
        middle = (first + last) / 2 / n
        for end in (0.0, 1.0):
            s, t = (middle, end) if axis == 0 else (end, middle)
            ends.add(tuple(np.round(surface.patches[patch].points(s, t), 9) + 0.0))
    assert len(ends) == 4


def test_a_cut_is_mirrored_where_edges_run_against_each_other():
    left, right = plane(spans=(1, 2)).patches
    halving = Halving(Surface([left, right.reverse(0).reverse(1)]))
    n = halving.samples
    halving.cut(halving.fellows((0, 0, 0, n)))
    assert halving.cuts == [([0, n // 2], [0])] * 2
    assert halving.fellows((0, 0, 0, n // 2)) == {(0, 0, 0, n // 2), (1, 0, n // 2, n)}
    assert halving.fellows((0, 1, 0, n)) == {(0, 1, 0, n)}


def test_small_patches_keep_their_size_and_small_charts_are_avoided():
    surface = surface_from_spec("cyclide:spans=28x28")
    charts = density_layout(surface, texels=4_194_304)
    assert len(charts) == 784
    assert 16 <= min(min(c.height, c.width) for c in charts) < 48
    grown = density_layout(surface, texels=4_194_304, thinnest=48)
    assert min(min(c.height, c.width) for c in grown) == 48
    assert total(grown) == pytest.approx(4_194_304, rel=0.01)


def test_charts_too_long_are_halved():
    charts = density_layout(plane(100.0, 1.0), density=400)
    assert [(c.height, c.width) for c in charts] == [(400, 10000)] * 4
    with pytest.raises(InputError, match="texels long"):
        density_layout(plane(1e5, 1.0), density=64)


def test_same_result_whatever_the_unit():
    small, large = (density_layout(torus(2 * k, 0.7 * k), texels=10**6) for k in (1, 1000))
    assert small == large


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "exactly one"),
        ({"texels": 10**6, "density": 5.0}, "exactly one"),
        ({"texels": 63}, "texels is 63"),
        ({"texels": 2**31 + 1}, "allowed: 64 to"),
        ({"texels": 2000}, "at least 4,096 on 16 patches"),
        ({"density": math.nan}, "density is nan"),
        ({"density": 0.0}, "density is 0"),
        ({"density": 1e6}, "GiB"),
        ({"texels": 10**6, "smallest": 0}, "smallest is 0"),
        ({"texels": 10**6, "thinnest": 49}, "thinnest is 49"),
    ],
)
def test_wrong_layouts_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        density_layout(torus(), **options)


def test_a_surface_without_area_is_refused():
    line = RationalPatch.from_points(np.array([[[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0]]], float))
    for made in (lambda s: density_layout(s, texels=10**6), lambda s: texture_scale(s, 128)):
        with pytest.raises(InputError, match="no area"):
            made(Surface([line]))


def test_uniform_layout_stays():
    assert {(c.height, c.width) for c in uniform_layout(torus(), chart=64)} == {(64, 64)}
    with pytest.raises(InputError, match="allowed: 8 to 16384"):
        uniform_layout(torus(), chart=4)


def test_texture_scale_follows_the_wishes():
    square = plane(2.0, 2.0)
    free = texture_scale(square, 256)
    assert (free.density, free.scale, free.sample_size, free.texels) == (1024, 1024, 0.25, 4_194_304)
    dense = texture_scale(square, 256, density=100)
    assert (dense.scale, dense.sample_size, dense.texels) == (100, 2.56, 40000)
    many = texture_scale(square, 256, texels=40000)
    assert (many.density, many.scale, many.texels) == (pytest.approx(100), many.density, 40000)
    sized = texture_scale(square, 256, sample_size=0.5)
    assert (sized.density, sized.scale, sized.texels) == (512, 512, 2**20)
    fine, coarse = (texture_scale(square, 256, sample_size=size) for size in (0.01, 10))
    assert (fine.texels, fine.scale, coarse.texels, coarse.scale) == (2**26, 25600, 2**18, 25.6)
    both = texture_scale(square, 256, sample_size=0.5, density=100)
    assert (both.density, both.scale, both.texels) == (100, 512, 40000)
    patchy = texture_scale(plane(spans=(64, 64)), 256)
    assert patchy.texels == 48 * 48 * 64 * 64


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sample_size": -1.0}, "sample size is -1"),
        ({"sample_size": math.inf}, "sample size is inf"),
        ({"sample_size": 8.5}, "less than one block of 32 pixels.*at most 8$"),
        ({"sample_size": 1e-5}, "pixels to a texel"),
        ({"density": 100.0, "texels": 10**6}, "both given"),
        ({"density": math.nan}, "density is nan"),
        ({"density": 1e6}, "GiB"),
        ({"texels": 3}, "texels is 3"),
    ],
)
def test_wrong_scales_are_refused(options, message):
    with pytest.raises(InputError, match=message) as caught:
        texture_scale(plane(), 256, **options)
    assert "\n" not in str(caught.value)
