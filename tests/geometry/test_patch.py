"""`RationalPatch`: evaluation against a NumPy twin, identities, normals, errors."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.revolution import cone
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.bernstein import bernstein
from upholster.geometry.patches.patch import RationalPatch

GRID = np.linspace(0.0, 1.0, 9)


def random_patch(seed: int, m: int, n: int) -> RationalPatch:
    """A patch that rises over the unit square, so that it has normals everywhere."""
    rng = np.random.default_rng(seed)
    points = np.stack(
        [*np.meshgrid(np.arange(n + 1.0), np.arange(m + 1.0)), rng.normal(size=(m + 1, n + 1))], -1
    )
    points += 0.2 * rng.uniform(-1, 1, points.shape)
    return RationalPatch.from_points(points, rng.uniform(0.5, 2.0, (m + 1, n + 1)))


def twin(patch: RationalPatch, s: ArrayLike, t: ArrayLike) -> FloatArray:
    """The definition, in NumPy."""
    m, n = patch.degree
    bs, bt = bernstein(m, np.asarray(s, float)), bernstein(n, np.asarray(t, float))
    h = np.einsum("...i,...j,ijc->...c", bs, bt, patch.net)
    return np.asarray(h[..., :3] / h[..., 3:])


degrees = st.tuples(st.integers(1, 7), st.integers(1, 7))


@given(st.integers(0, 1000), degrees)
def test_kernels_equal_their_twin(seed: int, degree: tuple[int, int]) -> None:
    patch = random_patch(seed, *degree)
    assert patch.degree == degree
    s, t = np.meshgrid(GRID, GRID[:6], indexing="ij")
    expected = twin(patch, s, t)
    np.testing.assert_allclose(patch.points_grid(GRID, GRID[:6]), expected, atol=1e-13)
    np.testing.assert_allclose(patch.points(s, t), expected, atol=1e-13)
    np.testing.assert_allclose(patch.derivatives_grid(GRID, GRID[:6])[0], expected, atol=1e-13)
    for on_grid, scattered in zip(
        patch.derivatives_grid(GRID, GRID[:6]), patch.derivatives(s, t), strict=True
    ):
        assert (on_grid == scattered).all()
    assert (patch.normals_grid(GRID, GRID[:6]) == patch.normals(s, t)).all()


@given(st.integers(0, 1000), degrees)
def test_derivatives_and_normals_are_central_differences(seed: int, degree: tuple[int, int]) -> None:
    patch = random_patch(seed, *degree)
    s, t = np.meshgrid(GRID, GRID, indexing="ij")
    step = 1e-5
    by_s = (twin(patch, s + step, t) - twin(patch, s - step, t)) / (2 * step)
    by_t = (twin(patch, s, t + step) - twin(patch, s, t - step)) / (2 * step)
    _, along_s, along_t = patch.derivatives(s, t)
    np.testing.assert_allclose(along_s, by_s, atol=1e-6)
    np.testing.assert_allclose(along_t, by_t, atol=1e-6)
    normal = np.cross(by_s, by_t)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    np.testing.assert_allclose(patch.normals(s, t), normal, atol=1e-5)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), degrees, st.floats(0.05, 0.95))
def test_split_elevate_reverse_transpose(seed: int, degree: tuple[int, int], at: float) -> None:
    patch = random_patch(seed, *degree)
    whole = patch.points_grid(GRID, GRID)
    before, behind = patch.split(s=at)
    np.testing.assert_allclose(before.points_grid(GRID, GRID), patch.points_grid(at * GRID, GRID), atol=1e-12)
    rest = at + (1 - at) * GRID
    np.testing.assert_allclose(behind.points_grid(GRID, GRID), patch.points_grid(rest, GRID), atol=1e-12)
    before, behind = patch.split(t=at)
    np.testing.assert_allclose(before.points_grid(GRID, GRID), patch.points_grid(GRID, at * GRID), atol=1e-12)
    np.testing.assert_allclose(behind.points_grid(GRID, GRID), patch.points_grid(GRID, rest), atol=1e-12)
    raised = patch.elevate(degree[0] + 3, degree[1] + 1)
    assert raised.degree == (degree[0] + 3, degree[1] + 1)
    np.testing.assert_allclose(raised.points_grid(GRID, GRID), whole, atol=1e-12)
    np.testing.assert_allclose(patch.reverse(0).points_grid(GRID, GRID), whole[::-1], atol=1e-12)
    np.testing.assert_allclose(patch.reverse(1).points_grid(GRID, GRID), whole[:, ::-1], atol=1e-12)
    turned = patch.transpose()
    np.testing.assert_allclose(turned.points_grid(GRID, GRID), whole.swapaxes(0, 1), atol=1e-12)
    normals = patch.normals_grid(GRID, GRID)
    np.testing.assert_allclose(turned.normals_grid(GRID, GRID), -normals.swapaxes(0, 1), atol=1e-9)
    assert (patch.reverse(0).reverse(0).net == patch.net).all()
    assert (turned.transpose().net == patch.net).all()


def test_edges_are_the_patch_at_the_ends_of_its_parameters() -> None:
    patch = random_patch(3, 2, 4)
    zero, one = np.zeros_like(GRID), np.ones_like(GRID)
    for edge, (s, t) in enumerate([(zero, GRID), (GRID, one), (one, GRID), (GRID, zero)]):
        net = patch.edge(edge)
        h = bernstein(len(net) - 1, GRID) @ net
        np.testing.assert_allclose(h[:, :3] / h[:, 3:], patch.points(s, t), atol=1e-13)


def test_large_grids_are_shared_among_threads_with_the_same_bits() -> None:
    patch = random_patch(4, 2, 2)
    s, t = np.linspace(0, 1, 401), np.linspace(0, 1, 701)
    points = patch.points_grid(s, t)
    assert (points[::50] == patch.points_grid(s[::50], t)).all()
    assert (patch.derivatives_grid(s, t)[1][::50] == patch.derivatives_grid(s[::50], t)[1]).all()
    np.testing.assert_allclose(points, twin(patch, s[:, None], t[None, :]), atol=1e-13)


def test_degree_32_is_stable() -> None:
    flat = np.stack([*np.meshgrid(np.arange(33.0), np.arange(33.0)), np.zeros((33, 33))], axis=-1)
    patch = RationalPatch.from_points(flat)
    s = np.linspace(0, 1, 33)
    np.testing.assert_allclose(patch.points_grid(s, s), flat, atol=1e-12)
    np.testing.assert_allclose(patch.normals_grid(s, s), np.tile([0.0, 0.0, -1.0], (33, 33, 1)), atol=1e-12)


def test_normals_at_poles_are_the_limit() -> None:
    u = np.concatenate([np.linspace(0, 1, 11), 10.0 ** -np.arange(2.0, 16.0)])
    for patch in sphere(3.0, tiling="octants").patches:
        s, t = np.meshgrid(np.concatenate([u, 1 - u]), u, indexing="ij")
        points, normals = patch.points(s, t), patch.normals(s, t)
        np.testing.assert_allclose(normals, points / 3.0, atol=1e-10)
        np.testing.assert_allclose(patch.normals_grid(u, u), patch.points_grid(u, u) / 3.0, atol=1e-10)


def test_normals_at_an_apex_turn_with_the_column() -> None:
    for patch in cone(1.0, 0.0, 1.0).patches:
        apex, below = patch.normals([0.0] * 9, GRID), patch.normals([0.5] * 9, GRID)
        np.testing.assert_allclose(apex, below, atol=1e-10)


def test_normals_where_the_cyclides_hole_closes() -> None:
    for patch in ring_cyclide(6, 2, 6).patches:
        for t in (0.0, 1.0):
            inside = 2e-6 if t == 0.0 else 1.0 - 2e-6
            at, near = patch.normals(GRID, np.full(9, t)), patch.normals(GRID, np.full(9, inside))
            np.testing.assert_allclose(at, near, atol=1e-4)


def test_normals_where_two_rows_collapse_and_at_a_collapsed_corner() -> None:
    # z = r² over the unit disc's quarter, with the first two rows of control points in the middle
    s = np.array([0.0, 0.0, 1.0])
    points = np.array([[(r, r * (j / 2), 0.0) for j in range(3)] for r in s])
    patch = RationalPatch.from_points(points)
    np.testing.assert_allclose(patch.normals_grid(GRID, GRID), np.tile([0.0, 0.0, 1.0], (9, 9, 1)), atol=1e-9)
    # a triangle: the tangents at one corner are parallel
    corner = [[(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)]] * 1
    corner += [
        [(1.0, 0.0, 0.0), (1.0, -1.0, 0.0), (2.0, -1.0, 0.0)],
        [(2.0, 0.0, 0.0), (2.0, -1.5, 0), (3.0, -2, 0)],
    ]
    normal = RationalPatch.from_points(corner).normals([0.0], [0.0])
    np.testing.assert_allclose(np.abs(normal), [[0.0, 0.0, 1.0]], atol=1e-9)


def test_a_patch_without_area_has_finite_normals() -> None:
    point = RationalPatch.from_points(np.ones((3, 3, 3)))
    line = RationalPatch.from_points(np.arange(9.0).reshape(3, 3, 1) * [1.0, 2.0, 3.0])
    for patch in (point, line):
        normals = patch.normals_grid(GRID, GRID)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1.0, atol=1e-12)


@pytest.mark.parametrize("scale", [1e-20, 1e20])
def test_normals_do_not_depend_on_the_unit_of_length(scale: float) -> None:
    patch = random_patch(5, 3, 2)
    scaled = RationalPatch(patch.net * [scale, scale, scale, 1.0])
    np.testing.assert_allclose(scaled.normals_grid(GRID, GRID), patch.normals_grid(GRID, GRID), atol=1e-12)


def test_the_net_is_a_read_only_copy() -> None:
    net = np.ones((2, 2, 4))
    patch = RationalPatch(net)
    net[:] = 7.0
    assert (patch.net == 1.0).all()
    with pytest.raises(ValueError, match="read-only"):
        patch.net[0, 0, 0] = 2.0


def spoiled(value: float, index: tuple[int, int, int]) -> FloatArray:
    net = np.ones((3, 4, 4))
    net[index] = value
    return net


@pytest.mark.parametrize(
    ("net", "message"),
    [
        (np.ones((3, 3)), "shape (3, 3)"),
        (np.ones((3, 3, 3)), "shape (3, 3, 3)"),
        (np.ones((1, 3, 4)), "1 x 3 points"),
        (np.ones((3, 34, 4)), "3 x 34 points"),
        (spoiled(np.nan, (1, 2, 0)), "control point [1, 2]"),
        (spoiled(np.inf, (2, 3, 1)), "control point [2, 3]"),
        (spoiled(1e31, (0, 0, 2)), "control point [0, 0]"),
        (spoiled(0.0, (2, 1, 3)), "weight [2, 1] is 0"),
        (spoiled(-1.0, (0, 3, 3)), "weight [0, 3] is -1"),
        ([["a", "b"]], "array of numbers"),
        ([[1.0], [1.0, 2.0]], "array of numbers"),
    ],
)
def test_bad_nets_are_named(net: ArrayLike, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        RationalPatch(net)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_bad_arguments_are_named() -> None:
    patch = random_patch(0, 2, 2)
    with pytest.raises(InputError, match=re.escape("weight [1, 0] is nan")):
        RationalPatch.from_points(np.zeros((2, 2, 3)), [[1.0, 1.0], [np.nan, 1.0]])
    with pytest.raises(InputError, match=re.escape("(2, 3)")):
        RationalPatch.from_points(np.zeros((2, 2, 3)), np.ones((2, 3)))
    with pytest.raises(InputError, match="exactly one"):
        patch.split()
    with pytest.raises(InputError, match="inside"):
        patch.split(s=1.0)
    with pytest.raises(InputError, match="inside"):
        patch.split(t=np.nan)
    with pytest.raises(InputError, match="elevate"):
        patch.elevate(1, 3)
    with pytest.raises(InputError, match="axis is 2"):
        patch.reverse(2)
    with pytest.raises(InputError, match="edge is 4"):
        patch.edge(4)
    with pytest.raises(InputError, match="equal shapes"):
        patch.points([0.0], [0.0, 1.0])
    with pytest.raises(InputError, match="finite"):
        patch.normals_grid([0.0, np.nan], [0.0])
    with pytest.raises(InputError, match="dimensions"):
        patch.points_grid(0.5, [0.0])
