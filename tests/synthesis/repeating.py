"""Samples that repeat, with their lattices: what `find_lattice` would find, made by hand."""

import numpy as np

from upholster.image.elements.lattice import Lattice


def repeating(height, width, waves, seed=0, noise=0.15):
    """Return a grey sample of these waves (n, 2), uint8 (H, W, 1), and its lattice."""
    waves = np.asarray(waves, float)
    rows, columns = np.mgrid[:height, :width]
    turns = waves[:, :1, None] * rows + waves[:, 1:, None] * columns
    value = np.cos(2 * np.pi * turns).mean(axis=0) + noise * np.random.default_rng(seed).normal(
        size=(height, width)
    )
    image = np.rint(127 + 90 * np.clip(value, -1.4, 1.4)).astype(np.uint8)[..., None]
    phases = np.rint(65536 * (turns - np.rint(turns))).astype(np.int64).astype(np.int16)
    return image, Lattice(waves, phases, np.ones(len(waves)))
