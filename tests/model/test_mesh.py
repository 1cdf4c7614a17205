"""The mesh: watertight, counter-clockwise, exact, of the asked-for size."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from upholster.base.errors import InputError
from upholster.charts.layout import density_layout, uniform_layout
from upholster.charts.tessellation.mesh import Mesh, face_parameters, tessellate
from upholster.geometry.built_in.cyclide import ring_cyclide, torus
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.revolution import cone, cylinder, vase
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.face import Face
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart


def topology(mesh: Mesh) -> tuple[int, int, int]:
    """Euler characteristic, border edges, and edges used twice in one direction or thrice: wrong."""
    _, index = np.unique(mesh.positions, axis=0, return_inverse=True)
    faces = index[mesh.all_triangles()]
    assert (faces != faces[:, [1, 2, 0]]).all()
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, uses = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    _, one_way = np.unique(directed, axis=0, return_counts=True)
    wrong = int((uses > 2).sum() + (one_way > 1).sum())
    return len(np.unique(faces)) - len(uses) + len(faces), int((uses == 1).sum()), wrong


CASES: list[tuple[Callable[[], Surface], int, bool]] = [
    (ring_cyclide, 0, True),
    (lambda: ring_cyclide(6, 2, 6), 1, True),  # a pinched ring
    (lambda: torus(spans=(6, 4)), 0, True),
    (sphere, 2, True),
    (lambda: sphere(tiling="octants"), 2, True),
    (vase, 2, True),
    (cylinder, 0, False),
    (cone, 0, False),
    (lambda: cone(1, 0, 1), 1, False),
    (lambda: plane(spans=(3, 2)), 1, False),
]


@pytest.mark.slow(reason="builds many models")
@pytest.mark.parametrize("quads", [1, 100, 3000])
@pytest.mark.parametrize(("build", "euler", "closed"), CASES)
def test_watertight_with_the_right_euler_characteristic(
    build: Callable[[], Surface], euler: int, closed: bool, quads: int
) -> None:
    surface = build()
    mesh = tessellate(surface, uniform_layout(surface, chart=8), quads=quads)
    k = max(1, round((quads / len(surface.patches)) ** 0.5))
    assert len(mesh.quads) == k * k * len(surface.patches)
    assert len(mesh.triangles) == 0
    for found in (topology(mesh), topology(tessellate(surface, quads=quads))):
        assert found[0] == euler
        assert (found[1] == 0) == closed
        assert found[2] == 0


@pytest.mark.slow(reason="builds many models")
@pytest.mark.parametrize("quads", [100, 6_000])
@pytest.mark.parametrize(("build", "euler", "closed"), CASES)
def test_charts_across_patches_and_of_any_size(
    build: Callable[[], Surface], euler: int, closed: bool, quads: int
) -> None:
    surface = build()
    charts = density_layout(surface, texels=100_000)
    mesh = tessellate(surface, charts, quads=quads)
    found = topology(mesh)
    assert found[0] == euler
    assert (found[1] == 0) == closed
    assert found[2] == 0
    if quads > 100:
        assert 0.85 * quads < len(mesh.quads) + len(mesh.triangles) / 6 < 1.15 * quads


@settings(max_examples=15, deadline=None)
@given(st.data(), st.integers(1, 3000))
def test_watertight_at_any_rectangles_of_faces(data: st.DataObject, quads: int) -> None:
    builders: list[tuple[Callable[[], Surface], int]] = [
        (ring_cyclide, 0), (lambda: sphere(tiling="octants"), 2), (vase, 2),
    ]  # fmt: skip
    build, euler = data.draw(st.sampled_from(builders))
    surface = build()
    charts = [
        Chart(n, 8, 8, 0.0, float(face.rows), 0.0, float(face.columns))
        for n, face in enumerate(surface.faces)
    ]
    for _ in range(data.draw(st.integers(1, 12))):
        k = data.draw(st.integers(0, len(charts) - 1))
        share = data.draw(st.sampled_from([0.25, 0.5, 0.75, 1 / 3]))
        one, c = data.draw(st.integers(3, 40)), charts[k]
        s, t = c.s0 + share * (c.s1 - c.s0), c.t0 + share * (c.t1 - c.t0)
        charts[k : k + 1] = data.draw(
            st.sampled_from(
                [
                    [Chart(c.face, one, c.width, c.s0, s, c.t0, c.t1), replace(c, s0=s)],
                    [Chart(c.face, c.height, one, c.s0, c.s1, c.t0, t), replace(c, t0=t)],
                ]
            )
        )
    assert topology(tessellate(surface, charts, quads=quads)) == (euler, 0, 0)


@settings(max_examples=15, deadline=None)
@given(st.data(), st.integers(1, 3000))
def test_watertight_at_t_junctions(data: st.DataObject, quads: int) -> None:
    builders: list[tuple[Callable[[], Surface], int]] = [(ring_cyclide, 0), (sphere, 2), (vase, 2)]
    build, euler = data.draw(st.sampled_from(builders))
    patches = list(build().patches)
    for _ in range(data.draw(st.integers(1, 12))):
        k = data.draw(st.integers(0, len(patches) - 1))
        at: Any = {data.draw(st.sampled_from("st")): data.draw(st.floats(0.2, 0.8))}
        patches[k : k + 1] = patches[k].split(**at)
    mesh = tessellate(Surface(patches), quads=quads)
    assert topology(mesh) == (euler, 0, 0)


def test_t_junction_cells_become_fans() -> None:
    first, *rest = sphere().patches
    surface = Surface([*first.split(s=0.5), *rest])
    mesh = tessellate(surface, quads=7 * 9)
    assert len(mesh.triangles) > 0
    assert len(mesh.quads) < 7 * 9
    assert topology(mesh) == (2, 0, 0)
    used = np.unique(np.concatenate([mesh.quads.ravel(), mesh.triangles.ravel()]))
    assert (used == np.arange(len(mesh.positions))).all()


@pytest.mark.parametrize("build", [case[0] for case in CASES])
def test_vertices_are_the_surfaces_own(build: Callable[[], Surface]) -> None:
    surface = build()
    charts = density_layout(surface, texels=20_000)
    mesh = tessellate(surface, charts, quads=500)
    assert mesh.positions.shape == mesh.normals.shape == (len(mesh.chart), 3)
    assert mesh.places.shape == (len(mesh.chart), 2)
    assert {str(array.dtype) for array in (mesh.quads, mesh.triangles, mesh.chart)} == {"int32"}
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-14)
    for n, chart in enumerate(charts):
        mine, face = mesh.chart == n, surface.faces[chart.face]
        assert mesh.places[mine].min() == 0
        assert tuple(mesh.places[mine].max(axis=0)) == (chart.height, chart.width)
        s, t = face_parameters(chart, *mesh.places[mine].T)
        np.testing.assert_allclose(mesh.positions[mine], face.points(s, t), atol=1e-12 * surface.size)
        np.testing.assert_allclose(mesh.normals[mine], face.frames(s, t)[1], atol=1e-8)


def test_borders_of_patches_are_borders_of_quadrilaterals() -> None:
    for surface in (vase(), cylinder(), ring_cyclide()):
        mesh = tessellate(surface, quads=3000)
        for n, face in enumerate(surface.faces):
            for axis, count in enumerate((face.rows, face.columns)):
                assert set(range(count + 1)) <= set(mesh.places[mesh.chart == n, axis].tolist())


def test_a_crease_is_kept_where_there_are_too_many_patches() -> None:
    """A roof of 2 × 60 patches: its ridge stays, borders between flat ones need not."""
    slope = [
        [
            RationalPatch.from_points([[(x, -y0, 1 - y0 * y0), (x + 1, -y0, 1 - y0 * y0)],
                                       [(x, -y1, 1 - y1 * y1), (x + 1, -y1, 1 - y1 * y1)]])
            for x in range(60)
        ]
        for y0, y1 in ((-1, 0), (0, 1))
    ]  # fmt: skip
    mesh = tessellate(Surface([Face(slope)]), [Chart(0, 3, 60, 0.0, 2.0, 0.0, 60.0)], quads=60)
    assert 1.5 in mesh.places[:, 0]
    assert len(np.unique(mesh.places[:, 1])) < 60


@pytest.mark.parametrize("build", [case[0] for case in CASES])
def test_triangles_face_outward(build: Callable[[], Surface]) -> None:
    mesh = tessellate(build(), quads=4000)
    faces = mesh.all_triangles()
    a, b, c = (mesh.positions[faces[:, k]] for k in range(3))
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), mesh.normals[faces].mean(axis=1))
    assert (outward > 0).all()


def test_triangles_at_a_pole_are_not_doubled() -> None:
    surface = sphere(tiling="octants")
    mesh = tessellate(surface, uniform_layout(surface, chart=8), quads=8 * 25)
    # each octant's row at the pole gives one triangle a cell, the others two
    assert len(mesh.all_triangles()) == 8 * (5 + 2 * 20)


def test_the_mesh_converges_to_the_sphere() -> None:
    mesh = tessellate(sphere(), quads=20_000)
    a, b, c = (mesh.positions[mesh.all_triangles()[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(4 / 3 * np.pi, rel=1e-3)


def test_the_mesh_is_read_only_and_repeatable() -> None:
    one, two = tessellate(vase(), quads=1000), tessellate(vase(), quads=1000)
    assert (one.positions == two.positions).all()
    assert (one.normals == two.normals).all()
    with pytest.raises(ValueError, match="read-only"):
        one.positions[0] = 0


@pytest.mark.parametrize("quads", [0, -1, 10_000_001, 2.5, float("nan")])
def test_bad_numbers_of_quads_are_named(quads: Any) -> None:
    with pytest.raises(InputError, match=f"quads is {quads}"):
        tessellate(plane(), quads=quads)


def test_charts_that_meet_at_a_crease_keep_their_own_normals() -> None:
    """A roof of two flat slopes, one face: the charts' vertices on the ridge point two ways."""
    slopes = [
        [RationalPatch.from_points([[(0, y, 1 - abs(y)), (1, y, 1 - abs(y))] for y in ends])]
        for ends in ((1, 0), (0, -1))
    ]
    charts = [Chart(0, 8, 8, row, row + 1.0, 0.0, 1.0) for row in (0.0, 1.0)]
    mesh = tessellate(Surface([Face(slopes)]), charts, quads=32)
    for n, y in enumerate((1, -1)):
        expected = np.array([0, y, 1]) / np.sqrt(2)
        np.testing.assert_allclose(np.abs(mesh.normals[mesh.chart == n] @ expected), 1, atol=1e-12)
    ridge = [mesh.positions[(mesh.chart == n) & (mesh.positions[:, 1] == 0)] for n in (0, 1)]
    np.testing.assert_array_equal(*ridge)
