"""Broken elements: cuts at which a sample's lattice jumps, and how long they run."""

import numpy as np
import pytest
from measured import grains, quilt_of, quilt_of_nearest, tiles

from upholster.base.errors import InputError
from upholster.charts.charted_surface import charted_surface
from upholster.covering.measure import broken_elements, measure_cover
from upholster.covering.measure.faults import longest_run
from upholster.covering.measure.places import SeamPlaces
from upholster.covering.measure.samples import Window
from upholster.covering.measure.source_cuts import SourceCuts, cuts_inside
from upholster.covering.measure.trace import Trace
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.plane import plane
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.image.elements.lattice import Lattice, find_lattice
from upholster.quilt.chart import Chart
from upholster.quilt.placement import PLACEMENT


@pytest.fixture(scope="module")
def lattice():
    """That of `tiles`, exactly: rows of 8 pixels, columns of 16."""
    waves = np.array([[1 / 8, 0.0], [0.0, 1 / 16]])
    turns = np.tensordot(waves, np.mgrid[:64, :64], axes=1)
    return Lattice(waves, np.rint(65536 * turns).astype(np.int64).astype(np.int16), np.ones(2))


def side_by_side(rows, columns):
    """Two blocks of 32 × 16 texels, the right one's source shifted from where the left one would go on."""
    return quilt_of([(16, 8, 32, 16, 20, 20, 0), (16, 24, 32, 16, 20 + rows, 36 + columns, 0)])


@pytest.mark.parametrize(
    ("shift", "expected"),
    [
        ((8, 0), (0, 0)),  # a whole period
        ((0, -16), (0, 0)),
        ((1, 3), (0, 0)),  # less than a quarter turn
        ((4, 0), (1, 0)),
        ((3, -16), (1, 0)),
        ((8, -8), (0, 1)),
        ((4, 7), (1, 1)),
    ],
)
def test_only_jumps_of_the_phase_are_broken(lattice, shift, expected):
    found = broken_elements(side_by_side(*shift), lattice)
    assert found.share == pytest.approx(expected)
    # One cut of 32 pixels, on 32² of them.
    length = np.array(expected) * 32 * np.pi / 4
    assert found.per_area == pytest.approx(length * found.periods / 32**2)
    assert found.faults == pytest.approx(length / found.periods)


def test_the_share_is_of_all_cuts_and_the_fault_the_longest_run(lattice):
    # Four blocks of 16²: only the lower right one is half a period too far down.
    blocks = [(8, 8, 16, 16, 20, 20, 0), (8, 24, 16, 16, 28, 36, 0)]
    blocks += [(24, 8, 16, 16, 44, 20, 0), (24, 24, 16, 16, 40, 36, 0)]
    found = broken_elements(quilt_of(blocks), lattice)
    assert found.share[0] == pytest.approx(0.5)
    assert found.faults[0] == pytest.approx(32 * np.pi / 4 / found.periods[0])
    assert found.share[1] == 0


def sheet(*quads, fold=0.0):
    """A mesh of rectangles (island, s0, s1, t0, t1), side by side in space along t, each turned by `fold`."""
    turns = np.radians(fold) * np.arange(len(quads))
    widths = np.array([quad[4] - quad[3] for quad in quads])
    steps = widths[:, None] * np.stack([np.cos(turns), 0 * turns, -np.sin(turns)], axis=1)
    lines = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    tall = np.array([0.0, quads[0][2] - quads[0][1], 0.0])
    positions = np.stack([lines, lines - tall], axis=1).reshape(-1, 3)
    triangles, island, parameters = [], [], []
    for k, (number, s0, s1, t0, t1) in enumerate(quads):
        places = [(s0, t0), (s1, t0), (s0, t1), (s1, t1)]
        for corners in ((0, 1, 2), (1, 3, 2)):
            triangles.append([2 * k + corner for corner in corners])
            island.append(number)
            parameters.append([places[corner] for corner in corners])
    mesh = TriangleMesh(positions, np.array(triangles))
    return MeshSurface(mesh, np.array(island), np.array(parameters))


def test_beyond_a_mesh_nothing_counts(lattice):
    found = broken_elements(side_by_side(4, 0), lattice, sheet((0, 0.0, 0.5, 0.0, 1.0)))
    assert found.share == (1, 0)
    assert found.faults[0] == pytest.approx(16 * np.pi / 4 / 8)
    assert found.per_area[0] == pytest.approx(16 * np.pi / 4 * 8 / (16 * 32))


def test_along_creases_nothing_counts(lattice):
    folded = sheet((0, 0.0, 1.0, 0.0, 0.5), (0, 0.0, 1.0, 0.5, 1.0), fold=90)
    assert broken_elements(side_by_side(4, 0), lattice, folded).share == (0, 0)
    found = broken_elements(side_by_side(4, 0), lattice, folded, crease=91)
    assert found.faults[0] == pytest.approx(32 * np.pi / 4 / 8)


@pytest.mark.parametrize(
    ("fold", "shifts", "expected"),
    [
        (0, (0, 4, 0, 4), 32),  # all the way over both charts
        (90, (0, 4, 0, 4), 16),  # over a crease nothing goes on
        (0, (0, 0, 4, 4), 32),  # along the seam
        (90, (0, 0, 4, 4), 0),
        (0, (0, 0, 8, 8), 0),
    ],
)
def test_runs_go_on_across_the_seams_of_a_mesh(lattice, fold, shifts, expected):
    # Two charts of 32 × 16, two blocks each, one below the other, moved in the sample by so many rows.
    blocks = np.zeros(4, PLACEMENT)
    for k, shift in enumerate(shifts):
        chart, below = k // 2, k % 2
        blocks[k]["chart"] = chart
        blocks[k]["row"], blocks[k]["column"] = 16 * (8 + 16 * below), 16 * 8
        blocks[k]["source_row"] = 16 * (16 + 16 * below + shift)
        blocks[k]["source_column"] = 16 * (12 + 16 * chart)
    charts = (Chart(0, 32, 16), Chart(1, 32, 16))
    quilt = quilt_of_nearest(charts, blocks)
    surface = sheet((0, 0.0, 1.0, 0.0, 1.0), (1, 0.0, 1.0, 0.0, 1.0), fold=fold)
    found = broken_elements(quilt, lattice, surface)
    assert found.faults[0] == pytest.approx(expected * np.pi / 4 / 8)


def test_blocks_of_other_symmetries_are_left_out(lattice):
    quilt = quilt_of([(16, 8, 32, 16, 20, 20, 0), (16, 24, 32, 16, 24, 36, 1)])
    assert broken_elements(quilt, lattice).share == (0, 0)


def test_a_lattice_of_another_sample_is_refused(lattice):
    with pytest.raises(InputError, match="32×32"):
        broken_elements(quilt_of([(16, 16, 32, 32, 16, 16, 0)], exemplar=(32, 32)), lattice)


def test_runs_go_on_across_seams():
    exemplar = tiles(128, 128, (16, 16))
    lattice = find_lattice(exemplar)
    assert lattice is not None
    surface = surface_from_spec("cyclide")
    quilt = synthesize(exemplar, surface, texels=2**16, seed=2, sample_size=2, phase=0)
    assert len(quilt.charts) > 1
    alone, whole = broken_elements(quilt, lattice), broken_elements(quilt, lattice, surface)
    assert max(alone.faults) > 0
    assert all(a <= b + 1e-9 for a, b in zip(alone.faults, whole.faults, strict=True))
    assert sum(whole.faults) > sum(alone.faults)


def edges(*corners, chart=0):
    """Edges of one texel each, downward from these corners."""
    ends = np.array([[(r, c), (r + 1, c)] for r, c in corners], np.intp)
    nowhere = np.zeros((len(ends), 2), np.int32)
    return SourceCuts(nowhere, nowhere, np.ones(len(ends)), np.full(len(ends), chart, np.intp), ends)


def test_edges_lie_between_the_texels_that_differ(lattice):
    rows, columns = cuts_inside(Trace.of(side_by_side(4, 0), Window(0, 0, 0, 32, 32)))
    assert not len(rows.ends)
    assert columns.ends.tolist() == [[[r, 16], [r + 1, 16]] for r in range(32)]
    assert (columns.lengths == 1).all()


def test_runs_go_over_small_gaps_on_one_chart():
    def run(*parts):
        cuts = SourceCuts.joined(parts)
        return longest_run(cuts, np.ones(len(cuts.lengths), bool))

    assert run(edges((0, 0), (3, 0), (6, 2))) == 3  # two texels apart, down and aside
    assert run(edges((0, 0), (4, 0), (5, 0))) == 2
    assert run(edges((0, 0)), edges((1, 0), chart=1)) == 1


def test_runs_go_on_beyond_an_edge():
    surface = surface_from_spec("cyclide")
    charts = synthesize(grains(), surface, texels=2**16, seed=1).charts
    seams = SeamPlaces.of(charted_surface(surface, charts)).of_texels()
    n = np.flatnonzero(seams.chart[:, 0] != seams.chart[:, 1])[0]
    one, other = (edges(seams.texel[n, k], chart=seams.chart[n, k]) for k in (0, 1))
    cuts = SourceCuts.joined([one, other])
    assert longest_run(cuts, np.ones(2, bool)) == 1
    assert longest_run(cuts, np.ones(2, bool), seams) == 2


@pytest.mark.slow(reason="lays and measures whole quilts")
def test_reports_have_it_where_the_sample_has_a_lattice():
    for exemplar, has in ((tiles(), True), (grains(), False)):
        quilt = synthesize(exemplar, plane(), texels=(96, 96), seed=1)
        found = measure_cover(plane(), quilt, exemplar)
        assert (found.broken is not None) == has
        assert any(name == "broken elements" for name, _, _ in found.rows()) == has
