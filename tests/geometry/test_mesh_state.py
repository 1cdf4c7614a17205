"""What is told of meshes whose faults are known."""

import numpy as np
import pytest
from gltf_models import BOX, BOX_TRIANGLES
from hypothesis import given
from hypothesis import strategies as st

from upholster.geometry.meshes.mesh_state import inside_out_parts, mesh_states, uv_state
from upholster.geometry.meshes.triangle_mesh import TriangleMesh


def state(triangles: np.ndarray, **more: np.ndarray):
    (found,) = mesh_states(TriangleMesh(BOX.astype(float), triangles, **more))
    return found


def test_a_box_is_whole() -> None:
    found = state(BOX_TRIANGLES)
    assert (found.triangles, found.vertices, found.components) == (12, 8, 1)
    assert (found.holes, found.border_edges, found.crowded_edges, found.turned_edges) == (0, 0, 0, 0)
    assert not found.inside_out
    assert (found.degenerate, found.slivers, found.uv) == (0, 0, None)
    assert found.area == pytest.approx(6)


def test_faults_are_counted() -> None:
    assert state(BOX_TRIANGLES[:, ::-1]).inside_out
    without_two_faces = state(BOX_TRIANGLES[4:])  # opposite ones
    assert (without_two_faces.holes, without_two_faces.border_edges) == (2, 8)
    turned = BOX_TRIANGLES.copy()
    turned[0] = turned[0, ::-1]
    assert state(turned).turned_edges == 3
    assert state(np.concatenate([BOX_TRIANGLES, [(0, 7, 1)]])).crowded_edges == 2
    assert state(np.concatenate([BOX_TRIANGLES, [(0, 1, 1)]])).degenerate == 1
    assert state(BOX_TRIANGLES[[0, 1, 2, 3]]).components == 2


def test_parts_are_distinguished_and_share_their_border() -> None:
    part = np.repeat(np.arange(2, dtype=np.int32), 6)
    mesh = TriangleMesh(BOX.astype(float), BOX_TRIANGLES, part, ("a", "b"))
    assert [(each.triangles, each.holes) for each in mesh_states(mesh)] == [(6, 0), (6, 0)]


def test_parts_that_share_edges_are_inside_out_together() -> None:
    two = np.concatenate([BOX, BOX + np.array([10, 0, 0])]).astype(float)
    part = np.repeat(np.arange(3, dtype=np.int32), (10, 2, 12))
    # The second part faces the middle between the boxes, and is a face of the first.
    first = np.roll(BOX_TRIANGLES, -4, axis=0)
    assert set(two[first[10:]][..., 0].ravel()) == {1.0}

    def found(own: np.ndarray) -> list[bool]:
        triangles = np.concatenate([own, BOX_TRIANGLES + 8])
        return inside_out_parts(TriangleMesh(two, triangles, part, ("a", "b", "c"))).tolist()

    assert found(first) == [False, False, False]
    assert found(first[:, ::-1]) == [True, True, False]
    assert found(np.concatenate([first[:10, ::-1], [(0, 0, 1), (0, 0, 1)]])) == [False, False, False]  # open


SQUARE = np.array([[(0, 0), (0, 1), (1, 1)], [(0, 0), (1, 1), (1, 0)]], float)
"""As seen from outside, v downward."""


def test_texture_coordinates_of_a_square() -> None:
    assert uv_state(SQUARE).overlapping == 0
    assert uv_state(SQUARE).mirrored == 0
    assert uv_state(SQUARE[:, ::-1]).mirrored == 1
    assert uv_state(SQUARE + 0.5).outside == 1
    assert uv_state(np.concatenate([SQUARE, 0 * SQUARE])).collapsed == 0.5
    half = np.concatenate([SQUARE, SQUARE + np.array([0.5, 0])])
    assert uv_state(half).overlapping == pytest.approx(1 / 3, abs=0.01)


@given(st.integers(0, 2**32 - 1))
def test_a_triangulation_never_overlaps(seed: int) -> None:
    """Whatever its points: centres of cells on edges belong to one side."""
    rng = np.random.default_rng(seed)
    n = 6
    grid = np.stack(np.meshgrid(np.arange(n), np.arange(n)), axis=-1).astype(float)
    grid[1:-1, 1:-1] += rng.integers(-3, 4, (n - 2, n - 2, 2)) / 10
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    uv = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3, 2)
    found = uv_state(uv)
    assert found.overlapping == 0
    assert found.mirrored == 0
