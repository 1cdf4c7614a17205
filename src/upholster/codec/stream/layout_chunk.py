"""The layout chunk: charts, with common values stored once."""

import struct
from collections.abc import Callable, Sequence

import numpy as np

from upholster.base.errors import InputError
from upholster.codec.stream.byte_reader import ByteReader, unzigzag, varint, zigzag
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import MAX_CHART, MAX_TEXELS, Chart

__all__ = ["MAX_CHARTS", "pack_layout", "parse_layout"]

MAX_CHARTS = 2**18

_BY_PATCH, _ONE_FACE, _SAME, _SQUARE, _DYADIC, _EVEN = 1, 2, 4, 8, 16, 32
_FINEST = 16
_FARTHEST = 2**32
"""Largest distance in texels from an island's origin to a chart's first one, in an even layout."""

_MOST = 1e18
"""Largest parameter on a mesh."""


def pack_layout(charts: Sequence[Chart], surface: Surface | MeshSurface) -> bytes:
    """Return the charts as bytes.

    Parameters
    ----------
    charts
        The charts.
    surface
        Their surface. Charts of a mesh take the fewest bytes if their texels are squares of one size q, and
        each starts at a multiple of it: ``s0 == q·m``, ``s1 == q·(m + height)`` to the bit, likewise t.

    Raises
    ------
    InputError
        For more than 2^18 charts, a size outside 1 to 16384, a face that the surface lacks, a rectangle
        outside the face, or more than 2^31 texels.
    """
    _check(charts, surface)
    by_patch = isinstance(surface, Surface) and _lie_by_patch(charts, surface)
    one_face = all(chart.face == 0 for chart in charts)
    same = len({(chart.height, chart.width) for chart in charts}) == 1
    square = all(chart.height == chart.width for chart in charts)
    form, rectangles = (0, b"") if by_patch else _pack_rectangles(charts, isinstance(surface, MeshSurface))
    flags = _BY_PATCH * by_patch | _ONE_FACE * one_face | _SAME * same | _SQUARE * square
    out = [bytes([flags | form])]
    if not by_patch:
        out.append(varint(len(charts)))
        if not one_face:
            out += [varint(chart.face) for chart in charts]
    for chart in charts[:1] if same else charts:
        out.append(varint(chart.height) + (b"" if square else varint(chart.width)))
    return b"".join([*out, rectangles])


def _pack_rectangles(charts: Sequence[Chart], on_mesh: bool) -> tuple[int, bytes]:
    """Return the flag for the rectangles' form, and their bytes."""
    texel = _even_texel(charts) if on_mesh else None
    if texel is not None:
        starts = [int(np.rint(low / texel)) for chart in charts for low in (chart.s0, chart.t0)]
        return _EVEN, struct.pack("<d", texel) + b"".join(varint(zigzag(start)) for start in starts)
    ends = {float(end) for chart in charts for end in (chart.s0, chart.s1, chart.t0, chart.t1)}
    fineness = next((n for n in range(_FINEST) if all((end * 2**n).is_integer() for end in ends)), None)
    if on_mesh or fineness is None:
        return 0, b"".join(struct.pack("<4d", c.s0, c.s1, c.t0, c.t1) for c in charts)
    out = [bytes([fineness])]
    for chart in charts:
        for low, high in ((chart.s0, chart.s1), (chart.t0, chart.t1)):
            out += [varint(int(low * 2**fineness)), varint(int((high - low) * 2**fineness) - 1)]
    return _DYADIC, b"".join(out)


def _even_texel(charts: Sequence[Chart]) -> float | None:
    """Return the common size of all charts' texels, if their starts are multiples of it; None without one."""
    ends = np.array([[(c.s0, c.s1), (c.t0, c.t1)] for c in charts])
    counts = np.array([(c.height, c.width) for c in charts], float)
    rough = (ends[..., 1] - ends[..., 0]) / counts
    starts = np.rint(ends[..., 0] / rough)
    if not (np.abs(starts) <= _FARTHEST).all():
        return None
    # A product, divided again, may differ in its last bit: take the most frequent quotient.
    whole = np.stack([starts, starts + counts], axis=-1)
    found, often = np.unique(ends[whole != 0] / whole[whole != 0], return_counts=True)
    texel = float(found[often.argmax()])
    if texel > 0 and (texel * whole == ends).all():
        return texel
    return None


def parse_layout(fields: ByteReader, surface: Surface | MeshSurface) -> tuple[Chart, ...]:
    """Read the charts back.

    Raises
    ------
    FormatError
        If they are malformed or not allowed.
    """
    flags = fields.byte("flags of the layout", 63)
    if flags & (_BY_PATCH | _DYADIC if isinstance(surface, MeshSurface) else _EVEN):
        raise fields.error(
            f"flags of the layout are {flags}; allowed: 1 and 16 on patches only, 32 on a mesh"
        )
    count = len(surface.patches) if isinstance(surface, Surface) else 0
    faces = [0] * count
    if not flags & _BY_PATCH:
        count = fields.varint("number of charts", MAX_CHARTS, 1)
        faces = [0] * count
        if not flags & _ONE_FACE:
            faces = [fields.varint("face of a chart", _faces(surface) - 1) for _ in range(count)]
    sizes: list[tuple[int, int]] = []
    texels = 0
    for _ in range(1 if flags & _SAME else count):
        height = fields.varint("height of a chart", MAX_CHART, 1)
        width = height if flags & _SQUARE else fields.varint("width of a chart", MAX_CHART, 1)
        sizes.append((height, width))
        texels += height * width * (count if flags & _SAME else 1)
    if texels > MAX_TEXELS:
        raise fields.error(f"layout has {texels} texels; allowed: {MAX_TEXELS}")
    sizes = sizes * count if flags & _SAME else sizes
    if isinstance(surface, Surface) and flags & _BY_PATCH:
        charts = [_on_patch(surface, patch, size) for patch, size in enumerate(sizes)]
    else:
        read = _even(fields) if flags & _EVEN else _dyadic(fields) if flags & _DYADIC else _rectangle(fields)
        charts = [
            Chart(face, *size, *read(size, _room(surface, face)))
            for face, size in zip(faces, sizes, strict=True)
        ]
    fields.end("layout")
    return tuple(charts)


def _faces(surface: Surface | MeshSurface) -> int:
    return len(surface.faces) if isinstance(surface, Surface) else surface.islands


Room = tuple[float, float, float]
"""Least parameter, largest s and largest t of a face."""


def _room(surface: Surface | MeshSurface, face: int) -> Room:
    if isinstance(surface, MeshSurface):
        return -_MOST, _MOST, _MOST
    return 0.0, surface.faces[face].rows, surface.faces[face].columns


def _lies_within(room: Room, s0: float, s1: float, t0: float, t1: float) -> bool:
    low, high_s, high_t = room
    return low <= s0 < s1 <= high_s and low <= t0 < t1 <= high_t


def _check(charts: Sequence[Chart], surface: Surface | MeshSurface) -> None:
    if not 1 <= len(charts) <= MAX_CHARTS:
        raise InputError(f"layout has {len(charts)} charts; allowed: 1 to {MAX_CHARTS}")
    for n, chart in enumerate(charts):
        if not 0 <= chart.face < _faces(surface):
            raise InputError(f"chart {n} is of face {chart.face}; allowed: 0 to {_faces(surface) - 1}")
        if not (1 <= chart.height <= MAX_CHART and 1 <= chart.width <= MAX_CHART):
            raise InputError(f"chart {n} is {chart.width}×{chart.height}; allowed: 1 to {MAX_CHART} each way")
        if not _lies_within(_room(surface, chart.face), chart.s0, chart.s1, chart.t0, chart.t1):
            raise InputError(f"chart {n} covers parameters outside its face, or none")
    texels = sum(chart.height * chart.width for chart in charts)
    if texels > MAX_TEXELS:
        raise InputError(f"layout has {texels:,} texels; allowed: {MAX_TEXELS:,}")


def _lie_by_patch(charts: Sequence[Chart], surface: Surface) -> bool:
    """Return whether chart k covers patch k, for all charts and patches."""
    places = (surface.whole_patch(c.face, c.s0, c.s1, c.t0, c.t1) for c in charts)
    return len(charts) == len(surface.patches) and all(n == place for n, place in enumerate(places))


def _on_patch(surface: Surface, patch: int, size: tuple[int, int]) -> Chart:
    face, row, column = surface.place(patch)
    return Chart(face, *size, float(row), row + 1.0, float(column), column + 1.0)


Rectangle = Callable[[tuple[int, int], Room], tuple[float, float, float, float]]
"""Reads s0, s1, t0, t1 of a chart of a given size, on a face with given room."""


def _rectangle(fields: ByteReader) -> Rectangle:
    def read(size: tuple[int, int], room: Room) -> tuple[float, float, float, float]:  # noqa: ARG001
        s0, s1, t0, t1 = (fields.float64(name) for name in ("s0", "s1", "t0", "t1"))
        if not _lies_within(room, s0, s1, t0, t1):
            raise fields.error("a chart covers parameters outside its face, or none")
        return s0, s1, t0, t1

    return read


def _dyadic(fields: ByteReader) -> Rectangle:
    unit = 1 << fields.byte("fineness of the charts", _FINEST)

    def read(size: tuple[int, int], room: Room) -> tuple[float, float, float, float]:  # noqa: ARG001
        ends = []
        for most in (int(room[1]) * unit, int(room[2]) * unit):
            low = fields.varint("start of a chart", most - 1)
            ends += [low / unit, (low + 1 + fields.varint("extent of a chart", most - 1 - low)) / unit]
        return ends[0], ends[1], ends[2], ends[3]

    return read


def _even(fields: ByteReader) -> Rectangle:
    texel = fields.float64("texel")

    def read(size: tuple[int, int], room: Room) -> tuple[float, float, float, float]:
        ends = []
        for count in size:
            low = unzigzag(fields.varint("start of a chart", 2 * _FARTHEST))
            ends += [texel * low, texel * (low + count)]
        if not _lies_within(room, ends[0], ends[1], ends[2], ends[3]):
            raise fields.error("a chart covers parameters outside its island, or none")
        return ends[0], ends[1], ends[2], ends[3]

    return read
