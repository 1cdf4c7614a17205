"""GLB files of whole materials: which texture holds what, tangents, factors."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_glb import Glb
from textured import Model, make_model

from upholster.base.errors import InputError
from upholster.charts.tessellation.mesh import face_parameters
from upholster.image.files.read import read_image
from upholster.model.tangents import vertex_tangents
from upholster.output.export.glb import write_glb
from upholster.output.export.pages import PagedMesh


def maps_of(model: Model, *roles: str, dtype: Any = np.uint8) -> dict[str, Any]:
    rng = np.random.default_rng(3)
    top = 1 if dtype == np.float32 else np.iinfo(dtype).max
    shape = model.pixels.shape[:2]
    return {
        role: (rng.random((*shape, 3 if role in ("normal", "emission") else 1)) * top).astype(dtype)
        for role in roles
    }


def write(path: Path, model: Model, maps: Any, **options: Any) -> Glb:
    tangents = vertex_tangents(model.surface, model.texels.charts, model.mesh)
    write_glb(path, PagedMesh(model.mesh, model.uv, model.pixels), maps=maps, tangents=tangents, **options)
    return Glb(path)


def texture(glb: Glb, info: Any, folder: Path) -> Any:
    source = glb.json["textures"][info["index"]]
    source = source.get("extensions", {}).get("EXT_texture_webp", source)["source"]
    image = glb.json["images"][source]
    path = folder / "texture.img"
    path.write_bytes(glb.view(image["bufferView"]))
    return read_image(path)


def test_a_whole_material_comes_back(tmp_path: Path) -> None:
    model = make_model()
    maps = maps_of(model, "normal", "roughness", "metallic", "ao", "emission", "height", "opacity")
    glb = write(tmp_path / "x.glb", model, maps, normal_scale=0.5)
    material = glb.json["materials"][0]
    surface = material["pbrMetallicRoughness"]
    assert (surface["metallicFactor"], surface["roughnessFactor"]) == (1, 1)
    assert material["normalTexture"]["scale"] == 0.5
    assert material["emissiveFactor"] == [1, 1, 1]
    assert material["occlusionTexture"] == surface["metallicRoughnessTexture"]
    assert len(glb.json["images"]) == len(glb.json["textures"]) == 4
    np.testing.assert_array_equal(texture(glb, surface["baseColorTexture"], tmp_path), model.pixels)
    np.testing.assert_array_equal(texture(glb, material["normalTexture"], tmp_path), maps["normal"])
    np.testing.assert_array_equal(texture(glb, material["emissiveTexture"], tmp_path), maps["emission"])
    packed = texture(glb, material["occlusionTexture"], tmp_path)
    for channel, role in enumerate(("ao", "roughness", "metallic")):
        np.testing.assert_array_equal(packed[:, :, channel], maps[role][:, :, 0])


def test_tangents_are_with_the_normal_map_only(tmp_path: Path) -> None:
    model = make_model()
    glb = write(tmp_path / "x.glb", model, maps_of(model, "normal"))
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    accessor = glb.json["accessors"][attributes["TANGENT"]]
    assert accessor["type"] == "VEC4"
    assert accessor["count"] == len(model.mesh.positions)
    tangents = np.frombuffer(glb.view(accessor["bufferView"]), "<f4").reshape(-1, 4)
    assert (tangents[:, 3] == 1).all()
    np.testing.assert_allclose(np.linalg.norm(tangents[:, :3], axis=1), 1, atol=1e-6)
    # (N × T)·w points up in the texture: against v along the surface.
    bitangent = np.cross(model.mesh.normals, tangents[:, :3])
    for n, chart in enumerate(model.texels.charts):
        mine = model.mesh.chart == n
        s, t = face_parameters(chart, *model.mesh.places[mine].T)
        _, by_s, _ = model.surface.faces[chart.face].derivatives(s, t)
        assert (np.einsum("ij,ij->i", bitangent[mine], by_s) < 0).all()
    plain = write(tmp_path / "y.glb", model, maps_of(model, "roughness"))
    assert "TANGENT" not in plain.json["meshes"][0]["primitives"][0]["attributes"]
    assert plain.json["materials"][0].keys() == {"name", "pbrMetallicRoughness", "doubleSided"}


@pytest.mark.parametrize(
    ("roles", "factors", "uses"),
    [
        (("roughness",), (0, 1), (False, True)),
        (("metallic",), (1, 0.8), (False, True)),
        (("ao",), (0, 0.8), (True, False)),
        (("ao", "roughness"), (0, 1), (True, True)),
    ],
)
def test_what_is_missing_is_left_to_the_factors(tmp_path: Path, roles: Any, factors: Any, uses: Any) -> None:
    model = make_model()
    glb = write(tmp_path / "x.glb", model, maps_of(model, *roles))
    material = glb.json["materials"][0]
    surface = material["pbrMetallicRoughness"]
    assert (surface["metallicFactor"], surface["roughnessFactor"]) == factors
    assert ("occlusionTexture" in material, "metallicRoughnessTexture" in surface) == uses
    packed = texture(glb, {"index": 1}, tmp_path)
    for channel, role in enumerate(("ao", "roughness", "metallic")):
        if role not in roles:
            assert (packed[:, :, channel] == 255).all()


def test_depths_are_kept(tmp_path: Path) -> None:
    model = make_model()
    wide = maps_of(model, "normal", "ao", dtype=np.uint16) | maps_of(model, "roughness")
    glb = write(tmp_path / "x.glb", model, wide)
    packed = texture(glb, {"index": 2}, tmp_path)
    np.testing.assert_array_equal(texture(glb, {"index": 1}, tmp_path), wide["normal"])
    np.testing.assert_array_equal(packed[:, :, 0], wide["ao"][:, :, 0])
    np.testing.assert_array_equal(packed[:, :, 1], wide["roughness"][:, :, 0] * np.uint16(257))
    # Plain numbers: no sRGB curve is laid on floats.
    floats = maps_of(model, "normal", "roughness", dtype=np.float32)
    glb = write(tmp_path / "y.glb", model, floats)
    expected = np.rint(floats["normal"] * 65535)
    assert np.abs(texture(glb, {"index": 1}, tmp_path) - expected).max() <= 1


@pytest.mark.parametrize(
    ("roles", "change", "said"),
    [
        (("normal",), {"tangents": None}, "a normal map needs tangents"),
        (("shine",), {}, r"role 'shine' is unknown"),
        (("normal",), {"normal_scale": -1.0}, "normal_scale is -1.0; allowed: 0 to 100"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, roles: Any, change: Any, said: str) -> None:
    model = make_model()
    options = {"maps": maps_of(model, *roles), "tangents": model.mesh.positions} | change
    with pytest.raises(InputError, match=said):
        write_glb(tmp_path / "x.glb", PagedMesh(model.mesh, model.uv, model.pixels), **options)
    assert list(tmp_path.iterdir()) == []


def test_maps_of_wrong_shapes_are_refused(tmp_path: Path) -> None:
    model = make_model()
    for maps, said in (
        ({"normal": model.pixels[:, :, :1]}, r"normal map has shape .*; allowed: \(H, W, 3\)"),
        ({"roughness": model.pixels}, r"roughness map has shape .*; allowed: \(H, W, 1\)"),
        ({"roughness": model.pixels[:, :, :1], "ao": model.pixels[1:, :, :1]}, "differ in size"),
    ):
        with pytest.raises(InputError, match=said):
            write(tmp_path / "x.glb", model, maps)
