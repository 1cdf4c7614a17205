"""Several samples in one image."""

import numpy as np
import pytest

from upholster import InputError
from upholster.image.color import to_linear
from upholster.image.files.collage import combined
from upholster.image.files.material import Material


def sample(height: int, width: int, channels: int = 3, **maps: np.ndarray) -> Material:
    rng = np.random.default_rng(height)
    return Material({"albedo": rng.integers(0, 256, (height, width, channels), np.uint8), **maps})


def test_each_sample_is_a_rectangle_of_the_image() -> None:
    parts = [sample(50, 70), sample(90, 64), sample(40, 40)]
    whole, rectangles = combined(parts)
    assert rectangles == ((0, 0, 50, 70), (0, 128, 90, 64), (0, 192, 40, 40))
    assert whole.shape == (90, 232)
    assert whole.used is not None
    inside = np.zeros(whole.shape, bool)
    for part, (row, column, height, width) in zip(parts, rectangles, strict=True):
        window = np.s_[row : row + height, column : column + width]
        np.testing.assert_array_equal(whole.maps["albedo"][window], part.maps["albedo"])
        inside[window] = True
    np.testing.assert_array_equal(whole.used, inside)


def test_what_is_masked_stays_masked() -> None:
    used = np.ones((40, 40), bool)
    used[:, :10] = False
    first = sample(40, 40)
    whole, _ = combined([first, Material(dict(sample(40, 40).maps), used=used)])
    assert whole.used is not None
    assert whole.used[:, :40].all()
    np.testing.assert_array_equal(whole.used[:, 64:104], used)


def test_maps_that_a_sample_lacks_are_neutral() -> None:
    normal = np.full((40, 40, 3), (10, 20, 200), np.uint8)
    rough = np.full((40, 40, 1), 0.25, np.float32)
    whole, rectangles = combined([sample(40, 40, normal=normal, roughness=rough), sample(40, 40, 4)])
    second = np.s_[:40, rectangles[1][1] :]
    assert set(whole.maps) == {"albedo", "normal", "roughness"}
    assert whole.maps["albedo"].shape[2] == 4
    assert (whole.maps["albedo"][:40, :40, 3] == 255).all()
    np.testing.assert_array_equal(whole.maps["normal"][second], np.full((40, 40, 3), (128, 128, 255)))
    np.testing.assert_allclose(whole.maps["roughness"][second], 0.8)
    np.testing.assert_allclose(whole.maps["roughness"][:40, :40], 0.25)


def test_grey_beside_colour_and_other_depths() -> None:
    grey, deep = sample(40, 40, 1), Material({"albedo": np.full((40, 40, 3), 65535, np.uint16)})
    whole, rectangles = combined([grey, deep])
    assert whole.maps["albedo"].dtype == np.uint8
    assert (whole.maps["albedo"][:40, :40] == grey.maps["albedo"]).all()
    assert (whole.maps["albedo"][:40, rectangles[1][1] :] == 255).all()


def test_too_many_are_refused() -> None:
    with pytest.raises(InputError, match=r"samples are \d+ pixels wide side by side; allowed: up to 4096"):
        combined([sample(40, 1200)] * 4)


def test_linear_colours_beside_coded_ones_stay_the_same_colours() -> None:
    coded = sample(40, 40)
    linear = Material({"albedo": to_linear(coded.maps["albedo"]).astype(np.float32)})
    for first, second in ((coded, linear), (linear, coded)):
        whole, rectangles = combined([first, second])
        own, other = whole.maps["albedo"][:40, :40], whole.maps["albedo"][:40, rectangles[1][1] :]
        np.testing.assert_array_equal(own, first.maps["albedo"])
        np.testing.assert_allclose(other, own, atol=1e-6)
