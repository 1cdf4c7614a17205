"""Surfaces whose patches meet in the same way, and what is said of those that do not."""

import re

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.plane import plane
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.same_edges import check_same_edges
from upholster.geometry.patches.surface import Surface


@pytest.mark.parametrize(
    ("spec", "model"),
    [
        ("cyclide", "torus:R=9,r=1"),
        ("cyclide:a=6,c=1,mu=3", "cyclide"),
        ("ellipsoid", "sphere:tiling=octants"),
        ("cylinder:spans=5", "cone:spans=5"),
        ("cone:spans=5,r2=0", "cone:spans=5"),  # an edge that is a point meets nothing
        ("sphere:r=3", "sphere"),
    ],
)
def test_what_meets_alike_fits_both_ways(spec: str, model: str) -> None:
    check_same_edges(surface_from_spec(spec), surface_from_spec(model))
    check_same_edges(surface_from_spec(model), surface_from_spec(spec))


@pytest.mark.parametrize(
    ("spec", "model", "message"),
    [
        ("cyclide:spans=6x4", "cyclide", "face 0 has 6x4 patches; allowed: 4x4, as before"),
        ("sphere", "sphere:tiling=octants", "it has 6 faces; allowed: 1, as before"),
        (
            "plane:spans=4x4",
            "torus",
            "edge 0 of patch 0 meets nothing; allowed: meets edge 2 of patch 12, as before",
        ),
        (
            "torus",
            "plane:spans=4x4",
            "edge 0 of patch 0 meets edge 2 of patch 12; allowed: meets nothing, as before",
        ),
    ],
)
def test_the_first_edge_that_does_not_fit_is_named(spec: str, model: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        check_same_edges(surface_from_spec(spec), surface_from_spec(model))
    assert "\n" not in str(caught.value)


def test_direction_and_interval_of_a_meeting_count() -> None:
    first, second = plane(2, 1, spans=(1, 2)).patches
    straight = Surface([first, second])
    opposed = Surface([first, second.reverse(0)])
    with pytest.raises(InputError, match=r"meets edge 3 of patch 1, in the opposite direction; allowed"):
        check_same_edges(opposed, straight)
    shifted = RationalPatch.from_points(second.control_points + np.array([0.0, 0.25, 0.0]))
    with pytest.raises(InputError, match=r"meets edge 3 of patch 1 from 0 to 0.75; allowed"):
        check_same_edges(Surface([first, shifted]), straight)
    with pytest.raises(InputError, match=r"allowed: meets edge 3 of patch 1 from 0 to 0.75, as before"):
        check_same_edges(straight, Surface([first, shifted]))
