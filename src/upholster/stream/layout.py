"""The layout chunk: charts, with what is alike told once, and the scale of a first view."""

import struct
from collections.abc import Callable, Sequence

from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.quilt import Chart
from upholster.quilt.chart import MAX_CHART, MAX_TEXELS
from upholster.stream.byte_reader import ByteReader, varint

__all__ = ["MAX_CHARTS", "pack_layout", "parse_layout"]

MAX_CHARTS = 2**18

_BY_PATCH, _WHOLE, _SAME, _SQUARE, _DYADIC, _SCALED = 1, 2, 4, 8, 16, 32
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
        For more than 2^18 charts, a size outside 1 to 16384, a patch that the surface lacks, a rectangle
        outside the patch, or more than 2^31 texels.
    """
    if not 1 <= len(charts) <= MAX_CHARTS:
        raise InputError(f"layout has {len(charts)} charts; allowed: 1 to {MAX_CHARTS}")
    for n, chart in enumerate(charts):
        if not 0 <= chart.patch < len(surface.patches):
            raise InputError(f"chart {n} is of patch {chart.patch}; allowed: 0 to {len(surface.patches) - 1}")
        if not (1 <= chart.height <= MAX_CHART and 1 <= chart.width <= MAX_CHART):
            raise InputError(f"chart {n} is {chart.width}×{chart.height}; allowed: 1 to {MAX_CHART} each way")
        if not (0 <= chart.s0 < chart.s1 <= 1 and 0 <= chart.t0 < chart.t1 <= 1):
            raise InputError(f"chart {n} covers parameters outside 0 to 1, or none")
    texels = sum(chart.height * chart.width for chart in charts)
    if texels > MAX_TEXELS:
        raise InputError(f"layout has {texels:,} texels; allowed: {MAX_TEXELS:,}")
    by_patch = [chart.patch for chart in charts] == list(range(len(surface.patches)))
    whole = all((chart.s0, chart.s1, chart.t0, chart.t1) == (0, 1, 0, 1) for chart in charts)
    same = len({(chart.height, chart.width) for chart in charts}) == 1
    square = all(chart.height == chart.width for chart in charts)
    ends = {float(end) for chart in charts for end in (chart.s0, chart.s1, chart.t0, chart.t1)}
    fineness = next((n for n in range(_FINEST) if all((end * 2**n).is_integer() for end in ends)), None)
    dyadic = not whole and fineness is not None
    flags = _BY_PATCH * by_patch | _WHOLE * whole | _SAME * same | _SQUARE * square
    out = [bytes([flags | _DYADIC * dyadic | _SCALED * (scale != 0)])]
    if scale:
        out.append(bytes([scale + _NO_SCALE]))
    if not by_patch:
        out += [varint(len(charts)), *(varint(chart.patch) for chart in charts)]
    for chart in charts[:1] if same else charts:
        out.append(varint(chart.height) + (b"" if square else varint(chart.width)))
    if dyadic and fineness is not None:
        out.append(bytes([fineness]))
        for chart in charts:
            for low, high in ((chart.s0, chart.s1), (chart.t0, chart.t1)):
                out += [varint(int(low * 2**fineness)), varint(int((high - low) * 2**fineness) - 1)]
    elif not whole:
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
    patches = list(range(len(surface.patches)))
    if not flags & _BY_PATCH:
        count = fields.varint("number of charts", MAX_CHARTS, 1)
        patches = [fields.varint("patch of a chart", len(surface.patches) - 1) for _ in range(count)]
    sizes: list[tuple[int, int]] = []
    texels = 0
    for _ in patches[:1] if flags & _SAME else patches:
        height = fields.varint("height of a chart", MAX_CHART, 1)
        width = height if flags & _SQUARE else fields.varint("width of a chart", MAX_CHART, 1)
        sizes.append((height, width))
        texels += height * width * (len(patches) if flags & _SAME else 1)
    if texels > MAX_TEXELS:
        raise fields.error(f"layout has {texels} texels; allowed: {MAX_TEXELS}")
    sizes = sizes * len(patches) if flags & _SAME else sizes
    if flags & _WHOLE:
        charts = [Chart(patch, *size) for patch, size in zip(patches, sizes, strict=True)]
    else:
        read = _dyadic(fields) if flags & _DYADIC else _rectangle
        charts = [Chart(patch, *size, *read(fields)) for patch, size in zip(patches, sizes, strict=True)]
    fields.end("layout")
    return tuple(charts), scale


def _rectangle(fields: ByteReader) -> tuple[float, float, float, float]:
    s0, s1, t0, t1 = (fields.float64(name) for name in ("s0", "s1", "t0", "t1"))
    if not (0 <= s0 < s1 <= 1 and 0 <= t0 < t1 <= 1):
        raise fields.error("a chart covers parameters outside 0 to 1, or none")
    return s0, s1, t0, t1


def _dyadic(fields: ByteReader) -> Callable[[ByteReader], tuple[float, float, float, float]]:
    unit = 1 << fields.byte("fineness of the charts", _FINEST)

    def read(fields: ByteReader) -> tuple[float, float, float, float]:
        ends = []
        for _ in range(2):
            low = fields.varint("start of a chart", unit - 1)
            ends += [low / unit, (low + 1 + fields.varint("extent of a chart", unit - 1 - low)) / unit]
        return ends[0], ends[1], ends[2], ends[3]

    return read
