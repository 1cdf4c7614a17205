"""Source maps: the placements that they derive, and what painting makes of them."""

import numpy as np
import pytest

from upholster.errors import InputError
from upholster.measure.copies import copies
from upholster.quilt import Chart, Quilt, paint
from upholster.quilt.plans import SourceMap

SHAPE = (11, 9)
CHARTS = (Chart(0, 6, 14), Chart(0, 3, 1))


def random_map(seed, charts=CHARTS):
    """Return sources of which many texels go on from the one before, also past the end of a row."""
    rng = np.random.default_rng(seed)
    parts = []
    for chart in charts:
        flat = np.empty((chart.height * chart.width, 2), np.int16)
        for n in range(len(flat)):
            goes_on = n > 0 and flat[n - 1, 1] + 1 < SHAPE[1] and rng.random() < 0.7
            flat[n] = flat[n - 1] + (0, 1) if goes_on else rng.integers(0, SHAPE)
        parts.append(flat.reshape(chart.height, chart.width, 2))
    return SourceMap(tuple(parts))


@pytest.mark.parametrize("seed", range(5))
def test_painting_looks_each_texel_up(seed):
    plan = random_map(seed)
    quilt = Quilt(CHARTS, SHAPE, plan)
    assert quilt.copied == (True, True)
    image = np.random.default_rng(seed).integers(0, 256, (*SHAPE, 3), dtype=np.uint8)
    for array, sources in zip(paint(quilt, image).arrays, plan.sources, strict=True):
        np.testing.assert_array_equal(array, image[sources[..., 0], sources[..., 1]])
    for found, sources in zip(quilt.sources(), plan.sources, strict=True):
        np.testing.assert_array_equal(found, 16 * sources.astype(int))


def test_each_run_of_a_row_is_one_placement():
    plan = random_map(7)
    placed = Quilt(CHARTS, SHAPE, plan).placements
    assert placed["width"].sum() == 6 * 14 + 3
    breaks = sum(
        int((np.diff(part.astype(int), axis=1) != (0, 1)).any(axis=2).sum()) for part in plan.sources
    )
    assert len(placed) == breaks + 6 + 3


def test_copies_are_counted_texel_by_texel():
    plan = random_map(3, CHARTS[:1])
    sources = plan.sources[0].astype(int)
    right = (np.diff(sources, axis=1) == (0, 1)).all(axis=2)
    below = (np.diff(sources, axis=0) == (1, 0)).all(axis=2)
    wanted = (right.sum() + below.sum()) / (right.size + below.size)
    assert copies(Quilt(CHARTS[:1], SHAPE, plan)).ratio == pytest.approx(wanted)


def test_a_map_that_does_not_fit_is_refused():
    plan = random_map(1)
    with pytest.raises(InputError, match="an array \\(height, width, 2\\) for each chart"):
        Quilt(CHARTS[:1], SHAPE, plan)
    with pytest.raises(InputError, match="source outside the exemplar's 5 rows"):
        Quilt(CHARTS, (5, 9), plan)
