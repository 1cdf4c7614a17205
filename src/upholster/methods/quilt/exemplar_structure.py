"""The size of an exemplar's structure, which a block must contain, measured by its autocorrelation."""

import numpy as np

from upholster.elements import find_lattice
from upholster.elements.autocorrelation import shifted_products
from upholster.methods.quilt.features import pca_features
from upholster.methods.working_form import working_form
from upholster.stages import stage
from upholster.types import FloatArray, IntArray, PixelArray

__all__ = ["block_size"]

_LOOKED_AT = 256
"""Maximum shorter side, in pixels, that is analysed: larger exemplars are reduced first."""

_LONGEST = 512
"""Maximum longer side, in pixels, that is analysed."""

_LEAST, _MOST = 24, 512
"""Minimum and maximum side of a block in pixels, for any structure."""

_SHARE, _PERIODIC_SHARE = 5 / 16, 7 / 16
"""Maximum side of a block as a fraction of the exemplar's shorter side, in general and for textures that
repeat. Larger blocks leave so few sources that repetitions are visible, except where the texture repeats."""

_ELEMENT = 0.2
"""An element's size is the distance at which the correlation has fallen to this value."""

_GROWTH = 4
"""Pixels of a block, above the minimum, per pixel of an element's size."""

_PERIOD_SHARE = 1.1
"""Minimum number of periods in a block."""


@stage
def block_size(exemplar: PixelArray) -> int:
    """Return the side of a block, in pixels, that suits an exemplar.

    It grows with the size of the texture's elements: the distance at which the autocorrelation of the main
    colour, averaged over all directions, has fallen to 0.2. Where the texture repeats, a block also contains
    a complete cell of its lattice, see `upholster.elements`. Sums are exact, so the same exemplar gives the
    same size on every machine.

    Parameters
    ----------
    exemplar
        (H, W, C), any number of channels; uint8, uint16 or float32.

    Returns
    -------
    int
        A multiple of 4: 24 to 512, but at most about 5/16 of the shorter side, or 7/16 where the texture
        repeats, and never less than 8.
    """
    shorter = min(exemplar.shape[:2])
    by = -(-shorter // _LOOKED_AT)
    plane = pca_features(_reduced(exemplar, by), most=1)[:_LONGEST, :_LONGEST, 0].astype(np.int64)
    plane -= int(plane.sum()) // plane.size
    reach = min(plane.shape) // 2
    # The exact products are integers far below 2^53, so rounding removes the transform's error.
    products = np.rint(shifted_products(plane, (reach, reach)))
    rows, columns = np.arange(reach + 1)[:, None], np.abs(np.arange(-reach, reach + 1))
    pairs = (plane.shape[0] - rows) * (plane.shape[1] - columns)
    spread = products[0, reach] / plane.size
    if spread == 0:  # nothing varies
        return _bounded(_LEAST, _SHARE * shorter)
    size = _bounded(_LEAST + _GROWTH * by * _element(products, pairs, spread), _SHARE * shorter)
    lattice = find_lattice(exemplar)
    if lattice is not None and lattice.cell <= _PERIODIC_SHARE * shorter:
        size = max(size, _bounded(_PERIOD_SHARE * lattice.cell, _PERIODIC_SHARE * shorter))
    return size


def _bounded(size: float, most: float) -> int:
    return max(8, 4 * int(min(max(size, _LEAST), _MOST, most) / 4 + 0.5))


def _reduced(image: PixelArray, by: int) -> PixelArray:
    # Means of by × by pixels, in working form.
    if by == 1:
        return image
    height, width = image.shape[0] // by, image.shape[1] // by
    form = working_form(image)
    total = np.zeros((height, width, image.shape[2]), np.uint32)
    for i in range(by):
        for j in range(by):
            total += form[i : by * height : by, j : by * width : by]
    # The working form's 10 bits, as 16-bit samples.
    return (total * 64 // (by * by)).astype(np.uint16)


def _element(products: FloatArray, pairs: IntArray, spread: float) -> float:
    # The distance at which the correlation, averaged over all directions, has fallen to _ELEMENT.
    reach = len(products) - 1
    squares = np.arange(reach + 1)[:, None] ** 2 + np.arange(-reach, reach + 1) ** 2
    rings = np.rint(np.sqrt(squares)).astype(np.int64)
    inside = rings <= reach
    sums = np.bincount(rings[inside], products[inside])
    means = sums / (np.bincount(rings[inside], pairs[inside]) * spread)
    below = np.flatnonzero(means < _ELEMENT)
    if not len(below):
        return float(reach)
    k = int(below[0])
    return float(k - 1 + (means[k - 1] - _ELEMENT) / (means[k - 1] - means[k]))
