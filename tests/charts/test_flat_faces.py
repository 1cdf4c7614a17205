"""One direction on each flat face that ends sharply: lids, heads of bolts, caps."""

import numpy as np
import pytest
from meshes import box, grid, height_field, sphere, torus
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from upholster.charts.creases import CREASE
from upholster.charts.directions.field import direction_field
from upholster.charts.directions.flats import flat_faces
from upholster.charts.directions.frames import plane_frames
from upholster.geometry.meshes.triangle_mesh import TriangleMesh, welded

TURN = np.radians(20.0)
ASKEW = np.array([[np.cos(TURN), np.sin(TURN), 0], [-np.sin(TURN), np.cos(TURN), 0], [0, 0, 1]])
"""Rows are where x, y and z of a shape go: along its edges is not along x."""


def hull(points: np.ndarray, turned: np.ndarray = ASKEW) -> TriangleMesh:
    """Return the convex hull of points round the origin, turned, seen from outside."""
    triangles = ConvexHull(points).simplices
    inward = np.linalg.det(points[triangles]) < 0
    triangles[inward] = triangles[inward, ::-1]
    return TriangleMesh(points @ turned, triangles.astype(np.int32))


def askew(mesh: TriangleMesh, turned: np.ndarray = ASKEW) -> TriangleMesh:
    return TriangleMesh(mesh.positions @ turned, mesh.triangles)


def column(sides: int, top: float = 1.0) -> TriangleMesh:
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return hull(np.concatenate([np.insert(ring, 2, -3, axis=1), np.insert(top * ring, 2, 3, axis=1)]))


def chamfered(width: float = 0.1) -> TriangleMesh:
    """Return a box of 6 × 4 × 2 with edges cut off."""
    signs = np.stack(np.meshgrid(*3 * [(-1, 1)]), axis=-1).reshape(-1, 1, 3)
    return hull((signs * (np.array((3.0, 2.0, 1.0)) - width * (1 - np.eye(3)))).reshape(-1, 3))


def rounded(radius: float = 0.2) -> TriangleMesh:
    """Return a box of 3 × 2 × 1 with round edges of many facets."""
    mesh = box((3.0, 2.0, 1.0), 60)
    half = np.array((1.5, 1.0, 0.5))
    points = mesh.positions - half
    inner = np.clip(points, radius - half, half - radius)
    off = points - inner
    return TriangleMesh(
        (inner + radius * off / np.linalg.norm(off, axis=1, keepdims=True)) @ ASKEW, mesh.triangles
    )


def cushion(width: float = 3.0) -> TriangleMesh:
    """Return a domed box with round edges, `width` × 2 × 1."""
    mesh = rounded()
    points = mesh.positions @ ASKEW.T * (width / 3, 1.0, 1.0)
    points[:, 2] *= 1 + 0.3 * (1 - (2 * points[:, 0] / width) ** 2) * (1 - points[:, 1] ** 2)
    return TriangleMesh(points @ ASKEW, mesh.triangles)


def tube(sides: int = 48, inner: float = 0.5) -> TriangleMesh:
    """Return a thick ring: flat above and below, round outside and inside."""
    angle = 2 * np.pi * np.arange(sides) / sides
    profile = np.array([(1.0, 0.3), (inner, 0.3), (inner, -0.3), (1.0, -0.3)])
    points = [(r * np.cos(a), r * np.sin(a), z) for a in angle for r, z in profile]
    return TriangleMesh(np.array(points), grid(sides, 4, wrap=(True, True)))


def ell() -> TriangleMesh:
    """Return a plate like an L, 6 long and 4 wide, its arms 2 wide and 1 thick."""
    cells = [(x, y) for x in range(6) for y in range(4) if y < 2 or x < 2]
    corners = np.array([(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    tops = [np.add(corners, (x, y, 0)) for x, y in cells]
    sides = []
    for x, y in cells:
        for (a, b), (i, j) in zip(
            ((0, 1), (1, 2), (2, 3), (3, 0)), ((0, -1), (1, 0), (0, 1), (-1, 0)), strict=True
        ):
            if (x + i, y + j) not in cells:
                first, last = np.add(corners[[a, b]], (x, y, 0))
                sides.append([first - (0, 0, 1), last - (0, 0, 1), last, first])
    quads = np.concatenate([tops, [(top - (0, 0, 1))[::-1] for top in tops], sides])
    positions, vertex = welded(quads.reshape(-1, 3))
    quads = vertex.reshape(-1, 4)
    return TriangleMesh(positions @ ASKEW, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))


def facing(mesh: TriangleMesh, way: np.ndarray) -> np.ndarray:
    return mesh.flat_normals @ np.asarray(way) > 0.9999


def one(vectors: np.ndarray) -> np.ndarray:
    """Return the one direction that vectors have, as a line."""
    vectors = vectors.reshape(-1, 3)
    np.testing.assert_allclose(vectors, vectors[:1].repeat(len(vectors), 0), atol=1e-3)
    return vectors[0]


def along(found: np.ndarray, *ways: np.ndarray) -> bool:
    return bool(max(abs(found @ way) for way in ways) > 1 - 1e-6)


@pytest.mark.parametrize("crease", [None, CREASE])
@pytest.mark.parametrize(
    "mesh", [askew(box()), chamfered(), rounded(), ell()], ids=["box", "chamfers", "rounded", "ell"]
)
def test_lids_run_along_their_longest_edges_and_walls_level(mesh, crease):
    field = direction_field(mesh, crease=crease)
    for way in (1, -1):
        assert along(one(field.corner_vectors[facing(mesh, (0, 0, way))]), ASKEW[0])
    for wall in ASKEW[:2]:
        found = one(field.corner_vectors[facing(mesh, wall)])
        np.testing.assert_allclose(found, np.cross((0, 0, 1), wall), atol=1e-3)


@pytest.mark.parametrize("direction", ["level", "smooth", None])
def test_the_head_of_a_bolt_runs_along_one_of_its_sides(direction):
    mesh = column(6)
    found = one(direction_field(mesh, direction, crease=CREASE).corner_vectors[facing(mesh, (0, 0, 1))])
    angle = np.radians(30 + 60 * np.arange(6))
    assert along(found, *(np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1) @ ASKEW))


@pytest.mark.parametrize("mesh", [column(64), tube()], ids=["disc", "ring"])
def test_round_caps_run_straight_by_default(mesh):
    cap = facing(mesh, (0, 0, 1))
    for direction, lattice in (("level", False), ("smooth", False), ("around:z", True)):
        one(direction_field(mesh, direction, crease=CREASE, lattice=lattice).corner_vectors[cap])
    found = direction_field(mesh, "around:z", crease=CREASE).corner_vectors[cap]
    round_it = np.cross((0, 0, 1), mesh.corners[cap])
    far = np.linalg.norm(round_it, axis=2) > 0.4
    round_it /= np.maximum(np.linalg.norm(round_it, axis=2, keepdims=True), 1e-12)
    assert abs((found * round_it).sum(axis=2))[far].min() > 0.99


@pytest.mark.parametrize("sides", [8, 64])
def test_columns_are_level(sides):
    mesh = column(sides)
    upright = abs(mesh.flat_normals[:, 2]) < 0.01
    assert abs(direction_field(mesh, crease=CREASE).corner_vectors[upright][..., 2]).max() < 1e-6


def test_a_gable_keeps_its_level_rows():
    # Its roof is steep: along it rows would lean by 70 degrees.
    outline = np.array([(-1, -1), (1, -1), (1, 0), (0, 3), (-1, 0)], float)
    mesh = hull(np.concatenate([np.insert(outline, 1, y, axis=1) for y in (-2, 2)]))
    field = direction_field(mesh, crease=CREASE)
    assert abs(one(field.corner_vectors[facing(mesh, ASKEW[1])])[2]) < 1e-6


def test_on_a_box_that_lies_aslant_level_gives_way():
    axes = Rotation.from_euler("xyz", (20, 30, 40), degrees=True).as_matrix()
    mesh = askew(box(), axes)
    field = direction_field(mesh, "level", crease=CREASE)
    for side in (*axes, *-axes):
        found = one(field.corner_vectors[facing(mesh, side)])
        longest = axes[min(k for k in range(3) if abs(axes[k] @ side) < 0.5)]
        assert along(found, longest)
    vector = direction_field(mesh, "0,0,1", crease=CREASE).face_vectors
    upward = np.array((0, 0, 1)) - mesh.flat_normals[:, 2:] * mesh.flat_normals
    np.testing.assert_allclose(vector, upward / np.linalg.norm(upward, axis=1, keepdims=True), atol=1e-3)


def test_where_a_vector_says_nothing_the_walls_go_on():
    mesh = askew(box())
    found = one(direction_field(mesh, "z", crease=CREASE).corner_vectors[facing(mesh, (0, 0, 1))])
    assert along(found, ASKEW[1])


def test_vectors_functions_and_strokes_win_over_faces():
    mesh = askew(box())
    lid = facing(mesh, (0, 0, 1))
    wanted = np.array((1.0, 2.0, 0.0)) / np.sqrt(5)
    for asked in ("1,2,0", lambda points: np.broadcast_to(wanted, points.shape)):
        assert along(one(direction_field(mesh, asked, crease=CREASE).corner_vectors[lid]), wanted)
    middle = mesh.corners[lid].mean(axis=1)[0]
    drawn = direction_field(mesh, "level", strokes=[[middle, wanted]], crease=CREASE)
    near = np.linalg.norm(mesh.corners.mean(axis=1) - middle, axis=1) < 0.05 * mesh.size
    assert (drawn.face_vectors[lid & near] @ wanted).min() > 0.99
    assert (drawn.face[lid] < 0).all()
    turned = direction_field(mesh, "30", crease=CREASE).corner_vectors[lid]
    assert abs(abs(one(turned) @ ASKEW[0]) - np.cos(np.radians(30))) < 1e-6


def test_what_is_round_has_no_flat_faces_but_its_caps():
    for mesh, count in (
        (sphere(), 0),
        (sphere(60), 0),
        (torus(), 0),
        (height_field(20, 0.3), 0),
        (column(7, top=0.6), 2),
        (column(64), 2),
        (tube(), 2),
        (rounded(), 6),
        (height_field(3), 1),
    ):
        assert flat_faces(mesh, plane_frames(mesh, None)).max() + 1 == count
    rough = height_field(40)
    bent = np.random.default_rng(0).normal(scale=5e-5, size=len(rough.positions))
    rough = TriangleMesh(rough.positions + bent[:, None] * (0, 0, 1), rough.triangles)
    assert (flat_faces(rough, plane_frames(rough, None)) == 0).all()


def test_the_top_of_a_cushion_has_one_direction():
    mesh = cushion()
    top = mesh.flat_normals[:, 2] > np.cos(np.radians(15))
    assert (flat_faces(mesh, plane_frames(mesh, None))[top] < 0).all()  # it is domed
    field = direction_field(mesh, "level", crease=CREASE)
    assert (field.face[top] == field.face[top][0]).all()
    assert field.face[top][0] >= 0
    assert np.abs(field.face_vectors[top] @ ASKEW[0]).min() > 0.96


def test_round_tops_and_long_ones_follow_level_lines():
    flat = sphere(40)
    for mesh in (
        TriangleMesh(flat.positions * (1.0, 1.0, 0.4), flat.triangles),
        cushion(12.0),
        sphere(),
    ):
        top = mesh.flat_normals[:, 2] > 0.9
        assert (direction_field(mesh, "level", crease=CREASE).face[top] < 0).all()


def test_the_order_of_triangles_does_not_matter():
    mesh = rounded()
    order = np.random.default_rng(1).permutation(len(mesh.triangles))
    mixed = TriangleMesh(mesh.positions, np.roll(mesh.triangles[order], 1, axis=1))
    lid = facing(mesh, (0, 0, 1))
    first, second = direction_field(mesh).face_vectors, direction_field(mixed).face_vectors
    np.testing.assert_allclose(second[facing(mixed, (0, 0, 1))][0], first[lid][0], atol=1e-9)
