"""Triangle meshes and surfaces made of them: what meets, what is refused."""

import numpy as np
import pytest
from tests.charts.meshes import on_charts

from upholster.base.errors import InputError
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh, welded


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


def test_of_three_triangles_at_an_edge_the_two_in_one_plane_go_on() -> None:
    positions = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)], float)
    three = TriangleMesh(positions, np.array([(0, 1, 2), (1, 0, 3), (0, 1, 4)]))
    np.testing.assert_array_equal(three.neighbours[:, 0], [3, 0, -1])
    assert (three.neighbours[:, 1:] == -1).all()
    same_way = TriangleMesh(positions, np.array([(0, 1, 2), (0, 1, 3)]))
    assert (same_way.neighbours == -1).all()
    three_same_way = TriangleMesh(positions, np.array([(0, 1, 2), (0, 1, 3), (0, 1, 4)]))
    assert (three_same_way.neighbours == -1).all()


def fan(degrees: list[float], rising: list[bool], turn: np.ndarray) -> TriangleMesh:
    """Return triangles round one edge, at angles seen along it; `rising` ones have their inside below."""
    a = np.radians(degrees)
    points = np.stack([np.cos(a), np.sin(a), np.full(len(a), 0.3)], axis=1)
    positions = np.concatenate([[(0, 0, 0), (0, 0, 1)], points]) @ turn.T
    ends = [(0, 1) if up else (1, 0) for up in rising]
    return TriangleMesh(positions, np.array([(*end, n + 2) for n, end in enumerate(ends)]))


@pytest.mark.parametrize(
    ("degrees", "rising", "paired"),
    [
        ([0, 180, 90, 270], [True, False, True, False], [1, 0, 3, 2]),  # two planes that cross
        ([90, 0, 270, 180], [True, False, True, False], [1, 0, 3, 2]),  # two cubes that touch
        ([10, 190, 10, 190], [True, False, False, True], [1, 0, 3, 2]),  # a sheet with two sides
        ([0, 10, 180], [True, True, False], [2, -1, 0]),
        ([0, 170, 200, 20, 90], [True, False, False, True, False], [1, 0, 3, 2, -1]),
    ],
)
def test_surfaces_go_straight_through_an_edge_of_several(
    degrees: list[float], rising: list[bool], paired: list[int]
) -> None:
    turns, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3, 3)))
    for turn in [np.eye(3), *(m * np.linalg.det(m) for m in turns)]:
        across = fan(degrees, rising, turn).neighbours[:, 0]
        np.testing.assert_array_equal(np.where(across >= 0, across // 3, -1), paired)


def test_pairs_at_many_edges_are_mutual_and_opposed() -> None:
    rng = np.random.default_rng(7)
    edge = rng.integers(0, 9, 60)
    rising = rng.random(60) < 0.5
    positions = np.concatenate([rng.normal(size=(18, 3)), rng.normal(size=(60, 3))])
    ends = np.stack([2 * edge + rising, 2 * edge + ~rising], axis=1)
    mesh = TriangleMesh(positions, np.column_stack([ends, 18 + np.arange(60)]))
    across = mesh.neighbours[:, 0]
    assert (mesh.neighbours[:, 1:] == -1).all()
    paired = np.flatnonzero(across >= 0)
    np.testing.assert_array_equal(across[across[paired] // 3] // 3, paired)
    np.testing.assert_array_equal(edge[across[paired] // 3], edge[paired])
    assert (rising[across[paired] // 3] != rising[paired]).all()
    for number in range(9):
        own = np.flatnonzero(edge == number)
        assert (across[own] >= 0).sum() == 2 * min(rising[own].sum(), (~rising[own]).sum())
        # The flattest of all possible pairs is one of them.
        cosine = mesh.flat_normals[own] @ mesh.flat_normals[own].T
        cosine[rising[own][:, None] == rising[own]] = -2
        a, b = np.unravel_index(cosine.argmax(), cosine.shape)
        assert across[own[a]] == 3 * own[b] or cosine.max() == -2


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
    assert not on_charts(whole, 1.0).is_seam.any()
    moved = flat[mesh.triangles]
    moved[1] += 3
    cut = MeshSurface(mesh, np.array([0, 0]), moved)
    np.testing.assert_array_equal(on_charts(cut, 1.0).is_seam, mesh.neighbours >= 0)
    np.testing.assert_array_equal(cut.boxes, [[(0, 0), (4, 4)]])
    assert not on_charts(MeshSurface(mesh, np.array([0, -1]), moved), 1.0).is_seam.any()


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
