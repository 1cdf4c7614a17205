"""Small quilts and streams that several tests share."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from upholster.geometry import surface_from_spec
from upholster.methods import synthesize
from upholster.quilt import Chart, Quilt
from upholster.quilt.placement import MASK_CUT, PLACEMENT, mask_sizes
from upholster.quilt.plans import ChartGrid, GridPlan, PlacementList, StripPlan
from upholster.quilt.plans.grid import BLOCK
from upholster.quilt.warp_field import WarpField, node_count
from upholster.stream import encode_stream


def noise(height: Any = 32, width: Any = 40, channels: Any = 3, dtype: Any = np.uint8, seed: Any = 0) -> Any:
    """A smooth, irregular image."""
    rng = np.random.default_rng(seed)
    rows, columns = np.mgrid[:height, :width][:, :, :, None] / 7.0
    phase = rng.uniform(0, 6, (4, channels))
    image = 0.5 + 0.2 * np.sin(rows * 2 + phase[0]) * np.cos(columns + phase[1])
    image = image + 0.2 * np.sin(rows * columns / 5 + phase[2]) + rng.uniform(-0.08, 0.08, image.shape)
    image = np.clip(image, 0, 1)
    return image.astype(np.float32) if dtype == np.float32 else (image * np.iinfo(dtype).max).astype(dtype)


@cache
def covered(
    spec: Any = "cyclide",
    chart: Any = 64,
    block: Any = 16,
    levels: Any = 2,
    overlap: Any = 4,
    seams: Any = True,
    seed: Any = 3,
    edge_block: Any = None,
) -> Any:
    """A surface, a quilt by method "paper", and its exemplar."""
    surface, exemplar = surface_from_spec(spec), noise()
    quilt = synthesize(
        exemplar,
        surface,
        chart=chart,
        block=block,
        overlap=overlap,
        levels=levels,
        seams=seams,
        seed=seed,
        edge_block=edge_block,
        method="paper",
    )
    return surface, quilt, exemplar


def anything(rng: Any, exemplar_shape: Any, charts: Any, count: Any) -> Any:
    """A valid quilt of arbitrary placements: every field used, masks in any order, cells that none uses."""
    half = min(exemplar_shape) // 4
    placed = np.zeros(count, PLACEMENT)
    placed["chart"] = np.sort(rng.integers(0, len(charts), count))
    placed["height"], placed["width"] = rng.integers(1, 2 * half, (2, count))
    placed["source_row"] = 16 * rng.integers(half, exemplar_shape[0] - half, count)
    placed["source_column"] = 16 * rng.integers(half, exemplar_shape[1] - half, count)
    sizes = np.array([(chart.height, chart.width) for chart in charts])[placed["chart"]]
    placed["row"] = rng.integers(0, sizes[:, 0])
    placed["column"] = rng.integers(0, sizes[:, 1])
    placed["symmetry"], placed["mask"] = rng.integers(0, 8, count), rng.integers(0, 3, count)
    placed["sides"], placed["ramp"] = rng.integers(0, 256, count), rng.integers(1, 256, count)
    placed["mask_cell"], placed["feather"] = rng.integers(1, 9, count), rng.integers(0, 17, count)
    placed["first_cell"] = rng.integers(-1, 2, count)
    offset, in_turn = 0, rng.integers(0, 2)
    seen = mask_sizes(placed, charts)
    cut = np.flatnonzero(placed["mask"] == MASK_CUT)
    for n in cut if in_turn else rng.permutation(cut):
        placed["first_cell"][n] = offset
        offset += int(seen[n]) + (0 if in_turn else int(rng.integers(0, 8) == 0))
    cells = rng.integers(0, 2, offset).astype(np.uint8)
    return Quilt(tuple(charts), exemplar_shape, PlacementList(placed, cells))


def changed(quilt: Any) -> Any:
    """The same quilt with one ramp wider, so that it is a list."""
    placed = quilt.placements.copy()
    placed["ramp"][5] += 1
    plan = PlacementList(placed, quilt.mask_cells)
    return Quilt(quilt.charts, quilt.exemplar_shape, plan, quilt.fields)


@cache
def woven(spec: Any = "sphere", texels: Any = 30_000, seed: Any = 3, **options: Any) -> Any:
    """A surface, a quilt by method "quilt", and its exemplar."""
    surface, exemplar = surface_from_spec(spec), noise(64, 72)
    quilt = synthesize(exemplar, surface, texels=texels, block=20, seed=seed, **options)
    return surface, quilt, exemplar


@cache
def leaning(seed: Any = 0, **options: Any) -> Any:
    """The same as `woven`; half of the transferred blocks have centre matrices."""
    surface, quilt, exemplar = woven(**options)
    return surface, with_matrices(quilt, seed), exemplar


def with_matrices(quilt: Any, seed: Any = 0) -> Any:
    """A quilt of a grid plan with centre matrices of their own for half of its transferred blocks."""
    rng = np.random.default_rng(seed)
    plan, blocks = quilt.plan, quilt.plan.blocks.copy()
    for place, grid in enumerate(plan.grids):
        start, n = int(plan.starts[place]), grid.chart
        part = blocks[start : start + grid.transferred]
        part["centred"] = rng.integers(0, 2, len(part))
        change = 64 * rng.integers(-9, 10, (len(part), 4)) * (rng.random((len(part), 1)) < 0.8)
        matrices = quilt.fields[n].integers_at(part["row"], part["column"]) + change
        part["matrix"] = np.where(part["centred"][:, None] > 0, matrices, 0)
    return Quilt(quilt.charts, quilt.exemplar_shape, replace(plan, blocks=blocks), quilt.fields)


def bent(rng: Any, charts: Any) -> Any:
    """Warp fields of every kind: identity, with and without margin, larger than the chart, of one node."""
    fields: list[WarpField] = []
    for n, chart in enumerate(charts):
        margin = int(rng.integers(0, 3))
        shape = (1, 1) if n % 4 == 2 else (node_count(chart.height, margin), node_count(chart.width, margin))
        if n % 4 == 3:
            shape = shape[0] + 2, shape[1] + 1
        nodes = np.empty((*shape, 4), np.int16)
        for k, (low, high) in enumerate(((-80, 80), (-80, 80), (0, 256), (-50, 51))):
            nodes[..., k] = rng.integers(low, high, shape)
        fields.append(WarpField.identity() if n % 4 == 0 else WarpField(nodes, margin))
    return tuple(fields)


def anything_bent(rng: Any, exemplar_shape: Any, charts: Any, count: Any) -> Any:
    """The same as `anything`, on charts with warp fields, sources with fractions, and centre matrices."""
    quilt, fields = anything(rng, exemplar_shape, charts, count), bent(rng, charts)
    placed = quilt.placements.copy()
    for name in ("source_row", "source_column"):
        placed[name] += rng.integers(0, 16, count, dtype=np.int32)
    placed["centred"] = rng.integers(0, 3, count) == 0
    most = rng.choice([1, 100, 2**13, 2**18], (count, 1))
    matrices = (rng.integers(-most, most + 1, (count, 4))).astype(np.int32)
    placed["matrix"] = np.where(placed["centred"][:, None] > 0, matrices, 0)
    return Quilt(quilt.charts, exemplar_shape, PlacementList(placed, quilt.mask_cells), fields)


def any_grids(rng: Any, exemplar_shape: Any, charts: Any, turned: Any = False) -> Any:
    """A valid quilt of a grid plan that nobody laid, on charts with warp fields: all that it can hold."""
    fields = bent(rng, charts)
    order = np.repeat(rng.permutation(len(charts)), rng.integers(1, 4, len(charts))).tolist()
    feather, count = int(rng.integers(0, 5)), 0
    grids: list[Any] = []
    parts = []
    for n in order:
        chart, field = charts[n], fields[n]
        size = rng.integers(4, 40, 2)
        steps = np.maximum(1, size - rng.integers(0, 8, 2))
        first = rng.integers(1 - size // 2, size)
        room = np.array((chart.height, chart.width)) - (first - size // 2)
        shape = np.minimum(rng.integers(1, 5, 2), np.maximum(1, -(-room // steps)))
        # Positions that touch the chart, some left out.
        rows, columns = np.divmod(np.arange(shape.prod()), shape[1])
        own = np.zeros(shape.prod(), BLOCK)
        own["row"], own["column"] = first[0] + rows * steps[0], first[1] + columns * steps[1]
        own["height"], own["width"], own["link"] = *size, -1
        if turned:
            own["symmetry"] = rng.choice(rng.integers(0, 8, 3), len(own))
        own = own[(rng.random(len(own)) < 0.8) & _touching(own, chart)]
        other = np.zeros(int(rng.integers(0, 6)), BLOCK)
        other["height"], other["width"] = rng.integers(1, 60, (2, len(other)))
        other["row"] = rng.integers(0, chart.height, len(other))
        other["column"] = rng.integers(0, chart.width, len(other))
        other["symmetry"] = rng.integers(0, 8, len(other))
        other["link"] = rng.integers(-1, max(count, 1), len(other)) if count else -1
        other["centred"] = rng.integers(0, 2, len(other))
        matrices = field.integers_at(other["row"], other["column"]) + 64 * rng.integers(
            -40, 41, (len(other), 4)
        )
        other["matrix"] = np.where(other["centred"][:, None] > 0, matrices, 0)
        parts += [other, own]
        count += len(other) + len(own)
        numbers = [*shape.tolist(), *first.tolist(), *size.tolist(), *steps.tolist()]
        level, cell = int(rng.integers(0, 3)), int(rng.integers(1, 9))
        grids.append(ChartGrid(n, *numbers, level, cell, len(other), len(own)))
    blocks = np.concatenate(parts)
    for name, pixels in zip(("source_row", "source_column"), exemplar_shape, strict=True):
        blocks[name] = rng.integers(0, 16 * pixels, len(blocks))
        whole = rng.random(len(blocks)) < 0.5
        blocks[name][whole] &= ~15
    blocks["cut"] = rng.random(len(blocks)) < 0.8
    plan = GridPlan(tuple(grids), feather, blocks, np.zeros(0, np.uint8))
    total = int(mask_sizes(plan.in_order(), charts).sum())
    cells = (rng.random(total) < rng.choice([0.1, 0.5, 0.97])).astype(np.uint8)
    return Quilt(tuple(charts), exemplar_shape, replace(plan, mask_cells=cells), fields)


def _touching(blocks: Any, chart: Any) -> Any:
    top, left = blocks["row"] - blocks["height"] // 2, blocks["column"] - blocks["width"] // 2
    inside = (top < chart.height) & (left < chart.width)
    return inside & (top + blocks["height"] > 0) & (left + blocks["width"] > 0)


@cache
def stream(name: Any) -> Any:
    """Streams of several kinds, by name."""
    if name == "quilt":
        return encode_stream(*woven())
    if name == "maps":
        surface, quilt, exemplar = woven("cone", 5_000)
        shape = exemplar.shape[:2]
        maps = {"normal": noise(*shape, 3, np.uint16, seed=1), "roughness": noise(*shape, 1, seed=2)}
        return encode_stream(surface, quilt, exemplar, maps=maps, most_bytes=6000)
    if name == "bent":
        charts = [Chart(0, 40, 50), Chart(0, 33, 20), Chart(0, 17, 64), Chart(0, 32, 32), Chart(0, 9, 5)]
        quilt = anything_bent(np.random.default_rng(8), (32, 40), charts, 40)
        return encode_stream(surface_from_spec("plane"), quilt, noise())
    if name in ("any grids", "turned grids"):
        charts = [Chart(0, 40, 50), Chart(0, 33, 20), Chart(0, 17, 64), Chart(0, 32, 32), Chart(0, 9, 5)]
        quilt = any_grids(np.random.default_rng(1), (32, 40), charts, name == "turned grids")
        return encode_stream(surface_from_spec("plane"), quilt, noise())
    if name == "leaning":
        return encode_stream(*leaning(spec="cone", texels=8_000))
    if name == "paper":
        return encode_stream(*covered())
    if name == "edge blocks":
        return encode_stream(*covered("sphere", block=24, edge_block=12))
    if name == "no seams":
        return encode_stream(*covered("sphere", seams=False))
    surface, quilt, exemplar = covered("cylinder")
    return encode_stream(surface, changed(quilt), exemplar, lossless=True)


STREAMS = (
    *("paper", "edge blocks", "no seams", "list", "quilt", "bent", "maps", "leaning"),
    *("any grids", "turned grids"),
)
"""Strips with edges, with edge blocks of a size of their own, and without edges; lists with and without
fields, grids, several maps, centre matrices, symmetries."""


def same_fields(a: Any, b: Any) -> Any:
    """Whether two tuples of warp fields are equal."""
    return len(a) == len(b) and all(
        x.margin == y.margin and np.array_equal(x.nodes, y.nodes) for x, y in zip(a, b, strict=True)
    )


def same_plan(a: Any, b: Any) -> Any:
    """Whether two plans are of one kind and equal in everything."""
    if type(a) is not type(b):
        return False
    match a:
        case StripPlan():
            return a.layout == b.layout and (a.chosen == b.chosen).all() and (a.masks == b.masks).all()
        case GridPlan():
            numbers = (a.grids, a.feather) == (b.grids, b.feather)
            return (
                numbers and np.array_equal(a.blocks, b.blocks) and np.array_equal(a.mask_cells, b.mask_cells)
            )
    return np.array_equal(a.placed, b.placed) and np.array_equal(a.mask_cells, b.mask_cells)


def same(a: Any, b: Any) -> Any:
    """Whether two quilts are equal in everything."""
    return (
        same_fields(a.fields, b.fields)
        and a.charts == b.charts
        and a.exemplar_shape == b.exemplar_shape
        and np.array_equal(a.placements, b.placements)
        and np.array_equal(a.mask_cells, b.mask_cells)
        and same_plan(a.plan, b.plan)
    )
