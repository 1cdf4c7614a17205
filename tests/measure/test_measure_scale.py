"""Texel sizes against what can be written down."""

import math

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.charts.layout import uniform_layout
from upholster.covering.measure import texel_scale
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.cyclide import torus
from upholster.geometry.built_in.plane import plane
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart


def test_a_square_plane_is_even():
    found = texel_scale(plane(), [Chart(0, 64, 64)])
    assert found.spread == pytest.approx(1)
    assert found.error == pytest.approx(0, abs=1e-9)
    assert found.error_95 == pytest.approx(0, abs=1e-9)
    assert found.anisotropy == pytest.approx(1)
    assert found.anisotropy_95 == pytest.approx(1)


def test_long_texels_are_long():
    found = texel_scale(plane(), [Chart(0, 64, 16)])
    assert found.spread == pytest.approx(1)
    assert found.anisotropy == pytest.approx(4)
    assert found.error_95 == pytest.approx(2)  # 4 times as wide as high: the median is one of the two


def test_sheared_texels():
    net = np.array([[[0, 0, 0], [1, 0, 0]], [[1, 1, 0], [2, 1, 0]]], float)
    found = texel_scale(Surface([RationalPatch.from_points(net)]), [Chart(0, 32, 32)])
    golden = (1 + math.sqrt(5)) / 2  # singular values of [[1, 1], [0, 1]]: golden ratio and its inverse
    assert found.anisotropy == pytest.approx(golden**2)


def test_charts_of_unequal_density():
    charts = [Chart(0, 64, 32, t1=0.5), Chart(0, 32, 16, t0=0.5)]
    found = texel_scale(plane(), charts)
    assert found.spread == pytest.approx(4)
    assert found.anisotropy == pytest.approx(1)
    assert found.error == pytest.approx(0.5)  # either half has one half of the area
    assert found.error_95 == pytest.approx(1)
    even = texel_scale(plane(), [Chart(0, 64, 32, t1=0.5), Chart(0, 64, 32, t0=0.5)])
    assert even.spread == pytest.approx(1)


def test_the_torus_as_written_down():
    # A quarter circle with weights 1, √½, 1 has speed √2 r / W(t), W the sum of the weights' Bernstein terms.
    t = (np.arange(4000) + 0.5) / 4000
    weight = (1 - t) ** 2 + math.sqrt(2) * t * (1 - t) + t**2
    x = ((1 - t) ** 2 + math.sqrt(2) * t * (1 - t)) / weight
    np.testing.assert_allclose(np.hypot(x, np.sqrt(1 - x**2)), 1)
    speed = math.sqrt(2) / weight
    assert speed.mean() == pytest.approx(math.pi / 2, rel=1e-6)
    major, minor = 3.0, 1.0
    pick = t[::20], speed[::20]
    cosine = np.concatenate([x, -x])[::20]
    across = (major + minor * cosine)[:, None] * pick[1][None, :]  # along the ring, per point of the tube
    tube = np.concatenate([pick[1], pick[1]])[:, None] * minor * np.ones_like(across)
    area = (across * tube).ravel()
    order = np.argsort(area)
    below = np.cumsum(area[order]) / area.sum()
    low, high = area[order][np.searchsorted(below, [0.01, 0.99])]
    found = texel_scale(torus(major, minor), uniform_layout(torus(), chart=100))
    assert found.spread == pytest.approx(high / low, rel=0.01)
    stretch = np.maximum(across / tube, tube / across).ravel()
    order = np.argsort(stretch)
    below = np.cumsum(area[order]) / area.sum()
    assert found.anisotropy == pytest.approx(stretch[order][np.searchsorted(below, 0.5)], rel=0.01)
    sizes, twice = np.log2(np.concatenate([across.ravel(), tube.ravel()])), np.tile(area, 2)
    order = np.argsort(sizes)
    median = sizes[order][np.searchsorted(np.cumsum(twice[order]), area.sum())]
    assert found.error == pytest.approx(np.average(np.abs(sizes - median), weights=twice), rel=0.01)


def test_it_does_not_depend_on_unit_or_place():
    charts = uniform_layout(torus(), chart=50)
    one, large = (texel_scale(torus(3 * k, k), charts) for k in (1, 1000))
    assert one.spread == pytest.approx(large.spread)
    assert one.error == pytest.approx(large.error)


@pytest.mark.parametrize("spec", ["sphere:tiling=octants", "cone", "vase", "cyclide"])
def test_poles_do_no_harm(spec):
    surface = surface_from_spec(spec)
    found = texel_scale(surface, uniform_layout(surface, chart=64))
    assert 1 <= found.spread < 100
    assert 1 <= found.anisotropy <= found.anisotropy_95 < math.inf
    assert 0 <= found.error <= found.error_95 < math.inf


def test_what_cannot_be_measured_is_refused():
    with pytest.raises(InputError, match="no charts"):
        texel_scale(plane(), [])
    with pytest.raises(InputError, match="face 1"):
        texel_scale(plane(), [Chart(1, 64, 64)])
    with pytest.raises(InputError, match=r"chart 0 reaches from 0 to 2; allowed: rising, 0 to 1"):
        texel_scale(plane(), [Chart(0, 64, 64, t1=2.0)])
    line = RationalPatch.from_points(np.array([[[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0]]], float))
    with pytest.raises(InputError, match="area"):
        texel_scale(Surface([line]), [Chart(0, 64, 64)])
