import math

import numpy as np
import pytest

from upholster.charts.directions import default_direction, direction_fields, parse_direction
from upholster.charts.layout import density_layout, texture_scale
from upholster.charts.seams import find_seams
from upholster.charts.tangents import aligned, from_nearest
from upholster.charts.transitions import transitions
from upholster.errors import InputError
from upholster.geometry import Face, RationalPatch, Surface, plane, sphere, surface_from_spec, torus
from upholster.quilt import Chart
from upholster.quilt.warp_field import FIELD_STEP, WarpField, node_count

QUANTUM = 2 * math.pi / 256


def swirl(points):
    """Spirals up round the z axis."""
    return np.stack([-points[:, 1], points[:, 0], np.full(len(points), 1.0)], axis=1)


def at_nodes(surface, chart, field):
    """Return points and texel steps (by rows, by columns) at the nodes on a chart, by finite differences."""
    inside = [FIELD_STEP * np.arange(-(-n // FIELD_STEP)) for n in (chart.height, chart.width)]
    rows, columns = (x.astype(float) for x in np.meshgrid(*inside, indexing="ij"))

    def points(r, c):
        s = chart.s0 + (chart.s1 - chart.s0) * (r + 0.5) / chart.height
        t = chart.t0 + (chart.t1 - chart.t0) * (c + 0.5) / chart.width
        return surface.faces[chart.face].points(s, t)

    h = 1e-3
    down = (points(rows + h, columns) - points(rows - h, columns)) / (2 * h)
    right = (points(rows, columns + h) - points(rows, columns - h)) / (2 * h)
    i, j = (x // FIELD_STEP + field.margin for x in inside)
    m = field.matrices[i[:, None], j].reshape(*rows.shape, 2, 2) / 4096
    return points(rows, columns), down, right, m


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def laid(surface, direction, texels=300_000, scale=1.3):
    charts = density_layout(surface, texels=texels)
    rho = scale * texture_scale(surface, 256, texels=texels).density
    fields = direction_fields(surface, charts, parse_direction(direction), rho)
    return rho, [at_nodes(surface, chart, field) for chart, field in zip(charts, fields, strict=True)]


def runs_along(down, right, m):
    """Return where in space the exemplar's rows and columns of pixels run, and pixels per unit along them."""
    steps = np.linalg.inv(m)
    jacobian = np.stack([down, right], axis=-1)
    e2, e1 = np.moveaxis(jacobian @ steps, -1, 0)
    return e1, e2


def test_the_plane_at_one_to_one_is_the_identity():
    surface = plane(2.0, 1.0)
    charts = density_layout(surface, density=300)
    assert direction_fields(surface, charts, parse_direction("u"), 300.0) == (WarpField.identity(),)
    assert direction_fields(surface, charts, parse_direction("1,0,0"), 300.0) == (WarpField.identity(),)
    (quarter,) = direction_fields(surface, charts, parse_direction("90"), 300.0)
    assert np.array_equal(quarter.matrices[2, 2], [0, -4096, 4096, 0])
    (down,) = direction_fields(surface, charts, parse_direction("v"), 300.0)
    assert np.array_equal(down.nodes, quarter.nodes)
    (twice,) = direction_fields(surface, charts, parse_direction("u"), 600.0)
    assert np.array_equal(twice.matrices[0, 0], [8192, 0, 0, 8192])


@pytest.mark.parametrize("spec", ["torus", "cyclide"])
@pytest.mark.parametrize("direction", ["u", "v", "37.5", "0.3,-0.2,1", "around:z", "around:1,2,3"])
def test_true_scale_everywhere(spec, direction):
    rho, found = laid(surface_from_spec(spec), direction)
    for _, down, right, m in found:
        area = np.linalg.norm(np.cross(down, right), axis=-1)
        assert np.abs(np.log2(np.linalg.det(m) / (rho * rho * area))).max() < 2 * 0.5 / 32 + 0.02
        e1, e2 = runs_along(down, right, m)
        for e in (e1, e2):
            assert np.abs(np.log2(np.linalg.norm(e, axis=-1) * rho)).max() < 0.05
        e1, e2 = unit(e1), unit(e2)
        assert np.abs(np.einsum("ijk,ijk->ij", e1, e2)).max() < 1.1 * QUANTUM
        outward = unit(np.cross(down, right))
        assert (np.einsum("ijk,ijk->ij", np.cross(e1, outward), e2) > 0.99).all()


def wanted(direction, points, down, right):
    normal = unit(np.cross(down, right))
    u = unit(right)
    if direction == "u":
        return u
    if direction == "v":
        return unit(down)
    if direction == "-20":
        angle = math.radians(-20)
        return math.cos(angle) * u + math.sin(angle) * np.cross(u, normal)
    vectors = {
        "1,0.2,0": lambda: np.broadcast_to([1, 0.2, 0], points.shape),
        "around:x": lambda: np.cross([1.0, 0, 0], points),
    }.get(direction, lambda: swirl(points.reshape(-1, 3)).reshape(points.shape))()
    return vectors - np.einsum("ijk,ijk->ij", vectors, normal)[..., None] * normal


@pytest.mark.parametrize("direction", ["u", "v", "-20", "1,0.2,0", "around:x", swirl])
@pytest.mark.parametrize("spec", ["torus", "sphere", "cone"])
def test_the_exemplar_runs_along_the_direction(spec, direction):
    line = direction in ("1,0.2,0", "around:x")
    for points, down, right, m in laid(surface_from_spec(spec), direction)[1]:
        e1 = unit(runs_along(down, right, m)[0])
        asked = wanted(direction, points, down, right)
        length = np.linalg.norm(asked, axis=-1)
        strong = length > 0.2 * np.linalg.norm(points, axis=-1).max()
        cosine = np.einsum("ijk,ijk->ij", e1, unit(np.where(strong[..., None], asked, 1)))[strong]
        assert ((np.abs(cosine) if line else cosine) > math.cos(1.1 * QUANTUM)).all()


def test_a_line_field_has_one_sign_all_over_the_surface():
    # Projected on a torus, z vanishes along the top and bottom circles and turns round there.
    surface = torus()
    _, found = laid(surface, "0,0,1")
    turning = []
    for points, down, right, m in found:
        e1 = unit(runs_along(down, right, m)[0])
        for axis in (0, 1):
            neighbours = np.einsum(
                "ijk,ijk->ij",
                *(np.take(e1, k, axis) for k in (range(1, e1.shape[axis]), range(e1.shape[axis] - 1))),
            )
            assert neighbours.min() > 0.5
        # One way round the tube everywhere.
        centre = 2.0 * unit(points * [1, 1, 0])
        around = np.cross(np.cross([0.0, 0, 1], centre), points - centre)
        turning.append(np.sign(np.einsum("ijk,ijk->ij", around, e1)).ravel())
    assert len(set(np.concatenate(turning))) == 1


@pytest.mark.parametrize("direction", ["u", "0,0,1", "around:z", "around:x", swirl])
@pytest.mark.parametrize("spec", ["sphere", "sphere:tiling=octants", "cone:r2=0", "ellipsoid"])
def test_singular_points_and_poles_do_no_harm(spec, direction):
    surface = surface_from_spec(spec)
    charts = density_layout(surface, texels=200_000)
    rho = texture_scale(surface, 256, texels=200_000).density
    for field in direction_fields(surface, charts, parse_direction(direction), rho):
        m = field.matrices.reshape(-1, 2, 2) / 4096
        assert (np.linalg.det(m) > 0).all()
        assert np.abs(m).max() < 8


def test_where_there_is_no_direction_it_comes_from_near_by():
    surface = plane(1.0, 1.0)
    charts = (Chart(0, 256, 256),)

    def hole(points):
        inside = np.linalg.norm(points, axis=1, keepdims=True) < 0.3
        return np.where(inside, [0, 0, 1.0], [0, -1.0, 0])

    (field,) = direction_fields(surface, charts, parse_direction(hole), 256.0)
    assert np.array_equal(field.nodes, np.broadcast_to([0, 0, 192, 0], field.nodes.shape))


def test_a_direction_that_turns_far_keeps_its_sign():
    surface = plane(1.0, 1.0)
    charts = (Chart(0, 256, 128, 0, 1, 0, 0.5), Chart(0, 256, 128, 0, 1, 0.5, 1))

    def turning(points):
        angle = -1.5 * np.pi * (points[:, :1] + 0.5)
        return np.hstack([np.cos(angle), np.sin(angle), 0 * angle])

    for chart, field in zip(
        charts, direction_fields(surface, charts, parse_direction(turning), 256.0), strict=True
    ):
        columns = 256 * chart.t0 + 32 * np.arange(5) + 0.5
        # Texel columns turn against the direction, seen from the exemplar.
        apart = (field.nodes[2, 1:6, 2] + 192 * columns / 256 + 128) % 256 - 128
        assert np.abs(apart).max() <= 1


def test_rings_of_few_nodes_keep_their_sign():
    # From node to node of the chart round the bottom's pole its rows turn by more than a quarter turn.
    surface = surface_from_spec("vase")
    charts = density_layout(surface, texels=2**20)
    scale = texture_scale(surface, 128, texels=2**20).density
    fields = direction_fields(surface, charts, parse_direction("around:z"), scale)
    rings = [n for n, chart in enumerate(charts) if chart.t1 - chart.t0 == 4]
    assert rings
    assert charts[rings[0]].width < 5 * FIELD_STEP
    for n in rings:
        columns = np.arange(charts[n].width, dtype=float)
        along = fields[n].at(np.full(len(columns), charts[n].height / 2), columns)[:, 1, 1]
        assert np.abs(along / along.mean() - 1).max() < 0.35


def test_margins_go_on_from_the_border():
    surface = torus()
    charts = (Chart(0, 100, 150, 0, 1, 3, 4), Chart(0, 64, 96, 0.25, 0.5, 3, 4))
    for direction in ("u", "0,0,1", "around:z"):
        one, three = (
            direction_fields(surface, charts, parse_direction(direction), 80.0, margin=k) for k in (1, 3)
        )
        for chart, small, large in zip(charts, one, three, strict=True):
            assert large.nodes.shape[:2] == (node_count(chart.height, 3), node_count(chart.width, 3))
            assert np.array_equal(small.nodes, large.nodes[2:-2, 2:-2])
    # Beyond its edge a chart goes on as its face does; beyond the face, as its last patch's own formula.
    for column, patch, beyond in ((0, 1, 0), (3, 3, 1)):
        chart = Chart(0, 128, 128, 0, 1, column, column + 1)
        (field,) = direction_fields(surface, (chart,), parse_direction("u"), 80.0, margin=1)
        _, _, by_t = surface.patches[patch].derivatives_grid([0.5], [beyond + (32 + 0.5) / 128])
        size = 80.0 * np.linalg.norm(by_t[0, 0]) / 128
        assert field.matrices[3, -1, 3] / 4096 == pytest.approx(size, rel=0.02)
        assert field.matrices[3, -1, 3] != field.matrices[3, -2, 3]


def test_where_derivatives_jump_a_field_goes_on_by_its_own_formula():
    # The right half's parameter runs three times as fast.
    grid = np.array([[[x, -y, 0.0] for x in (0, 1, 4)] for y in (0, 2)])
    face = Face([[RationalPatch.from_points(grid[:, :2]), RationalPatch.from_points(grid[:, 1:])]])
    assert face.breaks == ((), (1,))
    charts = (Chart(0, 128, 64), Chart(0, 128, 192, t0=1, t1=2))
    fields = direction_fields(Surface([face]), charts, parse_direction("u"), 64.0)
    assert all(field.is_identity for field in fields)


@pytest.mark.parametrize(
    ("spec", "text"),
    [
        ("cyclide", "v"),
        ("torus", "v"),
        ("torus:R=2,r=1.9", "v"),
        ("vase", "u"),
        ("cone", "u"),
        ("plane:spans=2x2", "u"),
        ("sphere", "level"),
    ],
)
def test_the_default_suits_the_surface(spec, text):
    assert default_direction(surface_from_spec(spec)).text == text


def test_creases_are_unfolded():
    # Two squares, one lying, one standing: u goes on round the crease.
    lying = [[[0, 0, 0], [1, 0, 0]], [[0, -1, 0], [1, -1, 0]]]
    standing = [[[1, 0, 0], [1, 0, -1]], [[1, -1, 0], [1, -1, -1]]]
    patches = [RationalPatch.from_points(np.array(x, float)) for x in (lying, standing)]
    assert default_direction(Surface(patches)).text == "u"
    turned = RationalPatch.from_points(
        np.array([[standing[1][0], standing[0][0]], [standing[1][1], standing[0][1]]])
    )
    assert default_direction(Surface([patches[0], turned])).text == "level"


@pytest.mark.parametrize(
    "text", ["u", " v ", "45", "-1e1", "1,2,3", "around:z", "around: 0,1,1", "1e300,0,0"]
)
def test_directions_are_read(text):
    found = parse_direction(text)
    assert found.text == text.strip()
    if found.vectors is not None:
        assert np.asarray(found.vectors(np.ones((5, 3)))).shape == (5, 3)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "w",
        "uv",
        "1,2",
        "1,2,3,4",
        "around",
        "around:",
        "around:w",
        "nan",
        "inf,0,0",
        "0,0,0",
        "around:0,0,0",
        "u:z",
        "1e9",
        "1e400,0,0",
    ],
)
def test_wrong_directions_are_refused(text):
    with pytest.raises(InputError, match=r"direction is .*; allowed: ") as caught:
        parse_direction(text)
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="direction is a list"):
        parse_direction([1, 2, 3])


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda p: np.where(p[:, :1] > 1.9, np.nan, p), r"not finite on (chart|patch) \d+.*, at \("),
        (lambda p: p * 0, r"no part along the surface on chart 0 \(face 0\), at \("),
        (lambda p: p[:1], "returns shape"),
        (lambda p: "round", "the function fails"),
    ],
)
def test_wrong_fields_are_refused(function, message):
    surface = torus()
    charts = density_layout(surface, texels=100_000)
    with pytest.raises(InputError, match=message) as caught:
        direction_fields(surface, charts, parse_direction(function), 100.0)
    assert "\n" not in str(caught.value)


def test_wrong_numbers_are_refused():
    surface = plane()
    charts = (Chart(0, 64, 64),)
    u = parse_direction("u")
    for scale in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="scale is"):
            direction_fields(surface, charts, u, scale)
    with pytest.raises(InputError, match="margin is 65"):
        direction_fields(surface, charts, u, 64.0, margin=65)
    with pytest.raises(InputError, match="face 7"):
        direction_fields(surface, (Chart(7, 64, 64),), u, 64.0)
    with pytest.raises(InputError, match=r"no part along the surface on chart 0 \(face 0\)"):
        direction_fields(surface, charts, parse_direction("0,0,1"), 64.0)


def test_a_patch_without_area_gives_some_field():
    point = RationalPatch.from_points(np.zeros((2, 2, 3)))
    surface = Surface([*sphere().patches, point])
    fields = direction_fields(surface, (Chart(6, 64, 64),), parse_direction("u"), 64.0)
    assert not fields[0].is_identity
    assert (np.linalg.det(fields[0].matrices.reshape(-1, 2, 2).astype(float)) > 0).all()


def test_gaps_are_filled_from_next_to_them():
    good = np.zeros((2, 4, 5), bool)
    good[0, 1, 2] = True
    found = from_nearest(good)
    assert (found[0] == 7).all()
    assert np.array_equal(found[1].ravel(), np.arange(20))
    good[1, :, 0] = good[1, :, 4] = True
    assert (from_nearest(good)[1] // 5 == np.arange(4)[:, None]).all()


def test_signs_follow_the_strongest_node():
    rng = np.random.default_rng(5)
    angle = np.linspace(0, 2, 6)[:, None] + np.linspace(0, 3, 8)
    smooth = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    signs = rng.choice([-1.0, 1.0], (3, 6, 8, 1))
    strength = rng.uniform(size=(3, 6, 8))
    found = aligned(signs * smooth, strength)
    for k in range(3):
        node = np.unravel_index(strength[k].argmax(), (6, 8))
        assert np.array_equal(found[k], signs[k][node] * smooth)


def box():
    """A unit box of six patches, rows of the walls downward."""
    corners = (
        *(((0, 0, 1), (1, 0, 0), (0, 0, -1)), ((1, 0, 1), (0, 1, 0), (0, 0, -1))),
        *(((1, 1, 1), (-1, 0, 0), (0, 0, -1)), ((0, 1, 1), (0, -1, 0), (0, 0, -1))),
        *(((0, 1, 1), (1, 0, 0), (0, -1, 0)), ((0, 0, 0), (1, 0, 0), (0, 1, 0))),
    )
    nets = [np.array([[o, o + r], [o + d, o + r + d]]) for o, r, d in np.array(corners, float)]
    return Surface([RationalPatch.from_points(net) for net in nets])


def turn(field):
    """The angle of a field's rows of pixels to rows of texels at the chart's middle, in degrees."""
    matrix = field.at(np.array([30.0]), np.array([30.0]))[0]
    return math.degrees(math.atan2(-matrix[0, 1], matrix[1, 1]))


@pytest.mark.parametrize("text", ["level", "0,0,1", "around:z"])
def test_a_chart_without_direction_takes_it_from_beside(text):
    surface = box()
    charts = tuple(Chart(n, 64, 64) for n in range(6))
    fields = direction_fields(surface, charts, parse_direction(text), 64.0)
    if text == "0,0,1":
        # Upward on the walls; over the edge it goes on straight.
        assert [abs(turn(field)) for field in fields[:4]] == pytest.approx([90] * 4, abs=1.5)
    elif text == "level":
        assert [turn(field) for field in fields[:4]] == pytest.approx([0] * 4, abs=1.5)
    if text != "around:z":
        # At the edges that the lids share with the wall before them, what lies beyond is what M makes of it.
        for lid in (4, 5):
            goes_on = []
            for transition in transitions(surface, charts, find_seams(surface, charts)):
                seam = transition.seam
                if seam.other_chart == lid and seam.chart < 4:
                    here = fields[seam.chart].at(np.array([30.0]), np.array([30.0]))[0]
                    there = fields[lid].at(np.array([30.0]), np.array([30.0]))[0] @ transition.matrices[4]
                    goes_on.append(np.abs(here - there).max() < 0.05)
            assert any(goes_on)


def test_level_is_round_the_axis_on_a_sphere_and_along_rows_where_all_is_flat():
    surface = sphere()
    charts = density_layout(surface, texels=60_000)
    level, around = (
        direction_fields(surface, charts, parse_direction(text), 50.0) for text in ("level", "around:z")
    )
    for chart, one, other in zip(charts, level, around, strict=True):
        inside = np.meshgrid(np.arange(4.0, chart.height, 16), np.arange(4.0, chart.width, 16), indexing="ij")
        a, b = one.at(*inside), other.at(*inside)
        assert np.quantile(np.minimum(np.abs(a - b), np.abs(a + b)).max(axis=(-2, -1)), 0.9) < 0.1
    (flat,) = direction_fields(plane(), (Chart(0, 64, 64),), parse_direction("level"), 64.0)
    assert flat.is_identity


def test_sizes_are_nearly_right_on_charts_that_are_shorter_than_a_step_of_nodes():
    surface = surface_from_spec("vase")
    charts = density_layout(surface, texels=400_000)
    rho = texture_scale(surface, 256, texels=400_000).density
    fields = direction_fields(surface, charts, parse_direction("around:z"), rho)
    right, total = 0.0, 0.0
    for chart, field in zip(charts, fields, strict=True):
        if min(chart.height, chart.width) > FIELD_STEP:
            continue
        s, t = (
            low + (high - low) * (np.arange(count) + 0.5) / count
            for low, high, count in (
                (chart.s0, chart.s1, chart.height),
                (chart.t0, chart.t1, chart.width),
            )
        )
        _, by_s, by_t = surface.faces[chart.face].derivatives_grid(s, t)
        area = np.linalg.norm(np.cross(by_s, by_t), axis=2)
        area *= (s[1] - s[0]) * (t[1] - t[0]) * rho**2
        at = np.meshgrid(np.arange(float(chart.height)), np.arange(float(chart.width)), indexing="ij")
        size = np.sqrt(area / np.linalg.det(field.at(*at)))
        right, total = right + area[np.abs(np.log(size)) < np.log(1.05)].sum(), total + area.sum()
    assert right > 0.6 * total
