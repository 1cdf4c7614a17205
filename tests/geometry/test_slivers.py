"""Triangles of a face: few slivers, the same face."""

import itertools

import numpy as np

from upholster.geometry.cad.slivers import without_slivers
from upholster.geometry.meshes.edge_pairs import edge_pairs


def bent(uv):
    """A sheet that is bent a little, and its normals."""
    u, v = uv.T
    points = np.stack([u, v, 0.005 * u * u], axis=1)
    normals = np.stack([-0.01 * u, np.zeros_like(u), np.ones_like(u)], axis=1)
    return points, normals / np.linalg.norm(normals, axis=1)[:, None]


def halved_to_the_corner(times):
    """A square whose lower edge is long, with vertices beside it that come nearer and nearer to a corner."""
    near = [(4.0 / 2**k, 1e-4 / 1.5**k) for k in range(times)]
    uv = np.array([(0, 0), (8, 0), (8, 4), (0, 4), *near], float)
    line = [*range(4, 4 + times), 0]  # from right to left
    upper = [(3, b, a) for a, b in itertools.pairwise(line)]
    lower = [(0, b, a) for a, b in itertools.pairwise(line[:-1])]
    triangles = np.array([(1, 2, 4), (2, 3, 4), *upper, (0, 1, 4), *lower], np.int32)
    turned = signed(uv, triangles) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return uv, triangles


def signed(uv, triangles):
    a, b, c = uv[triangles].transpose(1, 0, 2)
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def heights(positions, triangles):
    corners = positions[triangles]
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    return doubled / longest**2


def border(triangles):
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    across = edge_pairs(np.zeros((triangles.max() + 1, 3)), triangles).T.ravel()
    return {tuple(side) for side in sides[across < 0].tolist()}


def test_vertices_beside_a_straight_edge_are_taken_out():
    uv, triangles = halved_to_the_corner(9)
    positions, normals = bent(uv)
    assert heights(positions, triangles).min() < 1e-3
    found = without_slivers(positions, normals, uv, triangles, 0.5)
    assert heights(positions, found).min() > 0.1
    assert (signed(uv, found) > 0).all()
    np.testing.assert_allclose(signed(uv, found).sum(), signed(uv, triangles).sum())
    assert border(found) == border(triangles)


def test_what_would_leave_the_face_stays():
    uv, triangles = halved_to_the_corner(9)
    positions, normals = bent(uv)
    found = without_slivers(positions, normals, uv, triangles, 1e-9)
    np.testing.assert_array_equal(found, triangles)


def test_a_flat_triangle_loses_its_longest_edge():
    uv = np.array([(0, 0), (2, 0), (1, 0.01), (1, -1)], float)
    positions, normals = bent(uv)
    found = without_slivers(positions, normals, uv, np.array([(0, 1, 2), (1, 0, 3)], np.int32), 0.1)
    assert {tuple(sorted(one)) for one in found.tolist()} == {(0, 2, 3), (1, 2, 3)}
    assert (signed(uv, found) > 0).all()


def test_good_triangles_stay():
    uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    positions, normals = bent(uv)
    triangles = np.array([(0, 1, 2), (0, 2, 3)], np.int32)
    np.testing.assert_array_equal(without_slivers(positions, normals, uv, triangles, 0.1), triangles)
