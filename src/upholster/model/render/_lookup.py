"""Texture look-up, for kernels: bilinear, between levels, and over a footprint."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.model.render.texture import MipPyramid
from upholster.runtime.jit import inline

__all__ = ["Color", "Pair", "filtered", "texture_at"]

Color = tuple[float, float, float, float]
Pair = tuple[float, float]
Single = NDArray[np.float32]

# A sample's footprint on the texture is covered by up to this many look-ups in a row.
PROBES = 4


@inline
def _texel(texels: Single, start: int, height: int, width: int, x: float, y: float) -> Color:
    """Return the bilinear look-up of one level at (x, y) in its texels, clamped to the image."""
    x = min(max(x - 0.5, 0.0), width - 1.0)
    y = min(max(y - 0.5, 0.0), height - 1.0)
    column, row = int(x), int(y)
    fx, fy = np.float32(x - column), np.float32(y - row)
    a = start + row * width + column
    right = 1 if column + 1 < width else 0
    down = width if row + 1 < height else 0
    one = np.float32(1.0)
    wa, wb, wc, wd = (one - fx) * (one - fy), fx * (one - fy), (one - fx) * fy, fx * fy
    b, c, d = a + right, a + down, a + right + down
    return (
        wa * texels[a, 0] + wb * texels[b, 0] + wc * texels[c, 0] + wd * texels[d, 0],
        wa * texels[a, 1] + wb * texels[b, 1] + wc * texels[c, 1] + wd * texels[d, 1],
        wa * texels[a, 2] + wb * texels[b, 2] + wc * texels[c, 2] + wd * texels[d, 2],
        wa * texels[a, 3] + wb * texels[b, 3] + wc * texels[c, 3] + wd * texels[d, 3],
    )


@inline
def texture_at(pyramid: MipPyramid, u: float, v: float, lod: float) -> Color:
    """Return the trilinear look-up of a pyramid at (u, v) and level `lod`: colour times alpha, and alpha."""
    coarsest = pyramid.first + len(pyramid.levels) - 1.0
    level = int(min(max(lod, float(pyramid.first)), coarsest))
    blend: Any = np.float32(min(lod, coarsest) - level)
    scale = 1.0 / (1 << level)
    x, y = u * pyramid.width * scale, v * pyramid.height * scale
    start, height, width = pyramid.levels[level - pyramid.first]
    r, g, b, a = _texel(pyramid.texels, start, height, width, x, y)
    if blend > 0.0:
        start, height, width = pyramid.levels[level - pyramid.first + 1]
        r1, g1, b1, a1 = _texel(pyramid.texels, start, height, width, 0.5 * x, 0.5 * y)
        r, g, b, a = r + blend * (r1 - r), g + blend * (g1 - g), b + blend * (b1 - b), a + blend * (a1 - a)
    return r, g, b, a


@inline
def filtered(pyramid: MipPyramid, u: float, v: float, one: Pair, two: Pair) -> Color:
    """Return the texture averaged over the footprint at (u, v) that two steps, in texels, span.

    The parallelogram is treated as an ellipse (greatest and least stretch of the steps' matrix), and up to
    PROBES look-ups are lined up along its long axis (J. McCormack et al.: Feline, SIGGRAPH 1999).
    """
    xx, yy, xy = one[0] ** 2 + two[0] ** 2, one[1] ** 2 + two[1] ** 2, one[0] * one[1] + two[0] * two[1]
    mean, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    root = math.sqrt(half * half + xy * xy)
    longest = math.sqrt(mean + root)
    shortest = math.sqrt(max(mean - root, 1e-30))
    # At most as many as the footprint has texels: a magnified texture needs one.
    probes = max(int(min(longest / shortest + 0.5, longest + 0.5, float(PROBES))), 1)
    lod = math.log2(max(longest / probes, shortest))
    if probes == 1:
        return texture_at(pyramid, u, v, lod)
    x, y = (half + root, xy) if half >= 0.0 else (xy, root - half)
    scale = longest / max(math.sqrt(x * x + y * y), 1e-30)
    du, dv = x * scale / pyramid.width, y * scale / pyramid.height
    r = g = b = a = 0.0
    for k in range(probes):
        at = (k + 0.5) / probes - 0.5
        red, green, blue, alpha = texture_at(pyramid, u + at * du, v + at * dv, lod)
        r, g, b, a = r + red, g + green, b + blue, a + alpha
    return r / probes, g / probes, b / probes, a / probes
