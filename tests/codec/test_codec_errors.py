"""The errors that the encoder records are those of decoding so many bytes, and a stream ends by them."""

import math

import numpy as np
import pytest
from codec_images import decoder_of, psnr, textured

from upholster.base.errors import InputError
from upholster.codec.image_code import encode_parts


@pytest.mark.slow(reason="codes many images, or large ones")
@pytest.mark.parametrize("wavelet", ["9/7", "5/3", "haar"])
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_recorded_errors_are_those_of_prefixes(wavelet, dtype):
    image = textured((61, 50, 3), dtype, seed=3)
    coded = encode_parts(image, wavelet=wavelet)
    best = decoder_of(coded.header, coded.payload).integers() if dtype == "float32" else image
    assert coded.lengths[0] == 0
    assert coded.lengths[-1] == len(coded.payload)
    for length, error in zip(coded.lengths, coded.errors, strict=True):
        found = np.mean(
            (decoder_of(coded.header, coded.payload[:length]).integers() - best.astype(float)) ** 2
        )
        # A decoder lacks the last few bits; of floats the best that is known lacks up to a half.
        assert error == pytest.approx(found, rel=0.02, abs=1 if dtype == "float32" else 1e-9)
        assert coded.error(length) == error


@pytest.mark.slow(reason="codes many images, or large ones")
@pytest.mark.parametrize("wavelet", ["9/7", "5/3", "haar"])
@pytest.mark.parametrize("quality", [20, 33, 46.0])
def test_a_stream_ends_where_its_quality_is_reached(wavelet, quality):
    image = textured((64, 60, 3), seed=5)
    coded = encode_parts(image, wavelet=wavelet, sample_quality=quality)
    assert coded.psnr(len(coded.payload)) >= quality
    assert psnr(decoder_of(coded.header, coded.payload).image(), image) == pytest.approx(
        coded.psnr(len(coded.payload)), abs=0.05
    )
    # It is the start of the whole stream, and a length before, 4 % and some bits, would not do.
    whole = encode_parts(image, wavelet=wavelet)
    assert whole.payload.startswith(coded.payload)
    assert coded.psnr(coded.lengths[-2]) < quality


def test_floats_end_later_for_they_are_linear():
    image = textured((64, 60, 1), "uint16", seed=5)
    image[0, :2, 0] = 0, 65535
    linear = (image / 65535).astype(np.float32)
    one = encode_parts(image, sample_quality=40 + 20 * math.log10(12.92))
    other = encode_parts(linear, sample_quality=40)
    assert one.payload == other.payload
    assert 40 <= other.psnr(len(other.payload)) < one.psnr(len(one.payload)) - 22


def test_lossless_loses_nothing_and_bytes_end_it_earlier():
    image = textured((40, 44, 3), seed=6)
    coded = encode_parts(image, sample_quality="lossless")
    assert coded.psnr(len(coded.payload)) == math.inf
    short = encode_parts(image, sample_quality=46, most_bytes=600)
    assert len(short.header) + len(short.payload) == 600
    assert short.psnr(len(short.payload)) < 46


@pytest.mark.parametrize("quality", [19.9, 80.5, math.nan, "best", True, "", [46]])
def test_other_qualities_are_refused(quality):
    with pytest.raises(InputError, match=r"sample_quality is .*; allowed: 20 to 80 \(dB\), or lossless"):
        encode_parts(textured((8, 8, 1)), sample_quality=quality)
