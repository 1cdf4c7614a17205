"""An exemplar as method "quilt" looks at it."""

import numpy as np
import pytest

from upholster.methods.quilt.features import pca_features
from upholster.methods.quilt.match_pyramid import MatchPyramid
from upholster.quilt.pyramid import halved


def picture(height, width, channels=3):
    return np.random.default_rng(height).integers(0, 256, (height, width, channels), dtype=np.uint8)


@pytest.mark.parametrize("shape", [(40, 56, 3), (33, 90, 1)])
def test_levels_are_the_pyramids(shape):
    exemplar = picture(*shape)
    match_pyramid = MatchPyramid.of(exemplar, 2)
    image, variance = pca_features(exemplar)
    assert match_pyramid.variance == variance
    assert len(match_pyramid.levels) == 3
    for match_level in match_pyramid.levels:
        height, width, channels = image.shape
        assert (match_level.height, match_level.width) == (height, width)
        pixels = match_level.match.image.view(np.uint8).reshape(height, width, 4)
        assert (pixels[..., :channels] == image).all()
        assert not pixels[..., channels:].any()
        assert match_level.match.plane.dtype == np.float32
        image = halved(image)
    assert len(MatchPyramid.of(exemplar).levels) == 1


@pytest.mark.parametrize(("height", "width"), [(1, 1), (30, 64), (256, 256), (257, 40), (900, 20)])
def test_use_is_counted_on_a_lattice_of_at_most_64_points_each_way(height, width):
    for last in (0, 2, 4):
        match_pyramid = MatchPyramid.of(picture(height, width), last)
        usage_step = match_pyramid.empty_usage()
        assert not usage_step.any()
        assert 1 <= max(usage_step.shape) <= 64
        # its points lie on whole pixels of every level, and reach over all of the finest
        for level in range(last + 1):
            assert match_pyramid.stride(level) * 2**level == match_pyramid.usage_step
            assert match_pyramid.stride(level) >= 1
        assert (
            usage_step.shape[0] * match_pyramid.usage_step
            >= height
            > (usage_step.shape[0] - 1) * match_pyramid.usage_step
        )
        assert (
            usage_step.shape[1] * match_pyramid.usage_step
            >= width
            > (usage_step.shape[1] - 1) * match_pyramid.usage_step
        )
