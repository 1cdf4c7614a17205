"""The Haar transform: orthonormal, invertible, equal to its formula and to PyWavelets."""

import numpy as np
import pytest
import pywt
from hypothesis import given
from hypothesis import strategies as st

from upholster.base.errors import InputError
from upholster.codec.haar import dwt2, idwt2, level_shape, subbands

SIDES = st.integers(1, 40)


@given(SIDES, SIDES, st.integers(1, 4), st.integers(1, 7), st.integers(0, 2**32 - 1))
def test_inverse_gives_the_image_back_and_energy_stays(height, width, channels, levels, seed):
    image = np.random.default_rng(seed).uniform(-1, 1, (height, width, channels))
    coefficients = dwt2(image, levels=levels)
    assert coefficients.shape == image.shape
    assert np.abs(idwt2(coefficients, levels=levels) - image).max() <= 1e-12
    assert np.sum(coefficients**2) == pytest.approx(np.sum(image**2), rel=1e-12)


@pytest.mark.parametrize("shape", [(5, 7), (1, 6), (4, 4)])
def test_the_transform_is_an_orthonormal_matrix(shape):
    size = shape[0] * shape[1]
    matrix = np.stack([dwt2(unit.reshape(shape), levels=2).reshape(-1) for unit in np.eye(size)], axis=1)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(size), atol=1e-14)


@pytest.mark.parametrize("levels", [1, 2, 3])
@pytest.mark.parametrize("shape", [(8, 8), (64, 40), (24, 32, 3)])
def test_every_band_equals_pywavelets(shape, levels):
    image = np.random.default_rng(1).uniform(0, 255, shape)
    ours = subbands(dwt2(image, levels=levels), levels=levels)
    theirs = pywt.wavedec2(image, "haar", level=levels, axes=(0, 1))
    np.testing.assert_allclose(ours[f"LL{levels}"], theirs[0], atol=1e-10)
    for level, (horizontal, vertical, diagonal) in zip(range(levels, 0, -1), theirs[1:], strict=True):
        np.testing.assert_allclose(ours[f"LH{level}"], horizontal, atol=1e-10)
        np.testing.assert_allclose(ours[f"HL{level}"], vertical, atol=1e-10)
        np.testing.assert_allclose(ours[f"HH{level}"], diagonal, atol=1e-10)


def test_one_level_is_its_formula():
    a, b, c, d = 3.0, 5.0, 11.0, 2.0
    ll, hl, lh, hh = (a + b + c + d) / 2, (a - b + c - d) / 2, (a + b - c - d) / 2, (a - b - c + d) / 2
    np.testing.assert_allclose(dwt2(np.array([[a, b], [c, d]]), levels=1), [[ll, hl], [lh, hh]])


@given(SIDES, SIDES, st.integers(1, 6))
def test_subbands_are_views_that_tile_the_array(height, width, levels):
    counts = np.zeros((height, width))
    bands = subbands(counts, levels=levels)
    for band in bands.values():
        band += 1
    assert (counts == 1).all()
    assert bands[f"LL{levels}"].shape == level_shape((height, width), levels)


@pytest.mark.parametrize(
    ("image", "levels"),
    [
        (np.zeros(4), 1),
        (np.zeros((0, 4)), 1),
        (np.zeros((4, 4)), 0),
        (np.zeros((4, 4)), 31),
        (np.zeros((1, 1, 1, 1)), 1),
    ],
)
def test_bad_input_is_refused(image, levels):
    with pytest.raises(InputError):
        dwt2(image, levels=levels)
    with pytest.raises(InputError):
        idwt2(image, levels=levels)


def test_integers_are_transformed_as_numbers():
    image = np.random.default_rng(2).integers(0, 256, (9, 9), dtype=np.uint8)
    np.testing.assert_array_equal(dwt2(image), dwt2(image.astype(float)))
