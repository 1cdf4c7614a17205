"""Textures and quilts that several tests share."""

import numpy as np
from warp_fields import quantised

from upholster.quilt.chart import Chart
from upholster.quilt.labels import LabelMap, label_shape, nearest_labels
from upholster.quilt.model import Quilt
from upholster.quilt.placement import PLACEMENT
from upholster.quilt.warp_field import node_count


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
    """One chart, blocks (row, column, height, width, source row, source column, turn), the last on top.

    A block's middle step reads at the source. What none covers the first one shows.
    """
    placed = np.zeros(len(blocks), PLACEMENT)
    labels = np.zeros(label_shape(*chart, 1), np.int32)
    for n, (row, column, height, width, source_row, source_column, symmetry) in enumerate(blocks):
        placed[n]["row"], placed[n]["column"] = 16 * row + 8, 16 * column + 8
        placed[n]["source_row"], placed[n]["source_column"] = 16 * source_row, 16 * source_column
        placed[n]["symmetry"] = symmetry
        # Cells of one step begin one before the chart.
        top, left = row - height // 2 + 1, column - width // 2 + 1
        labels[max(0, top) : max(0, top + height), max(0, left) : max(0, left + width)] = n
    return Quilt((Chart(0, *chart),), exemplar, placed, ((LabelMap(1, labels),),))


def quilt_of_nearest(charts, placed, *, exemplar=(64, 64), fields=(), cell=1):
    """Charts on which each cell shows the placement whose centre is nearest."""
    labels = []
    for index, chart in enumerate(charts):
        own = placed[placed["chart"] == index]
        labels.append((LabelMap(cell, nearest_labels(own["row"], own["column"], chart, cell)),))
    return Quilt(tuple(charts), exemplar, placed, tuple(labels), tuple(fields))


def random_field(rng, height, width, scale, *, vary=0.1):
    """Matrices that turn, stretch and shear a little from node to node, about `scale` pixels per texel."""
    shape = (node_count(height, 1), node_count(width, 1))
    angle = vary * rng.normal(size=shape)
    sizes = scale * np.exp(vary * rng.normal(size=(2, *shape)))
    matrices = np.empty((*shape, 2, 2))
    matrices[..., 0, 0], matrices[..., 0, 1] = sizes[0] * np.cos(angle), -sizes[1] * np.sin(angle + 0.05)
    matrices[..., 1, 0], matrices[..., 1, 1] = sizes[0] * np.sin(angle), sizes[1] * np.cos(angle + 0.05)
    return quantised(matrices)


def warped(rng, scale, *, chart=(96, 80), block=16, exemplar=(128, 128)):
    """A chart of square blocks that continue one another through a field as well as they can."""
    field = random_field(rng, *chart, scale, vary=0.03)
    places = [(r, c) for r in range(8, chart[0], block) for c in range(8, chart[1], block)]
    placed = np.zeros(len(places), PLACEMENT)
    centre = np.array(exemplar) / 2
    for n, place in enumerate(places):
        step = scale * (np.array(place) - np.array(chart) / 2)
        placed["row"][n], placed["column"][n] = 16 * np.array(place) + 8
        source = np.clip(np.rint(16 * (centre + step)), 0, 16 * np.array(exemplar) - 16)
        placed["source_row"][n], placed["source_column"][n] = source
    return quilt_of_nearest((Chart(0, *chart),), placed, exemplar=exemplar, fields=(field,))
