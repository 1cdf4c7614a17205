"""Images as ``.ezw`` files: magic, image header, embedded stream (SPEC.md, "Image files").

Any prefix that contains the header is a complete image; every further byte refines it.
"""

from dataclasses import dataclass

from upholster.base.errors import FormatError, InputError
from upholster.base.limits import Limits
from upholster.base.options.write_options import QUALITY, Quality
from upholster.base.types import PixelArray
from upholster.codec.header import ImageHeader
from upholster.codec.image_code import encode_parts
from upholster.codec.lifting import Wavelet
from upholster.codec.partial_image import ImageDecoder

__all__ = ["MAGIC", "DecodedImage", "decode", "encode"]

MAGIC = b"EZW1"
_LONGEST_HEADER = 256


def encode(
    image: PixelArray,
    *,
    most_bytes: int | None = None,
    bits_per_pixel: float | None = None,
    sample_quality: Quality | None = None,
    coefficients: float | None = None,
    wavelet: Wavelet | None = None,
    levels: int | None = None,
) -> bytes:
    """Encode an image as an embedded zerotree stream.

    Parameters
    ----------
    image
        (H, W) or (H, W, C), at most 3.2 million samples; uint8, uint16, or float32, which is stored as 16
        bits over its range.
    most_bytes
        The most bytes of the file.
    bits_per_pixel
        The same, per pixel.
    sample_quality
        Stop at this PSNR in dB; or "lossless". As for `encode_parts`.
    coefficients
        Stop when this share of all coefficients is significant, 0 to 1.
    wavelet, levels
        As for `encode_parts`.

    Returns
    -------
    bytes
        The file; at most one of the four limits may be given. Without a limit the quality is 46 dB.

    Raises
    ------
    InputError
        For an image or options out of range.

    References
    ----------
    Shapiro: Embedded image coding using zerotrees of wavelet coefficients, 1993.
    """
    pixels = image[:, :, None] if image.ndim == 2 else image
    limits = {
        "most_bytes": most_bytes,
        "bits_per_pixel": bits_per_pixel,
        "sample_quality": sample_quality,
        "coefficients": coefficients,
    }
    given = [name for name, value in limits.items() if value is not None]
    if len(given) > 1:
        raise InputError(f"{' and '.join(given)} are given; allowed: one of them")
    if bits_per_pixel is not None:
        if not 0 < bits_per_pixel <= 1000:
            raise InputError(f"bits_per_pixel is {bits_per_pixel}; allowed: above 0, to 1000")
        most_bytes = int(bits_per_pixel * pixels.shape[0] * pixels.shape[1] / 8)
    if most_bytes is not None and not 64 <= most_bytes < 2**32:
        raise InputError(f"bytes is {most_bytes}; allowed: at least 64")
    significant = None
    if coefficients is not None:
        if not 0 < coefficients <= 1:
            raise InputError(f"coefficients is {coefficients}; allowed: above 0, to 1")
        significant = max(1, round(coefficients * pixels.size))
    room = None if most_bytes is None else most_bytes - len(MAGIC)
    coded = encode_parts(
        pixels,
        wavelet=wavelet,
        levels=levels,
        sample_quality=sample_quality if given else QUALITY,
        most_bytes=room,
        most_significant=significant,
    )
    return MAGIC + coded.header + coded.payload


@dataclass(frozen=True)
class DecodedImage:
    """The content of a file, or of a prefix of one.

    Attributes
    ----------
    image
        (H, W, C) of the original's dtype.
    header
        The image's header.
    complete
        Whether all bytes are there.
    significant
        Share of the coefficients that are significant so far, 0 to 1.
    used
        Number of bytes of the file that were read.
    """

    image: PixelArray
    header: ImageHeader
    complete: bool
    significant: float
    used: int


def decode(
    data: bytes,
    *,
    most_bytes: int | None = None,
    coefficients: float | None = None,
    limits: Limits | None = None,
) -> DecodedImage:
    """Decode a file of `encode`, or any prefix of it.

    Parameters
    ----------
    data
        The file's bytes.
    most_bytes
        Use at most this many bytes.
    coefficients
        Stop when this share of the coefficients is significant, 0 to 1.
    limits
        The most samples; by default as many as the format allows.

    Raises
    ------
    FormatError
        If it is no such file, has more samples than the limits, or is cut before its header ends; the message
        then gives the number of missing bytes.
    InputError
        For options out of range.
    """
    if most_bytes is not None and most_bytes < 1:
        raise InputError(f"bytes is {most_bytes}; allowed: at least 1")
    if coefficients is not None and not 0 < coefficients <= 1:
        raise InputError(f"coefficients is {coefficients}; allowed: above 0, to 1")
    data = data[:most_bytes]
    if data[:3] == MAGIC[:3] and data[3:4].isdigit() and data[3:4] != MAGIC[3:]:
        who = "a newer upholster reads it" if data[3:4] > MAGIC[3:] else "it was never released: re-encode it"
        raise FormatError(f"byte 3: version is {chr(data[3])}; allowed: {chr(MAGIC[3])}; {who}")
    if data[: len(MAGIC)] != MAGIC[: len(data)]:
        raise FormatError("byte 0: this is not an .ezw file (its first bytes are not EZW1)")
    if len(data) < len(MAGIC):
        raise FormatError(
            f"byte {len(data)}: the file is cut in its magic; needs {len(MAGIC) - len(data)} more bytes"
        )
    header = ImageHeader.parse(data[len(MAGIC) : len(MAGIC) + _LONGEST_HEADER], offset=len(MAGIC))
    samples = header.height * header.width * header.channels
    (limits or Limits()).check(f"byte {len(MAGIC)}: the image has", "samples", samples)
    start = len(MAGIC) + header.length
    decoder = ImageDecoder(header)
    if coefficients is None:
        decoder.feed(data[start:])
    else:
        wanted = coefficients * decoder.coefficients
        while start + decoder.received < len(data) and decoder.significant < wanted:
            place = start + decoder.received
            # Near the end byte by byte: hardly any byte codes 64 coefficients.
            decoder.feed(data[place : place + max(1, int(wanted - decoder.significant) // 64)])
    if decoder.unread:
        raise FormatError(f"byte {len(data) - decoder.unread}: {decoder.unread} bytes too many")
    share = decoder.significant / decoder.coefficients
    return DecodedImage(decoder.image(), header, decoder.complete, share, start + decoder.received)
