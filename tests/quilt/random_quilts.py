"""Quilts of every kind of placement, their weights by the formula, and images to paint them with."""

import numpy as np

from upholster.quilt import Chart, Quilt
from upholster.quilt.placement import (
    MASK_CUT,
    MASK_NONE,
    MASK_RAMP,
    PLACEMENT,
    SIDE_LEFT,
    SIDE_TOP,
    SYMMETRIES,
)

SHAPE = (40, 44)


def random_quilt(seed, *, count=60, charts=((70, 90), (33, 41))):
    """Return a quilt with placements of every kind, placements its charts with a first one each."""
    rng = np.random.default_rng(seed)
    placements = np.zeros(count, PLACEMENT)
    placements["chart"] = np.sort(rng.integers(0, len(charts), count))
    cells = []
    for placement in placements:
        height, width = rng.integers(1, 25, 2)
        chart = charts[placement["chart"]]
        placement["height"], placement["width"] = height, width
        placement["row"] = rng.integers(-5, chart[0] + 5)
        placement["column"] = rng.integers(-5, chart[1] + 5)
        placement["symmetry"] = rng.integers(8)
        symmetry = SYMMETRIES[placement["symmetry"]]
        steps_row = [symmetry[0] * i + symmetry[1] * j for i in span(height) for j in span(width)]
        steps_column = [symmetry[2] * i + symmetry[3] * j for i in span(height) for j in span(width)]
        placement["source_row"] = 16 * rng.integers(-min(steps_row), SHAPE[0] - max(steps_row))
        placement["source_column"] = 16 * rng.integers(-min(steps_column), SHAPE[1] - max(steps_column))
        placement["mask"] = rng.choice([MASK_NONE, MASK_RAMP, MASK_CUT])
        placement["cells"] = -1
        if placement["mask"] == MASK_RAMP:
            placement["sides"], placement["ramp"] = rng.integers(4), rng.integers(1, 10)
        if placement["mask"] == MASK_CUT:
            cell = rng.integers(1, 6)
            placement["cell"], placement["feather"] = cell, rng.integers(0, 4)
            placement["cells"] = sum(map(len, cells))
            cells.append(rng.integers(0, 2, -(-height // cell) * -(-width // cell), dtype=np.uint8))
    layout = tuple(Chart(n, *size) for n, size in enumerate(charts))
    return Quilt(layout, SHAPE, placements, np.concatenate([np.zeros(0, np.uint8), *cells]))


def span(size):
    return (-(size // 2), size - 1 - size // 2)


def plain_weights(placement, cells):
    height, width = int(placement["height"]), int(placement["width"])
    if placement["mask"] == MASK_CUT:
        cell = int(placement["cell"])
        down, across = -(-height // cell), -(-width // cell)
        part = cells[placement["cells"] :][: down * across].reshape(down, across).astype(int) * 256
        weights = np.kron(part, np.ones((cell, cell), int))[:height, :width]
        for _ in range(placement["feather"]):
            for axis in (0, 1):
                padded = np.pad(weights, [(1, 1), (0, 0)] if axis == 0 else [(0, 0), (1, 1)], mode="edge")
                size = weights.shape[axis]
                before, after = (np.take(padded, np.arange(size) + k, axis) for k in (0, 2))
                weights = (51 * (before + after) + 154 * weights + 128) >> 8
        return weights
    weights = np.full((height, width), 256)
    if placement["mask"] == MASK_RAMP:
        ramp = int(placement["ramp"])
        rise = np.minimum((2 * np.arange(256) + 1) * 128 // ramp, 256)
        rise[ramp:] = 256
        if placement["sides"] & SIDE_TOP:
            weights = np.repeat(rise[:height, None], width, 1)
        if placement["sides"] & SIDE_LEFT:
            weights = (weights * rise[None, :width]) >> 8
    return weights


def exemplar_of(dtype, channels=3, seed=0):
    rng = np.random.default_rng(seed)
    if dtype == np.float32:
        return rng.normal(size=(*SHAPE, channels)).astype(dtype)
    return rng.integers(0, np.iinfo(dtype).max + 1, (*SHAPE, channels)).astype(dtype)
