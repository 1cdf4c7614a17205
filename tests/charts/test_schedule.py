"""In which order charts are covered: no two at once that touch, always going on from finished ones."""

import numpy as np
import pytest
from chart_layouts import GRID, SURFACES, on_patch, split, whole

from upholster.charts.schedule import THIN, _cells, schedule
from upholster.charts.seams import find_seams
from upholster.geometry import RationalPatch, Surface, plane, ring_cyclide, torus
from upholster.quilt import Chart


def ordered(surface, charts):
    return schedule(surface, charts, find_seams(surface, charts))


def touching(surface, charts):
    """Return pairs of charts that have a point in common, of layouts by eighths, found in space."""
    points, owners = [], []
    for n, c in enumerate(charts):
        s, t = (
            np.arange(round(GRID * a), round(GRID * b) + 1) / GRID for a, b in ((c.s0, c.s1), (c.t0, c.t1))
        )
        points.append(surface.faces[c.face].points_grid(s, t).reshape(-1, 3))
        owners += [n] * len(points[-1])
    cloud, owner = np.concatenate(points), np.array(owners)
    pairs = set()
    for n in range(len(charts)):
        near = np.abs(points[n][:, None] - cloud).max(axis=2).min(axis=0) < 1e-7
        pairs |= {(n, int(o)) for o in np.unique(owner[near]) if o != n}
    return pairs


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", SURFACES)
def test_no_two_charts_of_a_round_touch(name, seed):
    surface = SURFACES[name]
    charts = split(surface, seed) if seed else whole(surface)
    sorted_out = ordered(surface, charts)
    assert sorted(n for members in sorted_out for n in members) == list(range(len(charts)))
    assert all(members == sorted(members) for members in sorted_out)
    pairs = touching(surface, charts)
    number = np.empty(len(charts), int)
    for k, members in enumerate(sorted_out):
        number[members] = k
    assert pairs
    assert all(number[a] != number[b] for a, b in pairs)
    # they grow from one chart: whoever comes later touches someone before
    assert len(sorted_out[0]) == 1
    for n in range(len(charts)):
        assert number[n] == 0 or any(a == n and number[b] < number[n] for a, b in pairs)


def test_a_grid_grows_from_its_corner():
    surface = plane(4, 4, spans=(4, 4))
    charts = tuple(on_patch(surface, n, 64, 64) for n in range(16))
    sorted_out = ordered(surface, charts)
    assert sorted_out[0] == [0]
    assert len(sorted_out) <= 10
    assert max(map(len, sorted_out)) >= 2
    assert schedule(surface, (), ()) == []


def test_separate_parts_are_covered_one_after_another():
    a, b = plane(2, 1, spans=(1, 2)).patches, plane(2, 1, spans=(1, 2)).patches
    far = [RationalPatch(p.net + 10.0 * np.array([1, 0, 0, 0])) for p in b]
    surface = Surface([a[0], far[0], a[1], far[1]])
    charts = tuple(Chart(n, 64, 64) for n in range(4))
    assert ordered(surface, charts) == [[0], [2], [1], [3]]


def test_thin_charts_come_first_and_keep_their_two_sides_apart():
    surface = plane(5, 1, spans=(1, 5))
    thin = THIN - 1
    # from chart 0 on: the thin one next to it first
    charts = tuple(on_patch(surface, n, 64, thin if n == 3 else 64) for n in range(5))
    assert ordered(surface, charts) == [[0], [1], [2], [3], [4]]
    surface = plane(3, 3, spans=(3, 3))
    charts = tuple(on_patch(surface, n, thin if n // 3 == 1 else 64, 64) for n in range(9))
    sorted_out = ordered(surface, charts)
    number = {n: k for k, members in enumerate(sorted_out) for n in members}
    assert all(number[3 + n] < number[6 + n] for n in range(3))
    assert all(number[n] != number[6 + n] for n in range(3))
    # thin ones wait for nobody but those that they touch
    assert sorted_out[1] == [3]
    # the same with rows just tall enough grows evenly
    even = tuple(on_patch(surface, n, THIN if n // 3 == 1 else 64, 64) for n in range(9))
    assert ordered(surface, even)[1] == [1]


@pytest.mark.parametrize("surface", [torus(), ring_cyclide()], ids=["torus", "cyclide"])
def test_nobody_is_covered_from_both_sides_of_a_thin_chart_at_once(surface):
    rng = np.random.default_rng(4)
    for _ in range(5):
        sizes = rng.choice([24, 64], len(surface.patches))
        charts = tuple(on_patch(surface, n, int(size), 64) for n, size in enumerate(sizes))
        found = find_seams(surface, charts)
        for members in schedule(surface, charts, found):
            for n, size in enumerate(sizes):
                beside = {m.other_chart for m in found if m.chart == n and m.other_chart != n}
                assert size >= THIN or len(beside & set(members)) <= 1


def test_rounds_of_one_patch():
    angle = np.linspace(0, 2 * np.pi, 4)
    net = np.zeros((2, 4, 3))
    net[:, :, 0], net[:, :, 1] = np.cos(angle), np.sin(angle)
    net[1, :, 2] = -1
    surface = Surface([RationalPatch.from_points(net)])  # it meets itself
    assert ordered(surface, (Chart(0, 40, 60),)) == [[0]]
    assert ordered(surface, (Chart(0, 40, 30, t1=0.5), Chart(0, 20, 30, t0=0.5))) == [[0], [1]]
    # lines parted by rounding
    surface, third = plane(), 1 / 3
    charts = (
        Chart(0, 8, 8, s1=third),
        Chart(0, 8, 8, s0=1 - 2 * third, s1=2 * third),
        Chart(0, 8, 8, s0=2 * third),
    )
    assert ordered(surface, charts) == [[0], [1], [2]]
    # and by more than points at one place are
    charts = (Chart(0, 8, 8, s1=0.5 - 4e-7), Chart(0, 8, 8, s0=0.5))
    assert ordered(surface, charts) == [[0], [1]]


def test_a_corner_on_anothers_edge_touches_it():
    # three patches fan out from the middle of a fourth one's edge, which the middle one touches in a point
    nets = [
        [[(-1, 0), (1, 0)], [(-1, -1), (1, -1)]],
        [[(-1, 1), (-0.5, 1)], [(-1, 0), (0, 0)]],
        [[(-0.5, 1), (0, 2)], [(0, 0), (0.5, 1)]],
        [[(0.5, 1), (1, 1)], [(0, 0), (1, 0)]],
    ]
    surface = Surface([RationalPatch.from_points([[(*p, 0) for p in row] for row in net]) for net in nets])
    charts = tuple(Chart(n, 16, 16) for n in (0, 1, 2, 3))
    found = find_seams(surface, charts)
    met = {(m.chart, m.other_chart) for m in found}
    assert {(0, 1), (0, 3), (1, 2), (2, 3)} < met
    assert (0, 2) not in met
    assert schedule(surface, charts, found) == [[0], [1], [2], [3]]


def test_points_at_one_place_share_a_cell_and_distant_ones_do_not():
    surface = ring_cyclide()
    rng = np.random.default_rng(3)
    low, high = surface.box
    points = low + (high - low) * rng.random((4000, 3))
    moved = points + surface.tolerance * surface.size * rng.uniform(-1, 1, points.shape)
    a, b = _cells(surface, points), _cells(surface, moved)
    assert ((a == b).any(axis=1)).all()
    assert (a != b).any()  # some boundary of some grid does pass between
    assert len(np.unique(a)) == a.size
