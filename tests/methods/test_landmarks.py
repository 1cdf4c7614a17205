"""What catches the eye in a sample is found, and is shown less often near itself."""

import numpy as np
from plain_quilt import texture

from upholster import synthesize
from upholster.geometry import plane
from upholster.measure.landmarks import landmark_recurrence
from upholster.methods.quilt.features import pca_features
from upholster.methods.quilt.landmarks import LandmarkRules, find_landmarks
from upholster.quilt import Chart
from upholster.quilt.warp_field import WarpField


def spotted(places, size=96):
    image = texture(size, size, seed=3) // 4 + 96
    for row, column in places:
        image[row - 3 : row + 4, column - 3 : column + 4] = (250, 20, 20)
    return image


def test_spots_are_landmarks_and_count_in_full():
    places = [(20, 30), (60, 70), (75, 15)]
    found = find_landmarks(pca_features(spotted(places))[0])
    assert 3 <= len(found) <= 16
    for row, column in places:
        away = np.abs(found[:3, :2] - (row, column)).max(axis=1)
        assert away.min() <= 4
    assert (found[:3, 2] == 256).all()
    assert (np.diff(found[:, 2]) <= 0).all()


def test_a_plain_sample_has_no_landmarks():
    assert len(find_landmarks(np.full((64, 64, 3), 9, np.uint8))) == 0


def test_blocks_of_other_charts_count_where_they_are_near():
    charts = [Chart(0, 400, 400)]
    form = pca_features(spotted([(20, 30)]))[0]
    fields = [WarpField.identity()]
    rules = LandmarkRules.of(form, plane(), charts, fields, weight=1.0, block=32, shape=(24, 24), wrap=False)
    blocks = np.array([[16, 16], [16, 300]], np.int32)
    first = rules.uses(0, blocks, 0, 2, [None])
    assert first.before == 0
    first.shown[:] = 1
    again = rules.uses(0, np.array([[20, 20]], np.int32), 0, 2, [rules.shown(first)])
    assert again.before == 1
    assert (again.places == [[16, 16, 0], [20, 20, 0]]).all()


def test_spots_recur_farther_apart():
    exemplar = spotted([(20, 30), (60, 70), (75, 15), (30, 75)])
    near = []
    for variety in (0, 1):
        found = [
            landmark_recurrence(
                plane(),
                synthesize(exemplar, plane(), texels=(400, 400), seed=seed, variety=variety, effort=0),
                exemplar,
            )
            for seed in range(4)
        ]
        near.append(np.mean([one.nearest for one in found]))
    assert near[1] > 1.1 * near[0]
