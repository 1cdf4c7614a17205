"""Broken elements: cuts at which a lattice jumps, such as a course of bricks that meets a joint."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.charts.charted_surface import charted_surface
from upholster.charts.creases import CREASE
from upholster.covering.measure.measure_rows import Row
from upholster.covering.measure.places import SeamPlaces
from upholster.covering.measure.source_cuts import SourceCuts, cuts_of
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.components import connected
from upholster.image.elements.courses import Courses
from upholster.image.elements.lattice import Lattice
from upholster.quilt.model import Quilt

__all__ = ["BrokenElements", "broken_elements", "jumps_of"]

QUARTER = 0.25
"""Turns by which a lattice must jump at a cut to be broken there."""

_IN_JOINT = 1 / 6
"""A cut is in a joint between courses if both sides are within this share of a course's height of it."""

STAIRS = np.pi / 4
"""Mean over all directions: a line's length over that of the texels' edges that follow it."""

REACH = 2
"""Ends of texels' edges belong to one run if they are at most this many texels apart."""

_CHART, _ROW, _PAD = 42, 21, 64
"""In a corner's number: bits below the chart's, bits below the row, and an offset of rows and columns."""


@dataclass(frozen=True, slots=True)
class BrokenElements:
    """Cuts at which a lattice's phase jumps by more than a quarter turn; each figure by wave.

    Attributes
    ----------
    periods
        Periods of the lattice's waves, in pixels of the sample.
    share
        Share of the length of all cuts, 0 to 1. More harmless cuts would lower it.
    per_area
        Length of such cuts in periods, per square period of the result.
    faults
        Length of the longest connected run of such cuts, in periods; for a wave that counts courses, in
        courses.
    """

    periods: tuple[float, ...]
    share: tuple[float, ...]
    per_area: tuple[float, ...]
    faults: tuple[float, ...]

    def rows(self) -> list[Row]:
        """Return the rows of a table."""
        return [
            ("broken elements", _by_wave(self.share, "{:.1%}"), "of the cuts, by wave"),
            ("  per square period", _by_wave(self.per_area, "{:.3f}"), "0: none"),
            ("  longest fault", _by_wave(self.faults, "{:.1f}"), "periods"),
            ("  periods", _by_wave(self.periods, "{:.1f}"), "sample's pixels"),
        ]


def broken_elements(
    quilt: Quilt,
    lattice: Lattice,
    surface: AnySurface | None = None,
    *,
    courses: Courses | None = None,
    crease: float = CREASE,
) -> BrokenElements:
    """Measure where a result's cuts break the lattice of its sample.

    There is a cut between two neighbouring texels if the second is not, within half a pixel, the continuation
    of the first one's source. The sample's phase at the second texel through its own source is compared with
    that through the first one's. This is exact, from the quilt; colours play no part. Cuts between blocks of
    different symmetries are left out. At most 8 Mtexels are examined.

    Parameters
    ----------
    quilt
        The result of a synthesis.
    lattice
        The sample's lattice, see `upholster.image.elements.lattice.find_lattice`.
    surface
        The surface below the charts. With it seams are examined as well, and runs continue across them. Only
        texels on it count, because blocks in the margins of a mesh's charts are invisible. Cuts along its
        creases, where the texture starts again, do not count.
    courses
        The sample's courses, if it is in running bond: then the first figure is that of the wave that counts
        courses, the second that of elements along a course. Cuts in joints between courses do not count for
        it, because courses may slip there.
    crease
        Degrees: edges at which the surface turns by at least this are creases.

    Returns
    -------
    BrokenElements
        Zeros if there are no cuts.

    Raises
    ------
    InputError
        If the lattice belongs to a sample of another size.
    """
    if lattice.phases.shape[1:] != quilt.exemplar_shape:
        height, width = quilt.exemplar_shape
        raise InputError(
            f"lattice is of a sample of {lattice.phases.shape[2]}×{lattice.phases.shape[1]} pixels; "
            f"allowed: the quilt's, {width}×{height}"
        )
    charted = None if surface is None else charted_surface(surface, quilt.charts)
    cuts, seams, area = cuts_of(quilt, charted, crease)
    waves, jumps = lattice.waves, jumps_of(cuts, lattice)
    if courses is not None:
        waves, jumps = _by_course(cuts, lattice, courses, jumps)
    periods = 1.0 / np.hypot(*waves.T)
    broken = np.abs(jumps) > QUARTER
    lengths = (broken * cuts.lengths[:, None]).sum(axis=0)
    total = float(cuts.lengths.sum())
    runs = [longest_run(cuts, broken[:, k], seams) for k in range(len(periods))]
    return BrokenElements(
        tuple(periods.tolist()),
        tuple((lengths / max(total, 1e-9)).tolist()),
        tuple((lengths * STAIRS * periods / max(area, 1e-9)).tolist()),
        tuple((np.array(runs) * STAIRS / periods).tolist()),
    )


def jumps_of(cuts: SourceCuts, lattice: Lattice) -> FloatArray:
    """Return the jumps of the waves' phases at cuts: (n, waves), in turns, -½ to ½."""
    jumps: FloatArray = _turns(lattice, cuts.found.T) - _turns(lattice, cuts.onward.T)
    return jumps - np.rint(jumps)


def _by_course(
    cuts: SourceCuts, lattice: Lattice, courses: Courses, jumps: FloatArray
) -> tuple[FloatArray, FloatArray]:
    # The wave that counts courses and the one along a course, (2, 2), and their jumps (n, 2).
    bed, free = courses.wave(lattice.waves), 1 - courses.once
    along = lattice.waves[free] - (lattice.waves[free] @ bed) / (bed @ bed) * bed
    over = jumps @ np.array(courses.multiples)
    sides = [_turns(lattice, at.T) @ np.array(courses.multiples) for at in (cuts.found, cuts.onward)]
    away = [np.abs(side - courses.joint - np.rint(side - courses.joint)) for side in sides]
    slipped = np.where(np.maximum(*away) < _IN_JOINT, 0.0, jumps[:, free])
    return np.stack([bed, along]), np.stack([over - np.rint(over), slipped], axis=1)


def _turns(lattice: Lattice, place: IntArray) -> FloatArray:
    # The sample's phases (n, waves), in turns, at places (2, n); beyond its edges they continue evenly.
    height, width = lattice.phases.shape[1:]
    rows, columns = place
    r, c = np.clip((rows + 8) >> 4, 0, height - 1), np.clip((columns + 8) >> 4, 0, width - 1)
    rest = np.stack([rows / 16 - r, columns / 16 - c], axis=1)
    turns: FloatArray = lattice.phases[:, r, c].T / 65536 + (rest[:, :, None] * lattice.waves.T).sum(axis=1)
    return turns


def longest_run(cuts: SourceCuts, chosen: NDArray[np.bool_], seams: SeamPlaces | None = None) -> float:
    """Return the length of the longest connected run of some cuts, in pixels of the sample.

    Two cuts belong together if their ends are within `REACH` texels of one another, on one chart or across a
    seam. Across a seam, they must be that near to both texels of one of its places.
    """
    if not chosen.any():
        return 0.0
    charts, ends, lengths = cuts.charts[chosen], cuts.ends[chosen], cuts.lengths[chosen]
    keys, number = np.unique([_keys(charts, ends[:, k]) for k in (0, 1)], return_inverse=True)
    number = number.reshape(2, -1)
    own, moved = [np.arange(len(keys))], [keys]
    count = len(keys)
    if seams is not None:
        # Each pair of texels across a seam is a point of its own, near corners on both charts.
        own += [count + np.arange(len(seams.chart))] * 2
        moved += [_keys(seams.chart[:, k], seams.texel[:, k]) for k in (0, 1)]
        count += len(seams.chart)
    asking, wanted = np.concatenate(own), np.concatenate(moved)
    pairs = [number]
    for step in range(-REACH, REACH + 1):
        for aside in range(-REACH, REACH + 1):
            asked = wanted + (step << _ROW) + aside
            at = np.minimum(np.searchsorted(keys, asked), len(keys) - 1)
            hit = keys[at] == asked
            pairs.append(np.stack([asking[hit], at[hit]]))
    label = connected(count, np.concatenate(pairs, axis=1).T)
    return float(np.bincount(label[number[0]], lengths).max())


def _keys(charts: NDArray[np.intp], corners: NDArray[np.intp]) -> NDArray[np.intp]:
    # One number for each corner (n, 2) of texels; neighbours differ by the same amount everywhere.
    keys: NDArray[np.intp] = (charts << _CHART) + ((corners[:, 0] + _PAD) << _ROW) + corners[:, 1] + _PAD
    return keys


def _by_wave(figures: tuple[float, ...], form: str) -> str:
    return "  ".join(form.format(figure).replace("%", " %") for figure in figures)
