"""Frames and canvases: where blocks lie on charts, what is there, what they write; steps and centres."""

from itertools import product
from typing import Any

import numpy as np
import pytest
from laying import Folded, cylinder, plane, texture
from laying_kernels import keep, lay_numbers, lie, look, write
from plain_laying import SYMMETRIES, barycentric
from warp_fields import quantised

from upholster.charts._step_kernels import StepGrid, locate_steps
from upholster.quilt.warp_field import FIELD_STEP, WarpField
from upholster.synthesis.quilt.centres import centres_on
from upholster.synthesis.quilt.kernels._block_kernels import BLOCK_COLUMNS, PHASE, CourseRule, FramePixels
from upholster.synthesis.quilt.kernels._frame_kernels import bound_places
from upholster.synthesis.quilt.kernels._lay_kernels import Ground
from upholster.synthesis.quilt.kernels._sheet_kernels import FIT, MOST_SHEETS, FieldArrays
from upholster.synthesis.quilt.kernels._unfold_kernels import Footprint
from upholster.synthesis.quilt.kernels._whole_kernels import CLEAR_CELL, ClearCells
from upholster.synthesis.quilt.match_pyramid import match_pyramid


def bent(scale: float, by: float, degrees: float = 0.0) -> WarpField:
    """Return a field that turns and grows over a chart."""
    i, j = np.mgrid[:6, :7]
    angle = np.radians(degrees) + by * (i - 1.5 * j)
    turn = np.stack([np.cos(angle), np.sin(angle), -np.sin(angle), np.cos(angle)], -1).reshape(6, 7, 2, 2)
    return quantised(scale * 2 ** (0.5 * by * (i + j))[..., None, None] * turn)


def arrays_of(field: WarpField) -> FieldArrays:
    """Return a field as kernels take it."""
    nodes = field.matrices.reshape(-1, 4) / 4096
    return FieldArrays(
        nodes, np.array([(0, *field.matrices.shape[:2])], np.int64), float(FIELD_STEP), np.zeros((1, 2))
    )


def clear_cells(rows: int, columns: int, *crossed: tuple[int, int]) -> ClearCells:
    """Return cells of a chart of which some are crossed by edges."""
    cells = np.zeros((rows, columns), np.uint8)
    for at in crossed:
        cells[at] = 1
    return ClearCells(cells.ravel(), np.zeros(1, np.int64), np.array([(rows, columns)], np.int64))


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize(("scale", "by", "degrees"), [(1, 0, 0), (0.7, 0.05, 30), (1.6, -0.05, 200)])
def test_a_whole_block_lies_where_a_decoder_reads_it(
    scale: float, by: float, degrees: float, turns: int
) -> None:
    field, half = bent(scale, by, degrees), 12.0
    root = np.array([0, 70.3, 64.8, 0.25, -0.4, turns])
    out, fits = Footprint.of(64), np.zeros((MOST_SHEETS, FIT))
    count = lie(arrays_of(field), clear_cells(20, 20), root, half, out, fits)
    maps, places = out.maps[:count], out.places[:count]
    # A place q reads at s + ½ (C + M(q)) (q − c), with the quarter turns after M.
    turn = np.array(SYMMETRIES[turns]).reshape(2, 2)
    centre, q = field.at(root[1:2], root[2:3])[0], places.reshape(-1, 2)
    both = 0.5 * turn @ (centre + field.at(q[:, 0], q[:, 1]))
    reads = root[3:5] + np.einsum("nij,nj->ni", both, q - root[1:3])
    np.testing.assert_allclose(maps.reshape(-1, 2), reads, atol=0.02)
    # The triangles tile the frame and a little round it.
    edges, flat = maps[:, 1:] - maps[:, :1], places[:, 1:] - places[:, :1]
    areas = 0.5 * np.linalg.det(edges)
    assert (areas > 0).all()
    assert (np.linalg.det(flat) > 0).all()
    assert areas.sum() == pytest.approx((2 * half + 4) ** 2)
    assert maps.min() == -half - 2 == -maps.max()
    assert (out.triangles[:count] == -1).all()
    assert fits[0, 0] == 1


def test_a_block_is_unfolded_near_edges_and_where_it_varies() -> None:
    root, out, fits = np.array([0, 80.0, 80.0, 0, 0, 0]), Footprint.of(64), np.zeros((MOST_SHEETS, FIT))
    found = np.zeros((20, 20), bool)
    for at in np.ndindex(20, 20):
        found[at] = lie(arrays_of(bent(1, 0)), clear_cells(20, 20, at), root, 12.0, out, fits) > 0
    # Steps 80 ± 14 and a little lie in cells 8 to 12.
    rows, columns = np.nonzero(~found)
    assert set(rows.tolist()) == set(columns.tolist()) == {8, 9, 10, 11, 12}
    assert (~found).sum() == 25
    assert lie(arrays_of(bent(0.5, 0.4)), clear_cells(20, 20), root, 12.0, out, fits) == 0


def simple(side: tuple[int, int], hole: bool = True) -> Ground:
    """Return bare ground of one chart whose steps are pixels, with a part that is not on the surface."""
    ground, _ = plane(*side).ground(1e9)
    canvases = ground.canvases
    canvases.triangles[:] = 0
    if hole:
        canvases.triangles.reshape(canvases.heights[0], canvases.widths[0])[40:52, 30:36] = -1
    return ground


PLACES = [(45, 40), (3, 50), (85, 2), (60, 60), (101, 88)]


@pytest.mark.parametrize("centre", PLACES)
def test_a_frame_shows_what_is_laid_under_it(centre: tuple[int, int]) -> None:
    ground, size = simple((90, 75)), 24
    canvases, rng = ground.canvases, np.random.default_rng(centre[0])
    shape = int(canvases.heights[0]), int(canvases.widths[0])
    on = canvases.triangles.reshape(shape) >= 0
    owners = np.where(texture(*shape, 1, centre[1], 9)[..., 0] > 128, rng.integers(0, 9, shape), -1)
    canvases.owners[:] = np.where(on, owners, -1).ravel()
    canvases.sources[:] = rng.integers(0, 3600, shape).ravel()
    pixels, covered = FramePixels.of(size), np.zeros((size + 2, size + 2), np.uint8)
    symmetries = np.zeros(8, np.int64)
    records = np.zeros((9, BLOCK_COLUMNS), np.int32)
    records[:, 2] = np.arange(9) % 8
    out, fits = Footprint.of(64), np.zeros((MOST_SHEETS, FIT))
    count = lie(ground.field, clear_cells(20, 20), np.array([0, *centre, 0, 0, 0.0]), 12.0, out, fits)
    colours, sizes = rng.integers(0, 2**30, 3600).astype(np.int32), np.zeros(2, np.int64)
    inside = np.zeros(len(ground.mesh.triangles), np.uint8)
    match = match_pyramid(np.zeros((60, 60, 3), np.uint8)).levels[0].match._replace(image=colours)
    look(canvases, match, records, out, count, inside, covered, pixels, symmetries, sizes)
    # A step is a pixel: 1 where something is laid, 0 where nothing is, 2 beside the surface.
    around = np.full((shape[0] + 60, shape[1] + 60), 2)
    around[30:-30, 30:-30] = np.where(on, canvases.owners.reshape(shape) >= 0, 2)
    want = around[centre[0] + 17 :, centre[1] + 17 :][:26, :26]
    np.testing.assert_array_equal(covered, want)
    np.testing.assert_array_equal(pixels.marks, want[1:-1, 1:-1])
    assert not inside.any()
    i, j = np.nonzero(covered[1:-1, 1:-1] == 1)
    at = (i - 12 + centre[0]) * shape[1] + j - 12 + centre[1]
    np.testing.assert_array_equal(pixels.old[i, j], colours[canvases.sources[at]])
    # Pixels on the edges of the footprint's triangles count twice.
    shown = np.bincount(canvases.owners[at] % 8, minlength=8)
    assert (symmetries >= shown).all()
    assert symmetries.sum() <= 1.5 * shown.sum()
    assert sizes.tolist() == [(want[1:-1, 1:-1] == kind).sum() for kind in (1, 0)]


@pytest.mark.parametrize("centre", PLACES)
@pytest.mark.parametrize("symmetry", [0, 3, 5])
def test_a_block_writes_what_its_mask_shows(centre: tuple[int, int], symmetry: int) -> None:
    ground, size, image = simple((90, 75)), 24, texture(60, 60)
    canvases, rng = ground.canvases, np.random.default_rng(symmetry)
    shape = int(canvases.heights[0]), int(canvases.widths[0])
    mask, record = rng.integers(0, 2, (12, 12)).astype(np.uint8), np.zeros(BLOCK_COLUMNS, np.int32)
    record[:3] = 20, 50, symmetry
    out, fits = Footprint.of(64), np.zeros((MOST_SHEETS, FIT))
    count = lie(ground.field, clear_cells(20, 20), np.array([0, *centre, 0, 0, 0.0]), 12.0, out, fits)
    write(canvases, lay_numbers(*image.shape[:2], size), 6, record, mask.ravel(), out, count)
    owners, turn = np.full(shape, -1), SYMMETRIES[symmetry]
    for r, c in np.ndindex(shape):
        y, x = r - centre[0], c - centre[1]
        inside = -12 <= y < 12 and -12 <= x < 12
        if inside and mask[(y + 12) // 2, (x + 12) // 2] and canvases.triangles[r * shape[1] + c] >= 0:
            owners[r, c] = 6
            row = min(max(20 + turn[0] * y + turn[1] * x, 0), 59)
            column = min(max(50 + turn[2] * y + turn[3] * x, 0), 59)
            assert canvases.sources[r * shape[1] + c] == row * 60 + column
    np.testing.assert_array_equal(canvases.owners.reshape(shape), owners)
    assert (owners >= 0).any()


COURSE = CourseRule(1.0, -1.0, 0.4, 0.06, 0.01, 0.09)
"""Courses of about 16 pixels, a little tilted, and a pixel and a half to spare."""


def beyond_course(phases: tuple[int, int], laid: np.ndarray) -> np.ndarray:
    """Return which pixels round a frame's middle, 12 each way and one more, are beyond the block's course."""
    side = laid.shape[0]
    down, right = np.mgrid[:side, :side] - side // 2
    place = ((phases[0] - phases[1]) / 65536 - 0.4) % 1 + 0.06 * down + 0.01 * right
    spare = np.where(laid, 0.0, 0.09)
    return (place < -spare) | (place > 1 + spare)


@pytest.mark.parametrize("phases", [(9000, 20000), (-30000, 31000), (26214, 0)])
def test_a_block_ends_with_its_course(phases: tuple[int, int]) -> None:
    rng, size = np.random.default_rng(1), 24
    covered = rng.choice([0, 1, 2, 9], (size + 2, size + 2)).astype(np.uint8)
    want = np.where(beyond_course(phases, covered & 1 == 1), 2, covered)
    pixels, record, sizes = FramePixels.of(size), np.zeros(BLOCK_COLUMNS, np.int32), np.zeros(2, np.int64)
    record[PHASE:] = phases
    keep(lay_numbers(60, 60, size, course=COURSE), record, covered, pixels, sizes)
    np.testing.assert_array_equal(covered, want)
    inside = want[1:-1, 1:-1]
    np.testing.assert_array_equal(pixels.marks, inside)
    assert sizes.tolist() == [(inside & 1).sum(), (inside == 0).sum()]
    assert 0.2 < (want != 2).mean() < 0.7
    # What is written ends there, too.
    ground = simple((90, 75), hole=False)
    canvases = ground.canvases
    canvases.owners[:] = np.where(rng.random(len(canvases.owners)) < 0.5, 3, -1)
    shape = int(canvases.heights[0]), int(canvases.widths[0])
    laid = (canvases.owners.reshape(shape) >= 0)[45 - 12 : 45 + 12, 40 - 12 : 40 + 12]
    out, fits = Footprint.of(64), np.zeros((MOST_SHEETS, FIT))
    count = lie(ground.field, clear_cells(20, 20), np.array([0, 45, 40, 0, 0, 0.0]), 12.0, out, fits)
    numbers = lay_numbers(60, 60, size, course=COURSE)
    write(canvases, numbers, 6, record, np.ones(144, np.uint8), out, count)
    written = (canvases.owners.reshape(shape) == 6)[45 - 12 : 45 + 12, 40 - 12 : 40 + 12]
    np.testing.assert_array_equal(written, ~beyond_course(phases, laid))


def some_charts() -> tuple[Folded, Ground]:
    """Return a cylinder on two charts, one of which is turned, and its ground."""
    islands = np.tile(np.arange(6) // 3, 12)
    surface = cylinder(36, 30, 6, islands=islands, turned=(0, 40))
    return surface, surface.ground(12.0)[0]


def test_each_step_knows_its_triangle() -> None:
    _, ground = some_charts()
    canvases, mesh = ground.canvases, ground.mesh
    canvases.triangles[:] = -1
    away = np.full(len(canvases.triangles), np.inf, np.float32)
    grid = StepGrid(canvases.firsts, canvases.heights, canvases.widths)
    for n in (2, 0, 1):  # part by part, in any order
        locate_steps(mesh.places, mesh.chart, grid, canvases.triangles, (n, 3), away)
    for chart, first in enumerate(canvases.firsts):
        shape = int(canvases.heights[chart]), int(canvases.widths[chart])
        steps = np.array(list(np.ndindex(shape)), float)
        away = np.full((len(mesh.triangles), len(steps)), np.inf)
        for t in np.flatnonzero(mesh.chart == chart):
            p = mesh.places[t]
            shares = barycentric(p, steps)
            edges = [
                np.linalg.norm(
                    steps - p[k] - np.clip((steps - p[k]) @ e / (e @ e), 0, 1)[:, None] * e, axis=1
                )
                for k, e in enumerate(np.roll(p, -1, axis=0) - p)
            ]
            away[t] = np.where(shares.min(axis=1) >= 0, 0, np.min(edges, axis=0))
        found, least = canvases.triangles[first : first + len(steps)], away.min(axis=0)
        sure = abs(least - 0.75) > 1e-6
        # On obtuse corners the nearest place is found up to what clamping coordinates is off.
        np.testing.assert_array_equal((found >= 0)[sure & (least == 0)], True)
        assert not (found >= 0)[sure & (least > 0.75)].any()
        on = found >= 0
        assert (away[found[on], np.flatnonzero(on)] <= least[on] + 0.3).all()
        assert (found >= 0)[least < 0.5].mean() > 0.98


@pytest.mark.parametrize("bare", [False, True])
def test_centres_are_the_steps_nearest_to_an_even_grids_points(bare: bool) -> None:
    placed, _ = some_charts()[0].placed(12.0)
    ground, canvases, rng = placed.ground, placed.ground.canvases, np.random.default_rng(1)
    canvases.owners[:] = np.where(rng.random(len(canvases.owners)) < 0.7, 3, -1)
    asked, wanted = rng.random(len(ground.mesh.triangles)) < 0.5, []
    for chart, first in enumerate(canvases.firsts):
        height, width = int(canvases.heights[chart]), int(canvases.widths[chart])
        own = np.s_[first : first + height * width]
        triangles, left = canvases.triangles[own], canvases.owners[own] < 0
        free = (triangles >= 0) & (left & asked[triangles] if bare else True)
        shape = int((height - 3) / 9 + 1.5), int((width - 3) / 9 + 1.5)
        for i, j in product(range(shape[0]), range(shape[1])):
            squares = [
                ((r - 3 - 9 * i) ** 2 + (c - 3 - 9 * j) ** 2, r * width + c)
                for r, c in zip(*np.nonzero(free.reshape(height, width)), strict=True)
                if min(max(int((r - 3) / 9 + 0.5), 0), shape[0] - 1) == i
                and min(max(int((c - 3) / 9 + 0.5), 0), shape[1] - 1) == j
            ]
            if squares and asked[triangles[min(squares)[1]]]:
                wanted.append((chart, *divmod(min(squares)[1], width)))
    centres = centres_on(placed, asked, 9.0, 3.0, bare=bare)
    np.testing.assert_array_equal(centres.steps, wanted)
    np.testing.assert_array_equal(centres.roots[:, :3], wanted)
    # They are told in the same place on the chart, in the triangle, and in space.
    on = canvases.triangles[canvases.firsts[centres.roots[:, 0].astype(int)] + _within(canvases, centres)]
    np.testing.assert_array_equal(centres.triangles, on)
    for t, root, spot in zip(on, centres.roots, centres.spots, strict=True):
        shares = barycentric(ground.mesh.places[t], root[None, 1:3])[0]
        np.testing.assert_allclose(spot, shares @ ground.mesh.corners[t], atol=1e-9)


def _within(canvases: Any, centres: Any) -> np.ndarray:
    # The numbers of centres' steps on their charts.
    chart, row, column = centres.roots[:, :3].astype(int).T
    return np.asarray(row * canvases.widths[chart] + column)


def test_cells_with_seams_creases_and_borders_are_marked() -> None:
    surface, ground = some_charts()
    mesh, clear = ground.mesh, ground.clear
    for chart in range(2):
        rows, columns = clear.shapes[chart]
        found = clear.crossed[clear.firsts[chart] :][: rows * columns].reshape(rows, columns)
        wanted = np.zeros_like(found)
        for t in np.flatnonzero(mesh.chart == chart):
            for k in range(3):
                if mesh.neighbours[t, k] < 0 or mesh.seam[t, k] >= 0:
                    ends = mesh.places[t, [k, (k + 1) % 3]]
                    along = ends[0] + np.linspace(0, 1, 200)[:, None] * (ends[1] - ends[0]) + 0.5
                    wanted[tuple((along // CLEAR_CELL).astype(int).T)] = 1
                    # A cell may be missed whose corner alone is cut.
                    round_it = [along + np.array([y, x]) for y in (-1, 0, 1) for x in (-1, 0, 1)]
                    near = [found[tuple((at // CLEAR_CELL).astype(int).T)] for at in round_it]
                    assert np.max(near, axis=0).all()
        assert (found <= wanted).all()
        assert (found == 0).any()
    creased, _ = surface.ground(12.0, crease=20)
    assert creased.clear.crossed.sum() > clear.crossed.sum()


def test_places_of_each_chart_are_bounded() -> None:
    rng = np.random.default_rng(3)
    chart, places = rng.choice([-1, 0, 2], 30).astype(np.int32), rng.normal(size=(30, 3, 2))
    low, high = np.empty((3, 2)), np.empty((3, 2))
    bound_places(chart, places, low, high)
    for n in (0, 2):
        own = places[chart == n].reshape(-1, 2)
        np.testing.assert_array_equal((low[n], high[n]), (own.min(axis=0), own.max(axis=0)))
    assert (low[1] > high[1]).all()
