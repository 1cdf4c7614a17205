"""Images and short cuts that the codec's tests share."""

import numpy as np

from upholster.codec.header import ImageHeader
from upholster.codec.image_code import encode_parts
from upholster.codec.partial_image import ImageDecoder


def textured(shape, dtype="uint8", seed=0):
    """A smooth random picture with some noise, over most of the dtype's range."""
    rng = np.random.default_rng(seed)
    height, width, channels = shape
    rows, columns = np.mgrid[:height, :width, :1][:2]
    picture = rng.normal(0, 0.04, shape)
    for _ in range(4):
        frequency, phase = rng.uniform(-0.4, 0.4, 2), rng.uniform(0, 6.3, channels)
        picture += 0.12 * np.sin(rows * frequency[0] + columns * frequency[1] + phase)
    picture = np.clip(picture + 0.5, 0, 1)
    if dtype == "float32":
        return (picture * 7 - 3).astype(np.float32)
    return np.rint(picture * np.iinfo(dtype).max).astype(dtype)


def decoder_of(header, payload=b""):
    """A decoder that was fed `payload`."""
    decoder = ImageDecoder(ImageHeader.parse(header))
    decoder.feed(payload)
    return decoder


def round_trip(image, **options):
    """The image after encoding and decoding."""
    return decoder_of(*coded_parts(image, **options)).image()


def coded_parts(image, **options):
    """Header and stream."""
    coded = encode_parts(image, **options)
    return coded.header, coded.payload


def psnr(one, other, peak=255):
    error = np.mean((one.astype(np.float64) - other) ** 2)
    return 10 * np.log10(peak**2 / max(error, 1e-12))
