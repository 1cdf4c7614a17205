"""Painting through warp fields: exact, linear, clamped at the rim, and equal to a plain twin."""

import numpy as np
import pytest
from plain_painting import plain_halved, plain_matrix, plain_paint
from random_quilts import SHAPE, changed, exemplar_of, random_quilt

from upholster.errors import InputError
from upholster.jit import kernel
from upholster.quilt import Quilt, paint
from upholster.quilt._field_kernels import matrix_at
from upholster.quilt.chart import Chart
from upholster.quilt.displacement import centre_matrices, levels_of, warped_sources
from upholster.quilt.placement import LARGEST_WARPED, MASK_CUT, MASK_NONE, PLACEMENT
from upholster.quilt.plans import PlacementList
from upholster.quilt.pyramid import build_pyramid, halved, most_levels
from upholster.quilt.warp_field import WarpField, node_count

# Several nodes, none of which does anything.
IDENTITY = WarpField.quantised(np.broadcast_to(np.eye(2), (2, 2, 2, 2)), margin=0)


def random_field(rng, chart, *, octaves=2.5, margin=1):
    """Return a field as wild as may be: every node differs."""
    nodes = np.empty((node_count(chart[0], margin), node_count(chart[1], margin), 4), np.int16)
    most = int(32 * octaves)
    nodes[..., :2] = rng.integers(-most, most + 1, (*nodes.shape[:2], 2))
    nodes[..., 2] = rng.integers(0, 256, nodes.shape[:2])
    nodes[..., 3] = rng.integers(-50, 51, nodes.shape[:2])
    return WarpField(nodes, margin)


def warped_quilt(seed, *, charts=((70, 90), (33, 41), (20, 130)), octaves=2.5, centred=0.0, **options):
    """Return a random quilt with a field on every chart but the last one, which is copied pixel by pixel.

    `centred`: the share of blocks that have a centre matrix of their own, on charts of all kinds.
    """
    rng = np.random.default_rng(seed)
    quilt = random_quilt(seed, charts=charts, **options)
    fields = [random_field(rng, chart, octaves=octaves, margin=k) for k, chart in enumerate(charts)]
    fields[-1] = WarpField.identity()
    placed = quilt.placements.copy()
    own = rng.random(len(placed)) < centred
    placed["centred"] = own
    placed["matrix"][own] = rng.integers(-(2**14), 2**14, (own.sum(), 4))
    placed["matrix"][own & (rng.random(len(placed)) < 0.1)] = 2**18
    free = own | (placed["chart"] < len(charts) - 1)
    placed["source_row"][free] = rng.integers(0, 16 * SHAPE[0], free.sum())
    placed["source_column"][free] = rng.integers(0, 16 * SHAPE[1], free.sum())
    return changed(quilt, placed, tuple(fields))


@pytest.mark.parametrize(
    ("dtype", "channels"),
    [(np.uint8, 3), (np.uint8, 5), (np.uint16, 3), (np.uint16, 2), (np.float32, 3), (np.float32, 1)],
)
def test_equals_the_plain_twin(dtype, channels):
    quilt, exemplar = warped_quilt(channels), exemplar_of(dtype, channels)
    assert quilt.copied == (False, False, True)
    painted = paint(quilt, exemplar).arrays
    for index in range(3):
        assert painted[index].dtype == dtype
        np.testing.assert_array_equal(painted[index], plain_paint(quilt, exemplar, index))


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_blocks_may_have_centre_matrices_of_their_own(dtype):
    quilt, exemplar = warped_quilt(11, centred=0.5), exemplar_of(dtype)
    assert quilt.copied == (False, False, False)
    painted = paint(quilt, exemplar).arrays
    for index in range(3):
        np.testing.assert_array_equal(painted[index], plain_paint(quilt, exemplar, index))
    # Without them the quilt is another one.
    placed = quilt.placements.copy()
    placed["centred"] = 0
    assert any(
        (a != b).any() for a, b in zip(painted, paint(changed(quilt, placed), exemplar).arrays, strict=True)
    )


def test_a_centre_matrix_that_the_field_has_there_changes_nothing():
    quilt, exemplar = warped_quilt(12), exemplar_of(np.uint8)
    placed = quilt.placements.copy()
    placed["centred"] = 1
    for n, field in enumerate(quilt.fields):
        mine = placed["chart"] == n
        placed["matrix"][mine] = centre_matrices(field, quilt.on_chart(n))
    told = changed(quilt, placed)
    assert told.copied == (False, False, False)
    for a, b in zip(paint(quilt, exemplar).arrays, paint(told, exemplar).arrays, strict=True):
        np.testing.assert_array_equal(a, b)
    for a, b in zip(quilt.sources(), told.sources(), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_without_a_field_blocks_may_begin_between_pixels_and_read_beyond_the_exemplar(dtype):
    rng = np.random.default_rng(13)
    quilt, exemplar = random_quilt(13), exemplar_of(dtype)
    placed = quilt.placements.copy()
    for name, size in zip(("source_row", "source_column"), SHAPE, strict=True):
        placed[name] = rng.integers(0, 16 * size, len(placed))
    fine = changed(quilt, placed)
    assert fine.copied == (False, False)
    placed = quilt.placements.copy()
    placed["source_row"][-1], placed["height"][-1] = 0, 20
    beyond = changed(quilt, placed)
    assert beyond.copied == (True, False)
    for made in (fine, beyond):
        for index, array in enumerate(paint(made, exemplar).arrays):
            np.testing.assert_array_equal(array, plain_paint(made, exemplar, index))


def test_what_no_window_holds_is_never_seen():
    rng = np.random.default_rng(14)
    exemplar = exemplar_of(np.uint8)
    hidden = 0
    for seed in range(3):
        charts = tuple((int(a), int(b)) for a, b in rng.integers(3, 40, (3, 2)))
        quilt = warped_quilt(seed, charts=charts, centred=0.2, count=40)
        for index, array in enumerate(paint(quilt, exemplar).arrays):
            for outside in (0, 1):
                np.testing.assert_array_equal(array, plain_paint(quilt, exemplar, index, outside))
        cut = quilt.placements[quilt.placements["mask"] == MASK_CUT]
        cell = np.maximum(1, cut["mask_cell"]).astype(int)
        whole = (-(-cut["height"] // cell) * -(-cut["width"] // cell)).sum()
        hidden += whole - len(quilt.mask_cells)
    assert hidden > 500


def test_sources_are_those_that_painting_reads():
    quilt = hard(warped_quilt(15, centred=0.5))
    for n, (field, found) in enumerate(zip(quilt.fields, quilt.sources(), strict=True)):
        placed = quilt.on_chart(n)
        owners = quilt.owners(n, 0, 0, *found.shape[:2])
        rows, columns = np.nonzero(owners >= 0)
        wanted = warped_sources(field, placed[owners[rows, columns]], rows, columns)
        for axis, (at, size) in enumerate(zip(wanted, SHAPE, strict=True)):
            np.testing.assert_array_equal(found[rows, columns, axis], at.clip(0, 16 * (size - 1)))


def test_a_chart_without_a_field_is_painted_as_ever():
    quilt, exemplar = warped_quilt(1), exemplar_of(np.uint8)
    placed = quilt.on_chart(2).copy()
    placed["chart"] = 0
    alone = Quilt(quilt.charts[2:], SHAPE, PlacementList(placed, quilt.mask_cells))
    np.testing.assert_array_equal(paint(quilt, exemplar).arrays[2], paint(alone, exemplar).arrays[0])


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("seed", [0, 1])
def test_the_identity_on_whole_pixels_is_no_field_at_all(dtype, seed):
    quilt, exemplar = random_quilt(seed), exemplar_of(dtype)
    same = changed(quilt, quilt.placements, (IDENTITY, IDENTITY))
    assert same.copied == (True, True)
    for a, b in zip(paint(quilt, exemplar).arrays, paint(same, exemplar).arrays, strict=True):
        np.testing.assert_array_equal(a, b)
    for a, b in zip(quilt.sources(), same.sources(), strict=True):
        np.testing.assert_array_equal(a, b)


def test_is_linear_in_the_exemplar():
    quilt = warped_quilt(3)
    x, y = exemplar_of(np.float32, seed=1), exemplar_of(np.float32, seed=2)
    both = paint(quilt, (2 * x - 3 * y).astype(np.float32)).arrays
    for mixed, a, b in zip(both, paint(quilt, x).arrays, paint(quilt, y).arrays, strict=True):
        np.testing.assert_allclose(mixed, 2 * a - 3 * b, atol=1e-4)


@pytest.mark.parametrize("value", [0, 1, 254, 255])
def test_one_colour_stays_that_colour(value):
    exemplar = np.full((*SHAPE, 3), value, np.uint8)
    quilt = warped_quilt(4, octaves=6)
    covered = [source[..., 0] >= 0 for source in hard(quilt).sources()]
    for texels, there in zip(paint(hard(quilt), exemplar).arrays, covered, strict=True):
        assert (texels[there] == value).all()


def test_threads_and_strips_do_not_matter(monkeypatch):
    quilt, exemplar = warped_quilt(6, charts=((300, 40), (90, 200), (5, 5))), exemplar_of(np.uint8)
    once = paint(quilt, exemplar, threads=1).arrays
    monkeypatch.setattr("upholster.quilt.painting._TASK_TEXELS", 1500)
    monkeypatch.setattr("upholster.quilt.painting._STRIP_WORDS", 1)
    for a, b in zip(once, paint(quilt, exemplar, threads=5).arrays, strict=True):
        np.testing.assert_array_equal(a, b)


def hard(quilt):
    """Return the same quilt without masks."""
    placed = quilt.placements.copy()
    placed["mask"], placed["feather"] = MASK_NONE, 0
    return changed(quilt, placed)


def test_sources_say_where_a_texel_comes_from():
    quilt = hard(warped_quilt(7, octaves=-0.0))
    # An image whose samples name their own place, which bilinear sampling reproduces exactly.
    places = np.stack(np.mgrid[: SHAPE[0], : SHAPE[1]], -1).astype(np.float32)
    for source, texels in zip(quilt.sources(), paint(quilt, places).arrays, strict=True):
        painted = source[:, :, 0] >= 0
        assert painted.any()
        np.testing.assert_array_equal(source[painted], 16 * texels[painted])


def test_sources_beyond_the_exemplar_lie_on_its_rim():
    quilt = hard(warped_quilt(8, octaves=6))
    for source in quilt.sources()[:2]:
        painted = source[:, :, 0] >= 0
        assert source[painted].min() == 0
        assert (source[painted].max(axis=0) <= 16 * (np.array(SHAPE) - 1)).all()


@kernel
def kernel_matrices(matrices, margin, rows, columns, out):
    for n in range(len(rows)):
        out[n] = matrix_at(matrices, margin, rows[n], columns[n])


@pytest.mark.parametrize("margin", [0, 2])
def test_matrices_are_those_of_the_kernels(margin):
    rng = np.random.default_rng(margin)
    field = random_field(rng, (70, 90), octaves=6, margin=margin)
    rows, columns = rng.integers(-200, 300, (2, 500))
    out = np.empty((500, 4), np.int32)
    kernel_matrices(field.matrices, margin, rows, columns, out)
    np.testing.assert_array_equal(field.integers_at(rows, columns), out)
    for n in range(40):
        assert plain_matrix(field, int(rows[n]), int(columns[n])) == out[n].tolist()


def test_the_level_is_the_one_whose_pixels_come_nearest_to_texels():
    scales = 2.0 ** np.array([-3, 0, 0.4, 0.6, 1, 1.4, 1.6, 5, 6])
    placed = np.zeros(1, PLACEMENT)
    fields = [WarpField.quantised(np.broadcast_to(s * np.eye(2), (2, 2, 2, 2))) for s in scales]
    assert [levels_of(centre_matrices(field, placed), 9)[0] for field in fields] == [
        0,
        0,
        0,
        1,
        1,
        1,
        2,
        5,
        6,
    ]
    assert [levels_of(centre_matrices(field, placed), 2)[0] for field in fields] == [
        0,
        0,
        0,
        1,
        1,
        1,
        2,
        2,
        2,
    ]
    assert [most_levels(*size) for size in ((1, 1), (2, 1), (3, 3), (4, 4), (5, 128))] == [0, 1, 2, 2, 7]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_the_pyramid_is_filtered_by_1_3_3_1(dtype):
    image = exemplar_of(dtype)[:37]
    np.testing.assert_array_equal(halved(image), plain_halved(image))
    assert halved(image[:1, :1]).tolist() == image[:1, :1].tolist()
    ramp = np.arange(64, dtype=np.float32)[:, None, None] * np.ones((1, 8, 1), np.float32)
    np.testing.assert_allclose(halved(ramp)[1:-1, :, 0], 2 * np.arange(1, 31)[:, None] + 0.5 + np.zeros(4))


def test_a_pyramid_holds_its_levels_with_a_rim():
    image = exemplar_of(np.uint16)
    pyramid = build_pyramid([image[::-1], image], 2)
    level = image
    assert len(pyramid.levels) == 6
    for number, (first, stride, last_row, last_column, halvings) in enumerate(pyramid.levels[3:]):
        assert halvings == number
        assert level.shape[:2] == (last_row + 1, last_column + 1)
        words = pyramid.words[first : first + (last_row + 2) * stride].reshape(last_row + 2, -1)
        lanes = words.view(pyramid.lane).reshape(last_row + 2, last_column + 2, -1)
        np.testing.assert_array_equal(lanes[:-1, :-1, :3], level)
        np.testing.assert_array_equal(lanes[-1, :-1, :3], level[-1])
        np.testing.assert_array_equal(lanes[:-1, -1, :3], level[:, -1])
        level = halved(level)


def test_large_blocks_stay_within_32_bits():
    nodes = np.full((1, 1, 4), 192, np.int16)
    nodes[..., 2], nodes[..., 3] = 100, -56
    field = WarpField(nodes, 0)
    placed = np.zeros(1, PLACEMENT)
    placed["height"] = placed["width"] = LARGEST_WARPED
    placed["row"], placed["column"] = LARGEST_WARPED // 2 - 8, 24 - LARGEST_WARPED // 2
    quilt = Quilt((Chart(0, 16, 16),), SHAPE, PlacementList(placed, np.zeros(0, np.uint8)), (field,))
    exemplar = exemplar_of(np.uint8)
    np.testing.assert_array_equal(paint(quilt, exemplar).arrays[0], plain_paint(quilt, exemplar, 0))


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("source_row", -1, "outside the exemplar's 40 rows"),
        ("source_column", 16 * SHAPE[1], "outside the exemplar's 44 columns"),
        ("width", LARGEST_WARPED + 1, "2048 texels"),
    ],
)
def test_a_bad_placement_on_a_field_is_refused(name, value, said):
    quilt = hard(warped_quilt(9))
    placed = quilt.placements.copy()
    placed[name][0] = value
    with pytest.raises(InputError, match=said):
        changed(quilt, placed)
    with pytest.raises(InputError, match="one for each chart"):
        changed(quilt, quilt.placements, quilt.fields[:1])


def test_a_bad_centre_matrix_is_refused():
    quilt = warped_quilt(9)
    placed = quilt.placements.copy()
    placed["matrix"][0, 2] = 2**18 + 1
    changed(quilt, placed.copy())  # nobody reads it
    placed["centred"][0] = 1
    with pytest.raises(InputError, match="a centre matrix is outside ±262144"):
        changed(quilt, placed)
    placed = quilt.on_chart(2).copy()
    placed["chart"], placed["mask"], placed["width"] = 0, MASK_NONE, LARGEST_WARPED + 1
    plain = (quilt.charts[2:], SHAPE)
    Quilt(*plain, PlacementList(placed.copy(), quilt.mask_cells))
    placed["centred"][0] = 1
    with pytest.raises(InputError, match="2048 texels"):
        Quilt(*plain, PlacementList(placed, quilt.mask_cells))
