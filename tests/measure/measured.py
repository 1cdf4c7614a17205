"""Textures and quilts that several tests share."""

import numpy as np

from upholster.quilt import Chart, Quilt
from upholster.quilt.placement import PLACEMENT
from upholster.quilt.plans import PlacementList
from upholster.quilt.warp_field import WarpField, node_count


def grains(height=64, width=64, channels=3, seed=0):
    """Smooth irregular colours, uint8."""
    rng = np.random.default_rng(seed)
    image = rng.normal(size=(height + 8, width + 8, channels))
    for axis in (0, 1):
        image = sum(np.roll(image, shift, axis) for shift in range(4))
    image = image[4:-4, 4:-4]
    return np.clip(128 + 40 * image / image.std(), 0, 255).astype(np.uint8)


def tiles(height=64, width=64, period=(8, 16)):
    """A lattice of blots, uint8 RGB."""
    rows, columns = np.mgrid[:height, :width]
    wave = np.cos(2 * np.pi * rows / period[0]) + np.cos(2 * np.pi * columns / period[1])
    color = np.array([0.9, 0.7, 0.4])
    return (128 + 40 * wave[:, :, None] * color).astype(np.uint8)


def quilt_of(blocks, *, chart=(32, 32), exemplar=(64, 64)):
    """One chart, placements (row, column, height, width, source row, source column, turn)."""
    placed = np.zeros(len(blocks), PLACEMENT)
    names = ("row", "column", "height", "width", "source_row", "source_column", "symmetry")
    for name, values in zip(names, np.array(blocks, np.int64).reshape(-1, 7).T, strict=True):
        placed[name] = 16 * values if name.startswith("source") else values
    return Quilt((Chart(0, *chart),), exemplar, PlacementList(placed, np.zeros(0, np.uint8)))


def random_field(rng, height, width, scale, *, vary=0.1):
    """Matrices that turn, stretch and shear a little from node to node, about `scale` pixels per texel."""
    shape = (node_count(height, 1), node_count(width, 1))
    angle = vary * rng.normal(size=shape)
    sizes = scale * np.exp(vary * rng.normal(size=(2, *shape)))
    matrices = np.empty((*shape, 2, 2))
    matrices[..., 0, 0], matrices[..., 0, 1] = sizes[0] * np.cos(angle), -sizes[1] * np.sin(angle + 0.05)
    matrices[..., 1, 0], matrices[..., 1, 1] = sizes[0] * np.sin(angle), sizes[1] * np.cos(angle + 0.05)
    return WarpField.quantised(matrices)


def warped(rng, scale, *, chart=(96, 80), block=16, exemplar=(128, 128)):
    """A chart of square blocks that continue one another through a field as well as they can."""
    field = random_field(rng, *chart, scale, vary=0.03)
    places = [(r, c) for r in range(8, chart[0], block) for c in range(8, chart[1], block)]
    placed = np.zeros(len(places), PLACEMENT)
    placed["height"] = placed["width"] = block
    centre = np.array(exemplar) / 2
    for n, place in enumerate(places):
        step = scale * (np.array(place) - np.array(chart) / 2)
        placed["row"][n], placed["column"][n] = place
        source = np.clip(np.rint(16 * (centre + step)), 0, 16 * np.array(exemplar) - 16)
        placed["source_row"][n], placed["source_column"][n] = source
    return Quilt((Chart(0, *chart),), exemplar, PlacementList(placed, np.zeros(0, np.uint8)), (field,))
