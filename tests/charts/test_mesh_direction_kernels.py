"""Kernels of direction fields on meshes against plain versions."""

import numpy as np
import scipy.sparse as sparse
from meshes import sphere, two_rings
from scipy.sparse.csgraph import connected_components

from upholster.charts.directions import direction_field
from upholster.charts.directions._kernels import (
    carry_from,
    corner_fans,
    near_by,
    nearest_triangles,
    regions,
)
from upholster.charts.directions.frames import plane_frames
from upholster.geometry import TriangleMesh


def cut_mesh():
    """Return a mesh whose flat sides are regions of their own, and which triangles lie across edges."""
    mesh = two_rings()
    return mesh, plane_frames(mesh, 40)


def test_regions_are_connected_components():
    mesh, frames = cut_mesh()
    t, edge = np.nonzero(frames.across >= 0)
    graph = sparse.csr_matrix((np.ones(len(t)), (t, frames.across[t, edge])), (len(mesh.triangles),) * 2)
    count, part = connected_components(graph, directed=False)
    out = np.empty(len(mesh.triangles), np.int32)
    assert regions(frames.across, out) == frames.parts == count == 14
    np.testing.assert_array_equal(out, part)


def plain_nearest(corners, point):
    """Return the least distance of a point from each triangle, by many points of it."""
    a, b = np.meshgrid(np.linspace(0, 1, 60), np.linspace(0, 1, 60))
    inside = a + b <= 1 + 1e-12
    weights = np.stack([1 - a - b, a, b])[:, inside]
    return np.linalg.norm(np.einsum("kn,tki->tni", weights, corners) - point, axis=2).min(axis=1)


def test_nearest_triangles_are_the_nearest():
    mesh = two_rings()
    corners = mesh.corners[:60]
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1) + 1e-9
    points = np.random.default_rng(1).uniform(-1, 6, (30, 3))
    found, away = np.zeros(30, np.int32), np.empty(30)
    nearest_triangles(corners, centres, radii, points, found, away)
    for n, point in enumerate(points):
        plain = plain_nearest(corners, point)
        np.testing.assert_allclose(away[n], plain.min(), atol=0.01)
        np.testing.assert_allclose(plain[found[n]], plain.min(), atol=0.01)


def test_surroundings_hang_together_and_end_at_creases():
    mesh, frames = cut_mesh()
    centres = mesh.corners.mean(axis=1)
    seeds = np.array([0, 1], np.int32)
    points = np.ascontiguousarray(centres[seeds])
    which, nearness = np.empty(len(centres), np.int32), np.empty(len(centres))
    near_by(frames.across, centres, seeds, points, 2.5, which, nearness)
    distance = np.linalg.norm(centres[:, None] - points, axis=2)
    reached = which >= 0
    assert (frames.part[reached] == frames.part[0]).all()
    np.testing.assert_array_equal(which[reached], distance[reached].argmin(axis=1))
    np.testing.assert_allclose(nearness[reached], 1 - distance[reached].min(axis=1) / 2.5)


def plain_carried(frames, seed, start, reached):
    """Return directions (T,) carried from a seed breadth first, then ten rounds of means of those beside."""
    z, order = np.zeros(len(reached), np.complex128), [seed]
    z[seed] = start

    def mean(t):
        total = 0
        for other, edge in zip(frames.across[t], frames.edges[t], strict=True):
            if other >= 0 and reached[other]:
                turn = frames.carried[edge]
                total += frames.weights[edge] * z[other] * (turn if other < t else turn.conj())
        return total / abs(total)

    for t in order:
        if t != seed:
            z[t] = mean(t)
        order += [o for o in frames.across[t] if o >= 0 and reached[o] and o not in order]
    for _ in range(10):
        for t in order[1:]:
            z[t] = mean(t)
    return z


def test_directions_are_carried_from_their_seeds():
    mesh = sphere(6)
    frames = plane_frames(mesh, None)
    centres = mesh.corners.mean(axis=1)
    seeds = np.array([3, 150], np.int32)
    points = np.ascontiguousarray(centres[seeds])
    which, nearness = np.empty(len(centres), np.int32), np.empty(len(centres))
    near_by(frames.across, centres, seeds, points, 1.2, which, nearness)
    start = np.exp(1j * np.array([0.3, 2.0]))
    z = np.zeros(len(centres), np.complex128)
    z[seeds] = start
    carry_from(
        frames.across, frames.edges, frames.carried, frames.weights, seeds, which, nearness, 0.25, z
    )  # fmt: skip
    for n, seed in enumerate(seeds):
        reached = (which == n) & (nearness > 0.25)
        assert reached.sum() > 10
        np.testing.assert_allclose(z[reached], plain_carried(frames, seed, start[n], reached)[reached])
    assert not z[nearness <= 0.25].any()


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


def test_fans_are_the_triangles_round_a_vertex_that_hang_together():
    mesh, frames = cut_mesh()
    joined = np.where(frames.across >= 0, mesh.neighbours, -1)
    fan = np.empty(mesh.triangles.shape, np.int32)
    count = corner_fans(joined, fan)
    # Flat sides are regions: a fan is what one of them has of a vertex.
    part = np.repeat(frames.part[:, None], 3, axis=1)
    pairs = np.unique(np.stack([mesh.triangles, part], axis=2).reshape(-1, 2), axis=0)
    assert count == len(pairs)
    for number in range(count):
        t, k = np.nonzero(fan == number)
        assert len(np.unique(mesh.triangles[t, k])) == len(np.unique(frames.part[t])) == 1
    whole = sphere(4)
    fan = np.empty(whole.triangles.shape, np.int32)
    assert corner_fans(whole.neighbours, fan) == len(whole.positions)


def test_corners_have_their_vertices_vectors_and_keep_to_their_side_of_a_crease():
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
