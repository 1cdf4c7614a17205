"""Axes on triangles, and the triangles at each vertex, beside plain NumPy."""

import numpy as np

from upholster.charts._mesh_sampling_kernels import corner_lists, fill_nodes
from upholster.charts.mesh_warp_fields import triangle_frames
from upholster.geometry import TriangleMesh


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


def test_each_vertex_lists_its_triangles_in_order() -> None:
    triangles = np.random.default_rng(2).integers(0, 12, (40, 3)).astype(np.int32)
    triangles[triangles == 5] = 6  # a vertex of none
    first, listed = np.empty(13, np.int64), np.empty(120, np.int32)
    corner_lists(triangles, first, listed)
    assert (first[0], first[-1]) == (0, 120)
    for v in range(12):
        np.testing.assert_array_equal(listed[first[v] : first[v + 1]], np.nonzero(triangles == v)[0])


def plain_around(array: np.ndarray) -> np.ndarray:
    """Return sums over the eight places beside each."""
    padded = np.pad(array, ((1, 1), (1, 1), (0, 0)))
    rows, columns = array.shape[:2]
    shifts = [(i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)]
    return np.asarray(sum(padded[i : i + rows, j : j + columns] for i, j in shifts))


def plain_filled(sums: np.ndarray, shape: tuple[int, int], size: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrices of a chart's nodes (n, 4), and which of them are means of what is near."""
    sums = sums.reshape(*shape, 7)
    weight = sums[..., 4]
    known = weight > 0
    mean = sums[..., :4] / np.where(known, weight, 1.0)[..., None]
    determinant = mean[..., 0] * mean[..., 3] - mean[..., 1] * mean[..., 2]
    known &= determinant > 0.02 * size * size
    # Means of matrices that turn are too small.
    true = sums[..., 5] / np.where(sums[..., 4] > 0, sums[..., 4], 1.0)
    mean *= np.where(known, np.sqrt(true / np.where(known, determinant, 1.0)), 0.0)[..., None]
    means = known.copy()
    if not known.any():
        mean[..., 0] = mean[..., 3] = size
        known[:] = True
    while not known.all():
        total, count = plain_around(mean), plain_around(known[..., None].astype(np.float64))
        new = ~known & (count[..., 0] > 0)
        mean[new] = total[new] / count[new]
        determinant = mean[..., 0] * mean[..., 3] - mean[..., 1] * mean[..., 2]
        flat = new & (determinant <= 0.02 * size * size)
        mean[flat] = (size, 0.0, 0.0, size)
        known |= new
    return mean.reshape(-1, 4), means.ravel()


def test_nodes_without_means_take_those_beside_them() -> None:
    rng, shapes = np.random.default_rng(3), [(9, 14), (1, 1), (4, 2), (6, 6)]
    counts = [rows * columns for rows, columns in shapes]
    firsts = np.cumsum([0, *counts[:-1]])
    sums = np.zeros((sum(counts), 7))
    sums[:, 4] = rng.uniform(0.1, 3, len(sums))
    sums[:, :4] = sums[:, 4:5] * (np.array([1, 0, 0, 1]) + rng.normal(0, 0.5, (len(sums), 4)))
    sums[:, 5] = sums[:, 4] * rng.uniform(1, 2, len(sums))
    sums[rng.random(len(sums)) < 0.8] = 0.0
    sums[firsts[2] : firsts[3]] = 0.0  # nothing is near
    sizes = rng.uniform(0.5, 2, 4)
    where = np.column_stack([firsts, shapes]).astype(np.int64)
    nodes, rounds = np.full((len(sums), 4), np.nan), np.empty(len(sums), np.int32)
    fill_nodes(sums, where, sizes, nodes, rounds)
    for first, count, shape, size in zip(firsts, counts, shapes, sizes, strict=True):
        own = slice(first, first + count)
        matrices, means = plain_filled(sums[own], shape, size)
        np.testing.assert_allclose(nodes[own], matrices, rtol=1e-14, atol=1e-15)
        np.testing.assert_array_equal(rounds[own] == 0, means)
    assert rounds.max() >= 2
