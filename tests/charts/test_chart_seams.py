"""Where charts meet: points stay where they are, and tangent planes unfold."""

import numpy as np
import pytest
from chart_layouts import SURFACES, split, whole

from upholster.charts.seams import find_seams
from upholster.charts.transitions import SAMPLES, transitions
from upholster.errors import InputError
from upholster.geometry import RationalPatch, Surface, plane
from upholster.quilt import Chart

INNER = np.linspace(0.0, 1.0, SAMPLES)[1:-1]
LAYOUTS = {f"{name}, {how.__name__}": (s, how(s)) for name, s in SURFACES.items() for how in (whole, split)}


@pytest.fixture(params=LAYOUTS)
def layout(request):
    surface, charts = LAYOUTS[request.param]
    found = find_seams(surface, charts)
    return surface, charts, found, transitions(surface, charts, found)


def derivatives(surface, chart, rows, columns):
    """Return the points at texel coordinates and the two derivatives per texel, (n, 3) each."""
    ds, dt = (chart.s1 - chart.s0) / chart.height, (chart.t1 - chart.t0) / chart.width
    s, t = chart.s0 + ds * (rows + 0.5), chart.t0 + dt * (columns + 0.5)
    point, by_s, by_t = surface.faces[chart.face].derivatives(s, t)
    return point, by_s * ds, by_t * dt


def beyond(chart, edge, along, depth):
    """Return the texel coordinates at places along an edge, so many texels beyond it."""
    along, depth = np.broadcast_arrays(np.asarray(along, float), depth)
    line = (-0.5, chart.width - 0.5, chart.height - 0.5, -0.5)[edge]
    across = line + (-depth if edge in (0, 3) else depth)
    return (along - 0.5, across) if edge in (1, 3) else (across, along - 0.5)


def inner(seam):
    return seam.start + (seam.stop - seam.start) * INNER


def test_a_point_of_the_edge_is_the_same_point_on_the_other_chart(layout):
    surface, charts, found, made = layout
    assert len(found) == len(made) > 0
    for m, transition in zip(found, made, strict=True):
        along = np.linspace(m.start, m.stop, 12)
        here = beyond(charts[m.chart], m.edge, along, 0.0)
        rows, columns, matrices = transition.apply(*here)
        a = derivatives(surface, charts[m.chart], *here)[0]
        b = derivatives(surface, charts[m.other_chart], rows, columns)[0]
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-6 * surface.size)
        assert np.isfinite(matrices).all()
        ends = np.linspace(m.other_start, m.other_stop, 12)
        np.testing.assert_allclose([rows, columns], beyond(charts[m.other_chart], m.other_edge, ends, 0.0))


def test_meetings_cover_each_edge_once(layout):
    surface, charts, found, _ = layout
    assert list(found) == sorted(found, key=lambda m: (m.chart, m.edge, m.start))
    assert sorted(map(repr, found)) == sorted(repr(m.flipped()) for m in found)
    for n, chart in enumerate(charts):
        for edge in range(4):
            size = (chart.width, chart.height)[edge & 1]
            parts = [(m.start, m.stop) for m in found if (m.chart, m.edge) == (n, edge)]
            line = (chart.s0, chart.t1, chart.s1, chart.t0)[edge]
            face = surface.faces[chart.face]
            joined = {
                e for m in surface.face_shared for e in ((m.face, m.edge), (m.other_face, m.other_edge))
            }
            if line == face.line(edge) and (chart.face, edge) not in joined:
                assert parts == []
                continue
            ends = np.array(parts).reshape(-1)
            np.testing.assert_allclose([ends[0], ends[-1]], [0, size], atol=1e-9)
            np.testing.assert_allclose(ends[1:-1:2], ends[2::2], atol=1e-9)


def test_the_matrix_keeps_lengths_and_angles(layout):
    surface, charts, found, made = layout
    for m, transition in zip(found, made, strict=True):
        here = beyond(charts[m.chart], m.edge, inner(m), 0.0)
        rows, columns, matrices = transition.apply(*here)
        a = np.stack(derivatives(surface, charts[m.chart], *here)[1:], axis=2)
        b = np.stack(derivatives(surface, charts[m.other_chart], rows, columns)[1:], axis=2) @ matrices
        metric = a.swapaxes(1, 2) @ a
        np.testing.assert_allclose(b.swapaxes(1, 2) @ b, metric, rtol=0, atol=1e-6 * np.abs(metric).max())
        # all these surfaces are smooth, so that steps are the same in space as well
        np.testing.assert_allclose(b, a, rtol=0, atol=1e-6 * np.abs(a).max())


def test_beyond_the_edge_it_is_right_to_first_order(layout):
    surface, charts, found, made = layout
    for m, transition in zip(found, made, strict=True):
        chart = charts[m.chart]
        errors = []
        for depth in (0.2, 0.1):
            # the patch's functions go on beyond its edge, on the same surface
            here = beyond(chart, m.edge, inner(m), depth)
            a, down, right = derivatives(surface, chart, *here)
            b = derivatives(surface, charts[m.other_chart], *transition.apply(*here)[:2])[0]
            errors.append(np.linalg.norm(a - b, axis=1).max() / np.linalg.norm(down + right, axis=1).max())
        assert errors[1] < 0.3 * errors[0] + 1e-6


def test_there_and_back_is_the_identity_to_first_order(layout):
    _, charts, found, made = layout
    backward = {repr(m): transition for m, transition in zip(found, made, strict=True)}
    for m, transition in zip(found, made, strict=True):
        back = backward[repr(m.flipped())]
        other = back.matrices[::-1] if m.other_start > m.other_stop else back.matrices
        np.testing.assert_allclose(
            other @ transition.matrices, np.tile(np.eye(2), (SAMPLES, 1, 1)), atol=1e-6
        )
        errors = []
        for depth in (0.02, 0.01):
            here = np.array(beyond(charts[m.chart], m.edge, inner(m), depth))
            there = transition.apply(*here)[:2]
            errors.append(np.abs(np.array(back.apply(*there)[:2]) - here).max())
        assert errors[1] < 0.3 * errors[0] + 1e-9


def test_equal_density_on_a_plane_gives_quarter_turns():
    turned = []
    for patch, symmetries in zip(plane(3, 3, spans=(3, 3)).patches, (0, 0, 1, 2, 1, 3, 0, 0, 2), strict=True):
        for _ in range(symmetries):
            patch = patch.transpose().reverse(0)
        turned.append(patch)
    surface = Surface(turned)
    charts = tuple(Chart(n, 20, 20) for n in range(9))
    seen = set()
    for transition in transitions(surface, charts, find_seams(surface, charts)):
        whole_numbers = np.rint(transition.matrices)
        np.testing.assert_allclose(transition.matrices, whole_numbers, atol=1e-9)
        np.testing.assert_allclose(np.linalg.det(whole_numbers), 1.0)
        seen.add(tuple(whole_numbers[0].ravel().astype(int)))
    assert len(seen) == 4


def crease(lean):
    """Return a floor and a wall at right angles; the wall's columns lean by so much over its height."""
    floor = [[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0)]]
    wall = [[(1, 0, 0), (1, 1, 0)], [(1, lean, 2), (1, 1 + lean, 2)]]
    return Surface([RationalPatch.from_points(p) for p in (floor, wall)])


@pytest.mark.parametrize("lean", [0.0, 0.8])
def test_a_crease_unfolds(lean):
    surface = crease(lean)
    charts = (Chart(0, 10, 10), Chart(1, 40, 30))  # 0.1 and 0.05 units per row
    found = find_seams(surface, charts)
    (ahead,) = (c for c in transitions(surface, charts, found) if c.seam.chart == 0)
    assert (ahead.seam.edge, ahead.seam.other_edge) == (2, 0)
    depth = np.array([-3.0, -1.0, 0.5, 2.0])
    rows, columns = ahead.apply(*beyond(charts[0], 2, np.full(4, 5.0), depth))[:2]
    np.testing.assert_allclose(rows, -0.5 + 2.0 * depth)  # before the edge of the one is before the other's
    y = (columns + 0.5) / 30 + lean * (rows + 0.5) / 40
    np.testing.assert_allclose(y, 0.5)  # straight on, whatever way the wall's columns lean


def test_beyond_an_intervals_end_its_last_matrix_holds():
    surface = plane(2, 1, spans=(1, 2))
    charts = (Chart(0, 10, 10), Chart(0, 20, 20, t0=1, t1=2))
    (transition, _) = transitions(surface, charts, find_seams(surface, charts))
    rows, columns, matrices = transition.apply(np.array([-3.0, 12.0]), np.array([9.0, 14.0]))
    np.testing.assert_allclose(rows, [-5.5, 24.5])
    np.testing.assert_allclose(columns, [-1.5, 8.5])
    np.testing.assert_allclose(matrices, np.tile(2.0 * np.eye(2), (2, 1, 1)), atol=1e-12)

    surface, charts = LAYOUTS["six, whole"]
    for transition in transitions(surface, charts, find_seams(surface, charts)):
        along = np.array([-7.0, 100.0])
        matrices = transition.apply(*beyond(charts[transition.seam.chart], transition.seam.edge, along, 2.0))[
            2
        ]
        np.testing.assert_array_equal(matrices, transition.matrices[[0, -1]])


def test_a_chart_may_meet_itself_or_charts_of_its_own_patch():
    angle = np.linspace(0, 2 * np.pi, 4)
    net = np.zeros((2, 4, 3))
    net[:, :, 0], net[:, :, 1] = np.cos(angle), np.sin(angle)
    net[1, :, 2] = -1
    surface = Surface([RationalPatch.from_points(net)])
    one = (Chart(0, 40, 60),)
    found = find_seams(surface, one)
    assert [(m.chart, m.edge, m.other_chart, m.other_edge) for m in found] == [(0, 1, 0, 3), (0, 3, 0, 1)]
    transition = transitions(surface, one, found)[0]
    assert transition.apply(np.array([3.0]), np.array([59.5]))[:2] == (3.0, -0.5)
    halves = (Chart(0, 40, 30, t1=0.5), Chart(0, 20, 30, t0=0.5))
    found = find_seams(surface, halves)
    assert [(m.chart, m.edge, m.other_chart, m.other_edge, m.other_stop) for m in found] == [
        (0, 1, 1, 3, 20.0),
        (0, 3, 1, 1, 20.0),
        (1, 1, 0, 3, 40.0),
        (1, 3, 0, 1, 40.0),
    ]


def test_lines_that_rounding_parts_are_one():
    surface = plane()
    third = 1 / 3
    charts = (
        Chart(0, 8, 8, s1=third),
        Chart(0, 8, 8, s0=1 - 2 * third, s1=2 * third),
        Chart(0, 8, 8, s0=2 * third),
    )
    assert charts[0].s1 != charts[1].s0
    found = find_seams(surface, charts)
    assert [(m.chart, m.other_chart, m.start, m.stop) for m in found] == [
        (0, 1, 0, 8),
        (1, 0, 0, 8),
        (1, 2, 0, 8),
        (2, 1, 0, 8),
    ]
    # parted by more than points at one place are, and yet they meet
    charts = (Chart(0, 8, 8, s1=0.5 - 4e-7), Chart(0, 8, 8, s0=0.5))
    assert [(m.chart, m.other_chart) for m in find_seams(surface, charts)] == [(0, 1), (1, 0)]


def test_where_a_chart_is_degenerate_nothing_is_carried():
    flat, crushed = plane(2, 1, spans=(1, 2)).patches
    net = np.array(crushed.elevate(1, 2).net)
    net[:, 1] = net[:, 0]  # no derivative across the edge that the two share
    surface = Surface([flat, RationalPatch(net)])
    charts = (Chart(0, 10, 10), Chart(1, 10, 10))
    found = find_seams(surface, charts)
    assert len(found) == 2
    for transition in transitions(surface, charts, found):
        assert np.isnan(transition.matrices).all()
        rows, columns, matrices = transition.apply(np.array([3.0]), np.array([3.0]))
        assert np.isnan([rows, columns]).any()
        assert np.isnan(matrices).all()


@pytest.mark.parametrize(
    ("chart", "says"),
    [
        (Chart(1, 8, 8), "chart 0 lies on face 1; allowed: 0 to 0"),
        (Chart(0, 0, 8), "chart 0 has 0 x 8 texels"),
        (Chart(0, 8, 8, s0=0.5, s1=0.5), "chart 0 reaches from 0.5 to 0.5"),
        (Chart(0, 8, 8, t1=float("nan")), "chart 0 reaches from 0 to nan"),
    ],
)
def test_what_is_no_chart_is_refused(chart, says):
    with pytest.raises(InputError, match=says):
        find_seams(plane(), (chart,))
