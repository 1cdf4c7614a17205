"""The contents of a stream, and what can be decoded from its first bytes."""

from dataclasses import dataclass

import numpy as np

from upholster.base.display import number_of
from upholster.base.errors import FormatError
from upholster.base.limits import Limits
from upholster.base.types import PixelArray
from upholster.codec.stream.byte_reader import ByteReader
from upholster.codec.stream.chunks import CHUNK_KINDS, Chunk
from upholster.codec.stream.mesh.mesh_code import MAX_TRIANGLES
from upholster.codec.stream.reader import StreamDecoder
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.patches.surface import Surface

__all__ = ["ChunkRow", "Description", "Readable", "describe"]

SIZES = (1000, 2000, 4000, 8000, 16000)


@dataclass(frozen=True, slots=True)
class ChunkRow:
    """A chunk.

    Attributes
    ----------
    tag, offset
        Its letter, and its position.
    length, received
        Length in bytes, including tag, length and CRC, and the number of received bytes.
    holds
        Its contents, in words.
    """

    tag: str
    offset: int
    length: int
    received: int
    holds: str


@dataclass(frozen=True, slots=True)
class Readable:
    """What can be decoded from the first `length` bytes.

    Attributes
    ----------
    length
        Number of bytes.
    charts, placements
        Shares, 0 to 1, of charts with known placements, and of known placements.
    coefficients
        Share of the exemplar's coefficients that are significant.
    psnr
        PSNR of the exemplar against the exemplar from all given bytes, in dB; infinite if equal.
    """

    length: int
    charts: float
    placements: float
    coefficients: float
    psnr: float


@dataclass(frozen=True, slots=True)
class Description:
    """Result of `describe`.

    Attributes
    ----------
    total, received
        Length of the whole file, and of the given part.
    complete
        Whether the whole file was given.
    view
        Length of the first view in bytes.
    chunks
        The chunks that have begun, in the file's order.
    readable
        What can be decoded from the first 1, 2, 4, 8, 16 kB, as far as given, and from all given bytes.
    """

    total: int
    received: int
    complete: bool
    view: int
    chunks: tuple[ChunkRow, ...]
    readable: tuple[Readable, ...]


def describe(data: bytes, *, limits: Limits | None = None) -> Description:
    """Return the contents of a stream, or of a prefix of one.

    Parameters
    ----------
    data
        The bytes.
    limits
        As for `StreamDecoder`.

    Returns
    -------
    Description
        The table of chunks, and what can be decoded from the first bytes.

    Raises
    ------
    FormatError
        If the stream is damaged or too short to show anything.
    """
    decoder = StreamDecoder(limits=limits)
    seen, states = 0, []
    for size in sorted({size for size in SIZES if size < len(data)} | {len(data)}):
        decoder.feed(data[seen:size])
        seen = size
        if decoder.needed == 0:
            states.append((size, _shares(decoder), decoder.exemplar()))
    if not states or decoder.total is None:
        raise FormatError(f"byte {len(data)}: file is cut; needs {decoder.needed} more bytes")
    full = states[-1][2]
    readable = tuple(Readable(size, *shares, _psnr(image, full)) for size, shares, image in states)
    rows = tuple(_row(chunk, decoder, data) for chunk in decoder.chunks)
    view = next(row.offset + row.length for row in rows if row.tag == "X")
    return Description(decoder.total, decoder.received, decoder.complete, view, rows, readable)


def _shares(decoder: StreamDecoder) -> tuple[float, float, float]:
    known, total = decoder.placements_known
    significant, coefficients = decoder.coefficients_known
    placements = known / total if total else float(decoder.plan_known)
    return decoder.charts_known / len(decoder.charts), placements, significant / coefficients


def _row(chunk: Chunk, decoder: StreamDecoder, data: bytes) -> ChunkRow:
    here = min(decoder.received, chunk.end) - chunk.offset
    return ChunkRow(chunk.tag, chunk.offset, chunk.end - chunk.offset, here, _holds(chunk, decoder, data))


def _holds(chunk: Chunk, decoder: StreamDecoder, data: bytes) -> str:
    kind = CHUNK_KINDS.get(chunk.tag)
    title = "unknown, skipped" if kind is None else kind.title
    if chunk.tag == "B" and chunk.verified:
        triangles = ByteReader(data[chunk.payload_offset :]).varint("triangles", MAX_TRIANGLES)
        return f"{title}: {number_of(triangles, 'triangle')}, until surface and layout have arrived"
    if chunk.tag == "S" and decoder.surface is not None and not decoder.is_base:
        return f"{title}: {_shape(decoder.surface)}"
    if chunk.tag == "L" and decoder.charts and not decoder.is_base:
        texels = sum(chart.height * chart.width for chart in decoder.charts)
        margins = " with the charts' margins" * isinstance(decoder.surface, MeshSurface)
        return f"{title}: {number_of(len(decoder.charts), 'chart')}, {texels:,} texels{margins}"
    if chunk.tag == "X" and decoder.needed == 0:
        height, width, channels = decoder.exemplar_shape
        return (
            f"{title}: {width}×{height}, {number_of(channels, 'channel')}, {decoder.exemplar_dtype}, "
            f"{decoder.wavelet}"
        )
    if chunk.tag == "P":
        return f"{title}: {decoder.placements_known[0]:,} of {decoder.placements_known[1]:,}"
    if chunk.tag == "M":
        return f"{title}: {decoder.labels_known[0]:,} of {decoder.labels_known[1]:,} cells"
    return title


def _shape(surface: Surface | MeshSurface) -> str:
    if isinstance(surface, MeshSurface):
        triangles, islands = number_of(len(surface.island), "triangle"), number_of(surface.islands, "island")
        return f"{surface.name or 'mesh'}, {triangles}, {islands}"
    return f"{surface.name or 'nets'}, {number_of(len(surface.patches), 'patch', 'patches')}"


def _psnr(image: PixelArray, full: PixelArray) -> float:
    error = float(np.mean((image.astype(np.float64) - full) ** 2))
    peak = float(np.iinfo(full.dtype).max) if full.dtype.kind == "u" else float(np.ptp(full)) or 1.0
    return float("inf") if error == 0 else 10 * float(np.log10(peak**2 / error))
