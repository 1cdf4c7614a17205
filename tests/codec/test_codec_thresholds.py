"""The paper's profile: at a share of the coefficients the largest ones of the Haar transform are kept."""

import numpy as np
import pytest
from codec_images import coded_parts, decoder_of, textured
from hypothesis import given
from hypothesis import strategies as st

from upholster.codec.haar import dwt2
from upholster.codec.header import ImageHeader
from upholster.codec.thresholds import SHARES, from_coded, share_thresholds, to_coded

KNOTS = st.lists(st.integers(1, 2**20), max_size=4)


@given(KNOTS, st.integers(0, 99))
def test_coded_numbers_keep_order_sign_and_value(thresholds, seed):
    rng = np.random.default_rng(seed)
    around = np.array([step + t for t in thresholds for step in (-1, 0, 1)], np.int64)
    values = np.concatenate([np.arange(-40, 40), rng.integers(-(2**19), 2**19, 200), around, -around])
    coded = to_coded(values, thresholds)
    np.testing.assert_array_equal(from_coded(coded.astype(float), thresholds), values)
    order = np.argsort(values, kind="stable")
    assert (np.diff(coded[order]) >= 0).all()
    # A threshold is where a plane begins.
    np.testing.assert_array_equal(np.abs(to_coded(np.array(thresholds), thresholds)).astype(float) % 1, 0)
    for threshold in thresholds:
        plane = int(to_coded(np.array([threshold]), thresholds)[0])
        assert plane & (plane - 1) == 0


def test_without_thresholds_the_coded_numbers_are_the_values():
    values = np.arange(-3000, 3000)
    np.testing.assert_array_equal(to_coded(values, ()), values)


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("channels", [1, 3])
def test_at_the_papers_shares_the_largest_are_kept(share, channels):
    image = textured((64, 72, channels), seed=5)
    header, payload = coded_parts(image, wavelet="haar")
    thresholds = ImageHeader.parse(header).thresholds
    assert len(thresholds) <= len(SHARES)
    decoder, wanted = decoder_of(header), round(share * image.size)
    for byte in payload:
        if decoder.significant >= wanted:
            break
        decoder.feed(bytes([byte]))
    exact = dwt2(image)
    magnitudes = np.trunc(2 * np.abs(exact))  # in halves, as they are coded
    threshold = share_thresholds(magnitudes)[::-1][SHARES.index(share)]
    known = haar_of(decoder)
    # All that reach the threshold, and of those one step below as many as make the share full: some bytes may
    # tell of a few more.
    assert (known != 0)[magnitudes >= threshold].all()
    assert 0 <= wanted - (magnitudes >= threshold).sum() <= (magnitudes == threshold - 1).sum()
    assert wanted <= (known != 0).sum() <= wanted + 8
    # What is kept is known to within the threshold, and has its sign.
    assert np.abs(known - exact)[known != 0].max() <= threshold / 2


def haar_of(decoder):
    """What a decoder knows of the coefficients, nested."""
    from upholster.codec.partial_image import window

    header = decoder.header
    found = np.zeros((header.height, header.width, header.channels))
    for band in decoder._coefficients.tree.bands:
        values = from_coded(decoder._coefficients.values(band), header.thresholds) / 2
        found[window(band, header.height, header.width)] = values
    return found


def test_before_anything_is_known_the_picture_is_the_mean():
    image = textured((40, 24, 3))
    header, payload = coded_parts(image, wavelet="haar")
    means = np.rint(image.mean(axis=(0, 1)))
    np.testing.assert_array_equal(decoder_of(header).image(), np.broadcast_to(means, image.shape))
    # And nothing that has come makes it much worse.
    errors = [
        np.abs(decoder_of(header, payload[:n]).image() - image.astype(float)).mean() for n in range(120)
    ]
    assert max(errors) < 1.2 * errors[0]
