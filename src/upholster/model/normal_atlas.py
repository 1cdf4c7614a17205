"""The atlas of a normal map: gutters convert a neighbour's vectors to the chart's own frame."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, PixelArray, frozen_array
from upholster.base.vectors import unit_vectors
from upholster.charts.chart_seams import ChartSeam
from upholster.charts.tessellation.mesh import face_parameters, own_patches
from upholster.geometry.patches.surface import Surface
from upholster.model.atlas import Atlas, build_atlas, by_chart
from upholster.model.gutter import beyond, mixed_corner
from upholster.model.packing import AtlasCell, AtlasLayout
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels

__all__ = ["build_normal_atlas", "turn_gutters"]


def build_normal_atlas(
    surface: Surface,
    texels: Texels,
    seams: Sequence[ChartSeam],
    layout: AtlasLayout | None = None,
) -> Atlas:
    """Place the charts of a normal map in one image, as `build_atlas` does for colours.

    A neighbour's vectors are in its own tangent frame (`upholster.quilt.normal_painting.paint_normals`). In
    the gutter they are rotated by the angle between the two frames, at each point of the edge.

    Parameters
    ----------
    surface
        The surface with the charts.
    texels, seams, layout
        As for `build_atlas`; texels of 3 channels.

    Raises
    ------
    InputError
        As for `build_atlas`; for another number of channels.
    """
    if texels.arrays and texels.arrays[0].shape[2] != 3:
        raise InputError(f"normal map has {texels.arrays[0].shape[2]} channels; allowed: 3")
    atlas = build_atlas(texels, seams, layout)
    pixels = atlas.pixels.copy()
    turn_gutters(surface, texels.charts, by_chart(seams), dict(enumerate(atlas.cells)), pixels, 0)
    return replace(atlas, pixels=frozen_array(pixels))


def turn_gutters(
    surface: Surface,
    charts: Sequence[Chart],
    seams: Mapping[int, Sequence[ChartSeam]],
    cells: Mapping[int, AtlasCell],
    pixels: PixelArray,
    top: int,
) -> None:
    """Rotate the vectors in the gutters of some cells; row 0 of `pixels` is row `top` of the atlas."""
    for n, cell in cells.items():
        first = cell.top - top
        _turn_gutters(
            pixels[first : first + cell.height, cell.left : cell.left + cell.width],
            cell,
            [_angles(surface, charts, n, edge, seams.get(n, ())) for edge in range(4)],
        )


def _turn_gutters(pixels: PixelArray, cell: AtlasCell, angles: Sequence[FloatArray]) -> None:
    """Rotate the vectors in a cell's gutters by angles per edge and texel along it."""
    top, left = cell.row - cell.top, cell.column - cell.left
    bottom, right = top + cell.chart.height, left + cell.chart.width
    # For each edge the gutter beyond it, (texels along the edge, across it outward, 3).
    bands = (
        pixels[:top, left:right][::-1].swapaxes(0, 1),
        pixels[top:bottom, right:],
        pixels[bottom:, left:right].swapaxes(0, 1),
        pixels[top:bottom, :left][:, ::-1],
    )
    for band, angle in zip(bands, angles, strict=True):
        turned = np.flatnonzero(angle)
        band[turned] = _turned(band[turned], angle[turned, None])
    pixels[:top, :left] = mixed_corner(bands[0][0], bands[3][0])[::-1, ::-1]
    pixels[:top, right:] = mixed_corner(bands[0][-1], bands[1][0])[::-1]
    pixels[bottom:, :left] = mixed_corner(bands[2][0], bands[3][-1])[:, ::-1]
    pixels[bottom:, right:] = mixed_corner(bands[2][-1], bands[1][-1])


def _angles(
    surface: Surface, charts: Sequence[Chart], index: int, edge: int, seams: Sequence[ChartSeam]
) -> FloatArray:
    """Return for each texel along an edge angles from the chart's frame to its neighbour's: 0 at borders."""
    count = charts[index].height if edge & 1 else charts[index].width
    angles = np.zeros(count)
    for seam in seams:
        if seam.edge != edge:
            continue
        mine, where = beyond(seam, count)
        if not len(where):
            continue
        own = np.arange(mine.start, mine.stop, dtype=np.float64) + 0.5
        along, up = _frame(surface, charts[index], edge, own)
        other, _ = _frame(surface, charts[seam.other_chart], seam.other_edge, where)
        angles[mine] = np.arctan2((other * up).sum(-1), (other * along).sum(-1))
    return angles


def _frame(surface: Surface, chart: Chart, edge: int, at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return T and B, unit vectors, at places along a chart's edge, in texels."""
    fixed = np.full_like(at, (0.0, chart.width, chart.height, 0.0)[edge])
    at = np.clip(at, 0.0, chart.height if edge & 1 else chart.width)
    rows, columns = (at, fixed) if edge & 1 else (fixed, at)
    face, chart = own_patches(surface, chart)
    _, by_s, by_t = face.derivatives(*face_parameters(chart, rows, columns))
    return unit_vectors(by_t), unit_vectors(np.cross(np.cross(by_s, by_t), by_t))


def _turned(samples: PixelArray, angles: FloatArray) -> PixelArray:
    top = 1.0 if samples.dtype.kind == "f" else float(np.iinfo(samples.dtype).max)
    x, y = samples[..., 0] - top / 2, samples[..., 1] - top / 2
    sine, cosine = np.sin(angles), np.cos(angles)
    turned = samples.astype(np.float64)
    turned[..., 0] = top / 2 + (x * cosine - y * sine)
    turned[..., 1] = top / 2 + (x * sine + y * cosine)
    return (turned if top == 1.0 else np.clip(np.rint(turned), 0, top)).astype(samples.dtype)
