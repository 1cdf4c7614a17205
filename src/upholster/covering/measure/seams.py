"""Whether seams show: differences across them over differences elsewhere."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import PixelArray
from upholster.charts.charted_surface import charted_surface
from upholster.charts.creases import CREASE
from upholster.covering.measure.measure_rows import Row, figure
from upholster.covering.measure.places import SeamPlaces
from upholster.covering.measure.samples import SEED, bilinear, coded
from upholster.geometry.any_surface import AnySurface
from upholster.quilt.model import Texels
from upholster.quilt.warp_field import WarpField

__all__ = ["MeanDifference", "WrapSeams", "edge_seam_ratio", "wrap_seams"]

LINE_PAIRS = 4096

INSIDE = 32.0
"""An edge is compared with places up to this many steps straight inward from it."""


@dataclass
class MeanDifference:
    """A mean of absolute differences of sRGB-coded samples, accumulated part by part."""

    total: float = 0.0
    count: int = 0

    def add(self, one: NDArray[np.float32], other: NDArray[np.float32]) -> None:
        """Add the differences of two arrays of samples."""
        self.total += float(np.abs(one - other).sum(dtype=np.float64))
        self.count += one.size

    def over(self, other: "MeanDifference") -> float | None:
        """Return this mean over another: None if this one is empty, 1 if there is no difference."""
        if not self.count or not other.count:
            return None
        here, there = self.total / self.count, other.total / other.count
        if there == 0:
            return 1.0 if here == 0 else float("inf")
        return here / there


def edge_seam_ratio(
    surface: AnySurface, texels: Texels, *, fields: Sequence[WarpField] = (), crease: float = CREASE
) -> float | None:
    """Measure whether the edges of charts show: both those of faces, and those between charts of a face.

    The mean absolute difference between points on both sides of an edge, equally far from it, divided by that
    between points inside the charts, up to 32 texels from the edge. Points are ½ to 1 texel from the edge (of
    the coarser side), straight across it in the unfolded tangent planes. Inside, points are the same step of
    the exemplar apart, so that neither charts of unequal size nor a change of scale or direction count as
    seams. Texels are interpolated bilinearly in both cases. Values are sRGB-coded, all channels weigh the
    same: 1.0 is invisible, more shows, less is blur. Creases, over which the texture starts again, do not
    count. At most 2^17 pairs are examined.

    Parameters
    ----------
    surface
        The surface below the charts: it defines which edges meet.
    texels
        The result.
    fields
        Each chart's warp field, as in `Quilt.fields`.
    crease
        Degrees: edges at which the surface turns by at least this are creases.

    Returns
    -------
    float or None
        The ratio, 0 or more; 1.0 if neither shows any difference, infinite if only the edges do; None if no
        charts meet.

    Raises
    ------
    InputError
        If a chart names a face that the surface does not have, or there is not one field per chart.

    References
    ----------
    The quotient of the boundary's gradient and the interior's is the usual blocking measure: Wang, Sheikh,
    Bovik: No-reference perceptual quality assessment of JPEG compressed images, ICIP 2002, eq. 1 and 3.
    """
    if fields and len(fields) != len(texels.charts):
        raise InputError(f"there are {len(fields)} fields; allowed: none, or one for each chart")
    charted = charted_surface(surface, texels.charts)
    found = SeamPlaces.of(charted, crease=crease)
    if found is None:
        return None
    found = found.chosen(~found.is_sharp)
    rng = np.random.default_rng(SEED)
    depth, aside = rng.uniform((0.5, 2.0), (1.0, INSIDE), (len(found.chart), 2)).T
    points = found.place + (depth * found.deep.max(axis=1))[:, None, None] * found.inward
    # Inside, around a place between texels, as on the edge.
    middles = found.place[:, 0] + np.rint((aside * found.deep[:, 0])[:, None] * found.inward[:, 0])
    across, inside = MeanDifference(), MeanDifference()
    for index, chart in enumerate(texels.charts):
        own = np.flatnonzero(found.chart[:, 0] == index)
        edge, middle, array = found.place[own, 0], middles[own], texels.arrays[index]
        # The same step in the exemplar, which may have another direction on the chart.
        field = fields[index] if fields else WarpField.identity()
        step = field.at(*(edge - 0.5).T) @ (points[own, 0] - edge)[:, :, None]
        half = np.linalg.solve(field.at(*(middle - 0.5).T), step)[:, :, 0]
        size = np.array((chart.height, chart.width))
        on_chart = (np.minimum(middle, size - middle) >= np.abs(half) + 0.5).all(axis=1)
        own, middle, half = own[on_chart], middle[on_chart], half[on_chart]
        shown = charted.lies_on(index, (0, 0), (chart.height, chart.width))[tuple(middle.astype(np.intp).T)]
        own, middle, half = own[shown], middle[shown], half[shown]
        inside.add(_at(array, middle - half), _at(array, middle + half))
        for other in np.unique(found.chart[own, 1]).tolist():
            met = own[found.chart[own, 1] == other]
            across.add(_at(array, points[met, 0]), _at(texels.arrays[other], points[met, 1]))
    return across.over(inside)


@dataclass(frozen=True, slots=True)
class WrapSeams:
    """Whether the wrapped edges of an image show.

    Attributes
    ----------
    ratio
        Differences across the wrapped edges over those everywhere: 1.0 is invisible, more shows, less is
        blur.
    low, high
        5th and 95th percentile of the same ratio for one row line and one column line anywhere inside. Within
        this range the wrapped edges are lines like any other.
    """

    ratio: float
    low: float
    high: float

    def rows(self) -> list[Row]:
        """Return the rows of a table."""
        return [
            ("seam ratio, wrapped edges", figure(self.ratio), "1: invisible"),
            ("  of any other line", f"{self.low:.3f} to {self.high:.3f}", "5 % to 95 %"),
        ]


def wrap_seams(image: PixelArray) -> WrapSeams | None:
    """Measure whether an image repeats without seams, side by side and one below the other.

    The mean absolute difference between the first and the last row and column, divided by that between
    neighbouring rows and columns. Values are sRGB-coded, all channels weigh the same. The wrapped edges are
    only two lines, and lines of a regular texture differ. The percentiles, over 4096 random pairs of lines,
    show how much.

    Parameters
    ----------
    image
        (h, w, C): the image.

    Returns
    -------
    WrapSeams or None
        The ratio and its range; None for an image of a single row or column. A ratio is 1.0 if nothing
        differs anywhere, and infinite if only the wrapped edges do.

    References
    ----------
    As for `edge_seam_ratio`.
    """
    if min(image.shape[:2]) < 2:
        return None
    values = coded(image)
    # Sums over the lines, so that longer lines count more.
    rows, columns = (np.abs(np.diff(values, axis=axis)).sum(axis=(1 - axis, 2)) for axis in (0, 1))
    whole = float(rows.mean() + columns.mean())
    wrapped = float(np.abs(values[-1] - values[0]).sum() + np.abs(values[:, -1] - values[:, 0]).sum())
    if whole == 0:
        return WrapSeams(1.0 if wrapped == 0 else float("inf"), 1.0, 1.0)
    rng = np.random.default_rng(SEED)
    any_lines = rng.choice(rows, LINE_PAIRS) + rng.choice(columns, LINE_PAIRS)
    low, high = np.percentile(any_lines / whole, (5, 95)).tolist()
    return WrapSeams(wrapped / whole, low, high)


def _at(array: PixelArray, places: NDArray[np.float64]) -> NDArray[np.float32]:
    # Samples at places (n, 2); texel (r, c) has its centre at (r + ½, c + ½).
    return bilinear(array, *(places - 0.5).T)
