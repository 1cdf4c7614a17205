"""Small binary fields: little-endian numbers and varints, written, and read with every limit checked."""

import math
import struct

from upholster.base.errors import FormatError

__all__ = ["ByteReader", "unzigzag", "varint", "zigzag"]

MOST_VARINT_BYTES = 9


def varint(value: int) -> bytes:
    """Return a number, 0 to 2^63 − 1, seven bits per byte, lowest first; the top bit means more follow."""
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    out.append(value)
    return bytes(out)


def zigzag(value: int) -> int:
    """Return a signed number as a nonnegative one: 0, −1, 1, −2 … as 0, 1, 2, 3 …."""
    return 2 * value if value >= 0 else -2 * value - 1


def unzigzag(value: int) -> int:
    """Return the signed number for a result of `zigzag`."""
    return value >> 1 if value % 2 == 0 else -(value >> 1) - 1


class ByteReader:
    """Reads fields one after another.

    Parameters
    ----------
    data
        The bytes.
    offset
        Their position in the file: errors name positions in the file.
    """

    def __init__(self, data: bytes, offset: int = 0) -> None:
        self._data, self._offset, self._place = data, offset, 0

    @property
    def offset(self) -> int:
        """Position of the next field in the file."""
        return self._offset + self._place

    @property
    def left(self) -> int:
        """Number of remaining bytes."""
        return len(self._data) - self._place

    def error(self, message: str) -> FormatError:
        """Return the error to raise at the next field."""
        return FormatError(f"byte {self.offset}: {message}")

    def bytes(self, count: int, name: str) -> bytes:
        """Read `count` bytes."""
        if count > self.left:
            raise self.error(f"{name} takes {count} bytes; {self.left} are left")
        self._place += count
        return self._data[self._place - count : self._place]

    def byte(self, name: str, most: int = 255) -> int:
        """Read a number of one byte, 0 to `most`."""
        return self._within(self.bytes(1, name)[0], name, 0, most, 1)

    def varint(self, name: str, most: int, least: int = 0) -> int:
        """Read a varint from `least` to `most`, in its shortest form."""
        value, start = 0, self._place
        if start < len(self._data) and least <= self._data[start] <= min(most, 127):
            self._place = start + 1  # most have one byte, and there may be very many
            return self._data[start]
        for n in range(MOST_VARINT_BYTES):
            byte = self.bytes(1, name)[0]
            value |= (byte & 127) << (7 * n)
            if byte < 128:
                break
        else:
            raise self.error(f"{name} is longer than {MOST_VARINT_BYTES} bytes")
        if byte == 0 and self._place - start > 1:
            raise self.error(f"{name} is not in its shortest form")
        return self._within(value, name, least, most, self._place - start)

    def float64(self, name: str) -> float:
        """Read a finite float64."""
        value: float = struct.unpack("<d", self.bytes(8, name))[0]
        if not math.isfinite(value):
            self._place -= 8
            raise self.error(f"{name} is {value}; allowed: finite numbers")
        return value

    def end(self, name: str) -> None:
        """Check that no bytes are left."""
        if self.left:
            raise self.error(f"{self.left} bytes too many in {name}")

    def _within(self, value: int, name: str, least: int, most: int, length: int) -> int:
        if not least <= value <= most:
            self._place -= length
            raise self.error(f"{name} is {value}; allowed: {least} to {most}")
        return value
