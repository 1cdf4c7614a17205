"""Triangle meshes and surfaces made of them: what meets, what is refused."""

import numpy as np
import pytest

from upholster.errors import InputError
from upholster.geometry import MeshSurface, TriangleMesh, welded


def tetrahedron() -> TriangleMesh:
    positions = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    return TriangleMesh(positions, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]))


def test_neighbours_share_their_edge_the_other_way_round() -> None:
    mesh = tetrahedron()
    assert (mesh.neighbours >= 0).all()
    for triangle, row in enumerate(mesh.neighbours):
        for edge, across in enumerate(row):
            other, met = divmod(int(across), 3)
            mine = mesh.triangles[triangle][[edge, (edge + 1) % 3]]
            assert (mine == mesh.triangles[other][[(met + 1) % 3, met]]).all()
            assert mesh.neighbours[other, met] == 3 * triangle + edge


def test_an_edge_of_three_triangles_and_one_run_the_same_way_have_no_neighbours() -> None:
    positions = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)], float)
    three = TriangleMesh(positions, np.array([(0, 1, 2), (1, 0, 3), (0, 1, 4)]))
    assert (three.neighbours == -1).all()
    same_way = TriangleMesh(positions, np.array([(0, 1, 2), (0, 1, 3)]))
    assert (same_way.neighbours == -1).all()


def test_areas_normals_and_size_are_those_of_the_tetrahedron() -> None:
    mesh = tetrahedron()
    np.testing.assert_allclose(mesh.areas, [0.5, 0.5, 3**0.5 / 2, 0.5])
    np.testing.assert_allclose(mesh.flat_normals.T @ mesh.areas, 0, atol=1e-15)
    assert mesh.size == pytest.approx(3**0.5)


def test_welding_keeps_the_order_and_joins_equal_places_alone() -> None:
    positions, vertex = welded([(1, 0, 0), (0, 0, 0), (1, 0, 0), (0.0, -0.0, 0), (1, 0, 1e-300)])
    np.testing.assert_array_equal(positions, [(1, 0, 0), (0, 0, 0), (1, 0, 1e-300)])
    np.testing.assert_array_equal(vertex, [0, 1, 0, 1, 2])


def test_seams_are_where_parameters_differ() -> None:
    positions = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (0, -1, 0)], float)
    mesh = TriangleMesh(positions, np.array([(0, 3, 2), (0, 2, 1)]))
    flat = np.stack([-positions[:, 1], positions[:, 0]], axis=1)
    whole = MeshSurface(mesh, np.zeros(2), flat[mesh.triangles])
    assert not whole.is_seam.any()
    moved = flat[mesh.triangles]
    moved[1] += 3
    cut = MeshSurface(mesh, np.array([0, 0]), moved)
    np.testing.assert_array_equal(cut.is_seam, mesh.neighbours >= 0)
    np.testing.assert_array_equal(cut.boxes, [[(0, 0), (4, 4)]])
    assert not MeshSurface(mesh, np.array([0, -1]), moved).is_seam.any()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"triangles": np.zeros((0, 3), int)}, "triangles have shape"),
        ({"triangles": np.array([(0, 1, 4)])}, "allowed: 0 to 3"),
        ({"positions": np.full((4, 3), np.nan)}, "not finite"),
        ({"part": np.array([0, 0, 0, 1])}, "part has shape"),
        ({"uv": np.zeros((4, 3, 3))}, "uv have shape"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(change: dict[str, np.ndarray], message: str) -> None:
    mesh = tetrahedron()
    with pytest.raises(InputError, match=message):
        TriangleMesh(**({"positions": mesh.positions, "triangles": mesh.triangles} | change))


def test_islands_that_do_not_fit_are_refused() -> None:
    mesh = tetrahedron()
    with pytest.raises(InputError, match="numbered"):
        MeshSurface(mesh, np.array([0, 0, 2, 0]), np.zeros((4, 3, 2)))
    with pytest.raises(InputError, match="shape"):
        MeshSurface(mesh, np.zeros(3), np.zeros((4, 3, 2)))
    with pytest.raises(InputError, match="finite"):
        MeshSurface(mesh, np.zeros(4), np.full((4, 3, 2), np.inf))
