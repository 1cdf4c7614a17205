"""Charted surfaces: vertices on the surface, no gaps, whole charts, fineness by bends; planes and tiles."""

import numpy as np
import pytest

from upholster.base.types import FloatArray
from upholster.charts.chart_seams import find_seams
from upholster.charts.charted_surface import ChartedSurface, charted_patches, charted_plane, charted_surface
from upholster.charts.directions.direction import parse_direction
from upholster.charts.directions.patch_directions import vectors_on_patches
from upholster.charts.layout import density_layout
from upholster.charts.subdivision import subdivided
from upholster.charts.tessellation.mesh import face_parameters
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.plane import plane
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart

CLOSED = ["cyclide", "torus", "sphere", "sphere:tiling=octants", "vase", "torus:spans=6x4"]
SURFACES = [*CLOSED, "cone", "cylinder", "plane:spans=3x2", "ellipsoid"]


def charted_at(spec: str, texels: int = 200_000) -> tuple[Surface, ChartedSurface]:
    surface = surface_from_spec(spec)
    return surface, charted_patches(surface, density_layout(surface, texels=texels))


def exact(surface: Surface, charted: ChartedSurface) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return points and derivatives by s and t at all triangles' corners, (T, 3, 3) each."""
    out = np.empty((3, *charted.mesh.corners.shape))
    for n, chart in enumerate(charted.charts):
        own = charted.chart == n
        s, t = face_parameters(chart, *charted.places[own].transpose(2, 0, 1))
        out[:, own] = surface.faces[chart.face].derivatives(s, t)
    return out[0], out[1], out[2]


def assert_is_partner(across: np.ndarray) -> None:
    """Each edge that has a partner is that one's partner."""
    inner = np.flatnonzero(across.ravel() >= 0)
    assert np.array_equal(across.ravel()[across.ravel()[inner]], inner)


@pytest.mark.parametrize("spec", SURFACES)
def test_vertices_lie_on_the_surface_and_nothing_gapes(spec: str) -> None:
    surface, charted = charted_at(spec)
    np.testing.assert_allclose(charted.mesh.corners, exact(surface, charted)[0], atol=1e-9 * surface.size)
    assert_is_partner(charted.across)
    if spec in CLOSED:
        assert (charted.across >= 0).all()
    # No edge is met by two: as many are borders as lie along the surface's border.
    ends = np.sort(np.stack([charted.mesh.triangles, np.roll(charted.mesh.triangles, -1, axis=1)], axis=2))
    _, uses = np.unique(ends.reshape(-1, 2), axis=0, return_counts=True)
    assert uses.max() <= 2
    assert (uses == 1).sum() == (charted.across < 0).sum()


@pytest.mark.parametrize("spec", SURFACES)
def test_triangles_fill_their_charts_and_turn_as_they_do_in_space(spec: str) -> None:
    surface, charted = charted_at(spec)
    one, other = charted.places[:, 1] - charted.places[:, 0], charted.places[:, 2] - charted.places[:, 0]
    area = 0.5 * (one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
    assert (area > 0).all()
    whole = np.array([chart.height * chart.width for chart in charted.charts], float)
    found = np.bincount(charted.chart, area, len(whole))
    if not surface.degenerate:  # beside a pole half of the first row of steps is a line
        np.testing.assert_allclose(found, whole)
    assert (whole - found < 2 * whole / np.sqrt(whole)).all()
    _, by_s, by_t = exact(surface, charted)
    normals = np.cross(by_s, by_t).mean(axis=1)
    assert ((normals * charted.mesh.flat_normals).sum(axis=1) > 0).all()


def test_triangles_are_as_large_as_bends_allow() -> None:
    assert len(charted_at("plane")[1].chart) == 2
    assert len(charted_at("plane:spans=3x2")[1].chart) == 2
    assert 1000 < len(charted_at("cyclide", 250_000)[1].chart) < 8000
    # A flat patch whose parameters run unevenly is bent like a ball.
    net = np.ones((3, 3, 4))
    net[..., 0], net[..., 1], net[..., 2] = np.arange(3), -np.arange(3)[:, None], 0
    net[1, 1] *= 4
    uneven = Surface([RationalPatch(net)])
    charts = (Chart(0, 200, 200),)
    fine = charted_patches(uneven, charts)
    assert len(fine.chart) > 100
    # Places differ from the true ones by about a step.
    shares = np.random.default_rng(0).dirichlet(np.ones(3), len(fine.chart))
    rows, columns = (fine.places * shares[..., None]).sum(axis=1).T
    there = uneven.faces[0].points(*face_parameters(charts[0], rows, columns))
    off = np.linalg.norm((fine.mesh.corners * shares[..., None]).sum(axis=1) - there, axis=1)
    assert off.max() < 2.5 * 2 / 200


@pytest.mark.parametrize("spec", SURFACES)
def test_seams_are_where_charts_meet_and_nothing_else(spec: str) -> None:
    surface, charted = charted_at(spec)
    triangle, edge, other, met = charted.seams.T
    assert (charted.across[triangle, edge] == 3 * other + met).all()
    assert len(np.unique(3 * np.concatenate([triangle, other]) + np.concatenate([edge, met]))) == 2 * len(met)
    lengths = np.linalg.norm(np.roll(charted.places, -1, axis=1) - charted.places, axis=2)
    found = lengths[triangle, edge].sum() + lengths[other, met].sum()
    # At a pole, the two that meet go on into its row of one step aslant.
    wanted = sum(seam.stop - seam.start for seam in find_seams(surface, charted.charts))
    np.testing.assert_allclose(found, wanted, rtol=0.05 if surface.degenerate else 1e-9)


@pytest.mark.parametrize("spec", ["cyclide", "sphere", "cone"])
def test_steps_are_the_surfaces_derivatives(spec: str) -> None:
    surface = surface_from_spec(spec)
    off = []
    for finer in (1, 4):
        charted = charted_surface(surface, density_layout(surface, texels=100_000), finer=finer)
        _, by_s, by_t = (of.mean(axis=1) for of in exact(surface, charted))
        spans = np.array([((c.s1 - c.s0) / c.height, (c.t1 - c.t0) / c.width) for c in charted.charts])
        wanted = np.stack([by_s, by_t], axis=2) * spans[charted.chart][:, None]
        size = np.linalg.norm(wanted, axis=1).mean()
        off.append(float(np.linalg.norm(charted.steps - wanted, axis=1).mean() / size))
    assert off[0] < 0.1
    assert off[1] < 0.4 * off[0]


@pytest.mark.parametrize("spec", ["cyclide", "sphere:tiling=octants", "vase"])
def test_unfolded_about_a_seam_steps_keep_lengths_and_angles(spec: str) -> None:
    _, charted = charted_at(spec)
    triangle, edge, other, met = charted.seams.T
    onto = -np.linalg.solve(charted.beside(other, met), charted.beside(triangle, edge))
    here, there = charted.steps[triangle], charted.steps[other] @ onto
    metric = here.transpose(0, 2, 1) @ here
    np.testing.assert_allclose(there.transpose(0, 2, 1) @ there, metric, atol=1e-9 * metric.max())
    # A step along the edge is that along the other's.
    way = charted.places[triangle, (edge + 1) % 3] - charted.places[triangle, edge]
    back = charted.places[other, met] - charted.places[other, (met + 1) % 3]
    np.testing.assert_allclose((onto @ way[..., None])[..., 0], back, atol=1e-6)


def test_steps_lie_on_a_chart_where_its_triangles_do() -> None:
    _, charted = charted_at("cyclide", 20_000)
    for index, chart in enumerate(charted.charts):
        assert charted.lies_on(index, (0, 0), (chart.height, chart.width)).all()
    assert charted.lies_on(0, (-2, -3), (4, 5)).tolist() == 2 * [5 * [False]] + 2 * [3 * [False] + 2 * [True]]


@pytest.mark.parametrize("kind", ["u", "v"])
@pytest.mark.parametrize("spec", ["cyclide", "sphere", "vase", "cone"])
def test_u_and_v_are_the_surfaces_derivatives(spec: str, kind: str) -> None:
    surface, charted = charted_at(spec)
    reported = vectors_on_patches(surface, charted, parse_direction(kind, patches=True))
    assert isinstance(reported.vectors, np.ndarray)
    _, by_s, by_t = exact(surface, charted)
    wanted = by_t if kind == "u" else by_s
    size = np.linalg.norm(wanted, axis=2)
    sound = size > 1e-6 * size.max()
    cosine = (reported.vectors * wanted).sum(axis=2) / np.maximum(
        size * np.linalg.norm(reported.vectors, axis=2), 1e-30
    )
    # Where derivatives jump, a corner has those of its own patches.
    assert np.mean(cosine[sound] > 1 - 1e-9) > 0.97


def test_a_plane_is_two_triangles_and_its_steps_are_lengths() -> None:
    flat = charted_plane(Chart(0, 30, 50))
    assert len(flat.chart) == 2
    assert not flat.is_seam.any()
    np.testing.assert_array_equal(
        flat.mesh.corners, np.stack([flat.places[..., 1], -flat.places[..., 0], 0 * flat.places[..., 0]], 2)
    )
    np.testing.assert_array_equal(flat.mesh.flat_normals, [[0, 0, 1], [0, 0, 1]])


def assert_is_tile(tile: ChartedSurface, height: float, width: float) -> None:
    """Nothing ends, and what lies across the edge of the chart lies one height or width away."""
    assert (tile.across >= 0).all()
    assert_is_partner(tile.across)
    other, met = np.divmod(tile.across, 3)
    rows, edges = np.indices(other.shape)
    for here, there in (
        (tile.places, tile.places[other, (met + 1) % 3]),
        (np.roll(tile.places, -1, axis=1), tile.places[other, met]),
    ):
        apart = here[rows, edges] - there
        np.testing.assert_array_equal(apart % (height, width), 0)
        np.testing.assert_array_equal((apart != 0).any(axis=2), tile.is_seam)
    # The edges of the chart, from either side.
    ends = np.roll(tile.mesh.corners, -1, axis=1) - tile.mesh.corners
    assert np.linalg.norm(ends, axis=2)[tile.is_seam].sum() == pytest.approx(2 * (height + width))


@pytest.mark.parametrize("longest", [None, 100.0, 20.0, 7.0])
def test_a_tile_has_no_border_and_keeps_that_when_it_is_subdivided(longest: float | None) -> None:
    tile = charted_plane(Chart(0, 48, 60), tile=True)
    if longest is not None:
        tile = subdivided(tile, np.tile([1.0, 0, 0], (len(tile.chart), 3, 1)), longest).surface
        sides = np.linalg.norm(np.roll(tile.mesh.corners, -1, axis=1) - tile.mesh.corners, axis=2)
        assert sides.max() <= longest
    assert_is_tile(tile, 48.0, 60.0)
    assert tile.mesh.areas.sum() == pytest.approx(48 * 60)


def test_a_plane_of_patches_and_one_without_are_alike() -> None:
    surface = plane(50.0, 30.0)
    one, other = charted_patches(surface, (Chart(0, 30, 50),)), charted_plane(Chart(0, 30, 50))
    assert len(one.chart) == len(other.chart)
    np.testing.assert_allclose(one.mesh.areas, other.mesh.areas)
