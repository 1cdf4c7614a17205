"""What the blocks of finished charts leave on a chart: placements of the same sources, seen from it.

A block that reaches beyond its chart's edge is laid on the neighbour as well, first of all, so that the
neighbour's own blocks go on from it exactly as they do from each other: no chart border is mended, for none
is made.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.synthesis._carry_kernels import carry_masks
from upholster.synthesis._paint_kernels import TURNS
from upholster.synthesis.field import Field, matrices_at
from upholster.synthesis.meetings import Carrier
from upholster.synthesis.quilt import MASK_CUT, PLACEMENT, Chart
from upholster.synthesis.warp import LARGEST_WARPED
from upholster.types import FloatArray

__all__ = ["Carrying", "Covering", "joined"]

_WORST_TURN = 25.0
"""In degrees: where directions on two charts differ more than this from quarter turns, nothing is carried."""

_WINDOW = 16
"""Cells to either side of a corner within which blocks may matter to the chart beyond it."""

_RIM = 1
"""Cells inside the edge of a finished neighbour that stay as its blocks left them."""

_EDGE_SAMPLES = 5
_MOST_CELLS = 2**22


@dataclass(frozen=True, eq=False)
class Covering:
    """A chart's placements, and whose blocks they are.

    Attributes
    ----------
    placements
        `PLACEMENT`, in painting order.
    cells
        Their masks' cells.
    origins
        (n,) int64: a number for the block that each one comes from, rising in the order of synthesis; a block
        keeps its number on every chart that it is carried onto.
    steps
        (n,) int64: across how many edges each has been carried from its own chart.
    bounds
        Rows from, to, columns from, to: where they count. Beyond, neighbours are on their own.
    """

    placements: NDArray[np.void]
    cells: NDArray[np.uint8]
    origins: NDArray[np.int64]
    steps: NDArray[np.int64]
    bounds: tuple[int, int, int, int] = (-(2**30), 2**30, -(2**30), 2**30)


def joined(parts: Sequence[Covering]) -> Covering:
    """Return coverings one after another."""
    starts = np.cumsum([0, *(len(part.cells) for part in parts)])
    placements = np.concatenate([np.zeros(0, PLACEMENT), *(part.placements for part in parts)])
    shift = np.repeat(starts[:-1], [len(part.placements) for part in parts])
    placements["cells"] += np.where(placements["cells"] >= 0, shift, 0).astype(np.int32)
    return Covering(
        placements,
        np.concatenate([np.zeros(0, np.uint8), *(part.cells for part in parts)]),
        np.concatenate([np.zeros(0, np.int64), *(part.origins for part in parts)]),
        np.concatenate([np.zeros(0, np.int64), *(part.steps for part in parts)]),
    )


@dataclass(frozen=True, eq=False)
class Carrying:
    """How blocks get from chart to chart.

    Attributes
    ----------
    charts, fields
        The layout.
    onto
        Per chart, the carriers from each meeting's other chart onto it.
    exemplar_shape
        (height, width) in pixels.
    cells
        Per chart, the size of masks' cells in texels.
    feather
        Smoothing passes of masks.
    """

    charts: Sequence[Chart]
    fields: Sequence[Field | None]
    onto: Sequence[Sequence[Carrier]]
    exemplar_shape: tuple[int, int]
    cells: Sequence[int]
    feather: int = 2

    def carried_onto(self, chart: int, coverings: Sequence[Covering | None]) -> Covering:
        """Collect what finished charts leave on a chart: neighbours, and those that meet it only in a corner.

        Parameters
        ----------
        chart
            Its index.
        coverings
            Those of finished charts, None elsewhere.

        Returns
        -------
        Covering
            In the order of synthesis; a block more than once where ways round a corner disagree about it.
        """
        parts = []
        for carrier in self.onto[chart]:
            covering = coverings[carrier.meeting.chart]
            if covering is not None:
                parts.append(self._carried(carrier, covering))
                continue
            # Round a corner, over the chart between, which is still bare.
            for corner in self._corners(carrier, coverings):
                beyond = coverings[corner.carrier.meeting.chart]
                assert beyond is not None
                between = self._carried(corner.carrier, beyond, corner.window)
                if between is not None:
                    parts.append(self._carried(carrier, between))
        found = joined([part for part in parts if part is not None])
        return _distinct(found)

    def open_sides(self, chart: int, coverings: Sequence[Covering | None]) -> set[int]:
        """Return the edges of a chart at which a neighbour is still to come."""
        return {
            carrier.meeting.other_edge
            for carrier in self.onto[chart]
            if coverings[carrier.meeting.chart] is None
        }

    def closed(self, chart: int, coverings: Sequence[Covering | None]) -> list[tuple[int, float, float, int]]:
        """Tell where finished charts lie round a chart.

        Returns
        -------
        list of tuple
            Edge, from and to along it in texels (infinite where it goes on beyond a corner), and how many
            texels inside the edge must stay as the neighbour's blocks left them.
        """
        found = []
        for carrier in self.onto[chart]:
            meeting = carrier.meeting
            edge, here = meeting.other_edge, self.charts[chart]
            rim = _RIM * self.cells[chart]
            length = here.height if edge & 1 else here.width
            start, stop = sorted((meeting.other_start, meeting.other_stop))
            if coverings[meeting.chart] is not None:
                low = -np.inf if start <= 0 else start
                found.append((edge, low, np.inf if stop >= length else stop, rim))
                continue
            for corner in self._corners(carrier, coverings):
                at = meeting.other_start if corner.low else meeting.other_stop
                found.append((edge, -np.inf, at, 0) if at == start else (edge, at, np.inf, 0))
        return found

    def _corners(self, carrier: Carrier, coverings: Sequence[Covering | None]) -> list["_Corner"]:
        # Finished charts round either end of the meeting of two charts that are not: seen from the first.
        meeting = carrier.meeting
        between = self.charts[meeting.chart]
        length = between.height if meeting.edge & 1 else between.width
        found = []
        for other in self.onto[meeting.chart]:
            far = other.meeting
            if (
                coverings[far.chart] is None
                or far.chart == meeting.other_chart
                or (far.other_edge + meeting.edge) % 2 == 0
            ):
                continue
            low = far.other_edge in (0, 3)
            if (meeting.start > 0.5) if low else (meeting.stop < length - 0.5):
                continue
            # Where along the far chart's edge the corner lies.
            side = between.height if far.other_edge & 1 else between.width
            corner = 0.0 if meeting.edge in (0, 3) else float(side)
            ends = (far.other_start, far.start), (far.other_stop, far.stop)
            place = min(ends, key=lambda end: abs(end[0] - corner))
            if abs(place[0] - corner) < 0.5:
                window = float(_WINDOW * self.cells[far.chart])
                found.append(_Corner(other, low, (place[1] - window, place[1] + window)))
        return found

    def _carried(
        self, carrier: Carrier, covering: Covering, window: tuple[float, float] | None = None
    ) -> Covering | None:
        meeting, chart = carrier.meeting, carrier.meeting.other_chart
        old, here, cell = self.charts[meeting.chart], self.charts[chart], self.cells[chart]
        ends = (meeting.start, meeting.stop)
        if window is not None:
            ends = (max(ends[0], window[0]), min(ends[1], window[1]))
        placed, low, high = _overhanging(
            covering.placements, old, meeting.edge, ends, 2 * self.cells[meeting.chart] + 2
        )
        chosen = np.flatnonzero(placed)
        block = covering.placements[chosen]
        rows, columns = block["row"].astype(np.float64), block["column"].astype(np.float64)
        there_row, there_column, forth = carrier.carry(rows, columns)
        sound = np.isfinite(there_row)
        sound[sound] = np.abs(np.linalg.det(forth[sound])) > 1e-6
        chosen, block, low, high = chosen[sound], block[sound], low[placed][sound], high[placed][sound]
        if not len(block):
            return None
        back: FloatArray = np.asarray(np.linalg.inv(forth[sound]), np.float64)
        places = np.column_stack([there_row[sound], there_column[sound], back.reshape(-1, 4)])
        before, after = self.fields[meeting.chart], self.fields[chart]
        turn, fits = _turns(block, before, after, places[:, :2], back)
        chosen, block, places, turn = chosen[fits], block[fits], places[fits], turn[fits]
        if not len(block):
            return None
        sources = _sources(carrier, block, before, after, places, turn, low[fits], high[fits])
        out, masks = _masks(block, covering, places, cell, here)
        kept = (out[:, 4] >= 0) & (out[:, 2:4].max(axis=1) <= LARGEST_WARPED)
        result = np.zeros(int(kept.sum()), PLACEMENT)
        result["chart"] = chart
        for n, name in enumerate(("row", "column", "height", "width", "cells")):
            result[name] = out[kept, n]
        whole = 16 if after is None else 1
        for n, name in enumerate(("source_row", "source_column")):
            most = 16 * (self.exemplar_shape[n] - 1)
            result[name] = np.clip(whole * np.rint(sources[kept, n] / whole), 0, most)
        result["turn"] = turn[kept]
        result["mask"], result["cell"], result["feather"] = MASK_CUT, cell, self.feather
        origins, steps = covering.origins[chosen[kept]], covering.steps[chosen[kept]] + 1
        return Covering(result, masks, origins, steps)


def _distinct(found: Covering) -> Covering:
    # One version of each block, in painting order: that which was carried over the fewest edges, which lies
    # most truly. Others that lie in the same place add to its mask; those that lie elsewhere come before it,
    # and show where it does not.
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
    return Covering(found.placements[kept], found.cells, found.origins[kept], found.steps[kept])


def _add_mask(cells: NDArray[np.uint8], one: np.void, other: np.void) -> None:
    # Adds another version of a block's mask, which lies in about the same place, to one.
    size = int(one["cell"])
    grids, places = [], []
    for block in (one, other):
        rows, columns = -(-int(block["height"]) // size), -(-int(block["width"]) // size)
        start = int(block["cells"])
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
    """A finished chart round a corner.

    Attributes
    ----------
    carrier
        From it onto the chart between.
    low
        Whether the corner lies at the start of that chart's meeting with the chart to cover, or at its stop.
    window
        What part of the finished chart's edge is near the corner: from, to, in its texels.
    """

    carrier: Carrier
    low: bool
    window: tuple[float, float]


def _masks(
    block: NDArray[np.void], covering: Covering, places: FloatArray, cell: int, here: Chart
) -> tuple[NDArray[np.int32], NDArray[np.uint8]]:
    # The masks as the other chart sees them, see `carry_masks`.
    area = (block["height"] + 8.0 * cell) * (block["width"] + 8.0 * cell)
    area /= np.abs(places[:, 2] * places[:, 5] - places[:, 3] * places[:, 4])
    masks = np.empty(min(_MOST_CELLS, int(4 * area.sum() / cell**2) + 64 * len(block)), np.uint8)
    out = np.empty((len(block), 5), np.int32)
    columns = [block[name].astype(np.int32) for name in ("row", "column", "height", "width")]
    columns.append(np.maximum(1, block["cell"]).astype(np.int32))
    columns += [(block["mask"] == MASK_CUT).astype(np.int32), block["cells"]]
    count = carry_masks(
        np.stack(columns, axis=1),
        covering.cells,
        places,
        covering.bounds,
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
    # Which blocks reach as far as the meeting's edge somewhere in its interval, and from where to where along
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


def _turns(
    block: NDArray[np.void],
    old: Field | None,
    new: Field | None,
    places: FloatArray,
    back: FloatArray,
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    # The turn that a block has on the other chart, and whether it fits that chart's directions.
    turned = TURNS[block["turn"]].reshape(-1, 2, 2)
    before = turned @ matrices_at(old, block["row"].astype(np.float64), block["column"].astype(np.float64))
    here: FloatArray = np.rint(places)
    wanted = before @ back @ np.linalg.inv(matrices_at(new, here[:, 0], here[:, 1]))
    wanted /= np.sqrt(np.maximum(1e-12, np.abs(np.linalg.det(wanted))))[:, None, None]
    likeness = np.einsum("nij,tij->nt", wanted, TURNS.reshape(-1, 2, 2).astype(np.float64))
    turn = likeness.argmax(axis=1)
    fits = likeness[np.arange(len(turn)), turn] > 2 * np.cos(np.radians(_WORST_TURN))
    return turn.astype(np.uint8), fits


def _sources(
    carrier: Carrier,
    block: NDArray[np.void],
    old: Field | None,
    new: Field | None,
    places: FloatArray,
    turn: NDArray[np.uint8],
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    # The sources, in 1/16 pixel, with which either chart shows the same along the edge: means over samples.
    meeting = carrier.meeting
    shares = (np.arange(_EDGE_SAMPLES) + 0.5) / _EDGE_SAMPLES
    along = low[:, None] + (high - low)[:, None] * shares
    there = meeting.other_start + (along - meeting.start) * (
        (meeting.other_stop - meeting.other_start) / (meeting.stop - meeting.start)
    )
    texels = []
    for edge, line, place in (
        (meeting.edge, carrier.line, along - 0.5),
        (meeting.other_edge, carrier.other_line, there - 0.5),
    ):
        across = np.full_like(place, line)
        texels.append((place, across) if edge & 1 else (across, place))
    read = _displacement(old, block["row"], block["column"], block["turn"], *texels[0])
    seen = _displacement(new, np.rint(places[:, 0]), np.rint(places[:, 1]), turn, *texels[1])
    start = np.stack([block["source_row"], block["source_column"]], axis=1).astype(np.float64)
    found: FloatArray = start + 16.0 * (read - seen).mean(axis=1)
    return found


def _displacement(
    field: Field | None,
    row: NDArray[Any],
    column: NDArray[Any],
    turn: NDArray[np.uint8],
    rows: FloatArray,
    columns: FloatArray,
) -> FloatArray:
    # How far from its source a block reads at some texels (n, k), in pixels.
    row, column = row.astype(np.float64), column.astype(np.float64)
    mean = 0.5 * (matrices_at(field, row, column)[:, None] + matrices_at(field, rows, columns))
    step = np.stack([rows - row[:, None], columns - column[:, None]], axis=2)
    turned = TURNS[turn].reshape(-1, 1, 2, 2)
    found: FloatArray = ((turned @ mean) @ step[..., None])[..., 0]
    return found
