"""Seam ratios: invisible where there is no seam, above 1 where there is one."""

import itertools

import numpy as np
import pytest
from measured import grains, quilt_of

from upholster.errors import InputError
from upholster.geometry import Surface, plane, surface_from_spec
from upholster.measure import cut_seam_ratio, edge_seam_ratio
from upholster.measure.copies import copy_labels, copy_maps, quilt_windows
from upholster.measure.seams import _facing, _line
from upholster.synthesis import Texels, paint, synthesize
from upholster.synthesis.quilt import Chart

OBLIQUE = np.array([[0.7, 0.5, -0.6], [-0.4, 0.8, 0.5], [0.6, -0.4, 0.7]])  # no wave along an edge


def in_space(surface, charts, place=None):
    """Texels that tell their position in space: continuous over the surface, whatever the charts."""
    arrays = []
    for chart in charts:
        s = chart.s0 + (chart.s1 - chart.s0) * (np.arange(chart.height) + 0.5) / chart.height
        t = chart.t0 + (chart.t1 - chart.t0) * (np.arange(chart.width) + 0.5) / chart.width
        points = surface.patches[chart.patch].points_grid(s, t)
        values = np.sin(50 * points @ OBLIQUE / surface.size) + 2 if place is None else place(points)
        arrays.append(values.astype(np.float32))
    return Texels(tuple(charts), tuple(arrays))


@pytest.mark.parametrize("spec", ["cyclide", "torus", "sphere", "sphere:tiling=octants", "cylinder", "vase"])
def test_what_is_continuous_on_the_surface_has_no_seams(spec):
    surface = surface_from_spec(spec)
    texels = in_space(surface, [Chart(p, 64, 64) for p in range(len(surface.patches))])
    whole = edge_seam_ratio(surface, texels)
    assert 0.4 < whole < 1.3  # texels are not equally large at edges and inside
    for other in (texels.arrays[0][::-1], texels.arrays[0][:, ::-1], texels.arrays[0].swapaxes(0, 1)):
        broken = Texels(texels.charts, (np.ascontiguousarray(other), *texels.arrays[1:]))
        assert edge_seam_ratio(surface, broken) > whole + 0.2


def test_charts_of_several_sizes_and_several_on_a_patch():
    surface = surface_from_spec("torus")
    rng = np.random.default_rng(0)
    charts = []
    for patch in range(len(surface.patches)):
        if patch % 3:
            charts.append(Chart(patch, *rng.integers(50, 70, 2).tolist()))
        else:
            charts += [Chart(patch, 60, 32, t1=0.5), Chart(patch, 64, 30, t0=0.5)]
    texels = in_space(surface, charts)
    found = edge_seam_ratio(surface, texels)
    # Sizes that differ cost something: nearest texels are half a texel off along the edge.
    assert 0.9 < found < 1.4
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
    assert edge_seam_ratio(flat, swapped) > 2 * whole


@pytest.mark.parametrize("spec", ["cyclide", "sphere", "sphere:tiling=octants", "cylinder", "cone"])
def test_texels_that_face_one_another_touch(spec):
    surface = surface_from_spec(spec)
    rng = np.random.default_rng(4)
    charts, on_patch = [], {}
    for patch in range(len(surface.patches)):
        on_patch[patch] = [len(charts), len(charts) + 1]
        cut = float(rng.uniform(0.3, 0.7))
        charts += [Chart(patch, 40, int(60 * cut), t1=cut), Chart(patch, 50, int(60 * (1 - cut)), t0=cut)]
    places = in_space(surface, charts, place=lambda points: points).arrays
    met = 0
    for index, edge in itertools.product(range(len(charts)), range(4)):
        chart = charts[index]
        count = chart.width if edge in (0, 2) else chart.height
        faced = np.zeros(count, int)
        own = _line(places[index], edge, np.zeros(1, int), np.arange(count))[0]
        inner = _line(places[index], edge, np.ones(1, int), np.arange(count))[0]
        for along, other, other_edge, there in _facing(surface, charts, on_patch, index, edge):
            faced[along] += 1
            beyond = _line(places[other], other_edge, np.zeros(1, int), there)[0]
            further = _line(places[other], other_edge, np.ones(1, int), there)[0]
            size = np.linalg.norm(own - inner, axis=1)[along] + np.linalg.norm(beyond - further, axis=1)
            step = np.linalg.norm(np.diff(own, axis=0), axis=1).max()
            assert (np.linalg.norm(own[along] - beyond, axis=1) < 0.6 * size + step).all()
            met += len(along)
        line = {0: chart.s0, 1: chart.t1, 2: chart.s1, 3: chart.t0}[edge]
        alone = line in (0, 1) and not surface.neighbours(chart.patch, edge)
        assert (faced == (0 if alone else 1)).all()
    assert met > 700


def test_noise_has_no_seams_and_steps_have_nothing_else():
    surface = surface_from_spec("torus")
    charts = tuple(Chart(p, 48, 48) for p in range(16))
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
    texels = in_space(surface_from_spec("torus"), [Chart(5, 32, 32)])
    with pytest.raises(InputError, match="patch 5"):
        edge_seam_ratio(Surface(plane().patches), texels)


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_unmended_seams_are_worse_than_mended(dtype):
    surface, exemplar = surface_from_spec("torus"), grains()
    exemplar = exemplar if dtype == np.uint8 else (exemplar / np.float32(255)) ** 2
    ratios = []
    for seams in (True, False):
        quilt = synthesize(exemplar, surface, chart=96, seams=seams, seed=1)
        ratios.append(edge_seam_ratio(surface, paint(quilt, exemplar)))
    assert ratios[0] < 1.3
    assert ratios[1] > ratios[0] + 0.5


def test_cuts_against_a_plain_sum():
    rng = np.random.default_rng(2)
    blocks = [(r, c, 16, 16, *rng.integers(8, 56, 2), rng.integers(4)) for r in (8, 24) for c in (8, 24)]
    quilt, exemplar = quilt_of(blocks), grains()
    texels = paint(quilt, exemplar)
    pixels = texels.arrays[0] / 255
    down, right = np.abs(np.diff(pixels, axis=0)), np.abs(np.diff(pixels, axis=1))
    everywhere = np.concatenate([down.ravel(), right.ravel()]).mean()
    cuts = np.concatenate([down[15].ravel(), right[:, 15].ravel()]).mean()
    assert cuts > 1.5 * everywhere
    assert cut_seam_ratio(quilt, texels) == pytest.approx(cuts / everywhere, rel=1e-5)


def test_bands_do_not_change_the_figure(monkeypatch):
    exemplar, surface = grains(), plane()
    quilt = synthesize(exemplar, surface, chart=100, seed=1)
    texels = paint(quilt, exemplar)
    whole = cut_seam_ratio(quilt, texels)
    monkeypatch.setattr("upholster.measure.seams.BAND", 7)
    assert cut_seam_ratio(quilt, texels) == pytest.approx(whole)
    labels = copy_labels(quilt, quilt_windows(quilt)[0], copy_maps(quilt))
    assert len(np.unique(labels)) > 4


def test_a_quilt_of_one_block_has_no_cuts_and_a_constant_one_no_visible_ones():
    quilt = quilt_of([(16, 16, 32, 32, 30, 30, 0)])
    assert cut_seam_ratio(quilt, paint(quilt, grains())) is None
    two = quilt_of([(16, 8, 32, 16, 30, 30, 0), (16, 24, 32, 16, 30, 30, 0)])
    assert cut_seam_ratio(two, paint(two, np.full((64, 64, 3), 7, np.uint8))) == 1
    with pytest.raises(InputError, match="charts"):
        cut_seam_ratio(two, Texels((Chart(0, 8, 8),), (np.zeros((8, 8, 3), np.uint8),)))
