"""Painting: exact, linear, the same on any number of threads, and equal to a plain twin."""

import numpy as np
import pytest
from random_quilts import SHAPE, changed, exemplar_of, random_quilt, weights_of

from upholster.errors import InputError
from upholster.quilt import Chart, Quilt, paint
from upholster.quilt.placement import MASK_CUT, MASK_NONE, PLACEMENT, SYMMETRIES
from upholster.quilt.plans import PlacementList


def plain_paint(quilt, exemplar):
    """Paint by the formula: the oracle of the kernel that copies."""
    whole = exemplar.dtype != np.float32
    arrays = []
    for index, chart in enumerate(quilt.charts):
        canvas = np.zeros((chart.height, chart.width, exemplar.shape[2]), np.int64 if whole else np.float32)
        for placement in quilt.on_chart(index):
            weights = weights_of(quilt, placement)
            a, b, c, d = SYMMETRIES[placement["symmetry"]]
            for i in range(placement["height"]):
                for j in range(placement["width"]):
                    down, right = i - placement["height"] // 2, j - placement["width"] // 2
                    row, column = placement["row"] + down, placement["column"] + right
                    if not (0 <= row < chart.height and 0 <= column < chart.width):
                        continue
                    source = exemplar[
                        (placement["source_row"] >> 4) + a * down + b * right,
                        (placement["source_column"] >> 4) + c * down + d * right,
                    ]
                    old = canvas[row, column]
                    if whole:
                        new = source.astype(np.int64) << 6
                        canvas[row, column] = (old * (256 - weights[i, j]) + new * weights[i, j] + 128) >> 8
                    else:
                        part = np.float32(weights[i, j] / 256)
                        canvas[row, column] = old * (1 - part) + source * part
        arrays.append(((canvas + 32) >> 6).astype(exemplar.dtype) if whole else canvas)
    return arrays


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("seed", [0, 1])
def test_equals_the_plain_twin(dtype, seed):
    quilt, exemplar = random_quilt(seed), exemplar_of(dtype)
    assert quilt.copied == (True, True)
    for ours, plain in zip(paint(quilt, exemplar).arrays, plain_paint(quilt, exemplar), strict=True):
        assert ours.dtype == dtype
        np.testing.assert_array_equal(ours, plain)


def test_is_linear_in_the_exemplar():
    quilt = random_quilt(3)
    x, y = exemplar_of(np.float32, seed=1), exemplar_of(np.float32, seed=2)
    both = paint(quilt, (2 * x - 3 * y).astype(np.float32)).arrays
    for mixed, a, b in zip(both, paint(quilt, x).arrays, paint(quilt, y).arrays, strict=True):
        np.testing.assert_allclose(mixed, 2 * a - 3 * b, atol=1e-4)


def test_integers_stay_within_half_a_step_of_the_float_formula():
    quilt, exemplar = random_quilt(4), exemplar_of(np.uint8)
    exact = paint(quilt, exemplar.astype(np.float32)).arrays
    for ours, ideal in zip(paint(quilt, exemplar).arrays, exact, strict=True):
        assert np.abs(ours - ideal).max() <= 0.5 + 60 / 64  # each placement rounds once, to 1/64


@pytest.mark.parametrize("channels", [1, 2, 3, 4, 7])
def test_any_number_of_channels_is_painted_alike(channels):
    quilt, exemplar = random_quilt(5), exemplar_of(np.uint16, channels)
    whole = paint(quilt, exemplar).arrays
    for k in range(channels):
        alone = paint(quilt, exemplar[:, :, k : k + 1]).arrays
        for a, b in zip(whole, alone, strict=True):
            np.testing.assert_array_equal(a[:, :, k], b[:, :, 0])


def test_threads_and_strips_do_not_matter(monkeypatch):
    quilt, exemplar = random_quilt(6, charts=((300, 40), (90, 200))), exemplar_of(np.uint8)
    once = paint(quilt, exemplar, threads=1).arrays
    monkeypatch.setattr("upholster.quilt.painting._TASK_TEXELS", 1500)
    for a, b in zip(once, paint(quilt, exemplar, threads=5).arrays, strict=True):
        np.testing.assert_array_equal(a, b)


def test_sources_say_where_a_texel_comes_from():
    quilt = random_quilt(7)
    # An image whose samples name their own place.
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]]
    places = np.stack([rows, columns], -1).astype(np.float32)
    hard = quilt.placements.copy()
    hard["mask"], hard["feather"] = MASK_NONE, 0
    hard = changed(quilt, hard)
    for source, texels in zip(hard.sources(), paint(hard, places).arrays, strict=True):
        painted = source[:, :, 0] >= 0
        assert painted.any()
        np.testing.assert_array_equal(source[painted], 16 * texels[painted])
        assert (texels[~painted] == 0).all()


@pytest.mark.parametrize("symmetry", range(8))
def test_turns_are_the_symmetries_of_the_square(symmetry):
    exemplar = exemplar_of(np.uint8)
    placements = np.zeros(1, PLACEMENT)
    placements["row"] = placements["column"] = 4
    placements["height"] = placements["width"] = 9
    placements["source_row"] = placements["source_column"] = 16 * 20
    placements["symmetry"] = symmetry
    quilt = Quilt((Chart(0, 9, 9),), SHAPE, PlacementList(placements, np.zeros(0, np.uint8)))
    painted = paint(quilt, exemplar).arrays[0]
    piece = exemplar[16:25, 16:25]
    turned = np.rot90(piece, symmetry % 4)
    if symmetry >= 4:
        turned = np.rot90(piece.swapaxes(0, 1), 0)
        turned = [turned, piece[:, ::-1], piece[::-1, ::-1].swapaxes(0, 1), piece[::-1]][symmetry - 4]
    symmetries = [np.rot90(q, k) for q in (piece, piece.swapaxes(0, 1)) for k in range(4)]
    assert sum(np.array_equal(painted, s) for s in symmetries) == 1
    matrix = SYMMETRIES[symmetry].reshape(2, 2)
    np.testing.assert_array_equal(matrix @ matrix.T, np.eye(2))
    assert round(np.linalg.det(matrix)) == (1 if symmetry < 4 else -1)


def test_the_eight_turns_differ():
    assert len(np.unique(SYMMETRIES, axis=0)) == 8


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("source_row", 16 * 4000),
        ("source_column", -16),
        ("chart", 9),
        ("symmetry", 8),
        ("mask", 3),
        ("height", 0),
        ("width", 5000),
        ("first_cell", 10**6),
        ("mask_cell", 0),
        ("feather", 17),
    ],
)
def test_a_bad_placement_is_refused(field, value):
    quilt = random_quilt(8)
    placements = quilt.placements.copy()
    index = np.flatnonzero(placements["mask"] == MASK_CUT)[-1]
    placements[field][index] = value
    with pytest.raises(InputError):
        changed(quilt, placements)


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
