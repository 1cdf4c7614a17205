"""Smaller blocks where courses end: where they lie, what they leave as it is, and what they mend."""

from dataclasses import replace

import numpy as np
import pytest
from repeating import repeating

import upholster
from upholster.charts.directions import direction_fields, parse_direction
from upholster.charts.layout import density_layout
from upholster.charts.phases import phase_field
from upholster.charts.seams import find_seams
from upholster.charts.transitions import transitions
from upholster.geometry import sphere
from upholster.measure import broken_elements
from upholster.methods.quilt._block_kernels import BLOCK_COLUMNS, COLUMN, LEFT, ROW, TOP
from upholster.methods.quilt.finer import finer_blocks, take_away
from upholster.methods.quilt.method import synthesize_quilt
from upholster.methods.quilt.options import QuiltOptions
from upholster.methods.quilt.phases import WantedPhases
from upholster.methods.quilt.run import planned
from upholster.stream import encode_stream, read_stream

BLOCK = 64
OPTIONS = QuiltOptions(block=BLOCK, effort=0)


@pytest.fixture(scope="module")
def ball():
    """A sphere on which columns of 20 pixels round its axis end, and blocks of three periods."""
    exemplar, lattice = repeating(128, 128, [(0, 1 / 20)], noise=0.5)
    surface = sphere(1)
    charts = density_layout(surface, density=100.0, ring=96)
    fields = direction_fields(surface, charts, parse_direction("around:z"), 100.0)
    over = transitions(surface, charts, find_seams(surface, charts))
    field = phase_field(charts, fields, over, lattice.waves, 16.0)
    return exemplar, surface, charts, fields, WantedPhases(lattice, field, 8.0, (BLOCK,) * len(charts))


def run_of(ball, **changed):
    exemplar, surface, charts, fields, phases = ball
    return planned(exemplar, surface, charts, fields, options=OPTIONS, phases=replace(phases, **changed))


def laid(ball, threads=1, effort=0):
    exemplar, surface, charts, fields, phases = ball
    options = replace(OPTIONS, effort=effort)
    return synthesize_quilt(
        exemplar, surface, charts, fields, options=options, phases=phases, seed=3, threads=threads
    )


def test_they_lie_only_where_courses_are_stretched(ball):
    run, field = run_of(ball), ball[4].surface
    grid, finer, need = run.grids[1], run.finer[1], run.grids[1].need({1, 2})
    blocks = finer_blocks(1, grid, finer, need, field)
    rows, columns = finer.centres(need)
    assert finer.height == 24 < grid.height == BLOCK
    assert 0 < len(blocks) < len(rows) * len(columns)
    # Neighbours are those one step before, if they are there.
    at = {(int(block[ROW]), int(block[COLUMN])): n for n, block in enumerate(blocks)}
    steps = rows[1] - rows[0], columns[1] - columns[0]
    for block in blocks:
        row, column = int(block[ROW]), int(block[COLUMN])
        assert block[LEFT] == at.get((row, column - steps[1]), -1)
        assert block[TOP] == at.get((row - steps[0], column), -1)


def test_there_are_none_where_elements_are_not_alike(ball):
    lattice = replace(ball[4].lattice, certainty=np.array([0.9]))
    assert run_of(ball, lattice=lattice).finer == [None] * len(ball[2])


def test_there_are_none_where_a_charts_own_are_small_or_asked_for(ball):
    assert run_of(ball, blocks=()).finer == [None] * len(ball[2])
    assert run_of(ball, blocks=(28,) * len(ball[2])).finer == [None] * len(ball[2])
    run = run_of(ball)
    assert None not in run.finer
    assert not len(finer_blocks(0, run.grids[0], None, (0, 9, 0, 9), ball[4].surface))


def test_what_finished_charts_show_is_not_taken_away(ball):
    run = run_of(ball)
    numbers = type("Numbers", (), {"need_top": 0, "need_bottom": 60, "need_left": 0, "need_right": 60})
    numbers.origin_row = numbers.origin_column = 10
    covered = np.ones((80, 80), np.uint8)
    covered[:, :20] = 3
    block = np.zeros((1, BLOCK_COLUMNS), np.int32)
    block[0, [ROW, COLUMN]] = 8, 8
    take_away(covered, numbers, run.finer[1], block)
    assert (covered[:, :20] == 3).all()
    bare = np.argwhere(covered == 0)
    assert bare.min(axis=0).tolist() == [10, 20]
    assert bare.max(axis=0).tolist() == [25, 25]


def test_faults_are_shorter_on_any_number_of_threads(ball, monkeypatch):
    surface, lattice = ball[1], ball[4].lattice
    one, two = laid(ball), laid(ball, threads=2)
    np.testing.assert_array_equal(one.placements, two.placements)
    monkeypatch.setattr("upholster.methods.quilt.run.finer_grids", lambda grids, *_: [None] * len(grids))
    after, before = (broken_elements(quilt, lattice, surface) for quilt in (one, laid(ball)))
    assert after.faults[0] < 0.7 * before.faults[0]
    assert after.share[0] < 0.6 * before.share[0]


@pytest.mark.parametrize("effort", [0, 2])
def test_a_stream_shows_the_same(ball, effort):
    exemplar, surface = ball[0], ball[1]
    quilt = laid(ball, effort=effort)
    read = read_stream(encode_stream(surface, quilt, exemplar))
    for one, other in zip(
        upholster.paint(quilt, exemplar).arrays, upholster.paint(read.quilt(), exemplar).arrays, strict=True
    ):
        np.testing.assert_array_equal(one, other)
