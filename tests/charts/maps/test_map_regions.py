"""Regions that are laid again: which steps of the charts stay."""

import numpy as np
import pytest
from grounds import on_mesh
from meshes import torus
from scipy.ndimage import maximum_filter

from upholster import InputError
from upholster.charts.maps.map_ground import MapGround, triangles_at_steps
from upholster.charts.maps.map_text import parse_map
from upholster.charts.maps.surface_map import region
from upholster.synthesis.guidance import region_again


@pytest.fixture(scope="module")
def ground() -> MapGround:
    ground = on_mesh(torus(), 12.0)
    assert len(ground.charted.charts) > 1
    return ground


def test_a_region_of_all_of_a_surface_leaves_no_step_at_its_seams(ground: MapGround) -> None:
    again = region_again(parse_map("0,0,0:100"), ground)
    assert not any(stays.any() for stays in again)


def test_steps_of_the_surface_outside_stay_and_three_round_each(ground: MapGround) -> None:
    wanted = parse_map("2,0,0:1.5")
    again = region_again(wanted, ground)
    inside = region(wanted, ground)
    assert any(own.any() for own in inside)
    for own, triangles, stays in zip(inside, triangles_at_steps(ground.charted), again, strict=True):
        outside = (triangles >= 0) & ~own
        np.testing.assert_array_equal(stays, maximum_filter(outside, 7))


def test_a_region_beside_the_surface_is_refused(ground: MapGround) -> None:
    with pytest.raises(InputError, match="contains no part of the surface"):
        region_again(parse_map("50,0,0:1"), ground)
