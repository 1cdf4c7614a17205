"""The container: a short header, then chunks of tag, length, payload and CRC (SPEC.md, "File")."""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from upholster.base.errors import FormatError
from upholster.codec.stream.byte_reader import ByteReader, varint

__all__ = [
    "CHUNK_KINDS",
    "MAGIC",
    "MAX_FILE",
    "VERSION",
    "Chunk",
    "ChunkKind",
    "ChunkReader",
    "assembled",
    "header",
    "pack_chunk",
]

MAGIC = b"uph"
VERSION = 3
"""Other versions are refused: later ones, and 0 to 2, which were never released."""
MAX_FILE = 2**30
MOST_CHUNKS = 4096
_CRC = struct.Struct("<I")
_LONGEST_HEADER = 14


class ChunkKind(NamedTuple):
    """A kind of chunk.

    Attributes
    ----------
    title
        Its contents, in words.
    needs
        The chunks that must precede it: of each group of letters at least one.
    longest
        Maximum length of its payload in bytes; None for a chunk that is decoded as its bytes arrive.
    repeats
        Whether a stream may have several.
    """

    title: str
    needs: tuple[str, ...] = ()
    longest: int | None = None
    repeats: bool = False


CHUNK_KINDS = {
    "B": ChunkKind("base", longest=2**26, repeats=True),
    "S": ChunkKind("surface", longest=2**26),
    "L": ChunkKind("layout", ("S",), longest=2**24),
    "X": ChunkKind("exemplar's header", ("LB",), longest=2**12),
    "D": ChunkKind("exemplar", ("X",), repeats=True),
    "F": ChunkKind("warp fields", ("X", "L"), longest=2**23),
    "Q": ChunkKind("grids of cells, numbers of placements", ("X", "L"), longest=2**23),
    "t": ChunkKind("broad shades are blended", ("Q",), longest=0),
    "N": ChunkKind("nodes of the warp fields", ("F",), repeats=True),
    "P": ChunkKind("placements", ("Q",), repeats=True),
    "M": ChunkKind("labels", ("P",), repeats=True),
    "R": ChunkKind("a further map's header", ("X",), longest=2**12, repeats=True),
    "E": ChunkKind("a further map", ("R",), repeats=True),
}
"""The chunks by their letters; decoders in JavaScript have the same in `web/uph/chunks.js`."""


def header(total: int, view: int) -> bytes:
    """Return the file's header: magic, version, the file's length, and the length of the first view."""
    return MAGIC + bytes([VERSION]) + varint(total) + varint(view)


def pack_chunk(tag: str, payload: bytes) -> bytes:
    """Return a chunk; its CRC-32 is over everything before it."""
    body = tag.encode("ascii") + varint(len(payload)) + payload
    return body + _CRC.pack(zlib.crc32(body))


def assembled(head: list[bytes], rest: list[bytes]) -> bytes:
    """Return a file of chunks: those of the first view, and the rest."""
    # The lengths in the header include the header.
    view, total = sum(map(len, head)), sum(map(len, head + rest))
    length = 0
    while len(found := header(total + length, view + length)) != length:
        length = len(found)
    return b"".join([found, *head, *rest])


@dataclass(slots=True)
class Chunk:
    """The received part of a chunk.

    Attributes
    ----------
    tag
        Its letter: decoders skip an unknown small one.
    offset, payload_offset
        Positions of the chunk and of its payload in the file.
    length
        Length of its payload in bytes.
    received
        Received bytes of its payload.
    verified
        Whether it is complete and its CRC is right.
    """

    tag: str
    offset: int
    payload_offset: int
    length: int
    received: int = 0
    verified: bool = False

    @property
    def end(self) -> int:
        """Position of the next chunk."""
        return self.payload_offset + self.length + _CRC.size


class ChunkReader:
    """Splits bytes, as they arrive, into header and chunks.

    Attributes
    ----------
    received
        Number of bytes fed.
    total, view
        From the header: the file's length, and the length of the first view; None before the header has
        arrived.
    chunks
        The chunks that have begun.
    """

    def __init__(self) -> None:
        self.received = 0
        self.total: int | None = None
        self.view: int | None = None
        self.chunks: list[Chunk] = []
        self._buffer = bytearray()
        self._start = 0  # position of the buffer in the file
        self._crc = 0

    @property
    def complete(self) -> bool:
        """Whether the whole file has arrived and every chunk is right."""
        return self.total is not None and self._start == self.total

    def feed(self, data: bytes) -> Iterator[tuple[Chunk, bytes]]:
        """Take further bytes; yield, for each chunk they belong to, the new bytes of its payload, in order.

        If the end of a chunk is among them, its CRC has been checked.

        Raises
        ------
        FormatError
            For a wrong magic or version, a wrong CRC, lengths that do not fit, bytes after the end. For a
            damaged chunk the message names the byte at which it begins.
        """
        self.received += len(data)
        self._buffer += data
        if self.total is None and not self._read_header():
            return
        total = self.total or 0
        while self._start < total:
            chunk = (
                self.chunks[-1] if self.chunks and not self.chunks[-1].verified else self._next_chunk(total)
            )
            if chunk is None:
                break
            part = bytes(self._buffer[: chunk.length - chunk.received])
            self._crc = zlib.crc32(part, self._crc)
            self._take(len(part))
            chunk.received += len(part)
            if chunk.received == chunk.length and len(self._buffer) >= _CRC.size:
                stored = _CRC.unpack_from(self._buffer)[0]
                if stored != self._crc:
                    raise FormatError(
                        f"byte {chunk.offset}: chunk {chunk.tag!r} has CRC {self._crc:08x}; "
                        f"the file says {stored:08x}"
                    )
                self._take(_CRC.size)
                chunk.verified = True
            if part or chunk.verified:
                yield chunk, part
            if not chunk.verified:
                break
        if self.received > total:
            raise FormatError(f"byte {total}: {self.received - total} bytes after the end of the file")

    def _take(self, count: int) -> None:
        del self._buffer[:count]
        self._start += count

    def _read_header(self) -> bool:
        buffer = bytes(self._buffer[:_LONGEST_HEADER])
        if not MAGIC.startswith(buffer[:3]):
            raise FormatError(
                f"byte 0: file begins with {buffer[:3].hex()}; allowed: {MAGIC.hex()}, a .uph stream"
            )
        if len(buffer) > 3 and buffer[3] != VERSION:
            who = "a newer upholster reads it" if buffer[3] > VERSION else "it was never released: remake it"
            raise FormatError(f"byte 3: version is {buffer[3]}; allowed: {VERSION}; {who}")
        if sum(byte < 128 for byte in buffer[4:]) < 2 and len(buffer) < _LONGEST_HEADER:
            return False
        fields = ByteReader(buffer[4:], 4)
        self.total = fields.varint("length of the file", MAX_FILE, 6)
        self.view = fields.varint("length of the first view", self.total)
        self._take(fields.offset)
        return True

    def _next_chunk(self, total: int) -> Chunk | None:
        buffer = bytes(self._buffer[:10])
        if len(buffer) < 2 or (all(byte > 127 for byte in buffer[1:]) and len(buffer) < 10):
            return None
        fields = ByteReader(buffer, self._start)
        tag = fields.bytes(1, "tag").decode("latin-1")
        if not (tag.isascii() and tag.isalpha()):
            raise FormatError(f"byte {self._start}: tag is {tag!r}; allowed: letters")
        room = total - self._start - 2 - _CRC.size
        length = fields.varint(f"length of chunk {tag!r}", max(0, room))
        chunk = Chunk(tag, self._start, fields.offset, length)
        if chunk.end > total:
            raise FormatError(
                f"byte {self._start}: chunk {tag!r} ends at {chunk.end}; the file ends at {total}"
            )
        if len(self.chunks) == MOST_CHUNKS:
            raise FormatError(
                f"byte {self._start}: chunk {MOST_CHUNKS + 1}; allowed: {MOST_CHUNKS} in a file"
            )
        used = fields.offset - self._start
        self._crc = zlib.crc32(buffer[:used])
        self._take(used)
        self.chunks.append(chunk)
        return chunk
