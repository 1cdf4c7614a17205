"""Streams of few bytes that ask for much work or memory, one for each thing that they can ask for."""

import struct
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "stream"))

from upholster.codec.stream.byte_reader import varint
from upholster.codec.stream.chunks import assembled, pack_chunk
from upholster.codec.stream.field_chunks import pack_fields
from upholster.codec.stream.layout_chunk import pack_layout
from upholster.codec.stream.mesh.mesh_code import MeshPrecision, pack_mesh
from upholster.codec.stream.plan import encode_plan
from upholster.codec.stream.surface_chunk import pack_surface
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.quilt.chart import Chart
from upholster.quilt.labels import LabelMap, cell_centres, label_shape
from upholster.quilt.model import Quilt
from upholster.quilt.placement import PLACEMENT
from upholster.quilt.warp_field import WarpField

__all__ = ["CASES", "costly", "image_header", "rebuilt"]

PLANE = bytes([4])
BY_PATCH, ONE_FACE, SAME, SQUARE = 1, 2, 4, 8
MOST_SIDE = 16384
SQUARE_SIDE = 2046
"""A chart with as many cells of a step as the fuzzer's limit of texels allows."""

MOST_PARTS = 1300


def rebuilt(chunks: list[tuple[str, bytes]]) -> bytes:
    """Return a stream of chunks, lengths and checksums right; the first view ends with X."""
    packed = [pack_chunk(*chunk) for chunk in chunks]
    first = 1 + [tag for tag, _ in chunks].index("X")
    return assembled(packed[:first], packed[first:])


def layout(side: int) -> bytes:
    """One chart on the plane."""
    return bytes([BY_PATCH | ONE_FACE | SAME | SQUARE]) + varint(side)


def image_header(
    height: int, width: int, channels: int, *, plane: int = 23, depth: int = 0, levels: int = 6
) -> bytes:
    """An image header of the wavelet 5/3."""
    kind = 1 | depth << 4
    head = struct.pack("<HHBBBBB", height, width, channels, kind, levels, plane + 1, 0)
    return (
        head
        + struct.pack(f"<{channels}H", *[128] * channels)
        + (struct.pack("<ff", 0, 1) if depth == 2 else b"")
    )


def framed(surface: bytes, charts: bytes, header: bytes, *rest: tuple[str, bytes]) -> bytes:
    """A stream of these."""
    return rebuilt([("S", surface), ("L", charts), ("X", header), *rest])


def in_parts(tag: str, payload: bytes) -> list[tuple[str, bytes]]:
    """A payload in as many chunks as a file may have, about."""
    size = -(-len(payload) // MOST_PARTS)
    return [(tag, payload[start : start + size]) for start in range(0, len(payload), size)]


def blocks(count: int, cell: int, *, layers: int = 1, maps: int = 1, labels: bytes = b"") -> bytes:
    """Placements in so many cells, from the first one on; `labels` follow as they are."""
    chart = Chart(0, SQUARE_SIDE, SQUARE_SIDE)
    shape = label_shape(chart.height, chart.width, cell)
    parts = []
    for layer in range(layers):
        part = np.zeros(count, PLACEMENT)
        for name, at, number in zip(("row", "column"), np.divmod(range(count), shape[1]), shape, strict=True):
            part[name] = cell_centres(number, cell)[at]
        part["layer"] = layer
        parts.append(part)
    plain = tuple(LabelMap(cell, np.full(shape, -layer, np.int32)) for layer in range(layers))
    code = encode_plan(Quilt((chart,), (64, 64), np.concatenate(parts), (plain,)))
    header = image_header(64, 64, 3, plane=-1)
    chunks = [("Q", code.head), ("P", code.placements), ("M", labels or code.labels)]
    return framed(PLANE, layout(SQUARE_SIDE), header, *further_maps(maps, header), *chunks)


def placements_of(byte: int, layers: int) -> bytes:
    """As many placements as there may be, of bytes that tell most of them in fewest."""
    each = 2**19 // layers
    head = bytes([layers, 3, 0, 0]) + bytes([2, 2]) * layers + varint(each) * layers
    chunks = [("Q", head), ("P", bytes([byte]) * 3000), ("M", bytes([byte]) * 3000)]
    return framed(PLANE, layout(SQUARE_SIDE), image_header(64, 64, 3, plane=-1), *chunks)


def further_maps(maps: int, header: bytes) -> list[tuple[str, bytes]]:
    """Chunks that tell of all maps but the first."""
    return [("R", varint(len(f"m{n}")) + f"m{n}".encode() + header) for n in range(maps - 1)]


def zeros(size: int, maps: int = 1) -> bytes:
    """Coefficients of zeros or ones for images as large as there may be."""
    header = image_header(1032, 1032, 3)
    return framed(
        PLANE,
        layout(8),
        header,
        *further_maps(maps, header),
        ("D", bytes(size)),
        *[("E", bytes([n + 1]) + bytes(size)) for n in range(maps - 1)],
    )


def ones(size: int) -> bytes:
    return framed(PLANE, layout(8), image_header(1032, 1032, 3), ("D", b"\xff" * size))


def plan(spans: int, cell: int = 255) -> bytes:
    """Q of as many charts as patches, with one placement each."""
    return bytes([1, 3, 0, 0, 2]) + varint(cell) + b"\x01" * (spans * spans)


def many_charts(spans: int, side: int = 1) -> bytes:
    """A plane of as many charts as patches."""
    surface = bytes([4, 4]) + varint(spans) + varint(spans)
    return framed(
        surface, layout(side), image_header(8, 8, 3, plane=-1), ("Q", plan(spans)), ("P", b"\xff" * 3000)
    )


def fields(spans: int, margin: int) -> bytes:
    """Warp fields of as many nodes as there may be, told before and behind the plan."""
    surface = bytes([4, 4]) + varint(spans) + varint(spans)
    some = ("N", b"\xff" * 200)
    rest = [("F", bytes([1, margin])), some, ("Q", plan(spans)), some]
    return framed(surface, layout(8), image_header(8, 8, 3, plane=-1), *rest)


def many_parts(spans: int) -> bytes:
    """Many charts, each with a warp field, two placements and labels, in as many chunks as there may be."""
    surface = surface_from_spec(f"plane:spans={spans}x{spans}")
    charts = tuple(Chart(0, 2, 2, i, i + 1, j, j + 1) for i in range(spans) for j in range(spans))
    rng = np.random.default_rng(1)
    placed = np.zeros(2 * len(charts), PLACEMENT)
    placed["chart"] = np.arange(len(placed)) // 2
    placed["row"], placed["column"] = 16, np.arange(len(placed)) % 2 * 32 + 16
    placed["source_row"], placed["source_column"] = rng.integers(0, 128, (2, len(placed)))
    labels = tuple((LabelMap(2, one),) for one in rng.integers(0, 2, (len(charts), 3, 3), dtype=np.int32))
    nodes = rng.integers(0, 8, (len(charts), 2, 2, 4), dtype=np.int16)
    quilt = Quilt(charts, (8, 8), placed, labels, tuple(WarpField(one, 0) for one in nodes))
    code, coded = encode_plan(quilt), pack_fields(quilt.fields, charts)
    rest = [("F", coded.head), ("Q", code.head), *in_parts("N", coded.nodes)]
    for tag, payload in (("P", code.placements), ("M", code.labels)):
        rest += in_parts(tag, payload)
    return framed(pack_surface(surface), pack_layout(charts, surface), image_header(8, 8, 3, plane=-1), *rest)


def mesh(triangles: int) -> bytes:
    """A strip of so many triangles, all at one point: few bytes tell them."""
    at = np.arange(triangles)
    corners = np.stack([at + at % 2, at + 1 - at % 2, at + 2], axis=1)
    strip = TriangleMesh(np.zeros((triangles + 2, 3)), corners)
    surface = MeshSurface(strip, np.zeros(triangles, int), np.zeros((triangles, 3, 2)))
    return framed(
        bytes([9]) + pack_mesh(surface, MeshPrecision(16, 1)),
        bytes([ONE_FACE | SAME | SQUARE]) + varint(1) + varint(8) + struct.pack("<4d", 0, 1, 0, 1),
        image_header(8, 8, 3, plane=-1),
    )


@cache
def costly(name: str) -> bytes:
    """Return a stream by the name of what it asks for."""
    return CASES[name]()


CASES: dict[str, Callable[[], bytes]] = {
    "rows_of_placements": lambda: blocks(2**19, 1),
    "a_row_of_placements": lambda: blocks(SQUARE_SIDE + 2, 1),
    "placements_of_ones": lambda: placements_of(255, 1),
    "placements_of_ones_in_two_layers": lambda: placements_of(255, 2),
    "placements_of_zeros": lambda: placements_of(0, 1),
    "labels": lambda: blocks(2, 1, layers=2),
    "labels_of_ones": lambda: blocks(9, 1, layers=2, labels=b"\xff" * 3000),
    "labels_of_zeros": lambda: blocks(9, 1, layers=2, labels=bytes(3000)),
    "layers_of_maps": lambda: blocks(2, 4, layers=2, maps=16),
    "zeros": lambda: zeros(10_000),
    "ones": lambda: ones(10_000),
    "zeros_of_four": lambda: zeros(10_000, 4),
    "zeros_of_sixteen": lambda: zeros(2_000, 16),
    "headers": lambda: zeros(0, 4),
    "texels": lambda: framed(
        PLANE,
        bytes([ONE_FACE | SAME | SQUARE])
        + varint(8)
        + varint(MOST_SIDE)
        + struct.pack("<4d", 0, 1, 0, 1) * 8,
        image_header(4, 4, 4, depth=2),
    ),
    "charts": lambda: many_charts(128),
    "fields": lambda: fields(8, 64),
    "fields_of_charts": lambda: fields(128, 0),
    "parts": lambda: many_parts(100),
    "mesh": lambda: mesh(2**19),
}
