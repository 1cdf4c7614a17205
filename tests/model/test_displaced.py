"""Displaced meshes: closed, of the predicted volume, true to the height map, flat where they are to stay."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from plain_displaced import PlainMesh, bilinear, block_means

from upholster.base.conditions import read_conditions
from upholster.base.errors import InputError
from upholster.charts.layout import density_layout
from upholster.charts.tessellation.mesh import Mesh, face_parameters, own_patches, tessellate
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.cyclide import ring_cyclide, torus
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.revolution import revolve, vase
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.surface import Surface
from upholster.model.displaced_mesh import displaced, kept_box, plain_solid
from upholster.model.heights import height_levels, height_values
from upholster.model.solid import check_solid
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels

Field = Callable[[np.ndarray], np.ndarray]


def waves(points: np.ndarray) -> np.ndarray:
    """Heights of 0 to 1 as a function of space: the same on both sides of a seam."""
    x, y, z = np.moveaxis(points, -1, 0)
    return 0.5 + 0.25 * np.sin(4 * x + 1) + 0.25 * np.cos(5 * y - 3 * z)


def centres(surface: Surface, chart: Chart) -> np.ndarray:
    face, own = own_patches(surface, chart)
    rows, columns = np.arange(chart.height) + 0.5, np.arange(chart.width) + 0.5
    return face.frames_grid(*face_parameters(own, rows, columns))[0]


def height_map(surface: Surface, field: Field, texels: int = 60_000, dtype: type = np.uint16) -> Texels:
    charts = density_layout(surface, texels=texels)
    top = 1 if dtype == np.float32 else np.iinfo(dtype).max
    heights = [np.clip(field(centres(surface, chart)), 0, 1) * top for chart in charts]
    arrays = [np.rint(h) if dtype != np.float32 else h for h in heights]
    return Texels(charts, tuple(a.astype(dtype)[:, :, None] for a in arrays))


def mesh_of(surface: Surface, texels: Texels, quads: int = 3000) -> Mesh:
    return tessellate(surface, texels.charts, quads=quads)


def predicted(surface: Surface, field: Field, amount: float, mid: float = 0.0) -> float:
    """Volume that the displacement adds, integrated over a fine tessellation.

    Between a surface and its displacement by d lies the integral of d + H·d² + K·d³/3 (H, K: mean and
    Gaussian curvature). Both are in the areas of surfaces offset by ±e: A(e) = A + 2eH·A + e²K·A.
    """
    mesh = tessellate(surface, quads=60_000)
    corners = mesh.all_triangles()
    step = 1e-3 * np.ptp(mesh.positions)
    offsets = [mesh.positions + e * mesh.normals for e in (-step, 0.0, step)]
    below, here, above = (
        np.linalg.norm(
            np.cross(p[corners[:, 1]] - p[corners[:, 0]], p[corners[:, 2]] - p[corners[:, 0]]), axis=1
        )
        / 2
        for p in offsets
    )
    d = amount * (field(mesh.positions[corners].mean(axis=1)) - mid)
    mean = (above - below) / (4 * step)
    gauss = (above + below - 2 * here) / (2 * step**2)
    return float((here * d + mean * d**2 + gauss * d**3 / 3).sum())


def closed_cylinder() -> Surface:
    """A rod of radius ½ and height 2, with its lids."""
    corners = [(0.0, 1.0), (0.5, 1.0), (0.5, -1.0), (0.0, -1.0)]
    return revolve([[(*a, 1.0), (*b, 1.0)] for a, b in pairwise(corners)])


def box_mesh() -> Mesh:
    """A cube of side 1 with a chart of 16² texels on each side, of two triangles each."""
    corners = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    normals = np.repeat([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1.0]], 4, axis=0)
    return Mesh(
        corners[quads.ravel()],
        normals,
        np.tile([[0.0, 0.0], [16.0, 0.0], [16.0, 16.0], [0.0, 16.0]], (6, 1)),
        np.repeat(np.arange(6, dtype=np.int32), 4),
        np.arange(24, dtype=np.int32).reshape(6, 4),
        np.empty((0, 3), np.int32),
    )


def flat_texels(heights: Sequence[float], side: int = 16) -> Texels:
    """One height for each chart."""
    charts = tuple(Chart(n, side, side) for n in range(len(heights)))
    return Texels(charts, tuple(np.full((side, side, 1), height, np.float32) for height in heights))


@pytest.mark.slow(reason="builds many models")
@pytest.mark.parametrize(
    ("surface", "amount", "mid"),
    [
        (sphere(), 0.05, 0.0),
        (sphere(), 0.2, 0.0),
        (torus(2, 0.7), 0.06, 0.0),
        (torus(2, 0.7), -0.1, 0.2),
        (vase(), 0.02, 0.0),
        (ring_cyclide(6, 2, 3), 0.3, 0.0),
        (surface_from_spec("sphere:tiling=octants"), 0.05, 0.2),
    ],
    ids=str,
)
def test_the_volume_is_as_predicted_and_the_solid_closed(surface: Surface, amount: float, mid: float) -> None:
    texels = height_map(surface, waves)
    mesh = mesh_of(surface, texels, 6000)
    found = displaced(mesh, texels, amount=amount, mid=mid, triangles=60_000)
    solid = check_solid(found.positions, found.triangles, found.before)
    assert solid.is_closed
    assert solid.manifold is not False
    assert solid.folded == 0
    assert solid.volume is not None
    assert solid.volume_before is not None
    added = predicted(surface, waves, amount, mid)
    assert solid.volume - solid.volume_before == pytest.approx(added, rel=0.02, abs=1e-3 * abs(amount))


def test_a_cube_grows_to_a_larger_cube() -> None:
    found = displaced(box_mesh(), flat_texels([1.0] * 6), amount=0.1, triangles=1000)
    solid = check_solid(found.positions, found.triangles, found.before)
    assert solid.is_closed
    assert solid.volume == pytest.approx(1.2**3, rel=1e-6)  # creases are mitred
    assert found.positions.min() == pytest.approx(-0.1)
    assert found.positions.max() == pytest.approx(1.1)
    assert len(found.triangles) == 24  # no side is longer than 16 texels; nothing else to follow


def test_lids_and_wall_of_a_cylinder_move_apart() -> None:
    surface = closed_cylinder()
    texels = height_map(surface, lambda points: np.full(points.shape[:-1], 0.5))
    found = displaced(mesh_of(surface, texels), texels, amount=0.1)
    solid = check_solid(found.positions, found.triangles, found.before)
    assert solid.is_closed
    assert solid.volume == pytest.approx(np.pi * 0.55**2 * 2.1, rel=5e-3)


def test_on_a_seam_the_height_is_the_mean_of_both_sides() -> None:
    surface = plane(2, 1)
    charts = (Chart(0, 16, 16, 0, 1, 0, 0.5), Chart(0, 16, 16, 0, 1, 0.5, 1))
    texels = Texels(charts, tuple(np.full((16, 16, 1), height, np.float32) for height in (0.2, 0.6)))
    found = displaced(tessellate(surface, charts, quads=200), texels, amount=1.0)
    x, _, z = found.positions.T
    assert np.allclose(z[x == 0], 0.4)
    assert np.allclose(z[x < 0], 0.2)
    assert np.allclose(z[x > 0], 0.6)
    assert (x == 0).sum() > 5


def test_what_is_kept_stays_to_the_bit_and_the_rest_moves() -> None:
    surface = sphere()
    texels = height_map(surface, lambda points: np.ones(points.shape[:-1]))
    mesh = mesh_of(surface, texels)
    box = kept_box(read_conditions("z<-0.5"), None)
    found = displaced(mesh, texels, amount=0.05, keep=box)
    moved = np.linalg.norm(found.positions - found.before, axis=1)
    z = found.before[:, 2]
    assert (z <= -0.5).sum() > 100
    assert (found.positions[z <= -0.5] == found.before[z <= -0.5]).all()
    assert moved[z >= -0.4] == pytest.approx(0.05, rel=2e-3)  # the triangles move by 0.05, not the vertices
    within = (z > -0.5) & (z < -0.4)
    order = np.argsort(z[within])
    assert (np.diff(moved[within][order]) > -1e-4).all()  # sets in without a step
    assert 0.01 < moved[within].mean() < 0.04
    assert check_solid(found.positions, found.triangles, found.before).is_closed


def test_the_middle_level_stays() -> None:
    surface = torus(2, 0.7)
    texels = height_map(surface, lambda points: np.full(points.shape[:-1], 0.5), dtype=np.float32)
    mesh = mesh_of(surface, texels)
    found = displaced(mesh, texels, amount=0.3, mid=0.5)
    assert (found.positions == found.before).all()
    lower, higher = (displaced(mesh, texels, amount=0.3, mid=mid) for mid in (0.75, 0.25))
    assert np.allclose(lower.positions - lower.before, higher.before - higher.positions, atol=1e-7)


def test_triangles_without_texture_stay() -> None:
    mesh = box_mesh()
    plain = replace(mesh, places=np.where(mesh.chart[:, None] == 0, 0.5, mesh.places))
    found = displaced(plain, flat_texels([1.0] * 6), amount=0.1)
    on_it = found.before[:, 0] == 0
    assert (found.positions[on_it] == found.before[on_it]).all()
    assert (found.positions[~on_it] != found.before[~on_it]).any(axis=1).all()
    assert check_solid(found.positions, found.triangles).is_closed


def test_more_triangles_follow_the_map_more_nearly() -> None:
    surface = torus(2, 0.7)
    texels = height_map(surface, lambda points: waves(3 * points), 60_000)
    mesh = mesh_of(surface, texels, 500)
    counts, errors = [], []
    for budget in (2000, 6000, 20_000):
        found = displaced(mesh, texels, amount=0.05, triangles=budget)
        counts.append(len(found.triangles))
        errors.append(found.error)
        assert budget - 3 <= len(found.triangles) <= budget
        assert check_solid(found.positions, found.triangles).is_closed
    assert errors == sorted(errors, reverse=True)
    everything = displaced(mesh, texels, amount=0.05, triangles=2_000_000)
    assert everything.error == 0
    assert counts[-1] < len(everything.triangles) < 4 * texels.count


def test_refining_changes_neither_shape_nor_corners() -> None:
    surface = vase()
    texels = height_map(surface, lambda points: waves(5 * points))
    mesh = mesh_of(surface, texels)
    base, found = plain_solid(mesh), displaced(mesh, texels, amount=0.1, triangles=40_000)
    assert (found.before[: len(base.positions)] == base.positions).all()
    assert len(found.triangles) > 2 * len(base.triangles)
    areas = [
        np.linalg.norm(np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]]), axis=1).sum()
        for p, t in ((base.positions, base.triangles), (found.before, found.triangles))
    ]
    assert areas[0] == pytest.approx(areas[1], rel=1e-9)


def least_angle(positions: np.ndarray, triangles: np.ndarray) -> float:
    points = positions[triangles]
    ahead, back = np.roll(points, -1, axis=1) - points, np.roll(points, 1, axis=1) - points
    cosine = (ahead * back).sum(axis=2) / np.linalg.norm(ahead, axis=2) / np.linalg.norm(back, axis=2)
    return float(np.degrees(np.arccos(cosine.max())))


def test_triangles_keep_their_shape() -> None:
    texels = flat_texels([0.0] * 6, 64)
    texels.arrays[0][::2, ::3] = 1  # a grain that is never followed
    base, found = (displaced(box_mesh(), texels, amount=0.1, triangles=budget) for budget in (12, 30_000))
    assert len(found.triangles) > 1000
    assert least_angle(found.before, found.triangles) > least_angle(base.before, base.triangles) / 2.001


@pytest.mark.parametrize(("most", "seed"), [(40, 1), (71, 2)])
def test_refining_is_what_the_plain_form_does(most: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh = box_mesh()
    # No two edges of a length, in space or on charts: the order of equals is the kernel's own.
    stretched = replace(
        mesh,
        positions=mesh.positions @ np.array([[1, 0.1, 0], [0, 1.31, 0.2], [0.07, 0, 0.93]]),
        places=mesh.places * rng.uniform(0.8, 1.0, (6, 2))[mesh.chart],
    )
    texels = flat_texels([0.0] * 6)
    for array in texels.arrays:
        array[:] = rng.random(array.shape)
    found = displaced(stretched, texels, amount=0.5, triangles=most, tolerance=0.02)
    base = plain_solid(stretched)
    split = stretched.all_triangles()
    plain = PlainMesh(
        base.positions,
        [
            [(int(v), tuple(stretched.places[w])) for v, w in zip(corners, own, strict=True)]
            for corners, own in zip(base.triangles, split, strict=True)
        ],
        stretched.chart[split[:, 0]].tolist(),
    )
    step = height_levels(texels, most)[2]
    values = [block_means(array[:, :, 0], step) for array in texels.arrays]
    error = plain.refine(values, 0.5, 0.02, most, step)
    assert found.error == pytest.approx(error, rel=1e-5)
    assert np.allclose(found.before, plain.positions)
    made = {tuple(sorted(row)) for row in found.triangles.tolist()}
    assert made == {tuple(sorted(v for v, _ in corners)) for corners in plain.triangles.values()}


def test_levels_are_means_over_squares() -> None:
    rng = np.random.default_rng(5)
    arrays = tuple(rng.integers(0, 65536, (h, w, 1), np.uint16) for h, w in ((37, 50), (16, 300)))
    texels = Texels(tuple(Chart(n, *a.shape[:2]) for n, a in enumerate(arrays)), arrays)
    for triangles, expected in ((10_000, 1), (200, 4)):
        values, table, step = height_levels(texels, triangles)
        assert step == expected
        for chart, array in enumerate(arrays):
            for level, (first, height, width) in enumerate(table[chart, :2].tolist()):
                own = values[first : first + height * width].reshape(height, width)
                whole = array[: array.shape[0] // (step << level) * (step << level), :, 0] / 65535
                means = block_means(whole, step << level)
                inner = means.shape[0], array.shape[1] // (step << level)
                assert np.allclose(own[: inner[0], : inner[1]], means[:, : inner[1]], atol=1e-5)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_heights_are_of_any_depth_and_colours_count_by_luminance(dtype: type) -> None:
    top = 1 if dtype == np.float32 else np.iinfo(dtype).max
    assert height_values(np.full((2, 3, 1), top, dtype)) == pytest.approx(1)
    assert height_values(np.full((2, 3, 4), top, dtype)) == pytest.approx(1)
    green, blue = (np.array([[[0, *part]]], dtype) for part in ((top, 0), (0, top)))
    assert height_values(green)[0, 0] == pytest.approx(0.7152, abs=1e-4)
    assert height_values(blue)[0, 0] == pytest.approx(0.0722, abs=1e-4)


def test_vertices_show_the_map_where_it_is_followed() -> None:
    surface = plane(4, 4)
    chart = Chart(0, 64, 64)
    y, x = np.mgrid[0:64, 0:64] / 64
    heights = (0.5 + 0.5 * np.sin(9 * x) * np.cos(7 * y)).astype(np.float32)
    texels = Texels((chart,), (heights[:, :, None],))
    found = displaced(tessellate(surface, (chart,), quads=20), texels, amount=0.3)
    assert found.error == 0
    column, row = (found.before[:, 0] + 2) * 16, (2 - found.before[:, 1]) * 16
    expected = [bilinear(heights, r, c) for r, c in zip(row, column, strict=True)]
    assert np.abs(found.positions[:, 2] / 0.3 - expected).max() < 0.03


def test_an_open_surface_is_reported_and_stays_in_one_piece() -> None:
    surface = plane()
    texels = height_map(surface, waves, 5000)
    found = displaced(mesh_of(surface, texels, 100), texels, amount=0.1, triangles=5000)
    solid = check_solid(found.positions, found.triangles)
    assert not solid.is_closed
    assert (solid.crowded, solid.turned) == (0, 0)
    on_border = np.abs(found.before[:, :2]).max(axis=1) == 0.5
    assert solid.borders == on_border.sum()  # every other edge has two triangles


def test_triangles_that_share_an_edge_by_threes_stay_together() -> None:
    corners = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0.5], [-1, 0.5, 0.5], [-1, -0.5, 0.5]], float)
    triangles = np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4]], np.int32)
    places = np.array([[0, 0], [16, 0], [8, 16], [8, 16], [8, 16]], float)
    mesh = Mesh(
        corners, np.ones((5, 3)), places, np.zeros(5, np.int32), np.empty((0, 4), np.int32), triangles
    )
    texels = flat_texels([0.0])
    texels.arrays[0][:, :] = np.random.default_rng(1).random((16, 16, 1))
    found = displaced(mesh, texels, amount=1e-3, triangles=300)
    solid = check_solid(found.positions, found.triangles)
    along = (found.before[:, :2] == 0).all(axis=1)
    assert along.sum() > 3
    assert solid.crowded == along.sum() - 1


def test_the_same_input_gives_the_same_bits() -> None:
    surface = torus(2, 0.7)
    texels = height_map(surface, waves)
    mesh = mesh_of(surface, texels)
    one, two = (displaced(mesh, texels, amount=0.1, triangles=20_000) for _ in range(2))
    assert one.positions.tobytes() == two.positions.tobytes()
    assert one.triangles.tobytes() == two.triangles.tobytes()


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        ({"amount": np.nan}, "displace is nan; allowed: a finite number"),
        ({"mid": 1.5}, "mid_level is 1.5; allowed: 0 to 1"),
        ({"triangles": 11}, "triangles is 11; allowed: at least 12, which the model has"),
        ({"triangles": 9_000_000}, "triangles is 9000000; allowed: 1 to 8000000"),
    ],
)
def test_wrong_numbers_are_refused(choices: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        displaced(box_mesh(), flat_texels([1.0] * 6), **{"amount": 0.1} | choices)  # type: ignore[arg-type]


def test_conditions_make_a_box() -> None:
    box = kept_box(read_conditions("z<1mm and x >= -2 and z<=3mm and X<5"), 0.001)
    assert box.tolist() == [[-2, -np.inf, -np.inf], [5, np.inf, 1]]
    with pytest.raises(InputError, match="keep's conditions on y hold nowhere together"):
        kept_box(read_conditions("y<1 and y>2"), None)
    with pytest.raises(InputError, match="keep's bound is '1mm', and this model does not state"):
        kept_box(read_conditions("z<1mm"), None)


def test_in_a_concave_corner_nothing_folds_over() -> None:
    # An L: two arms of length 2 and width 1, extruded by 1.
    outline = np.array([[0.0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]])
    sides = [[*outline[k], 0.0, *outline[(k + 1) % 6], 1.0] for k in range(6)]
    quads = [[[x, y, z], [u, v, z], [u, v, w], [x, y, w]] for x, y, z, u, v, w in sides]
    for z, turn in ((0.0, -1), (1.0, 1)):
        quads += [[[*outline[k], z] for k in part[::turn]] for part in ([0, 1, 2, 3], [0, 3, 4, 5])]
    positions = np.array(quads).reshape(-1, 3)
    mesh = Mesh(
        positions,
        np.ones_like(positions),
        np.tile([[0.0, 0], [0, 32], [32, 32], [32, 0]], (10, 1)),
        np.repeat(np.arange(10, dtype=np.int32), 4),
        np.arange(40, dtype=np.int32).reshape(10, 4),
        np.empty((0, 3), np.int32),
    )
    texels = flat_texels([0.0] * 10, 32)
    rng = np.random.default_rng(7)
    for array in texels.arrays:
        array[:] = 0.5 + 0.5 * rng.random(array.shape)
    found = displaced(mesh, texels, amount=0.3, triangles=20_000)
    solid = check_solid(found.positions, found.triangles, found.before)
    assert solid.is_closed
    assert solid.folded == 0
    assert 0 < found.held < len(found.positions) / 2
    x, y, z = found.before.T
    far = (x == 2) & (y > 0.3) & (y < 0.7) & (z > 0.3) & (z < 0.7)
    assert (found.positions[far, 0] - 2 > 0.14).all()
