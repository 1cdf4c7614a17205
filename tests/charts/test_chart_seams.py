"""Where charts meet: points of their edges stay where they are."""

import numpy as np
import pytest
from chart_layouts import SURFACES, split, whole

from upholster.base.errors import InputError
from upholster.charts.chart_seams import find_seams
from upholster.geometry.built_in.plane import plane
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart

LAYOUTS = {f"{name}, {how.__name__}": (s, how(s)) for name, s in SURFACES.items() for how in (whole, split)}


@pytest.fixture(params=LAYOUTS)
def layout(request):
    surface, charts = LAYOUTS[request.param]
    return surface, charts, find_seams(surface, charts)


def points(surface, chart, edge, along):
    """Return the points (n, 3) at texels along an edge of a chart."""
    low, high, size = (chart.s0, chart.s1, chart.height) if edge & 1 else (chart.t0, chart.t1, chart.width)
    place = low + (high - low) * along / size
    line = np.full(len(along), (chart.s0, chart.t1, chart.s1, chart.t0)[edge])
    return surface.faces[chart.face].points(*((place, line) if edge & 1 else (line, place)))


def test_a_point_of_the_edge_is_the_same_point_on_the_other_chart(layout):
    surface, charts, found = layout
    assert found
    for m in found:
        a = points(surface, charts[m.chart], m.edge, np.linspace(m.start, m.stop, 12))
        there = np.linspace(m.other_start, m.other_stop, 12)
        b = points(surface, charts[m.other_chart], m.other_edge, there)
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-6 * surface.size)


def test_meetings_cover_each_edge_once(layout):
    surface, charts, found = layout
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


def test_a_chart_may_meet_itself_or_charts_of_its_own_patch():
    angle = np.linspace(0, 2 * np.pi, 4)
    net = np.zeros((2, 4, 3))
    net[:, :, 0], net[:, :, 1] = np.cos(angle), np.sin(angle)
    net[1, :, 2] = -1
    surface = Surface([RationalPatch.from_points(net)])
    one = (Chart(0, 40, 60),)
    found = find_seams(surface, one)
    assert [(m.chart, m.edge, m.other_chart, m.other_edge) for m in found] == [(0, 1, 0, 3), (0, 3, 0, 1)]
    assert (found[0].start, found[0].stop, found[0].other_start, found[0].other_stop) == (0, 40, 0, 40)
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
