"""The data that a decoder needs before the first coded bit: shape, depth, transforms, first plane."""

import struct
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError
from upholster.base.types import MAX_SAMPLE
from upholster.codec.lifting import MAX_LEVELS, Wavelet
from upholster.codec.tree import tree_size

__all__ = ["MAX_PLACES", "MAX_SAMPLES", "MOST_THRESHOLDS", "ImageHeader"]

MAX_SAMPLES = 3_200_000
"""Limit of height × width × channels: a decoder allocates less than 256 MiB, however small the file."""

MAX_PLACES = 3_300_000
"""The same limit including the padding of each band of each channel."""

MOST_THRESHOLDS = 4
"""The most thresholds of passes in a header of "haar"."""

_WAVELETS: tuple[Wavelet, ...] = ("9/7", "5/3", "haar")
_KLT, _YCOCG = 1, 2
_DTYPES = (np.uint8, np.uint16, np.float32)
_FIXED = struct.Struct("<HHBBBBB")


@dataclass(frozen=True)
class ImageHeader:
    """Header of a coded image.

    Attributes
    ----------
    height, width, channels
        Shape.
    dtype
        uint8, uint16, or float32, which is coded as 16-bit integers between `low` and `high`.
    wavelet, levels
        The transform: "9/7" (ordinary), "5/3" (lossless) or "haar" (the paper's, lossless too).
    plane
        The first plane coded, -1 to 23.
    fineness
        "9/7", "haar": coefficients are coded as multiples of 2^-fineness, 0 to 7.
    matrix
        KLT of the first three channels, (3, 3) int16 in 1/16384, or None.
    ycocg
        Whether the first three channels are coded as YCoCg-R.
    means
        Integers subtracted from each channel; for "haar" the expected values, which are not subtracted.
    thresholds
        "haar": magnitudes in 2^-fineness at which a pass ends, besides the powers of two; up to four.
    low, high
        Range of float samples.
    """

    height: int
    width: int
    channels: int
    dtype: np.dtype[np.generic]
    wavelet: Wavelet
    levels: int
    plane: int
    fineness: int = 0
    matrix: NDArray[np.int16] | None = None
    ycocg: bool = False
    means: tuple[int, ...] = field(default_factory=tuple)
    low: float = 0.0
    high: float = 1.0
    thresholds: tuple[int, ...] = ()

    @property
    def length(self) -> int:
        """Length of the header in bytes."""
        return len(self.pack())

    @property
    def exact(self) -> bool:
        """Whether the complete stream restores every sample exactly."""
        return self.wavelet != "9/7"

    def pack(self) -> bytes:
        """Return the header as bytes."""
        color = _KLT if self.matrix is not None else _YCOCG if self.ycocg else 0
        depth = [np.dtype(d) for d in _DTYPES].index(self.dtype)
        kind = _WAVELETS.index(self.wavelet) | color << 2 | depth << 4
        parts = [
            _FIXED.pack(
                self.height, self.width, self.channels, kind, self.levels, self.plane + 1, self.fineness
            ),
            struct.pack(f"<{self.channels}H", *self.means),
        ]
        if self.matrix is not None:
            parts.append(self.matrix.astype("<i2").tobytes())
        if self.wavelet == "haar":
            parts.append(
                struct.pack("<4I", *self.thresholds, *[0] * (MOST_THRESHOLDS - len(self.thresholds)))
            )
        if self.dtype == np.float32:
            parts.append(struct.pack("<ff", self.low, self.high))
        return b"".join(parts)

    @classmethod
    def parse(cls, data: bytes, *, offset: int = 0) -> "ImageHeader":
        """Read a header from the start of `data`.

        Parameters
        ----------
        data
            At least the header's bytes.
        offset
            Position of `data` in its file, for messages.

        Raises
        ------
        FormatError
            If it is cut, or a value is outside its limits.
        """
        if len(data) < _FIXED.size:
            raise _fault(
                offset, f"the image header is cut; needs at least {_FIXED.size - len(data)} more bytes"
            )
        height, width, channels, kind, levels, plane, fineness = _FIXED.unpack_from(data)
        wavelet, color, depth = kind & 3, kind >> 2 & 3, kind >> 4
        _check_ranges(
            offset,
            ("height", height, 1, 65535),
            ("width", width, 1, 65535),
            ("channels", channels, 1, 64),
            ("wavelet", wavelet, 0, 2),
            ("colour transform", color, 0, 2),
            ("depth", depth, 0, 2),
            ("levels", levels, 0, MAX_LEVELS),
            ("first plane", plane, 0, 24),
            ("fineness", fineness, 0, 7),
            ("samples", height * width * channels, 1, MAX_SAMPLES),
        )
        if (places := tree_size(height, width, channels, levels)) > MAX_PLACES:
            raise _fault(offset, f"the image header asks for {places} places; allowed: {MAX_PLACES}")
        _check_color(offset, color, wavelet, channels)
        size = _FIXED.size + 2 * channels + (18 if color == _KLT else 0) + (8 if depth == 2 else 0)
        haar = _WAVELETS[wavelet] == "haar"
        size += 4 * MOST_THRESHOLDS if haar else 0
        if len(data) < size:
            raise _fault(offset, f"the image header is cut; needs {size - len(data)} more bytes")
        place = _FIXED.size
        means = struct.unpack_from(f"<{channels}H", data, place)
        place += 2 * channels
        matrix = None
        if color == _KLT:
            matrix = np.frombuffer(data, "<i2", 9, place).astype(np.int16).reshape(3, 3)
            place += 18
        thresholds: tuple[int, ...] = ()
        if haar:
            thresholds = struct.unpack_from("<4I", data, place)
            place += 4 * MOST_THRESHOLDS
            _check_ranges(offset, *(("threshold", value, 0, 2**24 - 1) for value in thresholds))
        low, high = struct.unpack_from("<ff", data, place) if depth == 2 else (0.0, 1.0)
        if not -MAX_SAMPLE <= low <= high <= MAX_SAMPLE:  # false for NaN as well
            raise _fault(
                offset + place,
                f"the image header's range is {low}, {high}; allowed: rising, within ±{MAX_SAMPLE:.0f}",
            )
        return cls(
            height,
            width,
            channels,
            np.dtype(_DTYPES[depth]),
            _WAVELETS[wavelet],
            levels,
            plane - 1,
            fineness,
            matrix,
            color == _YCOCG,
            means,
            low,
            high,
            tuple(value for value in thresholds if value > 0),
        )


def _check_ranges(offset: int, *fields: tuple[str, int, int, int]) -> None:
    """Raise FormatError unless each value, given by (name, value, least, most), is in its range."""
    for name, value, least, most in fields:
        if not least <= value <= most:
            raise _fault(offset, f"the image header's {name} is {value}; allowed: {least} to {most}")


def _check_color(offset: int, color: int, wavelet: int, channels: int) -> None:
    if color and channels < 3:
        raise _fault(offset, f"the image header has a colour transform but {channels} channels")
    if color and (_WAVELETS[wavelet], color) not in (("9/7", _KLT), ("5/3", _YCOCG)):
        raise _fault(offset, "the image header's colour transform does not go with its wavelet")


def _fault(offset: int, what: str) -> FormatError:
    return FormatError(f"byte {offset}: {what}")
