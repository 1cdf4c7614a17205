"""The order of a grid plan's blocks in a stream: what a prefix shows best, painted alike.

Charts come such that those of many texels for few bytes are first. Blocks that refinement added lie on a
lattice: told as blocks of further grids of their own, they are seen, by straight cuts, before their masks
have come, which blocks that are told as transferred ones without a link are not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.methods.quilt.masked import MASK_CUT, mask_sizes
from upholster.methods.quilt.old_plans import ChartGrid, GridPlan
from upholster.quilt.warp_field import WarpField

__all__ = ["arranged"]

_OWN, _TRANSFERRED, _NODES = 2.0, 1.0, 0.5
"""Bytes of a block's source, and of a node: about."""

_MOST_SORTED = 512
"""Of more charts the order stays."""

_POSITIONS_A_BLOCK = 64
"""A lattice that has more positions for each block on it does not pay."""


@dataclass(frozen=True, slots=True)
class _Part:
    # A grid to be, and which of the plan's blocks it has.
    grid: ChartGrid
    blocks: NDArray[np.int64]


def arranged(quilt: Quilt) -> Quilt:
    """Return a quilt that paints the same, its plan in the best order for a stream.

    Parameters
    ----------
    quilt
        Of any plan; all but plans of grids stay as they are.
    """
    if not isinstance(quilt.plan, GridPlan):
        return quilt
    plan = quilt.plan
    parts: dict[int, list[_Part]] = {}
    for place, grid in enumerate(plan.grids):
        blocks = np.arange(*plan.starts[place : place + 2])
        known = parts.setdefault(grid.chart, [])
        known += _layers(plan, grid, blocks) if known else [_Part(grid, blocks)]
    order = _charts_in_turn(quilt, plan, parts)
    return replace(quilt, plan=_rebuilt(plan, quilt.charts, [part for n in order for part in parts[n]]))


def _charts_in_turn(quilt: Quilt, plan: GridPlan, parts: dict[int, list[_Part]]) -> list[int]:
    # Always next the chart that gives most texels a byte, with those before it that its blocks come from.
    given = list(parts)
    if len(given) > _MOST_SORTED:
        return given
    areas = np.array([quilt.charts[n].height * quilt.charts[n].width for n in given], np.float64)
    costs = np.array([_bytes_about(quilt.fields[n], parts[n]) for n in given])
    needs = _needed(plan, given)
    left, order = np.ones(len(given), bool), list[int]()
    while left.any():
        missing = (needs & left).astype(np.float64)
        gains = np.where(left, (missing @ areas) / (missing @ costs).clip(1.0), -1.0)
        chosen = np.flatnonzero(needs[int(np.argmax(gains))] & left)
        order += [given[n] for n in chosen.tolist()]
        left[chosen] = False
    return order


def _bytes_about(field: WarpField, parts: list[_Part]) -> float:
    nodes = 0 if field.is_identity else field.nodes.size // 4
    blocks = sum(_OWN * part.grid.own + _TRANSFERRED * part.grid.transferred for part in parts)
    return _NODES * nodes + blocks


def _needed(plan: GridPlan, given: list[int]) -> NDArray[np.bool_]:
    # Per chart, in the order given, which ones its blocks come from, and those's in turn; itself as well.
    place = {n: k for k, n in enumerate(given)}
    owners = np.repeat([place[grid.chart] for grid in plan.grids], np.diff(plan.starts))
    links = plan.blocks["link"]
    needs = np.eye(len(given), dtype=bool)
    needs[owners[links >= 0], owners[links[links >= 0]]] = True
    for k in range(len(given)):
        # What a chart needs comes before it, and is known by now.
        needs[k] |= needs[needs[k]].any(axis=0)
    return needs


def _layers(plan: GridPlan, grid: ChartGrid, blocks: NDArray[np.int64]) -> list[_Part]:
    # Added blocks as own ones of a lattice, painted in raster order: as many grids as it takes for each block
    # to come behind those that it lies on. Blocks beside the lattice stay transferred ones.
    told = plan.blocks[blocks]
    alike = len(told) > 0 and all(len(np.unique(told[name])) == 1 for name in ("height", "width"))
    if grid.own or not alike or told["centred"].any() or (told["link"] >= 0).any():
        return [_Part(grid, blocks)]
    rows, across = _lattice_of(told["row"]), _lattice_of(told["column"])
    if rows.count * across.count > _POSITIONS_A_BLOCK * len(told):
        return [_Part(grid, blocks)]
    places = np.where(rows.on & across.on, rows.places * across.count + across.places, -1)
    layers = _layer_of(told, places)
    first = replace(
        grid,
        rows=rows.count,
        across=across.count,
        first_row=rows.first,
        first_column=across.first,
        height=int(told["height"][0]),
        width=int(told["width"][0]),
        step_row=rows.step,
        step_column=across.step,
    )
    return [
        _Part(
            replace(first, transferred=int((places[layer] < 0).sum()), own=int((places[layer] >= 0).sum())),
            # Those beside the lattice come first, in their own order.
            blocks[layer[np.argsort(places[layer], kind="stable")]],
        )
        for layer in (np.flatnonzero(layers == n) for n in range(int(layers.max()) + 1))
    ]


@dataclass(frozen=True, slots=True)
class _Lattice:
    # Of centres along one axis: first, step, how many; which are on it, and at which place.
    first: int
    step: int
    count: int
    on: NDArray[np.bool_]
    places: NDArray[np.int64]


def _lattice_of(centres: NDArray[np.int32]) -> _Lattice:
    # The last region ends with the chart, and need not lie on the lattice of the others.
    values = np.unique(centres).astype(np.int64)
    regular = values[:-1] if len(values) > 2 else values[:1]
    first = int(values[0])
    step = int(np.gcd.reduce(regular - first)) or max(1, int(values[-1]) - first)
    away = centres.astype(np.int64) - first
    on = away % step == 0
    return _Lattice(first, step, int(away[on].max()) // step + 1, on, away // step)


def _layer_of(told: NDArray[np.void], places: NDArray[np.int64]) -> NDArray[np.int64]:
    # The layer of each block: not before those that it lies on, and in that of one of them only if it comes
    # behind it there.
    layers = np.zeros(len(told), np.int64)
    height, width = int(told["height"][0]), int(told["width"][0])
    for n in range(1, len(told)):
        near = np.abs(told["row"][:n] - told["row"][n]) < height
        below = np.flatnonzero(near & (np.abs(told["column"][:n] - told["column"][n]) < width))
        if len(below):
            behind = np.where(places[below] < 0, True, (places[n] >= 0) & (places[below] < places[n]))
            layers[n] = (layers[below] + ~behind).max()
    return layers


def _rebuilt(plan: GridPlan, charts: Sequence[Chart], parts: list[_Part]) -> GridPlan:
    # The plan of the same blocks in other grids: links and masks go with them.
    order = np.concatenate([part.blocks for part in parts])
    if (order == np.arange(len(order))).all() and len(parts) == len(plan.grids):
        return plan
    where = np.empty(len(order) + 1, np.int64)
    where[order], where[-1] = np.arange(len(order)), -1
    placed = plan.in_order()
    sizes = np.where(placed["mask"] == MASK_CUT, mask_sizes(placed, charts), 0)
    starts = np.cumsum(sizes) - sizes
    taken = sizes[order]
    within = np.arange(int(taken.sum())) - np.repeat(np.cumsum(taken) - taken, taken)
    blocks = plan.blocks[order]
    blocks["link"] = where[blocks["link"]]
    cells = plan.mask_cells[np.repeat(starts[order], taken) + within]
    return GridPlan(tuple(part.grid for part in parts), plan.feather, blocks, cells)
