"""Painting through warp fields: exact, linear, clamped at the rim, and equal to a plain twin."""

import numpy as np
import pytest
from random_quilts import SHAPE, exemplar_of, plain_weights, random_quilt

from upholster.errors import InputError
from upholster.jit import kernel
from upholster.quilt import Quilt, paint
from upholster.quilt._field_kernels import matrix_at
from upholster.quilt.chart import Chart
from upholster.quilt.displacement import levels_of
from upholster.quilt.placement import LARGEST_WARPED, MASK_NONE, PLACEMENT, SYMMETRIES
from upholster.quilt.pyramid import build_pyramid, halved, most_levels
from upholster.quilt.warp_field import WarpField, node_count

IDENTITY = WarpField.quantised(np.broadcast_to(np.eye(2), (2, 2, 2, 2)), margin=0)


def random_field(rng, chart, *, octaves=2.5, margin=1):
    """Return a field as wild as may be: every node differs."""
    nodes = np.empty((node_count(chart[0], margin), node_count(chart[1], margin), 4), np.int16)
    most = int(32 * octaves)
    nodes[..., :2] = rng.integers(-most, most + 1, (*nodes.shape[:2], 2))
    nodes[..., 2] = rng.integers(0, 256, nodes.shape[:2])
    nodes[..., 3] = rng.integers(-50, 51, nodes.shape[:2])
    return WarpField(nodes, margin)


def warped_quilt(seed, *, charts=((70, 90), (33, 41), (20, 130)), octaves=2.5, holes=True):
    """Return a random quilt with a field on every chart but the last one."""
    rng = np.random.default_rng(seed)
    quilt = random_quilt(seed, charts=charts)
    fields = [random_field(rng, chart, octaves=octaves, margin=k) for k, chart in enumerate(charts)]
    if holes:
        fields[-1] = None
    placed = quilt.placements.copy()
    free = np.array([fields[chart] is not None for chart in placed["chart"]])
    placed["source_row"][free] = rng.integers(0, 16 * SHAPE[0], free.sum())
    placed["source_column"][free] = rng.integers(0, 16 * SHAPE[1], free.sum())
    return Quilt(quilt.charts, SHAPE, placed, quilt.cells, tuple(fields))


def plain_matrix(field, row, column):
    nodes = field.matrices.astype(object)
    i, j, down, right = field.margin + row // 32, field.margin + column // 32, row % 32, column % 32
    rows, columns = nodes.shape[:2]

    def node(a, b):
        return nodes[min(max(a, 0), rows - 1), min(max(b, 0), columns - 1)]

    total = (node(i, j) * (32 - right) + node(i, j + 1) * right) * (32 - down)
    total = total + (node(i + 1, j) * (32 - right) + node(i + 1, j + 1) * right) * down
    return [(int(value) + 512) // 1024 for value in total]


def plain_halved(image):
    """Halve by the formula, axis after axis, with the edges padded."""
    whole = image.dtype != np.float32
    part = image.astype(np.int64 if whole else np.float32)
    for axis in (0, 1):
        part = np.moveaxis(part, axis, 0)
        size = (len(part) + 1) // 2
        padded = np.concatenate([part[:1], part, part[-1:], part[-1:]])
        taps = [padded[k : k + 2 * size : 2] for k in range(4)]
        part = np.moveaxis((taps[0] + taps[3]) + 3 * (taps[1] + taps[2]), 0, axis)
    return ((part + 32) // 64).astype(image.dtype) if whole else (part / 64).astype(np.float32)


def plain_sample(image, row, column):
    """Sample bilinearly at 1/16 pixel, clamped to the image: with 6 fractional bits for integers."""
    row = min(max(row, 0), 16 * (image.shape[0] - 1))
    column = min(max(column, 0), 16 * (image.shape[1] - 1))
    i, j, y, x = row // 16, column // 16, row % 16, column % 16

    def pixel(a, b):
        # A neighbour beyond the rim has no weight.
        value = image[min(a, image.shape[0] - 1), min(b, image.shape[1] - 1)]
        return value if image.dtype == np.float32 else value.astype(np.int64)

    taps = [
        (pixel(i, j), (16 - y) * (16 - x)),
        (pixel(i, j + 1), (16 - y) * x),
        (pixel(i + 1, j), y * (16 - x)),
        (pixel(i + 1, j + 1), y * x),
    ]
    if image.dtype == np.float32:
        (a, p), (b, q), (c, r), (d, s) = [(value, np.float32(w / 256)) for value, w in taps]
        return ((a * p + b * q) + c * r) + d * s
    return (sum(value * w for value, w in taps) + 2) // 4


def plain_paint(quilt, exemplar, index):
    """Paint chart `index` by the formula, with Python's own integers: the oracle of the kernel."""
    whole = exemplar.dtype != np.float32
    levels = [exemplar]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(plain_halved(levels[-1]))
    chart, field = quilt.charts[index], quilt.fields[index]
    canvas = np.zeros((chart.height, chart.width, exemplar.shape[2]), np.int64 if whole else np.float32)
    for placement in quilt.on_chart(index):
        weights = plain_weights(placement, quilt.cells)
        (a, b), (c, d) = SYMMETRIES[placement["symmetry"]].reshape(2, 2).tolist()
        row0, column0 = int(placement["row"]), int(placement["column"])
        centre = plain_matrix(field, row0, column0)
        determinant = centre[0] * centre[3] - centre[1] * centre[2]
        level = sum(determinant >= 2 * 4**m * 4096**2 for m in range(len(levels) - 1))
        top, left = row0 - int(placement["height"]) // 2, column0 - int(placement["width"]) // 2
        for row in range(max(top, 0), min(top + int(placement["height"]), chart.height)):
            for column in range(max(left, 0), min(left + int(placement["width"]), chart.width)):
                i, j, y, x = row - top, column - left, row - row0, column - column0
                if weights[i, j] == 0:
                    continue
                m = [p + q for p, q in zip(centre, plain_matrix(field, row, column), strict=True)]
                v, w = (m[0] * y + m[1] * x + 256) // 512, (m[2] * y + m[3] * x + 256) // 512
                at_row = (int(placement["source_row"]) + a * v + b * w + 8) // 2**level - 8
                at_column = (int(placement["source_column"]) + c * v + d * w + 8) // 2**level - 8
                new, old = plain_sample(levels[level], at_row, at_column), canvas[row, column]
                if whole:
                    canvas[row, column] = (old * (256 - weights[i, j]) + new * weights[i, j] + 128) >> 8
                else:
                    part = np.float32(weights[i, j] / 256)
                    canvas[row, column] = old * (1 - part) + new * part
    return ((canvas + 32) >> 6).astype(exemplar.dtype) if whole else canvas


@pytest.mark.parametrize(
    ("dtype", "channels"),
    [(np.uint8, 3), (np.uint8, 5), (np.uint16, 3), (np.uint16, 2), (np.float32, 3), (np.float32, 1)],
)
def test_equals_the_plain_twin(dtype, channels):
    quilt, exemplar = warped_quilt(channels), exemplar_of(dtype, channels)
    painted = paint(quilt, exemplar).arrays
    for index in (0, 1):
        assert painted[index].dtype == dtype
        np.testing.assert_array_equal(painted[index], plain_paint(quilt, exemplar, index))


def test_a_chart_without_a_field_is_painted_as_ever():
    quilt, exemplar = warped_quilt(1), exemplar_of(np.uint8)
    placed = quilt.on_chart(2).copy()
    placed["chart"] = 0
    alone = Quilt(quilt.charts[2:], SHAPE, placed, quilt.cells)
    np.testing.assert_array_equal(paint(quilt, exemplar).arrays[2], paint(alone, exemplar).arrays[0])


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("seed", [0, 1])
def test_the_identity_on_whole_pixels_is_no_field_at_all(dtype, seed):
    quilt, exemplar = random_quilt(seed), exemplar_of(dtype)
    same = Quilt(quilt.charts, SHAPE, quilt.placements, quilt.cells, (IDENTITY, IDENTITY))
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
    return Quilt(quilt.charts, SHAPE, placed, quilt.cells, quilt.fields)


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
    for source in quilt.sources():
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
    np.testing.assert_array_equal(matrices_at(field, rows, columns), out)
    for n in range(40):
        assert plain_matrix(field, int(rows[n]), int(columns[n])) == out[n].tolist()


def test_the_level_is_the_one_whose_pixels_come_nearest_to_texels():
    scales = 2.0 ** np.array([-3, 0, 0.4, 0.6, 1, 1.4, 1.6, 5, 6])
    placed = np.zeros(1, PLACEMENT)
    fields = [WarpField.quantised(np.broadcast_to(s * np.eye(2), (2, 2, 2, 2))) for s in scales]
    assert [levels_of(field, placed, 9)[0] for field in fields] == [0, 0, 0, 1, 1, 1, 2, 5, 6]
    assert [levels_of(field, placed, 2)[0] for field in fields] == [0, 0, 0, 1, 1, 1, 2, 2, 2]
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
    quilt = Quilt((Chart(0, 16, 16),), SHAPE, placed, np.zeros(0, np.uint8), (field,))
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
        Quilt(quilt.charts, SHAPE, placed, quilt.cells, quilt.fields)
    whole = quilt.placements.copy()
    whole["source_row"] |= 1
    with pytest.raises(InputError, match="whole pixel"):
        Quilt(quilt.charts, SHAPE, whole, quilt.cells, quilt.fields)
    with pytest.raises(InputError, match="one for each chart"):
        Quilt(quilt.charts, SHAPE, quilt.placements, quilt.cells, quilt.fields[:1])
