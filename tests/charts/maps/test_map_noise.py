"""Noise: as it is defined, in space, spread over its range, and on a tile without an edge."""

import numpy as np
import pytest
from grounds import at_steps, map_values, on_flat, on_mesh
from meshes import box, sphere

from upholster.base.errors import InputError
from upholster.charts.maps.map_text import parse_map


def test_noise_is_the_same_on_every_machine() -> None:
    values = parse_map("noise:9").values(on_flat(60, 80))[0]
    np.testing.assert_allclose(values[(3, 30, 59), (7, 40, 79)], PINNED, atol=1e-6)


@pytest.mark.slow(reason="casts rays over surfaces")
def test_noise_belongs_to_places_in_space_not_to_charts() -> None:
    mesh = sphere(8)
    coarse, fine = on_mesh(mesh, 12), on_mesh(mesh, 17)
    places, others = (at_steps(mesh.corners, ground) for ground in (coarse, fine))
    away = np.linalg.norm(places[:, None] - others, axis=2)
    near = away.min(axis=1) < 0.02
    assert near.sum() > 100
    difference = map_values("noise:0.8", coarse) - map_values("noise:0.8", fine)[away.argmin(axis=1)]
    assert np.abs(difference[near]).max() < 0.12  # it is that smooth


def test_noise_is_spread_and_blobs_are_as_large_as_asked() -> None:
    ground = on_mesh(box((10.0, 10.0, 10.0), 2), 8)
    for text, blob in (("noise:1", 1.0), ("noise", ground.charted.mesh.size / 8)):
        values = [v for v in parse_map(text).values(ground) if np.isfinite(v).sum() > 1000]
        every = np.concatenate([v[np.isfinite(v)] for v in values])
        assert every.min() >= 0
        assert every.max() <= 1
        if text == "noise:1":
            shares = np.histogram(every, 4, (0, 1))[0] / len(every)
            assert np.abs(shares - 0.25).max() < 0.07
        steps = round(8 * blob)  # half of one blob on it is alike, two are not
        alike = [
            np.corrcoef(*(part[~np.isnan(a + b)] for part in (a, b)))[0, 1]
            for by in (steps // 4, 2 * steps)
            for a, b in [(values[0][:-by], values[0][by:])]
        ]
        assert alike[0] > 0.5
        assert abs(alike[1]) < 0.5


def test_noise_goes_on_beyond_the_edges_of_a_tile() -> None:
    whole = parse_map("noise:9").values(on_flat(60, 80, tile=True))[0]
    for axis in (0, 1):
        inside = np.abs(np.diff(whole, axis=axis)).max()
        first, last = whole.take(0, axis), whole.take(-1, axis)
        assert np.abs(first - last).max() <= inside
    bare = parse_map("noise:9").values(on_flat(60, 80))[0]
    assert np.abs(bare[0] - bare[-1]).max() > 0.3


def test_blobs_that_are_too_small_are_refused() -> None:
    with pytest.raises(InputError, match="blobs of a map are 1e-09 model units; allowed: at least"):
        parse_map("noise:1e-9").values(on_flat())


PINNED = (0.754164994, 0.468649566, 0.773692727)
"""Noise at some places."""
