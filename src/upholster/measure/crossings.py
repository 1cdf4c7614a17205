"""What lies on both sides of a seam: how far the two read apart, and how often a cut lies there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts.charted import ChartedSurface, charted_surface
from upholster.geometry import AnySurface
from upholster.measure.samples import SEED
from upholster.quilt import Quilt
from upholster.quilt.displacement import warped_sources
from upholster.types import FloatArray

__all__ = ["Crossings", "crossings"]

_MOST = 2**14
"""Edges of triangles that are looked at, of seams and of others."""

_PLACES = (0.2, 0.4, 0.6, 0.8)
"""Of each edge."""

_ASIDE = 0.6
"""Steps from the edge, to either side, at which it is looked up which placement shows."""

_CUT = 2.5
"""Pixels: what reads farther apart on both sides of an edge does not go on, but is cut there."""


@dataclass(frozen=True, slots=True)
class Crossings:
    """What lies on both sides of edges of triangles.

    Attributes
    ----------
    apart, apart_most
        Exemplar pixels by which the two sides of a seam read apart where one goes on in the other: the
        median, and what 95 % stay below.
    cuts, cuts_inside
        The share of seams along which a cut lies, by length, and of triangles' edges inside charts.
    """

    apart: float
    apart_most: float
    cuts: float
    cuts_inside: float


def crossings(surface: AnySurface, quilt: Quilt) -> Crossings | None:
    """Measure a quilt on its surface; None where there are no seams.

    Both sides of an edge are looked up a little aside, and what shows there is read on the edge itself. The
    edges of at most 16,384 triangles are looked at, of seams and inside charts.
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
    # Pixels by which both sides of edges (n, 2), triangle and edge, read apart, and the edges' lengths.
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
    # Where places of edges read, (n, 2) in pixels, by what shows beside them in their triangles.
    first, last = charted.places[triangle, edge], charted.places[triangle, (edge + 1) % 3]
    place = first + share[:, None] * (last - first)
    inward = charted.places[triangle].mean(axis=1) - place
    beside = place + _ASIDE * inward / np.maximum(np.hypot(*inward.T), 1e-9)[:, None]
    found = np.empty((len(place), 2))
    for n in np.unique(charted.chart[triangle]).tolist():
        own, chart = charted.chart[triangle] == n, quilt.charts[n]
        steps = np.clip(np.floor(beside[own]).astype(np.int64), 0, (chart.height - 1, chart.width - 1))
        placed = quilt.on_chart(n)[quilt.labels[n][0].at(*steps.T)]
        rows, columns = np.rint(16 * place[own]).astype(np.int64).T
        found[own] = np.stack(warped_sources(quilt.fields[n], placed, rows, columns), axis=1) / 16
    return found
