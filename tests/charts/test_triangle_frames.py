"""Axes on triangles, beside plain NumPy."""

import numpy as np

from upholster.charts.mesh_warp_fields import triangle_frames
from upholster.geometry.meshes.triangle_mesh import TriangleMesh


def test_axes_lie_in_the_triangles_planes_at_right_angles() -> None:
    rng = np.random.default_rng(1)
    positions = rng.normal(size=(30, 3))
    triangles = np.array([rng.choice(30, 3, replace=False) for _ in range(50)], np.int32)
    mesh, vectors = TriangleMesh(positions, triangles), rng.normal(size=(50, 3, 3))
    vectors[:4] = mesh.flat_normals[:4, None]  # no part in the plane
    along, down = triangle_frames(mesh, vectors)
    mean, normals = vectors.mean(axis=1), mesh.flat_normals
    expected = mean - (mean * normals).sum(axis=1, keepdims=True) * normals
    expected[:4] = (mesh.corners[:, 1] - mesh.corners[:, 0])[:4]
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_array_equal(along, expected)
    np.testing.assert_array_equal(down, np.cross(along, normals))
    np.testing.assert_allclose((along * normals).sum(axis=1), 0, atol=1e-12)
