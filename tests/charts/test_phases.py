"""Phase fields: solved as SciPy solves them, closed where they can be, conjugate where a wave comes back."""

import numpy as np
import pytest
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg
from scipy.sparse.csgraph import connected_components

from upholster.charts.directions import Direction, direction_fields, parse_direction
from upholster.charts.layout import density_layout
from upholster.charts.phases import TURN, StraightPhases, phase_field, warped
from upholster.charts.phases._kernels import first_members
from upholster.charts.phases.chart_cells import chart_grids, chart_links
from upholster.charts.phases.links import Links, matched_waves, signed
from upholster.charts.phases.solving import (
    conjugate_phases,
    phase_system,
    smallest_phases,
    solved_phases,
)
from upholster.charts.seams import find_seams
from upholster.charts.transitions import transitions
from upholster.geometry import plane, torus
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import ANGLES, OCTAVE, UNIT, WarpField

BRICKS = np.array([(1 / 24, 0.0), (0.0, 1 / 32)])


def layout(scale=16.0, direction="around:z", turned=()):
    """Return a torus' charts, fields and transitions; some charts' fields are turned by half a turn."""
    surface = torus(2, 0.8)
    charts = density_layout(surface, density=20.0, ring=96)
    fields = list(direction_fields(surface, charts, parse_direction(direction), scale))
    for n in turned:
        nodes = fields[n].nodes.copy()
        nodes[..., 2] = (nodes[..., 2] + 128) % 256
        fields[n] = WarpField(nodes, fields[n].margin)
    return charts, fields, transitions(surface, charts, find_seams(surface, charts))


def between(turns):
    turns = turns / TURN
    return np.abs(turns - np.rint(turns))


def over_seams(field, found):
    """Return by how many turns phases on both sides of seams differ, (n, places)."""
    away = []
    for one in found:
        m = one.seam
        here = np.linspace(m.start, m.stop, 9)[1:-1]
        there = m.other_start + (m.other_stop - m.other_start) * (here - m.start) / (m.stop - m.start)
        sides = []
        for chart, edge, line, along in (
            (m.chart, m.edge, one.line, here),
            (m.other_chart, m.other_edge, one.other_line, there),
        ):
            across = np.full(len(along), line)
            place = (along - 0.5, across) if edge & 1 else (across, along - 0.5)
            sides.append(field.at(chart, *place).astype(float))
        away.append(between(sides[0] - sides[1]))
    return np.concatenate(away, axis=1)


def test_the_smallest_phases_are_scipys():
    charts, fields, over = layout()
    waves = np.array([(1 / 14.7, 0.004)])
    grids = chart_grids(charts, fields, 10.0)
    areas = np.concatenate([grid.areas for grid in grids])
    links = chart_links(grids, over, waves)
    system = phase_system(links, areas, waves)
    assert len(system.mass) == len(areas)  # no wave comes back as its opposite
    matrix = np.zeros((len(areas), len(areas)), complex)
    for a, b, here, there, weight in zip(
        links.first, links.second, links.here, links.there, links.weights, strict=True
    ):
        turn = np.exp(2j * np.pi * (here + there) @ waves[0])
        # weight · |ψ_b − turn · ψ_a|²
        matrix[a, a] += weight
        matrix[b, b] += weight
        matrix[b, a] -= weight * turn
        matrix[a, b] -= weight * np.conj(turn)
    value, vector = linalg.eigsh(
        sparse.csc_matrix(matrix), k=1, M=sparse.diags(areas).tocsc(), sigma=-1e-4, which="LM"
    )
    found = smallest_phases(system)
    quotient = (np.conj(found) @ matrix @ found).real / (areas * np.abs(found) ** 2).sum()
    assert quotient == pytest.approx(value[0], rel=0.02)
    like = np.abs((areas * np.conj(found)) @ vector[:, 0])
    assert like / np.sqrt((areas * np.abs(found) ** 2).sum() * (areas @ np.abs(vector[:, 0]) ** 2)) > 0.98


def test_a_wave_that_closes_has_no_ends_and_is_the_same_on_both_sides_of_seams():
    charts, fields, over = layout()
    field = phase_field(charts, fields, over, np.array([(1 / 14.7, 0)]), 8.0)
    assert field.ends == 0
    assert max(field.strain(chart, [0.9])[0] for chart in range(len(charts))) < 0.12 / 14.7
    assert over_seams(field, over).max() < 0.06
    # Columns must end, for the torus is shorter inside than outside.
    field = phase_field(charts, fields, over, np.array([(1 / 14.7, 0), (0, 1 / 14.7)]), 8.0)
    assert field.ends >= 4
    found = np.array([field.ends_on(chart) for chart in range(len(charts))])
    assert found[:, 0].sum() == 0
    # Those over an edge are found from either side, those at corners from neither.
    assert field.ends <= found[:, 1].sum() <= 3 * field.ends


@pytest.mark.parametrize("turned", [(), (1, 2)])
def test_beyond_an_edge_a_chart_wants_what_its_neighbour_wants(turned):
    # Columns end, so that phases do not go on by the warp field alone; some charts show them backwards.
    charts, fields, over = layout(turned=turned)
    field = phase_field(charts, fields, over, np.array([(0, 1 / 14.7)]), 8.0)
    away = []
    for one in over:
        m = one.seam
        along = np.linspace(m.start, m.stop, 9)[2:-2] - 0.5
        across = np.full(len(along), one.line + (-12 if m.edge in (0, 3) else 12))
        place = (along, across) if m.edge & 1 else (across, along)
        rows, columns, _ = one.apply(*place)
        sign = -1 if (m.chart in turned) != (m.other_chart in turned) else 1
        here, there = field.at(m.chart, *place), field.at(m.other_chart, rows, columns)
        away.append(between(here.astype(float) - sign * there).reshape(-1))
    assert np.quantile(np.concatenate(away), 0.95) < 0.03


def test_phases_go_on_by_the_warp_field_beyond_edges():
    charts, fields, over = layout()
    wave = np.array([(1 / 14.7, 0.01)])
    field = phase_field(charts, fields, over, wave, 8.0)
    rows, columns = np.array([-9.0, -6.0, -3.0]), np.full(3, 20.0)
    assert field.at(0, rows[:0], columns[:0]).shape == (len(field.waves), 0)
    turns = np.diff(field.at(0, rows, columns)[0].astype(float))
    mean = fields[0].at(np.array([-7.5, -4.5]), columns[:2])[..., 0] * 3
    assert between(turns - TURN * (mean @ wave[0])).max() < 0.02


def test_lines_that_are_turned_round_have_the_opposite_phase():
    wave = np.array([(1 / 14.7, 0)])
    plain = phase_field(*layout(), wave, 8.0)
    turned = phase_field(*layout(turned=(2, 5)), wave, 8.0)
    rows, columns = np.array([5.0, 40.0]), np.array([4.0, 20.0])
    apart = []
    for chart in range(len(plain.grids)):
        sign = -1 if chart in (2, 5) else 1
        apart.append(
            plain.at(chart, rows, columns)[0] - sign * turned.at(chart, rows, columns)[0].astype(float)
        )
    # Nothing but where all of it begins may differ, or which way it counts.
    apart = np.array(apart)
    assert between(apart - apart[0, 0]).max() < 0.02


@pytest.mark.parametrize("waves", [[(0, 1 / 14.7)], [(1 / 14.7, 0), (0.5 / 14.7, 1 / 29.4)]])
def test_warp_fields_give_way_to_the_phases_by_as_much_as_is_allowed(waves):
    charts, fields, over = layout()
    plain = phase_field(charts, fields, over, np.array(waves), 8.0)
    found = warped(plain, over, 0.03)
    assert np.array_equal(found.phases, plain.phases)
    rounding = 2 ** (0.5 / OCTAVE) - 1 + 2 * np.pi * 0.5 / ANGLES  # of a node
    for before, after in zip(plain.grids, found.grids, strict=True):
        m, n = (grid.field.matrices.reshape(-1, 2, 2) / UNIT for grid in (before, after))
        assert np.linalg.norm(n @ np.linalg.inv(m) - np.eye(2), 2, axis=(1, 2)).max() < 0.03 + 1.5 * rounding
        assert np.array_equal(after.matrices, after.field.at(*after.places(0)))
    stretch = [
        np.mean([field.strain(chart, [0.5]) for chart in range(len(charts))]) for field in (plain, found)
    ]
    assert stretch[1] < 0.92 * stretch[0]


def ring(count, comes_back_as):
    """Return links of a ring of cells, of which the last goes on in the first as another wave."""
    first = np.arange(count, dtype=np.int32)
    goes_on = np.tile(np.arange(len(comes_back_as), dtype=np.int8), (count, 1))
    goes_on[-1] = comes_back_as
    half = np.tile([0.5, 0.0], (count, 1))
    return Links(first, np.roll(first, -1), half, half, np.ones(count), goes_on)


def test_a_wave_that_comes_back_as_its_opposite_is_its_own_conjugate():
    links, wave = ring(24, (1, 0)), np.array([(1 / 8, 0.0)])
    system = phase_system(links, np.ones(24), wave)
    assert len(system.mass) == 48
    psi = solved_phases(links, np.ones(24), wave)[0]
    psi /= np.abs(psi)
    inside = np.angle(psi[1:] * np.conj(psi[:-1])) / (2 * np.pi)
    assert np.abs(inside - 1 / 8).max() < 1e-3
    # The last cell's next, half a step at 1/8 and half a step back, is the first one's conjugate.
    assert np.abs(np.angle(psi[-1] * psi[0])) < 1e-3
    # Where it comes back as nothing, it starts anew.
    alone = solved_phases(ring(24, (-1, -1)), np.ones(24), wave)[0]
    assert np.abs(np.angle(alone[1:] * np.conj(alone[:-1])) / (2 * np.pi) - 1 / 8).max() < 1e-3


def test_opposite_waves_stay_conjugate_however_the_solver_turns_them():
    square = np.array([(1 / 8, 0.0), (0.0, 1 / 8)])
    links = ring(12, (1, 2, 3, 0))  # each of four comes back as the next: the two waves and their opposites
    system = phase_system(links, np.ones(12), square)
    assert len(system.mass) == 48
    assert (system.opposite[system.opposite] == np.arange(48)).all()
    rng = np.random.default_rng(2)
    psi = rng.normal(size=48) + 1j * rng.normal(size=48)
    psi += np.conj(psi[system.opposite])
    for turn in (1.0, np.exp(0.9j), -1j):
        found = conjugate_phases(system, turn * psi)
        assert np.abs(found - np.conj(found[system.opposite])).max() < 1e-12
        assert min(np.abs(found - psi).max(), np.abs(found + psi).max()) < 1e-12
    # What comes of it is of one size: a wave and its opposite never cancel each other.
    solved = np.abs(solved_phases(links, np.ones(12), square))
    assert solved.min() > 0.5 * solved.max()


def test_waves_go_on_in_themselves_their_opposites_each_other_or_nothing():
    square, quarter = np.array([(0.1, 0.0), (0.0, 0.1)]), np.array([[0.0, 1.0], [-1.0, 0.0]])
    steps = np.stack([np.eye(2), -np.eye(2), quarter])
    found = matched_waves(square, np.tile(np.eye(2), (3, 1, 1)), steps)
    assert found[:2].tolist() == [[0, 1, 2, 3], [2, 3, 0, 1]]
    for a, b in enumerate(found[2]):
        np.testing.assert_allclose(signed(square)[b] @ quarter, signed(square)[a])
    assert (matched_waves(square[:1], np.eye(2)[None], quarter[None]) == -1).all()


def test_straight_phases_are_the_waves():
    rows, columns = np.array([0.0, 10.0, 25.0]), np.array([0.0, 3.0, -7.0])
    found = StraightPhases(np.array([(0.1, 0.02)])).at(0, rows, columns)
    assert found.dtype == np.int16
    assert between(found[0] - TURN * (0.1 * rows + 0.02 * columns)).max() < 1e-4


def test_small_charts_have_cells():
    charts = (Chart(0, 1, 2),)
    (grid,) = chart_grids(charts, (WarpField.identity(),), 8.0)
    assert (grid.rows, grid.columns) == (3, 3)


def test_first_members_are_the_least_of_what_hangs_together():
    rng = np.random.default_rng(3)
    first, second = (rng.integers(0, 200, 130).astype(np.int32) for _ in range(2))
    part = np.empty(200, np.int32)
    first_members(first, second, part)
    _, label = connected_components(sparse.coo_matrix((np.ones(130), (first, second)), (200, 200)))
    assert part.tolist() == [int(np.flatnonzero(label == one)[0]) for one in label]


def banded(turn):
    """Return layout and wanted direction on a plane whose lines turn aside by an angle in a narrow band."""
    surface = plane(32, 32)
    charts = density_layout(surface, density=16.0, ring=96)

    def vectors(points):
        angle = np.radians(turn) * np.exp(-((points[:, 1] - points[:, 1].mean().round()) ** 2))
        return np.stack([np.cos(angle), np.sin(angle), np.zeros(len(points))], axis=1)

    fields = direction_fields(surface, charts, Direction("", vectors=vectors), 16.0)
    return charts, fields, transitions(surface, charts, find_seams(surface, charts))


def test_where_directions_turn_faster_than_courses_can_follow_they_turn_less():
    charts, fields, over = banded(80)
    asked, calm = (phase_field(charts, fields, over, BRICKS, 12.0, calm=way) for way in (False, True))
    assert calm.ends < 0.6 * asked.ends
    for before, after in zip(asked.grids, calm.grids, strict=True):
        assert np.median(np.abs(np.log(after.areas / before.areas))) < 0.02
        assert np.array_equal(after.matrices, after.field.at(*after.places(0)))


def test_directions_that_courses_can_follow_stay_as_they_are():
    for charts, fields, over in (layout(), layout(turned=(1, 2)), banded(10)):
        found = phase_field(charts, fields, over, BRICKS, 12.0, calm=True)
        assert all(a is grid.field for a, grid in zip(fields, found.grids, strict=True))
