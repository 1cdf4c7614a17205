"""What was laid becomes labels and placements: cells show what shows at their middles, and read the same."""

from typing import Any

import numpy as np
import pytest
from laying import Run, covered, cylinder, folded, net, plane, texture
from plain_emitting import centred
from plain_laying import plain_filled

from upholster.quilt.displacement import warped_sources
from upholster.quilt.labels import cell_centres, label_shape
from upholster.synthesis.quilt import emit
from upholster.synthesis.quilt.kernels._emit_kernels import centre_placements
from upholster.synthesis.quilt.kernels._label_map_kernels import (
    fill_labels,
    label_beyond,
    label_cells,
    list_sheets,
)
from upholster.synthesis.quilt.kernels._sheet_kernels import MOST_SHEETS

EXEMPLAR = texture(96, 96, passes=8)


@pytest.fixture(scope="module")
def bent() -> Run:
    """Return what is laid on a cyclide, where each chart's field varies."""
    return covered(EXEMPLAR, "cyclide", texels=15_000, sample_size=20.0, block=24)


def test_cells_without_a_label_get_the_nearest_ones() -> None:
    rng = np.random.default_rng(2)
    labels = np.where(rng.random((30, 24)) < 0.03, rng.integers(0, 99, (30, 24)), -1).astype(np.int32)
    filled = labels.copy()
    fill_labels(filled, np.empty(filled.size, np.int64))
    np.testing.assert_array_equal(filled, plain_filled(labels))
    known = np.argwhere(labels >= 0)
    for i, j in np.ndindex(labels.shape):
        away = np.abs(known - (i, j)).sum(axis=1)
        assert filled[i, j] in {int(labels[tuple(at)]) for at in known[away == away.min()]}


def plain_seen(owners: np.ndarray, sheets: np.ndarray, cell: int) -> np.ndarray:
    """Return what cells show: the step right after the middle, or the first step that shows something."""
    out = np.full(label_shape(*owners.shape, cell), -1)
    for i, j in np.ndindex(out.shape):
        steps = [(cell // 2, cell // 2), *np.ndindex(cell, cell)]
        for r, c in [((i - 1) * cell + down, (j - 1) * cell + right) for down, right in steps]:
            if 0 <= r < owners.shape[0] and 0 <= c < owners.shape[1] and owners[r, c] >= 0:
                out[i, j] = owners[r, c] * MOST_SHEETS + sheets[r, c]
                break
    return out


@pytest.mark.parametrize("cell", [1, 2, 3, 4, 7])
def test_a_cell_shows_what_shows_at_its_middle(cell: int) -> None:
    rng, (ground, _) = np.random.default_rng(cell), plane(60, 50).ground(1e9)
    canvases = ground.canvases
    shape = int(canvases.heights[0]), int(canvases.widths[0])
    canvases.owners[:] = rng.integers(-6, 9, len(canvases.owners)).clip(-1)
    canvases.sheets[:] = rng.integers(0, MOST_SHEETS, len(canvases.owners))
    found = np.empty(label_shape(*shape, cell), np.int64)
    away, own = np.empty(found.shape), np.array([0, 1], np.uint8)
    label_cells(canvases, own, 0, cell, away, found)
    assert (np.isinf(away) == (found < 0)).all()
    assert set(away[found >= 0].tolist()) == {0.0, -1.0}
    owners, sheets = canvases.owners.reshape(shape), canvases.sheets.reshape(shape).astype(int)
    np.testing.assert_array_equal(found, plain_seen(owners, sheets, cell))


def test_sheets_are_numbered_as_they_are_seen(bent: Run) -> None:
    canvases, chart = bent.ground.canvases, 3
    shape = int(canvases.heights[chart]), int(canvases.widths[chart])
    seen = np.empty(label_shape(*shape, 2), np.int64)
    away = np.empty(seen.shape)
    label_cells(canvases, bent.laid.own.view(np.uint8), chart, 2, away, seen)
    away[::5] = -1.0  # not told
    reported = (seen >= 0) & (away >= 0)
    ranks = np.full(len(bent.laid.fits), -1, np.int32)
    labels, keys = np.empty(seen.shape, np.int32), np.empty(seen.size, np.int64)
    count = list_sheets(seen, away, bent.laid.firsts, ranks, labels, keys)
    _, first = np.unique(seen[reported], return_index=True)
    np.testing.assert_array_equal(keys[:count], seen[reported][np.sort(first)])
    np.testing.assert_array_equal(keys[labels[reported]], seen[reported])
    assert (labels[~reported] == -1).all()
    assert (ranks == -1).all()


@pytest.mark.parametrize(("turned", "stretched"), [(0, 1), (90, 1), (33, 0.7)])
def test_beyond_a_seam_cells_show_what_shows_there(turned: float, stretched: float) -> None:
    islands = np.tile(np.arange(12) // 6, 12)
    surface = cylinder(islands=islands, turned=(0.0, turned), stretched=stretched)
    run, cell = surface.laid(EXEMPLAR, block=24), 2
    ground = run.ground
    mesh, canvases = ground.mesh, ground.canvases
    edges = np.argwhere((mesh.seam >= 0) & (mesh.chart[:, None] == 0))
    shape = int(canvases.heights[0]), int(canvases.widths[0])
    labels = np.empty(label_shape(*shape, cell), np.int64)
    away = np.empty(labels.shape)
    label_cells(canvases, run.laid.own.view(np.uint8), 0, cell, away, labels)
    before, bare = labels.copy(), np.isinf(away)
    label_beyond(mesh, ground.field, canvases, run.laid.firsts, run.laid.fits, edges, 0, cell, away, labels)
    new = bare & np.isfinite(away)
    np.testing.assert_array_equal(labels[~new], before[~new])
    assert (before[new] == -1).all()
    # Chart 0 ends at x = 60. A place beyond it lies on chart 1, turned back and moved.
    a, first = np.radians(turned), surface.charted.places[surface.charted.chart == 1].reshape(-1, 2)
    flat = surface.flat[surface.charted.chart == 1].reshape(-1, 2)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) * (1, stretched)
    move = first[0] - np.array([-flat[0, 1], flat[0, 0]]) @ turn
    start = surface.charted.places[0, 0] - (-surface.flat[0, 0, 1], surface.flat[0, 0, 0])
    same = 0
    for i, j in np.argwhere(new):
        place = (np.array([i, j]) - 0.5) * cell - start
        there = np.floor(place @ turn + move - 0.5 + 0.5 + 1e-6).astype(int)
        owner = run.on(1, "owners")[tuple(there)]
        same += int(labels[i, j] // MOST_SHEETS == owner)
    # All along the seam, 90 steps long; places halfway between two blocks may be taken for either.
    assert same >= 0.9 * new.sum()
    assert new.sum() >= 0.85 * 90 / cell


def read_by(run: Run, chart: int, rows: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where a quilt reads at places in 1/16 step, and which placement shows in those cells."""
    labels = run.quilt.labels[chart][0]
    i, j = (at // (16 * labels.cell) + 1 for at in (rows, columns))
    owner = run.quilt.on_chart(chart)[labels.labels[i, j]]
    return np.stack(warped_sources(run.quilt.fields[chart], owner, rows, columns), axis=1), owner


def made(kind: str) -> Run:
    if kind == "plane":
        return plane().laid(EXEMPLAR, block=24)
    islands = np.tile(np.arange(12) // 6, 12)
    if kind == "cylinder":
        return cylinder(islands=islands, turned=(0.0, 20.0)).laid(EXEMPLAR, block=24)
    # A step is four pixels, or about one.
    if kind == "minified":
        return cylinder(islands=islands, turned=(0.0, 20.0), scale=4.0).laid(EXEMPLAR, block=64)
    return covered(EXEMPLAR, "cyclide", texels=15_000, sample_size=20.0, block=24)


@pytest.mark.parametrize("kind", ["plane", "cylinder", "minified", "cyclide"])
def test_each_cell_reads_what_its_block_read(kind: str) -> None:
    run, off = made(kind), []
    assert run.numbers.level == (2 if kind == "minified" else 0)
    for chart in range(len(run.quilt.charts)):
        owners = run.on(chart, "owners")
        # Steps right after the middles of cells that show one block all over.
        sides = [np.arange(1, size - 1, 2) for size in owners.shape]
        rows, columns = (x.ravel() for x in np.meshgrid(*sides, indexing="ij"))
        shown = np.stack([owners[rows + a, columns + b] for a in (-1, 0, 1) for b in (-1, 0, 1)])
        whole = (shown == shown[0]).all(axis=0) & (shown[0] >= 0)
        at = rows[whole], columns[whole]
        found, _ = read_by(run, chart, 16 * at[0] + 8, 16 * at[1] + 8)
        # The middle of a level's pixel, and what lies beside it.
        read = ((run.shown(chart, at) - run.numbers.fringe + 0.5) * (1 << run.numbers.level)) - 0.5
        off.append(np.abs(found / 16 - read).max(axis=1))
    apart = np.concatenate(off)
    assert len(apart) > 500
    # Sources are quarters of a pixel; a placement's matrix is mended where it is off by more than 0.3.
    pixel = 1 << run.numbers.level
    assert np.median(apart) < 0.2
    assert np.quantile(apart, 0.99) < (0.7 if kind == "cyclide" else 0.35) * pixel
    mended = (run.quilt.placements["offset"] != 0).any(axis=1).mean()
    assert mended == 0 if kind in ("plane", "cylinder") else kind == "minified" or mended > 0


def test_centres_are_middles_of_own_cells(bent: Run) -> None:
    quilt = bent.quilt
    for n in range(len(quilt.charts)):
        placed, layer = quilt.on_chart(n), quilt.labels[n][0]
        places = []
        for name, count in zip(("row", "column"), layer.labels.shape, strict=True):
            centres = cell_centres(count, layer.cell)
            places.append(np.searchsorted(centres, placed[name]))
            np.testing.assert_array_equal(centres[places[-1]], placed[name])
        np.testing.assert_array_equal(layer.labels[tuple(places)], np.arange(len(placed)))
        assert (np.diff(places[0] * layer.labels.shape[1] + places[1]) > 0).all()


def test_a_chart_on_which_nothing_was_laid_shows_the_sample_bare() -> None:
    # The second chart lies on triangles without area in steps.
    flat = np.array([(0, 0), (60, 0), (60, 60), (0, 60), (120, 0), (120, 60)], float)
    triangles = np.concatenate([net(1, 1)[:0], [(0, 1, 2), (0, 2, 3), (1, 4, 5), (1, 5, 2)]])
    surface = folded(
        flat,
        np.column_stack([flat, 0 * flat[:, 0]]),
        triangles,
        islands=np.array([0, 0, 1, 1]),
        turned=(0, 0),
    )
    surface.charted.chart[2:] = -1
    run = surface.laid(EXEMPLAR, block=24)
    assert len(run.quilt.on_chart(1)) == 1
    assert not run.quilt.labels[1][0].labels.any()
    assert (run.quilt.placements["chart"] == 0).sum() > 5


def test_placements_are_settled_as_in_plain_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[tuple[Any, ...]] = []

    def kept(field: Any, cells: Any, matrices: Any, margin: int, rounded: int, found: Any) -> None:
        centre_placements(field, cells, matrices, margin, rounded, found)
        calls.append((field, cells._replace(shown=cells.shown.copy()), matrices, rounded, found))

    monkeypatch.setattr(emit, "centre_placements", kept)
    run = covered(EXEMPLAR, "cyclide", texels=15_000, sample_size=20.0, block=24, mirror=True, rotate=True)
    assert len(calls) == len(run.quilt.charts)
    for field, cells, matrices, rounded, found in calls:
        (warp,) = (one for one in run.quilt.fields if np.array_equal(one.matrices, matrices))
        centres, reads, off, square, product = centred(field, cells, warp, rounded)
        np.testing.assert_array_equal(found.cells, centres)
        np.testing.assert_array_equal(found.reads, reads)
        np.testing.assert_array_equal(found.off, off)
        np.testing.assert_array_equal(found.square, square)
        np.testing.assert_array_equal(found.product, product)
