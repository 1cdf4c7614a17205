"""Meshes laid out flat: islands cover the mesh once, turn as in space, and keep areas and lengths."""

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.charts.meshes import on_charts

from upholster.base.errors import InputError
from upholster.charts.unwrap._raster_kernels import coverage
from upholster.charts.unwrap.flat_islands import unwrap
from upholster.charts.unwrap.flat_piece import flatten
from upholster.charts.unwrap.pieces import pieces_of
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh, welded


def grid(
    points: Callable[[NDArray, NDArray], list[NDArray]], rows: int, columns: int, **more: object
) -> TriangleMesh:
    """Triangles over (rows + 1) × (columns + 1) points of [0, 1]²; what meets in space is one vertex."""
    a, b = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij")
    flat = np.stack(points(a.ravel(), b.ravel()), axis=-1).round(12)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    corners = [first, first + columns + 1, first + columns + 2, first, first + columns + 2, first + 1]
    positions, vertex = welded(flat)
    return TriangleMesh(positions, vertex[np.stack(corners, axis=-1).reshape(-1, 3)], **more)


def torus() -> TriangleMesh:
    def points(a: NDArray, b: NDArray) -> list[NDArray]:
        a, b = 2 * np.pi * a, -2 * np.pi * b
        return [(3 + np.cos(a)) * np.cos(b), (3 + np.cos(a)) * np.sin(b), np.sin(a)]

    return grid(points, 24, 48)


def sphere() -> TriangleMesh:
    def points(a: NDArray, b: NDArray) -> list[NDArray]:
        a, b = np.pi * a, 2 * np.pi * b
        return [np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)]

    return grid(points, 24, 36)


def cylinder(length: float = 4.0) -> TriangleMesh:
    """Three quarters of a tube: it can be unrolled."""

    def points(a: NDArray, b: NDArray) -> list[NDArray]:
        return [np.cos(1.5 * np.pi * b), np.sin(1.5 * np.pi * b), -length * a]

    return grid(points, 12, 60)


def cube(steps: int = 4) -> TriangleMesh:
    side = grid(lambda a, b: [a, b, 0 * a], steps, steps)
    positions, triangles = [], []
    for axis in range(3):
        for level in (0.0, 1.0):
            points = np.roll(side.positions + np.array([0, 0, level]), axis, axis=1)
            faces = side.triangles if level else side.triangles[:, ::-1]
            triangles.append(faces + len(side.positions) * len(positions))
            positions.append(points)
    places, vertex = welded(np.concatenate(positions))
    return TriangleMesh(places, vertex[np.concatenate(triangles)])


def plane(size: float = 1.0, **more: object) -> TriangleMesh:
    return grid(lambda a, b: [size * b, -size * a, 0 * a], 6, 9, **more)


def turned(surface: MeshSurface) -> NDArray:
    a = surface.parameters[:, 1] - surface.parameters[:, 0]
    b = surface.parameters[:, 2] - surface.parameters[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def lengths(corners: NDArray) -> NDArray:
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)


MESHES = {"torus": torus, "sphere": sphere, "cylinder": cylinder, "cube": cube, "plane": plane}


@pytest.mark.parametrize("name", MESHES)
def test_islands_cover_the_mesh_once(name: str) -> None:
    mesh = MESHES[name]()
    surface, report = unwrap(mesh)
    real = mesh.areas > 0
    assert (surface.island[real] >= 0).all()
    assert (turned(surface)[real] > 0).all()
    assert report.islands == surface.islands <= 40
    assert report.spread < 2.5
    for island in range(surface.islands):
        own = surface.island == island
        corners = surface.parameters[own]
        assert turned(surface)[own].sum() == pytest.approx(mesh.areas[own].sum())
        times = np.zeros((400, 400), np.int32)
        low, high = surface.boxes[island]
        coverage((corners - low) / (high - low).max() * 400, times)
        assert times.max() == 1


@pytest.mark.parametrize("name", MESHES)
def test_islands_hang_together_without_handles(name: str) -> None:
    surface, _ = unwrap(MESHES[name]())
    across = surface.mesh.neighbours.copy()
    across[on_charts(surface, 100 / surface.size).is_seam] = -1
    pieces = list(pieces_of(across, surface.island >= 0))
    assert len(pieces) == surface.islands
    for piece in pieces:
        assert piece.handles == 0
        assert piece.loops >= 1
        assert len(set(surface.island[piece.triangles])) == 1


@pytest.mark.parametrize(("name", "islands"), [("plane", 1), ("cylinder", 1), ("cube", 6)])
def test_what_can_be_unrolled_keeps_its_lengths(name: str, islands: int) -> None:
    mesh = MESHES[name]()
    surface, _ = unwrap(mesh, crease=30)
    np.testing.assert_allclose(lengths(surface.parameters), lengths(mesh.corners), rtol=1e-3)
    assert surface.islands <= islands + 2


@pytest.mark.parametrize("name", ["cube", "plane"])
def test_flat_faces_are_one_island_on_a_level_rectangle(name: str) -> None:
    mesh = MESHES[name]()
    surface, _ = unwrap(mesh, crease=30)
    assert surface.islands == {"cube": 6, "plane": 1}[name]
    np.testing.assert_allclose(np.ptp(surface.boxes, axis=1), 1.0, rtol=1e-9)


def test_creases_are_seams_and_without_them_the_mesh_decides() -> None:
    bent = grid(lambda a, b: [b, np.minimum(a, 0.5), np.maximum(a, 0.5)], 8, 8)
    assert unwrap(bent)[0].islands == 1
    assert unwrap(bent, crease=60)[0].islands == 2
    with pytest.raises(InputError, match=r"crease is 181; allowed: 0 to 180"):
        unwrap(bent, crease=181)


@pytest.mark.parametrize("scale", [2.0**-20, 2.0**20])
def test_islands_do_not_depend_on_units(scale: float) -> None:
    mesh = torus()
    plain, _ = unwrap(mesh)
    scaled, _ = unwrap(TriangleMesh(mesh.positions * scale, mesh.triangles))
    assert scaled.islands == plain.islands
    np.testing.assert_allclose(scaled.boxes / scale, plain.boxes)


def test_threads_do_not_change_the_result(monkeypatch: pytest.MonkeyPatch) -> None:
    first, _ = unwrap(torus())
    monkeypatch.setattr("upholster.runtime.parallel.thread_count", lambda: 1)
    second, _ = unwrap(torus())
    np.testing.assert_array_equal(first.island, second.island)
    np.testing.assert_array_equal(first.parameters, second.parameters)


def test_odd_triangles_are_covered_or_reported() -> None:
    mesh = plane()
    middle = mesh.positions[mesh.triangles[0, :2]].mean(axis=0)
    positions = np.concatenate([mesh.positions, [middle], [[5, 5, 5], [5, 6, 5], [6, 5, 5]]])
    n = len(mesh.positions)
    a, b, c = mesh.triangles[0]
    odd = [[a, n, b], [a, a, c], [n + 1, n + 2, n + 3], list(mesh.triangles[40]), [c, b, n + 2]]
    split = [[n, b, c], [a, n, c]]  # the first triangle, with a T-junction closed by one without area
    triangles = np.concatenate([mesh.triangles[1:], split, odd])
    odd_mesh = TriangleMesh(positions, triangles)
    surface, report = unwrap(odd_mesh)
    assert (surface.island[odd_mesh.areas > 0] >= 0).all()
    assert (turned(surface)[odd_mesh.areas > 0] > 0).all()
    assert np.isfinite(surface.parameters).all()
    assert report.flat == 1
    assert any("three or more triangles" in note for note in report.notes)


def test_other_winding_is_another_island() -> None:
    mesh = plane()
    triangles = mesh.triangles.copy()
    half = len(triangles) // 2
    triangles[half:] = triangles[half:, ::-1]
    surface, report = unwrap(TriangleMesh(mesh.positions, triangles))
    assert surface.islands == 2
    assert (turned(surface) > 0).all()
    assert any("have opposite orientations" in note for note in report.notes)


def test_one_triangle_and_none() -> None:
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    surface, _ = unwrap(TriangleMesh(corner, [[0, 1, 2]]))
    np.testing.assert_allclose(lengths(surface.parameters), lengths(surface.mesh.corners))
    with pytest.raises(InputError, match="no triangle has an area"):
        unwrap(TriangleMesh(corner, [[0, 1, 1]]))


@pytest.mark.parametrize("apart", [0.0, 1e-200])
def test_triangles_that_are_points_are_left_out(apart: float) -> None:
    corners = np.array([(2, 0, 0), (2, 1, 0), (1, 2, 0), (2, apart, 0), (2, 0, apart)])
    surface, report = unwrap(TriangleMesh(corners, [[4, 0, 2], [4, 3, 0], [3, 1, 2]]))
    assert surface.island.tolist() == [0, -1, 1]
    assert report.flat == 1
    assert np.isfinite(surface.parameters).all()
    with pytest.raises(InputError, match="no triangle has an area"):
        unwrap(TriangleMesh(np.zeros((3, 3)), [[0, 1, 2]]))


def test_only_what_is_chosen_is_laid_out() -> None:
    mesh = torus()
    chosen = np.arange(len(mesh.triangles)) % 96 < 30
    surface, report = unwrap(mesh, chosen=chosen)
    np.testing.assert_array_equal(surface.island >= 0, chosen)
    assert report.plain == (~chosen).sum()


def test_texture_coordinates_are_kept() -> None:
    mesh = cylinder()
    a, b = np.meshgrid(np.linspace(0, 1, 13), np.linspace(0, 1, 61), indexing="ij")
    first = (np.arange(12)[:, None] * 61 + np.arange(60)).ravel()
    at = np.stack([first, first + 61, first + 62, first, first + 62, first + 1], axis=-1).reshape(-1, 3)
    uv = np.stack([b.ravel() * 1.5 * np.pi, a.ravel() * 4], axis=-1)[at] / 5
    kept, _ = unwrap(TriangleMesh(mesh.positions, mesh.triangles, uv=uv), keep_uv=True)
    assert kept.islands == 1
    np.testing.assert_allclose(kept.parameters, uv[..., ::-1] * 5, rtol=1e-3, atol=1e-12)
    mirrored = TriangleMesh(mesh.positions, mesh.triangles, uv=uv * [-1, 1])
    assert (turned(unwrap(mirrored, keep_uv=True)[0]) > 0).all()
    folded = TriangleMesh(mesh.positions, mesh.triangles, uv=np.abs(uv - [0.4, 0]))
    with pytest.raises(InputError, match=r"\d\d% of the area of the texture coordinates overlaps"):
        unwrap(folded, keep_uv=True)
    uneven = TriangleMesh(mesh.positions, mesh.triangles, uv=uv**2)
    with pytest.raises(InputError, match="density of the texture coordinates differs by a factor"):
        unwrap(uneven, keep_uv=True)
    with pytest.raises(InputError, match="no texture coordinates"):
        unwrap(mesh, keep_uv=True)


def test_a_few_uneven_islands_are_laid_out_anew_and_the_rest_is_kept() -> None:
    # A sheet whose texture coordinates are right, but for a triangle that is pressed to a line.
    mesh = plane()
    uv = mesh.corners[..., :2] / mesh.size
    pressed = np.arange(len(uv)) == 0
    share = mesh.areas[pressed].sum() / mesh.areas.sum()
    assert 0 < share < 0.01
    uv[pressed] = uv[pressed] * [1, 0] + 5
    kept, report = unwrap(TriangleMesh(mesh.positions, mesh.triangles, uv=uv), keep_uv=True)
    assert (kept.island >= 0).all()
    assert (turned(kept) > 0).all()
    np.testing.assert_array_equal(kept.island[pressed] > 0, True)
    np.testing.assert_array_equal(kept.island[~pressed], 0)
    assert any("of 1 triangle are too uneven to keep" in note for note in report.notes)


def test_borders_that_lie_on_each_other_do_not_hide_overlaps() -> None:
    """A strip of five squares round a corner: unfolded, the last lies exactly on the first."""
    ways = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [1, 0, 0]])
    positions, triangles = [], []
    for number, (one, other) in enumerate(itertools.pairwise(ways)):
        positions += [0 * one, one, one + other, other]
        triangles += [
            [4 * number, 4 * number + 1, 4 * number + 2],
            [4 * number, 4 * number + 2, 4 * number + 3],
        ]
    places, vertex = welded(positions)
    cut = vertex.reshape(5, 4).copy()
    cut[4, 3] = len(places)  # the last square does not meet the first
    mesh = TriangleMesh([*places, ways[0]], cut.reshape(-1)[triangles])
    (piece,) = pieces_of(mesh.neighbours, np.ones(10, bool))
    flat = flatten(piece, mesh.corners, mesh.areas, mesh.flat_normals)
    times = np.zeros((90, 90), np.int32)
    coverage((flat.parameters - flat.parameters.min(axis=(0, 1))) * 30, times)
    assert flat.good == (times.max() == 1)
    surface, _ = unwrap(mesh)
    assert (turned(surface) > 0).all()
    for island in range(surface.islands):
        own = surface.parameters[surface.island == island]
        times = np.zeros((90, 90), np.int32)
        coverage((own - own.min(axis=(0, 1))) * 30, times)
        assert times.max() == 1


def test_triangles_back_to_back_become_islands_of_their_own() -> None:
    leaf = np.array([(0.0, 0, 0), (1, 0, 0.2), (0.3, 1, 0)])
    mesh = TriangleMesh(leaf, np.array([(0, 1, 2), (0, 2, 1)]))
    surface, _ = unwrap(mesh)
    assert surface.islands == 2
