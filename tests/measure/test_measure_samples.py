"""Which samples are looked at, and as what numbers."""

import numpy as np
import pytest

from upholster.covering.measure.samples import chosen_windows, coded
from upholster.image.color import to_linear


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_floats_are_coded_as_integers_are(dtype, channels):
    pixels = np.random.default_rng(0).integers(0, np.iinfo(dtype).max, (9, 8, channels), dtype, endpoint=True)
    np.testing.assert_allclose(coded(to_linear(pixels)), coded(pixels), atol=2e-6)
    assert coded(pixels).dtype == np.float32
    assert coded(pixels).max() <= 1


def test_floats_beyond_one_and_below_zero_are_not_clipped():
    found = coded(np.array([[[-4.0], [-1.0], [1.0], [4.0]]], np.float32)).ravel()
    assert (np.diff(found) > 0.5).all()
    np.testing.assert_allclose(found, -found[::-1])


def test_windows_cover_small_arrays_once():
    shapes = [(100, 33, 3), (7, 200, 1)]
    counts = [np.zeros(shape[:2], int) for shape in shapes]
    for window in chosen_windows(shapes, side=32, most=10**6):
        window.of(counts[window.index])[:] += 1
        assert max(window.height, window.width) <= 32
    for count in counts:
        assert (count == 1).all()


def test_of_large_arrays_a_part_is_chosen_and_always_the_same():
    shapes = [(4000, 4000)] * 3
    windows = chosen_windows(shapes, side=512, most=2**21)
    assert 2**20 < sum(window.height * window.width for window in windows) <= 2**21
    assert len({window.index for window in windows}) == 3
    assert windows == chosen_windows(shapes, side=512, most=2**21)
    assert len(chosen_windows(shapes, side=512, most=1)) == 1
