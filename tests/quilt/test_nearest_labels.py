"""The nearest placement of each cell: exactly, ties to the first, in time that goes with the cells."""

import numpy as np
import pytest

from upholster.quilt.chart import Chart
from upholster.quilt.labels import cell_centres, label_shape, nearest_labels


@pytest.mark.parametrize("seed", range(300))
def test_the_first_of_the_nearest_is_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    chart, cell = Chart(0, *rng.integers(1, 60, 2).tolist()), int(rng.integers(1, 9))
    half, count = bool(rng.integers(2)), int(rng.integers(1, 30))
    high, wide = label_shape(chart.height, chart.width, cell)
    at_rows, at_columns = cell_centres(high, cell, half=half), cell_centres(wide, cell, half=half)
    if seed % 2:  # at centres of cells, in any order: many are as near as others
        places = rng.permutation(high * wide)[:count]
        rows, columns = at_rows[places // wide], at_columns[places % wide]
    else:
        rows, columns = rng.integers(-200, 1200, (2, count))
    found = nearest_labels(rows.astype(np.int32), columns.astype(np.int32), chart, cell, half=half)
    away = (at_rows[:, None, None] - rows) ** 2 + (at_columns[:, None] - columns) ** 2
    np.testing.assert_array_equal(found, away.argmin(axis=2))


def test_a_row_of_far_placements_is_no_harder_than_others() -> None:
    # Looked through one by one these would be two thousand million distances.
    side = 2046
    columns = cell_centres(side + 2, 1).astype(np.int32)
    found = nearest_labels(np.full_like(columns, -8), columns, Chart(0, side, side), 1)
    np.testing.assert_array_equal(found, np.broadcast_to(np.arange(side + 2), found.shape))
