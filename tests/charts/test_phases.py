"""Phase fields: solved as SciPy solves them, whole over edges, conjugate where a wave comes back."""

import numpy as np
import pytest
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg
from tests.charts.meshes import torus

from upholster.charts.charted_surface import ChartedSurface, charted_mesh, charted_patches, charted_plane
from upholster.charts.mesh_layout import mesh_charts
from upholster.charts.mesh_warp_fields import triangle_frames
from upholster.charts.phases.links import Links, matched_waves, signed
from upholster.charts.phases.phase_cells import TURN, phase_field
from upholster.charts.phases.phase_solution import (
    conjugate_phases,
    phase_system,
    smallest_phases,
    solved_phases,
)
from upholster.geometry.built_in.plane import plane
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.quilt.chart import Chart

SCALE = 20.0
ROWS = np.array([(1 / 14.7, 0)])


def rings() -> tuple[ChartedSurface, np.ndarray]:
    """Return a torus by quarters round z, each laid out flat, and level vectors at triangles' corners."""
    mesh = torus(48, 120)
    middle = mesh.corners.mean(axis=1)
    island = np.floor(np.arctan2(middle[:, 1], middle[:, 0]) / (np.pi / 2)).astype(int) % 4
    around = np.arctan2(mesh.corners[..., 1], mesh.corners[..., 0]) - island[:, None] * np.pi / 2
    around = (around + np.pi / 4) % (2 * np.pi) - np.pi / 4
    wide = np.hypot(mesh.corners[..., 0], mesh.corners[..., 1])
    tube = np.arctan2(mesh.corners[..., 2], wide - 2)
    # A triangle over the cut of the tube lies on one side of it.
    tube = np.where((np.ptp(tube, axis=1) > np.pi)[:, None] & (tube < 0), tube + 2 * np.pi, tube)
    surface = MeshSurface(mesh, island, np.stack([-tube, 2 * around], axis=2))
    along = np.cross([0, 0, 1.0], mesh.corners)
    charted = charted_mesh(surface, mesh_charts(surface, SCALE))
    return charted, along / np.linalg.norm(along, axis=2, keepdims=True)


def between(turns):
    turns = turns / TURN
    return np.abs(turns - np.rint(turns))


def over_edges(surface, field, sign=None):
    """Return by how many turns phases of both sides of each edge differ at its middle, (n, edges)."""
    corners = surface.mesh.corners
    triangle, edge = np.nonzero(surface.across >= 0)
    other, met = np.divmod(surface.across[triangle, edge], 3)
    here, there = (
        field.at(t, 0.5 * (corners[t, k] + corners[t, (k + 1) % 3])) * (1.0 if sign is None else sign[t])
        for t, k in ((triangle, edge), (other, met))
    )
    return between(here - there)


def test_rows_round_a_torus_close():
    surface, vectors = rings()
    field = phase_field(surface, vectors, SCALE, ROWS)
    assert len(field.cells.centres) < len(surface.chart)
    assert over_edges(surface, field).max() < 0.1
    # The wave is as long as it shall be: from a triangle's corner to the next, along its own axes.
    _, down = triangle_frames(surface.mesh, vectors)
    corners = surface.mesh.corners
    triangles = np.arange(len(corners))
    step = field.at(triangles, corners[:, 1]).astype(float) - field.at(triangles, corners[:, 0])
    wanted = SCALE / 14.7 * ((corners[:, 1] - corners[:, 0]) * down).sum(axis=1)
    assert between(step - TURN * wanted).max() < 0.1


def test_the_strain_is_large_where_courses_can_not_close():
    surface, vectors = rings()
    assert phase_field(surface, vectors, SCALE, ROWS).strain(0.9) < 0.12 / 14.7
    # Columns must end, for the torus is shorter inside than outside.
    columns = phase_field(surface, vectors, SCALE, np.array([(0, 1 / 14.7)]))
    assert columns.strain(0.5) < columns.strain(0.9) < columns.strain(1.0) <= 0.5 / 14.7 * 10
    assert columns.strain(0.9) > 0.2 / 14.7


def test_over_a_half_turn_a_wave_goes_on_as_its_opposite():
    surface, vectors = rings()
    sign = np.where(surface.mesh.corners.mean(axis=1)[:, 0] > 0, 1, -1)
    turned = phase_field(surface, vectors * sign[:, None, None], SCALE, ROWS)
    assert over_edges(surface, turned, sign).max() < 0.1
    assert over_edges(surface, turned).max() > 0.2


def along_rows(surface):
    return np.broadcast_to([1.0, 0, 0], (len(surface.chart), 3, 3)).copy()


def on_the_plane(surface, field):
    """Return rows and columns of random places of a flat surface, (300, 2), and phases there, in turns."""
    triangle = np.random.default_rng(1).integers(0, len(surface.chart), 300)
    shares = np.random.default_rng(2).dirichlet([1, 1, 1], 300)[:, :, None]
    found = field.at(triangle, (shares * surface.mesh.corners[triangle]).sum(axis=1))
    return (shares * surface.places[triangle]).sum(axis=1), found / TURN


@pytest.mark.parametrize("patch", [True, False])
def test_on_a_plane_phases_are_the_waves(patch):
    chart = Chart(0, 80, 80)
    surface = charted_patches(plane(), [chart]) if patch else charted_plane(chart)
    waves = np.array([(1 / 9.3, 0.01), (0.02, 1 / 13.1)])
    field = phase_field(surface, along_rows(surface), 80.0 if patch else 1.0, waves)
    places, found = on_the_plane(surface, field)
    away = found - waves @ places.T
    assert between(TURN * (away - away[:, :1])).max() < 0.002
    assert field.strain(1.0) < 1e-3 / 13.1


@pytest.mark.parametrize("side", [256, 512, 1024])
@pytest.mark.parametrize("wave", [(3 / 64, 3 / 65536), (1 / 9.7, 0.003), (0.001, 1 / 33.3)])
def test_on_a_large_plane_no_course_ends(side, wave):
    surface = charted_plane(Chart(0, side, side))
    field = phase_field(surface, along_rows(surface), 1.0, np.array([wave]))
    assert field.missing.max() < 1e-9


def test_a_tile_has_whole_periods():
    surface = charted_plane(Chart(0, 96, 128), tile=True)
    waves = np.array([(0.1, 0.002), (0.03, -0.051)])
    field = phase_field(surface, along_rows(surface), 1.0, waves)
    places, found = on_the_plane(surface, field)
    size = np.array([96, 128])
    away = found - np.rint(waves * size) / size @ places.T
    assert between(TURN * (away - away[:, :1])).max() < 0.05
    assert over_edges(surface, field).max() < 0.06


def test_the_smallest_phases_are_scipys(monkeypatch):
    asked = []
    monkeypatch.setattr(
        "upholster.charts.phases.phase_cells.solved_phases",
        lambda *asked_for: asked.append(asked_for) or solved_phases(*asked_for),
    )
    waves = np.array([(1 / 14.7, 0.004)])
    phase_field(*rings(), SCALE, waves)
    ((links, areas, _),) = asked
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


def test_waves_are_matched_to_those_they_go_on_in():
    square, quarter = np.array([(0.1, 0.0), (0.0, 0.1)]), np.array([[0.0, 1.0], [-1.0, 0.0]])
    steps = np.stack([np.eye(2), -np.eye(2), quarter])
    found = matched_waves(square, np.tile(np.eye(2), (3, 1, 1)), steps)
    assert found[:2].tolist() == [[0, 1, 2, 3], [2, 3, 0, 1]]
    for a, b in enumerate(found[2]):
        np.testing.assert_allclose(signed(square)[b] @ quarter, signed(square)[a])
    assert (matched_waves(square[:1], np.eye(2)[None], quarter[None]) == -1).all()
