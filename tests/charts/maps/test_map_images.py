"""Images as maps: where they lie, between pixels, labels, clear pixels."""

import os
from dataclasses import replace

import numpy as np
import pytest
from grounds import at_steps, map_values, on_flat, on_mesh, on_patches, steps_of
from meshes import height_field

from upholster.base.errors import InputError
from upholster.charts.maps.map_text import parse_map
from upholster.geometry.built_in.cyclide import torus
from upholster.image.files.write import write_image
from upholster.runtime.stages import Stages


def written(path, pixels: np.ndarray) -> str:
    write_image(path, pixels)
    return str(path)


def random_image(height: int, width: int, channels: int, dtype: type = np.uint8) -> np.ndarray:
    most = np.iinfo(dtype).max
    return np.random.default_rng(5).integers(0, most, (height, width, channels), dtype, endpoint=True)


def between(grey: np.ndarray, rows: np.ndarray, columns: np.ndarray, mode: str) -> np.ndarray:
    """Return values between the pixels' middles, by NumPy's way to go on beyond the border."""
    padded = np.pad(grey, 2, mode=mode)
    r, c = rows - 0.5 + 2, columns - 0.5 + 2
    i, j = np.floor(r).astype(int), np.floor(c).astype(int)
    y, x = r - i, c - j
    upper = (1 - x) * padded[i, j] + x * padded[i, j + 1]
    lower = (1 - x) * padded[i + 1, j] + x * padded[i + 1, j + 1]
    return (1 - y) * upper + y * lower


@pytest.mark.parametrize("tile", [False, True])
def test_an_image_lies_over_a_flat_texture_from_corner_to_corner(tmp_path, tile: bool) -> None:
    pixels = random_image(6, 8, 3)
    name, ground = written(tmp_path / "map.png", pixels), on_flat(30, 40, tile=tile)
    rows, columns = np.indices((30, 40)) + 0.5
    wanted = between(pixels.mean(axis=2) / 255, rows / 5, columns / 5, "wrap" if tile else "edge")
    np.testing.assert_allclose(parse_map(name).values(ground)[0], wanted, atol=1e-6)
    coded = parse_map(name).codes(ground)[0]
    hexed = pixels.astype(int) @ (1 << 16, 1 << 8, 1)
    np.testing.assert_array_equal(coded, hexed.repeat(5, axis=0).repeat(5, axis=1))
    np.testing.assert_array_equal(parse_map(f"1-{name}").codes(ground)[0], 0xFFFFFF - coded)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_samples_are_plain_numbers_at_any_depth(tmp_path, dtype: type) -> None:
    pixels = random_image(30, 40, 1, dtype)
    found = parse_map(written(tmp_path / "map.png", pixels)).values(on_flat(30, 40))[0]
    np.testing.assert_allclose(found, pixels[..., 0] / np.iinfo(dtype).max, atol=1e-6)


def test_floats_are_cut_to_the_range(tmp_path) -> None:
    pixels = np.linspace(-1, 2, 1200, dtype=np.float32).reshape(30, 40, 1)
    name = written(tmp_path / "map.exr", pixels)
    found = parse_map(name).values(on_flat(30, 40))[0]
    np.testing.assert_allclose(found, pixels[..., 0].clip(0, 1), atol=1e-3)
    grey = np.rint(pixels[..., 0].clip(0, 1) * 255).astype(int)
    assert np.abs(parse_map(name).codes(on_flat(30, 40))[0] - grey * 0x010101).max() <= 0x010101


def test_nothing_is_asked_where_an_image_is_clear(tmp_path) -> None:
    pixels = random_image(30, 40, 4)
    pixels[..., 3] = np.where(pixels[..., 3] < 128, 0, pixels[..., 3])
    name, clear = written(tmp_path / "map.png", pixels), pixels[..., 3] == 0
    values, codes = (getattr(parse_map(name), kind)(on_flat(30, 40))[0] for kind in ("values", "codes"))
    np.testing.assert_array_equal(np.isnan(values), clear)
    np.testing.assert_array_equal(codes == -1, clear)
    np.testing.assert_array_equal(np.isnan(parse_map(f"1-{name}>0.5").values(on_flat(30, 40))[0]), clear)
    fine = parse_map(name).values(on_flat(120, 160))[0]
    assert np.nanmin(fine) >= pixels[..., :3].mean(axis=2)[~clear].min() / 255 - 1e-6


def test_on_patches_an_image_lies_over_each_face(tmp_path) -> None:
    ramp = np.zeros((64, 64, 3), np.uint8)
    ramp[..., 0] = np.arange(64) * 4
    ramp[..., 1] = np.arange(64)[:, None] * 4
    ground = on_patches(torus(2.0, 0.8))
    codes = parse_map(written(tmp_path / "map.png", ramp)).codes(ground)
    for chart, found in zip(ground.charted.charts, codes, strict=True):
        face = ground.surface.faces[chart.face]
        down, right = np.indices(found.shape) + 0.5
        s = (chart.s0 + (chart.s1 - chart.s0) * down / chart.height) / face.rows
        t = (chart.t0 + (chart.t1 - chart.t0) * right / chart.width) / face.columns
        np.testing.assert_array_equal(found >> 16, np.floor(t * 64) * 4)
        np.testing.assert_array_equal(found >> 8 & 255, np.floor(s * 64) * 4)


def test_on_a_mesh_an_image_lies_by_texture_coordinates_and_repeats(tmp_path) -> None:
    pixels = random_image(7, 9, 3)
    mesh = height_field(6, 0.2)
    uv = mesh.corners[..., :2] * (2.2, 1.7) - (0.4, 0.9)
    uv[:10] = np.nan
    ground = on_mesh(replace(mesh, uv=np.nan_to_num(uv)))
    ground = replace(ground, model=replace(ground.model, uv=uv))
    name = written(tmp_path / "map.png", pixels)
    u, v = at_steps(uv, ground).T
    known = np.isfinite(u)
    assert known.any()
    assert not known.all()
    found = map_values(name, ground)
    wanted = between(np.tile(pixels.mean(axis=2) / 255, (5, 5)), v[known] * 7 + 14, u[known] * 9 + 18, "wrap")
    np.testing.assert_allclose(found[known], wanted, atol=1e-5)
    assert np.isnan(found[~known]).all()


def test_a_model_without_texture_coordinates_is_reported(tmp_path) -> None:
    name = written(tmp_path / "map.png", random_image(4, 4, 3))
    with pytest.raises(InputError, match="this model has no texture coordinates"):
        parse_map(name).values(on_mesh(height_field(3)))


def test_a_file_that_is_missing_or_no_image_is_reported(tmp_path) -> None:
    with pytest.raises(InputError, match=r"missing\.png"):
        parse_map(str(tmp_path / "missing.png")).values(on_flat())
    (tmp_path / "broken.png").write_bytes(b"no image")
    with pytest.raises(InputError, match=r"broken\.png"):
        parse_map(str(tmp_path / "broken.png")).codes(on_flat())


def test_a_file_that_has_changed_is_read_again(tmp_path) -> None:
    ground, wanted = on_flat(), parse_map(str(tmp_path / "map.png"))
    with Stages().active():
        for grey in (10, 200):
            written(tmp_path / "map.png", np.full((4, 4, 1), grey, np.uint8))
            os.utime(tmp_path / "map.png", (grey, grey))
            np.testing.assert_allclose(wanted.values(ground)[0], grey / 255, atol=1e-6)


def test_every_step_of_a_flat_texture_is_on_it() -> None:
    assert len(steps_of(on_flat(5, 7).charted)[0][0]) > 20
    assert not np.isnan(parse_map("height").values(on_flat(5, 7))[0]).any()


def test_colours_of_vertices_are_means_between_them() -> None:
    mesh = height_field(4)
    colors = np.random.default_rng(2).random((len(mesh.triangles), 3, 3)).astype(np.float32)
    colors[:3] = np.nan
    ground = on_mesh(mesh, colors=colors)
    grey = at_steps(colors.mean(axis=2, keepdims=True), ground)[:, 0]
    np.testing.assert_allclose(map_values("colors", ground), grey, atol=1e-6)
    assert np.isnan(grey).any()
    hexed = np.nan_to_num(np.rint(colors * 255)).astype(int) @ (1 << 16, 1 << 8, 1)
    hexed[:3] = -1
    codes = parse_map("colors").codes(ground)
    for code, chart, (rows, columns, triangles, _) in zip(
        codes, ground.charted.charts, steps_of(ground.charted), strict=True
    ):
        middles = np.stack([rows, columns], axis=1)[:, None] + 0.5
        away = np.linalg.norm(ground.charted.places[triangles] - middles, axis=2)
        np.testing.assert_array_equal(code[rows, columns], hexed[triangles, away.argmin(axis=1)])
        assert code.shape == (chart.height, chart.width)
    with pytest.raises(InputError, match="this surface has no colours"):
        parse_map("colors").values(on_mesh(mesh))
