"""Quarter turns of charts' matrices against the field: they go on within charts, but near singular points."""

import numpy as np
import pytest
from tests.charts.meshes import height_field, on_charts, sphere

from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.directions.field import direction_field
from upholster.charts.mesh_warp_fields import triangle_frames
from upholster.charts.turns import chart_turns
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh


def roof(count: int = 24) -> MeshSurface:
    """Return a sheet that is bent over a rounded ridge along y, one island, seen from above."""
    flat = height_field(count, size=2.0)
    x = flat.positions[:, 0] - 1
    positions = np.column_stack([x, flat.positions[:, 1], 0.2 - np.sqrt(x * x + 0.04)])
    parameters = np.stack([-flat.positions[:, 1], flat.positions[:, 0]], axis=1)
    mesh = TriangleMesh(positions, flat.triangles)
    return MeshSurface(mesh, np.zeros(len(mesh.triangles)), parameters[mesh.triangles])


def one_island(mesh: TriangleMesh) -> ChartedSurface:
    """Return a mesh as one island; its parameters do not matter, but no edge is a seam."""
    flat = np.ascontiguousarray(mesh.positions[mesh.triangles][..., :2])
    return on_charts(MeshSurface(mesh, np.zeros(len(mesh.triangles)), flat))


def open_edges(surface: ChartedSurface, along: np.ndarray) -> np.ndarray:
    """Return over which edges (T, 3) within islands unit tangents turn by more than a right angle."""
    mesh = surface.mesh
    found = np.zeros(mesh.triangles.shape, bool)
    for t, row in enumerate(mesh.neighbours):
        for k, met in enumerate(row):
            if met >= 0 and not surface.is_seam[t, k]:
                edge = mesh.corners[t, (k + 1) % 3] - mesh.corners[t, k]
                edge /= np.linalg.norm(edge)
                sides = [
                    np.array([along[one] @ edge, along[one] @ np.cross(mesh.flat_normals[one], edge)])
                    for one in (t, met // 3)
                ]
                found[t, k] = sides[0] @ sides[1] < 0
    return found


def turned(along: np.ndarray, down: np.ndarray, turns: np.ndarray) -> np.ndarray:
    return np.choose(turns[:, None], [along, down, -along, -down])


def test_over_a_ridge_each_side_keeps_its_sense() -> None:
    surface = on_charts(roof())
    field = direction_field(surface.mesh, "level")
    along, down = triangle_frames(surface.mesh, field.corner_vectors)
    # To the right, seen from outside: opposite ways on either side, and along the ridge everywhere.
    x = surface.mesh.corners[..., 0].mean(axis=1)
    assert (along[:, 1] * np.sign(x) > 0.95).all()
    assert len(field.singular) == 0
    turns = chart_turns(surface, along, field.fold)
    assert set(turns.tolist()) == {0, 2}
    assert open_edges(surface, along).any()
    assert not open_edges(surface, turned(along, down, turns)).any()


@pytest.mark.parametrize("direction", ["smooth", "level"])
def test_matrices_jump_only_on_short_ways_between_singular_points(direction: str) -> None:
    mesh = sphere(10)
    surface = one_island(mesh)
    field = direction_field(mesh, direction, symmetry=2)
    along = field.face_vectors
    down = np.cross(along, mesh.flat_normals)
    turns = chart_turns(surface, along, field.fold)
    jumps = open_edges(surface, turned(along, down, turns))
    odd = field.index[field.singular] % 2 != 0
    assert odd.any()
    # Every odd point lies at an odd number of them, every other vertex at an even one.
    around = np.zeros(len(mesh.positions), int)
    for k in range(3):
        np.add.at(around, mesh.triangles[:, k], jumps[:, k])
        np.add.at(around, mesh.triangles[:, (k + 1) % 3], jumps[:, k])
    assert set(np.flatnonzero(around // 2 % 2)) == set(field.singular[odd])
    # At most as if each point were joined to its nearest one by twice the straight way.
    places = mesh.positions[field.singular[odd]]
    away = np.linalg.norm(places[:, None] - places, axis=2) + 9 * np.eye(len(places))
    edges = np.linalg.norm(mesh.corners - np.roll(mesh.corners, -1, axis=1), axis=2)
    assert edges[jumps].sum() / 2 < 2 * away.min(axis=1).sum()


def test_a_field_of_one_sense_is_left_as_it_is() -> None:
    surface = one_island(sphere(6))
    field = direction_field(surface.mesh, "smooth")
    along, _ = triangle_frames(surface.mesh, field.corner_vectors)
    assert field.fold == 1
    assert not chart_turns(surface, along, field.fold).any()
