"""Edges over which directions start anew where nobody says at which angle."""

import numpy as np
import pytest
from meshes import box, height_field, sphere
from scipy.spatial import ConvexHull

from upholster.charts.creases import CREASE, default_crease
from upholster.charts.directions.field import direction_field
from upholster.geometry.meshes.corner_normals import corner_normals
from upholster.geometry.meshes.triangle_mesh import TriangleMesh


def hull(points: np.ndarray) -> TriangleMesh:
    """Return the convex hull of points round the origin, seen from outside."""
    triangles = ConvexHull(points).simplices
    inward = np.linalg.det(points[triangles]) < 0
    triangles[inward] = triangles[inward, ::-1]
    return TriangleMesh(points, triangles.astype(np.int32))


def chamfered(width: float = 0.1) -> TriangleMesh:
    """Return a box of 6 × 4 × 2 with edges cut off."""
    signs = np.stack(np.meshgrid(*3 * [(-1, 1)]), axis=-1).reshape(-1, 1, 3)
    return hull((signs * (np.array((3.0, 2.0, 1.0)) - width * (1 - np.eye(3)))).reshape(-1, 3))


def column(sides: int) -> TriangleMesh:
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return hull(np.concatenate([np.insert(ring, 2, z, axis=1) for z in (-3, 3)]))


@pytest.mark.parametrize(
    "mesh",
    [box(), sphere(2), sphere(), height_field(7, 0.5), column(12), column(64)],
    ids=["box", "rough ball", "ball", "land", "twelve sides", "round"],
)
def test_what_has_no_chamfers_goes_on_over_slighter_bends(mesh):
    assert default_crease(mesh) == CREASE


def test_the_lid_of_a_box_with_chamfers_runs_straight():
    mesh = chamfered()
    assert default_crease(mesh) == 30.0
    lid = mesh.flat_normals[:, 2] > 0.99
    straight = direction_field(mesh, crease=default_crease(mesh))
    np.testing.assert_allclose(abs(straight.corner_vectors[lid][..., 0]), 1, atol=0.01)
    assert not len(straight.singular)


def test_a_column_of_eight_sides_is_level_on_all():
    mesh = column(8)
    assert default_crease(mesh) == 30.0  # its edges are as those of chamfers: that must do no harm
    upright = abs(mesh.flat_normals[:, 2]) < 0.01
    field = direction_field(mesh, crease=default_crease(mesh))
    assert abs(field.corner_vectors[upright][..., 2]).max() < 1e-6


def test_normals_of_the_file_tell_what_is_smooth():
    mesh = column(8)
    smooth = TriangleMesh(mesh.positions, mesh.triangles, normals=corner_normals(mesh, 60.0))
    assert default_crease(smooth) == CREASE
