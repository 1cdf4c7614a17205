"""Transferring blocks from finished charts to a chart: one more placement there, of the same source.

A block that reaches beyond its chart's edge is laid on the neighbour as well, before the neighbour's own
blocks. These overlap it and match it exactly as they do each other, so charts have no seams to repair.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.charts.transitions import Transition
from upholster.methods.quilt._fit_kernels import (
    CENTRED,
    FITTED,
    MATRIX,
    PLACES,
    SOURCE_COLUMN,
    SOURCE_ROW,
    SYMMETRY,
    FieldNodes,
    SeamNumbers,
    fit_blocks,
)
from upholster.methods.quilt._transfer_kernels import transfer_masks
from upholster.methods.quilt.masked import BLOCK, LARGEST_BLOCK
from upholster.quilt.chart import Chart
from upholster.quilt.placement import SYMMETRIES
from upholster.quilt.warp_field import WarpField
from upholster.types import FloatArray

__all__ = ["EVERYWHERE", "BlockTransfer", "ChartPlacements", "joined"]

EVERYWHERE = (-(2**30), 2**30, -(2**30), 2**30)
"""Bounds that leave nothing out."""

_WINDOW = 16
"""Cells to either side of a corner within which blocks may matter to the chart beyond it."""

_RIM = 1
"""Cells inside the edge of a finished neighbour that stay as its blocks left them."""

_SAME_PLACE = 8
"""Texels: a block that comes back to within so many of where it lies is not laid again."""

_MOST_CELLS = 2**22


@dataclass(frozen=True, eq=False)
class ChartPlacements:
    """A chart's placements, and whose blocks they are.

    Attributes
    ----------
    placements
        `BLOCK`, in the order in which they lie over each other.
    cells
        Their masks' cells.
    origins
        (n,) int64: a number for the block that each one comes from, rising in the order of synthesis; a block
        keeps its number on every chart that it is transferred onto.
    steps
        (n,) int64: across how many edges each has been transferred from its own chart.
    bounds
        Rows from, to, columns from, to: where the chart's own count. Beyond, nothing is transferred.
    """

    placements: NDArray[np.void]
    cells: NDArray[np.uint8]
    origins: NDArray[np.int64]
    steps: NDArray[np.int64]
    bounds: tuple[int, int, int, int] = EVERYWHERE


def joined(parts: Sequence[ChartPlacements]) -> ChartPlacements:
    """Return placements one after another."""
    counts = [len(part.placements) for part in parts]
    starts = np.cumsum([0, *(len(part.cells) for part in parts)])
    # Filled, for NumPy takes long to find out that records of one kind go together.
    placements = np.empty(sum(counts), BLOCK)
    stops = np.cumsum(counts).tolist()
    for part, count, stop in zip(parts, counts, stops, strict=True):
        placements[stop - count : stop] = part.placements
    shift = np.repeat(starts[:-1], counts)
    placements["first_cell"] += np.where(placements["first_cell"] >= 0, shift, 0).astype(np.int32)
    return ChartPlacements(
        placements,
        np.concatenate([np.zeros(0, np.uint8), *(part.cells for part in parts)]),
        np.concatenate([np.zeros(0, np.int64), *(part.origins for part in parts)]),
        np.concatenate([np.zeros(0, np.int64), *(part.steps for part in parts)]),
    )


@dataclass(frozen=True, eq=False)
class BlockTransfer:
    """How blocks get from chart to chart.

    Attributes
    ----------
    charts, fields
        The layout.
    onto
        Per chart, the transitions from each seam's other chart onto it.
    around
        Per chart, those from one of its edges onto the opposite one, where it meets itself.
    exemplar_shape
        (height, width) in pixels.
    mask_cells
        Per chart, the size of masks' cells in texels.
    """

    charts: Sequence[Chart]
    fields: Sequence[WarpField]
    onto: Sequence[Sequence[Transition]]
    around: Sequence[Sequence[Transition]]
    exemplar_shape: tuple[int, int]
    mask_cells: Sequence[int]

    def transferred_onto(self, chart: int, finished: Sequence[ChartPlacements | None]) -> ChartPlacements:
        """Collect the blocks that reach a chart from finished ones: neighbours, and those across a corner.

        Parameters
        ----------
        chart
            Its index.
        finished
            What finished charts have along their edges, see `overhang`; None elsewhere.

        Returns
        -------
        ChartPlacements
            In the order of synthesis; a block more than once where ways round a corner disagree about it.
        """
        parts = []
        for transition in self.onto[chart]:
            laid = finished[transition.seam.chart]
            if laid is not None:
                parts.append(self._transferred(transition, laid))
                continue
            # Across a corner, over the chart in between, which is not laid yet.
            for corner in self._corners(transition, finished):
                beyond = finished[corner.transition.seam.chart]
                assert beyond is not None
                between = self._transferred(corner.transition, beyond, corner.window)
                if between is not None:
                    parts.append(self._transferred(transition, between))
        found = joined([part for part in parts if part is not None])
        return _distinct(found)

    def overhang(self, chart: int, laid: ChartPlacements) -> ChartPlacements:
        """Return what other charts need of a finished one: the blocks that reach one of its edges."""
        ends, reach = (-np.inf, np.inf), self._reach(chart)
        reaching = np.zeros(len(laid.placements), bool)
        for edge in range(4):
            reaching |= _overhanging(laid.placements, self.charts[chart], edge, ends, reach)[0]
        return _taken(laid, np.flatnonzero(reaching))

    def asked_of(self, chart: int) -> set[int]:
        """Return the charts whose overhangs a chart may need: neighbours, and those across a corner."""
        beside = {transition.seam.chart for transition in self.onto[chart]}
        return beside | {further.seam.chart for one in beside for further in self.onto[one]} - {chart}

    def _reach(self, chart: int) -> int:
        # How near to an edge a block must come that may be transferred over it.
        return 2 * self.mask_cells[chart] + 2

    def transferred_around(self, chart: int, laid: ChartPlacements) -> ChartPlacements:
        """Collect the blocks of a chart that reach it once more, over an edge where it meets itself.

        Parameters
        ----------
        chart
            Its index.
        laid
            What is laid on it so far.

        Returns
        -------
        ChartPlacements
            In the order of synthesis, without those that lie there already.
        """
        parts = [self._transferred(transition, laid) for transition in self.around[chart]]
        found = _distinct(joined([part for part in parts if part is not None]))
        new = ~_already_there(found, laid)
        return ChartPlacements(found.placements[new], found.cells, found.origins[new], found.steps[new])

    def closed_around(self, chart: int) -> list[tuple[int, float, float, int]]:
        """Tell where a chart meets itself, as `closed` does."""
        rim = _RIM * self.mask_cells[chart]
        seams = [transition.seam for transition in self.around[chart]]
        ends = [(min(m.other_start, m.other_stop), max(m.other_start, m.other_stop)) for m in seams]
        return [(m.other_edge, *end, rim) for m, end in zip(seams, ends, strict=True)]

    def open_sides(self, chart: int, finished: Sequence[ChartPlacements | None]) -> set[int]:
        """Return the edges of a chart at which a neighbour is not laid yet."""
        return {
            transition.seam.other_edge
            for transition in self.onto[chart]
            if finished[transition.seam.chart] is None
        }

    def closed(
        self, chart: int, finished: Sequence[ChartPlacements | None]
    ) -> list[tuple[int, float, float, int]]:
        """Tell where finished charts lie round a chart.

        Returns
        -------
        list of tuple
            Edge, from and to along it in texels (infinite where it goes on beyond a corner), and how many
            texels inside the edge must stay as the neighbour's blocks left them.
        """
        found = []
        for transition in self.onto[chart]:
            seam = transition.seam
            edge, here = seam.other_edge, self.charts[chart]
            rim = _RIM * self.mask_cells[chart]
            length = here.height if edge & 1 else here.width
            start, stop = sorted((seam.other_start, seam.other_stop))
            if finished[seam.chart] is not None:
                low = -np.inf if start <= 0 else start
                found.append((edge, low, np.inf if stop >= length else stop, rim))
                continue
            for corner in self._corners(transition, finished):
                at = seam.other_start if corner.low else seam.other_stop
                found.append((edge, -np.inf, at, 0) if at == start else (edge, at, np.inf, 0))
        return found

    def _corners(self, transition: Transition, finished: Sequence[ChartPlacements | None]) -> list["_Corner"]:
        # Finished charts at either end of the seam of two charts that are not finished.
        seam = transition.seam
        between = self.charts[seam.chart]
        length = between.height if seam.edge & 1 else between.width
        found = []
        for other in self.onto[seam.chart]:
            far = other.seam
            if (
                finished[far.chart] is None
                or far.chart == seam.other_chart
                or (far.other_edge + seam.edge) % 2 == 0
            ):
                continue
            low = far.other_edge in (0, 3)
            if (seam.start > 0.5) if low else (seam.stop < length - 0.5):
                continue
            # Where along the far chart's edge the corner lies.
            side = between.height if far.other_edge & 1 else between.width
            corner = 0.0 if seam.edge in (0, 3) else float(side)
            ends = (far.other_start, far.start), (far.other_stop, far.stop)
            place = min(ends, key=lambda end: abs(end[0] - corner))
            if abs(place[0] - corner) < 0.5:
                window = float(_WINDOW * self.mask_cells[far.chart])
                found.append(_Corner(other, low, (place[1] - window, place[1] + window)))
        return found

    def _transferred(
        self, transition: Transition, laid: ChartPlacements, window: tuple[float, float] | None = None
    ) -> ChartPlacements | None:
        seam, chart = transition.seam, transition.seam.other_chart
        old, here, cell = self.charts[seam.chart], self.charts[chart], self.mask_cells[chart]
        ends = (seam.start, seam.stop)
        if window is not None:
            ends = (max(ends[0], window[0]), min(ends[1], window[1]))
        placed, low, high = _overhanging(laid.placements, old, seam.edge, ends, self._reach(seam.chart))
        chosen = np.flatnonzero(placed)
        if not len(chosen):
            return None
        block = laid.placements[chosen]
        places, fitted = self._fitted(transition, block, np.stack([low[placed], high[placed]], axis=1))
        fits = fitted[:, SYMMETRY] >= 0
        if not fits.any():
            return None
        chosen, block, places, fitted = chosen[fits], block[fits], places[fits], fitted[fits]
        out, masks = _masks(block, laid, places, cell, here)
        kept = (out[:, 4] >= 0) & (out[:, 2:4].max(axis=1) <= LARGEST_BLOCK)
        chosen, out, fitted = chosen[kept], out[kept], fitted[kept]
        result = np.zeros(len(chosen), BLOCK)
        result["chart"] = chart
        for n, name in enumerate(("row", "column", "height", "width", "first_cell")):
            result[name] = out[:, n]
        height, width = self.exemplar_shape
        result["source_row"] = np.clip(fitted[:, SOURCE_ROW], 0, 16 * (height - 1))
        result["source_column"] = np.clip(fitted[:, SOURCE_COLUMN], 0, 16 * (width - 1))
        result["symmetry"], result["centred"] = fitted[:, SYMMETRY], fitted[:, CENTRED]
        result["matrix"] = np.where(fitted[:, CENTRED, None] > 0, fitted[:, MATRIX:], 0)
        result["mask_cell"] = cell
        return ChartPlacements(result, masks, laid.origins[chosen], laid.steps[chosen] + 1)

    def _fitted(
        self, transition: Transition, block: NDArray[np.void], ends: FloatArray
    ) -> tuple[FloatArray, NDArray[np.int64]]:
        # How blocks are shown across a seam, see `fit_blocks`.
        seam = transition.seam
        old, new = self.fields[seam.chart], self.fields[seam.other_chart]
        here = self.charts[seam.other_chart]
        places, fitted = np.empty((len(block), PLACES)), np.empty((len(block), FITTED), np.int64)
        fit_blocks(
            block,
            ends,
            SeamNumbers(
                *(seam.edge, seam.other_edge, seam.start, seam.stop, seam.other_start, seam.other_stop),
                *(transition.line, transition.other_line),
            ),
            transition.matrices,
            FieldNodes(old.matrices, old.margin),
            FieldNodes(new.matrices, new.margin),
            (here.height, here.width),
            SYMMETRIES,
            places,
            fitted,
        )
        return places, fitted


def _taken(laid: ChartPlacements, chosen: NDArray[np.intp]) -> ChartPlacements:
    # Some of the placements, with the cells of their masks alone.
    placed = laid.placements[chosen]
    cut = placed["first_cell"] >= 0
    size = np.maximum(1, placed["mask_cell"]).astype(np.int64)
    counts = np.where(cut, -(-placed["height"] // size) * -(-placed["width"] // size), 0)
    starts = np.cumsum(counts) - counts
    at = np.repeat(placed["first_cell"] - starts, counts) + np.arange(counts.sum())
    placed["first_cell"][cut] = starts[cut]
    return replace(
        laid,
        placements=placed,
        cells=laid.cells[at],
        origins=laid.origins[chosen],
        steps=laid.steps[chosen],
    )


def _already_there(found: ChartPlacements, laid: ChartPlacements) -> NDArray[np.bool_]:
    # Which blocks lie on their chart already, in about the same place: a way round leads back.
    out = np.zeros(len(found.origins), bool)
    for n, origin in enumerate(found.origins.tolist()):
        one, same = found.placements[n], laid.placements[laid.origins == origin]
        rows, columns = np.abs(same["row"] - one["row"]), np.abs(same["column"] - one["column"])
        out[n] = bool(((rows < _SAME_PLACE) & (columns < _SAME_PLACE)).any())
    return out


def _distinct(found: ChartPlacements) -> ChartPlacements:
    # One version of each block, in painting order: that which was transferred over the fewest edges, which
    # lies most truly. Others that lie in the same place add to its mask; those that lie elsewhere come before
    # it, and show where it does not.
    order = np.lexsort((found.steps, found.origins))
    _, first, which = np.unique(found.origins[order], return_index=True, return_inverse=True)
    block = found.placements[order]
    best = block[first[which]]
    apart = np.zeros(len(order), bool)
    for name, most in (("row", 1), ("column", 1), ("source_row", 16), ("source_column", 16)):
        apart |= np.abs(block[name] - best[name]) > most
    again = ~apart
    again[first] = False
    for n in np.flatnonzero(again):
        _add_mask(found.cells, best[n], block[n])
    apart[first] = True
    kept = order[apart]
    kept = kept[np.lexsort((-found.steps[kept], found.origins[kept]))]
    return ChartPlacements(found.placements[kept], found.cells, found.origins[kept], found.steps[kept])


def _add_mask(cells: NDArray[np.uint8], one: np.void, other: np.void) -> None:
    # Adds another version of a block's mask, which lies in about the same place, to one.
    size = int(one["mask_cell"])
    grids, places = [], []
    for block in (one, other):
        rows, columns = -(-int(block["height"]) // size), -(-int(block["width"]) // size)
        start = int(block["first_cell"])
        grids.append(cells[start : start + rows * columns].reshape(rows, columns))
        places.append((block["row"] - block["height"] // 2, block["column"] - block["width"] // 2))
    here, there = grids
    picked = []
    for axis in range(2):
        index = np.arange(here.shape[axis])
        moved = (places[0][axis] - places[1][axis] + size * index + size // 2) // size
        inside = (moved >= 0) & (moved < there.shape[axis])
        picked.append((index[inside], moved[inside]))
    (rows_here, rows_there), (columns_here, columns_there) = picked
    here[np.ix_(rows_here, columns_here)] |= there[np.ix_(rows_there, columns_there)]


@dataclass(frozen=True, eq=False, slots=True)
class _Corner:
    """A finished chart across a corner.

    Attributes
    ----------
    transition
        From it onto the chart between.
    low
        Whether the corner lies at the start of that chart's seam with the chart to cover, or at its stop.
    window
        What part of the finished chart's edge is near the corner: from, to, in its texels.
    """

    transition: Transition
    low: bool
    window: tuple[float, float]


def _masks(
    block: NDArray[np.void], laid: ChartPlacements, places: FloatArray, cell: int, here: Chart
) -> tuple[NDArray[np.int32], NDArray[np.uint8]]:
    # The masks on the other chart, see `transfer_masks`.
    area = (block["height"] + 8.0 * cell) * (block["width"] + 8.0 * cell)
    area /= np.abs(places[:, 2] * places[:, 5] - places[:, 3] * places[:, 4])
    masks = np.empty(min(_MOST_CELLS, int(4 * area.sum() / cell**2) + 64 * len(block)), np.uint8)
    out = np.empty((len(block), 5), np.int32)
    columns = [block[name].astype(np.int32) for name in ("row", "column", "height", "width")]
    columns.append(np.maximum(1, block["mask_cell"]).astype(np.int32))
    columns += [(block["first_cell"] >= 0).astype(np.int32), block["first_cell"]]
    count = transfer_masks(
        np.stack(columns, axis=1),
        laid.cells,
        places,
        laid.bounds,
        cell,
        here.height,
        here.width,
        out,
        masks,
    )
    return out, masks[:count].copy()


def _overhanging(
    placed: NDArray[np.void], chart: Chart, edge: int, ends: tuple[float, float], reach: int
) -> tuple[NDArray[np.bool_], FloatArray, FloatArray]:
    # Which blocks reach as far as the seam's edge somewhere in its interval, and from where to where along
    # it.
    top, left = placed["row"] - placed["height"] // 2, placed["column"] - placed["width"] // 2
    bottom, right = top + placed["height"], left + placed["width"]
    beyond = (
        top < reach,
        right > chart.width - reach,
        bottom > chart.height - reach,
        left < reach,
    )[edge]
    near = (bottom > 0, left < chart.width, top < chart.height, right > 0)[edge]
    low, high = (top, bottom) if edge & 1 else (left, right)
    low, high = np.maximum(low, ends[0]), np.minimum(high, ends[1])
    return beyond & near & (low < high), low, high
