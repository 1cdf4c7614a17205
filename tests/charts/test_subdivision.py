"""Subdividing meshes: nothing gapes, nothing moves, no edge stays long."""

from dataclasses import replace

import numpy as np
import pytest
from tests.charts.meshes import box, on_charts, sphere

from upholster.charts.charted import ChartedSurface
from upholster.charts.subdivision import subdivided
from upholster.geometry import MeshSurface, TriangleMesh


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
