"""From canvases to label maps: the block and the sheet that each cell of a chart shows."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, int64
from upholster.runtime.jit import inline, kernel
from upholster.synthesis.quilt.kernels._frame_kernels import KEPT_SHEET, Canvases
from upholster.synthesis.quilt.kernels._sheet_kernels import MOST_SHEETS, FieldArrays, shown_at
from upholster.synthesis.quilt.kernels._unfold_kernels import MeshArrays

__all__ = ["KEPT", "fill_labels", "label_beyond", "label_cells", "list_sheets"]

KEPT = -2
"""Instead of a label: the cell stays as it was."""

_REACH = 2.0
"""Distance from a seam, in cells, up to which cells beyond it are labelled by the chart across."""

_ALIKE = 4.0
"""Two sheets of a block continue each other across a seam where they differ by less than this many frame
pixels."""


@kernel
def label_cells(
    canvases: Canvases,
    own: NDArray[np.uint8],
    chart: int,
    cell: int,
    away: FloatArray,
    labels: NDArray[np.int64],
) -> None:
    """Write the block and sheet that each cell of a chart shows, ``block · MOST_SHEETS + sheet``; −1: none.

    `KEPT`: the cell stays as it was. A cell takes the step right after its middle, or the first of its steps
    that shows a block. `away` receives 0 if that step is in a triangle that is `own` (T,), −1 if it is not,
    and infinity if the cell shows no block.
    """
    height, width, first = canvases.heights[chart], canvases.widths[chart], canvases.firsts[chart]
    for i in range(labels.shape[0]):
        for j in range(labels.shape[1]):
            labels[i, j], away[i, j] = -1, np.inf
            for n in range(cell * cell + 1):
                down, right = (cell // 2, cell // 2) if n == 0 else ((n - 1) // cell, (n - 1) % cell)
                r, c = (i - 1) * cell + down, (j - 1) * cell + right
                if 0 <= r < height and 0 <= c < width:
                    at = first + r * width + c
                    if canvases.owners[at] >= 0 and canvases.sheets[at] == KEPT_SHEET:
                        labels[i, j], away[i, j] = KEPT, -1.0
                        break
                    if canvases.owners[at] >= 0:
                        labels[i, j] = int64(canvases.owners[at]) * MOST_SHEETS + canvases.sheets[at]
                        away[i, j] = 0.0 if own[canvases.triangles[at]] else -1.0
                        break


@inline
def _goes_on(
    field: FieldArrays,
    canvases: Canvases,
    firsts: NDArray[np.int64],
    fits: FloatArray,
    chart: int,
    here: tuple[float, float],
    other: int,
    there: tuple[float, float],
) -> Any:
    # The block at a place of another chart, and its sheet that continues at a place of this chart; −1: the
    # block does not continue; `KEPT`: the other chart's step is kept.
    r = min(max(int64(np.floor(there[0] + 0.5)), 0), canvases.heights[other] - 1)
    c = min(max(int64(np.floor(there[1] + 0.5)), 0), canvases.widths[other] - 1)
    at = canvases.firsts[other] + r * canvases.widths[other] + c
    block = int64(canvases.owners[at])
    if block < 0:
        return int64(-1)
    if canvases.sheets[at] == KEPT_SHEET:
        return int64(KEPT)
    wanted = shown_at(field, fits[firsts[block] + canvases.sheets[at]], there[0], there[1])
    best, least = int64(-1), _ALIKE * _ALIKE
    for row in range(firsts[block], firsts[block + 1]):
        if fits[row, 0] == 1.0 and int64(fits[row, 1]) == chart:
            y, x = shown_at(field, fits[row], here[0], here[1])
            away = (y - wanted[0]) ** 2 + (x - wanted[1]) ** 2
            if away < least:
                best, least = block * MOST_SHEETS + row - firsts[block], away
    return best


@kernel
def label_beyond(
    mesh: MeshArrays,
    field: FieldArrays,
    canvases: Canvases,
    firsts: NDArray[np.int64],
    fits: FloatArray,
    edges: NDArray[np.int64],
    chart: int,
    cell: int,
    away: FloatArray,
    labels: NDArray[np.int64],
) -> None:
    """Label cells beyond a chart's seams by the blocks that show there, on the chart beyond.

    `edges` (n, 2) are the chart's edges on seams, triangle and edge; `firsts` and `fits` are all blocks'
    sheets. `away` (rows, columns) comes from `label_cells`, and receives the squared distance, in steps, of
    cells beyond a seam.
    """
    reach = _REACH * cell
    for e in range(edges.shape[0]):
        t, k = edges[e, 0], edges[e, 1]
        m, across = (k + 1) % 3, mesh.neighbours[t, k]
        other, l = across // 3, across % 3  # noqa: E741
        p, q, cross = mesh.places[t], mesh.places[other], mesh.crossing[mesh.seam[t, k]]
        y, x = p[m, 0] - p[k, 0], p[m, 1] - p[k, 1]
        length = y * y + x * x
        if length <= 0.0:
            continue
        # The middle of cell i is (i − ½)·cell steps from the chart's edge.
        i0 = int64(np.floor((min(p[k, 0], p[m, 0]) - reach) / cell)) + 1
        i1 = int64(np.floor((max(p[k, 0], p[m, 0]) + reach) / cell)) + 3
        j0 = int64(np.floor((min(p[k, 1], p[m, 1]) - reach) / cell)) + 1
        j1 = int64(np.floor((max(p[k, 1], p[m, 1]) + reach) / cell)) + 3
        for i in range(max(i0, 0), min(i1, labels.shape[0])):
            for j in range(max(j0, 0), min(j1, labels.shape[1])):
                if away[i, j] <= 0.0:
                    continue  # the cell shows a block
                row, column = (i - 0.5) * cell - 0.5, (j - 0.5) * cell - 0.5
                down, right = row - p[k, 0], column - p[k, 1]
                share = min(max((down * y + right * x) / length, 0.0), 1.0)
                down, right = down - share * y, right - share * x
                far = down * down + right * right
                if far >= away[i, j] or far > reach * reach:
                    continue
                n = (l + 1) % 3
                there = (
                    q[n, 0] + share * (q[l, 0] - q[n, 0]) + cross[0, 0] * down + cross[0, 1] * right + 1e-6,
                    q[n, 1] + share * (q[l, 1] - q[n, 1]) + cross[1, 0] * down + cross[1, 1] * right + 1e-6,
                )
                # Cells are labelled by the step right after their middle.
                found = _goes_on(
                    field,
                    canvases,
                    firsts,
                    fits,
                    chart,
                    (row, column),
                    int64(mesh.chart[other]),
                    (there[0] + 0.0, there[1] + 0.0),
                )
                if found >= 0 or found == KEPT:
                    labels[i, j], away[i, j] = found, far


@kernel
def list_sheets(
    seen: NDArray[np.int64],
    away: FloatArray,
    firsts: NDArray[np.int64],
    ranks: IntArray,
    labels: IntArray,
    keys: NDArray[np.int64],
) -> Any:
    """Assign numbers to the sheets that cells show, in raster order; return how many there are.

    `seen` and `away` are the results of `label_beyond`; cells with a negative `away` get no number. `labels`
    receives the numbers, −1 for none, `KEPT` where `seen` is `KEPT`; `keys` receives the sheets as in `seen`.
    `firsts` (B + 1,) are blocks' first sheets, and `ranks` is scratch with an entry for each sheet, all −1.
    """
    count = int64(0)
    for i in range(seen.shape[0]):
        for j in range(seen.shape[1]):
            labels[i, j] = KEPT if seen[i, j] == KEPT else -1
            if seen[i, j] < 0 or away[i, j] < 0.0:
                continue
            at = firsts[seen[i, j] // MOST_SHEETS] + seen[i, j] % MOST_SHEETS
            if ranks[at] < 0:
                ranks[at] = count
                keys[count] = seen[i, j]
                count += 1
            labels[i, j] = ranks[at]
    for n in range(count):
        ranks[firsts[keys[n] // MOST_SHEETS] + keys[n] % MOST_SHEETS] = -1
    return count


@inline
def _is_next_to_none(labels: IntArray, i: int, j: int) -> Any:
    # Whether one of a cell's four neighbours has no label.
    return (
        (i > 0 and labels[i - 1, j] < 0)
        or (i + 1 < labels.shape[0] and labels[i + 1, j] < 0)
        or (j > 0 and labels[i, j - 1] < 0)
        or (j + 1 < labels.shape[1] and labels[i, j + 1] < 0)
    )


@kernel
def fill_labels(labels: NDArray[np.int32], queue: NDArray[np.int64]) -> None:
    """Give each cell without a label, −1, the label of the nearest cell by rows plus columns.

    `queue` has room for all cells. If several cells are equally near, the first one in raster order counts.
    """
    wide, first, last = labels.shape[1], 0, 0
    for i in range(labels.shape[0]):
        for j in range(wide):
            if labels[i, j] >= 0 and _is_next_to_none(labels, i, j):
                queue[last] = i * wide + j
                last += 1
    while first < last:
        i, j = queue[first] // wide, queue[first] % wide
        first += 1
        for k in range(4):
            a, b = i + (k == 0) - (k == 1), j + (k == 2) - (k == 3)
            if 0 <= a < labels.shape[0] and 0 <= b < wide and labels[a, b] < 0:
                labels[a, b] = labels[i, j]
                queue[last] = a * wide + b
                last += 1
