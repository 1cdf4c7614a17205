"""Direction fields on meshes against plain versions: regions, indices, corners."""

import numpy as np
import scipy.sparse as sparse
from meshes import sphere, two_rings
from scipy.sparse.csgraph import connected_components

from upholster.charts.directions.field import direction_field
from upholster.charts.directions.frames import plane_frames
from upholster.geometry.meshes.triangle_mesh import TriangleMesh


def cut_mesh():
    """Return a mesh whose flat sides are regions of their own, and which triangles lie across edges."""
    mesh = two_rings()
    return mesh, plane_frames(mesh, 40)


def test_regions_are_connected_components():
    mesh, frames = cut_mesh()
    t, edge = np.nonzero(frames.across >= 0)
    graph = sparse.csr_matrix((np.ones(len(t)), (t, frames.across[t, edge])), (len(mesh.triangles),) * 2)
    count, part = connected_components(graph, directed=False)
    assert frames.parts == count == 14
    np.testing.assert_array_equal(frames.part, part)


def plain_index(field, vertex):
    """Return how often a field turns round a vertex, in turns: triangle by triangle, laid out flat there."""
    mesh = field.mesh
    t = int(np.flatnonzero((mesh.triangles == vertex).any(axis=1))[0])
    first, total = t, 2 * np.pi
    while True:
        k = mesh.triangles[t].tolist().index(vertex)
        point, right, left = np.roll(mesh.corners[t], -k, axis=0)
        one, two = ((end - point) / np.linalg.norm(end - point) for end in (right, left))
        total -= np.arccos(one @ two)
        met = mesh.neighbours[t, (k + 2) % 3]
        angles = []
        for one in (t, met // 3):
            vector, across = field.face_vectors[one], np.cross(mesh.flat_normals[one], left - point)
            angles.append(np.arctan2(vector @ across, vector @ (left - point)))
        part = 2 * np.pi / field.fold
        total += (angles[1] - angles[0] + part / 2) % part - part / 2
        t = met // 3
        if t == first:
            return total / (2 * np.pi)


def test_indices_are_turns_round_vertices():
    mesh = sphere(4)
    for symmetry in (1, 2, 4):
        field = direction_field(mesh, "smooth", symmetry=symmetry)
        plain = [plain_index(field, vertex) * symmetry for vertex in range(len(mesh.positions))]
        np.testing.assert_allclose(field.index, plain, atol=1e-3)


def test_slivers_carry_directions_as_their_plane_does():
    points = np.array([(0, 0, 0), (1, 0, 0), (2, 1e-7, 0), (3, 0, 0), (1.5, 1, 0), (1.5, -1, 0), (1, 0, 0)])
    triangles = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 5, 1), (1, 5, 3), (1, 3, 2), (1, 6, 1)]
    field = direction_field(TriangleMesh(points, np.array(triangles)), "smooth")
    assert np.abs(field.face_vectors[2:6, 2]).max() < 1e-6
    assert np.einsum("i,ji->j", field.face_vectors[2], field.face_vectors[3:6]).min() > np.cos(np.radians(2))


def test_corners_keep_to_their_side_of_a_crease():
    mesh = sphere(5)
    for symmetry in (1, 2, 4):
        field = direction_field(mesh, "smooth", symmetry=symmetry)
        along = field.vectors[mesh.triangles]
        cosine = np.einsum("tki,tki->tk", field.corner_vectors, along)
        turns = np.degrees(np.arccos(np.clip(cosine, -1, 1))) % (360 // symmetry)
        assert np.minimum(turns, 360 // symmetry - turns).max() < 1e-3
        near = np.einsum("tki,ti->tk", field.corner_vectors, field.face_vectors)
        assert near.min() > np.cos(np.pi / symmetry) - 0.1
    mesh, _ = cut_mesh()
    field = direction_field(mesh, "1,2,3", crease=40)
    off_plane = np.einsum("tki,ti->tk", field.corner_vectors, mesh.flat_normals)
    assert np.abs(off_plane).max() < 1e-12
    np.testing.assert_allclose(
        np.einsum("tki,ti->tk", field.corner_vectors, field.face_vectors), 1, atol=1e-6
    )
