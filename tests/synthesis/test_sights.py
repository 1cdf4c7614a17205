"""An exemplar as method "quilt" looks at it."""

import numpy as np
import pytest

from upholster.synthesis.matching import matching_form
from upholster.synthesis.pyramid import halved
from upholster.synthesis.sights import Sights


def picture(height, width, channels=3):
    return np.random.default_rng(height).integers(0, 256, (height, width, channels), dtype=np.uint8)


@pytest.mark.parametrize("shape", [(40, 56, 3), (33, 90, 1)])
def test_levels_are_the_pyramids(shape):
    exemplar = picture(*shape)
    sights = Sights.of(exemplar, 2)
    image, variance = matching_form(exemplar)
    assert sights.variance == variance
    assert len(sights.levels) == 3
    for sight in sights.levels:
        assert (sight.height, sight.width, sight.channels) == image.shape
        assert (sight.image.reshape(image.shape) == image).all()
        assert sight.plane.dtype == np.float32
        image = halved(image)
    assert len(Sights.of(exemplar).levels) == 1


@pytest.mark.parametrize(("height", "width"), [(1, 1), (30, 64), (256, 256), (257, 40), (900, 20)])
def test_use_is_counted_on_a_lattice_of_at_most_64_points_each_way(height, width):
    for last in (0, 2, 4):
        sights = Sights.of(picture(height, width), last)
        lattice = sights.unused()
        assert not lattice.any()
        assert 1 <= max(lattice.shape) <= 64
        # its points lie on whole pixels of every level, and reach over all of the finest
        for level in range(last + 1):
            assert sights.stride(level) * 2**level == sights.lattice
            assert sights.stride(level) >= 1
        assert lattice.shape[0] * sights.lattice >= height > (lattice.shape[0] - 1) * sights.lattice
        assert lattice.shape[1] * sights.lattice >= width > (lattice.shape[1] - 1) * sights.lattice
