"""Ten packages of materials, named as libraries name them: the right maps in the GLB, channel by channel."""

import json
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upholster.base.options.write_options import WriteOptions
from upholster.image.files.read import read_image
from upholster.image.files.write import encode_image, write_image
from upholster.pipeline import cover

SIDE = 64
AO, ROUGHNESS, METALLIC = 200, 90, 40
NONE = 255  # what a channel holds in the GLB without a map


def relief() -> tuple[Any, Any]:
    """Height of a wall of stones, and its normals with green upward."""
    rows, columns = np.mgrid[:SIDE, :SIDE]
    columns = columns + 8 * (rows // 8 % 2)
    edge = np.minimum(np.minimum(rows % 8, 7 - rows % 8), np.minimum(columns % 16, 15 - columns % 16))
    height = np.clip(edge, 0, 2) / 2
    slopes = np.gradient(2 * height)
    vectors = np.stack([-slopes[1], slopes[0], np.ones_like(height)], axis=2)
    vectors /= np.linalg.norm(vectors, axis=2, keepdims=True)
    return np.rint(255 * height).astype(np.uint8), np.rint(127.5 + 127.5 * vectors).astype(np.uint8)


HEIGHT, NORMAL = relief()
GREY: dict[str, Any] = {
    "ao": np.full((SIDE, SIDE), AO, np.uint8),
    "roughness": np.full((SIDE, SIDE), ROUGHNESS, np.uint8),
    "gloss": np.full((SIDE, SIDE), 255 - ROUGHNESS, np.uint8),
    "metallic": np.full((SIDE, SIDE), METALLIC, np.uint8),
    "height": HEIGHT,
    "none": np.random.default_rng(0).integers(0, 255, (SIDE, SIDE), dtype=np.uint8),
}
# The base colour is the normal map, with x and y left to compare: both are painted by one quilt.
COLOR = NORMAL.copy()
COLOR[:, :, 2] = HEIGHT


def content(what: str) -> Any:
    """An image: the colour, normals with green up or down, or other maps, one to a channel."""
    if what == "color":
        return COLOR
    if what in ("gl", "dx"):
        normal = NORMAL.copy()
        if what == "dx":
            normal[:, :, 1] = 255 - normal[:, :, 1]
        return normal
    return np.stack([GREY[role] for role in what.split()], axis=2)


PACKAGES: dict[str, tuple[dict[str, str], tuple[int, int, int], list[str]]] = {
    "ambientCG": (
        {
            "Bricks102_1K-PNG_Color": "color",
            "Bricks102_1K-PNG_NormalGL": "gl",
            "Bricks102_1K-PNG_NormalDX": "dx",
            "Bricks102_1K-PNG_Roughness": "roughness",
            "Bricks102_1K-PNG_AmbientOcclusion": "ao",
            "Bricks102_1K-PNG_Displacement": "height",
            "Bricks102": "none none none",
        },
        (AO, ROUGHNESS, NONE),
        [],
    ),
    "Poly Haven": (
        {
            "textures/brick_wall_diff_1k": "color",
            "textures/brick_wall_nor_dx_1k": "dx",
            "textures/brick_wall_arm_1k": "ao roughness metallic",
            "textures/brick_wall_disp_1k": "height",
        },
        (AO, ROUGHNESS, METALLIC),
        ["'brick_wall_arm_1k.png' holds ao, roughness, metallic in its channels"],
    ),
    "Megascans": (
        {
            "tbzb_4K_Albedo": "color",
            "tbzb_4K_Normal_LOD0": "dx",
            "tbzb_4K_Roughness": "roughness",
            "tbzb_4K_Gloss": "gloss",
            "tbzb_4K_Displacement": "height",
            "tbzb_4K_AO": "ao",
            "tbzb_4K_Cavity": "none",
            "tbzb_4K_Specular": "none none none",
            "tbzb_4K_Bump": "none",
        },
        (AO, ROUGHNESS, NONE),
        ["left out 'tbzb_4K_Cavity.png'", "left out 'tbzb_4K_Gloss.png'", "DirectX"],
    ),
    "Unreal": (
        {"T_Brick_D": "color", "T_Brick_N": "dx", "T_Brick_ORM": "ao roughness metallic"},
        (AO, ROUGHNESS, METALLIC),
        ["'T_Brick_ORM.png' holds"],
    ),
    "Substance": (
        {
            "Bricks_Base_Color": "color",
            "Bricks_Normal_OpenGL": "gl",
            "Bricks_Roughness": "roughness",
            "Bricks_Metallic": "metallic",
            "Bricks_Mixed_AO": "ao",
            "Bricks_Height": "height",
        },
        (AO, ROUGHNESS, METALLIC),
        [],
    ),
    "Substance for glTF": (
        {
            "Bricks_BaseColor": "color",
            "Bricks_Normal": "gl",
            "Bricks_OcclusionRoughnessMetallic": "ao roughness metallic",
        },
        (AO, ROUGHNESS, METALLIC),
        ["'Bricks_OcclusionRoughnessMetallic.png' holds"],
    ),
    "RMA": (
        {"wall_albedo": "color", "wall_normal_dx": "dx", "wall_RMA": "roughness metallic ao"},
        (AO, ROUGHNESS, METALLIC),
        ["holds roughness, metallic, ao"],
    ),
    "MRA": (
        {"wall_col": "color", "wall_nrm": "dx", "wall_h": "height", "wall_MRA": "metallic roughness ao"},
        (AO, ROUGHNESS, METALLIC),
        ["holds metallic, roughness, ao", "DirectX"],
    ),
    "Unity": (
        {"Wall_Albedo": "color", "Wall_Normal": "gl", "Wall_MaskMap": "metallic ao none gloss"},
        (AO, ROUGHNESS, METALLIC),
        ["holds metallic, ao, nothing, gloss"],
    ),
    "glTF": (
        {
            "Wall_baseColor": "color",
            "Wall_normal": "gl",
            "Wall_metallicRoughness": "none roughness metallic",
            "Wall_occlusion": "ao",
        },
        (AO, ROUGHNESS, METALLIC),
        ["holds nothing, roughness, metallic"],
    ),
}


def glb_images(path: Path, folder: Path) -> dict[str, Any]:
    """Return a GLB's images by what its material uses them for."""
    data = path.read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    head, body = json.loads(data[20 : 20 + length]), data[28 + length :]

    def pixels(texture: Any) -> Any:
        image = head["images"][head["textures"][texture["index"]]["source"]]
        view = head["bufferViews"][image["bufferView"]]
        start = view.get("byteOffset", 0)
        (folder / "image.png").write_bytes(body[start : start + view["byteLength"]])
        return read_image(folder / "image.png").astype(int)

    material = head["materials"][0]
    surface = material["pbrMetallicRoughness"]
    assert material["occlusionTexture"]["index"] == surface["metallicRoughnessTexture"]["index"]
    return {
        "color": pixels(surface["baseColorTexture"]),
        "orm": pixels(surface["metallicRoughnessTexture"]),
        "normal": pixels(material["normalTexture"]),
    }


@pytest.mark.slow(reason="covers several models, or one several times")
@pytest.mark.parametrize("name", PACKAGES)
def test_the_right_maps_are_in_the_glb(name: str, tmp_path: Path) -> None:
    files, expected, notes = PACKAGES[name]
    if list(PACKAGES).index(name) % 2:  # as downloaded
        source = tmp_path / "package.zip"
        with zipfile.ZipFile(source, "w") as package:
            for file, what in files.items():
                package.writestr(f"{file}.png", encode_image(content(what), "png"))
    else:
        source = tmp_path / "package"
        source.mkdir()
        for file, what in files.items():
            write_image(source / f"{Path(file).name}.png", content(what))
    report = cover(
        source,
        "plane",
        [str(tmp_path / "wall.glb")],
        synthesis={"texels": (SIDE, SIDE)},
        options=WriteOptions(texture="png"),
        threads=1,
    )
    for note in notes:
        assert any(note in reported for reported in report.notes), report.notes
    images = glb_images(tmp_path / "wall.glb", tmp_path)
    for channel, value in enumerate(expected):
        assert (images["orm"][..., channel] == value).all()
    # Red and green: where blocks are blended, normals are made unit vectors, so a few differ.
    off = np.abs(images["normal"][..., :2] - images["color"][..., :2]).max(axis=2)
    assert np.mean(off > 1) < 0.15
    assert np.abs(255 - images["color"][..., 1] - images["normal"][..., 1]).max() > 50  # the test can fail
