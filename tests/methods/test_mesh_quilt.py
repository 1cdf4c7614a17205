"""Quilts over meshes: unfolding, fitted sheets, what is painted, and the plain twins of kernels."""

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import pytest
from plain_quilt import shown_blocks
from tests.charts.meshes import box, sphere, torus
from tests.charts.test_mesh_layout import sheet
from tests.charts.test_mesh_turns import roof

from upholster import paint
from upholster.charts.directions import direction_field
from upholster.charts.mesh_layout import chart_places, mesh_charts
from upholster.charts.subdivision import subdivided
from upholster.charts.turns import chart_turns
from upholster.charts.warp_fields import triangle_frames, warp_fields
from upholster.geometry import MeshSurface, TriangleMesh, welded
from upholster.measure import mesh_mapping, mesh_seams, mesh_texel_scale
from upholster.methods.quilt.emit import emitted_quilt
from upholster.methods.quilt.mesh import method
from upholster.methods.quilt.mesh._frame_kernels import Canvases, locate_texels, nearest_texels
from upholster.methods.quilt.mesh._sheet_kernels import MOST_SHEETS
from upholster.methods.quilt.mesh.footprints import (
    Centres,
    Footprints,
    field_arrays,
    find_footprints,
    mesh_arrays,
)
from upholster.methods.quilt.mesh.method import _frame, _Laying, _working, synthesize_mesh
from upholster.methods.quilt.options import QuiltOptions
from upholster.quilt import Quilt

SCALE, DENSITY = 100.0, 80.0


def noise(side: int = 96) -> np.ndarray:
    """Return a soft random texture."""
    rng = np.random.default_rng(5)
    image = rng.uniform(0, 255, (side, side, 3))
    for _ in range(3):
        image = (image + np.roll(image, 1, 0) + np.roll(image, 1, 1) + np.roll(image, (1, 1), (0, 1))) / 4
    return np.rint(np.clip((image - image.mean()) * 4 + 128, 0, 255)).astype(np.uint8)


def halves(whole: MeshSurface, turned: float) -> MeshSurface:
    """Cut a flat sheet down its middle; the right half is turned and moved."""
    right = whole.mesh.corners[:, :, 0].mean(axis=1) > whole.mesh.box[:, 0].mean()
    a = np.radians(turned)
    parameters = whole.parameters.copy()
    parameters[right] = parameters[right] @ np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) + 7
    return MeshSurface(whole.mesh, right.astype(int), parameters)


def patches(mesh: TriangleMesh) -> MeshSurface:
    """Lay a mesh's triangles out by the six sides of a cube round it, each seen from its axis."""
    middle = mesh.flat_normals
    axis = np.abs(middle).argmax(axis=1)
    sign = np.sign(np.take_along_axis(middle, axis[:, None], 1)[:, 0])
    parameters = np.empty((len(axis), 3, 2))
    for n, (k, s) in enumerate(zip(axis, sign, strict=True)):
        right, up = np.eye(3)[(k + 1) % 3], np.eye(3)[(k + 2) % 3] * s
        parameters[n] = np.stack([-mesh.corners[n] @ up, mesh.corners[n] @ right], axis=1)
    island = 2 * axis + (sign > 0)
    return MeshSurface(mesh, np.unique(island, return_inverse=True)[1], parameters)


def covered(surface: MeshSurface, vectors: np.ndarray, **choices: int | None) -> Quilt:
    charts = mesh_charts(surface, DENSITY)
    fields = warp_fields(surface, charts, *triangle_frames(surface, vectors), SCALE)
    seed, threads = choices.get("seed") or 0, choices.get("threads")
    options = QuiltOptions(block=24)
    return synthesize_mesh(
        noise(), surface, charts, fields, vectors, SCALE, options=options, seed=seed, threads=threads
    )


def covered_and_bare(surface: MeshSurface, vectors: np.ndarray) -> tuple[Quilt, list[np.ndarray]]:
    """Return a quilt, and chart by chart on which texels no block was laid."""
    given: list[Any] = []

    def noted(charts: Any, *rest: Any, **how: Any) -> Quilt:
        given.extend(zip(charts, rest[2], strict=True))
        return emitted_quilt(charts, *rest, **how)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(method, "emitted_quilt", noted)
        quilt = covered(surface, vectors)
    return quilt, [shown_blocks(one, chart) < 0 for chart, one in given]


def level(mesh: TriangleMesh) -> np.ndarray:
    """Return unit tangents at the corners of a mesh round the origin: level, and along x at the poles."""
    normals = np.zeros_like(mesh.positions)
    for corner in range(3):
        np.add.at(normals, mesh.triangles[:, corner], mesh.flat_normals)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    along = np.cross([0, 0, 1.0], normals) + np.array([1e-3, 0, 0])
    along -= (along * normals).sum(axis=1, keepdims=True) * normals
    return (along / np.linalg.norm(along, axis=1, keepdims=True))[mesh.triangles]


@pytest.mark.parametrize("turned", [0.0, 90.0, 33.0])
def test_over_a_cut_plane_both_sheets_read_as_the_plane_lies(turned: float) -> None:
    surface = halves(sheet(), turned)
    vectors = np.tile([1.0, 0.0, 0.0], (len(surface.mesh.triangles), 3, 1))
    charts = mesh_charts(surface, DENSITY)
    fields = warp_fields(surface, charts, *triangle_frames(surface, vectors), SCALE)
    fine = subdivided(surface, vectors, 0.06)
    mesh = mesh_arrays(fine, charts)
    field = field_arrays(fields, 1.0, 0)
    triangle = int(np.argmin(np.abs(mesh.positions[mesh.triangles].mean(axis=1) - [1.0, 1.0, 0]).sum(axis=1)))
    place = mesh.places[triangle].mean(axis=0)
    root = [mesh.chart[triangle], *place, 0.0, 0.0, 0.0]
    centres = Centres(np.array([triangle], np.int32), np.full((1, 3), 1 / 3), np.array([root]))
    found = find_footprints(mesh, field, centres, 20.0, SCALE, threads=1)
    assert set(found.sheets.tolist()) == {0, 1}
    assert (found.fits[0, :2, 0] == 1).all()
    assert not found.fits[0, 2:, 0].any()
    # The block map is the plane itself, in pixels: rows down, columns to the right.
    middle = mesh.positions[mesh.triangles[triangle]].mean(axis=0)
    corners = mesh.positions[mesh.triangles[found.triangles]] - middle
    exact = SCALE * np.stack([-corners[..., 1], corners[..., 0]], axis=2)
    np.testing.assert_allclose(found.maps, exact, atol=1e-3)
    # Each sheet, shown by its centre, its matrix and the chart's field, agrees within the field's steps.
    for sheet_number, fit in enumerate(found.fits[0, :2]):
        own = found.sheets == sheet_number
        steps = mesh.places[found.triangles[own]].reshape(-1, 2) - fit[2:4]
        matrix = fields[int(fit[1])].matrices[1, 1].reshape(2, 2) / 4096
        shown = fit[4:6] + 0.5 * steps @ (fit[6:10].reshape(2, 2) + matrix).T
        near = np.abs(exact[own].reshape(-1, 2)).max(axis=1) < 20
        assert np.abs(shown - exact[own].reshape(-1, 2))[near].max() < 0.5


def test_a_block_reaches_as_far_as_its_square_and_no_farther() -> None:
    mesh_surface = patches(sphere(16))
    vectors = level(mesh_surface.mesh)
    charts = mesh_charts(mesh_surface, DENSITY)
    fields = warp_fields(mesh_surface, charts, *triangle_frames(mesh_surface, vectors), SCALE)
    mesh = mesh_arrays(subdivided(mesh_surface, vectors, 0.06), charts)
    chosen = np.flatnonzero(np.abs(mesh.positions[mesh.triangles].mean(axis=1)[:, 2]) < 0.5)[::97]
    roots = np.column_stack(
        [mesh.chart[chosen], mesh.places[chosen].mean(axis=1), np.zeros((len(chosen), 3))]
    )
    centres = Centres(chosen.astype(np.int32), np.full((len(chosen), 3), 1 / 3), roots)
    found = find_footprints(mesh, field_arrays(fields, 1.0, 0), centres, 12.0, SCALE, threads=2)
    for n, triangle in enumerate(chosen):
        part = slice(found.firsts[n], found.firsts[n + 1])
        assert found.triangles[part][0] == triangle
        assert len(set(found.triangles[part])) == found.firsts[n + 1] - found.firsts[n]
        maps = found.maps[part]
        assert (maps.min(axis=1) <= 12).all()
        assert (maps.max(axis=1) >= -12).all()
        # Areas of triangles as the block shows them are those in space, nearly: a sphere can not be flat.
        edges = maps[:, 1:] - maps[:, :1]
        shown = 0.5 * (edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]) / SCALE**2
        corners = mesh.positions[mesh.triangles[found.triangles[part]]]
        area = 0.5 * np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        assert np.abs(shown / area - 1).mean() < 0.05
        assert shown.sum() == pytest.approx((2 * 12 / SCALE) ** 2, rel=0.6)
        off = _misfits(mesh, fields, found.triangles[part], found.fits[n][found.sheets[part]])
        np.testing.assert_allclose(found.misfits[part], np.where(found.sheets[part] < 0, 0, off), atol=1)
        assert found.misfits[part][0] < found.misfits[part].max()


def _misfits(mesh: Any, fields: Any, triangles: np.ndarray, fits: np.ndarray) -> np.ndarray:
    # What sheets show of a triangle's corners, against where they lie in the field: 32 for 5° or 5 %.
    places, out = mesh.places[triangles], np.zeros(len(triangles))
    for n, (triangle, fit) in enumerate(zip(triangles, fits, strict=True)):
        nodes = fields[int(fit[1])].matrices / 4096
        at = (places[n] + 32) / 32
        first = np.clip(at.astype(int), 0, np.array(nodes.shape[:2]) - 2)
        (y, x), (i, j) = (at - first).T[..., None], first.T
        upper = nodes[i, j] * (1 - x) + nodes[i, j + 1] * x
        lower = nodes[i + 1, j] * (1 - x) + nodes[i + 1, j + 1] * x
        matrices = 0.5 * (fit[6:10] + upper * (1 - y) + lower * y).reshape(3, 2, 2)
        shown = np.einsum("kab,kb->ka", matrices, places[n] - fit[2:4])
        corners = mesh.positions[mesh.triangles[triangle]]
        true = SCALE * np.stack([corners @ mesh.down[triangle], corners @ mesh.along[triangle]], axis=1)
        turned = (shown[1:] - shown[0]).T @ np.linalg.inv((true[1:] - true[0]).T)
        angle, size = abs(turned[0, 1]) / turned[0, 0], np.sqrt(np.linalg.det(turned))
        out[n] = min(32 * max(angle / 0.0875, abs(size - 1) / 0.05), 255)
    return out


def test_surfaces_that_touch_have_vertices_of_their_own_where_blocks_are_unfolded() -> None:
    # Two sheets that cross in a line, and touch a third one at a point.
    flat = sheet()
    corners = flat.mesh.corners - [1, 1, 0]
    upright = corners[..., [0, 2, 1]]
    beside = corners + np.array([2, 2, 0])
    positions, vertex = welded(np.round(np.concatenate([corners, upright, beside]).reshape(-1, 3), 9))
    mesh = TriangleMesh(positions, vertex.reshape(-1, 3))
    count = len(corners)
    assert len(positions) < 3 * len(flat.mesh.positions)
    island = np.arange(3 * count) // count
    surface = MeshSurface(mesh, island, np.concatenate([flat.parameters] * 3))
    assert not surface.is_seam.any()  # each goes through the other
    vectors = np.tile([1.0, 0.0, 0.0], (3 * count, 3, 1))
    charts = mesh_charts(surface, DENSITY)
    found = mesh_arrays(subdivided(surface, vectors, 2.0), charts)
    np.testing.assert_array_equal(found.positions[found.triangles], mesh.corners)
    own = [set(found.triangles[island == n].ravel().tolist()) for n in range(3)]
    assert not own[0] & own[1] | own[0] & own[2] | own[1] & own[2]
    quilt, bare = covered_and_bare(surface, vectors)
    for places, one in zip(_texels_inside(surface, quilt), bare, strict=True):
        assert one[places].mean() < 0.005
    whole = mesh_arrays(subdivided(flat, vectors[:count], 2.0), mesh_charts(flat, DENSITY))
    np.testing.assert_array_equal(whole.triangles, flat.mesh.triangles)


@pytest.mark.parametrize("make", [lambda: patches(sphere(16)), lambda: patches(torus(24, 60))])
def test_every_part_of_a_mesh_is_covered_at_true_scale_without_seams(make: Callable[[], MeshSurface]) -> None:
    surface = make()
    vectors = level(surface.mesh)
    quilt, bare = covered_and_bare(surface, vectors)
    texels = paint(quilt, noise())
    for places, one in zip(_texels_inside(surface, quilt), bare, strict=True):
        assert one[places].mean() < 0.005
    seams = mesh_seams(surface, quilt, texels, noise())
    assert seams.ratio is not None
    assert 0.9 < seams.ratio < 1.12
    assert seams.creases == 0.0
    assert seams.over_creases is None
    found = mesh_mapping(surface, quilt, scale=SCALE)
    assert found.error < 0.13  # large blocks on a small model
    assert mesh_texel_scale(surface, quilt.charts).spread < 3


def begun(surface: MeshSurface, vectors: np.ndarray) -> _Laying:
    """Return a synthesis with nothing laid yet."""
    charts = mesh_charts(surface, DENSITY)
    fields = warp_fields(surface, charts, *triangle_frames(surface, vectors), SCALE)
    frame = _frame((96, 96), 24, SCALE, DENSITY)
    fine = subdivided(surface, vectors, 0.4 * frame.size / frame.scale)
    working = tuple(_working(chart, frame) for chart in charts)
    mesh = mesh_arrays(fine, working)
    return _Laying.of(
        noise(),
        surface,
        charts,
        fields,
        fine,
        working,
        mesh,
        frame,
        SCALE,
        QuiltOptions(block=24),
        None,
        0,
        1,
    )


def at(laying: _Laying, *points: tuple[float, float]) -> Centres:
    """Return blocks' centres on a flat mesh in the plane z = 0."""
    mesh, chosen, shares = laying.mesh, [], []
    for point in points:
        corners = mesh.positions[mesh.triangles][:, :, :2]
        system = np.concatenate([corners.transpose(0, 2, 1), np.ones((len(corners), 1, 3))], axis=1)
        found = np.linalg.solve(system, np.tile([*point, 1.0], (len(corners), 1))[..., None])[..., 0]
        chosen.append(int(found.min(axis=1).argmax()))
        shares.append(found[chosen[-1]])
    places = (np.array(shares)[:, :, None] * mesh.places[chosen]).sum(axis=1)
    roots = np.column_stack([mesh.chart[chosen], places, np.zeros((len(chosen), 3))])
    return Centres(np.array(chosen, np.int32), np.array(shares), roots)


def bare_columns(laying: _Laying, chart: int, row: int) -> np.ndarray:
    """Return which texels of a row of a working chart lie on the mesh, and nothing is laid there."""
    canvases = laying.canvases
    own = canvases.firsts[chart] + row * canvases.widths[chart] + np.arange(canvases.widths[chart])
    return np.flatnonzero((canvases.triangles[own] >= 0) & (canvases.covered[own] == 0))


def test_a_block_that_ends_beside_another_leaves_room_for_one_over_both() -> None:
    surface = sheet()
    vectors = np.tile([1.0, 0.0, 0.0], (len(surface.mesh.triangles), 3, 1))
    for margin in (0, 9):
        laying = begun(surface, vectors)
        side = laying.frame.size / laying.frame.scale
        row = int(at(laying, (1.0, 1.0)).roots[0, 1])
        before = bare_columns(laying, 0, row)
        # Two blocks side by side, with a texel in common.
        laying.lay(at(laying, (1 - side / 2, 1.0), (1 + side / 2 - 1 / SCALE, 1.0)), margin, None)
        laid = np.setdiff1d(before, bare_columns(laying, 0, row))
        between = np.arange(laid[0], laid[-1] + 1)
        assert len(between) == pytest.approx(2 * laying.frame.size - 1, abs=2)
        # Cells that are half bare are laid.
        left = len(between) - len(laid)
        assert left == 0 if margin == 0 else 1 <= left <= margin
    laying.lay(laying.bare_centres(), margin, None)
    assert not np.isin(bare_columns(laying, 0, row), between).any()


def test_a_block_that_overlaps_another_leaves_no_room() -> None:
    surface = sheet()
    vectors = np.tile([1.0, 0.0, 0.0], (len(surface.mesh.triangles), 3, 1))
    covered = []
    for margin in (0, 9):
        laying = begun(surface, vectors)
        side = laying.frame.size / laying.frame.scale
        # Like bricks: to its right by the usual overlap, and half a block away along it.
        laying.lay(at(laying, (1.0, 1.0), (1.0 + 0.7 * side, 1.0 + side / 2)), margin, None)
        covered.append(int(laying.canvases.covered.sum()))
    assert covered[0] - covered[1] <= 20  # beside the corners, where one ends at the other


@pytest.mark.parametrize(("before", "now", "new"), [(0, 255, 0), (255, 0, 1)])
def test_of_two_blocks_the_one_that_is_much_truer_to_the_field_is_seen(
    before: int, now: int, new: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def found(*of: Any, **choices: Any) -> Footprints:
        footprints = find_footprints(*of, **choices)
        footprints.misfits[:] = now
        return footprints

    surface = sheet()
    laying = begun(surface, np.tile([1.0, 0.0, 0.0], (len(surface.mesh.triangles), 3, 1)))
    side, cells = laying.frame.size / laying.frame.scale, laying.frame.size // laying.frame.cell
    laying.lay(at(laying, (1.0, 1.0)), 0, None)
    laying.canvases.misfits[:] = before
    monkeypatch.setattr(method, "find_footprints", found)
    laying.lay(at(laying, (1.0 + 0.5 * side, 1.0)), 0, None)
    mask = laying.masks[1].reshape(cells, cells)[2:-2, 2 : cells // 2 - 1]  # over the first one
    assert (mask == new).all()


def test_a_block_keeps_off_where_it_can_not_go_on_beside_what_is_laid() -> None:
    # The field jumps by 90° over a line down a sheet: no block reaches over.
    surface = sheet()
    xs = np.unique(surface.mesh.positions[:, 0].round(9))
    line = float(xs[np.abs(xs - 1).argmin()])
    right = surface.mesh.corners[:, :, 0].mean(axis=1) > line
    vectors = np.where(right[:, None, None], [0.0, 1.0, 0.0], np.tile([1.0, 0.0, 0.0], (len(right), 3, 1)))
    laying = begun(surface, vectors)
    side = laying.frame.size / laying.frame.scale
    row, middle = (int(place) for place in at(laying, (line, 1.0)).roots[0, 1:3])
    bare, ends = bare_columns(laying, 0, row), []
    for away in (-0.46 * side, 0.46 * side):
        laying.lay(at(laying, (line + away, 1.0)), 5, None)
        left = bare_columns(laying, 0, row)
        ends.append(np.setdiff1d(bare, left) - middle)
        bare = left
    # The first one has nothing beside it, the second one leaves bare what is near the first.
    assert ends[0].max() == pytest.approx(0, abs=2)
    assert ends[1].min() == pytest.approx(5, abs=2)


def test_seams_over_creases_are_told_by_themselves() -> None:
    # Each side of a box is an island; one of them is cut in two as well.
    surface = patches(box((1.0, 1.0, 1.0)))
    middle = surface.mesh.corners.mean(axis=1)
    first = surface.island == 0
    split = first & (middle[:, 1] > 0.5)  # it lies across x
    island = np.where(split, surface.islands, surface.island)
    surface = MeshSurface(surface.mesh, island, surface.parameters)
    vectors = np.cross([0.3, 0.5, 0.8], surface.mesh.flat_normals)
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    quilt = covered(surface, np.repeat(vectors[:, None], 3, axis=1))
    texels = paint(quilt, noise())
    apart = mesh_seams(surface, quilt, texels, noise())
    assert apart.ratio is not None
    assert apart.over_creases is not None
    assert apart.ratio < 1.1 < 1.2 < apart.over_creases  # where directions turn
    # Twelve edges of the box, and one cut as long as one of them.
    cut = apart.creases
    assert 0.85 < cut < 0.95
    together = mesh_seams(surface, quilt, texels, noise(), crease=180)
    assert together.creases == 0.0
    assert together.over_creases is None
    assert together.ratio == pytest.approx(cut * apart.over_creases + (1 - cut) * apart.ratio, rel=0.1)


def test_over_a_ridge_the_texture_lies_true_to_size_and_upright_on_both_sides() -> None:
    surface = roof()
    field = direction_field(surface.mesh, "level")
    charts = mesh_charts(surface, DENSITY)
    along, down = triangle_frames(surface, field.corner_vectors)
    turns = chart_turns(surface, along, field.fold)
    fields = warp_fields(surface, charts, along, down, SCALE, turns)
    quilt = synthesize_mesh(
        noise(), surface, charts, fields, field.corner_vectors, SCALE, fold=field.fold, turns=turns,
        options=QuiltOptions(block=24),
    )  # fmt: skip
    assert set(quilt.placements["symmetry"].tolist()) == {0, 2}
    # A field of one sense turns about on the ridge: a third of the area would be of another size.
    found = mesh_mapping(surface, quilt, scale=SCALE, asked=np.repeat(along[:, None], 3, axis=1))
    assert found.within > 0.97
    assert found.aligned is not None
    assert found.aligned > 0.9


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_turned_matrices_give_the_same_blocks_turned_back(quarters: int) -> None:
    surface = halves(sheet(), 33)
    vectors = np.tile([1.0, 0.0, 0.0], (len(surface.mesh.triangles), 3, 1))
    charts, (along, down) = mesh_charts(surface, DENSITY), triangle_frames(surface, vectors)
    texels = []
    # One half's matrices are turned, and with them its blocks, but nothing that is seen.
    for turns in (0 * surface.island, quarters * surface.island):
        turns = turns.astype(np.int32)
        fields = warp_fields(surface, charts, along, down, SCALE, turns)
        quilt = synthesize_mesh(
            noise(), surface, charts, fields, vectors, SCALE, fold=4, turns=turns,
            options=QuiltOptions(block=24),
        )  # fmt: skip
        texels.append(paint(quilt, noise()))
    for index, places in enumerate(_texels_inside(surface, quilt)):
        one, other = (painted.arrays[index][places].astype(int) for painted in texels)
        assert (np.abs(one - other).max(axis=1) <= 24).mean() > 0.97


def test_the_same_seed_gives_the_same_quilt_whatever_the_threads() -> None:
    surface = patches(sphere(12))
    vectors = level(surface.mesh)
    one, two, other = (covered(surface, vectors, seed=s, threads=t) for s, t in ((4, 1), (4, 3), (5, 1)))
    np.testing.assert_array_equal(one.placements, two.placements)
    for a, b in zip(one.labels, two.labels, strict=True):
        np.testing.assert_array_equal(a[0].labels, b[0].labels)
    assert len(one.placements) != len(other.placements) or (one.placements != other.placements).any()
    assert one.surface is surface


def _texels_inside(surface: MeshSurface, quilt: Quilt) -> list[np.ndarray]:
    # Which texels' centres lie well inside a triangle, chart by chart.
    places = chart_places(surface, quilt.charts) - 0.5
    out = [np.zeros((chart.height, chart.width), bool) for chart in quilt.charts]
    for island, p in zip(surface.island, places, strict=True):
        for share in ((1, 1, 1), (2, 1, 1), (1, 2, 1), (1, 1, 2)):
            place = (np.array(share)[:, None] * p).sum(axis=0) / sum(share)
            row, column = np.rint(place).astype(int)
            out[island][row, column] = True
    return out


def test_texels_are_located_and_the_nearest_found_as_by_the_plain_twins() -> None:
    surface = halves(sheet(20), 40)
    vectors = np.tile([1.0, 0.0, 0.0], (len(surface.mesh.triangles), 3, 1))
    charts = mesh_charts(surface, 20.0)
    mesh = mesh_arrays(subdivided(surface, vectors, 0.5), charts)
    sizes = np.array([(chart.height, chart.width) for chart in charts], np.int64)
    firsts = np.concatenate([[0], np.cumsum(sizes.prod(axis=1))]).astype(np.int64)
    rng = np.random.default_rng(1)
    canvases = Canvases(
        np.zeros((firsts[-1], 1), np.uint8),
        np.zeros(firsts[-1], np.int32),
        (rng.random(firsts[-1]) < 0.7).astype(np.uint8),
        np.full(firsts[-1], -1, np.int32),
        firsts[:-1],
        sizes[:, 0].copy(),
        sizes[:, 1].copy(),
        np.zeros(firsts[-1], np.uint8),
    )
    locate_texels(mesh, canvases)
    for chart, (height, width) in enumerate(sizes):
        own = canvases.triangles[firsts[chart] : firsts[chart + 1]].reshape(height, width)
        rows, columns = np.mgrid[:height, :width]
        inside = np.zeros((height, width), bool)
        for p, of in zip(mesh.places, mesh.chart, strict=True):
            if of == chart:
                edges = np.roll(p, -1, axis=0) - p
                sides = [
                    e[0] * (columns - q[1]) - e[1] * (rows - q[0]) >= 0 for e, q in zip(edges, p, strict=True)
                ]
                inside |= np.logical_and.reduce(sides)
        np.testing.assert_array_equal(own >= 0, inside)
        for bare in (False, True):
            shape = (int((height - 3) / 9 + 1.5), int((width - 3) / 9 + 1.5))
            away, found = np.empty(shape), np.empty(shape, np.int32)
            nearest_texels(canvases, chart, 9.0, 3.0, bare, away, found)
            laid = canvases.covered[firsts[chart] : firsts[chart + 1]].reshape(height, width) == 1
            wanted = inside & ~(laid & bare)
            for i, j in product(range(shape[0]), range(shape[1])):
                squares = [
                    ((r - 3 - 9 * i) ** 2 + (c - 3 - 9 * j) ** 2, r * width + c)
                    for r, c in zip(*np.nonzero(wanted), strict=True)
                    if min(max(int((r - 3) / 9 + 0.5), 0), shape[0] - 1) == i
                    and min(max(int((c - 3) / 9 + 0.5), 0), shape[1] - 1) == j
                ]
                assert found[i, j] == (min(squares)[1] if squares else -1)


def test_sheets_beyond_the_most_are_left_out_rather_than_wrong() -> None:
    # Every triangle an island of its own: a block has more sheets than are fitted.
    mesh = sheet().mesh
    fine = sheet().parameters + 5 * np.arange(len(mesh.triangles))[:, None, None]
    surface = MeshSurface(mesh, np.arange(len(mesh.triangles)), fine)
    vectors = np.tile([1.0, 0.0, 0.0], (len(mesh.triangles), 3, 1))
    charts = mesh_charts(surface, DENSITY)
    fields = warp_fields(surface, charts, *triangle_frames(surface, vectors), SCALE)
    mesh_like = mesh_arrays(subdivided(surface, vectors, 0.5), charts)
    middle = np.flatnonzero(mesh_like.chart == 48)[0]
    root = [mesh_like.chart[middle], *mesh_like.places[middle].mean(axis=0), 0, 0, 0]
    centres = Centres(np.array([middle], np.int32), np.full((1, 3), 1 / 3), np.array([root], float))
    found = find_footprints(mesh_like, field_arrays(fields, 1.0, 0), centres, 100.0, SCALE, threads=1)
    assert found.sheets.max() < MOST_SHEETS
    assert set(found.sheets[found.sheets >= 0]) <= set(np.flatnonzero(found.fits[0, :, 0] == 1))
