"""Direction fields on meshes: unit tangents, as asked where something is asked, smooth elsewhere."""

import json

import numpy as np
import pytest
from meshes import box, height_field, sphere, torus, two_rings

from upholster.base.errors import InputError
from upholster.charts.directions.direction import parse_direction
from upholster.charts.directions.field import default_direction, direction_field
from upholster.charts.directions.level_directions import laid_over, requested_at_corners, shading_normals
from upholster.charts.directions.strokes import parse_strokes, stroke_texts
from upholster.geometry.meshes.triangle_mesh import TriangleMesh


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
        field = direction_field(mesh, direction, symmetry=symmetry)
        assert field.face_vectors.shape == mesh.triangles.shape
        assert field.vectors.shape == mesh.positions.shape
        np.testing.assert_allclose(np.linalg.norm(field.face_vectors, axis=1), 1, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(field.vectors, axis=1), 1, atol=1e-12)
        assert abs(np.einsum("ij,ij->i", field.face_vectors, mesh.flat_normals)).max() < 1e-9


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 0, 1), (1, -2, 3)])
def test_an_axis_is_followed_with_its_sign(axis):
    mesh = sphere()
    axis = np.array(axis) / np.linalg.norm(axis)
    # Of the sphere, not of the facets, whose own normals ask for up to 2.8 degrees more or less.
    normals = mesh.corners.mean(axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    along = laid_over(axis - (normals @ axis)[:, None] * normals, normals, mesh.flat_normals)
    angle, length = off(mesh, direction_field(mesh, axis).face_vectors, along)
    assert np.average(angle < 5, weights=mesh.areas) > 0.98
    assert angle[length > 0.5].max() < 0.2


def test_level_runs_to_the_right_seen_from_outside():
    mesh = torus()
    found = direction_field(mesh).face_vectors
    angle, _ = off(mesh, found, np.cross((0, 0, 1), mesh.flat_normals))
    assert np.average(angle < 5, weights=mesh.areas) > 0.9
    turned = direction_field(mesh, "90").face_vectors
    np.testing.assert_allclose(turned, np.cross(found, mesh.flat_normals), atol=1e-12)


@pytest.mark.parametrize(("direction", "turned"), [("level", 0), ("30", 30), ("0,0,1", -90)])
def test_smooth_facets_are_asked_by_their_normals(direction, turned):
    mesh = sphere(6)
    asked = requested_at_corners(mesh, parse_direction(direction))
    rng = np.random.default_rng(1)
    shares = rng.dirichlet(np.ones(3), len(asked))[:, :, None]
    normals = (mesh.corners * shares).sum(axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    level = np.cross((0, 0, 1), normals)
    true = np.cos(np.radians(turned)) * level + np.sin(np.radians(turned)) * np.cross(level, normals)
    sloped = np.linalg.norm(level, axis=1) > 0.5
    angle, _ = off(mesh, (asked * shares).sum(axis=1), true)
    length = np.linalg.norm((asked * shares).sum(axis=1), axis=1)
    found = np.degrees(np.arccos(np.clip(np.cos(np.radians(angle)) / length, -1, 1)))
    assert found[sloped].max() < 4
    # By their own normals facets are off by more.
    plain, _ = off(mesh, np.cross((0, 0, 1), mesh.flat_normals), level)
    assert plain[sloped].max() > 8


@pytest.mark.parametrize("direction", ["level", "30", "1,2,3", "around:z"])
def test_corners_have_what_is_asked_there(direction):
    mesh = sphere(3)
    asked = requested_at_corners(mesh, parse_direction(direction))
    length = np.linalg.norm(asked, axis=2)
    found = direction_field(mesh, direction).corner_vectors
    cosine = np.abs(np.einsum("tki,tki->tk", found, asked)) / length
    assert cosine[length > 0.5].min() > 1 - 1e-9
    # Means of what the triangles about a vertex ask for are off by more.
    means = direction_field(mesh, direction).vectors[mesh.triangles]
    assert (np.abs(np.einsum("tki,tki->tk", means, asked)) / length)[length > 0.5].min() < 0.995


def test_strokes_are_asked_for_near_their_places():
    mesh = height_field(40)
    strokes = np.array([[(0.5, 0.5, 0.1 * np.sin(2.5) * np.cos(2)), (1, 2, 0)]])
    apart = np.linalg.norm(mesh.corners.mean(axis=1) - strokes[0, 0], axis=1) / mesh.size
    found = direction_field(mesh, "x", strokes=strokes).corner_vectors
    near, far = apart < 0.03, apart > 0.4
    assert near.any()
    np.testing.assert_allclose(found[near].mean(axis=(0, 1))[:2], np.array([1, 2]) / np.sqrt(5), atol=0.1)
    np.testing.assert_allclose(found[far], direction_field(mesh, "x").corner_vectors[far], atol=1e-6)


def test_a_stroke_goes_straight_on_over_what_can_be_unrolled():
    # A rod of few sides, long along z: unrolled it is a sheet, on which a stroke asks for one direction.
    # Projected on each side, its vector would turn about on the way round.
    sides, rows, radius = 6, 40, 0.05
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    positions = np.concatenate(
        [np.column_stack([ring, np.full(sides, height)]) for height in np.linspace(0, 4, rows)]
    )
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(sides), indexing="ij")
    a, b = (sides * i + j).ravel(), (sides * i + (j + 1) % sides).ravel()
    triangles = np.concatenate([np.stack([a, b, b + sides], 1), np.stack([a, b + sides, a + sides], 1)])
    mesh = TriangleMesh(positions, triangles.astype(np.int32))
    at = np.append(ring[:2].mean(axis=0), 2.0)
    outward = at * (1, 1, 0) / np.linalg.norm(at[:2])
    round_it = np.cross((0, 0, 1), outward)
    strokes = [[at, round_it + np.array((0, 0, 1))]]
    asked = direction_field(mesh, "z", strokes=strokes, crease=75).corner_vectors[:, 0]
    near = np.linalg.norm(mesh.corners.mean(axis=1) - at, axis=1) < 0.03 * mesh.size
    assert len(np.unique(np.arctan2(*mesh.flat_normals[near, 1::-1].T).round(3))) == sides
    along = np.stack([np.cross((0, 0, 1), mesh.flat_normals), np.tile((0.0, 0.0, 1.0), (len(triangles), 1))])
    np.testing.assert_allclose((along * asked).sum(axis=2)[:, near], np.sqrt(0.5), atol=1e-6)


def test_over_sharp_edges_each_side_is_asked_for_by_itself():
    cube = box()
    asked = requested_at_corners(cube, parse_direction("1,2,3"))
    np.testing.assert_allclose(asked, np.repeat(asked[:, :1], 3, axis=1), atol=1e-12)
    assert requested_at_corners(cube, parse_direction("smooth")) is None


def test_a_sheet_gets_the_plane_field():
    sheet = height_field(5)
    for direction in ("level", "smooth"):
        np.testing.assert_allclose(direction_field(sheet, direction).face_vectors @ (1, 0, 0), 1, atol=0.01)
    cube = box()
    lid = cube.flat_normals[:, 2] > 0.5
    assert (direction_field(cube, crease=40).face_vectors[lid] @ (1, 0, 0)).min() > 0.99


@pytest.mark.parametrize(
    ("mesh", "direction", "options", "words"),
    [
        (sphere(3), "sideways", {}, "sideways"),
        (sphere(3), "u", {}, "on patches u and v as well"),
        (sphere(3), "0,0,0", {}, "not zero"),
        (sphere(3), np.zeros((4, 3)), {}, "shape"),
        (sphere(3), lambda points: points[:1], {}, "shape"),
        (sphere(3), lambda points: points * np.nan, {}, "not finite"),
        (height_field(3), "z", {}, "nowhere along"),
        (sphere(3), "z", {"symmetry": 3}, "1, 2 or 4"),
        (sphere(3), "z", {"crease": 200}, "crease"),
    ],
)
def test_what_is_wrong_is_reported_in_a_line(mesh, direction, options, words):
    with pytest.raises(InputError, match=words):
        direction_field(mesh, direction, **options)


def test_odd_meshes_get_directions():
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0), (0, -1, 0), (0, 0, 1), (5, 5, 5)], float)
    triangles = [(0, 1, 2), (0, 1, 3), (1, 0, 4), (0, 1, 5), (4, 4, 4), (2, 0, 5)]
    mesh = TriangleMesh(points, np.array(triangles))
    for direction in ("level", "smooth", "x"):
        field = direction_field(mesh, direction)
        np.testing.assert_allclose(np.linalg.norm(field.face_vectors, axis=1), 1, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(field.vectors, axis=1), [1] * 6 + [0], atol=1e-12)


DEGENERATE = {
    "two triangles on a line with the same edges": (
        [(2, 0, 1), (1, 0, 1), (0, 0, 1), (2, 0, 0), (0, -1, 1)],
        [(0, 2, 3), (0, 1, 2), (2, 0, 4), (2, 1, 0)],
    ),
    "two triangles back to back": ([(0, 1, 1), (0, 0, 1), (1, 0, 0)], [(0, 1, 2), (0, 2, 1)]),
    "one of four points, three of which coincide": (
        [(2, 0, 0), (2, 1, 0), (1, 2, 0), (2, 0, 0), (2, 0, 0)],
        [(4, 0, 2), (4, 3, 0), (3, 1, 2)],
    ),
    "one triangle": ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]),
    "one without area": ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)]),
    "points": (
        [(1, 0, 0), (1, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)],
        [(0, 1, 2), (2, 1, 0), (0, 3, 4)],
    ),
}


@pytest.mark.parametrize("name", DEGENERATE)
@pytest.mark.filterwarnings("error")
def test_flat_faces_without_a_border_or_an_area_get_directions(name):
    points, triangles = DEGENERATE[name]
    mesh = TriangleMesh(np.array(points, float), np.array(triangles))
    for direction in ("level", "smooth", "edges", "curvature"):
        field = direction_field(mesh, direction)
        np.testing.assert_allclose(np.linalg.norm(field.corner_vectors, axis=2), 1, atol=1e-6)


@pytest.mark.parametrize(
    ("mesh", "euler"), [(sphere(8), 2), (torus(10, 20), 0), (two_rings(), -2), (box(), 2)]
)
@pytest.mark.parametrize("symmetry", [1, 2, 4])
def test_indices_sum_up_to_eulers_characteristic(mesh, euler, symmetry):
    assert (mesh.neighbours >= 0).all()
    for direction in ("smooth", "level", "1,2,3"):
        field = direction_field(mesh, direction, symmetry=symmetry)
        assert field.fold >= symmetry
        assert field.index.sum(dtype=int) == field.fold * euler
        assert (field.index[field.singular] != 0).all()


def test_an_axis_has_its_singular_points_at_the_poles():
    field = direction_field(sphere(8), "z")
    np.testing.assert_allclose(np.abs(field.places[:, 2]), 1, atol=0.2)
    assert field.words == "2 singular points: 2 of +1"
    assert direction_field(height_field(4)).words == "no singular points"
    assert direction_field(sphere(8), "smooth", symmetry=4).words == "8 singular points: 8 of +1/4"


def plain_jumps(field):
    """Return by how many quarter turns vectors differ from those over each edge, unfolded there."""
    mesh = field.mesh
    jumps = np.zeros(mesh.triangles.shape, int)
    for t, row in enumerate(mesh.neighbours):
        for edge, met in enumerate(row):
            if met >= 0:
                along = mesh.corners[t, (edge + 1) % 3] - mesh.corners[t, edge]
                angles = []
                for one in (t, met // 3):
                    vector, across = field.face_vectors[one], np.cross(mesh.flat_normals[one], along)
                    angles.append(np.arctan2(vector @ across, vector @ along))
                jumps[t, edge] = round((angles[1] - angles[0]) * field.fold / (2 * np.pi)) % field.fold
    return jumps * 4 // field.fold


@pytest.mark.parametrize("symmetry", [1, 2, 4])
def test_jumps_are_those_of_vectors_unfolded(symmetry):
    mesh = sphere(5)
    field = direction_field(mesh, "smooth", symmetry=symmetry)
    np.testing.assert_array_equal(field.jumps, plain_jumps(field))
    # A texture with the field's symmetry shows none of them; one without shows them all.
    assert not (field.jumps * symmetry % 4).any()
    assert field.jumps.any() == (symmetry > 1)
    # Combed: jumps end at singular points, and are few.
    assert np.count_nonzero(field.jumps) < 0.25 * field.jumps.size


def test_curvature_runs_round_a_tube():
    mesh = torus(30, 90, radius=4.0)
    field = direction_field(mesh, "curvature")
    centres = mesh.corners.mean(axis=1)
    ring = centres * (1, 1, 0) / np.linalg.norm(centres[:, :2], axis=1)[:, None]
    round_tube = np.cross(np.cross((0, 0, 1), ring), mesh.flat_normals)
    angle, _ = off(mesh, field.face_vectors, round_tube)
    assert field.fold == 2
    assert np.minimum(angle, 180 - angle).max() < 5
    assert len(field.singular) == 0


def test_edges_are_followed_or_crossed():
    for mesh, axes in ((box(), np.eye(3)), (two_rings(), np.eye(3)), (height_field(6), np.eye(3))):
        for crease in (None, 40):
            field = direction_field(mesh, "edges", crease=crease)
            assert field.fold == 4
            assert np.abs(field.face_vectors @ axes).max(axis=1).min() > np.cos(np.radians(5))


def test_strokes_are_followed_and_the_rest_is_smooth():
    mesh = height_field(24, 0.1)
    strokes = np.array([[(0.1, 0.1, 0), (1, 0, 0)], [(0.9, 0.9, 0), (0, 1, 0)]])
    strokes[:, 0, 2] = 0.1 * np.sin(5 * strokes[:, 0, 0]) * np.cos(4 * strokes[:, 0, 1])
    field = direction_field(mesh, strokes=strokes)
    centres = mesh.corners.mean(axis=1)
    for at, along in strokes:
        near = np.linalg.norm(centres - at, axis=1) < 0.02
        assert near.any()
        assert off(mesh, field.face_vectors, along)[0][near].max() < 5
    assert len(field.singular) == 0
    middle = np.linalg.norm(centres[:, :2] - 0.5, axis=1) < 0.05
    assert off(mesh, field.face_vectors, np.array((1, 1, 0)))[0][middle].max() < 20
    fine = direction_field(height_field(80), strokes="0.5,0.5,0:1,2,0")
    assert (fine.face_vectors @ (1, 2, 0)).min() > 5**0.5 * np.cos(np.radians(1))
    over_x = direction_field(mesh, "x", strokes=strokes[1:])
    assert off(mesh, over_x.face_vectors, strokes[1, 1])[0][near].max() < 5
    assert off(mesh, over_x.face_vectors, strokes[0, 1])[0][middle].max() < 1


@pytest.mark.slow(reason="lays quilts on every kind of surface")
@pytest.mark.parametrize("direction", ["level", "z", "around:y"])
def test_a_stroke_is_followed_as_far_as_is_asked(direction):
    mesh = sphere(40)
    at, along = np.array([[0.6, -0.6, 0.53], [0.1, 1.0, 1.0]])
    at = at / np.linalg.norm(at)
    field = direction_field(mesh, direction, strokes=[[at, along]])
    away = np.linalg.norm(mesh.corners.mean(axis=1) - at, axis=1) / mesh.size
    near, far = away < 0.045, (away > 0.2) & (np.abs(mesh.corners.mean(axis=1)) < 0.9).all(axis=1)
    assert near.sum() > 8
    assert off(mesh, field.face_vectors, along)[0][near].max() < 5
    without = direction_field(mesh, direction)
    cosine = (field.face_vectors * without.face_vectors).sum(axis=1)
    assert np.median(cosine[far]) > np.cos(np.radians(1))


def test_strokes_are_read_from_texts_files_and_arrays(tmp_path):
    array = np.array([[(0, 0.5, 1e-3), (1, 0, 0)], [(1, 1, 0), (0, -2, 0.5)]])
    texts = ["0,0.5,1e-3:1,0,0", "1,1,0:0,-2,.5"]
    objects, lists = tmp_path / "objects.json", tmp_path / "lists.json"
    objects.write_text(json.dumps([{"at": at, "along": along} for at, along in array.tolist()]))
    lists.write_text(json.dumps(array.tolist()))
    for written in (texts, str(objects), [lists], array, array.tolist()):
        np.testing.assert_array_equal(parse_strokes(written, size=1.0), array)


@pytest.mark.parametrize(
    ("written", "words"),
    [
        ("1,2,3", "stroke is '1,2,3'; allowed"),
        ("0,0,0:0,0,0", "zero"),
        ("0,0,1e300:1,0,0", "finite"),
        ([], "0 strokes"),
        (np.zeros((2, 3)), "shape"),
        ("none.json", "none.json"),
        ("0,0,7:1,0,0", "from the surface"),
    ],
)
def test_wrong_strokes_are_reported_in_a_line(written, words):
    with pytest.raises(InputError, match=words):
        direction_field(sphere(4), strokes=written)


def test_a_stroke_at_right_angles_to_the_surface_is_refused():
    with pytest.raises(InputError, match=r"stroke at \(1.4, 0.9, 1\) is at right angles"):
        direction_field(box(), strokes=["1.4,0.9,1:0,0,3", "1,1,1:1,0,0"])


@pytest.mark.parametrize("text", ["{", '{"at": 1}', "[1]", '[{"at": [0, 0, 1]}]', "[[[0, 0, 1], [1, 0]]]"])
def test_wrong_files_of_strokes_are_reported_in_a_line(tmp_path, text):
    path = tmp_path / "strokes.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"strokes\.json"):
        parse_strokes(path, size=1.0)


def test_a_missing_file_of_strokes_is_named(tmp_path):
    with pytest.raises(InputError, match=r"^file '.*none\.json' does not exist; allowed: "):
        parse_strokes(tmp_path / "none.json", size=1.0)


def test_a_line_is_followed_round_its_curve():
    # Three quarters of a circle on a hilly sheet: near it rows run round its middle.
    mesh, radius = height_field(60), 0.3
    angles = np.radians(np.linspace(0, 270, 28))
    line = np.stack([0.5 + radius * np.cos(angles), 0.5 + radius * np.sin(angles)], axis=1)
    line = np.column_stack([line, 0.1 * np.sin(5 * line[:, 0]) * np.cos(4 * line[:, 1])])
    field = direction_field(mesh, strokes="/".join(",".join(map(repr, at)) for at in line.tolist()))
    to = mesh.corners.mean(axis=1)[:, :2] - 0.5
    turned = np.arctan2(to[:, 1], to[:, 0]) % (2 * np.pi)
    near = (np.abs(np.hypot(*to.T) - radius) < 0.02) & (turned > 0.1) & (turned < np.radians(260))
    degrees, _ = off(mesh, field.face_vectors, np.column_stack([-to[:, 1], to[:, 0], 0 * turned]))
    assert near.sum() > 300
    assert np.quantile(degrees[near], 0.95) < 6


def test_lines_become_strokes_a_hundredth_of_the_model_apart(tmp_path):
    line, path = [[0, 0, 0], [0, 0, 0], [0.25, 0, 0], [0.25, 0.001, 0]], tmp_path / "lines.json"
    path.write_text(json.dumps([{"line": line}, {"at": [1, 1, 0], "along": [0, 1, 0]}]))
    found = parse_strokes(path, size=5.0)
    np.testing.assert_allclose(found[:5, 0, 0], 0.025 + 0.05 * np.arange(5))
    np.testing.assert_allclose(found[5], [(0.25, 0.0005, 0), (0, 0.001, 0)])
    np.testing.assert_allclose(found[6], [(1, 1, 0), (0, 1, 0)])
    texts = stroke_texts([str(path)])
    np.testing.assert_array_equal(parse_strokes(texts, size=5.0), found)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ([[0, 0, 0]], "at least two points"),
        ([[0, 0, 0], [0, 0, 0]], "at least two points"),
        ([[0, 0, 0], [1, 0]], r"shape \(n, 3\)"),
        ([[0, 0, 0], [0, 0, 1e300]], "not finite numbers"),
        ([[0, 0, 0], [0, 0, 1e6]], r"1e\+06 times as long as the model; allowed: 10000 strokes"),
        ("abc", "not finite numbers"),
    ],
)
def test_wrong_lines_are_reported_in_a_line(tmp_path, line, words):
    path = tmp_path / "lines.json"
    path.write_text(json.dumps([{"line": line}]))
    with pytest.raises(InputError, match=rf"strokes .*lines\.json: .*{words}"):
        parse_strokes(path, size=1.0)


def test_a_line_far_from_the_surface_is_refused():
    with pytest.raises(InputError, match="from the surface"):
        direction_field(sphere(4), strokes="0,0,1/0,0,7")


def test_arrays_and_functions_are_followed():
    mesh = torus()
    wanted = np.cross((0, 0, 1), mesh.positions)
    for direction in (wanted, lambda points: np.cross((0, 0, 1), points), "around:z"):
        field = direction_field(mesh, direction)
        assert off(mesh, field.face_vectors, np.cross((0, 0, 1), mesh.corners.mean(axis=1)))[0].max() < 2


def test_vertices_have_what_their_triangles_have():
    mesh = torus()
    for symmetry in (1, 4):
        field = direction_field(mesh, "around:z", symmetry=symmetry)
        mean = np.zeros(mesh.positions.shape)
        for corner in range(3):
            np.add.at(mean, mesh.triangles[:, corner], field.face_vectors)
        mean /= np.linalg.norm(mean, axis=1, keepdims=True)
        assert np.einsum("ij,ij->i", mean, field.vectors).min() > 0.99


def test_the_order_of_triangles_and_the_units_do_not_matter():
    mesh = sphere(8)
    field = direction_field(mesh, "1,2,3", symmetry=2)
    order = np.random.default_rng(0).permutation(len(mesh.triangles))
    mixed = TriangleMesh(1000 * mesh.positions, np.roll(mesh.triangles[order], 1, axis=1))
    other = direction_field(mixed, "1,2,3", symmetry=2)
    cosine = np.abs(np.einsum("ij,ij->i", field.face_vectors[order], other.face_vectors))
    assert np.mean(cosine > 0.999) > 0.97
    np.testing.assert_array_equal(direction_field(mesh, "1,2,3", symmetry=2).vectors, field.vectors)


def test_the_smoothest_field_is_turned_to_be_most_like_level():
    mesh = height_field(12, 0.3)
    tilted = TriangleMesh(
        mesh.positions @ np.linalg.qr([[3.0, 1, 2], [1, 2, 0], [0, 1, 2]])[0], mesh.triangles
    )
    field = direction_field(tilted, "smooth")
    level = np.cross((0, 0, 1), tilted.flat_normals)
    turned = np.cross(tilted.flat_normals, field.face_vectors)
    like, unlike = (np.einsum("t,ti,ti->", tilted.areas, one, level) for one in (field.face_vectors, turned))
    assert like > 0
    assert abs(unlike) < 0.05 * like


def test_legs_of_few_facets_are_asked_as_round_ones() -> None:
    for sides, crease, smooth in ((7, None, True), (5, None, False), (7, 40.0, False)):
        angle = 2 * np.pi * np.arange(sides) / sides
        ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        low, high = np.arange(sides), sides + np.arange(sides)
        triangles = np.concatenate(
            [
                np.stack([low, np.roll(low, -1), high], axis=1),
                np.stack([np.roll(low, -1), np.roll(high, -1), high], axis=1),
            ]
        )
        leg = TriangleMesh(np.concatenate([ring, 0.6 * ring + (0, 0, 2)]), triangles)
        normals = shading_normals(leg, crease)
        first = normals.reshape(-1, 3)[np.unique(triangles, return_index=True)[1]]
        assert np.allclose(normals, first[triangles]) == smooth


def test_open_land_has_smooth_directions_and_other_meshes_level_ones() -> None:
    assert default_direction(height_field(12, 0.1)) == "smooth"
    assert default_direction(sphere(8)) == "level"
    # A low house has more area flat than upright, and is level; a floor is smooth.
    assert default_direction(box((30.0, 30.0, 5.5))) == "level"
    assert default_direction(box((30.0, 30.0, 1.0))) == "smooth"
    assert default_direction(height_field(4)) == "smooth"
    # On a ring that lies level lines close; on one that stands they end, and those round its girth close.
    lying = torus()
    assert default_direction(lying) == "level"
    assert default_direction(TriangleMesh(lying.positions[:, [2, 0, 1]], lying.triangles)) == "curvature"
    land = height_field(16, 0.1)
    np.testing.assert_array_equal(
        direction_field(land).face_vectors, direction_field(land, "smooth").face_vectors
    )
