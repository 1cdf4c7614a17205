"""From cells to placements: the kernels' against those found in plain NumPy."""

import numpy as np
import pytest
from laying import Run, covered, texture
from plain_emission import plain_placements

from upholster.methods.quilt._emit_kernels import (
    FITTED,
    PLACED,
    CellLabels,
    PlacedSheets,
    choose_centres,
    enter_piece,
    fit_offsets,
)
from upholster.methods.quilt._label_kernels import label_cells, list_sheets
from upholster.methods.quilt._sheet_kernels import MOST_SHEETS
from upholster.quilt.labels import label_shape

EXEMPLAR = texture(96, 96, passes=8)


@pytest.fixture(scope="module", params=[0, 2])
def run(request: pytest.FixtureRequest) -> Run:
    """Return what is laid on a cyclide, at steps of a pixel and of several."""
    sizes = {"sample_size": 20.0, "block": 24} if request.param == 0 else {"sample_size": 5.0, "block": 64}
    return covered(EXEMPLAR, "cyclide", texels=15_000, **sizes)


def seen_on(run: Run, chart: int, cell: int) -> tuple[np.ndarray, np.ndarray]:
    """Return which block and sheet a chart's cells show, and whether they are told."""
    canvases = run.ground.canvases
    seen = np.empty(label_shape(int(canvases.heights[chart]), int(canvases.widths[chart]), cell), np.int64)
    away = np.empty(seen.shape)
    label_cells(canvases, run.laid.own.view(np.uint8), chart, cell, away, seen)
    return seen, away


@pytest.mark.parametrize("cell", [2, 3])
def test_placements_are_those_found_in_plain_numpy(run: Run, cell: int) -> None:
    rng, bent = np.random.default_rng(cell), 0
    for chart in range(0, len(run.quilt.charts), 7):
        seen, _ = seen_on(run, chart, cell)
        keys, labels = np.unique(seen, return_inverse=True)
        # Cells that show nothing, and sheets that no cell shows.
        labels = (labels.reshape(seen.shape) - (keys[0] < 0)).astype(np.int32)
        labels[rng.random(labels.shape) < 0.05] = -1
        labels[labels == 1] = -1
        block, sheet = np.divmod(keys[keys >= 0], MOST_SHEETS)
        fits = run.laid.fits[run.laid.firsts[block] + sheet]
        cells = CellLabels(labels, run.laid.records[block], fits, cell, run.numbers.level)
        count, field = len(block), run.quilt.fields[chart]
        symmetries = rng.integers(0, 8, count)
        placed = PlacedSheets(np.full((count, PLACED), -7, np.int64), symmetries)
        offsets = np.empty((count, 4), np.int32)
        choose_centres(run.ground.field, cells, EXEMPLAR.shape[:2], np.empty((count, 3)), placed)
        sums = np.empty((count, FITTED))
        fit_offsets(run.ground.field, cells, field.matrices, field.margin, placed, sums, offsets)
        expected, at = plain_placements(field, cells, symmetries, EXEMPLAR.shape[:2])
        shown = at[:, 0] >= 0
        assert not shown.all()
        np.testing.assert_array_equal(placed.places[:, 0], [(labels == n).sum() for n in range(count)])
        np.testing.assert_array_equal(placed.places[shown, 1:3], at[shown])
        for n, name in enumerate(("row", "column", "source_row", "source_column"), 3):
            np.testing.assert_array_equal(placed.places[shown, n], expected[name][shown])
        np.testing.assert_array_equal(offsets[shown], expected["offset"][shown])
        bent += int((offsets[shown] != 0).any(axis=1).sum())
    assert bent > 10


def test_sheets_are_numbered_as_they_are_seen(run: Run) -> None:
    seen, away = seen_on(run, 3, 2)
    away[::5] = -1.0  # not told
    told = (seen >= 0) & (away >= 0)
    ranks = np.full(len(run.laid.fits), -1, np.int32)
    labels, keys = np.empty(seen.shape, np.int32), np.empty(seen.size, np.int64)
    count = list_sheets(seen, away, run.laid.firsts, ranks, labels, keys)
    _, first = np.unique(seen[told], return_index=True)
    np.testing.assert_array_equal(keys[:count], seen[told][np.sort(first)])
    np.testing.assert_array_equal(keys[labels[told]], seen[told])
    assert (labels[~told] == -1).all()
    assert (ranks == -1).all()


def test_of_pieces_that_tell_a_cell_the_nearest_counts_and_the_first_of_several() -> None:
    rng = np.random.default_rng(4)
    shown, nearest = np.full((9, 8), -1, np.int32), np.full((9, 8), np.inf, np.float32)
    pieces = []
    for corner in [(0, 0), (2, 3), (1, 0)]:
        labels = rng.integers(-1, 4, (6, 5)).astype(np.int32)
        away = rng.integers(0, 3, (6, 5)).astype(np.float32)
        sheets = rng.permutation(40)[:4]
        pieces.append((corner, labels, away, sheets))
        enter_piece(labels, away, sheets, corner, shown, nearest)
    for i, j in np.ndindex(shown.shape):
        told = []
        for n, ((r, c), labels, away, sheets) in enumerate(pieces):
            if 0 <= i - r < 6 and 0 <= j - c < 5 and labels[i - r, j - c] >= 0:
                told.append((away[i - r, j - c], n, sheets[labels[i - r, j - c]]))
        assert shown[i, j] == (min(told)[2] if told else -1)
        assert nearest[i, j] == (min(told)[0] if told else np.inf)
