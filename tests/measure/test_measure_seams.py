"""Seam ratios: invisible where there is no seam, above 1 where there is one."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from measured import grains
from tests.charts.on_patches import laid

from upholster.base.errors import InputError
from upholster.charts.layout import density_layout, uniform_layout
from upholster.covering.measure import edge_seam_ratio, wrap_seams
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.plane import plane
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels
from upholster.quilt.painting import paint

WAVES = np.random.default_rng(3).normal(size=(3, 24))  # no direction is better than another
WAVES /= np.linalg.norm(WAVES, axis=0)


def in_space(surface, charts, place=None):
    """Texels that tell their position in space: continuous over the surface, whatever the charts."""
    arrays = []
    for chart in charts:
        s = chart.s0 + (chart.s1 - chart.s0) * (np.arange(chart.height) + 0.5) / chart.height
        t = chart.t0 + (chart.t1 - chart.t0) * (np.arange(chart.width) + 0.5) / chart.width
        points = surface.faces[chart.face].points_grid(s, t)
        values = np.sin(50 * points @ WAVES / surface.size) + 2 if place is None else place(points)
        arrays.append(values.astype(np.float32))
    return Texels(tuple(charts), tuple(arrays))


@pytest.mark.slow(reason="lays and measures whole quilts")
@pytest.mark.parametrize("spec", ["cyclide", "sphere:tiling=octants", "cylinder", "vase"])
def test_what_is_continuous_on_the_surface_has_no_seams(spec):
    surface = surface_from_spec(spec)
    texels = in_space(surface, uniform_layout(surface, chart=64))
    whole = edge_seam_ratio(surface, texels)
    assert 0.8 < whole < 1.15  # texels are not equally large at edges and inside
    for other in (texels.arrays[0][::-1], texels.arrays[0][:, ::-1], texels.arrays[0].swapaxes(0, 1)):
        broken = Texels(texels.charts, (np.ascontiguousarray(other), *texels.arrays[1:]))
        assert edge_seam_ratio(surface, broken) > whole + 0.2


@pytest.mark.slow(reason="lays and measures whole quilts")
@pytest.mark.parametrize("spec", ["cyclide", "sphere", "vase"])
def test_even_layouts_have_no_seams_where_fields_tell_the_size(spec):
    surface = surface_from_spec(spec)
    charts = density_layout(surface, texels=2**18)
    assert len({(chart.height, chart.width) for chart in charts}) > 1 or spec == "sphere"
    texels = in_space(surface, charts)
    # The waves go through space: any scale will do, only sizes relative to one another count.
    _, fields = laid(surface, charts, None, 100 / surface.size)
    whole = edge_seam_ratio(surface, texels, fields=fields)
    assert 0.95 < whole < (1.1 if spec == "vase" else 1.05)  # whose charts are thin beside its poles
    shifted = [np.roll(array, 3, axis=(0, 1)) if n % 2 else array for n, array in enumerate(texels.arrays)]
    assert edge_seam_ratio(surface, Texels(texels.charts, tuple(shifted)), fields=fields) > whole + 0.1
    with pytest.raises(InputError, match="fields"):
        edge_seam_ratio(surface, texels, fields=fields[1:])


def test_wrapped_edges():
    rows, columns = np.mgrid[:60, :80]
    wave = np.sin(2 * np.pi * (3 * rows / 60 + 5 * columns / 80)) + np.sin(2 * np.pi * 2 * rows / 60)
    image = (128 + 50 * wave[:, :, None]).astype(np.uint8)
    found = wrap_seams(image)
    assert found.ratio == pytest.approx(1, abs=0.15)
    assert 0.9 * found.low < found.ratio < 1.1 * found.high
    assert wrap_seams(image[:50, :70]).ratio > 3
    rng = np.random.default_rng(1)
    noise = rng.integers(0, 256, (300, 200, 3), np.uint8)
    found = wrap_seams(noise)
    assert found.ratio == pytest.approx(1, abs=0.08)
    assert 0.9 < found.low < 1 < found.high < 1.1
    assert dataclasses.astuple(wrap_seams(np.full((9, 9, 1), 3, np.uint8))) == (1, 1, 1)
    assert wrap_seams(noise[:1]) is None


def test_wrapped_edges_against_a_plain_sum():
    rng = np.random.default_rng(2)
    image = rng.integers(0, 256, (30, 50, 2), np.uint8)
    image[0] = 255 - image[-1]
    values = image / 255
    wrapped = np.abs(values[0] - values[-1]).sum() + np.abs(values[:, 0] - values[:, -1]).sum()
    rows, columns = np.abs(np.diff(values, axis=0)), np.abs(np.diff(values, axis=1))
    expected = wrapped / (rows.sum() / 29 + columns.sum() / 49)
    assert wrap_seams(image).ratio == pytest.approx(expected, rel=1e-5)


def test_charts_of_several_sizes_and_several_on_a_patch():
    surface = surface_from_spec("torus")
    rng = np.random.default_rng(0)
    charts = []
    for n, chart in enumerate(uniform_layout(surface, chart=8)):
        height, width = rng.integers(50, 70, 2).tolist()
        middle = (chart.t0 + chart.t1) / 2
        if n % 3:
            charts.append(replace(chart, height=height, width=width))
        else:
            charts.append(replace(chart, height=60, width=32, t1=middle))
            charts.append(replace(chart, height=64, width=30, t0=middle))
    texels = in_space(surface, charts)
    found = edge_seam_ratio(surface, texels)
    assert 0.85 < found < 1.1
    arrays = list(texels.arrays)
    arrays[1] = arrays[1][:, ::-1].copy()
    assert edge_seam_ratio(surface, Texels(texels.charts, tuple(arrays))) > found + 0.3


def test_halves_of_one_patch_meet():
    flat = plane()
    charts = [Chart(0, 32, 16, t1=0.5), Chart(0, 32, 16, t0=0.5)]
    texels = in_space(flat, charts)
    whole = edge_seam_ratio(flat, texels)
    assert whole == pytest.approx(1, abs=0.25)
    swapped = Texels(texels.charts, texels.arrays[::-1])
    assert edge_seam_ratio(flat, swapped) > 1.4 * whole


def test_noise_has_no_seams_and_steps_have_nothing_else():
    surface = surface_from_spec("torus")
    charts = uniform_layout(surface, chart=48)
    rng = np.random.default_rng(0)
    noise = tuple(rng.integers(0, 256, (48, 48, 3), np.uint8) for _ in charts)
    assert edge_seam_ratio(surface, Texels(charts, noise)) == pytest.approx(1, abs=0.03)
    constant = tuple(np.full((48, 48, 3), 90, np.uint8) for _ in charts)
    assert edge_seam_ratio(surface, Texels(charts, constant)) == 1
    steps = tuple(array + np.uint8(n) for n, array in enumerate(constant))
    assert edge_seam_ratio(surface, Texels(charts, steps)) == np.inf


def test_a_surface_without_shared_edges_has_no_ratio():
    assert edge_seam_ratio(plane(), in_space(plane(), [Chart(0, 32, 32)])) is None


def test_charts_of_another_surface_are_refused():
    texels = Texels((Chart(5, 32, 32),), (np.zeros((32, 32, 3), np.float32),))
    with pytest.raises(InputError, match="face 5"):
        edge_seam_ratio(plane(), texels)


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_unmended_seams_are_worse_than_mended(dtype):
    surface, exemplar = surface_from_spec("torus"), grains()
    exemplar = exemplar if dtype == np.uint8 else (exemplar / np.float32(255)) ** 2
    ratios = []
    for seams in (True, False):
        quilt = synthesize(exemplar, surface, method="paper", chart=96, seams=seams, seed=1)
        ratios.append(edge_seam_ratio(surface, paint(quilt, exemplar)))
    assert ratios[0] < 1.3
    assert ratios[1] > ratios[0] + 0.5
