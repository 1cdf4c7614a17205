"""What comes back is what went in: exactly, within 1, or within the step of a float's range."""

import numpy as np
import pytest
from codec_images import coded_parts, round_trip, textured
from hypothesis import example, given, settings
from hypothesis import strategies as st

from upholster.base.errors import InputError
from upholster.codec.header import MAX_SAMPLES

SIDES = st.one_of(st.integers(1, 9), st.integers(10, 70))
DTYPES = st.sampled_from(["uint8", "uint16", "float32"])


@st.composite
def images(draw, dtypes=DTYPES, sides=SIDES):
    shape = (draw(sides), draw(sides), draw(st.integers(1, 5)))
    dtype = draw(dtypes)
    picture = textured(shape, dtype, draw(st.integers(0, 99)))
    if draw(st.booleans()):
        return picture
    # Noise, extremes only, or one colour.
    rng, kind = (
        np.random.default_rng(draw(st.integers(0, 99))),
        draw(st.sampled_from(["noise", "extremes", "flat"])),
    )
    samples = {
        "noise": rng.random(shape),
        "extremes": rng.integers(0, 2, shape),
        "flat": np.full(shape, 0.3),
    }[kind]
    return (samples * (1.0 if dtype == "float32" else np.iinfo(dtype).max)).astype(dtype)


def step(image):
    return (float(image.max()) - float(image.min())) / 65535 + 1e-6 * float(np.abs(image).max())


@given(images(), st.sampled_from(["5/3", "haar"]), st.integers(0, 6))
def test_reversible_wavelets_lose_nothing(image, wavelet, levels):
    back = round_trip(image, wavelet=wavelet, levels=levels)
    assert back.dtype == image.dtype
    assert back.shape == image.shape
    if image.dtype == np.float32:
        assert np.abs(back - image).max() <= 0.51 * step(image)
    else:
        np.testing.assert_array_equal(back, image)


@pytest.mark.slow(reason="codes many images, or large ones")
@given(images(), st.one_of(st.none(), st.integers(0, 10)))
def test_the_ordinary_profile_ends_within_one(image, levels):
    back = round_trip(image, levels=levels)
    assert back.dtype == image.dtype
    if image.dtype == np.float32:
        assert np.abs(back - image).max() <= 1.51 * step(image)
    else:
        assert np.abs(back.astype(int) - image).max() <= 1


@pytest.mark.slow(reason="codes many images, or large ones")
@settings(max_examples=4, deadline=None)
@given(st.integers(100, 300), st.integers(100, 300), st.integers(1, 3), st.booleans())
@example(300, 300, 1, True)
@example(1, 300, 3, False)
def test_larger_and_thin_images_come_back(height, width, channels, lossless):
    image = textured((height, width, channels))
    back = round_trip(image, sample_quality="lossless" if lossless else None)
    assert np.abs(back.astype(int) - image).max() <= (0 if lossless else 1)


@pytest.mark.slow(reason="codes many images, or large ones")
@pytest.mark.parametrize("wavelet", ["9/7", "5/3", "haar"])
@pytest.mark.parametrize("size", [64, 200, 1000])
def test_no_more_bytes_than_allowed(wavelet, size):
    image = textured((40, 50, 3))
    header, payload = coded_parts(image, wavelet=wavelet, most_bytes=size)
    longer = coded_parts(image, wavelet=wavelet, most_bytes=4000)
    assert size - 8 <= len(header) + len(payload) <= size
    assert header == longer[0]
    assert payload == longer[1][: len(payload)]


def test_a_share_of_significant_coefficients_stops_the_encoder():
    from codec_images import decoder_of

    image = textured((64, 64, 3))
    for share in (1, 50, 700):
        assert decoder_of(*coded_parts(image, most_significant=share)).significant == share


def test_the_default_levels_hold_16_bit_extremes():
    image = np.full((64, 64, 3), 65535, np.uint16)
    np.testing.assert_array_equal(round_trip(image, sample_quality="lossless", levels=6), image)
    with pytest.raises(InputError, match=r"levels is 10.*16-bit"):
        coded_parts(image, sample_quality="lossless", levels=10)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"wavelet": "9/8"}, "unknown wavelet"),
        ({"wavelet": "9/7", "sample_quality": "lossless"}, "wavelet is 9/7"),
        ({"levels": 11}, "levels is 11"),
        ({"levels": -1}, "levels is -1"),
    ],
)
def test_options_that_do_not_fit_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        coded_parts(textured((8, 8, 1)), **change)


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (np.zeros((8, 8), np.uint8), "shape"),
        (np.zeros((0, 8, 1), np.uint8), "shape"),
        (np.zeros((2, 2, 65), np.uint8), "shape"),
        (np.zeros((2, 2, 1), np.float64), "float64"),
        (np.zeros((2, 2, 1), np.int32), "int32"),
        (np.full((2, 2, 1), np.nan, np.float32), "allowed: finite"),
        (np.array([1, np.inf], np.float32).reshape(2, 1, 1), "allowed: finite"),
        (np.broadcast_to(np.uint8(0), (65536, 1, 1)), "65535"),
        (np.broadcast_to(np.uint8(0), (MAX_SAMPLES // 60, 61, 1)), "samples"),
    ],
)
def test_images_that_do_not_fit_are_refused(image, message):
    with pytest.raises(InputError, match=message):
        coded_parts(image)
