"""A decoder takes only so many bits of a stream as go with its bytes (SPEC.md, section 9)."""

from typing import Any

import numpy as np
import pytest
from codec_images import coded_parts

from upholster.codec._coder_kernels import SYMBOLS
from upholster.codec.ezw import decode, encode
from upholster.codec.header import ImageHeader
from upholster.codec.partial_image import ImageDecoder

SIDE = 256


def woven() -> Any:
    """An image that repeats itself exactly: a byte of its stream tells of more than a thousand bits."""
    i, j = np.mgrid[:SIDE, :SIDE]
    return np.stack([(i + j) % 2 * 255, i % 2 * 255, j % 2 * 255], axis=2).astype(np.uint8)


def symbols(decoder: Any) -> int:
    return int(decoder._coefficients._memory.state[SYMBOLS])


def most(count: int) -> int:
    """Bits that go with so many bytes of the stream of `woven`."""
    return min(3 * SIDE * SIDE, 1024 * count) + 2**16 + 128 * count


@pytest.mark.parametrize("byte", [0, 255])
def test_bytes_alike_give_no_more_bits_than_go_with_them(byte: int) -> None:
    header = ImageHeader(SIDE, SIDE, 3, np.dtype(np.uint8), "5/3", 6, 23, ycocg=True, means=(128, 128, 128))
    at_once, one_by_one = ImageDecoder(header), ImageDecoder(header)
    at_once.feed(bytes([byte]) * 150)
    for n in range(150):
        one_by_one.feed(bytes([byte]))
        assert symbols(one_by_one) <= most(n + 1)
    assert symbols(at_once) == symbols(one_by_one) == most(150)
    np.testing.assert_array_equal(at_once.image(), one_by_one.image())


@pytest.mark.slow(reason="codes many images, or large ones")
def test_a_stream_of_many_bits_is_made_longer_by_zeros() -> None:
    image = woven()
    header, payload = coded_parts(image, wavelet="haar", sample_quality="lossless")
    decoder = ImageDecoder(ImageHeader.parse(header))
    decoder.feed(payload[:-1])
    assert not decoder.complete
    assert payload.endswith(bytes(16))
    decoder.feed(payload[-1:])
    assert decoder.complete
    assert decoder.unread == 0
    assert most(len(payload) - 1) < symbols(decoder) <= most(len(payload))
    np.testing.assert_array_equal(
        decode(encode(image, wavelet="haar", sample_quality="lossless")).image, image
    )
