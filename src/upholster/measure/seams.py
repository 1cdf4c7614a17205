"""Whether seams show: differences across them over differences elsewhere."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts.seams import find_seams
from upholster.charts.transitions import Transition, transitions
from upholster.errors import InputError
from upholster.geometry import Surface
from upholster.measure.samples import SEED, bilinear, coded
from upholster.quilt import Texels
from upholster.quilt.warp_field import WarpField
from upholster.types import FloatArray, PixelArray

__all__ = ["MeanDifference", "WrapSeams", "edge_seam_ratio", "wrap_seams"]

MOST_MEETINGS = 2048
MOST_PAIRS = 2**17
PER_TEXEL = 4
LINE_PAIRS = 4096


@dataclass
class MeanDifference:
    """A mean of absolute differences of sRGB-coded samples, added up part by part."""

    total: float = 0.0
    count: int = 0

    def add(self, one: NDArray[np.float32], other: NDArray[np.float32]) -> None:
        """Add the differences of two arrays of samples."""
        self.total += float(np.abs(one - other).sum(dtype=np.float64))
        self.count += one.size

    def over(self, other: "MeanDifference") -> float | None:
        """Return this mean over another: None if there is nothing here, 1 where there is no difference."""
        if not self.count or not other.count:
            return None
        here, there = self.total / self.count, other.total / other.count
        if there == 0:
            return 1.0 if here == 0 else float("inf")
        return here / there


def edge_seam_ratio(surface: Surface, texels: Texels, *, fields: Sequence[WarpField] = ()) -> float | None:
    """Measure whether the edges of charts show: both those of faces, and those between charts of a face.

    The mean absolute difference between a point before an edge and one as far beyond it, over the same
    between points inside the charts, about random lines parallel to the edge. Points lie ½ to 1 texel from
    the edge (of the coarser side), straight across it in the unfolded tangent planes; inside, the same step
    of the exemplar apart, so that neither charts of unequal size nor a change of scale or direction count as
    seams. Texels are interpolated bilinearly on both sides and inside alike. Values are sRGB-coded, all
    channels weigh alike: 1.0 is invisible, more shows, less is blur. At most 2048 edges, and some 2^17 pairs
    are looked at.

    Parameters
    ----------
    surface
        What the charts lie on: says which edges meet.
    texels
        The result.
    fields
        Each chart's warp field, as in `Quilt.fields`.

    Returns
    -------
    float or None
        The ratio, 0 or more; 1.0 where neither shows any difference, infinite where only the edges do; None
        where no charts meet.

    Raises
    ------
    InputError
        If a chart names a face that the surface does not have, or fields are not one for each chart.

    References
    ----------
    The quotient of the boundary's gradient and the interior's is the usual blocking measure: Wang, Sheikh,
    Bovik: No-reference perceptual quality assessment of JPEG compressed images, ICIP 2002, eq. 1 and 3.
    """
    if fields and len(fields) != len(texels.charts):
        raise InputError(f"there are {len(fields)} fields; allowed: none, or one for each chart")
    rng = np.random.default_rng(SEED)
    found = find_seams(surface, texels.charts)
    chosen = [found[n] for n in rng.permutation(len(found))[:MOST_MEETINGS]]
    if not chosen:
        return None
    most = max(64, MOST_PAIRS // len(chosen))
    across, inside = MeanDifference(), MeanDifference()
    for transition in transitions(surface, texels.charts, chosen):
        index = transition.seam.chart
        field = fields[index] if fields else WarpField.identity()
        _add_seam(transition, texels.arrays, field, most, rng, across, inside)
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
        5th and 95th percentile of the same ratio for one row line and one column line anywhere inside: within
        them the wrapped edges are lines like any other.
    """

    ratio: float
    low: float
    high: float


def wrap_seams(image: PixelArray) -> WrapSeams | None:
    """Measure whether an image repeats without seams, laid side by side and one below the other.

    The mean absolute difference between the first and the last row and column, over the same between
    neighbouring rows and columns. Values are sRGB-coded, all channels weigh alike. Wrapped edges are but two
    lines, and lines of a regular texture differ: the percentiles, over 4096 random pairs of lines, tell how
    much.

    Parameters
    ----------
    image
        (h, w, C): the image.

    Returns
    -------
    WrapSeams or None
        The ratio and its range; None for an image of a single row or column. A ratio is 1.0 where nothing
        differs anywhere, and infinite where only the wrapped edges do.

    References
    ----------
    As for `edge_seam_ratio`.
    """
    if min(image.shape[:2]) < 2:
        return None
    values = coded(image)
    # Sums over the lines, so that the longer ones count for more.
    rows, columns = (np.abs(np.diff(values, axis=axis)).sum(axis=(1 - axis, 2)) for axis in (0, 1))
    whole = float(rows.mean() + columns.mean())
    wrapped = float(np.abs(values[-1] - values[0]).sum() + np.abs(values[:, -1] - values[:, 0]).sum())
    if whole == 0:
        return WrapSeams(1.0 if wrapped == 0 else float("inf"), 1.0, 1.0)
    rng = np.random.default_rng(SEED)
    any_lines = rng.choice(rows, LINE_PAIRS) + rng.choice(columns, LINE_PAIRS)
    low, high = np.percentile(any_lines / whole, (5, 95)).tolist()
    return WrapSeams(wrapped / whole, low, high)


def _add_seam(
    transition: Transition,
    arrays: Sequence[PixelArray],
    field: WarpField,
    most: int,
    rng: np.random.Generator,
    across: MeanDifference,
    inside: MeanDifference,
) -> None:
    """Add the differences across one seam of two charts, and those on as many lines inside the first."""
    m = transition.seam
    own, other = arrays[m.chart], arrays[m.other_chart]
    down = bool(m.edge & 1)  # the edge runs along the rows' axis
    extent = own.shape[1 if down else 0]
    inward = 1.0 if m.edge in (0, 3) else -1.0
    count = min(most, max(8, round(PER_TEXEL * (m.stop - m.start))))
    along = rng.uniform(m.start, m.stop, count) - 0.5
    edge = np.full(count, transition.line)
    # How far a step across the edge goes on the other chart: points there lie ½ texel inside it at least.
    *_, matrices = transition.apply(*((along, edge) if down else (edge, along)))
    step = np.abs(matrices[:, 0 if m.other_edge in (0, 2) else 1, 1 if down else 0])
    with np.errstate(divide="ignore"):
        depth = rng.uniform(0.5, 1.0, count) * np.maximum(1.0, 1.0 / step)
    sound = np.isfinite(depth) & (2 * np.ceil(depth) <= extent - 1)
    along, depth, edge = along[sound], depth[sound], edge[sound]
    if not len(along):
        return
    before, beyond = edge + inward * depth, edge - inward * depth
    rows, columns, _ = transition.apply(*((along, beyond) if down else (beyond, along)))
    across.add(_at(own, along, before, down), bilinear(other, rows, columns))
    # Inside, the same step in the exemplar, which may run otherwise on the chart, and half of it on either
    # side of a line between texels, as at the edge.
    reach = np.ceil(depth)
    line = np.floor(reach + rng.uniform(0, 1, len(along)) * (extent - 1 - 2 * reach)) + 0.5
    length = own.shape[0 if down else 1]
    beside = np.clip(along, np.minimum(reach, length / 2), np.maximum(length - 1 - reach, length / 2))
    turned = np.linalg.solve(_matrices(field, beside, line, down), _matrices(field, along, edge, down))
    half = depth[:, None] * turned[:, :, 1 if down else 0]
    rows, columns = (beside, line) if down else (line, beside)
    ends = [bilinear(own, rows + sign * half[:, 0], columns + sign * half[:, 1]) for sign in (-1, 1)]
    inside.add(*ends)


def _at(array: PixelArray, along: FloatArray, across: FloatArray, down: bool) -> NDArray[np.float32]:
    return bilinear(array, *((along, across) if down else (across, along)))


def _matrices(field: WarpField, along: FloatArray, across: FloatArray, down: bool) -> FloatArray:
    """Return M (n, 2, 2) in exemplar pixels per texel."""
    places = (along, across) if down else (across, along)
    return field.at(*(np.rint(place) for place in places))
