"""Limits of reading a stream: in bytes, bits per exemplar pixel, or as a share of the coefficients."""

from dataclasses import dataclass

from upholster.base.errors import InputError
from upholster.codec.stream.reader import StreamDecoder

__all__ = ["Limit", "feed_until"]

_PARTS = 400


@dataclass(frozen=True, slots=True)
class Limit:
    """Where to stop reading; without a limit, the whole stream is read.

    Attributes
    ----------
    most_bytes
        Number of bytes of the stream, at least 1.
    bits_per_pixel
        The same, in bits per pixel of the exemplar, above 0.
    coefficients
        Share of the exemplar's coefficients that are significant, above 0, at most 1. It includes all
        placements and labels: the stream is read until they are known, but the exemplar only up to this
        share.

    Raises
    ------
    InputError
        If more than one limit is given, or one is out of range.
    """

    most_bytes: int | None = None
    bits_per_pixel: float | None = None
    coefficients: float | None = None

    def __post_init__(self) -> None:
        values = {"bytes": self.most_bytes, "bpp": self.bits_per_pixel, "coefficients": self.coefficients}
        given = [name for name, value in values.items() if value is not None]
        if len(given) > 1:
            raise InputError(f"{' and '.join(given)} are given; allowed: one of them")
        if self.most_bytes is not None and self.most_bytes < 1:
            raise InputError(f"bytes is {self.most_bytes}; allowed: at least 1")
        if self.bits_per_pixel is not None and not 0 < self.bits_per_pixel < 1e6:
            raise InputError(f"bpp is {self.bits_per_pixel:g}; allowed: above 0")
        if self.coefficients is not None and not 0 < self.coefficients <= 1:
            raise InputError(f"coefficients is {self.coefficients:g}; allowed: above 0, at most 1")

    def reached(self, decoder: StreamDecoder) -> bool:
        """Whether a decoder that can show something has reached the limit."""
        if self.most_bytes is not None:
            return decoder.received >= self.most_bytes
        if self.bits_per_pixel is not None:
            height, width, _ = decoder.exemplar_shape
            return 8 * decoder.received >= self.bits_per_pixel * height * width
        if self.coefficients is None or self.coefficients == 1:
            return False
        known, count = decoder.coefficients_known
        return known >= self.coefficients * count and decoder.placements_complete


def feed_until(decoder: StreamDecoder, data: bytes, limit: Limit) -> None:
    """Feed a decoder with the bytes of `data` that follow those it has, until a limit is reached.

    A limit in coefficients is met to the byte of the exemplar; the stream is read in parts of 1/400. A limit
    below the first view is exceeded.

    Raises
    ------
    FormatError
        If the stream is damaged.
    """
    decoder.limit_coefficients(None if limit.coefficients == 1 else limit.coefficients)
    part = max(16, len(data) // _PARTS)
    while decoder.received < len(data) and (decoder.needed or not limit.reached(decoder)):
        taken = decoder.received
        size = decoder.needed or part
        if limit.most_bytes is not None and not decoder.needed:
            size = limit.most_bytes - taken
        decoder.feed(data[taken : taken + size])
