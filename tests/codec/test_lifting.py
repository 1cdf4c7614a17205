"""Wavelets for coding: what goes in comes back, and each equals a plain twin or PyWavelets' filter bank."""

import numpy as np
import pytest
import pywt
from hypothesis import given
from hypothesis import strategies as st

from upholster.base.errors import InputError
from upholster.codec.haar import dwt2, level_shape
from upholster.codec.lifting import MAX_LEVELS, WAVELETS, band_norms, forward, inverse

SIDES = st.integers(1, 40)
each = pytest.mark.parametrize("wavelet", WAVELETS)


def samples(shape, wavelet, seed=0, most=30000):
    whole = np.random.default_rng(seed).integers(-most, most, shape).astype(np.int32)
    return whole + np.random.default_rng(seed).random(shape) if wavelet == "9/7" else whole


def mirrored(line, n):
    last = len(line) - 1
    n = abs(n)
    return line[last - abs(last - n) if last else 0]


def twin_line(line):
    """Lift one line, sample by sample: the definition."""
    line = list(line)
    if len(line) == 1:
        return line
    for n in range(1, len(line), 2):
        around = mirrored(line, n - 1) + mirrored(line, n + 1)
        line[n] -= around // 2
    for n in range(0, len(line), 2):
        line[n] += (mirrored(line, n - 1) + mirrored(line, n + 1) + 2) // 4
    return line[::2] + line[1::2]


def twin(image, levels):
    out = np.array(image)
    for level in range(levels):
        height, width = level_shape(out.shape, level)
        part = [twin_line([int(value) for value in row]) for row in out[:height, :width]]
        columns = [twin_line(column) for column in zip(*part, strict=True)]
        out[:height, :width] = np.array(columns).T
    return out


@given(
    st.sampled_from(list(WAVELETS)),
    SIDES,
    SIDES,
    st.integers(1, 4),
    st.integers(0, MAX_LEVELS),
    st.integers(0, 99),
)
def test_inverse_gives_the_image_back(wavelet, height, width, channels, levels, seed):
    image = samples((height, width, channels), wavelet, seed)
    kept = image.copy()
    coefficients = forward(image, wavelet=wavelet, levels=levels)
    back = inverse(coefficients, wavelet=wavelet, levels=levels)
    assert coefficients.shape == back.shape == image.shape
    assert coefficients.dtype == back.dtype == WAVELETS[wavelet]
    np.testing.assert_array_equal(image, kept)
    if wavelet == "9/7":
        np.testing.assert_allclose(back, image, rtol=0, atol=1e-7)
    else:
        np.testing.assert_array_equal(back, image)


@pytest.mark.parametrize("shape", [(1, 1), (1, 8), (7, 1), (2, 3), (16, 16), (13, 22), (37, 5)])
def test_the_integer_wavelet_equals_its_definition(shape):
    image = samples(shape, "5/3", 1)
    for levels in (1, 2, 5):
        np.testing.assert_array_equal(forward(image, wavelet="5/3", levels=levels), twin(image, levels))


@pytest.mark.parametrize("shape", [(16, 24, 3), (8, 8, 1), (13, 22, 1), (1, 5, 2), (37, 8, 1)])
def test_haar_is_orthonormal_with_the_last_row_twice(shape):
    image = samples(shape, "haar", 4)
    low = image
    for level in (1, 2, 3):
        height, width = low.shape[:2]
        rows, columns = level_shape(low.shape, 1)
        ours = forward(image, wavelet="haar", levels=level)
        whole = dwt2(np.pad(low, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge"), levels=1)
        np.testing.assert_array_equal(ours[:height, columns:width], whole[:height, columns:width])
        np.testing.assert_array_equal(ours[rows:height, :width], whole[rows:height, :width])
        low = ours[:rows, :columns]
        np.testing.assert_array_equal(low, whole[:rows, :columns])
        # No operation rounds: coefficients are multiples of 2^-level.
        np.testing.assert_array_equal(ours * 2**level, np.rint(ours * 2**level))


@pytest.mark.parametrize("shape", [(16, 16), (17, 23), (40, 12), (9, 64)])
def test_97_equals_pywavelets_filter_bank_to_the_borders(shape):
    image = samples(shape, "9/7", 2, 255)
    ours = forward(image, wavelet="9/7", levels=1)
    low, details = pywt.dwt2(image, "bior4.4", mode="reflect")  # mirrored at the outermost sample, as here
    (low_rows, low_columns), (rows, columns) = level_shape(shape, 1), (shape[0] // 2, shape[1] // 2)
    # The filter bank's output is longer by two at the start; its high-pass filter has the other sign.
    lh, hl, hh = details
    for mine, theirs, sign, size in (
        (ours[:low_rows, :low_columns], low, 1, (low_rows, low_columns)),
        (ours[:low_rows, low_columns:], hl, -1, (low_rows, columns)),
        (ours[low_rows:, :low_columns], lh, -1, (rows, low_columns)),
        (ours[low_rows:, low_columns:], hh, 1, (rows, columns)),
    ):
        np.testing.assert_allclose(mine, sign * theirs[2 : 2 + size[0], 2 : 2 + size[1]], atol=1e-9)


@each
def test_channels_are_transformed_on_their_own(wavelet):
    image = samples((21, 34, 3), wavelet, 3)
    together = forward(image, wavelet=wavelet, levels=3)
    for channel in range(3):
        np.testing.assert_array_equal(
            together[..., channel], forward(image[..., channel], wavelet=wavelet, levels=3)
        )
    np.testing.assert_array_equal(forward(np.asfortranarray(image), wavelet=wavelet, levels=3), together)
    backwards = image[::-1, ::-1]
    np.testing.assert_array_equal(
        forward(backwards, wavelet=wavelet, levels=3), forward(backwards.copy(), wavelet=wavelet, levels=3)
    )


def test_a_constant_has_no_details():
    for wavelet in WAVELETS:
        coefficients = forward(np.full((24, 20), 100), wavelet=wavelet, levels=2)
        details = coefficients.copy()
        details[:6, :5] = 0
        assert np.abs(details).max() < 1e-9
        expected = 100 if wavelet == "5/3" else 400
        np.testing.assert_allclose(coefficients[:6, :5], expected, rtol=1e-9)


@pytest.mark.parametrize("level", [1, 2, 3, 4])
def test_norms_of_97_are_those_of_its_synthesis_functions(level):
    size = 256
    middle = size // 2**level // 2
    low = level_shape((size, size), level)[0]
    for kind, norm in enumerate(band_norms("9/7", level)):
        unit = np.zeros((size, size))
        unit[middle + low * (kind >> 1), middle + low * (kind & 1)] = 1
        # To the four digits that the table, part of the format, has.
        assert np.linalg.norm(inverse(unit, wavelet="9/7", levels=level)) == pytest.approx(norm, abs=6e-5)


def test_norms_of_the_integer_wavelet_are_powers_of_two():
    wavelet = "5/3"
    for level in (1, 2, 3):
        low = 128 >> level
        for kind, norm in enumerate(band_norms(wavelet, level)):
            unit = np.zeros((128, 128), np.int32)
            unit[low // 2 + low * (kind >> 1), low // 2 + low * (kind & 1)] = 4096
            true = np.linalg.norm(inverse(unit, wavelet=wavelet, levels=level) / 4096)
            assert np.log2(norm) == round(np.log2(norm))
            assert norm / 1.6 < true < norm * 1.6
    assert band_norms(wavelet, 0) == (1, 1, 1, 1)


@pytest.mark.parametrize(
    ("image", "wavelet", "levels", "message"),
    [
        (np.zeros((4, 4)), "db4", 1, "unknown wavelet 'db4'"),
        (np.zeros((4, 4)), "9/7", 11, "levels is 11"),
        (np.zeros((4, 4)), "9/7", -1, "levels is -1"),
        (np.zeros(4), "9/7", 1, "shape"),
        (np.zeros((0, 4)), "9/7", 1, "shape"),
        (np.zeros((4, 4)), "5/3", 1, "for integers"),
    ],
)
@pytest.mark.parametrize("transform", [forward, inverse])
def test_what_does_not_fit_is_refused(transform, image, wavelet, levels, message):
    with pytest.raises(InputError, match=message):
        transform(image, wavelet=wavelet, levels=levels)
