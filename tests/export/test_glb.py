import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from textured import make_model

from upholster._version import __version__
from upholster.base.errors import InputError
from upholster.charts.tessellation.mesh import tessellate
from upholster.geometry.built_in.plane import plane
from upholster.geometry.model_files.model_reader import read_model
from upholster.image.color import from_linear
from upholster.image.files.read import read_exemplar
from upholster.output.export.glb import TextureFormat, write_glb
from upholster.output.export.pages import PagedMesh


class Glb:
    """A GLB file, read back from the specification."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        magic, version, total = struct.unpack_from("<4sII", data)
        assert (magic, version, total) == (b"glTF", 2, len(data))
        size, tag = struct.unpack_from("<I4s", data, 12)
        assert tag == b"JSON"
        assert size % 4 == 0
        self.json = json.loads(data[20 : 20 + size])
        length, tag = struct.unpack_from("<I4s", data, 20 + size)
        assert tag == b"BIN\0"
        self.binary = data[28 + size :]
        assert len(self.binary) == length == self.json["buffers"][0]["byteLength"]

    def view(self, index: int) -> Any:
        view = self.json["bufferViews"][index]
        return self.binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]

    def accessor(self, index: int) -> Any:
        accessor = self.json["accessors"][index]
        dtype = {5126: "<f4", 5123: "<u2", 5125: "<u4"}[accessor["componentType"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor["type"]]
        values = np.frombuffer(self.view(accessor["bufferView"]), dtype).reshape(-1, width)
        assert len(values) == accessor["count"]
        return values

    def image(self, folder: Path) -> Any:
        image = self.json["images"][0]
        path = folder / ("image." + image["mimeType"].removeprefix("image/"))
        path.write_bytes(self.view(image["bufferView"]))
        return read_exemplar(path)


def test_geometry_comes_back(tmp_path: Path) -> None:
    model = make_model()
    write_glb(tmp_path / "x.glb", PagedMesh(model.mesh, model.uv, model.pixels), name="ring")
    glb = Glb(tmp_path / "x.glb")
    primitive = glb.json["meshes"][0]["primitives"][0]
    names = primitive["attributes"]
    positions = glb.accessor(names["POSITION"])
    np.testing.assert_array_equal(positions, model.mesh.positions.astype(np.float32))
    np.testing.assert_array_equal(glb.accessor(names["NORMAL"]), model.mesh.normals.astype(np.float32))
    np.testing.assert_array_equal(glb.accessor(names["TEXCOORD_0"]), model.uv.astype(np.float32))
    triangles = glb.accessor(primitive["indices"]).reshape(-1, 3)
    np.testing.assert_array_equal(triangles, model.mesh.all_triangles())
    bounds = glb.json["accessors"][names["POSITION"]]
    assert bounds["min"] == positions.min(axis=0).tolist()
    assert bounds["max"] == positions.max(axis=0).tolist()
    assert glb.json["asset"] == {"version": "2.0", "generator": f"upholster {__version__}"}
    assert glb.json["nodes"][0]["name"] == "ring"


def test_up_is_up(tmp_path: Path) -> None:
    """The root node takes our z axis to glTF's y axis."""
    model = make_model()
    write_glb(tmp_path / "x.glb", PagedMesh(model.mesh, model.uv, model.pixels))
    x, y, z, w = Glb(tmp_path / "x.glb").json["nodes"][0]["rotation"]
    axis = np.array([x, y, z])
    for vector, expected in (((0, 0, 1), (0, 1, 0)), ((1, 0, 0), (1, 0, 0))):
        across = np.cross(axis, vector)
        turned = vector + 2 * (w * across + np.cross(axis, across))
        np.testing.assert_allclose(turned, expected, atol=1e-12)


def test_faces_look_outward(tmp_path: Path) -> None:
    model = make_model("octants")
    write_glb(tmp_path / "x.glb", PagedMesh(model.mesh, model.uv, model.pixels))
    glb = Glb(tmp_path / "x.glb")
    corners = glb.accessor(0)[glb.accessor(3).reshape(-1, 3)].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.linalg.norm(normals, axis=1) > 0).all()
    assert (np.einsum("ij,ij->i", normals, corners.mean(axis=1)) > 0).all()


@pytest.mark.parametrize(("quads", "component"), [(400, 5123), (80_000, 5125)])
def test_indices_are_as_wide_as_needed(tmp_path: Path, quads: int, component: int) -> None:
    model = make_model()
    mesh = tessellate(model.surface, model.texels.charts, quads=quads)
    write_glb(tmp_path / "x.glb", PagedMesh(mesh, model.atlas.texture_coordinates(mesh), model.pixels))
    glb = Glb(tmp_path / "x.glb")
    assert glb.json["accessors"][3]["componentType"] == component
    np.testing.assert_array_equal(glb.accessor(3).reshape(-1, 3), mesh.all_triangles())


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_png_keeps_the_texels(tmp_path: Path, dtype: Any, channels: int) -> None:
    model = make_model(channels=channels, dtype=dtype, alpha="blend")
    write_glb(tmp_path / "x.glb", PagedMesh(model.mesh, model.uv, model.pixels))
    expected = from_linear(model.pixels, np.uint8) if dtype == np.float32 else model.pixels
    image = Glb(tmp_path / "x.glb").image(tmp_path)
    assert image.dtype == expected.dtype
    np.testing.assert_array_equal(image, expected)


@pytest.mark.parametrize("texture", ["jpeg", "webp"])
def test_other_image_formats(tmp_path: Path, texture: TextureFormat) -> None:
    model = make_model()
    write_glb(tmp_path / "x.glb", PagedMesh(model.mesh, model.uv, model.pixels), texture=texture, quality=95)
    glb = Glb(tmp_path / "x.glb")
    assert glb.json["images"][0]["mimeType"] == f"image/{texture}"
    used = ["EXT_texture_webp"] if texture == "webp" else None
    assert glb.json.get("extensionsUsed") == glb.json.get("extensionsRequired") == used
    image = glb.image(tmp_path).astype(int)
    assert np.abs(image - model.pixels).mean() < 6


@pytest.mark.parametrize(("alpha", "mode"), [("opaque", None), ("mask", "MASK"), ("blend", "BLEND")])
@pytest.mark.parametrize("channels", [2, 4])
def test_alpha_mode(tmp_path: Path, channels: int, alpha: Any, mode: Any) -> None:
    model = make_model(channels=channels, alpha=alpha, size=128)
    write_glb(tmp_path / "x.glb", PagedMesh(model.mesh, model.uv, model.pixels))
    glb = Glb(tmp_path / "x.glb")
    assert glb.json["materials"][0].get("alphaMode") == mode
    assert glb.image(tmp_path).shape[2] == channels - (mode is None)
    if mode is not None:
        with pytest.raises(InputError, match="'jpeg' cannot hold the sample's alpha; allowed"):
            write_glb(tmp_path / "x.glb", PagedMesh(model.mesh, model.uv, model.pixels), texture="jpeg")


def test_what_does_not_fit(tmp_path: Path) -> None:
    model = make_model()
    with pytest.raises(InputError, match=r"texture 'gif' is unknown; .*known: auto, png, jpeg, webp"):
        write_glb(tmp_path / "x.glb", PagedMesh(model.mesh, model.uv, model.pixels), texture="gif")  # type: ignore[arg-type]
    mesh = tessellate(plane(), quads=1)
    with pytest.raises(InputError, match="allowed in webp: up to 16383"):
        write_glb(
            tmp_path / "x.glb",
            PagedMesh(mesh, mesh.places, np.zeros((1, 20000, 3), np.uint8)),
            texture="webp",
        )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("page", "maps", "said"),
    [
        (np.array([0, 2]), {}, "vertices lie on page 2; there are images of 2"),
        (None, {"ao": np.zeros((8, 8, 1), np.uint8)}, "ao map has 1 pages; allowed: 2"),
    ],
)
def test_pages_that_do_not_fit_are_refused(tmp_path: Path, page: Any, maps: Any, said: str) -> None:
    model = make_model()
    paged = PagedMesh(model.mesh, model.uv, [model.pixels, model.pixels], page)
    with pytest.raises(InputError, match=said):
        write_glb(tmp_path / "x.glb", paged, maps=maps)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("metres", "scale"), [(None, None), (1.0, None), (0.001, [0.001] * 3)])
def test_a_known_unit_becomes_metres(tmp_path: Path, metres: float | None, scale: list[float] | None) -> None:
    model = make_model()
    write_glb(tmp_path / "x.glb", PagedMesh(model.mesh, model.uv, model.pixels, metres=metres))
    assert Glb(tmp_path / "x.glb").json["nodes"][0].get("scale") == scale
    found = read_model(tmp_path / "x.glb").mesh
    size = (model.mesh.positions.max(axis=0) - model.mesh.positions.min(axis=0)) * (metres or 1.0)
    np.testing.assert_allclose(found.box[1] - found.box[0], size, rtol=1e-5)
