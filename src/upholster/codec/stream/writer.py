"""Writing a stream: data that is needed first comes first."""

import os
from collections.abc import Callable, Mapping, Sequence

from upholster.base.errors import InputError, check_whole
from upholster.base.options.write_options import QUALITY, Quality
from upholster.base.types import PixelArray
from upholster.codec.lifting import Wavelet
from upholster.codec.stream.base_maker import made_base
from upholster.codec.stream.chunks import assembled, pack_chunk
from upholster.codec.stream.field_chunks import pack_fields
from upholster.codec.stream.layout_chunk import pack_layout
from upholster.codec.stream.maps import MAX_MAP_SAMPLES, MOST_SIDE, check_roles, interleaved, pack_role
from upholster.codec.stream.order import ordered, plan_parts, sample_parts, split_sample
from upholster.codec.stream.plan import encode_plan
from upholster.codec.stream.sample import coded_maps, sample_errors
from upholster.codec.stream.surface_chunk import pack_surface
from upholster.geometry.built_in.catalog import SurfaceLike, as_surface
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.quilt.painting import check_painted

__all__ = ["FIRST_PART", "check_layout", "encode_stream"]

FIRST_PART = 600
"""Number of bytes of the exemplar that precede the placements."""

BASE_FROM, SECOND_BASE_FROM = 3000, 30_000
"""Bytes of surface and layout from which a stream begins with a base, and has a second one."""

FIRST_VIEW, SECOND_BASE = 2500, 8000
"""Approximate bytes of header, base and first part of the exemplar together; bytes of the second base."""

_BASE_BITS, _SECOND_BASE_BITS = 8, 9
"""Bits of their coordinates."""

_AROUND = 30
"""Bytes of the file's header, and around the base and the exemplar's first part."""


def encode_stream(
    surface: SurfaceLike | MeshSurface,
    quilt: Quilt,
    exemplar: PixelArray | str | os.PathLike[str],
    *,
    wavelet: Wavelet | None = None,
    levels: int | None = None,
    sample_quality: Quality = QUALITY,
    most_bytes: int | None = None,
    most_significant: int | None = None,
    first_part: int = FIRST_PART,
    maps: Mapping[str, PixelArray] | None = None,
    reached: dict[str, float] | None = None,
) -> bytes:
    """Encode a textured surface as a .uph stream, of which any prefix with the first view is a coarser model.

    Parameters
    ----------
    surface
        The surface; built-in ones take a few bytes. Or its text form, or the path of its file. Or a mesh:
        its positions are rounded to 12 bits along the longest side of its box, parameters to an eighth of a
        texel, and its triangles are reordered.
    quilt
        Its quilt, which decodes without change. Centres of its placements must be centres of cells, at most
        one per cell of its layer, in the order of the cells.
    exemplar
        (H, W) or (H, W, C) uint8, uint16 or float, of the quilt's shape; or the path of such an image.
    wavelet, levels, most_significant
        How the exemplar is coded, see `upholster.codec.image_code.encode_parts`.
    sample_quality
        Quality in dB at which the stream of every map ends, as `upholster.codec.image_code.encode_parts`
        measures it; or "lossless".
    most_bytes
        Largest length of the whole stream: the exemplar gets the bytes that the rest leaves.
    first_part
        Number of bytes of the exemplar that precede the placements.
    maps
        Further maps of the same material by role, such as "normal" or "roughness": (H, W, 1 to 4) of the
        exemplar's height and width, each of its own depth, painted by the same quilt. The exemplar's role is
        "albedo".
    reached
        Receives the PSNR of every map by role, in dB: infinite if nothing is lost.

    Returns
    -------
    bytes
        The stream.

    Raises
    ------
    InputError
        If arguments do not fit together, such as a quilt of another surface, or exceed the format's limits
        (SPEC.md, "Limits"), or if `most_bytes` is too small for the data that precedes the exemplar.
    """
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
    if not isinstance(reached, dict | None):
        raise InputError(f"reached is a {type(reached).__name__}; allowed: a dict, or None")
    maps = {role: check_painted(quilt, image) for role, image in maps.items()}
    _check_maps(quilt, exemplar, maps)
    layout = check_layout(surface, quilt.charts, quilt.exemplar_shape)
    sample, coded = coded_maps(
        exemplar,
        maps,
        wavelet=wavelet,
        levels=levels,
        sample_quality=sample_quality,
        most_significant=most_significant,
    )
    header = pack_chunk("X", sample.header)
    exact = [("S", pack_surface(surface, quilt.charts)), ("L", layout)]
    first, later = _shape_chunks(surface, quilt, exact, FIRST_VIEW - first_part - len(header) - _AROUND)
    head = [*(pack_chunk(tag, data) for tag, data in first), header]
    plan = encode_plan(quilt)
    bent = not all(field.is_identity for field in quilt.fields)
    fields = pack_fields(quilt.fields, quilt.charts) if bent else None
    tables = [pack_chunk("Q", plan.head), *([pack_chunk("t", b"")] if quilt.has_tones else [])]
    tables += [pack_chunk("R", pack_role(role, image.header)) for role, image in coded.items()]
    queue = plan_parts(plan, fields)
    streams = {role: image.payload for role, image in coded.items()}

    def whole(payload: bytes, streams: Mapping[str, bytes]) -> bytes:
        start = payload[:first_part]
        turns = interleaved(payload, streams, len(start)) if streams else split_sample(payload, len(start))
        errors = sample_errors(sample, [len(start), *(place for place, _ in turns)])
        if reached is not None:
            reached["albedo"] = sample.psnr(len(payload))
            reached.update({role: coded[role].psnr(len(stream)) for role, stream in streams.items()})
        rest = ordered(queue, sample_parts(turns), errors, len(start))
        early = [("D", start), *later]
        if fields is not None:  # first a picture, then its direction
            third = len(start) if later else len(start) // 3
            warped = [("F", fields.head), ("N", fields.nodes[: fields.coarse])]
            early = [("D", start[:third]), *later, *warped, ("D", start[third:])]
        return assembled(head, [*(pack_chunk(tag, data) for tag, data in early if data), *tables, *rest])

    if most_bytes is None:
        return whole(sample.payload, streams)
    least = len(whole(b"", {}))
    if most_bytes < least:
        raise InputError(f"most_bytes is {most_bytes}; allowed: {least} or more for this quilt")
    return _within(whole, sample.payload, streams, most_bytes)


def _shape_chunks(
    surface: Surface | MeshSurface, quilt: Quilt, exact: list[tuple[str, bytes]], room: int
) -> tuple[list[tuple[str, bytes]], list[tuple[str, bytes]]]:
    """Return the chunks of the shape that come before the exemplar, and those after its first part."""
    length = sum(len(data) for _, data in exact)
    base = made_base(surface, quilt, room, _BASE_BITS) if length > BASE_FROM else b""
    if not base:
        return exact, []
    finer = b""
    if length > SECOND_BASE_FROM:
        finer = made_base(surface, quilt, SECOND_BASE, _SECOND_BASE_BITS)
    return [("B", base)], [*([("B", finer)] if finer else []), *exact]


def _within(
    whole: Callable[[bytes, Mapping[str, bytes]], bytes],
    payload: bytes,
    streams: Mapping[str, bytes],
    most_bytes: int,
) -> bytes:
    # A stream of at most `most_bytes` bytes, in which every map has its share.
    most = sum(map(len, [payload, *streams.values()]))
    keep = min(most, most_bytes)
    while True:
        share = keep / max(1, most)
        parts = {role: stream[: int(len(stream) * share)] for role, stream in streams.items()}
        data = whole(payload[: keep - sum(map(len, parts.values()))], parts)
        if len(data) <= most_bytes or keep == 0:
            return data
        keep = max(0, keep - max(1, len(data) - most_bytes))


def check_layout(
    surface: Surface | MeshSurface, charts: Sequence[Chart], exemplar_shape: tuple[int, int]
) -> bytes:
    """Check that a stream can hold a layout, before it is used; return the payload of the layout chunk.

    Parameters
    ----------
    surface, charts
        The contents of the layout chunk.
    exemplar_shape
        (height, width) in pixels.

    Raises
    ------
    InputError
        If it exceeds the format's limits (SPEC.md, "Limits").
    """
    if not all(1 <= side <= MOST_SIDE for side in exemplar_shape):
        raise InputError(
            f"exemplar is {exemplar_shape[1]}×{exemplar_shape[0]}; "
            f"allowed: 1 to {MOST_SIDE} each way in a stream"
        )
    return pack_layout(charts, surface)


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
