import math

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.charts.layout import density_layout, texture_scale, uniform_layout
from upholster.covering.measure import texel_scale
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.cyclide import torus
from upholster.geometry.built_in.plane import plane
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface

EVEN = ["cyclide", "torus", "sphere", "cone", "vase"]


def total(charts):
    return sum(chart.height * chart.width for chart in charts)


@pytest.mark.slow(reason="measures the layouts of many surfaces")
@pytest.mark.parametrize("spec", EVEN)
def test_texels_are_even(spec):
    texels = 1_000_000
    surface = surface_from_spec(spec)
    charts = density_layout(surface, texels=texels)
    # Beside the vase's poles charts would be too narrow.
    assert texel_scale(surface, charts).spread <= (2.8 if spec == "vase" else 2.1)
    assert total(charts) == pytest.approx(texels, rel=0.01)


@pytest.mark.parametrize(
    ("spec", "most"),
    [("cyclide", 64), ("torus", 8), ("sphere", 6), ("ellipsoid", 10), ("cylinder", 1), ("vase", 25)],
)
def test_charts_are_no_more_than_needed(spec, most):
    assert len(density_layout(surface_from_spec(spec), texels=4_194_304)) <= most


@pytest.mark.parametrize(
    ("coarse", "fine"),
    [("vase", "vase:spans=256"), ("plane", "plane:spans=9x9")],
)
def test_patches_do_not_matter(coarse, fine):
    few, many = (density_layout(surface_from_spec(spec), texels=10**6) for spec in (coarse, fine))
    assert abs(len(few) - len(many)) <= 0.2 * len(few)


@pytest.mark.parametrize("spec", [*EVEN, "sphere:tiling=octants", "cone:r2=0", "torus:spans=12x6"])
def test_charts_tile_every_face(spec):
    surface = surface_from_spec(spec)
    charts = density_layout(surface, texels=2_000_000)
    assert min(min(chart.height, chart.width) for chart in charts) >= 16
    assert [(c.face, c.s0, c.t0) for c in charts] == sorted((c.face, c.s0, c.t0) for c in charts)
    for n, face in enumerate(surface.faces):
        covered = np.zeros((face.rows * 32, face.columns * 32), int)
        for c in charts:
            if c.face == n:
                ends = [32 * end for end in (c.s0, c.s1, c.t0, c.t1)]
                assert ends == np.rint(ends).tolist()
                top, bottom, left, right = map(int, ends)
                covered[top:bottom, left:right] += 1
        assert (covered == 1).all()


def test_no_chart_goes_on_where_derivatives_jump():
    vase = surface_from_spec("vase")
    lines = vase.faces[0].breaks[0]
    assert len(lines) == 9
    for chart in density_layout(vase, texels=2_000_000):
        assert not any(chart.s0 < line < chart.s1 for line in lines)


def test_sizes_are_extents_times_density():
    (chart,) = density_layout(plane(2.0, 0.5), density=500)
    assert (chart.height, chart.width) == (250, 1000)
    surface = surface_from_spec("cylinder:r=1,h=2")
    for chart in density_layout(surface, density=200):
        assert (chart.height, chart.width) == (400, pytest.approx(200 * 2 * math.pi, rel=0.01))
    # A sheared patch: texels have the asked area, not the asked sides.
    skew = RationalPatch.from_points(np.array([[[0, 0, 0], [1, 0, 0]], [[1, -1, 0], [2, -1, 0]]], float))
    (chart,) = density_layout(Surface([skew]), density=300)
    assert chart.height * chart.width == pytest.approx(300**2, rel=0.01)


def test_what_is_alike_is_cut_alike():
    charts = density_layout(surface_from_spec("cyclide"), texels=1_000_000)
    # The cyclide is its own mirror image, twice.
    assert len({(c.height, c.width) for c in charts}) <= len(charts) // 3


def test_small_charts_are_avoided():
    lone = [plane().patches[0]] + [
        RationalPatch(p.net + np.array([2.0, 0, 0, 0])) for p in plane(0.02, 0.02).patches
    ]
    charts = density_layout(Surface(lone), texels=1_000_000)
    assert (charts[-1].height, charts[-1].width) == (20, 20)
    grown = density_layout(Surface(lone), texels=1_000_000, thinnest=32)
    assert (grown[-1].height, grown[-1].width) == (32, 32)


def test_charts_too_long_are_halved():
    charts = density_layout(plane(100.0, 1.0), density=400)
    assert {(c.height, c.width) for c in charts} == {(400, 2500)}
    charts = density_layout(plane(1e5, 1.0), density=1)
    assert max(c.width for c in charts) <= 4096
    with pytest.raises(InputError, match="texels long"):
        density_layout(plane(1e6, 0.01), density=64)


def test_charts_may_be_shorter_than_they_should_be_at_least():
    charts = density_layout(plane(), density=56, largest=20)
    assert max(max(c.height, c.width) for c in charts) <= 20


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
        ({"texels": 200}, "at least 256 on 1 faces"),
        ({"density": math.nan}, "density is nan"),
        ({"density": 0.0}, "density is 0"),
        ({"density": 1e6}, "GiB"),
        ({"texels": 10**6, "smallest": 0}, "smallest is 0"),
        ({"texels": 10**6, "thinnest": 33}, "thinnest is 33"),
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


@pytest.mark.slow(reason="lays quilts on every kind of surface")
def test_texture_scale_follows_the_wishes():
    square = plane(2.0, 2.0)
    sixth = pytest.approx(square.size / 6)
    for pixels in (64, 256, 1024, 4000):
        for wishes in ({}, {"density": 400}, {"texels": 80_000}, {"texels": 16_000_000}):
            assert texture_scale(square, pixels, **wishes).sample_size == sixth
    # Two texels for a pixel each way, or one; eight million at most.
    totals = [texture_scale(square, pixels).texels for pixels in (64, 512, 4000)]
    assert totals == [*(round((wide * 2 / (square.size / 6)) ** 2) for wide in (2 * 64, 512)), 2**23]
    dense = texture_scale(square, 256, density=100)
    assert (dense.density, dense.texels) == (100, 40000)
    many = texture_scale(square, 256, texels=40000)
    assert (many.density, many.texels) == (pytest.approx(100), 40000)
    sized = texture_scale(square, 256, sample_size=0.5)
    assert (sized.density, sized.scale, sized.texels) == (1024, 512, 2**22)
    fine, coarse = (texture_scale(square, 256, sample_size=size) for size in (0.05, 10))
    assert (fine.texels, fine.scale, coarse.scale) == (2**23, 5120, 25.6)
    assert coarse.texels == round((2 * 2 * 25.6) ** 2)
    both = texture_scale(square, 256, sample_size=0.5, density=100)
    assert (both.density, both.scale, both.texels) == (100, 512, 40000)
    # On a strip so thin that a sixth of its length is much more than its width, the area tells.
    assert texture_scale(plane(100.0, 0.01), 256).sample_size == pytest.approx(0.5)
    assert texture_scale(plane(spans=(64, 64)), 128).texels == texture_scale(plane(), 128).texels
    patchy = texture_scale(Surface(plane(spans=(64, 64)).patches), 256)
    assert patchy.texels == 48 * 48 * 64 * 64


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sample_size": -1.0}, "sample size is -1"),
        ({"sample_size": math.inf}, "sample size is inf"),
        (
            {"sample_size": 8.5},
            r"less than one block of 32 pixels on a model of \d+(\.\d+)? \(diagonal\).*at most 8$",
        ),
        ({"sample_size": 1e-5}, "sample size is 1e-05 .*pixels of the sample to a texel; allowed: 0.0"),
        ({"texels": 100}, "texels is 100, .* pixels of the sample to a texel; allowed: "),
        ({"density": 0.1}, "density is 0.1 .* pixels of the sample to a texel; allowed: "),
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
