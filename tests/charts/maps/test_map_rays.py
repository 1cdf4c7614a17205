"""Curvature and occlusion: edges, hollows, walls, what is open and hidden; cells that stand for steps."""

import numpy as np
import pytest
from grounds import at_steps, map_values, on_mesh, on_patches, steps_of
from meshes import box, sphere, two_rings

from upholster.charts.maps import coarse_values
from upholster.charts.maps.coarse_values import coarse_cells
from upholster.charts.maps.map_text import parse_map
from upholster.geometry.built_in.cyclide import torus
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.runtime.parallel import running


@pytest.fixture(scope="module")
def cube():
    return on_mesh(box((2.0, 2.0, 2.0), 2), 40)


@pytest.fixture(scope="module")
def room():
    """Return the inside of a box."""
    outside = box((2.0, 2.0, 2.0), 2)
    return on_mesh(TriangleMesh(outside.positions, outside.triangles[:, ::-1]), 40)


def from_edge(ground) -> np.ndarray:
    """Return how far steps on a cube of side 2 are from the nearest edge."""
    places = at_steps(ground.charted.mesh.corners, ground)
    return np.sort(np.minimum(places, 2 - places), axis=1)[:, 1]


@pytest.mark.slow(reason="casts rays over surfaces")
def test_edges_are_light_hollows_dark_and_what_is_flat_between(cube, room) -> None:
    for ground, sign in ((cube, 1), (room, -1)):
        found, away = map_values("curvature:0.3", ground), from_edge(ground)
        assert np.abs(found[away > 0.4] - 0.5).max() < 1e-3
        # Near one edge, far from corners, where two more edges show.
        places = at_steps(ground.charted.mesh.corners, ground)
        far = np.sort(np.minimum(places, 2 - places), axis=1)[:, 2] > 0.5
        rings = [sign * (found[far & (np.abs(away - at) < 0.015)] - 0.5) for at in (0.02, 0.1, 0.2, 0.28)]
        means = [ring.mean() for ring in rings]
        assert means == sorted(means, reverse=True)
        assert means[0] > 0.35
        assert 0 < means[-1] < 0.05
        assert max(ring.std() for ring in rings) < 0.06


@pytest.mark.slow(reason="casts rays over surfaces")
def test_the_reach_is_a_length_or_a_part_of_the_size(cube) -> None:
    size = cube.charted.mesh.size
    np.testing.assert_array_equal(
        map_values("curvature", cube), map_values(f"curvature:{0.03 * size!r}", cube)
    )
    np.testing.assert_array_equal(map_values("occlusion", cube), map_values(f"occlusion:{size / 3!r}", cube))


def test_a_ball_is_a_ridge_all_over() -> None:
    found = map_values("curvature:0.5", on_mesh(sphere(16), 15))
    # A ray at an angle a to the radius inward is within 0.5 if its chord, 2 cos a, is; its share is sin² a.
    assert found.mean() == pytest.approx(0.5 + 0.25**2, abs=0.02)
    assert found.std() < 0.02


def test_the_other_side_of_a_wall_is_no_edge() -> None:
    ground = on_mesh(box((2.0, 2.0, 0.05), 2), 30)
    places = at_steps(ground.charted.mesh.corners, ground)
    inner = np.minimum(places, 2 - places)[:, :2].min(axis=1) > 0.4
    assert np.abs(map_values("curvature:0.3", ground)[inner] - 0.5).max() < 0.01


def test_what_is_convex_is_open_and_a_room_is_dark_in_its_corners(cube, room) -> None:
    assert map_values("occlusion", cube).min() > 0.999
    places = at_steps(room.charted.mesh.corners, room)
    into = np.sort(np.minimum(places, 2 - places), axis=1)  # 0, from an edge, from the next one
    found = map_values("occlusion:0.5", room)
    assert found[into[:, 1] > 0.6].min() > 0.999
    edge = (into[:, 1] < 0.03) & (into[:, 2] > 0.6)
    assert found[edge].mean() == pytest.approx(0.5, abs=0.06)  # one of two walls fills half of the view
    assert found[into[:, 2] < 0.05].mean() < 0.4
    assert map_values("occlusion:9", room).max() == 0


def test_what_is_dark_beside_an_edge_does_not_show_beyond_it() -> None:
    slab = on_mesh(two_rings(), 30)
    triangles = np.concatenate([t for *_, t, _ in steps_of(slab.charted)])
    up = slab.charted.mesh.flat_normals[triangles, 2] > 0.5
    found = map_values("occlusion", slab)
    assert found[up].min() > 0.999  # right to the holes
    assert found.min() < 0.5  # in which it is dark


@pytest.mark.parametrize("text", ["curvature:0.3", "occlusion"])
def test_coarser_cells_tell_about_the_same(room, monkeypatch, text: str) -> None:
    fine = map_values(text, room)
    monkeypatch.setattr(coarse_values, "MOST_POINTS", 12_000)
    cells = coarse_cells(room.charted)
    assert sum(int(one.on.sum()) for one in cells) <= 12_000
    assert {one.stride for one in cells} == {2}
    again = map_values(text, room)
    assert np.isfinite(again).all()
    assert np.abs(again - fine).mean() < 0.03


def test_values_are_the_same_for_any_number_of_threads() -> None:
    ground = on_patches(torus(2.0, 0.8), 3000)
    for text in ("curvature:0.5", "occlusion"):
        with running(1):
            one = parse_map(text).values(ground)
        with running(3):
            other = parse_map(text).values(ground)
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a, b)
            assert np.isfinite(a).all()


def test_each_step_on_the_surface_is_in_a_cell_with_a_point_of_it(cube) -> None:
    for cells, (rows, columns, *_) in zip(coarse_cells(cube.charted), steps_of(cube.charted), strict=True):
        assert cells.on[rows // cells.stride, columns // cells.stride].all()
        low, high = cube.charted.mesh.box
        assert (cells.positions[cells.on] >= low - 1e-9).all()
        assert (cells.positions[cells.on] <= high + 1e-9).all()
