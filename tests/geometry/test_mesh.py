"""The mesh: watertight, counter-clockwise, exact, of the asked-for size."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from upholster.errors import InputError
from upholster.geometry import (
    Mesh,
    Surface,
    cone,
    cylinder,
    plane,
    ring_cyclide,
    sphere,
    tessellate,
    torus,
    vase,
)


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


@pytest.mark.parametrize("quads", [1, 100, 3000])
@pytest.mark.parametrize(("build", "euler", "closed"), CASES)
def test_watertight_with_the_right_euler_characteristic(
    build: Callable[[], Surface], euler: int, closed: bool, quads: int
) -> None:
    surface = build()
    mesh = tessellate(surface, quads=quads)
    k = max(1, round((quads / len(surface.patches)) ** 0.5))
    assert len(mesh.quads) == k * k * len(surface.patches)
    assert len(mesh.triangles) == 0
    found = topology(mesh)
    assert found[0] == euler
    assert (found[1] == 0) == closed
    assert found[2] == 0


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
    mesh = tessellate(surface, quads=500)
    assert mesh.positions.shape == mesh.normals.shape == (len(mesh.patch), 3)
    assert mesh.parameters.shape == (len(mesh.patch), 2)
    assert {str(array.dtype) for array in (mesh.quads, mesh.triangles, mesh.patch)} == {"int32"}
    assert mesh.parameters.min() == 0
    assert mesh.parameters.max() == 1
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-14)
    for p, patch in enumerate(surface.patches):
        mine = mesh.patch == p
        s, t = mesh.parameters[mine].T
        np.testing.assert_allclose(mesh.positions[mine], patch.points(s, t), atol=1e-12 * surface.size)
        np.testing.assert_allclose(mesh.normals[mine], patch.normals(s, t), atol=1e-12)


@pytest.mark.parametrize("build", [case[0] for case in CASES])
def test_triangles_face_outward(build: Callable[[], Surface]) -> None:
    mesh = tessellate(build(), quads=4000)
    faces = mesh.all_triangles()
    a, b, c = (mesh.positions[faces[:, k]] for k in range(3))
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), mesh.normals[faces].mean(axis=1))
    assert (outward > 0).all()


def test_triangles_at_a_pole_are_not_doubled() -> None:
    mesh = tessellate(sphere(tiling="octants"), quads=8 * 25)
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
