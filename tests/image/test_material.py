"""Materials: which file is which map, sizes, conventions, packed maps, and what matching sees."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.image.files.material import MATCH_WEIGHTS, Material
from upholster.image.files.material_files import read_material
from upholster.image.files.write import write_image
from upholster.image.roles import role_of

SIZE = (48, 64)


def image(seed: int, channels: int = 3, size: Any = SIZE, dtype: Any = np.uint8) -> Any:
    top = np.iinfo(dtype).max
    return np.random.default_rng(seed).integers(0, top + 1, (*size, channels)).astype(dtype)


def folder(path: Path, **files: Any) -> Path:
    for name, pixels in files.items():
        write_image(path / f"{name}.png", pixels)
    return path


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("albedo", "albedo"),
        ("brick_wall_diff_4k", "albedo"),
        ("Bricks102_2K-JPG_Color", "albedo"),
        ("Rock_BaseColor", "albedo"),
        ("rough_wood_col_1k", "albedo"),
        ("Rock_COL_2K", "albedo"),
        ("brick_wall_nor_gl_1k", "normal_gl"),
        ("Bricks102_1K-PNG_NormalGL", "normal_gl"),
        ("wall-normal", "normal"),
        ("Bricks102_1K-PNG_NormalDX", "normal_dx"),
        ("brick_wall_nor_dx_8k", "normal_dx"),
        ("rusty_metal_rough_2k", "roughness"),
        ("Metal046_Metalness", "metallic"),
        ("metal_plate_metal_1k", "metallic"),
        ("Bricks102_AmbientOcclusion", "ao"),
        ("wall ao", "ao"),
        ("wall.occlusion", "ao"),
        ("rock_disp_16bit", "height"),
        ("Bricks102_8K_Displacement", "height"),
        ("fence_Opacity", "opacity"),
        ("lava_Emissive", "emission"),
        ("brick_arm_1k", "ao+roughness+metallic"),
        ("Bricks_OcclusionRoughnessMetallic", "ao+roughness+metallic"),
        ("brick_arm_ao_rough_metal", "ao+roughness+metallic"),
        ("T_Brick_ORM", "ao+roughness+metallic"),
        ("brick_RMA_2K", "roughness+metallic+ao"),
        ("brick_MRA", "metallic+roughness+ao"),
        ("brick_MRAO", "metallic+roughness+ao"),
        ("brick_ORMH", "ao+roughness+metallic+height"),
        ("x_2K_ORDp", "ao+roughness+height"),
        ("brick_metallicRoughness", "+roughness+metallic"),
        ("Brick_MaskMap", "metallic+ao++gloss"),
        ("rusty_metal_roughness", "roughness"),
        ("T_Brick_D", "albedo"),
        ("T_Brick_N", "normal_dx"),
        ("brick_n", "normal"),
        ("brick_Cavity", "left out"),
        ("brick_4K_Specular", "left out"),
        ("storm", None),
        ("d", None),
        ("paint_gloss", "gloss"),
        ("Bricks102", None),
        ("rusty_metal053C", None),
        ("normal_wall", None),
        ("2k", None),
        ("", None),
    ],
)
def test_names_tell_roles(name: str, role: Any) -> None:
    assert role_of(name) == role


def test_a_folder_is_read(tmp_path: Path) -> None:
    files = {
        "Wall_1K-PNG_Color": image(0),
        "Wall_1K-PNG_NormalGL": image(1),
        "Wall_1K-PNG_NormalDX": image(2),
        "Wall_1K-PNG_Roughness": image(3, 1, dtype=np.uint16),
        "Wall": image(4),  # a preview
    }
    folder(tmp_path, **files)
    (tmp_path / "Wall.mtlx").write_text("no image")
    material = read_material(tmp_path)
    assert list(material.maps) == ["albedo", "normal", "roughness"]
    assert material.shape == SIZE
    np.testing.assert_array_equal(material.maps["albedo"], files["Wall_1K-PNG_Color"])
    np.testing.assert_array_equal(material.maps["normal"], files["Wall_1K-PNG_NormalGL"])
    np.testing.assert_array_equal(material.maps["roughness"], files["Wall_1K-PNG_Roughness"])
    assert not material.maps["albedo"].flags.writeable
    same = read_material([tmp_path / "Wall_1K-PNG_Color.png", tmp_path / "Wall_1K-PNG_NormalGL.png"])
    np.testing.assert_array_equal(same.maps["normal"], files["Wall_1K-PNG_NormalGL"])
    named = read_material({"albedo": tmp_path / "Wall.png", "Rough": tmp_path / "Wall_1K-PNG_Roughness.png"})
    np.testing.assert_array_equal(named.maps["albedo"], files["Wall"])
    assert list(named.maps) == ["albedo", "roughness"]


def test_other_conventions_are_brought_to_one(tmp_path: Path) -> None:
    files = {
        "x_albedo": image(0, 4),
        "x_normal_dx": image(1, dtype=np.uint16),
        "x_gloss": image(2, 1),
        "x_arm": image(3),
        "x_metallic": np.repeat(image(4, 1), 3, axis=2),
    }
    maps = read_material(folder(tmp_path, **files)).maps
    normal = files["x_normal_dx"]
    np.testing.assert_array_equal(maps["normal"][:, :, 1], 65535 - normal[:, :, 1])
    np.testing.assert_array_equal(maps["normal"][:, :, ::2], normal[:, :, ::2])
    np.testing.assert_array_equal(maps["roughness"], 255 - files["x_gloss"])
    np.testing.assert_array_equal(maps["ao"], files["x_arm"][:, :, :1])
    np.testing.assert_array_equal(maps["metallic"], files["x_metallic"][:, :, :1])  # before the packed one
    assert maps["albedo"].shape[2] == 4


def test_multiples_and_fractions_are_resampled_as_the_data_they_are(tmp_path: Path) -> None:
    rows = np.linspace(20, 230, 96).round().astype(np.uint8)[:, None, None] * np.ones((1, 128, 1), np.uint8)
    tilted = np.broadcast_to(np.array([200, 128, 220], np.uint8), (24, 32, 3))
    files = {"x_albedo": image(0), "x_height": rows, "x_normal": np.ascontiguousarray(tilted)}
    maps = read_material(folder(tmp_path, **files)).maps
    assert maps["height"].shape == (*SIZE, 1)
    assert maps["normal"].shape == (*SIZE, 3)
    # Means of pairs, which light would bend: no sRGB curve is involved.
    pairs = rows.reshape(48, 2, 64, 2).mean(axis=(1, 3))
    assert np.abs(maps["height"][2:-2, :, 0].astype(float) - pairs[2:-2]).max() <= 1
    vectors = maps["normal"] / 127.5 - 1
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=2), 1, atol=0.01)
    whole = read_material(tmp_path, crop=(8, 4, 40, 40), resize=32).maps
    assert {part.shape[:2] for part in whole.values()} == {(32, 32)}


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ({"x_normal": image(0)}, "material has no albedo; it has: normal"),
        ({}, "material has no albedo; it has: no maps"),
        ({"x_albedo": image(0), "x_color": image(1)}, "two files of role 'albedo': 'x_albedo.png' and"),
        ({"x_albedo": image(0), "x_orm": image(1), "x_mra": image(2)}, "two files of role '.*': .* 'x_orm"),
        ({"x_albedo": image(0), "x_orm": image(1, 1)}, "packed 'x_orm.png' has 1 channels; allowed: RGB"),
        ({"x_albedo": image(0), "x_maskmap": image(1)}, "has 3 channels; allowed: RGB and alpha"),
        ({"x_albedo": image(0), "x_shine": image(1)}, "role of 'x_shine.png' is unknown; .*known: albedo"),
        ({"x_albedo": image(0), "x_ao": image(1, 1, (40, 64))}, "ao is 64x40 pixels; allowed: 64x48 as"),
        ({"x_albedo": image(0), "x_ao": image(1, 1, (72, 96))}, "ao is 96x72 pixels"),
        (
            {"x_albedo": image(0), "x_normal": image(1, 1)},
            "normal 'x_normal.png' has 1 channels; allowed: RGB",
        ),
        ({"x_albedo": image(0, size=(16, 16))}, "albedo: sample is 16x16 pixels; allowed: 32x32 or more"),
    ],
)
def test_what_is_no_material_is_refused(tmp_path: Path, files: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read_material(folder(tmp_path, **files))


def test_places_and_roles_that_do_not_exist_are_refused(tmp_path: Path) -> None:
    write_image(tmp_path / "x.png", image(0))
    for source, options, said in (
        (tmp_path / "nowhere", {}, "is neither a folder"),
        ({"shine": tmp_path / "x.png"}, {}, "role 'shine' is unknown"),
        ({"albedo": tmp_path / "x.png", "color": tmp_path / "x.png"}, {}, "two files of role 'albedo'"),
        ({"albedo": tmp_path / "y.png"}, {}, "does not exist"),
        ({"albedo": tmp_path / "x.png"}, {"crop": (0, 0, 99, 9)}, "crop is 0,0,99,9; allowed"),
        ({"albedo": tmp_path / "x.png"}, {"resize": 8}, "resize is 8; allowed: 32 to 4096"),
    ):
        with pytest.raises(InputError, match=said):
            read_material(source, **options)


def test_colour_takes_the_opacity_map_as_alpha() -> None:
    albedo, opacity = image(0, 4), image(1, 1, dtype=np.uint16)
    material = Material({"albedo": albedo, "opacity": opacity})
    color = material.color()
    np.testing.assert_array_equal(color[:, :, :3], albedo[:, :, :3])
    np.testing.assert_array_equal(color[:, :, 3:], np.rint(opacity / 257).astype(np.uint8))
    assert Material({"albedo": albedo}).color() is not None
    assert albedo.flags.writeable  # the caller's own


def with_alpha(seed: int) -> Any:
    pixels = image(seed, 4)
    pixels[..., 3] = 255
    pixels[: len(pixels) // 2, :, 3] = 0
    return pixels


def test_colours_with_alpha_next_to_colours_are_the_opacity(tmp_path: Path) -> None:
    both = with_alpha(1)
    files = {"leaf-color": image(2), "leaf-diffuse-alpha": both}
    material = read_material(folder(tmp_path, **files))
    np.testing.assert_array_equal(material.maps["albedo"], files["leaf-color"])
    np.testing.assert_array_equal(material.maps["opacity"], both[..., 3:])
    assert any("has an alpha, which is read as the opacity" in note for note in material.notes)


@pytest.mark.parametrize("name", ["leaf-diffuse-alpha", "leaf_BaseColorOpacity_2k"])
def test_colours_with_alpha_alone_are_the_albedo(tmp_path: Path, name: str) -> None:
    both = with_alpha(1)
    material = read_material(folder(tmp_path, **{name: both, "leaf-roughness": image(2, 1)}))
    np.testing.assert_array_equal(material.maps["albedo"], both)
    assert "opacity" not in material.maps


def test_a_grey_opacity_map_with_an_opaque_alpha_is_read_by_its_grey(tmp_path: Path) -> None:
    grey = image(1, 1)
    opaque = np.full_like(grey, 255)
    files = {"leaf_color": image(2), "leaf_opacity": np.concatenate([grey, opaque], axis=2)}
    material = read_material(folder(tmp_path, **files))
    np.testing.assert_array_equal(material.maps["opacity"], grey)


def test_large_maps_are_reduced_alike_with_a_note(tmp_path: Path) -> None:
    size = (33, 4100)
    files = {"wall_color": image(1, 3, size), "wall_roughness": image(2, 1, size)}
    material = read_material(folder(tmp_path, **files))
    assert material.shape == (33, 4096)
    assert {pixels.shape[:2] for pixels in material.maps.values()} == {(33, 4096)}
    assert "4100x33 pixels and was reduced to 4096x33" in material.notes[-1]


def test_matching_sees_all_maps_by_their_weights() -> None:
    maps = {"albedo": image(0), "normal": image(1, dtype=np.uint16), "height": image(2, 1), "ao": image(3, 1)}
    material = Material(maps)
    seen = material.matched()
    assert seen.dtype == np.uint16
    assert seen.shape == (*SIZE, 3 + 2 + 1)  # ao does not count
    np.testing.assert_array_equal(seen[:, :, :3], maps["albedo"] * np.uint16(257))
    share = MATCH_WEIGHTS["normal"] ** 0.5
    step = seen[1:, :, 3].astype(float) - seen[:-1, :, 3]
    own = maps["normal"][1:, :, 0].astype(float) - maps["normal"][:-1, :, 0]
    np.testing.assert_allclose(step, share * own, atol=1)
    louder = material.matched({"height": 4, "normal": 0})
    assert louder.shape[2] == 4
    np.testing.assert_allclose(np.ptp(louder[:, :, 3]) / np.ptp(louder[:, :, 0]), 2, rtol=0.02)
    np.testing.assert_array_equal(material.matched({"height": 0, "normal": 0}), maps["albedo"])


@pytest.mark.parametrize(
    ("maps", "said"),
    [
        ({"normal": image(0)}, "material has no albedo; it has: normal"),
        ({"albedo": image(0), "shine": image(1)}, "role 'shine' is unknown"),
        ({"albedo": image(0), "height": image(1)}, r"height has shape \(48, 64, 3\)"),
        ({"albedo": image(0), "height": image(1, 1, (48, 48))}, r"allowed: \(48, 64, C\) as the albedo"),
        ({"albedo": image(0).astype(np.int32)}, "albedo: sample has dtype int32"),
    ],
)
def test_maps_that_do_not_fit_are_refused(maps: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Material(maps)


@pytest.mark.parametrize("weights", [{"albedo": 1}, {"shine": 1}, {"height": -1}, {"height": float("nan")}])
def test_weights_out_of_range_are_refused(weights: Any) -> None:
    with pytest.raises(InputError, match="weight of"):
        Material({"albedo": image(0), "height": image(1, 1)}).matched(weights)
