"""The image header: packs and parses, and says where it is damaged before anything is allocated."""

import struct
import tracemalloc

import numpy as np
import pytest
from codec_images import coded_parts, textured

from upholster.base.errors import FormatError, InputError
from upholster.codec.ezw import MAGIC, decode
from upholster.codec.header import MAX_SAMPLES, ImageHeader
from upholster.codec.partial_image import ImageDecoder
from upholster.codec.tree import _built


def headers():
    for dtype in ("uint8", "uint16", "float32"):
        for channels in (1, 2, 3, 5):
            for wavelet in ("9/7", "5/3", "haar"):
                yield coded_parts(textured((9, 14, channels), dtype), wavelet=wavelet)[0]


def fixed(height=8, width=8, channels=1, kind=0, levels=2, plane=9, fineness=1):
    return struct.pack("<HHBBBBB", height, width, channels, kind, levels, plane, fineness)


@pytest.mark.slow(reason="codes many images, or large ones")
def test_parse_inverts_pack():
    for data in headers():
        header = ImageHeader.parse(data + b"stream")
        assert header.pack() == data
        assert header.length == len(data)
        assert (header.height, header.width) == (9, 14)
        assert header.exact == (header.wavelet != "9/7")


@pytest.mark.slow(reason="codes many images, or large ones")
def test_every_cut_header_says_how_many_bytes_are_missing():
    for data in headers():
        for length in range(len(data)):
            with pytest.raises(
                FormatError, match=r"^byte 7: the image header is cut; needs (at least )?\d+ more bytes$"
            ):
                ImageHeader.parse(data[:length], offset=7)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"height": 0}, "height is 0"),
        ({"width": 0}, "width is 0"),
        ({"channels": 0}, "channels is 0"),
        ({"channels": 65}, "channels is 65"),
        ({"kind": 3}, "wavelet is 3"),
        ({"kind": 3 << 2}, "colour transform is 3"),
        ({"kind": 3 << 4}, "depth is 3"),
        ({"kind": 15 << 4}, "depth is 15"),
        ({"levels": 11}, "levels is 11"),
        ({"plane": 25}, "first plane is 25"),
        ({"fineness": 8}, "fineness is 8"),
        ({"kind": 1 << 2}, "colour transform but 1 channels"),
        ({"kind": 1 << 2 | 1, "channels": 3}, "does not go with its wavelet"),
        ({"kind": 2 << 2 | 2, "channels": 3}, "does not go with its wavelet"),
        ({"kind": 2 << 2, "channels": 3}, "does not go with its wavelet"),
        ({"height": 65535, "width": 65535}, "samples is"),
        ({"height": 2000, "width": 2000}, f"samples is 4000000; allowed: 1 to {MAX_SAMPLES}"),
        ({"height": 65535, "channels": 48, "width": 1}, "asks for 23596996 places; allowed:"),
    ],
)
def test_values_outside_their_limits_are_format_errors(change, message):
    with pytest.raises(FormatError, match=message) as error:
        ImageHeader.parse(fixed(**change) + bytes(400), offset=12)
    assert str(error.value).startswith("byte 12: ")
    assert "\n" not in str(error.value)


def test_thresholds_lie_below_the_largest_magnitude():
    data = fixed(kind=2) + bytes(2) + struct.pack("<4I", 3, 9, 2**24, 0)
    with pytest.raises(FormatError, match=r"^byte 5: the image header's threshold is 16777216"):
        ImageHeader.parse(data, offset=5)
    header = ImageHeader.parse(fixed(kind=2) + bytes(2) + struct.pack("<4I", 3, 9, 0, 0))
    assert header.thresholds == (3, 9)


@pytest.mark.parametrize("values", [(np.nan, 1), (0, np.inf), (2, 1), (-np.inf, 0)])
def test_ranges_must_be_finite_and_rising(values):
    data = fixed(kind=2 << 4) + bytes(2) + struct.pack("<ff", *values)
    with pytest.raises(FormatError, match=r"^byte 11: the image header's range"):
        ImageHeader.parse(data)


def test_sizes_beyond_the_limit_are_refused_first():
    tracemalloc.start()
    try:
        for height, width, channels in ((65535, 65535, 64), (3000, 2001, 1), (65535, 92, 1)):
            with pytest.raises(FormatError, match="samples"):
                decode(MAGIC + fixed(height, width, channels) + bytes(1000))
        assert tracemalloc.get_traced_memory()[1] < 1e6
    finally:
        tracemalloc.stop()


@pytest.mark.slow(reason="codes many images, or large ones")
@pytest.mark.parametrize(
    ("shape", "haar"),
    [
        *(((1788, 1789, 1, 6), False), ((65535, 48, 1, 0), True), ((1032, 1032, 3, 6), True)),
        *(((1032, 1032, 3, 6), False), ((65535, 1, 16, 0), False), ((1, 65535, 3, 10), True)),
    ],
)
def test_the_largest_declared_images_take_less_than_256_mib(shape, haar):
    height, width, channels, levels = shape
    kind = 2 if haar else 1 << 2 if channels >= 3 else 0
    means = struct.pack(f"<{channels}H", *[100] * channels)
    header = ImageHeader.parse(fixed(height, width, channels, kind, levels) + means + bytes(18))
    _built.cache_clear()
    small = ImageDecoder(ImageHeader.parse(fixed(kind=kind & 2) + bytes(20)))
    small.feed(bytes(50))  # compiles
    small.image()
    tracemalloc.start()
    try:
        decoder = ImageDecoder(header)
        decoder.feed(bytes(50))
        decoder.image()
        assert tracemalloc.get_traced_memory()[1] < 2**28
    finally:
        tracemalloc.stop()
        _built.cache_clear()


def test_an_image_too_thin_for_its_channels_is_refused():
    with pytest.raises(InputError, match="too thin for 0 levels: 9,437,620 places"):
        coded_parts(np.zeros((65535, 1, 48), np.uint8))


@pytest.mark.parametrize(("version", "what"), [("0", "never released"), ("2", "a newer upholster reads it")])
def test_other_versions_are_refused_by_their_number(version, what):
    with pytest.raises(FormatError, match=f"byte 3: version is {version}; allowed: 1; .*{what}"):
        decode(b"EZW" + version.encode() + bytes(40))
