"""Courses that slip: each closes with its own whole number of elements, and the joints between them go on."""

import numpy as np
import pytest
from tests.charts.test_phases import SCALE, between, over_edges, rings

from upholster.charts.charted_surface import charted_plane
from upholster.charts.phases.course_phases import course_field
from upholster.charts.phases.phase_cells import TURN, PhaseField, phase_field
from upholster.image.elements.courses import Courses
from upholster.quilt.chart import Chart

HIGH, LONG = 12.0, 24.0
WAVES = np.array([(0.5 / HIGH, 1 / LONG), (0.5 / HIGH, -1 / LONG)])
LONGER = np.array([(0, -2 / LONG), (0.5 / HIGH, 1 / LONG)])
BOND, LONGER_BOND = Courses((1, 1), 0.3), Courses((1, 2), 0.3)
"""The same courses by other waves, as those of longer elements are."""


@pytest.fixture(scope="module", params=[(WAVES, BOND), (LONGER, LONGER_BOND)], ids=["short", "long"])
def ring(request):
    surface, vectors = rings()
    waves, courses = request.param
    lattice = phase_field(surface, vectors, SCALE, waves)
    field = course_field(lattice, courses, surface, vectors, SCALE)
    assert field.courses == courses
    return surface, vectors, lattice, field


def test_joints_between_courses_go_on_over_all_edges(ring):
    surface, _, _, field = ring
    found = over_edges(surface, SumOf(field))
    assert np.quantile(found, 0.99) < 0.1


class SumOf:
    """A field's wave that counts courses, as a field of its own."""

    def __init__(self, field):
        self.field = field

    def at(self, triangles, points):
        found = self.field.at(triangles, points).astype(np.int64)
        return np.array(self.field.courses.multiples)[None] @ found


def test_each_course_has_its_own_whole_number_of_elements(ring):
    surface, _, lattice, field = ring
    middles = surface.mesh.corners.mean(axis=1)
    wide = np.hypot(middles[:, 0], middles[:, 1])
    tube, around = np.arctan2(middles[:, 2], wide - 2), np.arctan2(middles[:, 1], middles[:, 0])
    row = np.round(tube * 48 * 3 / (2 * np.pi)).astype(int)  # two triangles of a square have two rows
    counts, even = [], []
    for one in np.unique(row):
        mine = np.flatnonzero(row == one)
        mine = mine[np.argsort(around[mine])]
        bed = SumOf(field).at(mine, middles[mine])[0] / TURN - BOND.joint
        if len(mine) != 120 or between(TURN * (bed - 0.5)).max() > 0.4:
            continue  # the circle is not inside a course
        closed = np.append(mine, mine[0])
        for phases, out in ((field, even), (lattice, None)):
            free = 1 - field.courses.once
            steps = np.diff(phases.at(closed, middles[closed])[free].astype(np.int64)) / TURN
            steps -= np.rint(steps)
            if out is not None:
                wanted = wide[mine].mean() * 2 * np.pi * SCALE / LONG
                counts.append((abs(steps.sum()), wanted))
                out.append(np.abs(steps - steps.mean()).max())
    counts = np.array(counts)
    assert len(counts) > 12
    np.testing.assert_allclose(counts[:, 0], np.rint(counts[:, 0]), atol=1e-3)
    numbers = np.rint(counts[:, 0])
    assert len(np.unique(numbers)) > 4
    for number in np.unique(numbers):  # a course is as long as its middle
        assert abs(counts[numbers == number, 1].mean() - number) < 0.75
    assert max(even) < 0.06


def test_courses_stay_in_bond_where_they_can():
    """On a flat sheet the lattice is right, and courses that are solved one by one come to the same."""
    charted = charted_plane(Chart(0, 200, 260))
    vectors = np.broadcast_to([1.0, 0, 0], (len(charted.chart), 3, 3)).copy()
    lattice = phase_field(charted, vectors, 1.0, WAVES)
    assert course_field(lattice, BOND, charted, vectors, 1.0) is None
    uneven = PhaseField(lattice.waves, lattice.cells, lattice.phases, lattice.missing + 1, lattice.areas)
    field = course_field(uneven, BOND, charted, vectors, 1.0)
    rng = np.random.default_rng(0)
    triangles = np.zeros(400, np.int32)
    corners = charted.mesh.corners[0]
    points = rng.dirichlet((1, 1, 1), 400) @ corners
    apart = field.at(triangles, points).astype(np.int64) - lattice.at(triangles, points)
    steady = between(apart - apart[:, :1])
    assert np.quantile(steady, 0.95) < 0.03
