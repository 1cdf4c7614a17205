"""Warp fields that give way to the phases: courses stretched a little, so that fewer of them end."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from upholster.charts.phases.field import RING, PhaseField, ringed_phases
from upholster.charts.transitions import Transition
from upholster.quilt.warp_field import FIELD_STEP, UNIT, WarpField
from upholster.types import FloatArray

__all__ = ["warped"]


def warped(field: PhaseField, transitions: Sequence[Transition], most: float) -> PhaseField:
    """Return the same phases over warp fields that follow them more nearly.

    At each node M becomes M + F⁺·g, F being the waves and g what is missing, in cycles per texel, for each to
    reach its phase on the next cell; no length changes by more than `most`.

    Parameters
    ----------
    field
        The phases, and the warp fields that they were found for.
    transitions
        Over all seams of the layout.
    most
        0 to 0.06: by what part of itself a length may change.

    Returns
    -------
    PhaseField
        Its grids have the new warp fields.
    """
    grids = []
    for n, grid in enumerate(field.grids):
        changed = grid.field if grid.field.is_identity else _changed(field, n, most)
        matrices = changed.at(*grid.places(0))
        grids.append(replace(grid, field=changed, matrices=matrices))
    ringed = ringed_phases(grids, transitions, field.waves, field.phases)
    return PhaseField(field.waves, tuple(grids), field.phases, ringed)


def _changed(field: PhaseField, chart: int, most: float) -> WarpField:
    own = field.grids[chart].field
    matrices = own.matrices.reshape(*own.matrices.shape[:2], 2, 2) / UNIT
    change = np.linalg.pinv(field.waves) @ _missing(field, chart, matrices.shape[:2])
    part = np.linalg.norm(change @ np.linalg.inv(matrices), 2, axis=(2, 3))
    change *= np.minimum(1.0, most / np.maximum(part, 1e-12))[..., None, None]
    return WarpField.quantised(matrices + change, margin=own.margin)


def _missing(field: PhaseField, chart: int, nodes: tuple[int, int]) -> FloatArray:
    # What is missing at a chart's nodes, (rows, columns, waves, 2), in cycles per texel down and to the
    # right: the mean of the steps between cells round each node.
    grid, ringed = field.grids[chart], field.ringed[chart]
    rows, columns = grid.places(RING)
    steps = field.steps(grid, ringed, grid.field.at(rows, columns))
    inside = [
        (at > -0.5) & (at < count - 0.5)
        for at, count in ((rows, grid.chart.height), (columns, grid.chart.width))
    ]
    # Not at corners, beyond which surfaces unfold in more than one way.
    sound = inside[0] | inside[1]
    found = []
    for axis, (_, missing, _) in enumerate(steps):
        first, second = ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:]))[axis]
        weight = (sound[first] & sound[second]).astype(np.float64)
        down, aside = (
            _hats(0.5 * (at[first] + at[second]), grid.field.margin, count, way)
            for way, (at, count) in enumerate(zip((rows, columns), nodes, strict=True))
        )
        total = down @ weight @ aside.T
        mean = (down @ (missing * weight) @ aside.T) / np.maximum(total, 1e-9)
        found.append(mean / grid.size[axis])
    return np.moveaxis(np.array(found), (0, 1), (3, 2))


def _hats(places: FloatArray, margin: int, count: int, axis: int) -> FloatArray:
    # What places, all rows or columns of a grid, weigh at nodes; beyond the grid its border holds.
    along = places[:, 0] if axis == 0 else places[0]
    nodes = np.clip(FIELD_STEP * (np.arange(count) - margin), along[0], along[-1])
    hats: FloatArray = np.maximum(0.0, 1 - np.abs(along - nodes[:, None]) / FIELD_STEP)
    return hats
