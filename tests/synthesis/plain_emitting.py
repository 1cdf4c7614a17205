"""Placements of a chart's cells in plain NumPy: what `centre_placements` does in a kernel."""

from typing import Any

import numpy as np
from laying_kernels import read_cells

from upholster.quilt.displacement import warped_sources
from upholster.quilt.placement import PLACEMENT, SYMMETRIES


def read(field: Any, cells: Any, owner: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return what places (n, 2) in 1/16 step read by sheets (n,), in 1/16 pixel."""
    found = np.empty((len(at), 2))
    read_cells(field, cells.fits, owner.astype(np.int64), at / 16 - 0.5, found)
    turn = SYMMETRIES[cells.sources[owner, 2]]
    parts = []
    for axis in range(2):
        shown = turn[:, 2 * axis] * found[:, 0] + turn[:, 2 * axis + 1] * found[:, 1]
        source = ((16 * cells.sources[owner, axis] + 8) << cells.level) - 8
        parts.append(source + np.rint((16 << cells.level) * shown).astype(np.int64))
    return np.stack(parts, axis=1)


def centred(field: Any, cells: Any, warp: Any, rounded: int) -> tuple[np.ndarray, ...]:
    """Return cells, sources, how far the field is off, and the sums of a fit: see `CentredArrays`."""
    count, last = len(cells.turns), np.array(cells.shown.shape) - 1
    rows, columns = np.nonzero(cells.shown >= 0)
    owner = cells.shown[rows, columns]
    at = 16 * cells.cell * (np.stack([rows, columns], axis=1) - 1) + 8 * cells.cell
    found = read(field, cells, owner, at)
    size = np.bincount(owner, minlength=count)
    away = np.zeros(len(owner))
    for index in (rows, columns):
        away += (index - (np.bincount(owner, index, minlength=count) / size)[owner]) ** 2
    away += 2.0**34 * ~((rows > 0) & (rows < last[0]) & (columns > 0) & (columns < last[1]))
    away += 2.0**36 * ~((found >= 0) & (found < 16 * np.array(cells.shape))).all(axis=1)
    order = np.lexsort((np.arange(len(owner)), away, owner))
    chosen = order[np.searchsorted(owner[order], np.arange(count))]
    reads = rounded * ((found[chosen] + rounded // 2) // rounded)
    reads = np.clip(reads, 0, 16 * np.array(cells.shape) - rounded)
    placed = np.zeros(count, PLACEMENT)
    placed["row"], placed["column"] = at[chosen].T
    placed["source_row"], placed["source_column"] = reads.T
    placed["symmetry"] = cells.turns
    now = np.stack(warped_sources(warp, placed[owner], at[:, 0], at[:, 1]), axis=1)
    turn = SYMMETRIES[cells.turns[owner]].reshape(-1, 2, 2)
    rest = np.einsum("nji,nj->ni", turn, (found - now) / 16)
    step = (at - at[chosen][owner]) / 16
    off = np.zeros(count)
    np.maximum.at(off, owner, np.abs(rest).max(axis=1))

    def summed(values: np.ndarray) -> np.ndarray:
        return np.bincount(owner, values, minlength=count)

    square = np.stack([summed(step[:, i] * step[:, j]) for i, j in ((0, 0), (0, 1), (1, 1))], axis=1)
    product = np.stack([summed(2 * rest[:, i] * step[:, j]) for i in range(2) for j in range(2)], axis=1)
    return np.stack([rows, columns], axis=1)[chosen], reads, off, square, product
