import numpy as np
import pytest
from warp_fields import quantised

from upholster.base.errors import InputError
from upholster.quilt.warp_field import ANGLES, MOST_OCTAVES, MOST_SHEAR, OCTAVE, UNIT, WarpField, node_count


def nodes(rng, shape=(5, 7)):
    out = np.empty((*shape, 4), np.int16)
    most = OCTAVE * MOST_OCTAVES
    out[..., :2] = rng.integers(-most, most + 1, (*shape, 2))
    out[..., 2] = rng.integers(0, ANGLES, shape)
    out[..., 3] = rng.integers(-MOST_SHEAR, MOST_SHEAR + 1, shape)
    return out


def exact(made):
    b, a, angle, shear = np.moveaxis(made.astype(float), -1, 0)
    symmetry = 2 * np.pi / ANGLES
    down, right = 2 ** (b / OCTAVE), 2 ** (a / OCTAVE)
    upright = (angle + shear + ANGLES / 4) * symmetry
    columns = [down * np.sin(upright), right * np.sin(angle * symmetry)]
    rows = [down * np.cos(upright), right * np.cos(angle * symmetry)]
    return np.stack([np.stack(columns, -1), np.stack(rows, -1)], -2)


def test_matrices_are_what_the_nodes_say():
    made = nodes(np.random.default_rng(1), (40, 50))
    found = WarpField(made).matrices.reshape(40, 50, 2, 2) / UNIT
    wanted = exact(made)
    size = np.abs(wanted).max(axis=(2, 3), keepdims=True)
    assert (np.abs(found - wanted) <= 2e-4 * size + 1 / UNIT).all()
    assert (np.linalg.det(found) > 0).all()


def test_quantised_is_the_nearest_and_keeps_what_is_quantised():
    rng = np.random.default_rng(2)
    made = nodes(rng)
    assert np.array_equal(quantised(exact(made)).nodes, made)
    symmetry = rng.uniform(0, 2 * np.pi, (30, 30))
    sizes = 2 ** rng.uniform(-5, 5, (2, 30, 30))
    shear = rng.uniform(-1, 1, (30, 30))
    m = np.empty((30, 30, 2, 2))
    m[..., 0, 1], m[..., 1, 1] = sizes[1] * np.sin(symmetry), sizes[1] * np.cos(symmetry)
    m[..., 0, 0], m[..., 1, 0] = sizes[0] * np.cos(symmetry + shear), -sizes[0] * np.sin(symmetry + shear)
    field = quantised(m, margin=0)
    near = exact(field.nodes)
    for column, steps in ((1, 0.5), (0, 1.0)):  # the rows' angle is rounded twice
        ratio = np.linalg.norm(near[..., column], axis=-1) / np.linalg.norm(m[..., column], axis=-1)
        assert np.abs(np.log2(ratio)).max() <= 0.5 / OCTAVE + 1e-9
        a, b = (np.arctan2(x[..., 0, column], x[..., 1, column]) for x in (near, m))
        apart = np.abs((a - b + np.pi) % (2 * np.pi) - np.pi)
        assert apart.max() <= steps * 2 * np.pi / ANGLES + 1e-9


def test_the_identity_is_exact():
    field = quantised(np.tile(np.eye(2), (3, 4, 1, 1)))
    assert not field.nodes.any()
    assert np.array_equal(field.matrices, np.tile([UNIT, 0, 0, UNIT], (3, 4, 1)))


def test_extremes_are_brought_within_range():
    field = quantised(np.array([[[[1e-9, 0], [0, 1e9]], [[1e-3, 0], [5, 1]]]]))
    assert field.nodes[0, 0].tolist() == [-192, 192, 0, 0]
    assert abs(field.nodes[0, 1, 3]) == MOST_SHEAR
    assert (np.linalg.det(field.matrices.reshape(1, 2, 2, 2)) > 0).all()


def test_between_nodes_it_is_bilinear():
    field = WarpField(nodes(np.random.default_rng(3)), margin=1)
    m = field.matrices

    def at(row, column):
        return field.between(16 * row + 8, 16 * column + 8)

    for row, column in ((0, 0), (-32, -32), (-1, 5), (31, 64), (40, 77), (96, 160), (95, 159)):
        i, j = 1 + row // 32, 1 + column // 32
        y, x = row % 32, column % 32
        below, beside = min(i + 1, 4), min(j + 1, 6)
        up, low = (m[k, j].astype(int) * (32 - x) + m[k, beside].astype(int) * x for k in (i, below))
        assert np.abs(at(row, column) - (up * (32 - y) + low * y) / 1024).max() <= 1
    for row, column, node in ((-500, -500, (0, 0)), (500, 500, (4, 6)), (-500, 500, (0, 6))):
        assert (at(row, column) == m[node]).all()


@pytest.mark.parametrize(
    ("shape", "margin"), [((5, 7), 1), ((4, 3), 0), ((1, 6), 2), ((2, 1), 1), ((1, 1), 0)]
)
def test_between_texels_it_is_bilinear_too(shape, margin):
    field = WarpField(nodes(np.random.default_rng(5), shape), margin)
    # at texels it is what decoders round
    rows, columns = np.mgrid[-90:260:13, -90:260:11]
    found = field.at(rows.astype(float), columns.astype(float))
    assert found.shape == (*rows.shape, 2, 2)
    rounded = field.between(16 * rows + 8, 16 * columns + 8).reshape(*rows.shape, 2, 2) / UNIT
    assert np.abs(found - rounded).max() <= 1 / UNIT + 1e-12
    # and between them it goes evenly from one to the next
    row, column = np.array([40.0, 40.25, 41.0]), np.array([7.5, 7.5, 7.5])
    one, between, other = field.at(row, column)
    np.testing.assert_allclose(between, 0.75 * one + 0.25 * other, atol=1e-9)
    one, between, other = field.at(column, row)
    np.testing.assert_allclose(between, 0.75 * one + 0.25 * other, atol=1e-9)


def test_the_identity_is_the_same_everywhere():
    places = np.linspace(-50, 90, 6).reshape(2, 3)
    several = quantised(np.tile(np.eye(2), (3, 4, 1, 1)))
    for field in (WarpField.identity(), several):
        assert field.is_identity
        assert (field.at(places, places) == np.eye(2)).all()
        assert field.at(places, places).shape == (2, 3, 2, 2)
        assert field.at(np.zeros(0), np.zeros(0)).shape == (0, 2, 2)
        assert (field.between([[3], [900]], [5, -80]) == [UNIT, 0, 0, UNIT]).all()
    assert not WarpField(nodes(np.random.default_rng(6))).is_identity


def test_nodes_reach_round_all_texels():
    for texels in (1, 31, 32, 33, 64, 500):
        count = node_count(texels, 1)
        assert texels <= 32 * (count - 3) < texels + 32
        assert node_count(texels, 3) == count + 4


def test_arrays_are_read_only():
    field = WarpField(nodes(np.random.default_rng(4)))
    for array in (field.nodes, field.matrices):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0, 0] = 1


@pytest.mark.parametrize(
    ("change", "margin", "message"),
    [
        ((0, 193), 1, "out of range"),
        ((1, -193), 1, "out of range"),
        ((2, 256), 1, "out of range"),
        ((2, -1), 1, "out of range"),
        ((3, 57), 1, "out of range"),
        ((0, 0), 65, "margin of 65"),
        ((0, 0), -1, "margin of -1"),
    ],
)
def test_wrong_nodes_are_refused(change, margin, message):
    made = np.zeros((2, 2, 4), np.int16)
    made[1, 1, change[0]] = change[1]
    with pytest.raises(InputError, match=message):
        WarpField(made, margin)


def test_wrong_shapes_and_matrices_are_refused():
    for wrong in (
        np.zeros((2, 2, 4), np.int32),
        np.zeros((2, 2, 3), np.int16),
        np.zeros((0, 2, 4), np.int16),
    ):
        with pytest.raises(InputError, match="allowed: int16"):
            WarpField(wrong)
    for bad in (np.nan, np.inf, -1.0, 0.0):
        m = np.tile(np.eye(2), (2, 2, 1, 1))
        m[1, 0, 0, 0] = bad
        with pytest.raises(InputError, match="not finite, or its determinant"):
            quantised(m)
