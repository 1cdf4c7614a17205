"""The result as a plan: charts in the order in which they were laid, blocks with links, masks as windows."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt.grid import BlockGrid
from upholster.methods.quilt.transfer import ChartPlacements
from upholster.quilt.chart import Chart
from upholster.quilt.placement import MASK_CUT, mask_windows, touches
from upholster.quilt.plans import ChartGrid, GridPlan, PlacementList
from upholster.quilt.plans.grid import BLOCK

__all__ = ["emit_list", "emit_plan", "windows_of"]


def emit_plan(
    charts: Sequence[Chart],
    grids: Sequence[BlockGrid],
    laid: Sequence[ChartPlacements],
    order: Sequence[int],
) -> GridPlan:
    """Return the plan of what was laid.

    Parameters
    ----------
    charts, grids
        The layout, and where each chart's own blocks lie.
    laid
        Each chart's placements: those transferred to it, then its own.
    order
        The charts' numbers in the order in which they were laid.

    Returns
    -------
    GridPlan
        Without blocks that do not touch their chart: they served to be transferred to its neighbours.
    """
    kept = [np.flatnonzero(touches(part.placements, charts)) for part in laid]
    indices = _coded_indices(laid, kept, order)
    chart_grids: list[ChartGrid] = []
    blocks, cells = [np.zeros(0, BLOCK)], [np.zeros(0, np.uint8)]
    for n in order:
        parts = np.split(kept[n], np.searchsorted(kept[n], laid[n].ends[:-1]))
        for part in [one for k, one in enumerate(parts) if k == 0 or len(one)]:
            before = chart_grids[-1] if chart_grids else None
            chart_grids.append(_chart_grid(n, grids[n], laid[n], part, before))
        blocks.append(_blocks(laid[n], kept[n], _links(laid, indices, n, kept[n])))
        cells += windows_of(laid[n], kept[n], charts)
    return GridPlan(tuple(chart_grids), grids[0].feather, np.concatenate(blocks), np.concatenate(cells))


def emit_list(charts: Sequence[Chart], laid: ChartPlacements) -> PlacementList:
    """Return one chart's placements as a plain list: those of a tile wrap round, which no grid tells."""
    kept = np.flatnonzero(touches(laid.placements, charts))
    placed = laid.placements[kept]
    cells = windows_of(laid, kept, charts)
    sizes = np.array([len(part) for part in cells], np.int64)
    cut = placed["mask"] == MASK_CUT
    placed["first_cell"][cut] = np.cumsum(sizes) - sizes
    return PlacementList(placed, np.concatenate([np.zeros(0, np.uint8), *cells]))


def windows_of(
    laid: ChartPlacements, kept: NDArray[np.intp], charts: Sequence[Chart]
) -> list[NDArray[np.uint8]]:
    """Return the windows of the cut masks of some placements, whose masks are whole."""
    placed = laid.placements[kept]
    placed = placed[placed["mask"] == MASK_CUT]
    cell = placed["mask_cell"].astype(np.int64)
    rows, columns = -(-placed["height"] // cell), -(-placed["width"] // cell)
    found = []
    for first, high, wide, (i0, i1, j0, j1) in zip(
        placed["first_cell"].tolist(),
        rows.tolist(),
        columns.tolist(),
        mask_windows(placed, charts).tolist(),
        strict=True,
    ):
        mask = laid.cells[first : first + high * wide].reshape(high, wide)
        found.append(mask[i0:i1, j0:j1].reshape(-1))
    return found


def _coded_indices(
    laid: Sequence[ChartPlacements], kept: Sequence[NDArray[np.intp]], order: Sequence[int]
) -> list[NDArray[np.int64]]:
    # Per chart, the index of each placement among the plan's blocks; -1 for those that are left out.
    indices = [np.full(len(part.placements), -1, np.int64) for part in laid]
    start = 0
    for n in order:
        indices[n][kept[n]] = start + np.arange(len(kept[n]))
        start += len(kept[n])
    return indices


def _links(
    laid: Sequence[ChartPlacements], indices: Sequence[NDArray[np.int64]], chart: int, kept: NDArray[np.intp]
) -> NDArray[np.int64]:
    # The block that each came from; where that was left out, the one that it came from in turn.
    links = np.full(len(kept), -1, np.int64)
    for n, parent in enumerate(laid[chart].parents[kept].tolist()):
        while parent[0] >= 0:
            links[n] = indices[parent[0]][parent[1]]
            if links[n] >= 0:
                break
            parent = laid[parent[0]].parents[parent[1]].tolist()
    return links


def _blocks(laid: ChartPlacements, kept: NDArray[np.intp], links: NDArray[np.int64]) -> NDArray[np.void]:
    placed = laid.placements[kept]
    blocks = np.zeros(len(placed), BLOCK)
    for name in (
        *("row", "column", "height", "width", "symmetry"),
        *("source_row", "source_column", "centred", "matrix"),
    ):
        blocks[name] = placed[name]
    blocks["cut"] = placed["mask"] == MASK_CUT
    blocks["link"] = links
    return blocks


def _chart_grid(
    chart: int, grid: BlockGrid, laid: ChartPlacements, kept: NDArray[np.intp], before: ChartGrid | None
) -> ChartGrid:
    # No more positions than those between the chart's own blocks that were laid at this time.
    first_added = len(laid.placements) - laid.added
    own = laid.placements[kept[(laid.parents[kept, 0] < 0) & (kept < first_added)]]
    transferred = len(kept) - len(own)
    steps = grid.height - grid.overlap_rows, grid.width - grid.overlap_columns
    if not len(own):
        if before is not None:
            # Its numbers mean nothing: those of the grid before take no bytes.
            changed = {"rows": 1, "across": 1, "mask_cell": grid.mask_cell, "transferred": transferred}
            return replace(before, chart=chart, own=0, **changed)
        first = grid.height // 2, grid.width // 2
        return ChartGrid(
            chart, 1, 1, *first, grid.height, grid.width, *steps, grid.level, grid.mask_cell, transferred, 0
        )
    low_row, low_column = int(own["row"].min()), int(own["column"].min())
    return ChartGrid(
        chart,
        (int(own["row"].max()) - low_row) // steps[0] + 1,
        (int(own["column"].max()) - low_column) // steps[1] + 1,
        low_row,
        low_column,
        grid.height,
        grid.width,
        *steps,
        grid.level,
        grid.mask_cell,
        transferred,
        len(own),
    )
