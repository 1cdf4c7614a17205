"""The layout chunk: charts, with what is alike told once, and the scale of a first view."""

import struct
from collections.abc import Callable, Sequence

from upholster.errors import InputError
from upholster.geometry import Face, Surface
from upholster.quilt import Chart
from upholster.quilt.chart import MAX_CHART, MAX_TEXELS
from upholster.stream.byte_reader import ByteReader, varint

__all__ = ["MAX_CHARTS", "pack_layout", "parse_layout"]

MAX_CHARTS = 2**18

_BY_PATCH, _ONE_FACE, _SAME, _SQUARE, _DYADIC, _SCALED = 1, 2, 4, 8, 16, 32
_FINEST = 16
_NO_SCALE = 128


def pack_layout(charts: Sequence[Chart], surface: Surface, scale: int = 0) -> bytes:
    """Return the charts as bytes.

    Parameters
    ----------
    charts
        The charts.
    surface
        What they lie on.
    scale
        Exemplar pixels per texel on a chart that has no placements yet, in 1/32 octave, -128 to 127.

    Raises
    ------
    InputError
        For more than 2^18 charts, a size outside 1 to 16384, a face that the surface lacks, a rectangle
        outside the face, or more than 2^31 texels.
    """
    _check(charts, surface)
    by_patch = _lie_by_patch(charts, surface)
    one_face = all(chart.face == 0 for chart in charts)
    same = len({(chart.height, chart.width) for chart in charts}) == 1
    square = all(chart.height == chart.width for chart in charts)
    ends = {float(end) for chart in charts for end in (chart.s0, chart.s1, chart.t0, chart.t1)}
    fineness = next((n for n in range(_FINEST) if all((end * 2**n).is_integer() for end in ends)), None)
    dyadic = not by_patch and fineness is not None
    flags = _BY_PATCH * by_patch | _ONE_FACE * one_face | _SAME * same | _SQUARE * square
    out = [bytes([flags | _DYADIC * dyadic | _SCALED * (scale != 0)])]
    if scale:
        out.append(bytes([scale + _NO_SCALE]))
    if not by_patch:
        out.append(varint(len(charts)))
        if not one_face:
            out += [varint(chart.face) for chart in charts]
    for chart in charts[:1] if same else charts:
        out.append(varint(chart.height) + (b"" if square else varint(chart.width)))
    if dyadic and fineness is not None:
        out.append(bytes([fineness]))
        for chart in charts:
            for low, high in ((chart.s0, chart.s1), (chart.t0, chart.t1)):
                out += [varint(int(low * 2**fineness)), varint(int((high - low) * 2**fineness) - 1)]
    elif not by_patch:
        out += [struct.pack("<4d", chart.s0, chart.s1, chart.t0, chart.t1) for chart in charts]
    return b"".join(out)


def parse_layout(fields: ByteReader, surface: Surface) -> tuple[tuple[Chart, ...], int]:
    """Read charts and scale back.

    Raises
    ------
    FormatError
        If they are malformed or outside what is allowed.
    """
    flags = fields.byte("flags of the layout", 63)
    scale = fields.byte("scale") - _NO_SCALE if flags & _SCALED else 0
    count = len(surface.patches)
    faces = [0] * count
    if not flags & _BY_PATCH:
        count = fields.varint("number of charts", MAX_CHARTS, 1)
        faces = [0] * count
        if not flags & _ONE_FACE:
            faces = [fields.varint("face of a chart", len(surface.faces) - 1) for _ in range(count)]
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
    if flags & _BY_PATCH:
        charts = [_on_patch(surface, patch, size) for patch, size in enumerate(sizes)]
    else:
        read = _dyadic(fields) if flags & _DYADIC else _rectangle(fields)
        charts = [
            Chart(face, *size, *read(surface.faces[face])) for face, size in zip(faces, sizes, strict=True)
        ]
    fields.end("layout")
    return tuple(charts), scale


def _check(charts: Sequence[Chart], surface: Surface) -> None:
    if not 1 <= len(charts) <= MAX_CHARTS:
        raise InputError(f"layout has {len(charts)} charts; allowed: 1 to {MAX_CHARTS}")
    for n, chart in enumerate(charts):
        if not 0 <= chart.face < len(surface.faces):
            raise InputError(f"chart {n} is of face {chart.face}; allowed: 0 to {len(surface.faces) - 1}")
        if not (1 <= chart.height <= MAX_CHART and 1 <= chart.width <= MAX_CHART):
            raise InputError(f"chart {n} is {chart.width}×{chart.height}; allowed: 1 to {MAX_CHART} each way")
        face = surface.faces[chart.face]
        if not (0 <= chart.s0 < chart.s1 <= face.rows and 0 <= chart.t0 < chart.t1 <= face.columns):
            raise InputError(f"chart {n} covers parameters outside its face, or none")
    texels = sum(chart.height * chart.width for chart in charts)
    if texels > MAX_TEXELS:
        raise InputError(f"layout has {texels:,} texels; allowed: {MAX_TEXELS:,}")


def _lie_by_patch(charts: Sequence[Chart], surface: Surface) -> bool:
    """Return whether chart k covers patch k, and nothing is left."""
    places = (surface.whole_patch(c.face, c.s0, c.s1, c.t0, c.t1) for c in charts)
    return len(charts) == len(surface.patches) and all(n == place for n, place in enumerate(places))


def _on_patch(surface: Surface, patch: int, size: tuple[int, int]) -> Chart:
    face, row, column = surface.place(patch)
    return Chart(face, *size, float(row), row + 1.0, float(column), column + 1.0)


Rectangle = Callable[[Face], tuple[float, float, float, float]]
"""Reads a chart's s0, s1, t0, t1 on its face."""


def _rectangle(fields: ByteReader) -> Rectangle:
    def read(face: Face) -> tuple[float, float, float, float]:
        s0, s1, t0, t1 = (fields.float64(name) for name in ("s0", "s1", "t0", "t1"))
        if not (0 <= s0 < s1 <= face.rows and 0 <= t0 < t1 <= face.columns):
            raise fields.error("a chart covers parameters outside its face, or none")
        return s0, s1, t0, t1

    return read


def _dyadic(fields: ByteReader) -> Rectangle:
    unit = 1 << fields.byte("fineness of the charts", _FINEST)

    def read(face: Face) -> tuple[float, float, float, float]:
        ends = []
        for most in (face.rows * unit, face.columns * unit):
            low = fields.varint("start of a chart", most - 1)
            ends += [low / unit, (low + 1 + fields.varint("extent of a chart", most - 1 - low)) / unit]
        return ends[0], ends[1], ends[2], ends[3]

    return read
