"""Writing a stream: what is needed first comes first."""

import os
from collections.abc import Mapping, Sequence

from upholster.codec import encode_parts
from upholster.errors import InputError, check_whole
from upholster.geometry import MeshSurface, Surface, SurfaceLike, as_surface
from upholster.quilt import Chart, Quilt
from upholster.quilt.painting import check_painted
from upholster.quilt.warp_field import WarpField
from upholster.stream.chunks import assembled, pack_chunk
from upholster.stream.first_view import check_tiles, scale_of
from upholster.stream.layout import pack_layout
from upholster.stream.maps import MAX_MAP_SAMPLES, check_roles, interleaved, pack_role
from upholster.stream.plans import encode_plan
from upholster.stream.surfaces import pack_surface
from upholster.stream.warp_fields import pack_fields
from upholster.types import PixelArray
from upholster.wavelet.lifting import Wavelet

__all__ = ["FIRST_PART", "check_layout", "encode_stream"]

FIRST_PART = 600
"""Bytes of the exemplar that come before the placements."""


def encode_stream(
    surface: SurfaceLike | MeshSurface,
    quilt: Quilt,
    exemplar: PixelArray | str | os.PathLike[str],
    *,
    wavelet: Wavelet | None = None,
    levels: int | None = None,
    lossless: bool = False,
    most_bytes: int | None = None,
    most_significant: int | None = None,
    first_part: int = FIRST_PART,
    maps: Mapping[str, PixelArray] | None = None,
) -> bytes:
    """Encode a textured surface as a .uph stream, any prefix of which is a coarser model.

    Parameters
    ----------
    surface
        The surface; built-in ones take a few bytes. Or its text form, or the path of its file. Or a mesh:
        its positions are rounded to 12 bits along the longest side of its box, parameters to an eighth of a
        texel, and its triangles get another order.
    quilt
        Its quilt: every placement and mask is kept exactly.
    exemplar
        (H, W) or (H, W, C) uint8, uint16 or float, of the quilt's shape; or the path of such an image.
    wavelet, levels, lossless, most_significant
        How the exemplar is coded, see `upholster.codec.encode_parts`.
    most_bytes
        Largest length of the whole stream: the exemplar gets what the rest leaves.
    first_part
        Bytes of the exemplar that come before the placements.
    maps
        Further maps of the same material by role, such as "normal" or "roughness": (H, W, 1 to 4) of the
        exemplar's height and width, each of its own depth, painted by the same quilt. The exemplar's role is
        "albedo".

    Returns
    -------
    bytes
        The stream.

    Raises
    ------
    InputError
        If something does not fit together, such as a quilt of another surface, or is beyond the format's
        limits (SPEC.md, "Limits"), or
        `most_bytes` does not hold what comes before the exemplar.
    """
    if not isinstance(lossless, bool):
        raise InputError(f"lossless is {lossless!r}; allowed: True or False")
    check_whole("first_part", first_part, 0)
    for name, count in (("most_bytes", most_bytes), ("most_significant", most_significant)):
        if count is not None:
            check_whole(name, count, 1)
    surface = surface if isinstance(surface, MeshSurface) else as_surface(surface)
    exemplar = check_painted(quilt, exemplar)
    quilt.check_surface(surface)
    maps = {} if maps is None else maps
    if not isinstance(maps, Mapping):
        raise InputError(f"maps are a {type(maps).__name__}; allowed: arrays by role")
    maps = {role: check_painted(quilt, image) for role, image in maps.items()}
    _check_maps(quilt, exemplar, maps)
    layout = check_layout(surface, quilt.charts, quilt.fields, quilt.exemplar_shape)
    bent = not all(field.is_identity for field in quilt.fields)
    fields = [pack_chunk("F", pack_fields(quilt.fields, quilt.charts))] if bent else []
    image_header, payload = encode_parts(
        exemplar,
        wavelet=wavelet,
        levels=levels,
        lossless=lossless,
        most_significant=most_significant,
    )
    coded = {
        role: encode_parts(image, wavelet=wavelet, levels=levels, lossless=lossless)
        for role, image in maps.items()
    }
    streams = {role: stream for role, (_, stream) in coded.items()}
    plan, sources, masks = encode_plan(quilt)
    head = [
        pack_chunk("S", pack_surface(surface, quilt.charts)),
        pack_chunk("L", layout),
        pack_chunk("X", image_header),
    ]
    rest = [*fields, pack_chunk("Q", plan), pack_chunk("P", sources)]
    rest += [pack_chunk("M", masks)] if masks else []
    rest += [pack_chunk("R", pack_role(role, header)) for role, (header, _) in coded.items()]
    if most_bytes is not None:
        # Chunks of maps have at most 10 bytes round their payload, and the header at most 14.
        round_parts = 14 + 10 * (1 + len(interleaved(payload, streams)))
        room = most_bytes - round_parts - sum(len(chunk) for chunk in head + rest)
        if room < 0:
            raise InputError(
                f"most_bytes is {most_bytes}; allowed: {most_bytes - room} or more for this quilt"
            )
        # Every map gets its share.
        share = min(1.0, room / max(1, len(payload) + sum(map(len, streams.values()))))
        payload = payload[: int(len(payload) * share)] if streams else payload[:room]
        streams = {role: stream[: int(len(stream) * share)] for role, stream in streams.items()}
    start = [pack_chunk("D", payload[:first_part])] if payload[:first_part] else []
    return assembled(head, [*start, *rest, *interleaved(payload[first_part:], streams)])


def check_layout(
    surface: Surface | MeshSurface,
    charts: Sequence[Chart],
    fields: Sequence[WarpField],
    exemplar_shape: tuple[int, int],
) -> bytes:
    """Check that a stream can hold a layout, before anything is made for it; return its chunk's payload.

    Parameters
    ----------
    surface, charts, fields
        What the layout chunk tells, with the scale of the first view.
    exemplar_shape
        (height, width) in pixels.

    Raises
    ------
    InputError
        If it is beyond the format's limits (SPEC.md, "Limits").
    """
    scale = scale_of(fields, charts, exemplar_shape)
    check_tiles(charts, exemplar_shape, scale)
    return pack_layout(charts, surface, scale)


def _check_maps(quilt: Quilt, exemplar: PixelArray, maps: Mapping[str, PixelArray]) -> None:
    if exemplar.ndim != 3 or exemplar.shape[:2] != quilt.exemplar_shape:
        height, width = quilt.exemplar_shape
        raise InputError(
            f"exemplar has shape {exemplar.shape}; the quilt wants ({height}, {width}, channels)"
        )
    check_roles(list(maps))
    for role, image in maps.items():
        if image.ndim != 3 or image.shape[:2] != quilt.exemplar_shape or not 1 <= image.shape[2] <= 4:
            raise InputError(
                f"map {role!r} has shape {image.shape}; allowed: as the exemplar, 1 to 4 channels"
            )
        if role == "normal" and image.shape[2] != 3:
            raise InputError(f"map 'normal' has {image.shape[2]} channels; allowed: 3")
    samples = exemplar.size + sum(image.size for image in maps.values())
    if samples > MAX_MAP_SAMPLES:
        raise InputError(f"maps have {samples} samples; allowed: {MAX_MAP_SAMPLES} in a stream")
