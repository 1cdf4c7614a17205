"""Whether a sample is one texture, unlike sky over land, a frame, or an object against a background."""

import numpy as np

from upholster.base.types import PixelArray

__all__ = ["differing_region"]

_CELLS = 12
_DIFFERS = 0.15
"""Share of the range of colours: textures reach 0.1, photographs with a sky or a background 0.17 and more."""


def differing_region(pixels: PixelArray) -> str | None:
    """Return the large part of an image with the most different mean colour, in words; None: no part.

    Parameters
    ----------
    pixels
        (H, W, C) uint8, uint16 or float32, sRGB-coded; the first three channels count, or the first alone.
    """
    height, width, channels = pixels.shape
    if min(height, width) < _CELLS:
        return None
    top = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1.0
    rows, columns = (np.linspace(0, side, _CELLS + 1).astype(int)[:-1] for side in (height, width))
    sums = np.add.reduceat(
        np.add.reduceat(pixels[..., : 3 if channels >= 3 else 1], rows, 0, np.float64), columns, 1
    )
    area = np.diff([*rows, height])[:, None, None] * np.diff([*columns, width])[:, None]
    cells = np.clip(sums / area / top, 0, 1)
    row, column = np.mgrid[:_CELLS, :_CELLS]
    middle = np.maximum(abs(2 * row - _CELLS + 1), abs(2 * column - _CELLS + 1))
    regions = {
        "the upper half": row < _CELLS // 2,
        "the upper third": row < _CELLS // 3,
        "the lower third": row >= _CELLS - _CELLS // 3,
        "the left half": column < _CELLS // 2,
        "the rim": middle == _CELLS - 1,
        "the middle": middle < _CELLS // 2,
    }
    apart = {
        name: float(np.sqrt(((cells[inside].mean(axis=0) - cells[~inside].mean(axis=0)) ** 2).mean()))
        for name, inside in regions.items()
    }
    found = max(apart, key=lambda name: apart[name])
    return found if apart[found] > _DIFFERS else None
