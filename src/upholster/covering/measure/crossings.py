"""The two sides of a seam: how far apart they read, and how often there is a cut along it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.charts.charted_surface import ChartedSurface, charted_surface
from upholster.covering.measure.measure_rows import Row
from upholster.covering.measure.samples import SEED
from upholster.geometry.any_surface import AnySurface
from upholster.quilt.displacement import warped_sources
from upholster.quilt.model import Quilt

__all__ = ["Crossings", "crossings"]

_MOST = 2**14
"""The most edges of triangles that are examined, on seams and elsewhere."""

_PLACES = (0.2, 0.4, 0.6, 0.8)
"""The places on each edge, as shares of its length."""

_ASIDE = 0.6
"""Steps from the edge, to either side, at which the placement that shows is looked up."""

_CUT = 2.5
"""Pixels: if the sides of an edge read farther apart, the texture is cut there."""


@dataclass(frozen=True, slots=True)
class Crossings:
    """Differences between the two sides of edges of triangles.

    Attributes
    ----------
    apart, apart_most
        Exemplar pixels between what the two sides of a seam read, where the texture continues across it: the
        median, and the 95th percentile.
    cuts, cuts_inside
        The share of seams, by length, that a cut follows, and that of triangles' edges inside charts.
    """

    apart: float
    apart_most: float
    cuts: float
    cuts_inside: float

    def rows(self) -> list[Row]:
        """Return the rows of a table."""
        apart = f"{self.apart:.2f}, 95 % {self.apart_most:.2f} px"
        cuts = f"{100 * self.cuts:.1f} %, {100 * self.cuts_inside:.1f} % inside"
        return [
            ("seams read apart by", apart, "0: continues exactly"),
            ("  cuts lie along", cuts, "equal: no seam shows"),
        ]


def crossings(surface: AnySurface, quilt: Quilt) -> Crossings | None:
    """Measure a quilt on its surface; None if there are no seams.

    The placement is looked up a little to either side of an edge, and evaluated on the edge itself. At most
    16,384 edges of triangles are examined on seams, and as many inside charts.
    """
    charted = charted_surface(surface, quilt.charts)
    once = charted.across > 3 * np.arange(len(charted.chart))[:, None] + 2
    once &= (charted.chart[:, None] >= 0) & (charted.chart[charted.across // 3] >= 0)
    at_seams = _apart(charted, quilt, charted.seams[:, :2])
    inside = _apart(charted, quilt, np.argwhere(once & ~charted.is_seam))
    if at_seams is None:
        return None
    apart, weights = at_seams
    goes_on = np.sort(apart[apart <= _CUT])
    median, most = np.quantile(goes_on, (0.5, 0.95)).tolist() if len(goes_on) else (0.0, 0.0)
    return Crossings(median, most, _cut(apart, weights), 0.0 if inside is None else _cut(*inside))


def _cut(apart: FloatArray, weights: FloatArray) -> float:
    return float((weights * (apart > _CUT)).sum() / weights.sum())


def _apart(
    charted: ChartedSurface, quilt: Quilt, edges: NDArray[np.int64]
) -> tuple[FloatArray, FloatArray] | None:
    # Pixels between what both sides of edges (n, 2), triangle and edge, read, and the edges' lengths.
    if not len(edges):
        return None
    edges = np.random.default_rng(SEED).permutation(edges)[:_MOST]
    triangle, edge = np.repeat(edges, len(_PLACES), axis=0).T
    share = np.tile(_PLACES, len(edges))
    other, its = np.divmod(charted.across[triangle, edge], 3)
    here = _read(charted, quilt, triangle, edge, share)
    there = _read(charted, quilt, other, its, 1 - share)
    ends = charted.places[triangle, (edge + 1) % 3] - charted.places[triangle, edge]
    apart: FloatArray = np.hypot(*(here - there).T)
    return apart, np.hypot(*ends.T)


def _read(
    charted: ChartedSurface,
    quilt: Quilt,
    triangle: NDArray[np.integer],
    edge: NDArray[np.integer],
    share: FloatArray,
) -> FloatArray:
    # The pixels (n, 2) that places of edges read, through the placement next to them in their triangles.
    first, last = charted.places[triangle, edge], charted.places[triangle, (edge + 1) % 3]
    place = first + share[:, None] * (last - first)
    inward = charted.places[triangle].mean(axis=1) - place
    near = place + _ASIDE * inward / np.maximum(np.hypot(*inward.T), 1e-9)[:, None]
    found = np.empty((len(place), 2))
    for n in np.unique(charted.chart[triangle]).tolist():
        own, chart = charted.chart[triangle] == n, quilt.charts[n]
        steps = np.clip(np.floor(near[own]).astype(np.int64), 0, (chart.height - 1, chart.width - 1))
        placed = quilt.on_chart(n)[quilt.labels[n][0].at(*steps.T)]
        rows, columns = np.rint(16 * place[own]).astype(np.int64).T
        found[own] = np.stack(warped_sources(quilt.fields[n], placed, rows, columns), axis=1) / 16
    return found
