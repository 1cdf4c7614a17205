"""The matching form: main colours in whole numbers, distances as they were."""

import numpy as np
import pytest

from upholster.synthesis.quilt.features import pca_features


def mixed(shape, scales, seed=0):
    """Return samples whose principal components, after a rotation, have these standard deviations."""
    rng = np.random.default_rng(seed)
    parts = rng.normal(size=(*shape, len(scales))) * scales
    symmetry = np.linalg.qr(rng.normal(size=(len(scales),) * 2))[0]
    return parts @ symmetry


def as_bytes(samples):
    return np.rint(128 + samples * (100 / np.abs(samples).max())).astype(np.uint8)


def distances(image, seed=1, count=4000):
    flat = image.reshape(-1, image.shape[2]).astype(float)
    a, b = np.random.default_rng(seed).integers(0, len(flat), (2, count))
    return np.linalg.norm(flat[a] - flat[b], axis=1)


def test_distances_are_kept_up_to_a_factor():
    image = as_bytes(mixed((60, 50), (10, 6, 3)))
    form = pca_features(image)
    assert form.shape == (60, 50, 3)
    assert form.dtype == np.uint8
    before, after = distances(image), distances(form)
    inner = before < np.percentile(before, 99)  # the farthest ones may be clipped
    factor = np.median(after[inner] / np.maximum(before[inner], 1))
    error = np.abs(after - factor * before)[inner]
    assert factor > 0.5
    assert np.percentile(error, 99) < 2  # rounding of two samples of three components


def test_components_are_in_order_of_their_variance():
    form = pca_features(as_bytes(mixed((80, 60), (3, 12, 6), seed=3)))
    spread = form.reshape(-1, 3).astype(float)
    assert (np.diff(spread.var(axis=0)) < 0).all()
    covariance = np.cov(spread.T)
    assert np.abs(covariance - np.diag(np.diag(covariance))).max() < 0.02 * covariance[0, 0]
    low, high = np.percentile(form[..., 0], [0.2, 99.8])
    assert low <= 20
    assert high >= 235


@pytest.mark.parametrize(
    ("scales", "most", "count"),
    [((10, 0.1, 0.1), 4, 1), ((10, 10, 0.1), 4, 2), ((5,) * 6, 4, 4), ((5,) * 6, 2, 2), ((5,), 4, 1)],
)
def test_as_many_components_as_matter(scales, most, count):
    image = mixed((60, 50), scales).astype(np.float32)
    assert pca_features(image, most=most).shape == (60, 50, count)


@pytest.mark.parametrize("channels", range(1, 13))
def test_any_number_of_channels(channels):
    image = as_bytes(mixed((20, 30), tuple(range(1, channels + 1))))
    form = pca_features(image)
    assert form.shape[:2] == (20, 30)
    assert 1 <= form.shape[2] <= min(channels, 4)


def test_depth_hardly_matters():
    image = as_bytes(mixed((60, 50), (10, 6, 3)))
    form = pca_features(image)
    for other in (image.astype(np.uint16) * 257, image.astype(np.float32) / 255):
        again = pca_features(other)
        assert np.abs(again.astype(int) - form).max() <= 1


def test_grey_is_spread_over_all_values():
    grey = np.tile(np.arange(100, 140, dtype=np.uint8), (20, 1))[..., None]
    form = pca_features(grey)
    assert form.shape == (20, 40, 1)
    assert (form[0, 0, 0], form[0, -1, 0]) == (0, 255)
    assert len(np.unique(form)) == 40
    # every sample's place on the scale, rounded
    wanted = np.arange(40) * 255 / 39
    assert np.abs(form[0, :, 0] - wanted).max() <= 0.5 + 1e-9


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("channels", [1, 3])
def test_a_constant_image_is_all_alike(dtype, channels):
    form = pca_features(np.full((9, 7, channels), 77, dtype))
    assert form.shape[:2] == (9, 7)
    assert np.ptp(form) == 0


def test_it_does_not_depend_on_the_order_of_channels():
    image = as_bytes(mixed((60, 50), (10, 6, 3)))
    form = pca_features(image)
    other = pca_features(np.ascontiguousarray(image[..., ::-1]))
    assert np.abs(form.astype(int) - other).max() <= 1


def test_half_the_colours_may_lie_beyond_the_ends_but_few_are_clipped():
    rng = np.random.default_rng(2)
    image = rng.normal(0, 10, (100, 100, 1)).astype(np.float32)
    image[0, :4] = 1000  # outliers do not squeeze the rest
    form = pca_features(image)
    assert np.ptp(np.percentile(form, [5, 95])) > 80
    assert (form == 255).mean() < 0.01
