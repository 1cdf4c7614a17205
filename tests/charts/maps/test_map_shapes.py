"""Maps of place, normal and part on flat textures, patches and meshes; comparisons, labels, regions."""

from dataclasses import replace

import numpy as np
import pytest
from grounds import at_steps, map_values, on_flat, on_mesh, on_patches, steps_of
from meshes import box, sphere

from upholster.base.errors import InputError
from upholster.charts.maps.map_text import parse_map
from upholster.charts.maps.surface_map import region
from upholster.geometry.built_in.cyclide import torus
from upholster.runtime.parallel import running
from upholster.runtime.stages import Stages


@pytest.fixture(scope="module")
def cube():
    mesh = box((2.0, 2.0, 2.0), 2)
    part = (mesh.flat_normals[:, 2] > 0.5).astype(np.int32)
    return on_mesh(replace(mesh, part=part, parts=("sides", "Lid"), metres=0.01))


@pytest.fixture(scope="module")
def ball():
    return on_mesh(sphere(8))


def test_values_are_there_on_the_surface_and_right_beside_it_alone(ball) -> None:
    values = parse_map("height").values(ball)
    for found, chart, steps in zip(values, ball.charted.charts, steps_of(ball.charted), strict=True):
        assert found.shape == (chart.height, chart.width)
        assert found.dtype == np.float32
        on = np.zeros(found.shape, bool)
        on[steps[0], steps[1]] = True
        assert np.isfinite(found[on]).all()
        near = np.zeros(found.shape, bool)
        for down in (-2, -1, 0, 1, 2):
            for right in (-2, -1, 0, 1, 2):
                near |= np.roll(on, (down, right), (0, 1))  # charts have margins
        assert np.isnan(found[~near]).all()


def test_height_goes_from_the_lowest_to_the_highest_point(ball) -> None:
    z = at_steps(ball.charted.mesh.corners, ball)[:, 2]
    low, high = ball.charted.mesh.box[:, 2]
    np.testing.assert_allclose(map_values("height", ball), (z - low) / (high - low), atol=1e-6)


def test_parts_that_are_left_plain_have_no_values(cube) -> None:
    chart = np.where(cube.charted.mesh.part == 0, -1, cube.charted.chart).astype(np.int32)
    ground = replace(cube, charted=replace(cube.charted, chart=chart))
    assert np.unique(map_values("facing:z", ground)).tolist() == [1]  # the lid's steps
    count = sum(int(np.isfinite(values).sum()) for values in parse_map("facing:z").values(ground))
    assert 40 * 40 <= count <= 42 * 42  # 2 by 2 units of 20 steps, and those right beside


def test_what_is_level_has_height_nought() -> None:
    assert (parse_map("height").values(on_flat())[0] == 0).all()


@pytest.mark.slow(reason="casts rays over surfaces")
def test_slope_and_facing_follow_the_normal_of_a_torus() -> None:
    ground = on_patches(torus(2.0, 0.8))
    x, y, z = at_steps(ground.charted.mesh.corners, ground).T
    beyond = np.hypot(x, y) - 2.0
    normal = np.stack([x / np.hypot(x, y) * beyond, y / np.hypot(x, y) * beyond, z]).T
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    np.testing.assert_allclose(map_values("slope", ground), np.sqrt(1 - normal[:, 2] ** 2), atol=0.02)
    np.testing.assert_allclose(map_values("facing:z", ground), (1 + normal[:, 2]) / 2, atol=0.01)
    np.testing.assert_allclose(map_values("facing:-z", ground), (1 - normal[:, 2]) / 2, atol=0.01)
    towards = normal @ np.array([3.0, 0, 4.0]) / 5
    np.testing.assert_allclose(map_values("facing:3,0,4", ground), (1 + towards) / 2, atol=0.01)


def test_sides_of_a_cube_are_upright_and_its_lid_is_level(cube) -> None:
    normal = cube.charted.mesh.flat_normals[np.concatenate([t for *_, t, _ in steps_of(cube.charted)])]
    np.testing.assert_allclose(map_values("slope", cube), np.abs(normal[:, 2]) < 0.5, atol=1e-6)
    np.testing.assert_allclose(map_values("facing:x", cube), (1 + normal[:, 0]) / 2, atol=1e-6)


def test_parts_are_chosen_by_patterns(cube) -> None:
    top = (
        cube.charted.mesh.flat_normals[np.concatenate([t for *_, t, _ in steps_of(cube.charted)])][:, 2] > 0.5
    )
    np.testing.assert_array_equal(map_values("part:lid", cube), top)
    np.testing.assert_array_equal(map_values("1-part:sides", cube), top)
    assert (map_values("part:*", cube) == 1).all()
    with pytest.raises(InputError, match="no part is called 'leg'; allowed: sides, Lid"):
        parse_map("part:leg").values(cube)
    with pytest.raises(InputError, match="is for models"):
        parse_map("part:leg").values(on_flat())


def test_a_ball_has_all_steps_that_are_near_enough(cube) -> None:
    away = np.linalg.norm(at_steps(cube.charted.mesh.corners, cube) - (2, 1, 1.5), axis=1)
    found = map_values("2,1,1.5:0.7", cube)
    sure = np.abs(away - 0.7) > 1e-6
    np.testing.assert_array_equal(found[sure], away[sure] <= 0.7)
    np.testing.assert_array_equal(map_values("2,1,1.5:7mm", cube), found)  # its unit is a centimetre
    with pytest.raises(InputError, match="radius of a map is '7mm', and this model does not state"):
        parse_map("2,1,1.5:7mm").values(on_flat())


def test_inverted_and_compared_maps(ball) -> None:
    plain = map_values("height", ball)
    np.testing.assert_array_equal(map_values("1-height", ball), 1 - plain)
    np.testing.assert_array_equal(map_values("height>0.25", ball), plain > np.float32(0.25))
    np.testing.assert_array_equal(map_values("height<0.25", ball), plain < np.float32(0.25))
    np.testing.assert_array_equal(map_values("1-height>0.25", ball), 1 - plain > np.float32(0.25))


def test_maps_joined_by_and_are_the_least_of_their_values(ball) -> None:
    plain = [map_values(text, ball) for text in ("1-height", "slope>0.5", "facing:x")]
    joined = map_values("1-height and slope>0.5 and facing:x", ball)
    np.testing.assert_array_equal(joined, np.minimum(plain[0], np.minimum(plain[1], plain[2])))
    both = parse_map("height>0.3 and slope<0.5")
    for joined, a, b in zip(
        region(both, ball),
        region(parse_map("height>0.3"), ball),
        region(parse_map("slope<0.5"), ball),
        strict=True,
    ):
        np.testing.assert_array_equal(joined, a & b)
    with pytest.raises(InputError, match=r"map 'height and slope' has no labels; .* such as height>0.5"):
        parse_map("height and slope").codes(ball)


def test_regions_and_labels_are_those_of_the_values(ball) -> None:
    for text in ("height>0.3", "1-0,0,1:0.5", "slope<0.5", "slope<0.5 and height>0.3"):
        wanted = parse_map(text)
        values, codes, inside = wanted.values(ball), wanted.codes(ball), region(wanted, ball)
        for value, code, one in zip(values, codes, inside, strict=True):
            np.testing.assert_array_equal(one, np.nan_to_num(value) > 0.5)
            np.testing.assert_array_equal(
                code, np.where(np.isnan(value), -1, np.where(value > 0, 0xFFFFFF, 0))
            )
            assert code.dtype == np.int32
    with pytest.raises(InputError, match="map 'height' has no labels; allowed: an image"):
        parse_map("height").codes(ball)


def test_values_are_the_same_for_any_number_of_threads(ball) -> None:
    for text in ("height", "facing:1,2,3"):
        once = parse_map(text).values(ball)
        with running(3):
            other = parse_map(text).values(ball)
        for a, b in zip(once, other, strict=True):
            np.testing.assert_array_equal(a, b)


def test_values_are_kept_where_stages_are(ball) -> None:
    with Stages().active():
        assert parse_map("slope").values(ball) is parse_map("slope").values(ball)
        assert parse_map("slope").values(ball) is not parse_map("1-slope").values(ball)


def test_what_rays_find_is_kept_for_every_comparison(ball) -> None:
    stages = Stages()
    with stages.active():
        for text in ("curvature", "curvature>0.5", "1-curvature<0.3", "curvature>0.7"):
            parse_map(text).values(ball)
    assert [ran.name for ran in stages.ran].count("_source_values") == 1
