"""Textures and quilts that several tests share."""

import numpy as np

from upholster.synthesis import Chart, Quilt
from upholster.synthesis.quilt import PLACEMENT


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
    names = ("row", "column", "height", "width", "source_row", "source_column", "turn")
    for name, values in zip(names, np.array(blocks, np.int64).reshape(-1, 7).T, strict=True):
        placed[name] = 16 * values if name.startswith("source") else values
    return Quilt((Chart(0, *chart),), exemplar, placed, np.zeros(0, np.uint8))
