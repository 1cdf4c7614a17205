"""Solids: what is closed, what is not, and how thick walls are."""

import numpy as np
import pytest

from upholster.charts.tessellation.mesh import tessellate
from upholster.geometry.built_in.revolution import vase
from upholster.geometry.built_in.sphere import sphere
from upholster.model.displaced_mesh import plain_solid
from upholster.model.solid import check_solid, solid_lines, volume


def shell(outer: float, inner: float) -> tuple[np.ndarray, np.ndarray]:
    """A hollow ball: two spheres, the inner one inside out."""
    ball = plain_solid(tessellate(sphere(), quads=4000))
    hole = ball.triangles[:, ::-1] + len(ball.positions)
    return np.concatenate([outer * ball.positions, inner * ball.positions]), np.concatenate(
        [ball.triangles, hole]
    ).astype(np.int32)


def tetrahedron() -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    return corners, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], np.int32)


def test_a_solid_is_closed_and_has_its_volume() -> None:
    found = check_solid(*tetrahedron())
    assert found.is_closed
    assert found.manifold in (True, None)
    assert found.volume == pytest.approx(1 / 6)
    assert volume(tetrahedron()[0] + 100, tetrahedron()[1]) == pytest.approx(1 / 6)
    assert (found.folded, found.overlaps) == (0, 0)


@pytest.mark.parametrize(
    ("faces", "faults", "reported"),
    [
        (slice(1, None), (3, 0, 0), "3 edges with a triangle on one side only"),
        ([0, 1, 2, 3, 3], (0, 3, 0), "3 edges with more than two triangles"),
    ],
)
def test_what_is_open_or_crowded_is_reported(
    faces: object, faults: tuple[int, int, int], reported: str
) -> None:
    positions, triangles = tetrahedron()
    found = check_solid(positions, triangles[faces])  # type: ignore[index]
    assert (found.borders, found.crowded, found.turned) == faults
    assert not found.is_closed
    assert found.manifold in (False, None)
    assert (found.volume, found.wall) == (None, None)
    (line,) = solid_lines(found, None)
    assert line.endswith(f"triangles, which are not a solid: {reported}")


def test_a_triangle_that_is_inside_out_is_reported() -> None:
    positions, triangles = tetrahedron()
    turned = triangles.copy()
    turned[0] = turned[0, ::-1]
    assert check_solid(positions, turned).turned == 3
    inside_out = check_solid(positions, np.ascontiguousarray(triangles[:, ::-1]))
    assert inside_out.is_closed
    assert any("face inward" in line for line in solid_lines(inside_out, None))


def test_the_thinnest_wall_is_found() -> None:
    positions, triangles = shell(1.0, 0.9)
    ball = len(positions) // 2
    top = int(positions[:ball, 2].argmax())
    dented = positions.copy()
    dented[top] *= 0.93
    found = check_solid(dented, triangles, positions)
    assert found.common_wall == pytest.approx(0.1, rel=0.02)
    assert found.wall == pytest.approx(0.03, rel=0.05)
    assert found.thinnest is not None
    assert found.thinnest[2] == pytest.approx(0.93, abs=0.05)
    assert found.overlaps == 0
    lines = solid_lines(found, 0.001)
    assert any(line.startswith("thinnest wall 0.03") and " mm at (" in line for line in lines)


def test_walls_that_pass_through_each_other_are_reported() -> None:
    positions, triangles = shell(1.0, 0.99)
    ball = len(positions) // 2
    through = positions.copy()
    through[:ball][positions[:ball, 2] > 0.5] *= 0.95  # the outer wall goes inside the inner one
    found = check_solid(through, triangles, positions)
    assert found.overlaps > 0.05
    assert any(line.startswith("parts of it overlap") for line in solid_lines(found, None))
    mesh = plain_solid(tessellate(vase(), quads=2000))
    folded = mesh.positions.copy()
    folded[mesh.triangles[7, 0]] = (
        2 * mesh.positions[mesh.triangles[7, 1:]].mean(axis=0) - folded[mesh.triangles[7, 0]]
    )
    found = check_solid(folded, mesh.triangles, mesh.positions)
    assert found.folded >= 1
    assert any(line.startswith("it passes through itself") for line in solid_lines(found, None))


def test_lengths_are_in_millimetres_where_the_unit_is_known() -> None:
    positions, triangles = shell(0.05, 0.045)  # metres
    lines = solid_lines(check_solid(positions, triangles), 1.0)
    assert "a closed solid of 141.7 cm³" in lines[0]
    assert "thinnest wall 4.9" in lines[1] or "thinnest wall 5" in lines[1]
