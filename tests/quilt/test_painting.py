"""Painting: exact, linear, the same on any threads, at any density, and equal to a plain twin."""

import numpy as np
import pytest
from plain_painting import plain_halved, plain_matrix, plain_paint, plain_softened
from random_quilts import SHAPE, changed, exemplar_of, random_field, random_quilt
from warp_fields import quantised

from upholster.base.errors import InputError
from upholster.quilt.chart import Chart
from upholster.quilt.displacement import centre_matrices, levels_of, warped_sources
from upholster.quilt.labels import LabelMap, cell_centres, label_shape, nearest_labels
from upholster.quilt.materials import WindowPainter
from upholster.quilt.model import Quilt
from upholster.quilt.painting import ChartPainter, image_pyramid, paint, painted_charts, texel_places
from upholster.quilt.placement import PLACEMENT, SYMMETRIES, bare_placement
from upholster.quilt.pyramid import halved, most_levels, softened
from upholster.quilt.warp_field import WarpField


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize(
    ("dtype", "channels", "options"),
    [
        (np.uint8, 3, {}),
        (np.uint8, 5, {"octaves": 2.5, "offsets": 0.4}),
        (np.uint8, 1, {"octaves": 1, "half": True, "layers": 2, "cell": 8}),
        (np.uint16, 3, {"octaves": 2.5, "layers": 2}),
        (np.uint16, 2, {"cell": 1, "offsets": 0.5}),
        (np.float32, 3, {"octaves": 2.5, "offsets": 0.3, "layers": 2, "cell": 3}),
        (np.float32, 1, {"half": True, "cell": 5}),
    ],
)
def test_equals_the_plain_twin(dtype, channels, options):
    quilt = random_quilt(channels, charts=((34, 41), (9, 35)), **options)
    exemplar = exemplar_of(dtype, channels)
    painted = paint(quilt, exemplar).arrays
    for index in range(2):
        assert painted[index].dtype == dtype
        np.testing.assert_array_equal(painted[index], plain_paint(quilt, exemplar, index))


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize(
    ("dtype", "channels", "options"),
    [
        (np.uint8, 3, {"cell": 2, "count": 6}),
        (np.uint8, 5, {"octaves": 2.5, "offsets": 0.4}),
        (np.uint16, 3, {"octaves": 1, "cell": 2, "half": True, "count": 40}),
        (np.float32, 2, {"octaves": 2.5, "offsets": 0.3, "cell": 3}),
    ],
)
def test_tones_equal_the_plain_twin(dtype, channels, options):
    quilt = changed(random_quilt(channels, charts=((34, 41), (9, 35)), **options), has_tones=True)
    exemplar = exemplar_of(dtype, channels)
    painted, once = paint(quilt, exemplar).arrays, paint(changed(quilt, has_tones=False), exemplar).arrays
    assert (painted[0] != once[0]).any()
    for index in range(2):
        np.testing.assert_array_equal(painted[index], plain_paint(quilt, exemplar, index))


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize(
    ("dtype", "density"),
    [(np.uint8, 0.125), (np.float32, 0.3), (np.float32, 0.5), (np.float32, 1.7), (np.uint8, 2)],
)
def test_equals_the_plain_twin_at_any_density(dtype, density):
    quilt = random_quilt(5, charts=((13, 35), (7, 9)), octaves=1.5, offsets=0.3, layers=2)
    exemplar = exemplar_of(dtype)
    painted = paint(quilt, exemplar, density=density)
    assert painted.charts == painted_charts(quilt.charts, density)
    for index in range(2):
        np.testing.assert_array_equal(painted.arrays[index], plain_paint(quilt, exemplar, index, density))


def copying_quilt(charts, **options):
    """Return a quilt with the identity everywhere, most of whose placements read whole pixels."""
    quilt = random_quilt(7, charts=charts, **options)
    placed, some = quilt.placements.copy(), np.arange(len(quilt.placements)) % 4 > 0
    placed["symmetry"][some] = 0
    for way in ("row", "column"):
        source = placed[f"source_{way}"]
        source[some] = (source // 16 * 16 + (placed[way] + 8) % 16)[some]
    return changed(quilt, placed)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_pixels_that_are_copied_equal_the_plain_twin(dtype):
    quilt, exemplar = copying_quilt(((13, 21),), layers=2, count=9), exemplar_of(dtype, 5)
    painter = ChartPainter(quilt, 0, quilt.charts[0], image_pyramid((exemplar,), quilt))
    assert 0.5 < painter._readings.copies.mean() < 1
    np.testing.assert_array_equal(paint(quilt, exemplar).arrays[0], plain_paint(quilt, exemplar, 0))


def test_pixels_are_not_copied_far_from_their_centre():
    placed, shape = np.zeros(1, PLACEMENT), (1, 1100)
    placed["row"], placed["column"] = 8, 8
    labels = np.zeros(label_shape(*shape, 64), np.int32)
    quilt = Quilt((Chart(0, *shape),), shape, placed, ((LabelMap(64, labels),),))
    exemplar = np.random.default_rng(1).integers(0, 256, (*shape, 1)).astype(np.uint8)
    painted = paint(quilt, exemplar).arrays[0]
    np.testing.assert_array_equal(painted, plain_paint(quilt, exemplar, 0))
    assert (painted[:, :960] == exemplar[:, :960]).all()
    assert (painted[:, 1025:] != exemplar[:, 1025:]).any()


def test_densities_show_one_picture():
    # A smooth image under the identity: four texels' mean at density 2 is the texel at density 1.
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float32)
    image = np.stack([rows, columns], axis=2)
    quilt = random_quilt(6, count=1, charts=((24, 26),), offsets=0)
    middle = changed(quilt, bare_placement(0, (24, 26), SHAPE))
    once, twice = (paint(middle, image, density=d).arrays[0] for d in (1, 2))
    np.testing.assert_allclose(twice.reshape(24, 2, 26, 2, 2).mean(axis=(1, 3)), once, atol=1e-5)
    np.testing.assert_allclose(np.diff(twice[:, :, 0], axis=0), 0.5, atol=1e-5)


def test_a_quilt_is_painted_at_its_own_density():
    quilt, exemplar = random_quilt(6, charts=((20, 20),)), exemplar_of(np.uint8)
    finer = changed(quilt, density=2.0)
    np.testing.assert_array_equal(
        paint(finer, exemplar).arrays[0], paint(quilt, exemplar, density=2).arrays[0]
    )
    with pytest.raises(InputError, match="density is 3"):
        changed(quilt, density=3.0)


@pytest.mark.parametrize("density", [0, -1, 65, float("nan"), "1", True])
def test_a_density_out_of_range_is_refused(density):
    with pytest.raises(InputError, match="density"):
        paint(random_quilt(1), exemplar_of(np.uint8), density=density)


def test_texels_lie_evenly_over_all_steps():
    assert texel_places(4, 4).tolist() == [8, 24, 40, 56]
    assert texel_places(4, 8).tolist() == [4, 12, 20, 28, 36, 44, 52, 60]
    assert texel_places(3, 2).tolist() == [12, 36]
    for steps, texels in ((7, 3), (5, 11), (100, 33)):
        at = texel_places(steps, texels)
        assert at[0] >= 0
        assert at[-1] < 16 * steps
        assert np.ptp(np.diff(at)) <= 1


@pytest.mark.parametrize("octaves", [None, 2.5])
def test_is_linear_in_the_exemplar(octaves):
    quilt = random_quilt(3, octaves=octaves, layers=2)
    x, y = exemplar_of(np.float32, seed=1), exemplar_of(np.float32, seed=2)
    both = paint(quilt, (2 * x - 3 * y).astype(np.float32)).arrays
    for mixed, a, b in zip(both, paint(quilt, x).arrays, paint(quilt, y).arrays, strict=True):
        np.testing.assert_allclose(mixed, 2 * a - 3 * b, atol=1e-4)


def test_integers_are_rounded_once():
    quilt, exemplar = random_quilt(4), exemplar_of(np.uint8)
    exact = paint(quilt, exemplar.astype(np.float32)).arrays
    for ours, ideal in zip(paint(quilt, exemplar).arrays, exact, strict=True):
        assert np.abs(ours - ideal).max() <= 0.5001


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("value", [0, 1, 254, 255, -1])
def test_one_colour_stays_that_colour(dtype, value):
    value = np.iinfo(dtype).max if value < 0 else value
    for texels in paint(random_quilt(4, octaves=6, layers=2), np.full((*SHAPE, 3), value, dtype)).arrays:
        assert (texels == value).all()


@pytest.mark.parametrize("channels", [1, 2, 3, 4, 7])
def test_any_number_of_channels_is_painted_alike(channels):
    quilt, exemplar = random_quilt(5), exemplar_of(np.uint16, channels)
    whole = paint(quilt, exemplar).arrays
    for k in range(channels):
        alone = paint(quilt, exemplar[:, :, k : k + 1]).arrays
        for a, b in zip(whole, alone, strict=True):
            np.testing.assert_array_equal(a[:, :, k], b[:, :, 0])


def test_threads_and_strips_do_not_matter(monkeypatch):
    quilt = changed(random_quilt(6, charts=((300, 40), (90, 200)), octaves=1), has_tones=True)
    exemplar = exemplar_of(np.uint8)
    once = paint(quilt, exemplar, threads=1).arrays
    monkeypatch.setattr("upholster.quilt.painting._TASK_TEXELS", 1500)
    for a, b in zip(once, paint(quilt, exemplar, threads=5).arrays, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("role", ["albedo", "normal"])
def test_a_window_is_a_part_of_the_chart(role):
    quilt, image = changed(random_quilt(7, octaves=2), has_tones=True), exemplar_of(np.uint8)
    for density in (1, 1.5):
        painter = WindowPainter(quilt, role, image, density=density)
        whole = painter.paint(0)
        window = slice(10, 33), slice(5, 60)
        np.testing.assert_array_equal(painter.paint(0, window), whole[window])
        if role == "albedo":
            np.testing.assert_array_equal(whole, paint(quilt, image, density=density).arrays[0])


@pytest.mark.parametrize("octaves", [None, 1.5])
def test_sources_say_where_a_step_reads(octaves):
    quilt = random_quilt(7, octaves=octaves, offsets=0.3, layers=2)
    for n, (field, found) in enumerate(zip(quilt.fields, quilt.sources(), strict=True)):
        owners = quilt.owners(n, 0, 0, *found.shape[:2])
        rows, columns = np.indices(owners.shape).reshape(2, -1)
        at = warped_sources(field, quilt.on_chart(n)[owners.reshape(-1)], 16 * rows + 8, 16 * columns + 8)
        for axis, (place, size) in enumerate(zip(at, SHAPE, strict=True)):
            inside = (place >= 0) & (place <= 16 * (size - 1))
            assert inside.any()
            np.testing.assert_array_equal(found[..., axis].reshape(-1)[inside], place[inside])
            assert (found[..., axis] >= 0).all()
            assert (found[..., axis] <= 16 * (size - 1)).all()


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("cell", [1, 2, 3, 4, 8])
def test_owners_are_the_labels_that_weigh_most(cell, half):
    quilt = random_quilt(8, cell=cell, half=half, charts=((37, 50),))
    chart, layer = quilt.charts[0], quilt.labels[0][0]
    owners = quilt.owners(0, 0, 0, chart.height, chart.width)
    for name, count in (("rows", chart.height), ("columns", chart.width)):
        centres = cell_centres(layer.labels.shape[name == "columns"], cell, half=half)
        own = np.abs(centres[None] - (16 * np.arange(count) + 8)[:, None]).min(axis=1)
        assert own.max() <= 8 * cell  # a step lies in the cell whose centre is nearest
    for row in range(chart.height):
        for column in range(chart.width):
            centre_i = np.abs(cell_centres(layer.labels.shape[0], cell, half=half) - 16 * row - 8)
            centre_j = np.abs(cell_centres(layer.labels.shape[1], cell, half=half) - 16 * column - 8)
            near = layer.labels[np.flatnonzero(centre_i == centre_i.min())][
                :, np.flatnonzero(centre_j == centre_j.min())
            ]
            assert owners[row, column] in near
    assert quilt.owners(0, 5, 7, 4, 6).tolist() == owners[5:9, 7:13].tolist()


@pytest.mark.parametrize("symmetry", range(8))
def test_symmetries_are_those_of_the_square(symmetry):
    exemplar = exemplar_of(np.uint8)
    placed = np.zeros(1, PLACEMENT)
    placed["row"] = placed["column"] = 8 * 9
    placed["source_row"] = placed["source_column"] = 16 * 20
    placed["symmetry"] = symmetry
    labels = LabelMap(4, np.zeros(label_shape(9, 9, 4), np.int32))
    painted = paint(Quilt((Chart(0, 9, 9),), SHAPE, placed, ((labels,),)), exemplar).arrays[0]
    piece = exemplar[16:25, 16:25]
    symmetries = [np.rot90(q, k) for q in (piece, piece.swapaxes(0, 1)) for k in range(4)]
    assert sum(np.array_equal(painted, s) for s in symmetries) == 1
    matrix = SYMMETRIES[symmetry].reshape(2, 2)
    np.testing.assert_array_equal(matrix @ matrix.T, np.eye(2))
    assert round(np.linalg.det(matrix)) == (1 if symmetry < 4 else -1)
    assert len(np.unique(SYMMETRIES, axis=0)) == 8


def test_beyond_the_sample_it_is_mirrored():
    exemplar = exemplar_of(np.uint8)
    size = 3 * SHAPE[0], 3 * SHAPE[1]
    quilt = Quilt((Chart(0, *size),), SHAPE, bare_placement(0, size, SHAPE),
                  ((LabelMap(16, np.zeros(label_shape(*size, 16), np.int32)),),))  # fmt: skip
    painted = paint(quilt, exemplar).arrays[0]
    # Half a pixel off, for the middle of an even side lies between pixels; the sample itself in the middle.
    rows = np.concatenate([exemplar[::-1], exemplar, exemplar[::-1]])
    wanted = np.concatenate([rows[:, ::-1], rows, rows[:, ::-1]], axis=1)
    np.testing.assert_array_equal(painted, wanted)


def test_ramps_of_half_cells_are_linear():
    placed = np.zeros(2, PLACEMENT)
    placed["row"], placed["column"] = 8 * 8, (0, 16 * 16)
    placed["source_row"], placed["source_column"] = 16 * 20, (16 * 10, 16 * 38)
    labels = np.repeat([[0, 0, 0, 1, 1, 1]], 4, axis=0).astype(np.int32)  # centres at steps −8, 0, 8, 16, …
    quilt = Quilt((Chart(0, 16, 32),), SHAPE, placed, ((LabelMap(8, labels, half=True),),))
    image = np.zeros((*SHAPE, 1), np.float32)
    image[:, 28:] = 1  # which the second one reads, and the first one does not
    line = paint(quilt, image).arrays[0][8, :, 0]
    np.testing.assert_allclose(line[:8], 0)
    np.testing.assert_allclose(line[8:16], (2 * np.arange(8) + 1) / 16, atol=1e-6)
    np.testing.assert_allclose(line[16:], 1)


def test_the_second_layer_lies_over_the_first():
    quilt, exemplar = random_quilt(9, layers=2, octaves=1), exemplar_of(np.uint8)
    bare = changed(
        quilt, labels=tuple((a, LabelMap(b.cell, np.full_like(b.labels, -1))) for a, b in quilt.labels)
    )
    alone = changed(
        quilt, quilt.placements[quilt.placements["layer"] == 0], labels=tuple((a,) for a, _ in quilt.labels)
    )
    for a, b, c in zip(*(paint(one, exemplar).arrays for one in (quilt, bare, alone)), strict=True):
        np.testing.assert_array_equal(b, c)
        assert (a != b).any()


def two_sides(image, *, columns=96, rows=96):
    """Return a quilt whose left half reads an image's left part, and its right half the right part."""
    high, wide = label_shape(rows, columns, 2)
    placed = np.zeros(2, PLACEMENT)
    placed["row"], placed["column"] = 16 * rows // 2, (16, 16 * (columns - 1))
    placed["source_row"], placed["source_column"] = 16 * image.shape[0] // 2, (0, 16 * (image.shape[1] - 1))
    labels = np.zeros((high, wide), np.int32)
    labels[:, wide // 2 :] = 1
    return Quilt(
        (Chart(0, rows, columns),), image.shape[:2], placed, ((LabelMap(2, labels),),), has_tones=True
    )


def test_tones_make_a_ramp_of_a_step():
    image = np.full((96, 256, 1), 40, np.uint8)
    image[:, 128:] = 200
    quilt = two_sides(image)
    line = paint(quilt, image).arrays[0][48, :, 0].astype(int)
    assert (line[:30] == 40).all()
    assert (line[-30:] == 200).all()
    assert (np.diff(line) >= 0).all()
    assert np.diff(line).max() <= 14
    assert np.diff(paint(changed(quilt, has_tones=False), image).arrays[0][48, :, 0].astype(int)).max() == 80
    # At the chart's edge, where what lies beyond is not known, the step stays.
    assert np.diff(paint(quilt, image).arrays[0][0, :, 0].astype(int)).max() > 70


def test_tones_leave_details_and_what_is_far_from_cuts():
    rng = np.random.default_rng(4)
    image = (100 + rng.integers(-40, 41, (96, 128, 3))).astype(np.uint8)
    quilt = two_sides(image)
    once, toned = (paint(changed(quilt, has_tones=on), image).arrays[0].astype(int) for on in (False, True))
    np.testing.assert_array_equal(toned[:, :30], once[:, :30])
    np.testing.assert_array_equal(toned[:, -30:], once[:, -30:])
    assert 0 < np.abs(toned - once).max() < 20


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_tones_stay_within_the_samples_range(dtype):
    rng, top = np.random.default_rng(5), np.iinfo(dtype).max
    image = np.where(rng.random((64, 64, 3)) < 0.5, 0, top).astype(dtype)
    image[:, :32] //= 2
    painted = paint(two_sides(image), image).arrays[0].astype(int)
    plain = paint(changed(two_sides(image), has_tones=False), image).arrays[0].astype(int)
    assert np.abs(painted - plain).max() < top / 2


def test_tones_take_one_layer():
    with pytest.raises(InputError, match="has_tones is True with a second layer"):
        changed(random_quilt(1, layers=2), has_tones=True)


@pytest.mark.parametrize("half", [False, True])
def test_nearest_labels_are_exact(half):
    rng = np.random.default_rng(3)
    for chart, cell, count in ((Chart(0, 50, 63), 4, 12), (Chart(0, 9, 120), 3, 40), (Chart(0, 5, 5), 8, 3)):
        high, wide = label_shape(chart.height, chart.width, cell)
        rows = rng.choice(cell_centres(high, cell, half=half), count).astype(np.int32)
        columns = rng.choice(cell_centres(wide, cell, half=half), count).astype(np.int32)
        found = nearest_labels(rows, columns, chart, cell, half=half)
        down = cell_centres(high, cell, half=half)[:, None, None] - rows.astype(np.int64)
        right = cell_centres(wide, cell, half=half)[None, :, None] - columns.astype(np.int64)
        np.testing.assert_array_equal(found, (down**2 + right**2).argmin(axis=2))


@pytest.mark.parametrize("margin", [0, 2])
def test_matrices_are_those_of_the_formula(margin):
    rng = np.random.default_rng(margin)
    field = random_field(rng, (70, 90), octaves=6, margin=margin)
    rows, columns = rng.integers(-3000, 4000, (2, 200))
    found = field.between(rows, columns)
    for n in range(200):
        assert plain_matrix(field, int(rows[n]), int(columns[n])) == found[n].tolist()
    nodes = field.between(*(512 * (np.indices(field.nodes.shape[:2]) - margin) + 8))
    np.testing.assert_array_equal(nodes, field.matrices)


def test_far_from_its_centre_a_placement_stands_still():
    """32 bits hold all of it: so says the limit of 1,023 steps."""
    nodes = np.full((1, 1, 4), 192, np.int16)
    nodes[..., 2], nodes[..., 3] = 100, -56
    quilt = random_quilt(2, charts=((1, 1100),), count=1)
    placed = quilt.placements.copy()
    placed["column"] = 32
    quilt = changed(quilt, placed, fields=(WarpField(nodes, 0),))
    exemplar = exemplar_of(np.uint8)
    np.testing.assert_array_equal(paint(quilt, exemplar).arrays[0], plain_paint(quilt, exemplar, 0))
    most = 2 * int(np.abs(quilt.fields[0].matrices).max() + 2**18)
    assert most * 1023 + most * 15 // 16 < 2**31


def test_texels_are_one_to_root_two_times_as_wide_as_details_of_their_level():
    scales = 2.0 ** np.array([-3, 0, 0.4, 0.6, 1, 1.4, 1.6, 5, 6])
    placed = np.zeros(1, PLACEMENT)
    fields = [quantised(np.broadcast_to(s * np.eye(2), (2, 2, 2, 2))) for s in scales]
    centres = np.concatenate([centre_matrices(field, placed) for field in fields])
    assert levels_of(centres, 9).tolist() == [0, 0, 0, 1, 2, 2, 3, 9, 9]
    assert levels_of(centres, 2).tolist() == [0, 0, 0, 1, 2, 2, 2, 2, 2]
    assert levels_of(centres, 9, ratio=4.0).tolist() == [0, 0, 0, 0, 0, 0, 1, 8, 9]
    assert [most_levels(*size) for size in ((1, 1), (2, 1), (3, 3), (4, 4), (5, 128))] == [0, 2, 4, 4, 14]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_the_pyramid_is_filtered_by_1_3_3_1_and_1_6_1(dtype):
    image = exemplar_of(dtype)[:37]
    np.testing.assert_array_equal(halved(image), plain_halved(image))
    np.testing.assert_array_equal(softened(image), plain_softened(image))
    for filtered in (halved, softened):
        assert filtered(image[:1, :1]).tolist() == image[:1, :1].tolist()
    ramp = np.arange(64, dtype=np.float32)[:, None, None] * np.ones((1, 8, 1), np.float32)
    np.testing.assert_allclose(halved(ramp)[1:-1, :, 0], 2 * np.arange(1, 31)[:, None] + 0.5 + np.zeros(4))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("source_row", 16 * SHAPE[0]),
        ("source_column", -1),
        ("chart", 9),
        ("symmetry", 8),
        ("layer", 2),
        ("layer", 1),
    ],
)
def test_a_bad_placement_is_refused(name, value):
    quilt = random_quilt(8)
    placed = quilt.placements.copy()
    placed[name][3] = value
    with pytest.raises(InputError):
        changed(quilt, placed)


def test_a_bad_offset_is_refused():
    quilt = random_quilt(9, octaves=1)
    placed = quilt.placements.copy()
    placed["offset"][0, 2] = 2**18 + 1
    with pytest.raises(InputError, match="a matrix's offset is outside ±262144"):
        changed(quilt, placed)


@pytest.mark.parametrize("label", [-1, 20, 2**30])
def test_a_label_that_names_nothing_is_refused(label):
    quilt = random_quilt(9)
    labels = quilt.labels[0][0].labels.copy()
    labels[2, 3] = label
    with pytest.raises(InputError, match="label"):
        changed(quilt, labels=((LabelMap(4, labels),), quilt.labels[1]))
    with pytest.raises(InputError, match="shape"):
        changed(quilt, labels=((LabelMap(4, labels[1:]),), quilt.labels[1]))
    with pytest.raises(InputError, match="one or two"):
        changed(quilt, labels=quilt.labels[:1])


def test_a_chart_without_placements_is_refused():
    quilt = random_quilt(9)
    with pytest.raises(InputError, match="of all 2"):
        changed(quilt, quilt.on_chart(0))
    with pytest.raises(InputError, match="one for each chart"):
        changed(random_quilt(9, octaves=1), fields=random_quilt(9, octaves=1).fields[:1])


@pytest.mark.parametrize("cell", [0, 256])
def test_a_cell_out_of_range_is_refused(cell):
    with pytest.raises(InputError, match="cell"):
        LabelMap(cell, np.zeros((3, 3), np.int32))


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((40, 43, 3), np.uint8),
        np.zeros((40, 45), np.uint8),
        np.zeros((40, 44, 3), np.int32),
        np.zeros((40, 44, 0), np.uint8),
    ],
)
def test_a_wrong_image_is_refused(image):
    with pytest.raises(InputError):
        paint(random_quilt(9), image)
