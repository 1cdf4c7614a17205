"""What was laid becomes placements and labels: of each cell, the block that shows there in the end.

Blocks are laid one over the other, with masks. Each cell takes the block that shows at its middle. A block's
centre moves into the cells that show it, with what it reads there; where that turns or stretches it by more
than a little, its matrix gets an offset, fitted to those cells.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._emit_kernels import fill_labels, trace_cells
from upholster.methods.quilt.transfer import ChartPlacements
from upholster.parallel import run_tasks
from upholster.quilt.chart import Chart
from upholster.quilt.displacement import warped_sources
from upholster.quilt.labels import LabelMap, cell_centres, label_shape
from upholster.quilt.model import Quilt
from upholster.quilt.placement import MOST_OFFSET, PLACEMENT, SYMMETRIES, bare_placement
from upholster.quilt.warp_field import UNIT, WarpField
from upholster.types import FloatArray, IntArray

__all__ = ["LABEL_CELL", "Labelled", "emitted_quilt", "labelled", "tile_cell"]

LABEL_CELL = 2
"""Steps a side of a cell of label maps: blocks are blended over so many. Cells of two charts do not line up:
the larger they are, the more a border of blocks is off where it crosses a seam."""

_SOURCE_UNIT, _OFFSET_UNIT = 4, 64
"""Sources are quarters of a pixel, offsets 1/64 pixel for a step: finer ones only cost bytes."""

_OFF = 0.3
"""Pixels that a placement may be off somewhere before its matrix gets an offset."""

Labelled = tuple[NDArray[np.void], LabelMap]
"""A chart's placements and labels."""


def tile_cell(tile: Chart) -> int:
    """Return the side of a tile's cells in steps: about `LABEL_CELL`, of which a whole number is each side.

    Then the cells beyond an edge are those at the opposite one, and blocks are blended alike on both sides.
    """
    sides = tile.height, tile.width
    return next(cell for cell in (LABEL_CELL, 3, 1) if not any(side % cell for side in sides))


def emitted_quilt(
    charts: Sequence[Chart],
    fields: Sequence[WarpField],
    exemplar_shape: tuple[int, int],
    laid: Sequence[ChartPlacements],
    *,
    cell: int,
    threads: int | None = None,
) -> Quilt:
    """Return the quilt of what was laid.

    Parameters
    ----------
    charts, fields, exemplar_shape
        As in `Quilt`.
    laid
        What was laid on each chart.
    cell
        Steps a side of a cell of the label maps.
    threads
        As in `upholster.parallel.run_tasks`.
    """
    found: list[Labelled | None] = [None] * len(charts)

    def label(n: int) -> None:
        found[n] = labelled(n, charts[n], fields[n], exemplar_shape, laid[n], cell=cell)

    run_tasks([partial(label, n) for n in range(len(charts))], threads=threads)
    each = [one for one in found if one is not None]
    placements = np.concatenate([own for own, _ in each])
    return Quilt(
        tuple(charts), exemplar_shape, placements, tuple((layer,) for _, layer in each), tuple(fields)
    )


def labelled(
    number: int,
    chart: Chart,
    field: WarpField,
    shape: tuple[int, int],
    laid: ChartPlacements,
    *,
    cell: int,
) -> Labelled:
    """Return the placements and labels of one chart, see `emitted_quilt`."""
    seen = np.full(label_shape(chart.height, chart.width, cell), -1, np.int32)
    trace_cells(laid.placements, laid.cells, laid.steps, laid.bounds, cell, seen)
    there = np.bincount(1 + seen.reshape(-1), minlength=1 + len(laid.placements)) > 0
    there[0] = True
    shown: IntArray = (np.cumsum(there) - 2).astype(np.int32)[1 + seen]
    if there[1:].any():
        blocks = _unmasked(number, laid.placements[there[1:]], field)
    else:
        blocks, shown = bare_placement(number, (chart.height, chart.width), shape), 0 * np.abs(seen)
    moved, centre = _recentred(blocks, shown, field, shape, cell)
    fill_labels(shown, np.empty(shown.size, np.int64))
    order = np.lexsort((centre[:, 1], centre[:, 0]))
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    return moved[order], LabelMap(cell, rank[shown])


def _unmasked(number: int, laid: NDArray[np.void], field: WarpField) -> NDArray[np.void]:
    # Placements that read as blocks do: the middle of step k is at 16·k + 8.
    found = np.zeros(len(laid), PLACEMENT)
    found["chart"] = number
    for name in ("row", "column"):
        found[name] = 16 * laid[name] + 8
    for name in ("source_row", "source_column", "symmetry"):
        found[name] = laid[name]
    offset = laid["matrix"] - field.between(found["row"], found["column"])
    found["offset"] = np.where(laid["centred"][:, None] > 0, offset, 0)
    return found


def _recentred(
    blocks: NDArray[np.void],
    shown: NDArray[np.int32],
    field: WarpField,
    shape: tuple[int, int],
    cell: int,
) -> tuple[NDArray[np.void], IntArray]:
    """Return placements whose centres are middles of cells that show them, and these cells' places.

    `shown` tells of each cell the placement that was laid there, −1 where it is to be the nearest one's: such
    cells may be many and lie far away.
    """
    rows, columns = np.nonzero(shown >= 0)
    owner = shown[rows, columns]
    at = cell_centres(shown.shape[0], cell)[rows], cell_centres(shown.shape[1], cell)[columns]
    read = np.stack(warped_sources(field, blocks[owner], *at), axis=1).astype(np.int64)
    inside = ((read >= 0) & (read < 16 * np.array(shape))).all(axis=1)
    within = (rows > 0) & (rows < shown.shape[0] - 1) & (columns > 0) & (columns < shown.shape[1] - 1)
    size = np.bincount(owner, minlength=len(blocks))
    middle = [np.bincount(owner, index, minlength=len(blocks)) / size for index in (rows, columns)]
    away = (rows - middle[0][owner]) ** 2 + (columns - middle[1][owner]) ** 2
    # Cells that read inside the sample come first, then those on the chart, then near ones.
    away += 2.0**34 * ~within + 2.0**36 * ~inside
    least = np.full(len(blocks), np.inf)
    np.minimum.at(least, owner, away)
    nearest = np.flatnonzero(away == least[owner])[::-1]
    chosen = np.empty(len(blocks), np.intp)
    chosen[owner[nearest]] = nearest  # of several the first
    moved = blocks.copy()
    moved["row"], moved["column"] = at[0][chosen], at[1][chosen]
    for axis, name in enumerate(("source_row", "source_column")):
        whole = _SOURCE_UNIT * ((read[chosen, axis] + _SOURCE_UNIT // 2) // _SOURCE_UNIT)
        moved[name] = np.clip(whole, 0, 16 * shape[axis] - _SOURCE_UNIT)
    _fit_matrices(moved, field, owner, np.stack(at, axis=1), read)
    return moved, np.stack([rows[chosen], columns[chosen]], axis=1)


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
