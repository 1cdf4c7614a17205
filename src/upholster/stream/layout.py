"""The layout chunk: charts, with what is alike told once."""

import struct
from collections.abc import Sequence

from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.stream.fields import Fields, varint
from upholster.synthesis import Chart
from upholster.synthesis.layout import MAX_CHART, MAX_TEXELS

__all__ = ["MAX_CHARTS", "pack_layout", "parse_layout"]

MAX_CHARTS = 2**18

_BY_PATCH, _WHOLE, _SAME, _SQUARE = 1, 2, 4, 8


def pack_layout(charts: Sequence[Chart], surface: Surface) -> bytes:
    """Return the charts as bytes.

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
    out = [bytes([_BY_PATCH * by_patch | _WHOLE * whole | _SAME * same | _SQUARE * square])]
    if not by_patch:
        out += [varint(len(charts)), *(varint(chart.patch) for chart in charts)]
    for chart in charts[:1] if same else charts:
        out.append(varint(chart.height) + (b"" if square else varint(chart.width)))
    if not whole:
        out += [struct.pack("<4d", chart.s0, chart.s1, chart.t0, chart.t1) for chart in charts]
    return b"".join(out)


def parse_layout(fields: Fields, surface: Surface) -> tuple[Chart, ...]:
    """Read the charts back.

    Raises
    ------
    FormatError
        If they are malformed or outside what is allowed.
    """
    flags = fields.byte("flags of the layout", 15)
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
        charts = []
        for patch, size in zip(patches, sizes, strict=True):
            s0, s1, t0, t1 = (fields.float64(name) for name in ("s0", "s1", "t0", "t1"))
            if not (0 <= s0 < s1 <= 1 and 0 <= t0 < t1 <= 1):
                raise fields.error("a chart covers parameters outside 0 to 1, or none")
            charts.append(Chart(patch, *size, s0, s1, t0, t1))
    fields.end("layout")
    return tuple(charts)
