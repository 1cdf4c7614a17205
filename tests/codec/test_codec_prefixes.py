"""Any prefix decodes, to what its bytes determine and no more; how the bytes arrive makes no difference."""

import numpy as np
import pytest
from codec_images import coded_parts, decoder_of, psnr, textured

from upholster.codec._coder_kernels import NEGATIVE, PLANE, SIGNIFICANT
from upholster.codec._model_kernels import WEIGHTS
from upholster.codec.header import ImageHeader
from upholster.codec.partial_image import ImageDecoder
from upholster.codec.tree import FLAGS

IMAGES = {
    "grey": (textured((40, 52, 1)), {}),
    "lossless": (textured((33, 31, 3)), {"sample_quality": "lossless"}),
    "haar 16 bits": (textured((24, 40, 2), "uint16"), {"wavelet": "haar", "levels": 3}),
    "float": (textured((16, 16, 4), "float32"), {}),
}
each = pytest.mark.parametrize("name", IMAGES)


def coded(name):
    image, options = IMAGES[name]
    return image, *coded_parts(image, **options)


def memory(decoder):
    inner = decoder._coefficients
    values = np.concatenate([inner.values(band).reshape(-1) for band in inner.tree.bands])
    return inner._memory.state, inner._memory.m, inner._memory.a[WEIGHTS:], values


@each
def test_bytes_one_by_one_give_the_same_state(name):
    _, header, payload = coded(name)
    payload = payload[:3000]
    whole, single, chunks = decoder_of(header, payload), decoder_of(header), decoder_of(header)
    for byte in payload:
        single.feed(bytes([byte]))
    rng, place = np.random.default_rng(3), 0
    while place < len(payload):
        size = int(rng.integers(0, 40))
        chunks.feed(payload[place : place + size])
        place += size
    assert single.received == chunks.received == whole.received == len(payload)
    for other in (single, chunks):
        for mine, theirs in zip(memory(whole), memory(other), strict=True):
            np.testing.assert_array_equal(mine, theirs)
        np.testing.assert_array_equal(whole.image(), other.image())


@each
def test_every_prefix_decodes_and_says_that_it_is_incomplete(name):
    image, header, payload = coded(name)
    decoder = decoder_of(header)
    assert decoder.image().shape == image.shape
    known = 0
    for length, byte in enumerate(payload[:1500], 1):
        assert not decoder.complete
        decoder.feed(bytes([byte]))
        assert known <= decoder.significant
        known = decoder.significant
        if length < 40 or length % 97 == 0:
            picture = decoder.image()
            assert (picture.shape, picture.dtype) == (image.shape, image.dtype)
            assert np.isfinite(picture).all()


@pytest.mark.slow(reason="codes many images, or large ones")
@each
def test_no_symbol_is_taken_that_the_bytes_present_do_not_determine(name):
    _, header, payload = coded(name)
    rng = np.random.default_rng(5)
    for length in [*range(12), *rng.integers(12, min(len(payload), 2500), 12)]:
        cut = decoder_of(header, payload[:length])
        known = cut._coefficients.magnitudes()
        plane, flags = int(cut._coefficients._state[PLANE]), cut._coefficients._memory.m[FLAGS]
        for tail in (
            bytes(400),
            b"\xff" * 400,
            rng.bytes(400),
            rng.bytes(400),
            payload[length : length + 400],
        ):
            longer = decoder_of(header, payload[:length] + tail)
            later = longer._coefficients.magnitudes()
            sure = known != 0
            # What is known stays, sign and bits; only lower bits may join.
            np.testing.assert_array_equal(np.sign(later[sure]), np.sign(known[sure]))
            assert (np.abs(later[sure]) & np.abs(known[sure]) == np.abs(known[sure])).all()
            assert (np.abs(later[sure]) - np.abs(known[sure]) < 2 << plane).all()
            # And every significance and sign that all continuations share was there to take only if coded.
            later_flags = longer._coefficients._memory.m[FLAGS]
            both = SIGNIFICANT | NEGATIVE
            np.testing.assert_array_equal(later_flags[sure] & both, flags[sure] & both)


@pytest.mark.parametrize("name", ["grey", "lossless"])
def test_the_decoder_takes_every_symbol_that_the_bytes_determine(name):
    # With three bytes more at most, everything that the encoder had coded at a length is known.
    image, options = IMAGES[name]
    for size in (150, 400, 900):
        header, payload = coded_parts(image, **{**options, "most_significant": size})
        short = decoder_of(header, payload[:-4])
        assert size - 40 <= short.significant <= size
        assert decoder_of(header, payload).significant >= size


@pytest.mark.slow(reason="codes many images, or large ones")
@pytest.mark.parametrize(
    ("shape", "options"),
    [
        ((64, 72, 3), {}),
        ((120, 100, 1), {}),
        ((64, 64, 3), {"sample_quality": "lossless"}),
        ((64, 80, 1), {"wavelet": "haar"}),
    ],
)
def test_quality_never_falls_as_bytes_are_added(shape, options):
    image = textured(shape, seed=4)
    header, payload = coded_parts(image, **options)
    lengths = np.unique(np.random.default_rng(6).integers(20, len(payload) + 1, 80))
    decoder, best, fed, values = ImageDecoder(ImageHeader.parse(header)), 0.0, 0, []
    for length in lengths:
        decoder.feed(payload[fed:length])
        fed = int(length)
        values.append(psnr(decoder.image(), image))
        assert values[-1] > best - 0.05
        best = max(best, values[-1])
    assert values[-1] > values[0] + 15


def test_work_is_proportional_to_the_new_bytes():
    # Not measured by the clock: a decoder that is complete, or gets nothing, leaves its state as it is.
    _, header, payload = coded("lossless")
    decoder = decoder_of(header, payload)
    assert decoder.complete
    before = decoder._coefficients._memory.a.copy()
    decoder.feed(b"more")
    np.testing.assert_array_equal(decoder._coefficients._memory.a, before)
    half = decoder_of(header, payload[: len(payload) // 2])
    state = half._coefficients._state.copy()
    half.feed(b"")
    np.testing.assert_array_equal(half._coefficients._state, state)


def test_compression_does_not_get_worse():
    # A gate on compression: figures of this version, a little loosened.
    image = textured((128, 128, 3), seed=9)
    header, payload = coded_parts(image, most_bytes=4096)
    assert psnr(decoder_of(header, payload).image(), image) > 28.97
    header, payload = coded_parts(image, sample_quality="lossless")
    assert len(payload) < 35450
