"""Direction fields on meshes: unit tangents, as asked where something is asked, smooth elsewhere."""

import numpy as np
import pytest
from meshes import box, height_field, sphere, torus

from upholster.charts.mesh_directions import mesh_directions
from upholster.errors import InputError
from upholster.geometry import TriangleMesh


def off(mesh, found, wanted):
    """Return degrees between vectors at triangles and wanted ones' projections, and the latter's length."""
    normals = mesh.flat_normals
    wanted = np.broadcast_to(wanted, normals.shape)
    along = wanted - np.einsum("ij,ij->i", wanted, normals)[:, None] * normals
    length = np.linalg.norm(along, axis=1)
    cosine = np.einsum("ij,ij->i", found, along) / np.maximum(length, 1e-12)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1))), length


@pytest.mark.parametrize("direction", ["level", "smooth", "x", "around:z", "1,2,3", "30"])
@pytest.mark.parametrize("symmetry", [1, 2, 4])
def test_vectors_are_unit_tangents(direction, symmetry):
    for mesh in (sphere(6), torus(8, 15), height_field(7, 0.2), box()):
        field = mesh_directions(mesh, direction, symmetry=symmetry)
        assert field.face_vectors.shape == mesh.triangles.shape
        assert field.vectors.shape == mesh.positions.shape
        np.testing.assert_allclose(np.linalg.norm(field.face_vectors, axis=1), 1, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(field.vectors, axis=1), 1, atol=1e-12)
        assert abs(np.einsum("ij,ij->i", field.face_vectors, mesh.flat_normals)).max() < 1e-9


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 0, 1), (1, -2, 3)])
def test_an_axis_is_followed_with_its_sign(axis):
    mesh = sphere()
    angle, length = off(mesh, mesh_directions(mesh, axis).face_vectors, np.array(axis) / np.linalg.norm(axis))
    assert np.average(angle < 5, weights=mesh.areas) > 0.98
    assert angle[length > 0.5].max() < 1


def test_level_runs_to_the_right_seen_from_outside():
    mesh = torus()
    found = mesh_directions(mesh).face_vectors
    angle, _ = off(mesh, found, np.cross((0, 0, 1), mesh.flat_normals))
    assert np.average(angle < 5, weights=mesh.areas) > 0.9
    turned = mesh_directions(mesh, "90").face_vectors
    np.testing.assert_allclose(turned, np.cross(found, mesh.flat_normals), atol=1e-12)


def test_a_sheet_gets_the_plane_field_and_the_lid_of_a_box_runs_along_x():
    sheet = height_field(5)
    for direction in ("level", "smooth"):
        np.testing.assert_allclose(mesh_directions(sheet, direction).face_vectors @ (1, 0, 0), 1, atol=0.01)
    cube = box()
    lid = cube.flat_normals[:, 2] > 0.5
    assert (mesh_directions(cube, crease=40).face_vectors[lid] @ (1, 0, 0)).min() > 0.99


@pytest.mark.parametrize(
    ("mesh", "direction", "options", "words"),
    [
        (sphere(3), "sideways", {}, "sideways"),
        (sphere(3), "u", {}, "allowed on a mesh"),
        (sphere(3), "0,0,0", {}, "not zero"),
        (sphere(3), np.zeros((4, 3)), {}, "shape"),
        (sphere(3), lambda points: points[:1], {}, "shape"),
        (sphere(3), lambda points: points * np.nan, {}, "not finite"),
        (height_field(3), "z", {}, "nowhere along"),
        (sphere(3), "z", {"symmetry": 3}, "1, 2 or 4"),
        (sphere(3), "z", {"crease": 200}, "crease"),
    ],
)
def test_what_is_wrong_is_told_in_a_line(mesh, direction, options, words):
    with pytest.raises(InputError, match=words):
        mesh_directions(mesh, direction, **options)


def test_odd_meshes_get_directions():
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0), (0, -1, 0), (0, 0, 1), (5, 5, 5)], float)
    triangles = [(0, 1, 2), (0, 1, 3), (1, 0, 4), (0, 1, 5), (4, 4, 4), (2, 0, 5)]
    mesh = TriangleMesh(points, np.array(triangles))
    for direction in ("level", "smooth", "x"):
        field = mesh_directions(mesh, direction)
        np.testing.assert_allclose(np.linalg.norm(field.face_vectors, axis=1), 1, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(field.vectors, axis=1), [1] * 6 + [0], atol=1e-12)
