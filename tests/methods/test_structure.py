"""The size of a texture's structure."""

import numpy as np
import pytest

from upholster.methods.quilt.exemplar_structure import block_size


def noise(height, width, channels=3, seed=1):
    return np.random.default_rng(seed).integers(0, 256, (height, width, channels), dtype=np.uint8)


def grains(side, size, seed=1):
    """Noise whose correlation falls to nothing at a distance of `size` pixels down or along."""
    fine = np.random.default_rng(seed).normal(size=(side + size - 1, side + size - 1))
    window = np.lib.stride_tricks.sliding_window_view(fine, (size, size)).mean(axis=(2, 3))
    return np.rint(np.clip(128 + 40 * window * size, 0, 255)).astype(np.uint8)[..., None]


def tiled(side, height, width, shift=0):
    """A random tile repeated, every row of tiles `shift` pixels further right, and a little noise."""
    tile = grains(max(height, width), 3)[:height, :width, 0].astype(np.int64)
    rows, columns = np.arange(side)[:, None], np.arange(side)
    repeated = tile[rows % height, (columns - shift * (rows // height)) % width]
    return (repeated // 2 + noise(side, side, 1)[..., 0] // 8).astype(np.uint8)[..., None]


def test_a_block_grows_with_the_grain():
    sizes = [block_size(grains(256, size)) for size in (1, 4, 8, 16)]
    assert sizes[0] == 28  # nothing is related to its neighbours: the least, and a pixel
    # a grain's correlation is a pyramid, which falls to 0.2 at about 0.78 of its base
    for size, block in zip((4, 8, 16), sizes[1:], strict=True):
        assert 24 + 4 * 0.68 * size - 2 <= block <= 24 + 4 * 0.85 * size + 2


@pytest.mark.parametrize("factor", [2, 3, 4])
def test_magnified_elements_are_that_much_larger(factor):
    exemplar = grains(256, 6)
    large = np.repeat(np.repeat(exemplar, factor, axis=0), factor, axis=1)
    # larger exemplars are looked at reduced: these to what they were
    assert block_size(large) - 24 == pytest.approx(factor * (block_size(exemplar) - 24), abs=2 + 2 * factor)


@pytest.mark.parametrize(
    ("height", "width", "shift", "cell"),
    [
        (40, 40, 0, 40),
        (44, 20, 0, 44),
        (20, 50, 0, 50),
        (24, 40, 20, 48),  # two courses are a cell; in its box of 48 × 40 lie two elements
        (12, 12, 0, 12),
    ],
)
def test_a_block_holds_a_period(height, width, shift, cell):
    block = block_size(tiled(128, height, width, shift))
    grain = block_size(grains(128, 3))
    assert max(cell, grain - 8) <= block <= max(1.1 * cell + 4, grain + 8)


def test_a_cell_is_not_taken_for_its_half():
    halves = tiled(128, 24, 24).astype(np.int64) + tiled(128, 48, 48)
    assert 48 <= block_size((halves // 2).astype(np.uint8)) <= 56


def test_periods_too_long_for_a_block_are_given_up():
    assert block_size(tiled(128, 58, 58)) == block_size(tiled(128, 64, 128)) <= 40


@pytest.mark.parametrize(
    "shape", [(1, 1, 1), (2, 3, 3), (8, 8, 3), (24, 900, 1), (900, 24, 4), (64, 64, 9), (257, 300, 3)]
)
def test_blocks_are_within_bounds(shape):
    for exemplar in (noise(*shape), np.full(shape, 7, np.uint8), np.cumsum(noise(*shape), axis=0) / 1e5):
        block = block_size(exemplar if exemplar.dtype == np.uint8 else exemplar.astype(np.float32))
        assert type(block) is int
        assert block % 4 == 0
        assert 8 <= block <= 512
        assert block <= max(8, 7 / 16 * min(shape[:2]) + 2)


def test_the_greatest_block_is_for_the_greatest_structure():
    ramp = (np.add.outer(np.arange(2000), np.arange(2000))[..., None] * 16).astype(np.uint16)
    assert block_size(ramp) == 512
    assert block_size(ramp[:128, :128]) == 40


def test_neither_orientation_nor_depth_matters():
    exemplar = np.concatenate([grains(150, 5, seed) for seed in (1, 2, 3)], axis=2)
    expected = block_size(exemplar)
    assert expected > 28
    for alike in (exemplar[::-1], exemplar[:, ::-1], exemplar.transpose(1, 0, 2), exemplar[..., ::-1]):
        assert block_size(alike) == expected
    assert block_size(exemplar.astype(np.uint16) * 256) == expected
    assert block_size(exemplar.astype(np.float32) / 255) == expected


def test_a_block_holds_a_cell_of_the_lattice():
    # Planks of one wave: the autocorrelation has no second peak.
    rows = np.sin(2 * np.pi * np.arange(256) / 50)[:, None] * np.ones(256)
    planks = np.rint(128 + 60 * rows + 25 * np.random.default_rng(1).normal(size=(256, 256)))
    assert block_size(planks.clip(0, 255).astype(np.uint8)[..., None]) >= 52
