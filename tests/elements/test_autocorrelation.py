"""How alike a sample and its shifted copy are, against plain sums."""

import numpy as np
import pytest

from upholster.image.elements.autocorrelation import ALIKE, correlation, highest, shifted_products
from upholster.image.elements.bases import shortest_pair


def whole(height, width, seed=1):
    return np.random.default_rng(seed).integers(-300, 300, (height, width))


@pytest.mark.parametrize(("height", "width", "reach"), [(9, 7, (4, 3)), (6, 11, (5, 10)), (5, 5, (0, 0))])
def test_shifted_products_are_plain_sums(height, width, reach):
    plane = whole(height, width)
    found = shifted_products([plane], reach)
    assert found.shape == (reach[0] + 1, 2 * reach[1] + 1)
    for i in range(reach[0] + 1):
        for j in range(-reach[1], reach[1] + 1):
            here = plane[: height - i, max(0, -j) : width - max(0, j)]
            there = plane[i:, max(0, j) : width + min(0, j)]
            assert found[i, j + reach[1]] == pytest.approx((here * there).sum(), abs=1e-6)


def test_the_correlation_is_that_of_the_shared_pixels():
    planes = [whole(9, 12), 3 * whole(9, 12, 2) + np.arange(12) * 40]
    found = correlation(planes, (5, 7))
    assert found.heights.shape == found.overlaps.shape == (11, 15)
    for i in range(-5, 6):
        for j in range(-7, 8):
            sums = np.zeros(3)
            for plane in planes:
                here = plane[max(0, -i) : 9 - max(0, i), max(0, -j) : 12 - max(0, j)]
                there = plane[max(0, i) : 9 + min(0, i), max(0, j) : 12 + min(0, j)]
                here, there = here - here.mean(), there - there.mean()
                sums += (here * there).sum(), (here * here).sum(), (there * there).sum()
            expected = ALIKE * sums[0] / np.sqrt(sums[1] * sums[2])
            assert found.overlaps[i + 5, j + 7] == here.size
            assert found.heights[i + 5, j + 7] == pytest.approx(expected, abs=1)


@pytest.mark.parametrize("near", [0, 1, 2, 5])
def test_the_highest_near_values(near):
    values = whole(9, 13)
    expected = [
        [values[max(0, i - near) : i + near + 1, max(0, j - near) : j + near + 1].max() for j in range(13)]
        for i in range(9)
    ]
    assert (highest(values, near) == expected).all()


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        ((1, 0), (7, 3), ((1, 0), (0, 3))),
        ((5, 5), (7, 8), ((-1, 1), (3, 2))),
        ((2, 4), (3, 6), ((0, 0), (1, 2))),
        ((0, 0), (3, 1), ((0, 0), (3, 1))),
    ],
)
def test_the_shortest_pair_generates_the_same_lattice(one, other, expected):
    short, long = shortest_pair(one, other)
    for found, square in zip((short, long), expected, strict=True):
        assert np.hypot(*found) == pytest.approx(np.hypot(*square))
    assert abs(np.linalg.det([short, long])) == pytest.approx(abs(np.linalg.det([one, other])))
