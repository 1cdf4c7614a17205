"""The progressive stream, .uph: a textured surface in one file; any prefix of it is a coarser model."""

from upholster.stream.describe import ChunkRow, Description, Readable, describe
from upholster.stream.reader import StreamDecoder, read_stream
from upholster.stream.surface_swap import on_surface
from upholster.stream.writer import check_layout, encode_stream

__all__ = [
    "ChunkRow",
    "Description",
    "Readable",
    "StreamDecoder",
    "check_layout",
    "describe",
    "encode_stream",
    "on_surface",
    "read_stream",
]
