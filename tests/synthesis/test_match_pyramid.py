"""An exemplar as method "quilt" looks at it."""

import numpy as np
import pytest

from upholster.image.elements.joints import Joints
from upholster.quilt.pyramid import halved
from upholster.synthesis.quilt.features import pca_features
from upholster.synthesis.quilt.match_pyramid import SamplePart, match_pyramid


def picture(height, width, channels=3):
    return np.random.default_rng(height).integers(0, 256, (height, width, channels), dtype=np.uint8)


@pytest.mark.parametrize("shape", [(40, 56, 3), (33, 90, 1)])
def test_levels_are_the_pyramids(shape):
    exemplar = picture(*shape)
    pyramid = match_pyramid(exemplar, 2)
    image = pca_features(exemplar)
    assert pyramid.variance == pytest.approx(image.reshape(-1, image.shape[2]).var(axis=0).sum())
    assert len(pyramid.levels) == 3
    for match_level in pyramid.levels:
        height, width, channels = image.shape
        assert (match_level.height, match_level.width) == (height, width)
        pixels = match_level.match.image.view(np.uint8).reshape(height, width, 4)
        assert (pixels[..., :channels] == image).all()
        assert not pixels[..., channels:].any()
        assert match_level.match.plane.dtype == np.float32
        image = halved(image)
    assert len(match_pyramid(exemplar).levels) == 1


@pytest.mark.parametrize("dark", [True, False])
def test_candidates_are_found_by_joints_before_colours(dark):
    distances = np.random.default_rng(1).integers(0, 256, (40, 56), dtype=np.uint8)
    exemplar = picture(40, 56) // 8
    exemplar += (distances // 2 if dark else 127 - distances // 2)[..., None]
    form = match_pyramid(exemplar, 0, [SamplePart.whole(exemplar, None, Joints(distances, 9.0, 5.0))]).form
    colors = pca_features(exemplar, most=3)
    assert (form[..., 1:] == colors).all()
    # Whichever sign the first component has, it and the joints do not cancel.
    both = form[..., 0].ravel().astype(float)
    assert abs(np.corrcoef(both, distances.ravel())[0, 1]) > 0.95
    assert np.corrcoef(both, colors[..., 0].ravel())[0, 1] > 0.95


def test_what_is_not_used_does_not_vary():
    exemplar = picture(40, 56)
    used = np.zeros((40, 56), bool)
    used[5:30, 10:40] = True
    exemplar[~used] = exemplar[used].mean(axis=0)
    found, image = match_pyramid(exemplar, masks=[used]), pca_features(exemplar)
    assert found.variance == pytest.approx(image[used].var(axis=0).sum())
    assert found.variance > 1.5 * match_pyramid(exemplar).variance


@pytest.mark.parametrize(("height", "width"), [(1, 1), (30, 64), (256, 256), (257, 40), (900, 20)])
def test_guides_are_compared_at_no_more_than_64_places_each_way(height, width):
    for last in (0, 2, 4):
        pyramid = match_pyramid(picture(height, width), last)
        assert max(height, width) <= 64 * pyramid.guide_step
        for level in range(last + 1):
            assert pyramid.stride(level) * 2**level == pyramid.guide_step
            assert pyramid.stride(level) >= 1
