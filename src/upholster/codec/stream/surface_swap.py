"""The same stream on another surface."""

from upholster.base.errors import FormatError
from upholster.codec.stream.chunks import ChunkReader, assembled, pack_chunk
from upholster.codec.stream.surface_chunk import pack_surface
from upholster.geometry.patches.surface import Surface

__all__ = ["on_surface"]


def on_surface(data: bytes, surface: Surface) -> bytes:
    """Return a whole stream with another surface, without bases; all other data is unchanged, to the byte.

    Parameters
    ----------
    data
        The stream.
    surface
        A surface with the same faces, see `upholster.geometry.patches.same_edges.check_same_edges`.

    Raises
    ------
    FormatError
        If the stream is damaged or incomplete.
    """
    reader = ChunkReader()
    list(reader.feed(data))
    if not reader.complete or reader.view is None:
        raise FormatError(f"byte {len(data)}: stream is cut; allowed: a complete one")
    head = {"S": pack_chunk("S", pack_surface(surface))}
    rest: list[bytes] = []
    for chunk in reader.chunks:
        if chunk.tag in ("L", "X"):
            head[chunk.tag] = data[chunk.offset : chunk.end]
        elif chunk.tag not in ("B", "S"):
            rest.append(data[chunk.offset : chunk.end])
    return assembled([head[tag] for tag in "SLX"], rest)
