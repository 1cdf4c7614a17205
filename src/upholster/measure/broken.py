"""Broken elements: cuts at which a lattice jumps, such as a course of bricks that meets a joint."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts.creases import CREASE
from upholster.charts.seams import find_seams
from upholster.charts.transitions import Transition, transitions
from upholster.errors import InputError
from upholster.geometry import AnySurface, MeshSurface
from upholster.lattice import Lattice
from upholster.measure.meshes import SeamPairs, smooth_texels
from upholster.measure.phase_cuts import PhaseCuts, cuts_at_mesh_seams, cuts_at_seams, cuts_inside
from upholster.measure.trace import Trace, quilt_windows
from upholster.quilt import Quilt

__all__ = ["BrokenElements", "broken_elements"]

QUARTER = 0.25
"""Turns by which a lattice must jump at a cut to be broken there."""

STAIRS = np.pi / 4
"""Length of a line over that of the texels' edges that follow it, in the mean of all directions."""

REACH = 2
"""Ends of texels' edges belong to one run if they are no more than so many texels apart."""

_CHART, _ROW, _PAD = 42, 21, 64
"""In a corner's number: bits below its chart's, bits below its row, and what is added to rows and columns."""

EVERY = 8
"""Texels each way of which one tells the area."""


@dataclass(frozen=True, slots=True)
class BrokenElements:
    """Cuts at which a lattice's phase jumps by more than a quarter turn; each figure by wave.

    Attributes
    ----------
    periods
        Of the lattice's waves, in pixels of the sample.
    share
        Of the length of all cuts, 0 to 1. More harmless cuts would lower it.
    per_area
        Length of such cuts in periods, per square period of the result.
    faults
        Length of the longest connected run of such cuts, in periods: of a wave that counts courses, in
        courses.
    """

    periods: tuple[float, ...]
    share: tuple[float, ...]
    per_area: tuple[float, ...]
    faults: tuple[float, ...]


def broken_elements(
    quilt: Quilt, lattice: Lattice, surface: AnySurface | None = None, *, crease: float = CREASE
) -> BrokenElements:
    """Measure where a result's cuts break the lattice of its sample.

    A cut lies between two neighbouring texels of which the second is not, within half a pixel, where the
    first one's source would go on. The sample's own phase at the second texel through its own source is
    compared with that through the first one's: exact, from the quilt, so that colours play no part. Cuts
    between blocks of different symmetries are left out. At most 8 Mtexels are looked at, as by `copies`.

    Parameters
    ----------
    quilt
        The result of a synthesis.
    lattice
        Of its sample, see `upholster.lattice.find_lattice`.
    surface
        What the charts lie on. With it seams are looked at as well, and runs go on across them. Of a mesh
        only texels on its triangles count: nobody sees what blocks do in the margins of its charts. Nor do
        cuts along its creases count, where the texture starts anew.
    crease
        Degrees: edges of a mesh at which it turns by as much or more are creases.

    Returns
    -------
    BrokenElements
        Zeros where there are no cuts.

    Raises
    ------
    InputError
        If the lattice is of a sample of another size.
    """
    if lattice.phases.shape[1:] != quilt.exemplar_shape:
        height, width = quilt.exemplar_shape
        raise InputError(
            f"lattice is of a sample of {lattice.phases.shape[2]}×{lattice.phases.shape[1]} pixels; "
            f"allowed: the quilt's, {width}×{height}"
        )
    found: list[PhaseCuts] = []
    area = 0.0
    for window in quilt_windows(quilt):
        trace, shown = Trace.of(quilt, window, beyond=True), None
        if isinstance(surface, MeshSurface):
            shown = smooth_texels(surface, quilt.charts, window, crease)
        found += cuts_inside(trace, lattice, shown)
        area += _area(trace, shown)
    met: tuple[Transition, ...] = ()
    facing: SeamPairs | None = None
    if isinstance(surface, MeshSurface):
        pairs = SeamPairs.of(surface, quilt.charts, 0.0, crease, False)
        if pairs is not None:
            facing = pairs.across_smooth()
            found += cuts_at_mesh_seams(quilt, lattice, facing)
    elif surface is not None:
        met = tuple(transitions(surface, quilt.charts, find_seams(surface, quilt.charts)))
        found += cuts_at_seams(quilt, lattice, met)
    cuts = PhaseCuts.joined(found)
    periods = 1.0 / np.hypot(*lattice.waves.T)
    broken = np.abs(cuts.jumps) > QUARTER
    lengths = (broken * cuts.lengths[:, None]).sum(axis=0)
    total = float(cuts.lengths.sum())
    runs = [longest_run(cuts, broken[:, k], met, facing) for k in range(len(periods))]
    return BrokenElements(
        tuple(periods.tolist()),
        tuple((lengths / max(total, 1e-9)).tolist()),
        tuple((lengths * STAIRS * periods / max(area, 1e-9)).tolist()),
        tuple((np.array(runs) * STAIRS / periods).tolist()),
    )


def _area(trace: Trace, shown: NDArray[np.bool_] | None) -> float:
    # Of the texels that are shown, in square pixels of the sample.
    if shown is None:
        shown = np.ones(trace.owners.shape, bool)
    rows, columns = np.nonzero(shown[::EVERY, ::EVERY])
    if not len(rows):
        return 0.0
    places = (EVERY * at + first for at, first in ((rows, trace.window.row), (columns, trace.window.column)))
    matrices = trace.field.at(*(place.astype(np.float64) for place in places))
    return float(np.abs(np.linalg.det(matrices)).mean()) * int(np.count_nonzero(shown))


def longest_run(
    cuts: PhaseCuts,
    chosen: NDArray[np.bool_],
    met: Sequence[Transition],
    facing: SeamPairs | None = None,
) -> float:
    """Return the length of the longest connected run of some cuts, in pixels of the sample.

    Two belong together if ends of theirs lie within `REACH` texels of one another, on one chart or across a
    seam: of patches (`met`), or of a mesh, where it is enough that they lie so near both texels of a pair.
    """
    if not chosen.any():
        return 0.0
    charts, ends, lengths = cuts.charts[chosen], cuts.ends[chosen], cuts.lengths[chosen]
    keys, number = np.unique([_keys(charts, ends[:, k]) for k in (0, 1)], return_inverse=True)
    number = number.reshape(2, -1)
    own, moved = [np.arange(len(keys))], [keys]
    corners = keys >> _CHART, (keys >> _ROW) % 2 ** (_CHART - _ROW) - _PAD, keys % 2**_ROW - _PAD
    for transition in met:
        m = transition.seam
        across, along = corners[2 if m.edge & 1 else 1], corners[1 if m.edge & 1 else 2]
        near = (corners[0] == m.chart) & (np.abs(across - 0.5 - transition.line) <= REACH)
        beside = np.flatnonzero(near & (along >= m.start) & (along <= m.stop))
        if len(beside):
            rows, columns, _ = transition.apply(corners[1][beside] - 0.5, corners[2][beside] - 0.5)
            sound = np.isfinite(rows) & np.isfinite(columns)
            there = np.rint(np.stack([rows, columns], axis=1)[sound] + 0.5).astype(np.intp)
            own.append(beside[sound])
            moved.append(_keys(np.full(len(there), m.other_chart, np.intp), there))
    count = len(keys)
    if facing is not None:
        # A pair of texels is a point of its own, near which are corners on both charts.
        own += [count + np.arange(len(facing.chart))] * 2
        moved += [_keys(facing.chart[:, k], facing.texel[:, k]) for k in (0, 1)]
        count += len(facing.chart)
    asking, wanted = np.concatenate(own), np.concatenate(moved)
    pairs = [number]
    for step in range(-REACH, REACH + 1):
        for aside in range(-REACH, REACH + 1):
            asked = wanted + (step << _ROW) + aside
            at = np.minimum(np.searchsorted(keys, asked), len(keys) - 1)
            hit = keys[at] == asked
            pairs.append(np.stack([asking[hit], at[hit]]))
    label = _components(count, np.concatenate(pairs, axis=1))
    return float(np.bincount(label[number[0]], lengths).max())


def _keys(charts: NDArray[np.intp], corners: NDArray[np.intp]) -> NDArray[np.intp]:
    # One number for each corner (n, 2) of texels: those of neighbours differ by as much everywhere.
    keys: NDArray[np.intp] = (charts << _CHART) + ((corners[:, 0] + _PAD) << _ROW) + corners[:, 1] + _PAD
    return keys


def _components(count: int, pairs: NDArray[np.intp]) -> NDArray[np.intp]:
    # The least number of each point's connected component.
    label = np.arange(count)
    while True:
        before = label.copy()
        least = np.minimum(label[pairs[0]], label[pairs[1]])
        for side in pairs:
            np.minimum.at(label, label[side], least)
            np.minimum.at(label, side, least)
        label = label[label]
        if (label == before).all():
            return label
