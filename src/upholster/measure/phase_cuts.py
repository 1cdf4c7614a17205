"""Cuts, and by how much a lattice's phase jumps at each."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.lattice import Lattice
from upholster.measure.places import SeamPlaces
from upholster.measure.trace import Trace, step_sources
from upholster.quilt import Quilt
from upholster.quilt.placement import SYMMETRIES
from upholster.types import FloatArray, IntArray

__all__ = ["PhaseCuts", "cuts_at_seams", "cuts_inside"]

CONTINUED = 16
"""A texel beyond a seam continues the other within so many 1/16 pixels: charts are unfolded, not exact."""

Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False, slots=True)
class PhaseCuts:
    """Edges of texels at which two sources meet that do not continue one another.

    Attributes
    ----------
    jumps
        (n, waves) by how much phases jump, in turns, -½ to ½.
    lengths
        (n,) in pixels of the sample.
    charts
        (n,) the charts.
    ends
        (n, 2, 2) rows and columns of each edge's ends: corner (r, c) is the upper left one of texel (r, c).
    """

    jumps: FloatArray
    lengths: FloatArray
    charts: Index
    ends: Index

    @classmethod
    def joined(cls, parts: Sequence["PhaseCuts"]) -> "PhaseCuts":
        """Return all parts as one."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in cls.__slots__))


def cuts_inside(
    trace: Trace, lattice: Lattice, shown: NDArray[np.bool_] | None = None
) -> Iterator[PhaseCuts]:
    """Yield the cuts inside a window of a chart: those between rows, and those between columns.

    Of `shown` (rows, columns of the window) both texels must be, where it is given.
    """
    for axis in (0, 1):
        border = trace.border(axis)
        cut = ~border.continued & (border.first["symmetry"] == border.second["symmetry"])
        if shown is not None:
            beyond = border.rows + (axis == 0), border.columns + (axis == 1)
            cut &= shown[border.rows, border.columns] & shown[beyond]
        rows = border.rows[cut] + trace.window.row + (axis == 0)
        columns = border.columns[cut] + trace.window.column + (axis == 1)
        # The second texel through either source: the first one's goes on by a texel.
        first, second = (
            step_sources(trace.field, side[cut], rows, columns) for side in (border.first, border.second)
        )
        ends = np.stack([rows, columns], axis=1)[:, None].repeat(2, axis=1)
        ends[:, 1, 1 - axis] += 1
        along = trace.field.at(rows, columns)[:, :, 1 - axis]
        charts = np.full(len(rows), trace.window.index, np.intp)
        yield PhaseCuts(_jumps(lattice, first, second), np.hypot(*along.T), charts, ends)


def cuts_at_seams(quilt: Quilt, lattice: Lattice, seams: SeamPlaces) -> Iterator[PhaseCuts]:
    """Yield the cuts along seams: where the texel beyond does not go on."""
    for a, b in np.unique(seams.chart, axis=0).tolist():
        own = np.flatnonzero((seams.chart == (a, b)).all(axis=1))
        texel, step = seams.texel[own], seams.step[own, 0]
        ends = texel[:, :1].repeat(2, axis=1)
        # A texel's edge that the seam follows: along the rows where the other texel lies above or below.
        ends[np.arange(len(own)), 1, np.abs(step).argmin(axis=1)] += 1
        yield _met(quilt, lattice, (a, texel[:, 0]), (b, texel[:, 1]), step, ends)


def _met(
    quilt: Quilt,
    lattice: Lattice,
    here: tuple[int, Index],
    there: tuple[int, Index],
    step: FloatArray,
    ends: Index,
) -> PhaseCuts:
    # Cuts between texels (n, 2) of two charts, the second ones a `step` (n, 2) of the first one's texels on.
    (first, place), (second, found) = (_sources(quilt, *side) for side in (here, there))
    matrices = quilt.fields[here[0]].at(*here[1].T)
    turned = SYMMETRIES[first["symmetry"]].reshape(-1, 2, 2) @ matrices @ step[:, :, None]
    onward = place + np.rint(16 * turned[:, :, 0].T).astype(np.int32)
    cut = first["symmetry"] == second["symmetry"]
    cut &= np.abs(onward - found).max(axis=0, initial=0) > CONTINUED
    along = (ends[:, 1] - ends[:, 0])[:, :, None].astype(np.float64)
    lengths = np.hypot(*(matrices @ along)[:, :, 0].T)
    jumps = _jumps(lattice, onward, found)
    return PhaseCuts(jumps[cut], lengths[cut], np.full(int(cut.sum()), here[0], np.intp), ends[cut])


def _sources(quilt: Quilt, chart: int, texel: Index) -> tuple[NDArray[np.void], IntArray]:
    # The placements that own texels (n, 2), and where these lie in the exemplar (2, n).
    if not len(texel):
        return quilt.placements[:0], np.zeros((2, 0), np.int32)
    low, high = texel.min(axis=0), texel.max(axis=0) + 1
    owners = quilt.owners(chart, *low.tolist(), *(high - low).tolist())[tuple((texel - low).T)]
    owner = quilt.on_chart(chart)[owners]
    return owner, step_sources(quilt.fields[chart], owner, *texel.T)


def _jumps(lattice: Lattice, one: IntArray, other: IntArray) -> FloatArray:
    jumps: FloatArray = _turns(lattice, other) - _turns(lattice, one)
    return jumps - np.rint(jumps)


def _turns(lattice: Lattice, place: IntArray) -> FloatArray:
    # The sample's phases (n, waves), in turns, at places (2, n); beyond its edges they go on evenly.
    height, width = lattice.phases.shape[1:]
    rows, columns = place
    r, c = np.clip((rows + 8) >> 4, 0, height - 1), np.clip((columns + 8) >> 4, 0, width - 1)
    rest = np.stack([rows / 16 - r, columns / 16 - c], axis=1)
    turns: FloatArray = lattice.phases[:, r, c].T / 65536 + (rest[:, :, None] * lattice.waves.T).sum(axis=1)
    return turns
