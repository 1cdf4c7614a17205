"""What becomes of a chart's cells, in plain NumPy: the oracle of `_emit_kernels`."""

import numpy as np
from plain_laying import SYMMETRIES

from upholster.methods.quilt._emit_kernels import CellLabels
from upholster.quilt.displacement import warped_sources
from upholster.quilt.labels import cell_centres
from upholster.quilt.placement import PLACEMENT
from upholster.quilt.warp_field import WarpField

TURNS = np.array(SYMMETRIES).reshape(-1, 2, 2)


def plain_read(field: WarpField, cells: CellLabels, owner: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return where places (n, 2) in 1/16 step read by sheets (n,), in 1/16 pixel."""
    fits, records, unit = cells.fits[owner], cells.records[owner], 1 << cells.level
    places = at / 16 - 0.5
    own = TURNS[fits[:, 10].astype(int)] @ (field.at(*places.T) / unit)
    away = np.einsum("nij,nj->ni", 0.5 * (fits[:, 6:10].reshape(-1, 2, 2) + own), places - fits[:, 2:4])
    shown = np.einsum("nij,nj->ni", TURNS[records[:, 2]], fits[:, 4:6] + away)
    sources = 16 * (unit * (records[:, :2] + 0.5) - 0.5)
    return np.asarray(sources + np.rint(16 * unit * shown)).astype(np.int64)


def plain_placements(
    field: WarpField, cells: CellLabels, symmetries: np.ndarray, shape: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Return each sheet's placement, and its centre's cell (n, 2), −1 for those that no cell shows."""
    placed = np.zeros(len(cells.records), PLACEMENT)
    placed["symmetry"] = symmetries
    chosen = np.full((len(placed), 2), -1)
    at_rows, at_columns = (cell_centres(count, cells.cell) for count in cells.labels.shape)
    for n in range(len(placed)):
        at = np.argwhere(cells.labels == n)
        if not len(at):
            continue
        places = np.stack([at_rows[at[:, 0]], at_columns[at[:, 1]]], axis=1)
        read = plain_read(field, cells, np.full(len(at), n), places)
        away = ((at - at.mean(axis=0)) ** 2).sum(axis=1)
        inner = ((at > 0) & (at < np.array(cells.labels.shape) - 1)).all(axis=1)
        inside = ((read >= 0) & (read < 16 * np.array(shape))).all(axis=1)
        best = int(np.lexsort((np.arange(len(at)), away, ~inner, ~inside))[0])
        chosen[n] = at[best]
        placed["row"][n], placed["column"][n] = places[best]
        source = np.clip(4 * ((read[best] + 2) // 4), 0, 16 * np.array(shape) - 4)
        placed["source_row"][n], placed["source_column"][n] = source
        now = np.stack(warped_sources(field, placed[np.full(len(at), n)], *places.T), axis=1)
        missing = (read - now) / 16 @ TURNS[symmetries[n]]
        if np.abs(missing).max() > 0.3:
            step = (places - places[best]) / 16
            # ½·ΔC·step is what is missing, by least squares; a step's worth against singular ones.
            more = np.linalg.solve(step.T @ step + np.eye(2), 2 * step.T @ missing).T
            placed["offset"][n] = np.clip(64 * np.rint(more.ravel() * 4096 / 64), -(2**18), 2**18)
    return placed, chosen
