"""How large an exemplar's structure is, by its autocorrelation: what a block must contain."""

import numpy as np
from numpy.typing import NDArray

from upholster.elements import find_lattice
from upholster.methods.quilt.features import pca_features
from upholster.methods.working_form import working_form
from upholster.stages import stage
from upholster.types import FloatArray, IntArray, PixelArray

__all__ = ["RADIUS", "block_size", "correlation_peaks", "shifted_products"]

_LOOKED_AT = 256
"""Pixels of the shorter side that are looked at: larger exemplars are reduced first."""

_LONGEST = 512
"""Pixels of the longer side that are looked at."""

_LEAST, _MOST = 24, 512
"""Sides of a block in pixels, whatever the structure."""

_SHARE, _PERIODIC_SHARE = 5 / 16, 7 / 16
"""Most of the exemplar's shorter side that a block takes. More leaves so few places that repeats show; where
the texture repeats by itself, they do not."""

_ELEMENT = 0.2
"""Correlation at an element's size."""

_GROWTH = 4
"""Pixels of a block per pixel of an element's size, above the least."""

_PERIOD_SHARE = 1.1
"""Periods in a block."""

_REPEATING = 0.3
"""Correlation from which on a texture is taken to repeat."""

_AS_HIGH = 0.75
"""How high a peak is, at least, that spans the lattice, as a share of the highest."""

RADIUS = 3
"""A peak is the highest value so many pixels round it."""


@stage
def block_size(exemplar: PixelArray) -> int:
    """Return the side of a block, in pixels, that suits an exemplar.

    It grows with the size of the texture's elements: the distance at which the autocorrelation of the main
    colour, averaged over all directions, has fallen to 0.2. Where the texture repeats, a block also holds a
    whole cell of its lattice: that of its waves, see `upholster.elements`, and that of the two shortest of
    the autocorrelation's high peaks that are not parallel. Sums are exact: the same exemplar gives the same
    size on every machine.

    Parameters
    ----------
    exemplar
        (H, W, C), any number of channels; uint8, uint16 or float32.

    Returns
    -------
    int
        A multiple of 4: 24 to 512, but at most about 5/16 of the shorter side, or 7/16 where the texture
        repeats, and never less than 8.

    References
    ----------
    Liu, Collins, Tsin: A computational model for periodic pattern perception based on frieze and wallpaper
    groups, PAMI 26 (2004), on finding a lattice by the autocorrelation's peaks.
    """
    shorter = min(exemplar.shape[:2])
    by = -(-shorter // _LOOKED_AT)
    plane = pca_features(_reduced(exemplar, by), most=1)[:_LONGEST, :_LONGEST, 0].astype(np.int64)
    plane -= int(plane.sum()) // plane.size
    reach = min(plane.shape) // 2
    # Whole numbers far below 2^53: rounding takes back what the transform lost.
    products = np.rint(shifted_products(plane, (reach, reach)))
    rows, columns = np.arange(reach + 1)[:, None], np.abs(np.arange(-reach, reach + 1))
    pairs = (plane.shape[0] - rows) * (plane.shape[1] - columns)
    spread = products[0, reach] / plane.size
    if spread == 0:  # nothing varies
        return _bounded(_LEAST, _SHARE * shorter)
    size = _bounded(_LEAST + _GROWTH * by * _element(products, pairs, spread), _SHARE * shorter)
    lattice = find_lattice(exemplar)
    cell = max(by * _cell(products / (pairs * spread)), 0.0 if lattice is None else lattice.cell)
    if 0 < cell <= _PERIODIC_SHARE * shorter:
        size = max(size, _bounded(_PERIOD_SHARE * cell, _PERIODIC_SHARE * shorter))
    return size


def shifted_products(plane: NDArray[np.int64] | FloatArray, reach: tuple[int, int]) -> FloatArray:
    """Return Σ x(p)·x(p + d) over all places where both exist, for all shifts d up to a distance.

    Parameters
    ----------
    plane
        (H, W).
    reach
        Rows and columns of the farthest shift.

    Returns
    -------
    ndarray
        (rows + 1, 2 · columns + 1) float64, shifts of 0…rows and −columns…columns. The others mirror these.
    """
    height, width = plane.shape
    rows, columns = np.arange(reach[0] + 1)[:, None], np.arange(-reach[1], reach[1] + 1)
    # Zeros beyond the borders keep shifts from wrapping round.
    sizes = _smooth(height + reach[0]), _smooth(width + reach[1])
    spectrum = np.fft.rfft2(plane, sizes)
    found: FloatArray = np.fft.irfft2(np.abs(spectrum) ** 2, sizes)[rows, columns]
    return found


def correlation_peaks(correlation: FloatArray, least: float) -> tuple[IntArray, IntArray]:
    """Return where an autocorrelation is at least `least` and nowhere higher within `RADIUS` each way.

    Parameters
    ----------
    correlation
        (rows + 1, 2 · columns + 1), at shifts as `shifted_products` has them; larger than `RADIUS` each way.
    least
        Least height.

    Returns
    -------
    rows, columns
        (n,) the shifts, row by row: rows > 0, or rows = 0 and columns > 0. Of those so near the farthest
        shifts that it may rise beyond, none.
    """
    height, middle = len(correlation), correlation.shape[1] // 2
    # Rows above the centre mirror those below it.
    whole = np.concatenate([correlation[:0:-1, ::-1], correlation])
    size = 2 * RADIUS + 1
    highest = whole[: -size + 1]
    for k in range(1, size):
        highest = np.maximum(highest, whole[k : len(whole) - size + 1 + k])
    around = highest[:, : -size + 1]
    for k in range(1, size):
        around = np.maximum(around, highest[:, k : highest.shape[1] - size + 1 + k])
    inner = whole[RADIUS:-RADIUS, RADIUS:-RADIUS]
    rows, columns = np.nonzero((inner == around) & (inner >= least))
    rows, columns = rows - (height - 1 - RADIUS), columns - (middle - RADIUS)
    half = (rows > 0) | ((rows == 0) & (columns > 0))
    return rows[half], columns[half]


def _smooth(size: int) -> int:
    """Return the next size whose only factors are 2, 3 and 5: fast to transform."""
    while True:
        rest = size
        for factor in (2, 3, 5):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return size
        size += 1


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
    # The distance at which the correlation, averaged round the centre, has fallen to _ELEMENT.
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


def _cell(correlation: FloatArray) -> int:
    # Side of the square that holds a cell of the lattice at which the texture repeats; 0: it does not.
    rows, columns = correlation_peaks(correlation, _REPEATING)
    if not len(rows):
        return 0
    heights = correlation[rows, len(correlation) - 1 + columns]
    high = heights >= _AS_HIGH * heights.max()
    rows, columns = rows[high], columns[high]
    lengths = rows**2 + columns**2
    order = np.argsort(lengths, kind="stable")
    y, x = int(rows[order[0]]), int(columns[order[0]])
    for n in order[1:]:
        v, u = int(rows[n]), int(columns[n])
        # At least 30° apart.
        if 4 * (y * u - x * v) ** 2 >= int(lengths[order[0]] * lengths[n]):
            return max(abs(y) + abs(v), abs(x) + abs(u))
    return 0
