"""Materials as libraries deliver them: zip files, maps named by hand, conventions of normals."""

import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.base.options.sample_options import SampleOptions
from upholster.image.files.material_files import read_material
from upholster.image.files.source import Sample, read_source, source_files
from upholster.image.files.write import encode_image, write_image
from upholster.image.normal_convention import points_down

SIZE = (40, 48)


def image(seed: int, channels: int = 3) -> Any:
    return np.random.default_rng(seed).integers(0, 256, (*SIZE, channels), dtype=np.uint8)


def relief(dtype: Any = np.uint8) -> tuple[Any, Any]:
    """A height map, and its normals with green upward."""
    r, c = np.mgrid[: SIZE[0], : SIZE[1]] / 4.0
    height = 0.5 + 0.2 * np.sin(r + 0.2 * c) + 0.2 * np.cos(c)
    slopes = np.gradient(6 * height)
    vectors = np.stack([-slopes[1], slopes[0], np.ones_like(height)], axis=2)
    vectors /= np.linalg.norm(vectors, axis=2, keepdims=True)
    top = np.iinfo(dtype).max
    return (
        np.rint(top * height).astype(dtype)[:, :, None],
        np.rint(top * (vectors + 1) / 2).astype(dtype),
    )


def down(normal: Any) -> Any:
    turned = normal.copy()
    turned[:, :, 1] = np.iinfo(normal.dtype).max - normal[:, :, 1]
    return turned


def package(path: Path, **entries: Any) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in entries.items():
            file.writestr(name, content if isinstance(content, bytes) else encode_image(content, "png"))
    return path


@pytest.mark.parametrize("method", [zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2])
def test_zip_files_by_other_methods_are_refused_sound_or_damaged(tmp_path: Path, method: int) -> None:
    path = tmp_path / "stone.zip"
    with zipfile.ZipFile(path, "w", method) as file:
        file.writestr("stone_albedo.png", encode_image(image(0), "png"))
    whole = path.read_bytes()
    for data in (whole, whole[:60] + b"\xff" * 40 + whole[100:]):
        path.write_bytes(data)
        with pytest.raises(InputError, match="allowed: stored, deflate"):
            read_material(path)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_the_height_map_tells_which_way_green_points(dtype: Any) -> None:
    height, normal = relief(dtype)
    top = np.iinfo(dtype).max
    assert points_down(normal, height) is False
    assert points_down(down(normal), height) is True
    assert points_down(down(normal), top - height) is True  # a depth map
    noise = np.random.default_rng(0).integers(0, top, height.shape).astype(dtype)
    assert points_down(normal, noise) is None
    assert points_down(normal, np.zeros_like(height)) is None


def test_normals_are_turned_by_height_name_or_wish(tmp_path: Path) -> None:
    height, normal = relief()
    for name, pixels in {"x_albedo": image(0), "x_normal": down(normal), "x_height": height}.items():
        write_image(tmp_path / f"{name}.png", pixels)
    material = read_material(tmp_path)
    np.testing.assert_array_equal(material.maps["normal"], normal)
    assert "DirectX" in " ".join(material.notes)
    np.testing.assert_array_equal(read_material(tmp_path, normal="gl").maps["normal"], down(normal))
    np.testing.assert_array_equal(read_material(tmp_path, normal="dx").maps["normal"], normal)
    # What the name says is not doubted.
    (tmp_path / "x_normal.png").rename(tmp_path / "x_normal_gl.png")
    np.testing.assert_array_equal(read_material(tmp_path).maps["normal"], down(normal))
    (tmp_path / "x_normal_gl.png").rename(tmp_path / "T_x_N.png")
    assert not read_material(tmp_path).notes
    np.testing.assert_array_equal(read_material(tmp_path).maps["normal"], normal)
    with pytest.raises(InputError, match="normal is 'up'; allowed: gl"):
        read_material(tmp_path, normal="up")


def test_a_zip_file_works_as_a_folder_does(tmp_path: Path) -> None:
    files = {"w_diff_1k.png": image(0), "w_arm_1k.png": image(1), "w_nor_gl_1k.png": image(2)}
    for name, pixels in files.items():
        write_image(tmp_path / name, pixels)
    path = package(
        tmp_path / "Wall.ZIP",
        **{f"w/textures/{name}": pixels for name, pixels in files.items()},
        **{"w/w.blend": b"no image", "__MACOSX/w/._w_diff_1k.png": b"no image", "w/.DS_Store": b"x"},
        **{"w/textures/thumbs/w_diff_1k.png": image(3), "license.txt": b"CC0"},
    )
    in_folder, in_zip = read_material(tmp_path), read_source(path)
    assert not isinstance(in_zip, np.ndarray)
    assert list(in_zip.maps) == ["albedo", "normal", "roughness", "metallic", "ao"]
    for role, pixels in in_folder.maps.items():
        np.testing.assert_array_equal(in_zip.maps[role], pixels)
    assert in_zip.notes == in_folder.notes
    assert source_files(path) == [str(path)]
    small = read_source(Sample(str(path), options=SampleOptions(crop=(0, 0, 40, 36))))
    assert not isinstance(small, np.ndarray)
    assert small.shape == (36, 40)


def test_maps_are_named_by_hand(tmp_path: Path) -> None:
    odd = image(1)
    write_image(tmp_path / "wall.png", image(0))
    write_image(tmp_path / "odd.png", odd)
    folder = tmp_path / "wall"
    folder.mkdir()
    write_image(folder / "x_albedo.png", image(0))
    write_image(folder / "x_rough.png", image(2, 1))
    write_image(folder / "x_what.png", image(3, 1))

    single = read_source(Sample(tmp_path / "wall.png", options={"maps": {"rma": tmp_path / "odd.png"}}))
    assert not isinstance(single, np.ndarray)
    for role, channel in (("roughness", 0), ("metallic", 1), ("ao", 2)):
        np.testing.assert_array_equal(single.maps[role][:, :, 0], odd[:, :, channel])
    # A name of the folder, instead of what the names say.
    material = read_material(folder, maps={"Roughness": "x_what.png"})
    np.testing.assert_array_equal(material.maps["roughness"], image(3, 1))
    zipped = package(tmp_path / "z.zip", **{"a.png": image(0), "b.png": image(3, 1)})
    material = read_material(zipped, maps={"albedo": "a.png", "height": "b.png"})
    np.testing.assert_array_equal(material.maps["height"], image(3, 1))
    assert source_files(tmp_path / "wall.png", {"ao": "b.png"}) == [str(tmp_path / "wall.png"), "b.png"]
    for maps, said in (
        ({"shine": "x_what.png"}, "role 'shine' is unknown"),
        ({"cavity": "x_what.png"}, "role 'cavity' is unknown"),
        ({"height": "x_what.png", "ao": "none.png"}, "'none.png' does not exist"),
        ({"ao": "x_what.png", "occlusion": "x_what.png"}, "two files of role 'ao'"),
    ):
        with pytest.raises(InputError, match=said):
            read_material(folder, maps=maps)
    with pytest.raises(InputError, match=r"normal is 'dx', but .* is not a material"):
        read_source(Sample(tmp_path / "wall.png", options={"normal": "dx"}))


def test_what_is_not_used_is_reported(tmp_path: Path) -> None:
    names = {"albedo": 3, "Cavity": 1, "Specular": 3, "Roughness": 3, "Gloss": 1, "Bump": 1}
    for n, (name, channels) in enumerate(names.items()):
        write_image(tmp_path / f"x_4K_{name}.png", image(n, channels))
    material = read_material(tmp_path)
    assert list(material.maps) == ["albedo", "roughness"]
    notes = "\n".join(material.notes)
    for name in ("Cavity", "Specular", "Gloss", "Bump"):
        assert f"left out 'x_4K_{name}.png'" in notes
    assert "'x_4K_Roughness.png' is coloured" in notes
    assert len(material.notes) == 5


def patched(path: Path, name: bytes, other: bytes) -> Path:
    """Put another name of the same length into an archive."""
    path.write_bytes(path.read_bytes().replace(name, other))
    return path


def test_odd_zip_files_are_refused_in_one_line(tmp_path: Path) -> None:
    good = {"x_albedo.png": image(0), "aa/x_ao.png": image(1, 1)}
    many = package(tmp_path / "many.zip", **{f"{n}.txt": b"" for n in range(1001)})
    link = zipfile.ZipInfo("x_albedo.png")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(tmp_path / "link.zip", "w") as file:
        file.writestr(link, "/etc/passwd")
    locked = package(tmp_path / "locked.zip", **good)
    data = bytearray(locked.read_bytes())
    at = data.index(b"PK\1\2")
    data[at + 8] |= 1  # the encryption bit
    locked.write_bytes(data)
    bomb = package(tmp_path / "bomb.zip", **good)
    data = bytearray(bomb.read_bytes())
    at = data.index(b"PK\1\2")
    data[at + 24 : at + 28] = struct.pack("<I", 1 << 30)  # what it says to take unpacked
    bomb.write_bytes(data)
    broken = package(tmp_path / "broken.zip", **good)
    data = bytearray(broken.read_bytes())
    data[120:160] = bytes(40)
    broken.write_bytes(data)
    (tmp_path / "text.zip").write_bytes(b"no zip file")
    package(tmp_path / "empty.zip")
    for path, said in (
        (many, "has 1001 entries; allowed: 1000"),
        (patched(package(tmp_path / "up.zip", **good), b"aa/", b"../"), "'../x_ao.png'; allowed: plain"),
        (patched(package(tmp_path / "root.zip", **good), b"aa/", b"/a/"), "'/a/x_ao.png'; allowed: plain"),
        (patched(package(tmp_path / "win.zip", **good), b"aa/", b"c:/"), "'c:/x_ao.png'; allowed: plain"),
        (tmp_path / "link.zip", "allowed: plain relative paths"),
        (locked, "is encrypted"),
        (bomb, "takes 1024 MiB; allowed: 256 MiB unpacked"),
        (broken, "broken.zip/x_albedo.png'(: it cannot be unpacked| is truncated)"),
        (tmp_path / "text.zip", "is not a readable zip file"),
        (tmp_path / "empty.zip", "material has no albedo; it has: no maps"),
        (tmp_path / "none.zip", "does not exist"),
        (
            package(tmp_path / "bad.zip", **{"x_albedo.png": b"no image"}),
            "bad.zip/x_albedo.png' is not a readable",
        ),
    ):
        with pytest.raises(InputError, match=said) as error:
            read_source(path)
        assert "\n" not in str(error.value)
        assert str(error.value).count(str(path)) == 1


def test_a_directory_is_not_read_before_its_length_is_checked(tmp_path: Path) -> None:
    path = tmp_path / "long.zip"
    with zipfile.ZipFile(path, "w") as file:
        for n in range(300):
            file.writestr(f"{n:04}" + "n" * 5000, b"")
    data = bytearray(path.read_bytes())
    end = data.index(b"PK\5\6")
    at, length = struct.unpack("<I", data[end + 16 : end + 20])[0], end
    # The record at the end tells of one short entry; a second one, for large files, has the true numbers.
    data[end + 8 : end + 16] = struct.pack("<HHI", 1, 1, 46)
    large = struct.pack("<4sQHHIIQQQQ", b"PK\6\6", 44, 45, 45, 0, 0, 300, 300, length - at, at)
    data[end:end] = large + struct.pack("<4sIQI", b"PK\6\7", 0, length, 1)
    path.write_bytes(data)
    with pytest.raises(InputError) as error:
        read_source(path)
    said = f"{str(path)!r}: its directory has {length - at:,} bytes; allowed: 1,024,000"
    assert str(error.value) == said
