"""Edges of triangles: which are the same, what lies across, which are seams; normals and areas."""

import numpy as np
import pytest

from upholster.geometry.meshes.edge_pairs import edge_pairs, numbered_edges, seams_of
from upholster.geometry.meshes.triangle_mesh import TriangleMesh


def some_triangles(seed: int, vertices: int, count: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, vertices, (count, 3)).astype(np.int32)


@pytest.mark.parametrize(("vertices", "count"), [(9, 40), (200, 300), (5, 1)])
def test_edges_between_the_same_vertices_have_one_number(vertices: int, count: int) -> None:
    first = some_triangles(count, vertices, count).ravel()
    last = some_triangles(count + 1, vertices, count).ravel()
    first[::7] = -1
    numbers, examples = numbered_edges(first, last, vertices)
    counted = first >= 0
    assert (numbers[~counted] == -1).all()
    keys = np.sort(np.stack([first, last], axis=1), axis=1)[counted]
    _, at, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    which = which.reshape(-1)
    assert len(examples) == len(at)
    # The same number if and only if the vertices are the same; of each the first one is its example.
    pairs = np.unique(np.stack([numbers[counted], which], axis=1), axis=0)
    assert len(pairs) == len(at)
    np.testing.assert_array_equal(np.flatnonzero(counted)[at], examples[numbers[counted][at]])
    assert (np.diff(keys[:, 0][at[np.argsort(numbers[counted][at])]]) >= 0).all()


@pytest.mark.parametrize("seed", range(4))
def test_across_an_edge_lies_the_one_that_has_it_the_other_way_round(seed: int) -> None:
    triangles = some_triangles(seed, 14, 30)
    found = edge_pairs(np.random.default_rng(9).normal(size=(14, 3)), triangles).ravel()
    sides: dict[tuple[int, int], list[tuple[int, bool]]] = {}
    for n, (a, b, c) in enumerate(triangles.tolist()):
        if len({a, b, c}) == 3:
            for k, (p, q) in enumerate(((a, b), (b, c), (c, a))):
                sides.setdefault((min(p, q), max(p, q)), []).append((3 * n + k, p < q))
    alone = {3 * n + k for n in range(len(triangles)) for k in range(3)}
    for met in sides.values():
        if len(met) == 2 and met[0][1] != met[1][1]:
            assert (found[met[0][0]], found[met[1][0]]) == (met[1][0], met[0][0])
        elif len(met) > 2:
            up, down = ([n for n, rising in met if rising == way] for way in (True, False))
            paired = [n for n, _ in met if found[n] >= 0]
            assert len(paired) == 2 * min(len(up), len(down))
            assert all((found[n] in down) == (n in up) and found[found[n]] == n for n in paired)
        else:
            assert all(found[n] == -1 for n, _ in met)
        alone -= {n for n, _ in met}
    assert all(found[n] == -1 for n in alone)


def test_a_seam_is_where_places_of_both_sides_differ() -> None:
    rng = np.random.default_rng(3)
    rows, columns = (part.ravel() for part in np.mgrid[:6, :7])
    a = 8 * rows + columns
    triangles = np.concatenate([np.stack([a, a + 8, a + 9], 1), np.stack([a, a + 9, a + 1], 1)])
    grid = np.stack(np.mgrid[:7, :8], axis=-1).reshape(-1, 2).astype(float)
    across = edge_pairs(np.zeros((56, 3)), triangles.astype(np.int32))
    places, part = grid[triangles], rng.integers(-1, 3, len(triangles)).astype(np.int32)
    moved = rng.random(len(triangles)) < 0.2
    places[moved, rng.integers(0, 3, moved.sum())] += 0.5
    found = seams_of(across, places, part)
    for t, k in np.ndindex(found.shape):
        met, seam = across[t, k], False
        if met >= 0 and part[t] >= 0 and part[met // 3] >= 0:
            there = places[met // 3][[(met % 3 + 1) % 3, met % 3]]
            same = np.array_equal(places[t][[k, (k + 1) % 3]], there)
            seam = not same or part[t] != part[met // 3]
        assert found[t, k] == seam
    assert 20 < found.sum() < found.size / 2


def test_normals_and_areas_are_those_of_cross_products() -> None:
    rng = np.random.default_rng(5)
    positions, triangles = rng.normal(size=(40, 3)), some_triangles(6, 40, 200)
    triangles[:5, 1] = triangles[:5, 0]  # no area
    mesh = TriangleMesh(positions, triangles)
    normals, areas = mesh.flat_normals, mesh.areas
    a, b, c = positions[triangles].transpose(1, 0, 2)
    crossed = np.cross(b - a, c - a)
    length = np.linalg.norm(crossed, axis=1)
    np.testing.assert_array_equal(areas, 0.5 * length)
    whole = length > 0
    np.testing.assert_array_equal(normals[whole], crossed[whole] / length[whole, None])
    assert not normals[~whole].any()
    assert 5 <= (~whole).sum() < 50
