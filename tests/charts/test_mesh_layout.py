"""Charts and warp fields of meshes: places, true scale, the plain twin of the nodes' sums."""

import numpy as np
import pytest
from tests.charts.meshes import height_field, on_charts

from upholster.base.errors import InputError
from upholster.charts.mesh_layout import GUTTER, chart_places, mesh_charts
from upholster.charts.mesh_warp_fields import triangle_frames, warp_fields
from upholster.geometry.meshes.triangle_mesh import MeshSurface


def sheet(turned: float = 0.0, size: float = 2.0) -> MeshSurface:
    """Return a square sheet, seen from above, laid out true to size and turned by some degrees."""
    mesh = height_field(7, size=size)
    flat = np.stack([-mesh.positions[:, 1], mesh.positions[:, 0]], axis=1)
    a = np.radians(turned)
    flat = flat @ np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    return MeshSurface(mesh, np.zeros(len(mesh.triangles)), flat[mesh.triangles])


def test_a_chart_holds_its_island_and_the_gutter_round_it() -> None:
    surface = sheet(30)
    (chart,) = mesh_charts(surface, 40.0)
    assert chart.height / (chart.s1 - chart.s0) == pytest.approx(40)
    assert chart.width / (chart.t1 - chart.t0) == pytest.approx(40)
    places = chart_places(surface, (chart,))
    assert places.min() >= GUTTER - 1e-9
    assert (chart.height - places[..., 0]).min() >= GUTTER - 1e-9
    assert (chart.width - places[..., 1]).min() >= GUTTER - 1e-9
    steps = np.linalg.norm(places[:, 1] - places[:, 0], axis=1)
    sides = np.linalg.norm(surface.mesh.corners[:, 1] - surface.mesh.corners[:, 0], axis=1)
    np.testing.assert_allclose(steps, 40 * sides)


@pytest.mark.parametrize("turned", [0.0, 30.0, -117.0])
def test_on_a_plane_the_field_is_one_turned_matrix(turned: float) -> None:
    surface = sheet(turned)
    charts = mesh_charts(surface, 64.0)
    vectors = np.tile([1.0, 0.0, 0.0], (len(surface.mesh.triangles), 3, 1))
    along, down = triangle_frames(surface.mesh, vectors)
    np.testing.assert_allclose(down, np.tile([0, -1.0, 0], (len(down), 1)), atol=1e-12)
    (field,) = warp_fields(on_charts(surface, 64.0), along, down, 100.0)
    matrices = field.matrices.reshape(-1, 2, 2) / 4096
    edges = surface.mesh.corners[0, 1:] - surface.mesh.corners[0, 0]
    steps = (chart_places(surface, charts)[0, 1:] - chart_places(surface, charts)[0, 0]).T
    exact = 100 * np.stack([edges @ down[0], edges @ along[0]]) @ np.linalg.inv(steps)
    np.testing.assert_allclose(matrices, np.broadcast_to(exact, matrices.shape), atol=0.03)


def test_an_island_that_is_too_large_is_refused() -> None:
    with pytest.raises(InputError, match="allowed: 16384 each way"):
        mesh_charts(sheet(), 10_000.0)


def test_where_the_field_turns_the_size_is_right_between_nodes_too() -> None:
    # A turn of 120° over a sheet of 128 texels: 30° from node to node.
    surface = sheet()
    charts = mesh_charts(surface, 64.0)
    centre = surface.mesh.corners[..., 0].mean(axis=1)
    angle = np.radians(60) * centre
    vectors = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)[:, None].repeat(3, axis=1)
    (field,) = warp_fields(on_charts(surface, 64.0), *triangle_frames(surface.mesh, vectors), 64.0)
    places = chart_places(surface, charts).mean(axis=1) - 0.5
    sizes = np.sqrt(np.linalg.det(field.at(places[:, 0], places[:, 1])))
    assert np.abs(sizes - 1).max() < 0.05
    assert abs(sizes.mean() - 1) < 0.01


def test_over_large_triangles_the_field_turns_as_at_corners() -> None:
    surface = sheet()
    charts = mesh_charts(surface, 64.0)
    angle = np.radians(20) * surface.mesh.corners[..., 0]
    corners = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=2)
    along = np.tile([1.0, 0.0, 0.0], (len(angle), 1))
    down = np.cross(along, surface.mesh.flat_normals)
    (field,) = warp_fields(on_charts(surface, 64.0), along, down, 64.0, corners=corners)
    # At any place a step along the wanted direction goes along the exemplar's columns.
    shares = np.random.default_rng(5).dirichlet(np.ones(3), len(angle))
    rows, columns = (chart_places(surface, charts) * shares[:, :, None]).sum(axis=1).T - 0.5
    wanted = (angle * shares).sum(axis=1)
    found = field.at(rows, columns) @ np.stack([-np.sin(wanted), np.cos(wanted)], axis=1)[:, :, None]
    off = np.degrees(np.arctan2(found[:, 0, 0], found[:, 1, 0]))
    assert np.abs(off).mean() < 1.0  # nodes have whole 256ths of a turn
