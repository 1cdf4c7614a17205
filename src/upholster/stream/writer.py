"""Writing a stream: what is needed first comes first."""

from upholster.codec import encode_parts
from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.stream.chunks import header, pack_chunk
from upholster.stream.layout import pack_layout
from upholster.stream.mirrored import check_tiles
from upholster.stream.placement_encoder import encode_placements
from upholster.stream.surfaces import pack_surface
from upholster.synthesis import Quilt
from upholster.types import PixelArray
from upholster.wavelet.lifting import Wavelet

__all__ = ["FIRST_PART", "encode_stream"]

FIRST_PART = 600
"""Bytes of the exemplar that come before the placements."""


def encode_stream(
    surface: Surface,
    quilt: Quilt,
    exemplar: PixelArray,
    *,
    wavelet: Wavelet | None = None,
    levels: int | None = None,
    lossless: bool = False,
    threshold: float = 0.0,
    most_bytes: int | None = None,
    most_significant: int | None = None,
    first_part: int = FIRST_PART,
) -> bytes:
    """Encode a textured surface as a .uph stream, any prefix of which is a coarser model.

    Parameters
    ----------
    surface
        The surface; built-in ones take a few bytes.
    quilt
        Its quilt: every placement and mask is kept exactly.
    exemplar
        (H, W, C) uint8, uint16 or float32, of the quilt's shape.
    wavelet, levels, lossless, threshold, most_significant
        How the exemplar is coded, see `upholster.codec.encode_parts`.
    most_bytes
        Largest length of the whole stream: the exemplar gets what the rest leaves.
    first_part
        Bytes of the exemplar that come before the placements.

    Returns
    -------
    bytes
        The stream.

    Raises
    ------
    InputError
        If something does not fit together or is beyond the format's limits (SPEC.md, "Limits"), or
        `most_bytes` does not hold what comes before the exemplar.
    """
    if exemplar.ndim != 3 or exemplar.shape[:2] != quilt.exemplar_shape:
        height, width = quilt.exemplar_shape
        raise InputError(
            f"exemplar has shape {exemplar.shape}; the quilt wants ({height}, {width}, channels)"
        )
    if first_part < 0:
        raise InputError(f"first_part is {first_part}; allowed: 0 or more bytes")
    check_tiles(quilt.charts, quilt.exemplar_shape)
    layout = pack_layout(quilt.charts, surface)
    image_header, payload = encode_parts(
        exemplar,
        wavelet=wavelet,
        levels=levels,
        lossless=lossless,
        threshold=threshold,
        most_significant=most_significant,
    )
    plan, sources, masks = encode_placements(quilt, surface.shared)
    head = [pack_chunk("S", pack_surface(surface)), pack_chunk("L", layout), pack_chunk("X", image_header)]
    rest = [pack_chunk("Q", plan), pack_chunk("P", sources)] + ([pack_chunk("M", masks)] if masks else [])
    if most_bytes is not None:
        # Two chunks of the exemplar, each with at most 9 bytes round its payload, and a header of at most 14.
        room = most_bytes - 32 - sum(len(chunk) for chunk in head + rest)
        if room < 0:
            raise InputError(
                f"most_bytes is {most_bytes}; allowed: {most_bytes - room} or more for this quilt"
            )
        payload = payload[:room]
    parts = [payload[:first_part], payload[first_part:]]
    data = [pack_chunk("D", part) if part else b"" for part in parts]
    return _assembled(head, [data[0], *rest, data[1]])


def _assembled(head: list[bytes], rest: list[bytes]) -> bytes:
    # The header tells lengths that include its own.
    view, total = sum(map(len, head)), sum(map(len, head + rest))
    length = 0
    while len(found := header(total + length, view + length)) != length:
        length = len(found)
    return b"".join([found, *head, *rest])
