"""The built-in surfaces: their equations, nets, weights and orientation."""

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.geometry.built_in.cyclide import ring_cyclide, torus
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.revolution import cone, cylinder, ellipsoid, revolve, vase
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.orientation import signed_volume
from upholster.geometry.patches.surface import Surface

DATA = Path(__file__).parent.parent / "data"
GRID = np.linspace(0.0, 1.0, 7)
MISPRINTS = [("2", "x", 1, 0), ("3", "x", 1, 2), ("4", "x", 1, 0)]


def evaluated(text: str, **values: float) -> float:
    """The value of a formula of the data files."""
    names = {"sqrt": math.sqrt, "pi": math.pi, **values}
    return float(eval(text, {"__builtins__": {}}, names))


def cyclide_residual(points: FloatArray, a: float, c: float, mu: float) -> FloatArray:
    """The implicit equation's residual, relative to the size of its terms."""
    x, y, z = np.moveaxis(points, -1, 0)
    b2 = a * a - c * c
    square = x * x + y * y + z * z - mu * mu + b2
    terms = square**2, 4 * (a * x - c * mu) ** 2, 4 * b2 * y * y
    scale = (x * x + y * y + z * z + mu * mu + b2) ** 2 + 4 * (abs(a * x) + c * mu) ** 2 + terms[2]
    return np.asarray(np.abs(terms[0] - terms[1] - terms[2]) / scale)


@st.composite
def cyclides(draw: st.DrawFn) -> tuple[float, float, float]:
    a = 10.0 ** draw(st.floats(-3, 3))
    c = a * draw(st.one_of(st.just(0.0), st.floats(1e-6, 0.999)))
    mu = c + (a - c) * draw(st.one_of(st.just(1.0), st.floats(1e-3, 1.0)))
    return a, c, min(mu, a)


even = st.sampled_from([4, 6, 8, 10, 16])


@given(cyclides(), st.tuples(even, even), st.integers(0, 2**32 - 1))
def test_cyclide_satisfies_its_equation_with_positive_weights(
    shape: tuple[float, float, float], spans: tuple[int, int], seed: int
) -> None:
    surface = ring_cyclide(*shape, spans=spans)
    assert len(surface.patches) == spans[0] * spans[1]
    rng = np.random.default_rng(seed)
    for patch in surface.patches:
        assert (patch.weights > 0).all()
    for patch in rng.choice(np.array(surface.patches, dtype=object), 8):
        s, t = rng.random((2, 250))
        assert cyclide_residual(patch.points(s, t), *shape).max() <= 1e-12


def test_cyclide_satisfies_its_equation_at_many_points() -> None:
    rng = np.random.default_rng(0)
    surface = ring_cyclide()
    for patch in surface.patches:
        s, t = rng.random((2, 6250))
        assert cyclide_residual(patch.points(s, t), 6, 2, 3).max() <= 1e-12


@pytest.mark.parametrize(
    ("a", "c", "mu"), [(6.0, 2.0, 3.0), (2.5, 0.4, 1.1), (4.0, 0.0, 1.0), (6.0, 2.0, 6.0)]
)
def test_cyclide_equals_the_papers_appendix_and_its_reflections(a: float, c: float, mu: float) -> None:
    appendix = json.loads((DATA / "cyclide_appendix.json").read_text())
    b = math.sqrt(a * a - c * c)
    patches = ring_cyclide(a, c, mu).patches
    # which of the sixteen lies where: the four tabulated have θ and φ in [0, π]
    for name, row, column in (("1", 0, 0), ("2", 0, 1), ("3", 1, 0), ("4", 1, 1)):
        entry = appendix[name]
        table = {}
        for key in ("w", "x", "y", "z"):
            formulas = [list(line) for line in entry[key]]
            for patch_name, wrong_key, i, j in MISPRINTS:
                if (name, key) == (patch_name, wrong_key):
                    assert formulas[i][j].endswith(")*a")
                    formulas[i][j] = formulas[i][j][:-1] + "1/a"
            table[key] = np.array([[evaluated(f, a=a, b=b, c=c, mu=mu) for f in line] for line in formulas])
        expected = np.stack([table["x"], table["y"], table["z"]], axis=-1)
        size = np.abs(expected).max()
        for turn_row in (False, True):
            for turn_column in (False, True):
                # y → −y takes θ to 2π − θ, z → −z takes φ to 2π − φ: the net is run through backwards
                patch = patches[4 * (3 - row if turn_row else row) + (3 - column if turn_column else column)]
                net = patch.reverse(0) if turn_row else patch
                net = net.reverse(1) if turn_column else net
                signs = [1.0, -1.0 if turn_row else 1.0, -1.0 if turn_column else 1.0]
                np.testing.assert_allclose(net.weights, table["w"], atol=1e-14 * a)
                np.testing.assert_allclose(net.control_points * signs, expected, atol=2e-15 * size)


def test_torus_satisfies_its_equation() -> None:
    for patch in torus(2.0, 0.7, spans=(6, 4)).patches:
        x, y, z = np.moveaxis(patch.points_grid(GRID, GRID), -1, 0)
        np.testing.assert_allclose((np.hypot(x, y) - 2.0) ** 2 + z * z, 0.49, atol=1e-14)


@pytest.mark.parametrize("tiling", ["six", "octants"])
def test_sphere_lies_on_its_radius_and_its_normals_along_it(tiling: Any) -> None:
    surface = sphere(2.5, tiling=tiling)
    for patch in surface.patches:
        points = patch.points_grid(GRID, GRID)
        np.testing.assert_allclose(np.linalg.norm(points, axis=-1), 2.5, atol=1e-14)
        np.testing.assert_allclose(patch.normals_grid(GRID, GRID), points / 2.5, atol=1e-10)
    np.testing.assert_allclose(signed_volume(surface), 4 / 3 * math.pi * 2.5**3, rtol=1e-5)


def test_sphere_top_equals_cobbs_net() -> None:
    table = json.loads((DATA / "sphere_six_patches.json").read_text())["points"]
    net = np.empty((5, 5, 4))
    for key, entry in table.items():
        i, j = map(int, key.split(","))
        point = np.array([evaluated(text) for text in entry])
        for p, flip_y in ((i, 1.0), (4 - i, -1.0)):
            for q, flip_x in ((j, 1.0), (4 - j, -1.0)):
                net[p, q] = point * [flip_x, flip_y, 1.0, 1.0]
    # tabulated with i along +y; rows of ours run along −y, which points the normals outward
    np.testing.assert_allclose(sphere().patches[4].net, net[::-1], atol=1e-14)


def test_ellipsoid_cylinder_and_cone_satisfy_their_equations() -> None:
    for patch in ellipsoid(3, 2, 0.5).patches:
        scaled = patch.points_grid(GRID, GRID) / [3, 2, 0.5]
        np.testing.assert_allclose(np.linalg.norm(scaled, axis=-1), 1.0, atol=1e-14)
    for patch in cylinder(1.5, 3, spans=3).patches:
        points = patch.points_grid(GRID, GRID)
        np.testing.assert_allclose(np.hypot(points[..., 0], points[..., 1]), 1.5, atol=1e-14)
        np.testing.assert_allclose(points[..., 2], np.tile(1.5 - 3 * GRID[:, None], 7), atol=1e-14)
    for patch in cone(2, 0.5, 3, spans=5).patches:
        points = patch.points_grid(GRID, GRID)
        radius = 0.5 + 1.5 * (1.5 - points[..., 2]) / 3
        np.testing.assert_allclose(np.hypot(points[..., 0], points[..., 1]), radius, atol=1e-14)


def test_vase_is_a_closed_smooth_solid_of_its_size() -> None:
    surface = vase(1.0, 2.0, spans=3)
    assert not surface.border
    low, high = surface.box
    assert (low[2], high[2]) == (-1.0, 1.0)
    sample = np.concatenate(
        [p.points_grid(np.linspace(0, 1, 101), [0.0])[:, 0] for p in surface.patches[::3]]
    )
    np.testing.assert_allclose(np.hypot(sample[:, 0], sample[:, 1]).max(), 1.0, atol=1e-3)
    for meeting in surface.shared:
        if meeting.edge == 2 and meeting.other_edge == 0:
            above, below = surface.patches[meeting.patch], surface.patches[meeting.other_patch]
            np.testing.assert_allclose(
                above.normals([1.0] * 7, GRID), below.normals([0.0] * 7, GRID), atol=1e-9
            )
    # the wall has a thickness: at every height the inside is nearer to the axis
    profile = [p.points_grid(np.linspace(0, 1, 201), [0.0])[:, 0] for p in surface.patches[::3]]
    inside = np.concatenate(profile[:4])
    outside = np.concatenate(profile[4:9])[::-1]
    heights = np.linspace(-0.8, 0.97, 100)
    r_in = np.interp(heights, inside[:, 2], np.hypot(inside[:, 0], inside[:, 1]))
    r_out = np.interp(heights, outside[:, 2], np.hypot(outside[:, 0], outside[:, 1]))
    assert (r_out - r_in > 0.02).all()


def test_plane_faces_up_with_rows_downward() -> None:
    surface = plane(4, 2, spans=(2, 3))
    assert len(surface.patches) == 6
    first = surface.patches[0]
    np.testing.assert_allclose(
        first.points([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]), [(-2, 1, 0), (-2, 0, 0), (-2 / 3, 1, 0)]
    )
    for patch in surface.patches:
        np.testing.assert_allclose(
            patch.normals_grid(GRID, GRID), np.tile([0.0, 0.0, 1.0], (7, 7, 1)), atol=1e-15
        )


RINGS: list[Callable[[], Surface]] = [
    ring_cyclide,
    lambda: ring_cyclide(6, 5.9, 5.95, spans=(6, 8)),
    lambda: ring_cyclide(6, 2, 6),
    torus,
]
UPRIGHT: list[Callable[[], Surface]] = [
    lambda: sphere(tiling="octants"),
    ellipsoid,
    cylinder,
    cone,
    lambda: cone(1, 0, 1),
    lambda: cone(0.3, 1.0, 2, spans=7),
]


@pytest.mark.parametrize("build", [*RINGS, *UPRIGHT, sphere, vase])
def test_the_volume_is_positive(build: Callable[[], Surface]) -> None:
    assert signed_volume(build()) > 0


@pytest.mark.parametrize("build", [*UPRIGHT, sphere])
def test_normals_point_away_from_the_centre(build: Callable[[], Surface]) -> None:
    for patch in build().patches:
        points, normals = patch.frames_grid(GRID, GRID)
        assert (np.einsum("ijk,ijk->ij", points, normals) > 0).all()


@pytest.mark.parametrize("build", UPRIGHT)
def test_rows_run_down_and_columns_to_the_right(build: Callable[[], Surface]) -> None:
    for patch in build().patches:
        points, along_s, along_t = patch.derivatives([0.5], [0.5])
        assert along_s[0, 2] < 0
        assert np.cross(points[0], along_t[0])[2] > 0


@pytest.mark.parametrize("shape", [(6.0, 2.0, 3.0), (6.0, 5.9, 5.95), (3.0, 0.0, 1.0)])
def test_cyclide_normals_follow_the_implicit_gradient(shape: tuple[float, float, float]) -> None:
    a, c, mu = shape
    b2 = a * a - c * c
    for patch in ring_cyclide(*shape, spans=(6, 4)).patches:
        points, normals = patch.frames_grid(GRID, GRID)
        x, y, _ = np.moveaxis(points, -1, 0)
        square = (points**2).sum(axis=-1) - mu * mu + b2
        gradient = 4 * square[..., None] * points
        gradient[..., 0] -= 8 * a * (a * x - c * mu)
        gradient[..., 1] -= 8 * b2 * y
        gradient /= np.linalg.norm(gradient, axis=-1, keepdims=True)
        np.testing.assert_allclose(normals, gradient, atol=1e-7)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: ring_cyclide(6, 2, 7), "mu is 7; allowed: c = 2 < mu <= a = 6"),
        (lambda: ring_cyclide(6, 2, 2), "mu is 2"),
        (lambda: ring_cyclide(6, 2, math.nan), "mu is nan"),
        (lambda: ring_cyclide(6, 6, 6), "c is 6"),
        (lambda: ring_cyclide(6, -1, 3), "c is -1"),
        (lambda: ring_cyclide(math.inf, 2, 3), "a is inf"),
        (lambda: ring_cyclide(spans=(4, 5)), "spans round the tube is 5"),
        (lambda: ring_cyclide(spans=(2, 4)), "spans round the ring is 2"),
        (lambda: ring_cyclide(spans=(4, 258)), "spans round the tube is 258"),
        (lambda: ring_cyclide(spans=4), "spans is 4"),  # type: ignore[arg-type]
        (lambda: torus(1, 1), "r is 1"),
        (lambda: torus(1, 0), "r is 0"),
        (lambda: sphere(-1), "r is -1"),
        (lambda: sphere(tiling="cube"), "tiling is 'cube'"),  # type: ignore[arg-type]
        (lambda: plane(0, 1), "width is 0"),
        (lambda: plane(1, 1, spans=(0, 1)), "spans along y is 0"),
        (lambda: ellipsoid(1, math.nan, 1), "ry is nan"),
        (lambda: cylinder(1, 1e10), "h is 10000000000"),
        (lambda: cone(0, 1, 1), "r1 is 0"),
        (lambda: vase(spans=2), "spans is 2"),
        (lambda: revolve([]), "no curves"),
        (lambda: revolve([[(1, 0, 1)]]), "shape (1, 3)"),
        (lambda: revolve([[(1, 1, 1), (-1, 0, 1)]]), "control point [1] of the profile's curve 0"),
        (lambda: revolve([[(1, 1, 1), (1, 0, 0)]]), "weight > 0"),
        (
            lambda: revolve([[(1, 1, 1), (1, 0, 1)], [(2, 0, 1), (1, -1, 1)]]),
            "curve 1 of the profile begins at",
        ),
        (lambda: revolve("x"), "curve 0 of the profile"),
    ],
)
def test_bad_parameters_are_named(build: Callable[[], Surface], message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        build()
    assert "\n" not in str(caught.value)
