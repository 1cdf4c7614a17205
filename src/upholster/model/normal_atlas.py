"""The atlas of a normal map: what gutters take over from a neighbour is told in the chart's own frame."""

from dataclasses import replace

import numpy as np

from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.model.atlas import Atlas, AtlasCell, build_atlas
from upholster.model.gutter import _corner
from upholster.quilt.model import Texels
from upholster.types import FloatArray, PixelArray, frozen_array

__all__ = ["build_normal_atlas"]


def build_normal_atlas(
    surface: Surface, texels: Texels, *, gutter: int = 16, threads: int | None = None
) -> Atlas:
    """Pack the charts of a normal map in one image, as `build_atlas` does for colours.

    A neighbour's vectors lie in its own tangent frame (`upholster.quilt.paint_normals`). In the gutter
    they are turned by the angle between the two frames, at each point of the edge.

    Parameters
    ----------
    surface, texels, gutter, threads
        As for `build_atlas`; texels of 3 channels.

    Raises
    ------
    InputError
        As for `build_atlas`; for another number of channels.
    """
    if texels.arrays[0].shape[2] != 3:
        raise InputError(f"normal map has {texels.arrays[0].shape[2]} channels; allowed: 3")
    atlas = build_atlas(surface, texels, gutter=gutter, threads=threads)
    pixels = atlas.pixels.copy()
    for cell in atlas.cells:
        _turn_gutters(
            pixels[cell.top : cell.top + cell.height, cell.left : cell.left + cell.width], cell, surface
        )
    return replace(atlas, pixels=frozen_array(pixels))


def _turn_gutters(pixels: PixelArray, cell: AtlasCell, surface: Surface) -> None:
    top, left = cell.row - cell.top, cell.column - cell.left
    bottom, right = top + cell.chart.height, left + cell.chart.width
    # Of each edge: the gutter beyond it, (texels along the edge, across it outward, 3).
    bands = (
        pixels[:top, left:right][::-1].swapaxes(0, 1),
        pixels[top:bottom, right:],
        pixels[bottom:, left:right].swapaxes(0, 1),
        pixels[top:bottom, :left][:, ::-1],
    )
    for edge, band in enumerate(bands):
        angles = _angles(surface, cell.chart.patch, edge, band.shape[0])
        turned = np.flatnonzero(angles)
        band[turned] = _turned(band[turned], angles[turned, None])
    pixels[:top, :left] = _corner(bands[0][0], bands[3][0])[::-1, ::-1]
    pixels[:top, right:] = _corner(bands[0][-1], bands[1][0])[::-1]
    pixels[bottom:, :left] = _corner(bands[2][0], bands[3][-1])[:, ::-1]
    pixels[bottom:, right:] = _corner(bands[2][-1], bands[1][-1])


def _angles(surface: Surface, patch: int, edge: int, count: int) -> FloatArray:
    """Return at each texel along an edge the angle of the neighbour's frame in the own one: 0 at borders."""
    angles = np.zeros(count)
    centres = (np.arange(count) + 0.5) / count
    for there in surface.neighbours(patch, edge):
        first, last = np.searchsorted(centres, (there.start, there.stop))
        if first == last:
            continue
        own = centres[first:last]
        slope = (there.other_stop - there.other_start) / (there.stop - there.start)
        other = np.clip(there.other_start + slope * (own - there.start), 0.0, 1.0)
        along, up = _frame(surface, patch, edge, own)
        beyond, _ = _frame(surface, there.other_patch, there.other_edge, other)
        angles[first:last] = np.arctan2((beyond * up).sum(-1), (beyond * along).sum(-1))
    return angles


def _frame(surface: Surface, patch: int, edge: int, at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return T and B, unit vectors, along an edge."""
    fixed = np.full_like(at, float(edge in (1, 2)))
    s, t = (fixed, at) if edge in (0, 2) else (at, fixed)
    _, by_s, by_t = surface.patches[patch].derivatives(s, t)
    up = np.cross(np.cross(by_s, by_t), by_t)
    tangent, bitangent = (
        v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-300) for v in (by_t, up)
    )
    return tangent, bitangent


def _turned(samples: PixelArray, angles: FloatArray) -> PixelArray:
    top = 1.0 if samples.dtype.kind == "f" else float(np.iinfo(samples.dtype).max)
    x, y = samples[..., 0] - top / 2, samples[..., 1] - top / 2
    sine, cosine = np.sin(angles), np.cos(angles)
    turned = samples.astype(np.float64)
    turned[..., 0] = top / 2 + (x * cosine - y * sine)
    turned[..., 1] = top / 2 + (x * sine + y * cosine)
    return (turned if top == 1.0 else np.clip(np.rint(turned), 0, top)).astype(samples.dtype)
