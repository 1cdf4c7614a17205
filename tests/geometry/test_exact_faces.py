"""CAD faces written as rational Bézier patches: the same surfaces, whatever form the file has."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from upholster.base.errors import InputError
from upholster.geometry.cad.exact_body import exact_body
from upholster.geometry.cad.exact_face import exact_face
from upholster.geometry.cad.spans import arc_axis, curve_segments, spline_segments
from upholster.geometry.occt.records import BodyRecord, CurveRecord, FaceRecord, SurfaceRecord
from upholster.geometry.patches.patch import RationalPatch


def bezier(points, t):
    """One curve's points at parameters, by the project's own patches."""
    net = np.repeat(points[:, None], 2, axis=1)
    return RationalPatch(net).points(t, np.zeros_like(t))


@pytest.mark.parametrize("degree", [1, 2, 3, 6, 13])
def test_segments_of_a_spline_are_the_spline(degree):
    rng = np.random.default_rng(degree)
    inner = np.sort(rng.uniform(0, 1, 6))
    inner[3] = inner[2]  # a double knot
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    poles = rng.normal(size=(len(knots) - degree - 1, 4))
    poles[:, 3] = rng.uniform(0.5, 2, len(poles))
    points, axis = spline_segments(degree, knots, poles, 0.0, 1.0)
    at = rng.uniform(0, 1, 200)
    wanted = BSpline(knots, poles, degree)(at)
    places = axis.places(at)
    number = np.floor(places).astype(int)
    for k in range(len(points)):
        mine = number == k
        found = bezier(points[k], places[mine] - k)
        np.testing.assert_allclose(found, wanted[mine, :3] / wanted[mine, 3:], atol=1e-10)


def test_only_the_needed_segments_are_cut():
    knots = np.arange(12.0)  # uniform: no knot is multiple
    poles = np.random.default_rng(1).normal(size=(8, 3))
    points, axis = spline_segments(3, knots, poles, 4.2, 5.9)
    assert axis.breaks.tolist() == [4, 5, 6]
    curve = BSpline(knots, poles, 3)
    np.testing.assert_allclose(points[0, 0], curve(4.0), atol=1e-12)
    np.testing.assert_allclose(points[1, -1], curve(6.0), atol=1e-12)


def test_arcs_keep_the_angle_as_their_parameter():
    ellipse = CurveRecord("arc", np.array([[1.0, 2, 3, 1], [2, 0, 0, 0], [0, 0.5, 0, 0]]))
    found = curve_segments(ellipse, -0.4, 5.1, 2 * np.pi)
    at = np.linspace(-0.4, 5.1, 50)
    for shift in (0.0, 2 * np.pi):  # one turn on is the same place
        places = found.axis.places(at + shift)
        number = np.clip(np.floor(places).astype(int), 0, len(found.points) - 1)
        got = [
            bezier(found.points[k], np.array([place - k]))[0] for k, place in zip(number, places, strict=True)
        ]
        wanted = np.stack([1 + 2 * np.cos(at), 2 + 0.5 * np.sin(at), np.full(50, 3.0)], axis=1)
        np.testing.assert_allclose(got, wanted, atol=1e-12)
    step = 1e-6
    slope = (found.axis.places(at + step) - found.axis.places(at - step)) / (2 * step)
    inside = np.abs(found.axis.places(at) % 1 - 0.5) < 0.49
    np.testing.assert_allclose(found.axis.rates(at)[inside], slope[inside], rtol=1e-6)


def torus(u0, u1, v0, v1, uv=None, triangles=None):
    circle = CurveRecord("arc", np.array([[3.0, 0, 0, 1], [1, 0, 0, 0], [0, 0, 1, 0]]))
    surface = SurfaceRecord("revolution", np.array([[0.0, 0, 0], [0, 0, 2]]), circle, period=(2 * np.pi,) * 2)
    return FaceRecord(kind="torus", box=(u0, u1, v0, v1), surface=surface)


def grid_triangles(u, v):
    """Parameters and triangles of a grid."""
    uv = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    first = (np.arange(len(u) - 1)[:, None] * len(v) + np.arange(len(v) - 1)).ravel()
    right, down = first + 1, first + len(v)
    return uv, np.concatenate([np.stack([first, down, right], 1), np.stack([right, down, down + 1], 1)])


def test_a_torus_is_exact_in_points_normals_and_area():
    face = exact_face(torus(0, 2 * np.pi, 0.5, 2 * np.pi + 0.5))
    assert (face.face.rows, face.face.columns) == (4, 4)
    uv, triangles = grid_triangles(np.linspace(0, 2 * np.pi, 40), np.linspace(0.5, 2 * np.pi + 0.5, 40))
    points, normals = face.frames(uv)
    u, v = uv.T
    out = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=1)
    np.testing.assert_allclose(points, out + 3 * np.stack([np.cos(u), np.sin(u), 0 * u], axis=1), atol=1e-12)
    np.testing.assert_allclose(normals, out, atol=1e-9)
    assert face.area(uv, triangles) == pytest.approx(4 * np.pi**2 * 3, rel=1e-4)


def test_planes_extrusions_and_splines_are_exact():
    plane = SurfaceRecord("plane", np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]))
    face = exact_face(FaceRecord(box=(-1, 2, 0, 5), surface=plane))
    np.testing.assert_allclose(face.frames(np.array([[0.3, 4.0]]))[0], [[1, 0.3, 4]])
    line = CurveRecord("line", np.array([[0.0, 0, 0, 1], [1, 0, 0, 0]]))
    drawn = SurfaceRecord("extrusion", np.array([[0.0, 1, 0]]), line)
    points, normals = exact_face(FaceRecord(box=(0, 1, -2, 2), surface=drawn)).frames(np.array([[0.25, 1.5]]))
    np.testing.assert_allclose(points, [[0.25, 1.5, 0]])
    np.testing.assert_allclose(normals, [[0, 0, 1]])
    rng = np.random.default_rng(3)
    u, v = np.array([0, 0, 0, 1, 2, 2, 2.0]), np.array([0, 0, 0, 0, 1, 1, 1, 1.0])
    net = np.dstack([rng.normal(size=(4, 4, 3)), np.ones((4, 4))])
    spline = SurfaceRecord("spline", degrees=(2, 3), knots_u=u, knots_v=v, net=net)
    face = exact_face(FaceRecord(box=(0, 2, 0, 1), surface=spline))
    assert (face.face.rows, face.face.columns) == (2, 1)
    at = rng.uniform(0, 1, (30, 2)) * (2, 1)
    wanted = np.stack(
        [BSpline(v, BSpline(u, net[..., :3], 2)(a), 3)(b) for a, b in at],
    )
    np.testing.assert_allclose(face.frames(at)[0], wanted, atol=1e-12)


def test_vertices_inside_faces_are_put_on_the_patches():
    record = torus(0, 1, 0, 1)
    record.uv, record.triangles = grid_triangles(np.linspace(0, 1, 3), np.linspace(0, 1, 3))
    record.vertices = np.arange(9)
    true = exact_face(record).frames(record.uv)[0]
    body = BodyRecord("ring", faces=[record], positions=true + 0.001, rim=np.arange(9) != 4)
    found = exact_body(body, 0.01)
    np.testing.assert_allclose(found.positions[4], true[4], atol=1e-12)
    np.testing.assert_allclose(found.positions[0], true[0] + 0.001)
    assert found.problems == [""]
    record.reversed = True
    np.testing.assert_allclose(exact_body(body, 0.01).normals[0], -found.normals[0])


def test_a_face_whose_patches_do_not_fit_is_taken_as_it_is():
    record = torus(0, 1, 0, 1)
    record.uv, record.triangles = grid_triangles(np.linspace(0, 1, 3), np.linspace(0, 1, 3))
    record.vertices = np.arange(9)
    far = exact_face(record).frames(record.uv)[0] + 5.0
    found = exact_body(BodyRecord("ring", faces=[record], positions=far, rim=np.zeros(9, bool)), 0.01)
    assert found.faces == [None]
    assert "from where Open CASCADE has it" in found.problems[0]
    np.testing.assert_array_equal(found.positions, far)
    assert found.areas[0] > 0
    np.testing.assert_allclose(np.linalg.norm(found.normals[0], axis=1), 1.0)


def test_what_is_no_surface_is_refused():
    with pytest.raises(InputError, match="unknown kind"):
        exact_face(FaceRecord(box=(0, 1, 0, 1)))
    with pytest.raises(InputError, match="no extent"):
        exact_face(torus(0, 0, 0, 1))
    with pytest.raises(InputError, match="knots"):
        spline_segments(2, np.arange(4.0), np.zeros((4, 3)), 0, 1)
    assert len(arc_axis(0, 2 * np.pi, 2 * np.pi).breaks) == 5
