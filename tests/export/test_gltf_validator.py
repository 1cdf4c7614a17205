"""Khronos' gltf-validator must find nothing to complain about."""

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_models import rigged
from gltf_validation import validated
from textured import make_model

from upholster.charts.chart_seams import find_seams
from upholster.charts.tessellation.mesh import tessellate
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.model_files.model_reader import read_model
from upholster.geometry.patches.surface import Surface
from upholster.model.atlas import build_atlas
from upholster.model.packing import pack_charts
from upholster.model.tangents import vertex_tangents
from upholster.output.export.glb import write_glb
from upholster.output.export.glb_copy import Cover, write_retextured_glb
from upholster.output.export.pages import PagedMesh


def test_retextured_files_are_valid(tmp_path: Path) -> None:
    """Split or not, of one page or several, whole or in part: only hints at what the source lacks."""
    model = read_model(rigged(tmp_path))
    count = len(model.mesh.triangles)
    apart = np.random.default_rng(1).random((count, 3, 2))
    together = (model.mesh.corners - model.mesh.box[0])[..., :2]
    flat = np.full((8, 8, 3), 128, np.uint8)
    part = np.arange(4)
    covers = [
        Cover(apart, flat),
        Cover(together, flat, maps={"normal": flat, "roughness": flat[..., :1], "ao": flat[..., :1]}),
        Cover(apart, [flat, flat], page=np.arange(count) % 2),
        Cover(apart[part], flat, part),
    ]
    files = [tmp_path / f"{number}.glb" for number in range(len(covers))]
    for file, cover in zip(files, covers, strict=True):
        write_retextured_glb(file, model, [cover], texture="webp" if file == files[2] else "png")
    for issues in validated(files):
        assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues
        assert {found["code"] for found in issues["messages"]} <= {
            "UNUSED_OBJECT",
            "BUFFER_VIEW_TARGET_MISSING",
        }


@pytest.mark.slow(reason="writes and reads whole models")
def test_no_errors_and_no_warnings(tmp_path: Path) -> None:
    kinds: list[tuple[Any, dict[str, Any]]] = []
    for texture, channels, dtype in product(
        ("png", "jpeg", "webp"), (1, 2, 3, 4), (np.uint8, np.uint16, np.float32)
    ):
        kinds.append((texture, {"channels": channels, "dtype": dtype}))
    for alpha, texture, channels in product(("mask", "blend"), ("png", "webp"), (2, 4)):
        kinds.append((texture, {"channels": channels, "alpha": alpha, "size": 64}))
    kinds += [("png", {"kind": "octants"}), ("png", {"kind": "sphere"})]
    files = []
    for number, (texture, options) in enumerate(kinds):
        model = make_model(**options)
        files.append(tmp_path / f"{number}.glb")
        write_glb(
            files[-1], PagedMesh(model.mesh, model.uv, model.pixels), texture=texture, name='ring "ä" \\ 1'
        )
    surface = ring_cyclide()
    mesh = tessellate(Surface([*surface.patches[0].split(s=0.5), *surface.patches[1:]]), quads=70_000)
    files.append(tmp_path / "junctions.glb")
    write_glb(files[-1], PagedMesh(mesh, mesh.places, make_model().pixels))
    for number, (texture, roles) in enumerate(
        [
            ("png", ("normal", "roughness", "metallic", "ao", "emission")),
            ("webp", ("normal", "ao")),
            ("jpeg", ("metallic",)),
        ]
    ):
        model = make_model("octants")
        files.append(tmp_path / f"material{number}.glb")
        maps = {role: model.pixels[:, :, : 3 if role in ("normal", "emission") else 1] for role in roles}
        tangents = vertex_tangents(model.surface, model.texels.charts, model.mesh)
        write_glb(
            files[-1],
            PagedMesh(model.mesh, model.uv, model.pixels),
            texture=texture,
            maps=maps,
            tangents=tangents,
        )
    for kind, texture in (("cyclide", "png"), ("octants", "webp")):
        model = make_model(kind, size=64, channels=4, alpha="mask")
        seams = find_seams(model.surface, model.texels.charts)
        atlas = build_atlas(model.texels, seams, pack_charts(model.texels.charts, limit=200))
        assert len(atlas.pages) > 1
        page, uv = atlas.page_coordinates(model.mesh)
        maps = {"normal": [image[:, :, :3] for image in atlas.images()]}
        tangents = vertex_tangents(model.surface, model.texels.charts, model.mesh)
        files.append(tmp_path / f"pages_{kind}.glb")
        write_glb(
            files[-1],
            PagedMesh(model.mesh, uv, atlas.images(), page),
            texture=texture,
            maps=maps,
            tangents=tangents,
        )
    for file, issues in zip(files, validated(files), strict=True):
        assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), (file.name, issues["messages"][:3])
        assert {message["code"] for message in issues["messages"]} <= {"IMAGE_NPOT_DIMENSIONS"}, file.name


def test_the_validator_does_find_errors(tmp_path: Path) -> None:
    model = make_model()
    write_glb(tmp_path / "x.glb", PagedMesh(model.mesh, model.uv, model.pixels))
    data = bytearray((tmp_path / "x.glb").read_bytes())
    data[data.index(b'"VEC3"') + 4] = ord("2")
    (tmp_path / "x.glb").write_bytes(data)
    assert validated([tmp_path / "x.glb"])[0]["numErrors"] > 0
