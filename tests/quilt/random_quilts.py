"""Quilts of every kind of placement, and images to paint them with."""

from dataclasses import replace

import numpy as np

from upholster.quilt.chart import Chart
from upholster.quilt.labels import LabelMap, cell_centres, label_shape, nearest_labels
from upholster.quilt.model import Quilt
from upholster.quilt.placement import PLACEMENT
from upholster.quilt.warp_field import WarpField, node_count

SHAPE = (40, 44)


def random_quilt(
    seed, *, count=20, charts=((70, 90), (33, 41)), cell=4, half=False, layers=1, octaves=None, offsets=0.0
):
    """Return a quilt of blocks anywhere, of all symmetries, under random labels near to the nearest ones.

    `octaves`: how wild the warp fields are; None: the identity on all charts. `offsets`: the share of
    placements that have a matrix of their own.
    """
    rng = np.random.default_rng(seed)
    layout = tuple(Chart(n, *size) for n, size in enumerate(charts))
    placed, labels = [], []
    for n, chart in enumerate(layout):
        maps, first = [], 0
        for layer in range(layers):
            size = cell if layer == 0 else max(1, cell // 2)
            some = _placements(rng, n, chart, size, half and layer == 0, layer, count, offsets)
            maps.append(_labels(rng, some, first, chart, size, half and layer == 0, layer))
            first += len(some)
            placed.append(some)
        labels.append(tuple(maps))
    fields = ()
    if octaves is not None:
        fields = tuple(
            random_field(rng, size, octaves=octaves, margin=k % 3) for k, size in enumerate(charts)
        )
    return Quilt(layout, SHAPE, np.concatenate(placed), tuple(labels), fields)


def _placements(rng, n, chart, cell, half, layer, count, offsets):
    high, wide = label_shape(chart.height, chart.width, cell)
    cells = np.sort(rng.choice(high * wide, min(count, high * wide), replace=False))
    placed = np.zeros(len(cells), PLACEMENT)
    placed["chart"], placed["layer"] = n, layer
    placed["row"] = cell_centres(high, cell, half=half)[cells // wide]
    placed["column"] = cell_centres(wide, cell, half=half)[cells % wide]
    placed["source_row"] = rng.integers(0, 16 * SHAPE[0], len(cells))
    placed["source_column"] = rng.integers(0, 16 * SHAPE[1], len(cells))
    placed["symmetry"] = rng.integers(0, 8, len(cells))
    own = rng.random(len(cells)) < offsets
    placed["offset"][own] = rng.integers(-(2**14), 2**14, (own.sum(), 4))
    placed["offset"][own & (rng.random(len(cells)) < 0.1)] = 2**18
    return placed


def _labels(rng, placed, first, chart, cell, half, layer):
    found = nearest_labels(placed["row"], placed["column"], chart, cell, half=half) + first
    stray = rng.random(found.shape) < 0.2
    found[stray] = first + rng.integers(0, len(placed), stray.sum())
    if layer:
        found[rng.random(found.shape) < 0.6] = -1
    return LabelMap(cell, found.astype(np.int32), half)


def random_field(rng, chart, *, octaves=2.5, margin=1):
    """Return a field as wild as may be: every node differs."""
    nodes = np.empty((node_count(chart[0], margin), node_count(chart[1], margin), 4), np.int16)
    most = int(32 * octaves)
    nodes[..., :2] = rng.integers(-most, most + 1, (*nodes.shape[:2], 2))
    nodes[..., 2] = rng.integers(0, 256, nodes.shape[:2])
    nodes[..., 3] = rng.integers(-50, 51, nodes.shape[:2])
    return WarpField(nodes, margin)


def changed(quilt, placements=None, **parts):
    """Return a quilt with other placements, or other parts."""
    return replace(quilt, placements=quilt.placements if placements is None else placements, **parts)


def exemplar_of(dtype, channels=3, seed=0):
    """Return noise."""
    rng = np.random.default_rng(seed)
    if dtype == np.float32:
        return rng.normal(size=(*SHAPE, channels)).astype(np.float32)
    return rng.integers(0, np.iinfo(dtype).max, (*SHAPE, channels), dtype=dtype, endpoint=True)
