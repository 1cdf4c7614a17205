"""Sliced Wasserstein distance."""

import numpy as np
import pytest
from measured import grains, tiles
from scipy.ndimage import convolve1d
from scipy.stats import wasserstein_distance

from upholster.base.errors import InputError
from upholster.covering.measure import measure_image, sliced_wasserstein
from upholster.covering.measure.fidelity import _distance, _doubled, _halved, _pyramid
from upholster.covering.measure.samples import coded
from upholster.image.color import to_linear


@pytest.mark.parametrize("make", [grains, tiles])
def test_an_exemplar_is_itself(make):
    exemplar = make()
    found = measure_image(exemplar, exemplar)
    assert found.wasserstein == (0,) * 4
    assert found.seams is found.scale is found.mapping is None


@pytest.mark.slow(reason="lays and measures whole quilts")
@pytest.mark.parametrize("size", [(32, 32), (65, 47), (600, 700), (40, 4000)])
def test_large_and_odd_exemplars_are_themselves(size):
    exemplar = grains(*size)
    assert sum(sliced_wasserstein([exemplar], exemplar)) == 0


def test_more_of_the_same_is_near_and_shuffled_pixels_are_far():
    texture = grains(256, 256)
    exemplar, more = texture[:96, :96], texture[:, 96:]
    shuffled = np.random.default_rng(0).permutation(more.reshape(-1, 3)).reshape(more.shape)
    near, far = sliced_wasserstein([more], exemplar), sliced_wasserstein([shuffled], exemplar)
    assert far[0] > 10 * near[0]
    assert sum(far) > 4 * sum(near)


def test_a_shift_of_brightness_shows_on_the_last_level_only():
    grey = np.full((64, 64, 3), 100, np.uint8)
    found = sliced_wasserstein([grey + np.uint8(51)], grey)
    assert max(found[:-1]) < 1e-6
    # A constant shift projects to 0.2 times the sum of a unit vector of 147 normal numbers.
    assert found[-1] == pytest.approx(0.2 * np.sqrt(2 / np.pi), rel=0.2)


def test_several_charts_are_one_sample():
    texture = grains(96, 192)
    whole = sliced_wasserstein([texture], texture)
    halves = sliced_wasserstein([texture[:, :96], texture[:, 96:]], texture)
    assert sum(whole) == 0
    assert sum(halves) < 0.01


def test_depth_and_coding_do_not_matter():
    texture, exemplar = grains(seed=1), grains()
    expected = sliced_wasserstein([texture], exemplar)
    deep = sliced_wasserstein([texture.astype(np.uint16) * 257], exemplar)
    linear = sliced_wasserstein([to_linear(texture)], exemplar)
    np.testing.assert_allclose(deep, expected, rtol=1e-4)
    np.testing.assert_allclose(linear, expected, rtol=1e-3)


def test_distance_against_scipy():
    rng = np.random.default_rng(0)
    one, other = rng.normal(size=(3, 400)), rng.normal(0.3, 1.2, size=(3, 1000))
    expected = np.mean([wasserstein_distance(a, b) for a, b in zip(one, other, strict=True)])
    assert _distance(np.sort(one), np.sort(other)) == pytest.approx(expected, rel=0.02)
    same = rng.normal(0.3, 1.2, size=(3, 400))
    expected = np.mean([wasserstein_distance(a, b) for a, b in zip(one, same, strict=True)])
    assert _distance(np.sort(one), np.sort(same)) == pytest.approx(expected)


@pytest.mark.parametrize("size", [(64, 64), (37, 50), (33, 9)])
def test_pyramids_add_up_to_the_image(size):
    image = coded(grains(*size))
    bands = _pyramid(image, 3)
    found = bands.pop()
    while bands:
        band = bands.pop()
        found = band + _doubled(_doubled(found, 0, band.shape[0]), 1, band.shape[1])
    np.testing.assert_allclose(found, image, atol=1e-6)
    taps = np.array([1, 4, 6, 4, 1]) / 16
    np.testing.assert_allclose(_halved(image, 0), convolve1d(image, taps, 0, mode="mirror")[::2], atol=1e-6)


@pytest.mark.parametrize(
    ("image", "exemplar", "named"),
    [
        (np.zeros((31, 64, 3), np.uint8), grains(), "64×31"),
        (np.zeros((64, 64), np.uint8), grains(), "image"),
        (np.zeros((64, 64, 1), np.uint8), grains(), "channels"),
        (np.zeros((64, 64, 3)), grains(), "float64"),
        (grains(), np.zeros((16, 16, 3), np.uint8), "sample"),
        (np.full((64, 64, 3), np.nan, np.float32), grains(), "finite"),
    ],
)
def test_what_cannot_be_measured_is_refused(image, exemplar, named):
    with pytest.raises(InputError, match=named):
        measure_image(image, exemplar)


def test_arrays_that_do_not_belong_together_are_refused():
    with pytest.raises(InputError, match="channels"):
        sliced_wasserstein([grains(channels=1)], grains())
    with pytest.raises(InputError, match="at least one"):
        sliced_wasserstein([], grains())
    with pytest.raises(InputError, match="result 0"):
        sliced_wasserstein([grains(6, 40)], grains())


def test_charts_so_small_that_no_patch_of_some_is_drawn():
    texture = grains(300, 300)
    small = [texture[r : r + 7, c : c + 7] for r in range(0, 70, 7) for c in range(0, 70, 7)]
    assert np.isfinite(sliced_wasserstein([texture, *small], texture)).all()
