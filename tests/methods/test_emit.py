"""What was laid becomes placements and labels: a cell shows what shows at its middle, and reads the same."""

import numpy as np
import pytest
from plain_quilt import masks_of, matrix, shown_blocks, sources_of, texture

from upholster.geometry import plane, torus
from upholster.methods.quilt._emit_kernels import fill_labels, trace_cells
from upholster.methods.quilt.emit import _OFF, emitted_quilt, labelled
from upholster.methods.quilt.masked import BLOCK
from upholster.methods.quilt.method import lay_all
from upholster.methods.quilt.options import QuiltOptions
from upholster.methods.quilt.run import planned
from upholster.methods.quilt.transfer import ChartPlacements
from upholster.quilt import Chart, paint
from upholster.quilt.displacement import warped_sources
from upholster.quilt.labels import cell_centres, label_shape
from upholster.quilt.warp_field import WarpField

EXEMPLAR = texture()
NONE = np.zeros(0, np.int64)


def bent(scale=1.0, by=0.1):
    """Return a field that turns and grows over a chart."""
    i, j = np.mgrid[:6, :6]
    angle = by * (i - 1.5 * j)
    turn = np.stack([np.cos(angle), np.sin(angle), -np.sin(angle), np.cos(angle)], -1).reshape(6, 6, 2, 2)
    return WarpField.quantised(scale * 2 ** (0.5 * by * (i + j))[..., None, None] * turn)


def some_blocks(rng, chart, count=40, centred=0.3):
    """Return blocks anywhere on a chart and round it, some with masks, on top of one that covers all."""
    placed = np.zeros(count, BLOCK)
    placed["row"] = rng.integers(-9, chart.height + 9, count)
    placed["column"] = rng.integers(-9, chart.width + 9, count)
    placed["height"], placed["width"] = rng.integers(8, 40, (2, count))
    placed["source_row"] = 16 * rng.integers(0, 56, count)
    placed["source_column"] = 16 * rng.integers(0, 48, count)
    placed["symmetry"], placed["mask_cell"] = rng.integers(0, 8, count), rng.integers(1, 5, count)
    placed["centred"] = rng.random(count) < centred
    placed["matrix"] = 4096 * np.eye(2, dtype=int).reshape(-1) + rng.integers(-900, 900, (count, 4))
    placed["row"][0], placed["column"][0] = chart.height // 2, chart.width // 2
    placed["height"][0], placed["width"][0] = chart.height + 20, chart.width + 20
    placed["first_cell"], cells = -1, []
    for n in range(1, count, 2):
        sides = [-(-int(placed[name][n]) // int(placed["mask_cell"][n])) for name in ("height", "width")]
        placed["first_cell"][n] = sum(map(len, cells))
        cells.append((rng.random(sides[0] * sides[1]) < 0.7).astype(np.uint8))
    return placed, np.concatenate(cells)


def plain_seen(laid, chart, cell):
    """Return of each cell the last block that shows at the step at its middle, in plain NumPy."""
    high, wide = label_shape(chart.height, chart.width, cell)
    out = np.full((high, wide), -1)
    rows, columns = (np.arange(count) * cell - cell + cell // 2 for count in (high, wide))
    top, bottom, left, right = laid.bounds
    inside = ((rows >= top) & (rows < bottom))[:, None] & (columns >= left) & (columns < right)
    for n, (one, mask) in enumerate(zip(laid.placements, masks_of(laid), strict=True)):
        y, x = rows - one["row"] + one["height"] // 2, columns - one["column"] + one["width"] // 2
        for i, j in np.ndindex(high, wide):
            if not (0 <= y[i] < one["height"] and 0 <= x[j] < one["width"]):
                continue
            if not (inside[i, j] or laid.steps[n]):
                continue
            if mask is None or mask[y[i] // one["mask_cell"], x[j] // one["mask_cell"]]:
                out[i, j] = n
    return out


@pytest.mark.parametrize("cell", [1, 2, 3, 4, 7])
def test_a_cell_shows_what_shows_at_its_middle(cell):
    rng, chart = np.random.default_rng(cell), Chart(0, 61, 50)
    placed, cells = some_blocks(rng, chart)
    seen = np.full(label_shape(61, 50, cell), -1, np.int32)
    steps, bounds = rng.integers(0, 2, len(placed)), (0, 55, 2, 50)
    trace_cells(placed, cells, steps, bounds, cell, seen)
    laid = ChartPlacements(placed, cells, NONE, steps, bounds)
    np.testing.assert_array_equal(seen, plain_seen(laid, chart, cell))
    assert len(np.unique(seen)) > 10


def plain_filled(labels):
    """Fill cells without a label: from all that have one at once, a step at a time."""
    labels = labels.copy()
    queue = [tuple(at) for at in np.argwhere(labels >= 0).tolist()]
    for i, j in queue:
        for a, b in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
            if 0 <= a < labels.shape[0] and 0 <= b < labels.shape[1] and labels[a, b] < 0:
                labels[a, b] = labels[i, j]
                queue.append((a, b))
    return labels


def test_cells_without_a_label_get_the_nearest_ones():
    rng = np.random.default_rng(2)
    labels = np.where(rng.random((30, 24)) < 0.03, rng.integers(0, 99, (30, 24)), -1).astype(np.int32)
    filled = labels.copy()
    fill_labels(filled, np.empty(filled.size, np.int64))
    np.testing.assert_array_equal(filled, plain_filled(labels))
    known = np.argwhere(labels >= 0)
    for i, j in np.ndindex(labels.shape):
        away = np.abs(known - (i, j)).sum(axis=1)
        assert filled[i, j] in {int(labels[tuple(at)]) for at in known[away == away.min()]}


def laid_on(surface, charts, fields, **more):
    options = QuiltOptions(effort=0, block=20)
    run = planned(EXEMPLAR, surface, charts, fields, options=options, seed=3, **more)
    return run, lay_all(run)


def emitted(run, laid, cell=4, threads=None):
    return emitted_quilt(run.charts, run.fields, (56, 48), laid, cell=cell, threads=threads)


def a_torus():
    charts = (Chart(0, 130, 90, 0, 4, 0, 2), Chart(0, 100, 80, 0, 4, 2, 4))
    return laid_on(torus(), charts, [bent(), bent(0.9)])


def test_each_label_is_the_block_that_shows():
    run, laid = a_torus()
    quilt = emitted(run, laid)
    for n, (chart, one) in enumerate(zip(run.charts, laid, strict=True)):
        seen, labels = plain_seen(one, chart, 4), quilt.labels[n][0].labels
        shown = seen >= 0
        # As many labels as blocks, one for each: the same cells hang together.
        pairs = np.unique(np.stack([seen[shown], labels[shown]]), axis=1)
        assert len(np.unique(pairs[0])) == len(np.unique(pairs[1])) == pairs.shape[1]
        assert pairs.shape[1] == len(quilt.on_chart(n))
        np.testing.assert_array_equal(labels, plain_filled(np.where(shown, labels, -1)))


def test_centres_are_middles_of_own_cells_one_a_cell_inside_the_sample():
    run, laid = a_torus()
    quilt = emitted(run, laid)
    for n in range(len(run.charts)):
        placed, labels = quilt.on_chart(n), quilt.labels[n][0].labels
        places = []
        for name, count in (("row", labels.shape[0]), ("column", labels.shape[1])):
            places.append(np.searchsorted(cell_centres(count, 4), placed[name]))
            np.testing.assert_array_equal(cell_centres(count, 4)[places[-1]], placed[name])
        np.testing.assert_array_equal(labels[tuple(places)], np.arange(len(placed)))
        assert (np.diff(places[0] * labels.shape[1] + places[1]) > 0).all()
        beyond = [(at == 0) | (at == count - 1) for at, count in zip(places, labels.shape, strict=True)]
        for k in np.flatnonzero(beyond[0] | beyond[1]):
            assert not (labels[1:-1, 1:-1] == k).any() or not _reads_inside(quilt, n, k, labels)


def _reads_inside(quilt, n, k, labels):
    # Whether a placement reads inside the sample at a cell on its chart.
    sources = quilt.sources()[n]
    at = np.argwhere(labels[1:-1, 1:-1] == k) * 4
    at = at[(at < sources.shape[:2]).all(axis=1)]
    found = sources[at[:, 0], at[:, 1]]
    return bool(((found > 16) & (found < 16 * np.array(quilt.exemplar_shape) - 32)).all(axis=1).any())


@pytest.mark.parametrize("cell", [2, 4])
@pytest.mark.parametrize("by", [0.0, 0.05, 0.1])
def test_each_cell_reads_what_its_block_read(cell, by):
    rng, chart, field = np.random.default_rng(8), Chart(0, 120, 110), bent(1.0, by)
    placed, cells = some_blocks(rng, chart, 60, centred=0.5)
    placed["row"], placed["column"] = placed["row"].clip(20, 100), placed["column"].clip(20, 90)
    placed["source_row"], placed["source_column"] = 16 * 28, 16 * 24
    own = rng.integers(-200, 200, (60, 4)) + matrix(field, placed["row"], placed["column"])
    placed["matrix"] = np.where(placed["centred"][:, None] > 0, own, 0)
    laid = ChartPlacements(placed, cells, NONE, np.zeros(60, np.int64))
    quilt = emitted_quilt((chart,), (field,), (56, 48), [laid], cell=cell)
    # Steps that show the block that their cell shows.
    seen, shown = plain_seen(laid, chart, cell), shown_blocks(laid, chart)
    rows, columns = np.mgrid[:120, :110] // cell + 1
    same = shown == seen[rows, columns]
    assert same.mean() > 0.5
    off = np.abs(sources_of(laid, chart, field) - _unmirrored(quilt)).max(axis=2)[same] / 16
    assert np.quantile(off, 0.99) < 2 * _OFF
    assert 0.1 < (quilt.placements["offset"] != 0).any(axis=1).mean() < 1


def _unmirrored(quilt):
    # Where each step of the one chart reads, before it is mirrored into the sample.
    chart, labels = quilt.charts[0], quilt.labels[0][0]
    rows, columns = np.mgrid[: chart.height, : chart.width]
    owner = quilt.on_chart(0)[labels.at(rows, columns)]
    found = warped_sources(
        quilt.fields[0], owner.reshape(-1), 16 * rows.reshape(-1) + 8, 16 * columns.reshape(-1) + 8
    )
    return np.stack(found, axis=1).reshape(chart.height, chart.width, 2)


def test_where_the_field_is_even_a_moved_centre_reads_exactly_the_same():
    run, laid = laid_on(plane(), (Chart(0, 90, 75),), None)
    quilt = emitted(run, laid)
    assert not quilt.placements["offset"].any()
    np.testing.assert_array_equal((quilt.placements["row"] - quilt.placements["source_row"]) % 16, 8)
    before = sources_of(laid[0], run.charts[0], run.fields[0])
    owners = quilt.labels[0][0].at(*np.mgrid[:90, :75])
    seen = plain_seen(laid[0], run.charts[0], 4)
    shown = shown_blocks(laid[0], run.charts[0])
    # Where the step shows the block that its cell shows.
    rows, columns = np.mgrid[:90, :75] // 4 + 1
    same = shown == seen[rows, columns]
    assert owners.shape == same.shape
    assert (quilt.sources()[0][same] == before[same]).all(axis=1).mean() > 0.99


def _bilinear(image, places):
    low = np.floor(places).astype(int)
    i, j = (low[..., k].clip(0, image.shape[k] - 2) for k in (0, 1))
    f, g = ((places[..., k] - at)[..., None] for k, at in enumerate((i, j)))
    upper, lower = ((1 - g) * image[at, j] + g * image[at, j + 1] for at in (i, i + 1))
    return (1 - f) * upper + f * lower


def test_texels_differ_from_blocks_laid_one_over_the_other_near_their_borders_alone():
    run, laid = a_torus()
    quilt = emitted(run, laid)
    for n, (chart, one) in enumerate(zip(run.charts, laid, strict=True)):
        painted = paint(quilt, EXEMPLAR).arrays[n].astype(int)
        shown = shown_blocks(one, chart)
        sources = sources_of(one, chart, run.fields[n]) / 16
        plain = _bilinear(EXEMPLAR.astype(float), sources)
        inner = np.ones(shown.shape, bool)
        for down in range(-4, 5):
            for right in range(-4, 5):
                inner &= np.roll(shown, (down, right), (0, 1)) == shown
        inner[:4] = inner[-4:] = inner[:, :4] = inner[:, -4:] = False
        inside = ((sources > 0) & (sources < np.array(EXEMPLAR.shape[:2]) - 1)).all(axis=2)
        assert (inner & inside).sum() > 300
        assert np.abs(painted - plain)[inner & inside].mean() < 2
        assert np.abs(painted - plain)[~inner].mean() > 2 * np.abs(painted - plain)[inner & inside].mean()


def test_a_chart_on_which_nothing_was_laid_shows_the_sample_bare():
    chart = Chart(0, 20, 30)
    nothing = ChartPlacements(np.zeros(0, BLOCK), np.zeros(0, np.uint8), NONE, NONE)
    placed, layer = labelled(0, chart, WarpField.identity(), (56, 48), nothing, cell=4)
    assert len(placed) == 1
    assert not layer.labels.any()
    assert placed["row"][0] in cell_centres(7, 4)


def test_the_number_of_threads_changes_nothing():
    run, laid = a_torus()
    one, four = emitted(run, laid, threads=1), emitted(run, laid, threads=4)
    np.testing.assert_array_equal(one.placements, four.placements)
    for a, b in zip(one.labels, four.labels, strict=True):
        np.testing.assert_array_equal(a[0].labels, b[0].labels)
