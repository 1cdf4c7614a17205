"""Cuts, and the parts of the sample that meet at each."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts.charted_surface import ChartedSurface
from upholster.covering.measure.places import SeamPlaces, smooth_steps
from upholster.covering.measure.trace import Trace, quilt_windows, step_sources
from upholster.quilt.model import Quilt
from upholster.quilt.placement import SYMMETRIES

__all__ = ["SourceCuts", "cuts_at_seams", "cuts_inside", "cuts_of"]

EVERY = 8
"""The area is measured on every eighth texel each way."""

CONTINUED = 16
"""Texels across a seam count as continued within this many 1/16 pixels: unfolding charts is not exact."""

Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False, slots=True)
class SourceCuts:
    """Edges of texels between two sources that do not continue one another.

    Attributes
    ----------
    onward, found
        (n, 2) rows and columns in the sample, in 1/16 pixel: where the second texel would be if the first
        one's source continued, and where it is.
    lengths
        (n,) in pixels of the sample.
    charts
        (n,) the charts.
    ends
        (n, 2, 2) rows and columns of each edge's ends: corner (r, c) is the upper left one of texel (r, c).
    """

    onward: IntArray
    found: IntArray
    lengths: FloatArray
    charts: Index
    ends: Index

    @classmethod
    def joined(cls, parts: Sequence["SourceCuts"]) -> "SourceCuts":
        """Return all parts as one."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in cls.__slots__))


def cuts_of(
    quilt: Quilt, charted: ChartedSurface | None, crease: float
) -> tuple[SourceCuts, SeamPlaces | None, float]:
    """Return the cuts of a quilt; the places of its seams, if its surface is known; and its area.

    Only texels on the surface count, and no cuts along its creases, see `broken_elements`. The area is in
    square pixels of the sample.
    """
    found: list[SourceCuts] = []
    area = 0.0
    for window in quilt_windows(quilt):
        trace = Trace.of(quilt, window)
        shown = None if charted is None else smooth_steps(charted, window, crease)
        found += cuts_inside(trace, shown)
        area += _area(trace, shown)
    seams = None if charted is None else SeamPlaces.of(charted, crease=crease)
    if seams is not None:
        seams = seams.of_texels()
        found += cuts_at_seams(quilt, seams)
    return SourceCuts.joined(found), seams, area


def cuts_inside(trace: Trace, shown: NDArray[np.bool_] | None = None) -> Iterator[SourceCuts]:
    """Yield the cuts inside a window of a chart: those between rows, and those between columns.

    If `shown` (rows, columns of the window) is given, both texels must be in it.
    """
    for axis in (0, 1):
        border = trace.border(axis)
        cut = border.cut & (border.first["symmetry"] == border.second["symmetry"])
        if shown is not None:
            beyond = border.rows + (axis == 0), border.columns + (axis == 1)
            cut &= shown[border.rows, border.columns] & shown[beyond]
        rows = border.rows[cut] + trace.window.row + (axis == 0)
        columns = border.columns[cut] + trace.window.column + (axis == 1)
        ends = np.stack([rows, columns], axis=1)[:, None].repeat(2, axis=1)
        ends[:, 1, 1 - axis] += 1
        along = trace.field.at(rows, columns)[:, :, 1 - axis]
        charts = np.full(len(rows), trace.window.index, np.intp)
        onward, found = border.onward.T[cut], border.found.T[cut]
        yield SourceCuts(onward, found, np.hypot(*along.T), charts, ends)


def cuts_at_seams(quilt: Quilt, seams: SeamPlaces) -> Iterator[SourceCuts]:
    """Yield the cuts along seams, where the texel across does not continue."""
    for a, b in np.unique(seams.chart, axis=0).tolist():
        own = np.flatnonzero((seams.chart == (a, b)).all(axis=1))
        texel, step = seams.texel[own], seams.step[own, 0]
        ends = texel[:, :1].repeat(2, axis=1)
        # The texel's edge along the seam: along the rows if the other texel is above or below.
        ends[np.arange(len(own)), 1, np.abs(step).argmin(axis=1)] += 1
        yield _met(quilt, (a, texel[:, 0]), (b, texel[:, 1]), step, ends)


def _met(
    quilt: Quilt,
    here: tuple[int, Index],
    there: tuple[int, Index],
    step: FloatArray,
    ends: Index,
) -> SourceCuts:
    # Cuts between texels (n, 2) of two charts; the second ones are a `step` (n, 2) of the first chart away.
    (first, place), (second, found) = (_sources(quilt, *side) for side in (here, there))
    matrices = quilt.fields[here[0]].at(*here[1].T)
    turned = SYMMETRIES[first["symmetry"]].reshape(-1, 2, 2) @ matrices @ step[:, :, None]
    onward = place + np.rint(16 * turned[:, :, 0].T).astype(np.int32)
    cut = first["symmetry"] == second["symmetry"]
    cut &= np.abs(onward - found).max(axis=0, initial=0) > CONTINUED
    along = (ends[:, 1] - ends[:, 0])[:, :, None].astype(np.float64)
    lengths = np.hypot(*(matrices @ along)[:, :, 0].T)
    return SourceCuts(
        onward.T[cut], found.T[cut], lengths[cut], np.full(int(cut.sum()), here[0], np.intp), ends[cut]
    )


def _sources(quilt: Quilt, chart: int, texel: Index) -> tuple[NDArray[np.void], IntArray]:
    # The placements that own texels (n, 2), and the texels' places in the exemplar (2, n).
    if not len(texel):
        return quilt.placements[:0], np.zeros((2, 0), np.int32)
    low, high = texel.min(axis=0), texel.max(axis=0) + 1
    owners = quilt.owners(chart, *low.tolist(), *(high - low).tolist())[tuple((texel - low).T)]
    owner = quilt.on_chart(chart)[owners]
    return owner, step_sources(quilt.fields[chart], owner, *texel.T)


def _area(trace: Trace, shown: NDArray[np.bool_] | None) -> float:
    # The area of the texels that are shown, in square pixels of the sample.
    if shown is None:
        shown = np.ones(trace.owners.shape, bool)
    rows, columns = np.nonzero(shown[::EVERY, ::EVERY])
    if not len(rows):
        return 0.0
    places = (EVERY * at + first for at, first in ((rows, trace.window.row), (columns, trace.window.column)))
    matrices = trace.field.at(*(place.astype(np.float64) for place in places))
    return float(np.abs(np.linalg.det(matrices)).mean()) * int(np.count_nonzero(shown))
