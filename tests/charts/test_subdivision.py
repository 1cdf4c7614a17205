"""Subdividing meshes: nothing gapes, nothing moves, no edge stays long."""

from dataclasses import replace

import numpy as np
import pytest
from tests.charts.meshes import box, on_charts, sphere
from tests.charts.plain_subdivision import PlainSubdivision

from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.subdivision import subdivided
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh


def flat_surface(mesh: TriangleMesh) -> ChartedSurface:
    """Return each triangle as an island of its own, laid out true to size."""
    a, b, c = mesh.corners.transpose(1, 0, 2)
    first = np.linalg.norm(b - a, axis=1)
    along = ((c - a) * (b - a)).sum(axis=1) / first
    up = 2 * mesh.areas / first
    zeros = np.zeros_like(first)
    flat = np.stack([np.stack([zeros, zeros], 1), np.stack([zeros, first], 1), np.stack([-up, along], 1)], 1)
    return on_charts(MeshSurface(mesh, np.arange(len(first)), flat))


@pytest.mark.parametrize("longest", [10.0, 0.4, 0.11])
def test_edges_are_short_and_area_and_parameters_stay(longest: float) -> None:
    mesh = box()
    surface = flat_surface(mesh)
    fine = subdivided(surface, np.tile([1.0, 0, 0], (len(mesh.triangles), 3, 1)), longest)
    small = fine.surface.mesh
    sides = np.linalg.norm(np.roll(small.corners, -1, axis=1) - small.corners, axis=2)
    assert sides.max() <= longest
    assert (small.neighbours >= 0).all()  # as watertight as the box was
    np.testing.assert_allclose(np.bincount(fine.parent, small.areas), mesh.areas)
    # Lengths on the islands are those in space.
    flat = np.roll(fine.surface.places, -1, axis=1) - fine.surface.places
    np.testing.assert_allclose(np.linalg.norm(flat, axis=2), sides, atol=1e-9)
    np.testing.assert_array_equal(fine.surface.chart, fine.parent)
    np.testing.assert_array_equal(fine.surface.across, small.neighbours)


def test_vectors_stay_of_unit_length_and_plain_triangles_are_left_out() -> None:
    mesh = sphere(6)
    vectors = np.cross([0, 0, 1.0], mesh.positions) + np.array([1e-3, 0, 0])
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    flat = flat_surface(mesh)
    chart = np.where(np.arange(len(flat.chart)) < 10, -1, flat.chart).astype(np.int32)
    surface = replace(flat, chart=chart)
    fine = subdivided(surface, vectors[mesh.triangles], 0.1)
    assert fine.parent.min() == 10
    np.testing.assert_allclose(np.linalg.norm(fine.vectors, axis=2), 1)
    again = subdivided(surface, vectors[mesh.triangles], 10.0)
    np.testing.assert_allclose(again.vectors, vectors[mesh.triangles][10:])


def test_what_is_narrow_is_cut_across() -> None:
    # A strip of 100 by 0.1, and a square beside its long edge.
    positions = np.array([[0.0, 0, 0], [100, 0, 0], [100, 0.1, 0], [0, 0.1, 0], [50, -50, 0]])
    mesh = TriangleMesh(positions, np.array([[0, 1, 2], [0, 2, 3], [1, 0, 4]], np.int32))
    fine = subdivided(flat_surface(mesh), np.tile([1.0, 0, 0], (3, 3, 1)), 2.0)
    small = fine.surface.mesh
    sides = np.linalg.norm(np.roll(small.corners, -1, axis=1) - small.corners, axis=2)
    assert sides.max() <= 2.0 * 1.04
    np.testing.assert_allclose(np.bincount(fine.parent, small.areas), mesh.areas)
    # 64 parts of each long edge; halving all edges would make 3^6 triangles of each.
    assert (np.bincount(fine.parent)[:2] == 127).all()
    border = small.neighbours < 0
    ends = np.stack([small.triangles, np.roll(small.triangles, -1, axis=1)], axis=2)[border]
    outline = np.linalg.norm(small.positions[ends[:, 0]] - small.positions[ends[:, 1]], axis=1).sum()
    np.testing.assert_allclose(outline, 100 + 0.2 + 2 * np.hypot(50, 50))  # no gap along what they share


@pytest.mark.parametrize("longest", [0.9, 0.35, 0.12])
def test_parts_are_those_cut_one_by_one_in_plain_python(longest: float) -> None:
    # Triangles of any shape, narrow ones as well, that share vertices.
    rng = np.random.default_rng(7)
    positions = rng.normal(size=(30, 3)) * (1, 1, 0.02)
    positions[:10] = positions[10:20] + rng.normal(size=(10, 3)) * 0.01
    triangles = np.array([rng.choice(30, 3, replace=False) for _ in range(40)], np.int32)
    triangles[:10, :2] = np.stack([np.arange(10), np.arange(10, 20)], axis=1)
    surface = flat_surface(TriangleMesh(positions, triangles))
    surface = replace(surface, places=rng.normal(size=(40, 3, 2)))
    vectors = rng.normal(size=(40, 3, 3))
    vectors /= np.linalg.norm(vectors, axis=2, keepdims=True)
    vectors[20:25, 1] = -vectors[20:25, 0]  # cancel halfway
    fine = subdivided(surface, vectors, longest)
    plain = PlainSubdivision(positions, longest)
    parts = [
        plain.parts((tuple(triangles[t].tolist()), np.column_stack([surface.places[t], vectors[t]])))
        for t in range(40)
    ]
    np.testing.assert_array_equal(fine.parent, np.repeat(np.arange(40), [len(own) for own in parts]))
    expected = np.concatenate(parts)
    np.testing.assert_array_equal(fine.surface.mesh.corners, expected[..., :3])
    np.testing.assert_array_equal(fine.surface.places, expected[..., 3:5])
    np.testing.assert_allclose(fine.vectors, expected[..., 5:], atol=1e-15)
    assert len(fine.surface.mesh.positions) == len(plain.positions)
