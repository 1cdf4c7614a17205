"""The lattice of a sample: its waves and phases."""

import numpy as np
import pytest
from benchmarks.lattice_samples import lattice_sample

from upholster.lattice import find_lattice


@pytest.mark.parametrize("pattern", ["running_bond", "stack_bond", "hexagons", "gingham"])
def test_generated_lattices_are_found(pattern):
    sample = lattice_sample(pattern, side=256)
    lattice = find_lattice(sample.image)
    assert lattice is not None
    assert lattice.waves.shape == (2, 2)
    assert lattice.phases.shape == (2, 256, 256)
    assert lattice.phases.dtype == np.int16
    # Whole combinations of the pattern's own waves, and nothing coarser: a basis of the same waves.
    change = lattice.waves @ np.linalg.inv(sample.waves)
    assert np.abs(change - np.rint(change)).max() < 0.1
    assert abs(round(np.linalg.det(np.rint(change)))) == 1


def test_nothing_repeats_in_noise():
    assert find_lattice(np.random.default_rng(3).integers(0, 256, (128, 128, 3), dtype=np.uint8)) is None
    assert find_lattice(np.full((64, 64, 3), 7, np.uint8)) is None


def test_phases_grow_by_the_waves():
    lattice = find_lattice(lattice_sample("stack_bond", side=192).image)
    assert lattice is not None
    for wave, phases in zip(lattice.waves, lattice.phases, strict=True):
        for axis in (0, 1):
            steps = np.diff(phases, axis=axis)  # they wrap
            assert abs(steps.mean() / 65536 - wave[axis]) < 1e-3
