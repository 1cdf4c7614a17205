"""Pictures of direction fields: lines along them, dots at singular points."""

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.charts.directions.field import direction_field
from upholster.geometry.meshes.triangle_mesh import TriangleMesh, welded
from upholster.model.render._direction_kernels import DrawnField, trace_lines
from upholster.model.render.directions import directions_picture, going_on
from upholster.runtime.parallel import running


def sheet(count=6):
    y, x = (s.ravel() for s in np.mgrid[: count + 1, : count + 1] / count)
    i, j = (s.ravel() for s in np.mgrid[:count, :count])
    a, b, c, d = ((i + di) * (count + 1) + j + dj for di, dj in ((0, 0), (0, 1), (1, 1), (1, 0)))
    return np.stack([x, y, 0 * x], axis=1), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def octahedron():
    points = np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)
    top = [(k, (k + 1) % 4, 4) for k in range(4)]
    return TriangleMesh(points, np.array(top + [(b, a, 5) for a, b, _ in top]))


def test_lines_run_straight_over_a_sheet_to_its_border():
    points, triangles = sheet()
    field = direction_field(TriangleMesh(points, triangles), (3, 1, 0), symmetry=4)
    mesh = field.mesh
    starts = mesh.corners.mean(axis=1)
    seeds = np.arange(len(starts), dtype=np.int32)
    lines, counts = np.zeros((len(starts), 60, 3)), np.zeros(len(starts), np.int32)
    turns = np.zeros(len(starts), np.int32)
    drawn = DrawnField(mesh.corners, mesh.neighbours, field.face_vectors, field.jumps)
    trace_lines(drawn, seeds, starts, turns, 5.0, lines, counts)
    ends = lines[np.arange(len(starts)), counts - 1]
    np.testing.assert_allclose(np.abs(ends[:, :2] - 0.5).max(axis=1), 0.5, atol=1e-9)
    way = ends - starts
    cosine = np.einsum("ij,ij->i", way, field.face_vectors) / np.linalg.norm(way, axis=1)
    np.testing.assert_allclose(cosine, 1, atol=1e-6)
    short = np.zeros_like(lines)
    trace_lines(drawn, seeds, starts, turns, 0.01, short, counts)
    lengths = np.linalg.norm(short[np.arange(len(starts)), counts - 1] - starts, axis=1)
    np.testing.assert_allclose(lengths, 0.01, atol=1e-9)


def test_a_picture_has_lines_and_dots():
    field = direction_field(octahedron(), "z")
    assert len(field.singular) == 2
    picture = directions_picture(field, size=(200, 150), view=(20, 50)).astype(int)
    assert picture.shape == (150, 200, 3)
    red = (picture[..., 0] > 180) & (picture[..., 1] < 90)
    blue = (picture[..., 2] - picture[..., 0]) > 40
    assert 40 < np.count_nonzero(red) < 150  # the upper of two points; the other is hidden
    assert np.count_nonzero(blue) > 100
    rows, columns = np.nonzero(red)
    assert columns.mean() == pytest.approx(100, abs=15)
    assert rows.mean() < 75


def test_no_option_out_of_range():
    field = direction_field(octahedron())
    with pytest.raises(InputError, match="size"):
        directions_picture(field, size=(0, 10))
    with pytest.raises(InputError, match="zoom"):
        directions_picture(field, zoom=0)


def test_the_picture_does_not_depend_on_threads():
    points, vertex = welded(octahedron().corners.reshape(-1, 3))
    field = direction_field(TriangleMesh(points, vertex.reshape(-1, 3)), "smooth", symmetry=2)
    pictures = []
    for threads in (1, 2):
        with running(threads):
            pictures.append(directions_picture(field, size=(120, 90)))
    one, two = pictures
    np.testing.assert_array_equal(one, two)


def test_lines_end_at_edges_where_directions_start_anew():
    corners = np.stack(np.meshgrid((0.0, 1.0), (0.0, 1.0), (0.0, 1.0), indexing="ij"), -1).reshape(-1, 3)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [one for a, b, c, d in sides for one in ((a, b, c), (a, c, d))]
    mesh = TriangleMesh(corners, np.array(triangles))
    field = direction_field(mesh, lambda points: np.where(points[:, 2:] > 0.9, (1.0, 3, 0), (-2.0, 1, 4)))
    for neighbours, inside in ((mesh.neighbours, False), (going_on(field), True)):
        starts, seeds = mesh.corners.mean(axis=1), np.arange(len(mesh.triangles), dtype=np.int32)
        lines, counts = np.zeros((len(starts), 20, 3)), np.zeros(len(starts), np.int32)
        for turn in (0, 2):
            turns = np.full(len(starts), turn, np.int32)
            drawn = DrawnField(mesh.corners, neighbours, field.face_vectors, field.jumps)
            trace_lines(drawn, seeds, starts, turns, 2.0, lines, counts)
            ends = np.concatenate([line[:count] for line, count in zip(lines, counts, strict=True)])
            if abs(ends - 0.5).max() > 0.5 + 1e-9:
                assert not inside
                break
        else:
            assert inside
