"""The size of an exemplar's structure, which a block must contain, measured by its autocorrelation."""

import numpy as np
from numpy.typing import NDArray

from upholster.elements import find_lattice
from upholster.methods.quilt.features import pca_features
from upholster.methods.working_form import working_form
from upholster.stages import stage
from upholster.types import FloatArray, IntArray, PixelArray

__all__ = ["RADIUS", "block_size", "correlation_peaks", "shifted_products"]

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

_REPEATING = 0.3
"""Minimum correlation at a peak of a texture that counts as repeating."""

_AS_HIGH = 0.75
"""Minimum height of a peak that spans the lattice, as a fraction of the highest peak."""

RADIUS = 3
"""A peak is the highest value within this many pixels."""


@stage
def block_size(exemplar: PixelArray) -> int:
    """Return the side of a block, in pixels, that suits an exemplar.

    It grows with the size of the texture's elements: the distance at which the autocorrelation of the main
    colour, averaged over all directions, has fallen to 0.2. Where the texture repeats, a block also contains
    a complete cell of its lattice: that of its waves, see `upholster.elements`, and that of the two shortest
    high peaks of the autocorrelation that are not parallel. Sums are exact, so the same exemplar gives the
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
    # The exact products are integers far below 2^53, so rounding removes the transform's error.
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
    """Return Σ x(p)·x(p + d) over all places p where both exist, for all shifts d up to a maximum.

    Parameters
    ----------
    plane
        (H, W).
    reach
        Rows and columns of the farthest shift.

    Returns
    -------
    ndarray
        (rows + 1, 2 · columns + 1) float64, for shifts of 0…rows and −columns…columns. Shifts by negative
        rows mirror them.
    """
    height, width = plane.shape
    rows, columns = np.arange(reach[0] + 1)[:, None], np.arange(-reach[1], reach[1] + 1)
    # Zeros beyond the borders prevent shifts from wrapping around.
    sizes = _smooth(height + reach[0]), _smooth(width + reach[1])
    spectrum = np.fft.rfft2(plane, sizes)
    found: FloatArray = np.fft.irfft2(np.abs(spectrum) ** 2, sizes)[rows, columns]
    return found


def correlation_peaks(correlation: FloatArray, least: float) -> tuple[IntArray, IntArray]:
    """Return the peaks of an autocorrelation: at least `least`, and no higher value within `RADIUS` each way.

    Parameters
    ----------
    correlation
        (rows + 1, 2 · columns + 1), at the shifts of `shifted_products`; larger than `RADIUS` each way.
    least
        Minimum height.

    Returns
    -------
    rows, columns
        (n,) the shifts, row by row: rows > 0, or rows = 0 and columns > 0. Peaks within `RADIUS` of the
        largest shifts are left out, because the correlation may rise beyond.
    """
    height, middle = len(correlation), correlation.shape[1] // 2
    # Rows above the centre are the mirror image of those below it.
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
    """Return the next size whose only prime factors are 2, 3 and 5, which is fast to transform."""
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


def _cell(correlation: FloatArray) -> int:
    # Side of the square that contains a cell of the lattice of the texture; 0: the texture does not repeat.
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
