"""Which blocks were transferred over from which charts: found again, so that one can be told by the other."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upholster.stream import _block_records as kernels
from upholster.stream.grid import GridPlan

__all__ = ["with_links"]

_NEAR = 24
"""How far apart two charts' sources of one block may lie, in 1/16 pixel."""

_MOST_CHARTS = 4096
_SWITCH = 8
"""What it costs, in 1/16 pixel, to go on with another chart than the block before."""


def with_links(plan: GridPlan, records: Sequence[NDArray[np.int32]]) -> tuple[GridPlan, NDArray[np.int32]]:
    """Order the charts such that what is transferred comes from charts before, and say from which blocks.

    Parameters
    ----------
    plan
        The plan, charts in any order.
    records
        Each chart's blocks.

    Returns
    -------
    plan, records
        With the order found; all blocks in that order, column LINK filled in.
    """
    if len(plan.charts) > _MOST_CHARTS:
        return plan, np.concatenate(records)
    counts = [len(part) for part in records]
    whole = np.concatenate(records)
    home = np.repeat(np.arange(len(records)), counts)
    transferred = np.concatenate(
        [np.arange(count) < chart.transferred for count, chart in zip(counts, plan.charts, strict=True)]
    )
    pairs = _candidates(whole, home, transferred)
    order = _order(pairs, home, len(records))
    plan = replace(plan, order=tuple(order))
    place = np.empty(len(records), np.int64)
    place[order] = np.arange(len(records))
    # Where each block lies in coded order.
    starts = np.concatenate([[0], np.cumsum(counts)])
    coded = plan.starts[place[home]] + np.arange(len(whole)) - starts[home]
    out = np.empty_like(whole)
    out[coded] = whole
    before = place[home[pairs[:, 1]]] < place[home[pairs[:, 0]]]
    pairs = pairs[before]
    distance = np.abs(
        whole[pairs[:, 0]][:, [kernels.SOURCE_ROW, kernels.SOURCE_COLUMN]]
        - whole[pairs[:, 1]][:, [kernels.SOURCE_ROW, kernels.SOURCE_COLUMN]]
    ).max(axis=1, initial=0)
    ends = np.searchsorted(pairs[:, 0], np.arange(len(whole) + 1))
    last = -1
    for n in np.flatnonzero(transferred):
        low, high = ends[n], ends[n + 1]
        if low == high:
            last = -1
            continue
        there, cost = pairs[low:high, 1], distance[low:high]
        if last >= 0:
            cost = cost + np.where(home[there] == home[last], np.where(there > last, 0, 2 * _SWITCH), _SWITCH)
        last = int(there[cost.argmin()])
        out[coded[n], kernels.LINK] = coded[last]
    return plan, out


def _candidates(
    whole: NDArray[np.int32], home: NDArray[np.int64], transferred: NDArray[np.bool_]
) -> NDArray[np.int64]:
    # Pairs of a transferred block and one on another chart with nearly the same source, sorted.
    rows, columns = (
        whole[:, kernels.SOURCE_ROW].astype(np.int64),
        whole[:, kernels.SOURCE_COLUMN].astype(np.int64),
    )
    by_row = np.argsort(rows, kind="stable")
    chosen = np.flatnonzero(transferred)
    low = np.searchsorted(rows[by_row], rows[chosen] - _NEAR)
    high = np.searchsorted(rows[by_row], rows[chosen] + _NEAR, side="right")
    found = [np.zeros((0, 2), np.int64)]
    for n, start, stop in zip(chosen, low, high, strict=True):
        there = by_row[start:stop]
        there = np.sort(there[(np.abs(columns[there] - columns[n]) <= _NEAR) & (home[there] != home[n])])
        found.append(np.stack([np.full_like(there, n), there], axis=1))
    return np.concatenate(found)


def _order(pairs: NDArray[np.int64], home: NDArray[np.int64], charts: int) -> list[int]:
    # Again and again the chart with the least transferred from charts that have not come.
    weight = np.zeros((charts, charts), np.int64)
    links = np.unique(np.stack([pairs[:, 0], home[pairs[:, 1]]], axis=1), axis=0)
    np.add.at(weight, (home[links[:, 0]], links[:, 1]), 1)
    waiting = weight.sum(axis=1)
    order: list[int] = []
    for _ in range(charts):
        n = int(waiting.argmin())
        order.append(n)
        waiting -= weight[:, n]
        waiting[n] = np.iinfo(np.int64).max // 2
    return order
