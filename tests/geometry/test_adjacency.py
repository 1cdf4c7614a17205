"""Which edges meet: counts, orientation, T-junctions, claims that overlap."""

import itertools
import re
import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.geometry.built_in.cyclide import ring_cyclide, torus
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.revolution import cone, cylinder, ellipsoid, vase
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.adjacency import BorderInterval, SharedEdge
from upholster.geometry.patches.bernstein import bernstein
from upholster.geometry.patches.edges import Edges
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface

U = np.linspace(0.0, 1.0, 17)


def along(surface: Surface, patch: int, edge: int, u: FloatArray) -> FloatArray:
    """Points of an edge."""
    net = surface.patches[patch].edge(edge)
    h = bernstein(len(net) - 1, u) @ net
    return np.asarray(h[:, :3] / h[:, 3:])


def check(surface: Surface, gap: float = 1e-12) -> None:
    """What holds for every surface: both views agree, points coincide, every edge is covered exactly once."""
    covered: dict[tuple[int, int], float] = dict.fromkeys(
        itertools.product(range(len(surface.patches)), range(4)), 0.0
    )
    for m in surface.shared:
        assert (m.patch, m.edge) <= (m.other_patch, m.other_edge)
        assert 0 <= m.start < m.stop <= 1
        assert m.flipped().flipped() == m
        assert m in surface.neighbours(m.patch, m.edge)
        assert m.flipped() in surface.neighbours(m.other_patch, m.other_edge)
        assert m.opposed == (m.other_start > m.other_stop)
        here = along(surface, m.patch, m.edge, m.start + U * (m.stop - m.start))
        there = along(
            surface, m.other_patch, m.other_edge, m.other_start + U * (m.other_stop - m.other_start)
        )
        assert np.abs(here - there).max() <= gap * surface.size
        for view in (m, m.flipped()):
            covered[view.patch, view.edge] += view.stop - view.start
    for b in surface.border:
        covered[b.patch, b.edge] += b.stop - b.start
    for key, share in covered.items():
        if key in surface.degenerate:
            assert share == 0
            assert surface.neighbours(*key) == ()
        else:
            assert share == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(
    ("build", "shared", "border", "degenerate"),
    [
        (ring_cyclide, 32, 0, 0),
        (lambda: ring_cyclide(6, 2, 6), 28, 0, 8),
        (lambda: ring_cyclide(5, 4, 4.5, spans=(6, 8)), 96, 0, 0),
        (torus, 32, 0, 0),
        (sphere, 12, 0, 0),
        (lambda: sphere(tiling="octants"), 12, 0, 8),
        (ellipsoid, 12, 0, 8),
        (cylinder, 4, 8, 0),
        (cone, 4, 8, 0),
        (lambda: cone(1, 0, 1), 4, 4, 4),
        (vase, 76, 0, 8),
        (plane, 0, 4, 0),
        (lambda: plane(3, 1, spans=(2, 3)), 7, 10, 0),
    ],
)
def test_counts_and_gaps(build: Callable[[], Surface], shared: int, border: int, degenerate: int) -> None:
    surface = build()
    check(surface)
    assert len(surface.shared) == shared
    assert len(surface.border) == border
    assert len(surface.degenerate) == degenerate
    assert all(m.whole for m in surface.shared)


def test_six_patch_sphere_meets_in_all_rotations() -> None:
    surface = sphere()
    assert len({(m.edge, m.other_edge, m.opposed) for m in surface.shared}) >= 7
    for patch in range(6):
        others = {surface.neighbours(patch, edge)[0].other_patch for edge in range(4)}
        opposite = {0: 2, 1: 3, 2: 0, 3: 1, 4: 5, 5: 4}[patch]
        assert others == set(range(6)) - {patch, opposite}


def test_octants_are_degenerate_at_the_poles_only() -> None:
    assert sphere(tiling="octants").degenerate == {(p, 0 if p < 4 else 2) for p in range(8)}


def test_views_of_a_split_plane() -> None:
    left, right = RationalPatch.from_points([[(0, 1, 0), (1, 1, 0)], [(0, 0, 0), (1, 0, 0)]]).split(t=0.5)
    top, bottom = right.split(s=0.25)
    surface = Surface([left, top.reverse(0), bottom])
    check(surface)
    assert surface.shared == (
        SharedEdge(0, 1, 0.0, 0.25, 1, 3, 1.0, 0.0),
        SharedEdge(0, 1, 0.25, 1.0, 2, 3, 0.0, 1.0),
        SharedEdge(1, 0, 0.0, 1.0, 2, 0, 0.0, 1.0),
    )
    assert [m.other_patch for m in surface.neighbours(0, 1)] == [1, 2]
    assert surface.neighbours(1, 3) == (SharedEdge(1, 3, 0.0, 1.0, 0, 1, 0.25, 0.0),)
    assert BorderInterval(0, 0, 0.0, 1.0) in surface.border


def test_a_border_may_be_part_of_an_edge() -> None:
    def square(x: float, y: float, size: float) -> RationalPatch:
        return RationalPatch.from_points(
            [[(x, y + size, 0), (x + size, y + size, 0)], [(x, y, 0), (x + size, y, 0)]]
        )

    surface = Surface([square(0, 0, 4), square(4, 1, 2), square(6, 2, 3)])
    check(surface)
    assert [b for b in surface.border if (b.patch, b.edge) == (0, 1)] == [
        BorderInterval(0, 1, 0.0, 0.25),
        BorderInterval(0, 1, 0.75, 1.0),
    ]
    # bricks in running bond: neither edge holds the other
    (meeting,) = surface.neighbours(1, 1)
    assert (meeting.start, meeting.stop, meeting.other_patch) == (0.0, 0.5, 2)
    assert (meeting.other_start, meeting.other_stop) == pytest.approx((2 / 3, 1.0))


Turn = Callable[[RationalPatch], RationalPatch]
TURNS: list[Turn] = [
    lambda p: p,
    lambda p: p.transpose().reverse(0),
    lambda p: p.reverse(0).reverse(1),
    lambda p: p.transpose().reverse(1),
]


@settings(max_examples=15, deadline=None)
@given(st.data())
def test_any_splits_and_turns_of_a_closed_surface_stay_closed(data: st.DataObject) -> None:
    builders: list[Callable[[], Surface]] = [ring_cyclide, sphere, lambda: sphere(tiling="octants"), vase]
    build = data.draw(st.sampled_from(builders))
    patches = list(build().patches)
    for _ in range(data.draw(st.integers(1, 12))):
        k = data.draw(st.integers(0, len(patches) - 1))
        at: Any = {data.draw(st.sampled_from("st")): data.draw(st.floats(0.2, 0.8))}
        patches[k : k + 1] = patches[k].split(**at)
    patches = [data.draw(st.sampled_from(TURNS))(patch) for patch in patches]
    surface = Surface(patches)
    check(surface, 1e-9)
    assert surface.border == ()


def test_degrees_and_weights_may_differ_along_an_edge() -> None:
    first, second, *rest = ring_cyclide().patches
    second = RationalPatch(second.elevate(4, 3).net * 2.5)
    surface = Surface([first, second, *rest])
    check(surface)
    assert len(surface.shared) == 32


def test_a_patch_may_meet_itself() -> None:
    angles = np.linspace(0, 2 * np.pi, 7)
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)
    ring[-1] = ring[0]
    surface = Surface([RationalPatch.from_points(np.stack([ring + np.array([0, 0, 1.0]), ring]))])
    check(surface)
    assert surface.shared == (SharedEdge(0, 1, 0.0, 1.0, 0, 3, 0.0, 1.0),)
    assert len(surface.border) == 2


def test_edges_that_share_only_their_ends_do_not_meet() -> None:
    def arc(bulge: float) -> RationalPatch:
        top = [(0.0, 0.0, 0.0), (1.0, bulge, 0.0), (2.0, 0.0, 0.0)]
        bottom = [(0.0, 0.0, 1.0), (1.0, 0.0, 1.0 + bulge), (2.0, 0.0, 1.0)]
        return RationalPatch.from_points(np.array([top, bottom]))

    surface = Surface([arc(1.0), arc(-1.0), arc(0.3)])
    # the straight sides at x = 0 and x = 2 are shared by all three
    with pytest.raises(InputError, match="more than two edges"):
        surface.shared  # noqa: B018
    surface = Surface([arc(1.0), arc(-1.0)])
    assert {(m.edge, m.other_edge) for m in surface.shared} == {(1, 1), (3, 3)}


@pytest.mark.slow(reason="thousands of edges")
@pytest.mark.parametrize("kind", ["alike", "nearly alike", "longer and longer"])
def test_a_crowd_of_edges_is_refused_in_little_memory(kind: str) -> None:
    def leaf(n: int) -> RationalPatch:
        width = 1.0 + (
            n / count if kind == "longer and longer" else 1e-11 * n if kind == "nearly alike" else 0.0
        )
        angle = 0.0 if kind == "alike" else 3.0 * n / count
        x, y = np.cos(angle), np.sin(angle)
        return RationalPatch.from_points([[(-width, 0, 0), (width, 0, 0)], [(-width, x, y), (width, x, y)]])

    count = 800
    surface = Surface([leaf(n) for n in range(count)])
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="more than two edges"):
            surface.shared  # noqa: B018
        assert tracemalloc.get_traced_memory()[1] < 120e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("parts", [0, 1, 2])
def test_three_edges_in_one_place_are_named(parts: int) -> None:
    def leaf(angle: float) -> RationalPatch:
        x, y = np.cos(angle), np.sin(angle)
        return RationalPatch.from_points([[(0, 0, 1), (x, y, 1)], [(0, 0, 0), (x, y, 0)]])

    leaves = [leaf(0.0), leaf(1.0), leaf(2.0)]
    for k in range(parts):
        leaves[2 - k : 3 - k] = leaves[2 - k].split(s=0.3 + 0.2 * k)
    with pytest.raises(InputError, match=re.escape("patch 0 edge 3")) as caught:
        Surface(leaves).shared  # noqa: B018
    assert str(caught.value).count("edge 3") == 3
    assert "\n" not in str(caught.value)


def test_a_third_edge_along_the_middle_of_two_is_named() -> None:
    hinge = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    leaves = [
        RationalPatch.from_points([hinge, hinge + np.array(way)]) for way in ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    ]
    middle = leaves[2].split(t=0.25)[1].split(t=0.5)[0]
    with pytest.raises(InputError, match="patch 0 edge 0"):
        Surface([*leaves[:2], middle]).shared  # noqa: B018


def test_tolerance_is_relative_to_the_size() -> None:
    for scale in (1e-6, 1.0, 1e6):
        left, right = plane(scale, scale, spans=(1, 2)).patches
        for gap, meets in ((1e-11, True), (1e-6, False)):
            moved = RationalPatch(right.net + np.array([0, 0, gap * scale, 0]))
            assert len(Surface([left, moved]).shared) == meets
            assert len(Surface([left, moved], tolerance=1e-5).shared) == 1


@pytest.mark.slow(reason="thousands of parts")
def test_many_patches_are_compared_with_few(monkeypatch: pytest.MonkeyPatch) -> None:
    compared: list[int] = []
    points = Edges.points

    def counted(self: Edges, edges: Any, parameters: Any) -> Any:
        compared.append(np.size(parameters))
        return points(self, edges, parameters)

    monkeypatch.setattr(Edges, "points", counted)
    surface = plane(1, 1, spans=(100, 100))
    assert len(surface.shared) == 19_800
    assert len(surface.border) == 400
    # 40,000 edges; a search of each among all would look at thousands of times as many points
    assert 40_000 <= sum(compared) <= 40 * 40_000


def test_bad_surfaces_are_named() -> None:
    with pytest.raises(InputError, match="0 patches"):
        Surface([])
    with pytest.raises(InputError, match="face 1 is a str"):
        Surface([plane().patches[0], "x"])  # type: ignore[list-item]
    with pytest.raises(InputError, match="tolerance is nan"):
        Surface(plane().patches, tolerance=float("nan"))
    for patch, edge in ((1, 0), (-1, 0), (0, 4)):
        with pytest.raises(InputError, match=f"patch {patch} edge {edge}"):
            plane().neighbours(patch, edge)


def test_size_is_the_diagonal_of_the_control_points() -> None:
    assert plane(3, 4).size == pytest.approx(5.0)
    point = Surface([RationalPatch.from_points(np.ones((2, 2, 3)))])
    assert point.size == 0
    assert len(point.degenerate) == 4
    assert point.shared == ()
    assert point.border == ()


def height_field(n: int, noise: float, tolerance: float) -> Surface:
    """n × n cubic patches of a smooth height field over [0, n]², every point moved a little."""
    rng = np.random.default_rng(n)
    steps = np.linspace(0.0, 1.0, 4)
    patches = []
    for i, j in itertools.product(range(n), range(n)):
        x, y = np.meshgrid(i + steps, j + steps, indexing="ij")
        points = np.stack([x, y, 0.3 * np.sin(x) * np.cos(y)], axis=-1)
        patches.append(RationalPatch.from_points(points + noise * rng.standard_normal(points.shape)))
    return Surface(patches, tolerance=tolerance)


@pytest.mark.parametrize(
    ("n", "noise", "tolerance"),
    [(3, 1e-6, 1e-3), (3, 1e-6, 1e-5), (3, 1e-6, 1e-2), (10, 1e-6, 1e-5), (10, 0.0, 1e-9), (3, 1e-3, 1e-3)],
)
def test_a_tolerance_heals_noise_and_makes_no_edges_of_its_own(
    n: int, noise: float, tolerance: float
) -> None:
    surface = height_field(n, noise, tolerance)
    assert len(surface.shared) == 2 * n * (n - 1)
    assert all(one.whole for one in surface.shared)
    assert len(surface.border) == 4 * n
    assert surface.nearly_meeting == (0, tolerance)


def test_edges_that_nearly_meet_are_counted() -> None:
    surface = height_field(10, 1e-6, 1e-9)
    count, tolerance = surface.nearly_meeting
    assert len(surface.shared) + count == 180
    healed = Surface(surface.patches, tolerance=tolerance)
    assert len(healed.shared) == 180
    assert tolerance == 1e-6
    for closed in (torus(), plane(), cylinder()):
        assert closed.nearly_meeting == (0, 1e-9)


def test_a_sliver_thinner_than_the_tolerance_joins_its_two_neighbours() -> None:
    # three strips side by side, the middle one far thinner than the tolerance
    ends = [0.0, 1.0, 1.0 + 1e-6, 2.0]
    strips = [
        RationalPatch.from_points([[(a, 1, 0), (b, 1, 0)], [(a, 0, 0), (b, 0, 0)]])
        for a, b in itertools.pairwise(ends)
    ]
    shared = Surface(strips, tolerance=1e-4).shared
    assert [(m.patch, m.edge, m.other_patch, m.other_edge) for m in shared] == [(0, 1, 1, 3), (1, 1, 2, 3)]
