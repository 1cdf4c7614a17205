"""Painted normal maps: the relief that is painted is the one that is lit, on every chart alike."""

import numpy as np
import pytest
from plain_painting import plain_turned
from warp_fields import quantised

from upholster.base.errors import InputError
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.sphere import sphere
from upholster.quilt._normal_kernels import turn_vectors
from upholster.quilt.chart import Chart
from upholster.quilt.labels import LabelMap, cell_centres, label_shape
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.normal_painting import paint_normals, unit_normal_texels
from upholster.quilt.painting import paint
from upholster.quilt.placement import PLACEMENT
from upholster.quilt.warp_field import FIELD_STEP, WarpField, node_count

SIDE = 160


def bumps(side=SIDE, *, phase=0.0):
    """Return a relief without symmetry and its slopes: height, by rows, by columns, each (side, side)."""
    r, c = np.mgrid[:side, :side] / 6.0
    u, v = r + 0.3 * c + phase, c - 0.2 * r
    height = np.sin(u) + 0.6 * np.cos(v) + 0.4 * np.sin(0.7 * (u + v))
    by_u, by_v = np.cos(u) + 0.28 * np.cos(0.7 * (u + v)), -0.6 * np.sin(v) + 0.28 * np.cos(0.7 * (u + v))
    return height, (by_u - 0.2 * by_v) / 6, (0.3 * by_u + by_v) / 6


def normals_of(by_row, by_column, dtype=np.float32):
    """Return the normal map of a relief: x to the right, y upward."""
    vectors = np.stack([-by_column, by_row, np.ones_like(by_row)], axis=2)
    unit = vectors / np.linalg.norm(vectors, axis=2, keepdims=True) / 2 + 0.5
    return (unit if dtype == np.float32 else np.rint(unit * np.iinfo(dtype).max)).astype(dtype)


def decoded(samples):
    top = 1 if samples.dtype == np.float32 else np.iinfo(samples.dtype).max
    return 2.0 * samples / top - 1


def quilt_of(charts, placed, labels, fields=()):
    """Return a quilt of charts and their labels, of each the cell and the map."""
    maps = tuple((LabelMap(cell, np.ascontiguousarray(own, np.int32)),) for cell, own in labels)
    return Quilt(charts, (SIDE, SIDE), placed, maps, fields)


def one_block(side, symmetry, field=None):
    placed = np.zeros(1, PLACEMENT)
    placed["row"] = placed["column"] = 16 * (side // 2) + 8
    placed["source_row"] = placed["source_column"] = 16 * (SIDE // 2)
    placed["symmetry"] = symmetry
    labels = 16, np.zeros(label_shape(side, side, 16))
    return quilt_of((Chart(0, side, side),), placed, [labels], (field,) if field else ())


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize("symmetry", range(8))
@pytest.mark.parametrize("angle", [None, 0, 37, 128, 200])
def test_they_are_the_normals_of_the_painted_relief(symmetry, angle):
    """On a flat chart, whose tangent frame is its own axes, finite differences tell what they must be."""
    field = None
    if angle is not None:
        nodes = np.zeros((1, 1, 4), np.int16)
        nodes[..., 2] = angle
        field = WarpField(nodes, 0)
    quilt = one_block(64, symmetry, field)
    height, *slopes = bumps()
    relief = paint(quilt, height.astype(np.float32)[:, :, None]).arrays[0][:, :, 0]
    expected = normals_of(*np.gradient(relief.astype(np.float64)))[2:-2, 2:-2]
    for dtype, tolerance in ((np.float32, 0.03), (np.uint16, 0.03), (np.uint8, 0.04)):
        texels = paint_normals(quilt, normals_of(*slopes, dtype)).arrays[0]
        assert texels.dtype == dtype
        found = decoded(texels[2:-2, 2:-2])
        assert np.abs(found - decoded(expected)).max() < tolerance
        mean = np.abs(found - decoded(expected)).mean()
        assert mean < 0.006
    if angle is None and symmetry:  # the test can fail
        as_it_is = decoded(paint(quilt, normals_of(*slopes)).arrays[0][2:-2, 2:-2])
        assert np.abs(as_it_is - decoded(expected)).mean() > 0.03


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_vectors_turn_by_integers_of_32_bits(dtype):
    """By any matrix, such as 0 and the largest ones, and any vector, such as those that are no unit ones."""
    rng = np.random.default_rng(4)
    top = np.iinfo(dtype).max
    matrices = rng.integers(-(2**18), 2**18, (1, 400, 4)) >> rng.integers(0, 18, (1, 400, 1))
    matrices[0, :8, 1::2] = [
        (0, 0),
        (1, 0),
        (0, -1),
        (2**18, 2**18),
        (-(2**18), 2**18),
        (32767, 32767),
        (46340, 1),
        (0, 4096),
    ]
    samples = rng.choice([0, 1, top // 2, top, 77], (1, 400, 3)).astype(dtype)
    expected = [plain_turned(m, x, y, top) for m, (x, y, _) in zip(matrices[0], samples[0], strict=True)]
    found = samples.copy()
    rows, columns = np.zeros(1, np.int64), 512 * np.arange(400) + 8
    turn_vectors(found, matrices.astype(np.int32), 0, rows, columns, top)
    np.testing.assert_array_equal(found[0, :, :2], expected)
    np.testing.assert_array_equal(found[0, 7], samples[0, 7])  # of no angle
    np.testing.assert_array_equal(found[..., 2], samples[..., 2])


def test_without_turns_and_fields_they_are_painted_as_any_map():
    quilt = one_block(40, 0)
    image = np.random.default_rng(0).integers(0, 256, (SIDE, SIDE, 3), dtype=np.uint8)
    np.testing.assert_array_equal(paint_normals(quilt, image).arrays[0], paint(quilt, image).arrays[0])


def test_blocks_of_several_turns_blend_vectors_already_turned():
    """Two blocks side by side show one relief: so do their normals, where they are blended too."""
    placed = np.repeat(one_block(41, 0).placements, 2)
    placed["symmetry"] = 0, 2
    r, c = np.mgrid[:SIDE, :SIDE] - 80.0
    slopes = 0.02 * r + 0.01 * c, 0.01 * r  # of a relief that half a turn does not change
    labels = np.indices(label_shape(41, 41, 4)).sum(axis=0) % 2
    quilt = quilt_of((Chart(0, 41, 41),), placed, [(4, labels)])
    once = one_block(41, 0)
    a, b = (paint_normals(q, normals_of(*slopes)).arrays[0] for q in (quilt, once))
    np.testing.assert_allclose(a, b, atol=1e-6)


def frames(patch, rows, columns, shape):
    """Return steps (S_s and S_t per texel), normals and e1, e2 of a direction that winds over the surface."""
    s, t = (np.asarray(rows) + 0.5) / shape[0], (np.asarray(columns) + 0.5) / shape[1]
    points, by_s, by_t = patch.derivatives(s, t)
    normals = np.cross(by_s, by_t)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    wanted = np.stack([-points[..., 1], points[..., 0], 2.0 + 0 * points[..., 2]], axis=-1)
    e1 = wanted - (wanted * normals).sum(-1, keepdims=True) * normals
    e1 /= np.linalg.norm(e1, axis=-1, keepdims=True)
    return by_s / shape[0], by_t / shape[1], normals, e1, np.cross(e1, normals)


def covered_surface(surface, shape, rho):
    """Return a quilt of single blocks over every patch, with fields along that direction."""
    rng = np.random.default_rng(1)
    charts = tuple(Chart(k, *shape) for k in range(len(surface.patches)))
    fields, placed = [], []
    for k, patch in enumerate(surface.patches):
        i, j = np.mgrid[: node_count(shape[0], 1), : node_count(shape[1], 1)]
        by_row, by_column, _, e1, e2 = frames(patch, FIELD_STEP * (i - 1), FIELD_STEP * (j - 1), shape)
        matrix = [[(e * step).sum(-1) for step in (by_row, by_column)] for e in (e2, e1)]
        fields.append(quantised(rho * np.moveaxis(np.array(matrix), (0, 1), (-2, -1))))
        cells = label_shape(*shape, 16)
        block = np.zeros(cells[0] * cells[1], PLACEMENT)
        block["chart"] = k
        block["row"] = np.repeat(cell_centres(cells[0], 16), cells[1])
        block["column"] = np.tile(cell_centres(cells[1], 16), cells[0])
        block["source_row"], block["source_column"] = 16 * rng.integers(40, SIDE - 40, (2, len(block)))
        placed.append(block)
    # Blocks of 16 steps in cells of one, so that nearly nothing is blended.
    i, j = ((np.arange(count) + 15) // 16 for count in label_shape(*shape, 1))
    labels = [(1, i[:, None] * cells[1] + j)] * len(charts)
    return quilt_of(charts, np.concatenate(placed), labels, tuple(fields))


@pytest.mark.parametrize(
    ("surface", "rho"), [(ring_cyclide(6, 0, 2), 8.0), (sphere(), 60.0)], ids=["torus", "sphere"]
)
def test_light_from_one_side_looks_the_same_on_every_chart(surface, rho):
    shape = (64, 96)
    quilt = covered_surface(surface, shape, rho)
    _, *slopes = bumps()
    image = normals_of(*slopes, np.uint16)
    light = np.array([0.48, 0.6, 0.64])
    painted, plain = paint_normals(quilt, image), paint(quilt, image)
    errors, without = [], []
    for k, source in enumerate(quilt.sources()):
        _, by_column, normal, e1, e2 = frames(surface.patches[k], *np.mgrid[: shape[0], : shape[1]], shape)
        along = by_column / np.linalg.norm(by_column, axis=-1, keepdims=True)
        up = np.cross(normal, along)
        at = np.rint(source / 16).astype(int)
        x, y, z = np.moveaxis(decoded(image[at[..., 0], at[..., 1]]), -1, 0)
        expected = (x[..., None] * e1 - y[..., None] * e2 + z[..., None] * normal) @ light

        def lit(texels, axes=(along, up, normal)):
            vectors = decoded(texels)
            return sum(vectors[..., n, None] * axis for n, axis in enumerate(axes)) @ light

        errors.append(np.abs(lit(painted.arrays[k]) - expected).mean())
        without.append(np.abs(lit(plain.arrays[k]) - expected).mean())
    assert (
        max(errors) < 0.015
    )  # the nearest pixel, not the bilinear sample; angles of 1.4°; a pole of the field
    assert np.mean(without) > 10 * np.mean(errors)


@pytest.mark.parametrize(
    "image",
    [np.zeros((SIDE, SIDE, 4), np.uint8), np.zeros((9, 9, 3), np.uint8), np.zeros((SIDE, SIDE, 3), int)],
)
def test_what_is_no_normal_map_is_refused(image):
    with pytest.raises(InputError, match="normal map"):
        paint_normals(one_block(40, 0), image)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_blended_normals_become_unit_vectors(dtype):
    rng = np.random.default_rng(5)
    _, *slopes = bumps(64)
    unit = normals_of(*slopes, dtype)
    other = unit[::-1, ::-1]
    top = 1 if dtype == np.float32 else np.iinfo(dtype).max
    blended = unit.astype(np.float64) + rng.random((64, 64, 1)) * (other.astype(np.float64) - unit)
    blended = (blended if top == 1 else np.rint(blended)).astype(dtype)
    blended[:8] = unit[:8]
    blended[8, 8] = top / 2  # no direction at all
    texels = Texels((Chart(0, 64, 64),), (blended,))
    before = blended.copy()
    found = unit_normal_texels(texels).arrays[0]
    np.testing.assert_array_equal(blended, before)
    assert found.dtype == dtype
    np.testing.assert_array_equal(found[:8], unit[:8])  # to the bit
    lengths = np.linalg.norm(decoded(found), axis=2)
    assert np.abs(lengths - 1).max() < 0.0079
    assert np.abs(np.linalg.norm(decoded(before), axis=2) - 1).max() > 0.1
    # The plain way: the same directions.
    vectors = decoded(before).astype(np.float64)
    length = np.linalg.norm(vectors, axis=2, keepdims=True)
    expected = np.where(length < 1 / 128, (0, 0, 1), vectors / np.maximum(length, 1e-9))
    changed = np.abs(length[..., 0] - 1) > 1 / 128
    assert changed.any()
    assert np.abs(decoded(found) - expected)[changed].max() < 1.01 / (top if top > 1 else 1e6)
