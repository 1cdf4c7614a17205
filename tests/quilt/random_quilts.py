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
from upholster.quilt.plans import PlacementList

SHAPE = (40, 44)


def random_quilt(seed, *, count=60, charts=((70, 90), (33, 41)), masked=True):
    """Return a quilt with placements of every kind, on whole pixels inside the exemplar."""
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
        placement["mask"] = rng.choice([MASK_NONE, MASK_RAMP, MASK_CUT]) if masked else MASK_NONE
        placement["first_cell"] = -1
        if placement["mask"] == MASK_RAMP:
            placement["sides"], placement["ramp"] = rng.integers(4), rng.integers(1, 10)
        if placement["mask"] == MASK_CUT:
            placement["mask_cell"], placement["feather"] = rng.integers(1, 6), rng.integers(0, 4)
            placement["first_cell"] = sum(map(len, cells))
            shown = [len(part) for part in plain_window(placement, chart)]
            cells.append(rng.integers(0, 2, shown[0] * shown[1], dtype=np.uint8))
    layout = tuple(Chart(n, *size) for n, size in enumerate(charts))
    return Quilt(layout, SHAPE, PlacementList(placements, np.concatenate([np.zeros(0, np.uint8), *cells])))


def changed(quilt, placements, fields=None):
    """Return a quilt with other placements, and maybe other fields."""
    plan = PlacementList(placements, quilt.mask_cells)
    return Quilt(quilt.charts, quilt.exemplar_shape, plan, quilt.fields if fields is None else fields)


def plain_window(placement, chart):
    """Return which rows and which columns of cells a chart (height, width) can show, told by their texels."""
    found = []
    for at, extent, size in (("row", "height", chart[0]), ("column", "width", chart[1])):
        low, reach = int(placement[at]) - int(placement[extent]) // 2, int(placement["feather"])
        cell = int(placement["mask_cell"])
        texels = range(low, low - (-int(placement[extent]) // cell) * cell)  # a last cell may be cut short
        found.append(sorted({(x - low) // cell for x in texels if -reach <= x < size + reach}))
    return found


def whole_mask(quilt, placement, outside=1):
    """Return all cells of a cut mask: those of its window, and `outside` (a number or cells) round them."""
    cell = int(placement["mask_cell"])
    shape = -(-int(placement["height"]) // cell), -(-int(placement["width"]) // cell)
    mask = np.broadcast_to(np.asarray(outside, np.uint8), shape).copy()
    chart = quilt.charts[placement["chart"]]
    rows, columns = plain_window(placement, (chart.height, chart.width))
    part = quilt.mask_cells[placement["first_cell"] :][: len(rows) * len(columns)]
    mask[np.ix_(rows, columns)] = part.reshape(len(rows), len(columns))
    return mask


def span(size):
    return (-(size // 2), size - 1 - size // 2)


def plain_weights(placement, mask=None):
    """Return a placement's weights by the formula; `mask` has all cells of a cut one."""
    height, width = int(placement["height"]), int(placement["width"])
    if placement["mask"] == MASK_CUT:
        cell = int(placement["mask_cell"])
        weights = np.kron(mask.astype(int) * 256, np.ones((cell, cell), int))[:height, :width]
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


def weights_of(quilt, placement, outside=1):
    """Return the weights of one of a quilt's placements; see `whole_mask`."""
    cut = placement["mask"] == MASK_CUT
    return plain_weights(placement, whole_mask(quilt, placement, outside) if cut else None)
