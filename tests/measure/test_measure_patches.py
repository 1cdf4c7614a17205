"""Patches of the one side in the other."""

import numpy as np
import pytest
from measured import grains, tiles, warped
from tests.measure.test_measure_broken import sheet

from upholster.base.errors import InputError
from upholster.covering.measure import measure_cover, patch_distance, undistorted_views
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.plane import plane
from upholster.quilt.model import Texels
from upholster.quilt.painting import paint


def test_what_is_copied_is_at_no_distance():
    exemplar = grains(80, 70)
    both = patch_distance([exemplar[10:60, 5:55]], exemplar)
    assert both is not None
    assert both.to_sample == pytest.approx(0, abs=1e-6)
    assert both.to_result > 0.1  # the result has only a part of it


@pytest.mark.parametrize("side", [31, 15])
def test_distances_are_those_to_the_nearest_patch(side):
    exemplar, result = grains(34, 36, seed=1), grains(side, side, seed=2)
    found = patch_distance([result], exemplar, side=side)
    assert found is not None
    sample, piece = (image.mean(axis=2) / 255 for image in (exemplar, result))
    windows = np.lib.stride_tricks.sliding_window_view(sample, (side, side))
    nearest = np.sqrt(((windows - piece) ** 2).mean(axis=(2, 3))).min()
    assert found.to_sample == pytest.approx(nearest / sample.std(), rel=1e-4)


def test_broken_tiles_are_farther_than_whole_ones():
    exemplar = tiles(96, 96, (16, 16))
    whole = tiles(96, 96, (16, 16))
    broken = whole.copy()
    broken[:, 48:] = np.roll(whole, 8, axis=0)[:, 48:]
    near, far = (patch_distance([image], exemplar) for image in (whole, broken))
    assert near is not None
    assert far is not None
    assert near.to_sample < 0.01 < 0.1 < far.to_sample


def test_there_is_no_distance_of_what_is_too_small_or_plain():
    assert patch_distance([grains(30, 64)], grains()) is None
    assert patch_distance([grains()], np.full((64, 64, 3), 9, np.uint8)) is None
    with pytest.raises(InputError, match="side is 0 pixels; allowed: 1 or more"):
        patch_distance([grains()], grains(), side=0)


def test_views_are_of_what_lies_on_the_surface():
    quilt = warped(np.random.default_rng(4), 1.0, chart=(320, 320), exemplar=(256, 256))
    rows = np.linspace(0, 1, 320, dtype=np.float32)[:, None, None].repeat(320, axis=1)
    for surface, most in ((None, 1.0), (sheet((0, 0.0, 0.5, 0.0, 1.0)), 0.5)):
        views = undistorted_views(quilt.on(surface), Texels(quilt.charts, (rows**2.2,)))
        middles = np.array([view[47:49, 47:49].mean() for view in views]) / 65535
        assert most - 0.3 < middles.max() < most + 0.02


def test_views_of_a_warped_result_are_at_the_samples_scale():
    exemplar = grains(256, 256)
    quilt = warped(np.random.default_rng(4), 0.5, chart=(320, 320), exemplar=(256, 256))
    texels = paint(quilt, exemplar)
    views = undistorted_views(quilt, texels)
    assert {view.shape for view in views} == {(96, 96, 3)}
    through, stretched = (patch_distance(side, exemplar) for side in (views, texels.arrays))
    assert through is not None
    assert stretched is not None
    assert through.to_sample < 0.6 * stretched.to_sample


@pytest.mark.slow(reason="lays and measures whole quilts")
def test_every_kind_of_surface_has_these_measures():
    exemplar = grains(64, 64)
    for surface, options in [
        (plane(), {"texels": (96, 96)}),
        (surface_from_spec("torus"), {"texels": 40000}),
    ]:
        quilt = synthesize(exemplar, surface, seed=1, **options)
        found = measure_cover(surface, quilt, exemplar)
        assert found.patches is not None
        assert "patch distance, 31²" in [name for name, _, _ in found.rows()]
