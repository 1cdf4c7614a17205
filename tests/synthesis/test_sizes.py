"""Sides of blocks: by the sample's size, the surface's size, and what courses are stretched by."""

from types import SimpleNamespace

import numpy as np
import pytest
from repeating import repeating

from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.charts.surface_to_cover import as_covered
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.quilt.scene import coarser
from upholster.synthesis.quilt.sizes import LARGEST_SIDE, block_side, suiting_side
from upholster.synthesis.setup import prepare

SAMPLE, LATTICE = repeating(256, 256, [(1 / 40, 0), (0, 1 / 31)])


def stretched(strain, waves=LATTICE.waves):
    return SimpleNamespace(waves=waves, strain=lambda _share: strain)


def test_a_block_suits_the_sample_where_nothing_is_stretched():
    assert block_side(SAMPLE.shape, 5000.0, None) == suiting_side(SAMPLE.shape, repeats=False) == 96
    assert block_side(SAMPLE.shape, 5000.0, stretched(0.0)) == suiting_side(SAMPLE.shape, repeats=True)


@pytest.mark.parametrize(
    ("shape", "side", "repeating"),
    [((32, 90), 12, 8), ((128, 128, 3), 48, 40), ((14, 14), 8, 8), ((4000, 4000, 1), 512, 512)],
)
def test_a_block_is_three_eighths_of_the_sample_or_less_if_it_repeats(shape, side, repeating):
    assert suiting_side(shape, repeats=False) == side
    assert suiting_side(shape, repeats=True) == repeating


def test_a_block_is_no_larger_than_a_small_surface_allows():
    assert block_side(SAMPLE.shape, 8 * 26.0, None) == 24
    assert block_side(SAMPLE.shape, 40.0, None) == 20


@pytest.mark.parametrize(("strain", "side"), [(0.25 / 33, 32), (0.25 / 28.5, 28), (1.0, 20)])
def test_small_blocks_are_in_step_with_the_next(strain, side):
    assert block_side(SAMPLE.shape, 5000.0, stretched(strain)) == side


def test_only_small_samples_have_small_blocks():
    assert block_side(SAMPLE.shape, 5000.0, stretched(1.0, np.array([(1 / 7, 0)]))) == 20
    small = SAMPLE[:32, :32]
    suits = suiting_side(small.shape, repeats=True)
    assert block_side(small.shape, 5000.0, stretched(1.0)) == suits < 20


def test_a_quick_look_has_blocks_twice_as_wide_and_never_too_wide():
    sample = np.random.default_rng(1).integers(0, 256, (1000, 1000, 1), dtype=np.uint8)
    sample, surface, sides = Exemplar(sample), as_covered("sphere").surface, []
    for block in (100, 400):
        options = SynthesisOptions(texels=40_000, sample_size=8.0, block=block, phase=0)
        sides.append(coarser(prepare(sample, surface, options), sample, 2).options.block)
    assert sides == [200, LARGEST_SIDE]
