"""What shows of laid blocks becomes placements and labels.

A label map's cell takes the block that shows there. A placement's centre lies in the middle of a cell that shows
it, with what the block reads there; where its chart's field alone would turn or stretch it by more than a little,
its matrix gets an offset, fitted to the cells that show it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._block_kernels import SOURCE_COLUMN, SOURCE_ROW, SYMMETRY
from upholster.methods.quilt._label_kernels import fill_labels, label_beyond, label_cells, read_cells
from upholster.methods.quilt._lay_kernels import Ground
from upholster.methods.quilt._sheet_kernels import MOST_SHEETS
from upholster.parallel import run_tasks
from upholster.quilt.chart import Chart
from upholster.quilt.displacement import warped_sources
from upholster.quilt.labels import LabelMap, cell_centres, label_shape
from upholster.quilt.model import Quilt
from upholster.quilt.placement import MOST_OFFSET, PLACEMENT, SYMMETRIES, bare_placement
from upholster.quilt.warp_field import UNIT, WarpField
from upholster.types import FloatArray, IntArray

__all__ = ["LABEL_CELL", "Laid", "emitted_quilt"]

LABEL_CELL = 2
"""Steps a side of a cell of label maps: blocks are blended over so many. Cells of two charts do not line up:
the larger they are, the more a border of blocks is off where it crosses a seam."""

_SOURCE_UNIT, _OFFSET_UNIT = 4, 64
"""Sources are quarters of a pixel, offsets 1/64 pixel for a step: finer ones only cost bytes."""

_OFF = 0.3
"""Pixels that a placement may be off somewhere before its matrix gets an offset."""

Labelled = tuple[NDArray[np.void], LabelMap]
"""A chart's placements and labels."""


@dataclass(frozen=True, eq=False, slots=True)
class Laid:
    """Blocks that are laid.

    Attributes
    ----------
    records
        (B, `BLOCK_COLUMNS`) what they show.
    firsts, fits
        (B + 1,) each one's first sheet, and all sheets, (S, `FIT`).
    level
        Of the exemplar, that they read.
    """

    records: IntArray
    firsts: NDArray[np.int64]
    fits: FloatArray
    level: int


def emitted_quilt(
    charts: Sequence[Chart],
    fields: Sequence[WarpField],
    shape: tuple[int, int],
    ground: Ground,
    laid: Laid,
    *,
    tile: bool = False,
    threads: int | None = None,
) -> Quilt:
    """Return the quilt of what was laid.

    Parameters
    ----------
    charts, fields, shape
        As in `Quilt`.
    ground, laid
        What shows where, and all blocks.
    tile
        Whether the chart's opposite edges meet.
    threads
        As in `upholster.parallel.run_tasks`.
    """
    found: list[Labelled | None] = [None] * len(charts)
    seams = np.argwhere(ground.mesh.seam >= 0)
    seams = seams[np.argsort(ground.mesh.chart[seams[:, 0]], kind="stable")]
    ends = np.searchsorted(ground.mesh.chart[seams[:, 0]], np.arange(len(charts) + 1))

    def label(n: int) -> None:
        cell = _tile_cell(charts[n]) if tile else LABEL_CELL
        edges = np.ascontiguousarray(seams[ends[n] : ends[n + 1]], np.int64)
        found[n] = _labelled(n, charts[n], fields[n], shape, ground, laid, edges, cell)

    run_tasks([partial(label, n) for n in range(len(charts))], threads=threads)
    each = [one for one in found if one is not None]
    placements = np.concatenate([own for own, _ in each])
    return Quilt(tuple(charts), shape, placements, tuple((layer,) for _, layer in each), tuple(fields))


def _tile_cell(tile: Chart) -> int:
    # About `LABEL_CELL`, of which a whole number is each side: then cells beyond an edge are those at the
    # opposite one, and blocks are blended alike on both sides.
    sides = tile.height, tile.width
    return next(cell for cell in (LABEL_CELL, 3, 1) if not any(side % cell for side in sides))


def _labelled(
    number: int, chart: Chart, field: WarpField, shape: tuple[int, int], ground: Ground, laid: Laid,
    edges: NDArray[np.int64], cell: int,
) -> Labelled:  # fmt: skip
    seen = np.empty(label_shape(chart.height, chart.width, cell), np.int64)
    label_cells(ground.canvases, number, cell, seen)
    label_beyond(
        ground.mesh, ground.field, ground.canvases, laid.firsts, laid.fits, edges, number, cell,
        np.full(seen.shape, np.inf), seen,
    )  # fmt: skip
    rows, columns = np.nonzero(seen >= 0)
    if not len(rows):
        none = np.zeros(seen.shape, np.int32)
        return bare_placement(number, (chart.height, chart.width), shape), LabelMap(cell, none)
    keys, owner = np.unique(seen[rows, columns], return_inverse=True)
    owner = owner.reshape(-1)
    shown = np.full(seen.shape, -1, np.int32)
    shown[rows, columns] = owner
    at = np.stack(
        [cell_centres(count, cell)[of] for count, of in zip(seen.shape, (rows, columns), strict=True)], axis=1
    )
    read = _read(ground, laid, keys[owner], at)
    placed = np.zeros(len(keys), PLACEMENT)
    placed["chart"] = number
    block, sheet = np.divmod(keys, MOST_SHEETS)
    turns = laid.fits[laid.firsts[block] + sheet, 10].astype(np.intp)
    placed["symmetry"] = _PRODUCTS[laid.records[block, SYMMETRY], turns]
    chosen = _recentred(placed, owner, (rows, columns), at, read, (chart, field, shape, cell))
    fill_labels(shown, np.empty(shown.size, np.int64))
    order = np.lexsort((columns[chosen], rows[chosen]))
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    return placed[order], LabelMap(cell, rank[shown])


def _products() -> NDArray[np.uint8]:
    # Of two symmetries the one that is both, the second one first.
    matrices = SYMMETRIES.reshape(-1, 2, 2)
    both = (matrices[:, None] @ matrices).reshape(8, 8, 1, 4)
    return (both == SYMMETRIES).all(axis=3).argmax(axis=2).astype(np.uint8)


_PRODUCTS = _products()


def _read(ground: Ground, laid: Laid, keys: NDArray[np.int64], at: NDArray[np.int64]) -> NDArray[np.int64]:
    # Where places (n, 2) of a chart, in 1/16 step, read by blocks' sheets: (n, 2) in 1/16 pixel.
    block, sheet = np.divmod(keys, MOST_SHEETS)
    places, read = at / 16 - 0.5, np.empty((len(at), 2))
    read_cells(ground.field, laid.fits, laid.firsts[block] + sheet, places, read)
    turn = SYMMETRIES[laid.records[block, SYMMETRY]].reshape(-1, 2, 2)
    shown = (turn @ read[:, :, None])[:, :, 0]
    pixel = laid.records[block][:, [SOURCE_ROW, SOURCE_COLUMN]].astype(np.int64)
    # The middle of a level's pixel, and what lies beside it.
    source = ((16 * pixel + 8) << laid.level) - 8
    found: NDArray[np.int64] = source + np.rint((16 << laid.level) * shown).astype(np.int64)
    return found


def _recentred(
    placed: NDArray[np.void],
    owner: IntArray,
    cells: tuple[IntArray, IntArray],
    at: NDArray[np.int64],
    read: NDArray[np.int64],
    on: tuple[Chart, WarpField, tuple[int, int], int],
) -> NDArray[np.intp]:
    """Give placements their centres, middles of cells that show them; return which cells.

    `owner` (n,) tells of cells which placement they show, `at` and `read` (n, 2) where they lie and read.
    """
    chart, field, shape, cell = on
    rows, columns = cells
    last = [count - 1 for count in label_shape(chart.height, chart.width, cell)]
    inside = ((read >= 0) & (read < 16 * np.array(shape))).all(axis=1)
    within = (rows > 0) & (rows < last[0]) & (columns > 0) & (columns < last[1])
    size = np.bincount(owner, minlength=len(placed))
    middle = [np.bincount(owner, index, minlength=len(placed)) / size for index in (rows, columns)]
    away = (rows - middle[0][owner]) ** 2 + (columns - middle[1][owner]) ** 2
    # Cells that read inside the sample come first, then those on the chart, then near ones.
    away += 2.0**34 * ~within + 2.0**36 * ~inside
    least = np.full(len(placed), np.inf)
    np.minimum.at(least, owner, away)
    nearest = np.flatnonzero(away == least[owner])[::-1]
    chosen = np.empty(len(placed), np.intp)
    chosen[owner[nearest]] = nearest  # of several the first
    placed["row"], placed["column"] = at[chosen].T
    for axis, name in enumerate(("source_row", "source_column")):
        whole = _SOURCE_UNIT * ((read[chosen, axis] + _SOURCE_UNIT // 2) // _SOURCE_UNIT)
        placed[name] = np.clip(whole, 0, 16 * shape[axis] - _SOURCE_UNIT)
    _fit_matrices(placed, field, owner, at, read)
    return chosen


def _fit_matrices(
    moved: NDArray[np.void],
    field: WarpField,
    owner: IntArray,
    at: NDArray[np.int64],
    read: NDArray[np.int64],
) -> None:
    """Give placements' matrices the offsets with which they read as before, where the field alone is off.

    With C + ΔC in place of C = M(c), a place q reads ½·ΔC·(q − c) further, T turned by the symmetry; ΔC is
    the least squares' answer over the cells that show the placement.
    """
    moved["offset"] = 0
    now = np.stack(warped_sources(field, moved[owner], at[:, 0], at[:, 1]), axis=1)
    turn = SYMMETRIES[moved["symmetry"][owner]].reshape(-1, 2, 2)
    # A symmetry's inverse is its transpose.
    rest: FloatArray = np.einsum("nji,nj->ni", turn, (read - now) / 16)
    centre: IntArray = np.stack([moved["row"][owner], moved["column"][owner]], axis=1)
    step: FloatArray = (at - centre) / np.float64(16)
    off: FloatArray = np.zeros(len(moved))
    np.maximum.at(off, owner, np.abs(rest).max(axis=1))
    bent = np.flatnonzero(off > _OFF)
    if not len(bent):
        return

    def summed(values: FloatArray) -> FloatArray:
        return np.bincount(owner, values, minlength=len(moved))[bent].astype(np.float64)

    square: FloatArray = np.empty((len(bent), 2, 2))
    product: FloatArray = np.empty((len(bent), 2, 2))
    for i in range(2):
        for j in range(2):
            # A step's worth against singular ones.
            square[:, i, j] = summed(step[:, i] * step[:, j]) + (i == j)
            product[:, i, j] = summed(2 * rest[:, i] * step[:, j])
    added = product @ np.linalg.inv(square)
    offset = _OFFSET_UNIT * np.rint(added.reshape(-1, 4) * UNIT / _OFFSET_UNIT)
    moved["offset"][bent] = np.clip(offset, -MOST_OFFSET, MOST_OFFSET).astype(np.int32)
