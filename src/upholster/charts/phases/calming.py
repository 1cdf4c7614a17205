"""Directions that turn within a course or two: there the texture turns less, so that fewer courses end."""

from collections.abc import Sequence

import numpy as np

from upholster.charts.multigrid import Multigrid, hermitian, solve
from upholster.charts.phases.chart_cells import CellGrid, Cells
from upholster.charts.phases.links import Links
from upholster.quilt.warp_field import FIELD_STEP, UNIT, WarpField
from upholster.types import FloatArray

__all__ = ["calmed"]

_REACH = 2.0
"""Periods over which directions are evened out."""

_LEAST = np.radians(5)
"""Turns by less are left out: elsewhere directions stay as asked for."""

_NOTABLE = np.radians(20)
"""Charts stay as they are unless something on them would turn by as much."""

_STEEPEST = 1.0
"""Radians from one cell to the next: more is not looked at, as round poles."""

_STAY = 0.05
"""What a node weighs itself as it is fitted to cells: few lie beside those off a chart."""

_LEAST_AREA = 0.2
"""Of a node, as a part of what it was: one that is fitted to less is turned only."""


def calmed(grids: Sequence[CellGrid], links: Links, waves: FloatArray) -> list[WarpField]:
    """Return warp fields that are turned where directions turn too fast for courses to follow.

    What keeps courses from going on is the curl of M's rows: c, in units of its own frame. Turning M by an
    angle α makes it c − ∇α. So α is the least squares of ∇α − c, with α/ℓ beside it, ℓ being two periods.

    Parameters
    ----------
    grids, links
        Cells of charts, and what joins them.
    waves
        (n, 2) cycles per exemplar pixel.

    Returns
    -------
    list
        A field for each chart: its own where little would change.
    """
    curls = _curls(Cells.of(grids))
    wanted = (curls[links.first] * links.here).sum(axis=1) + (curls[links.second] * links.there).sum(axis=1)
    reach = _REACH / float(np.sqrt((waves**2).sum(axis=1)).min())
    pull = np.concatenate([grid.areas for grid in grids]) / reach**2
    angles = _angles(links, np.clip(wanted, -_STEEPEST, _STEEPEST), pull)
    if not np.abs(angles).max() >= _NOTABLE:
        return [grid.field for grid in grids]
    angles = np.sign(angles) * np.maximum(np.abs(angles) - _LEAST, 0.0)
    return [_turned(grid, angles[grid.first : grid.first + grid.rows * grid.columns]) for grid in grids]


def _angles(links: Links, wanted: FloatArray, pull: FloatArray) -> FloatArray:
    # What cells (n,) are turned by: least squares of differences that links want, and of the angles
    # themselves, weighed by `pull`. No wave goes on over a link that joins nothing.
    on = (links.first != links.second) & (links.goes_on >= 0).any(axis=1)
    first, second, weights = links.first[on], links.second[on], links.weights[on]
    count, pulled = len(pull), weights * wanted[on]
    right = np.bincount(second, pulled, count) - np.bincount(first, pulled, count)
    diagonal = pull + np.bincount(first, weights, count) + np.bincount(second, weights, count)
    rows = hermitian(count, first, second, -weights.astype(np.complex128), diagonal)
    start = np.zeros(count, np.complex128)
    found: FloatArray = solve(Multigrid(rows), right.astype(np.complex128), start, tolerance=1e-2).real
    return found


def _curls(cells: Cells) -> FloatArray:
    # (cells, 2) curl of each row of M, by its determinant.
    chart, i, j = cells.raster(0)
    rows, columns = cells.centres(chart, i, j).T
    tall, wide = 0.5 * cells.size[chart].T
    below, above = (cells.fields.at(chart, at, columns)[..., 1] for at in (rows + tall, rows - tall))
    after, before = (cells.fields.at(chart, rows, at)[..., 0] for at in (columns + wide, columns - wide))
    curls = (below - above) / (2 * tall)[:, None] - (after - before) / (2 * wide)[:, None]
    area = np.linalg.det(cells.matrices)[:, None]
    found: FloatArray = curls / np.maximum(area, 1e-6)
    return found


def _turned(grid: CellGrid, angles: FloatArray) -> WarpField:
    # The chart's field turned by angles at its cells: nodes are fitted to them by least squares.
    field = grid.field
    if field.is_identity or not np.abs(angles).max() >= _NOTABLE - _LEAST:
        return field
    turn = _rotations(angles.reshape(grid.rows, grid.columns))
    nodes = field.matrices.reshape(*field.matrices.shape[:2], 2, 2) / UNIT
    at = grid.places(0)[0][:, 0], grid.places(0)[1][0]
    hats = [_hats(places, field.margin, count) for places, count in zip(at, nodes.shape[:2], strict=True)]
    near = [
        np.abs(places[:, None] - FIELD_STEP * (np.arange(count) - field.margin)).argmin(axis=0)
        for places, count in zip(at, nodes.shape[:2], strict=True)
    ]
    turned = turn[near[0][:, None], near[1]] @ nodes
    missing = turn @ grid.matrices - np.einsum("ia,jb,abkl->ijkl", *hats, turned)
    for axis, hat in enumerate(hats):
        fit = np.linalg.solve(hat.T @ hat + _STAY * np.eye(hat.shape[1]), hat.T)
        missing = np.moveaxis(np.tensordot(fit, missing, axes=(1, axis)), 0, axis)
    sound = np.linalg.det(turned + missing) > _LEAST_AREA * np.linalg.det(nodes)
    turned += np.where(sound[..., None, None], missing, 0.0)
    return WarpField.quantised(turned, margin=field.margin)


def _hats(places: FloatArray, margin: int, count: int) -> FloatArray:
    # What each node of an axis weighs at places along it, (places, nodes).
    hats: FloatArray = np.maximum(0.0, 1 - np.abs(places[:, None] / FIELD_STEP + margin - np.arange(count)))
    return hats


def _rotations(angles: FloatArray) -> FloatArray:
    cosine, sine = np.cos(angles), np.sin(angles)
    return np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)
