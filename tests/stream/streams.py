"""Small quilts and streams that several tests share."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from upholster.codec.stream.writer import encode_stream
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.quilt.chart import Chart
from upholster.quilt.labels import LabelMap, cell_centres, label_shape, nearest_labels
from upholster.quilt.model import Quilt
from upholster.quilt.placement import PLACEMENT
from upholster.quilt.warp_field import WarpField, node_count


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
def woven(spec: Any = "sphere", texels: Any = 30_000, seed: Any = 3, **options: Any) -> Any:
    """A surface, a quilt by method "quilt", and its exemplar."""
    surface, exemplar = surface_from_spec(spec), noise(64, 72)
    quilt = synthesize(exemplar, surface, texels=texels, block=20, seed=seed, **options)
    return surface, quilt, exemplar


def anything(rng: Any, exemplar_shape: Any, charts: Any, count: Any = 20, layers: Any = None) -> Any:
    """A valid quilt that nobody laid: placements at any cells, labels that name any of them."""
    layers = layers or int(rng.integers(1, 3))
    half, alike = rng.integers(0, 2, layers), rng.integers(0, 2, layers)
    size = rng.integers(1, 9, layers)
    placed, labels = [], []
    for number, chart in enumerate(charts):
        maps, first = [], 0
        for layer in range(layers):
            cell = int(size[layer] if alike[layer] else rng.choice([1, 2, 3, 4, 8, 255]))
            shape = label_shape(chart.height, chart.width, cell)
            some = int(rng.integers(0, 2 + 2 * count // len(charts)))
            part = at_cells(rng, shape, cell, bool(half[layer]), max(some, 1 - layer))
            part["chart"], part["layer"] = number, layer
            low = -1 if layer else first
            choices = np.unique(rng.integers(low, first + len(part), 4))
            choices = choices[(choices >= first) | (choices < 0)]
            named = rng.choice(choices if len(choices) else [-1], shape).astype(np.int32)
            # Runs of equal labels, as they are in real ones.
            named = np.where(rng.random(shape) < 0.7, np.roll(named, 1, axis=1), named)
            maps.append(LabelMap(cell, named, bool(half[layer])))
            placed.append(part)
            first += len(part)
        labels.append(tuple(maps))
    whole = np.concatenate(placed)
    for name, pixels in zip(("source_row", "source_column"), exemplar_shape, strict=True):
        whole[name] = rng.integers(0, 16 * pixels, len(whole))
        whole[name] &= -int(rng.choice([1, 4, 16]))
    whole["symmetry"] = rng.integers(0, 8, len(whole)) * rng.integers(0, 2)
    return Quilt(tuple(charts), tuple(exemplar_shape), whole, tuple(labels), has_tones=layers == 1)


def at_cells(rng: Any, shape: Any, cell: Any, half: Any, count: Any) -> Any:
    """Placements at so many cells of a grid, or as many as there are."""
    places = np.sort(rng.permutation(shape[0] * shape[1])[:count])
    out = np.zeros(len(places), PLACEMENT)
    for name, at, number in zip(("row", "column"), np.divmod(places, shape[1]), shape, strict=True):
        out[name] = cell_centres(number, cell, half=half)[at]
    return out


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


def anything_bent(rng: Any, exemplar_shape: Any, charts: Any, count: Any = 20, layers: Any = None) -> Any:
    """The same as `anything`, on charts with warp fields, and with offsets of matrices."""
    quilt = anything(rng, exemplar_shape, charts, count, layers)
    placed = quilt.placements.copy()
    some = rng.integers(0, 3, (len(placed), 1)) == 0
    most = rng.choice([1, 100, 2**13, 2**18], (len(placed), 1))
    offsets = rng.integers(-most, most + 1, (len(placed), 4)).astype(np.int32) & -int(rng.choice([1, 16]))
    placed["offset"] = np.where(some, offsets, 0)
    return replace(quilt, placements=placed, fields=bent(rng, charts))


CHARTS = (Chart(0, 40, 50), Chart(0, 33, 20), Chart(0, 17, 64), Chart(0, 32, 32), Chart(0, 9, 5))
"""Charts of the plane, each over all of it."""


@cache
def laid(spec: Any = "cyclide", side: Any = 64, cell: Any = 4, seed: Any = 3, second: Any = False) -> Any:
    """A surface, a quilt as a synthesis might give it, and its exemplar: blocks that mostly go on."""
    rng, surface, exemplar = np.random.default_rng(seed), surface_from_spec(spec), noise()
    charts = tuple(
        Chart(number, side, side, row, row + 1, column, column + 1)
        for number, face in enumerate(surface.faces)
        for row in range(face.rows)
        for column in range(face.columns)
    )
    shape, placed, labels = label_shape(side, side, cell), [], []
    centres = cell_centres(shape[0], cell)
    for number, chart in enumerate(charts):
        at = np.stack(np.meshgrid(*[np.arange(1, shape[0], 4)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
        at = np.unique(np.clip(at + rng.integers(-1, 2, at.shape), 0, shape[0] - 1), axis=0)
        part = np.zeros(len(at), PLACEMENT)
        part["chart"], part["row"], part["column"] = number, *centres[at].T
        apart = rng.integers(0, 300, (4, 2))[rng.integers(0, 4, len(at))]
        for name, offset, pixels in zip(("row", "column"), apart.T, exemplar.shape, strict=False):
            part[f"source_{name}"] = (part[name] + offset) % (16 * pixels)
        nearest = nearest_labels(part["row"], part["column"], chart, cell)
        moved = np.where(rng.random(shape) < 0.15, np.roll(nearest, 1, axis=int(rng.integers(2))), nearest)
        maps = [LabelMap(cell, moved)]
        if second:
            over = part[:: len(part) // 3].copy()
            over["layer"] = 1
            some = (np.indices(shape).min(axis=0) < 3) & (rng.random(shape) < 0.9)
            maps.append(LabelMap(cell, np.where(some, len(part), -1).astype(np.int32)))
            part = np.concatenate([part, over])
        placed.append(part)
        labels.append(tuple(maps))
    quilt = Quilt(charts, exemplar.shape[:2], np.concatenate(placed), tuple(labels))
    return surface, quilt, exemplar


@cache
def stream(name: Any) -> Any:
    """Streams of several kinds, by name."""
    if name in ("bent", "half cells"):
        rng = np.random.default_rng(8 if name == "bent" else 5)
        quilt = anything_bent(rng, (32, 40), CHARTS, 40, 1 if name == "bent" else 2)
        return encode_stream(surface_from_spec("plane"), quilt, noise())
    surface, quilt, exemplar = laid("cone" if name == "maps" else "cyclide", second=name == "two layers")
    if name == "maps":
        shape = exemplar.shape[:2]
        maps = {"normal": noise(*shape, 3, np.uint16, seed=1), "roughness": noise(*shape, 1, seed=2)}
        return encode_stream(surface, quilt, exemplar, maps=maps, most_bytes=6000)
    return encode_stream(surface, quilt, exemplar, sample_quality="lossless" if name == "two layers" else 46)


STREAMS = ("plain", "two layers", "half cells", "bent", "maps")
"""One layer; two; any labels and centre matrices on charts with fields, of two layers and of one; maps."""


def same_fields(a: Any, b: Any) -> Any:
    """Whether two tuples of warp fields are equal."""
    return len(a) == len(b) and all(
        x.margin == y.margin and np.array_equal(x.nodes, y.nodes) for x, y in zip(a, b, strict=True)
    )


def same_labels(a: Any, b: Any) -> Any:
    """Whether two tuples of label maps are equal."""
    return len(a) == len(b) and all(
        (x.cell, x.half) == (y.cell, y.half) and np.array_equal(x.labels, y.labels)
        for x, y in zip(a, b, strict=True)
    )


def same(a: Any, b: Any) -> Any:
    """Whether two quilts are equal in everything."""
    return (
        same_fields(a.fields, b.fields)
        and a.charts == b.charts
        and (a.exemplar_shape, a.density) == (b.exemplar_shape, b.density)
        and np.array_equal(a.placements, b.placements)
        and len(a.labels) == len(b.labels)
        and all(same_labels(x, y) for x, y in zip(a.labels, b.labels, strict=True))
    )
