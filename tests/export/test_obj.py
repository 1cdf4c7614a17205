from pathlib import Path
from typing import Any

import numpy as np
import pytest
from textured import Model, make_model

from upholster.charts.tessellation.mesh import Mesh, tessellate
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.model_files.model_reader import read_model
from upholster.geometry.patches.surface import Surface
from upholster.image.files.read import read_exemplar
from upholster.output.export.obj import ObjPart, write_obj
from upholster.output.export.pages import PagedMesh
from upholster.output.outputs import parse_output


def read_obj(path: Path) -> Any:
    rows: dict[str, list[Any]] = {"v": [], "vt": [], "vn": [], "f": [], "mtllib": [], "usemtl": []}
    for line in path.read_text(encoding="utf-8").splitlines():
        key, _, rest = line.partition(" ")
        if key in ("v", "vt", "vn"):
            rows[key].append([float(word) for word in rest.split()])
        elif key == "f":
            rows[key].append([[int(word) - 1 for word in corner.split("/")] for corner in rest.split()])
        elif key in rows:
            rows[key].append(rest)
    return rows


def written(tmp_path: Path, model: Model, stem: str = "ring") -> Any:
    names = tmp_path / f"{stem}.obj", tmp_path / f"{stem}.mtl", tmp_path / f"{stem}_texture.png"
    write_obj(*names, PagedMesh(model.mesh, model.uv, model.pixels), stem=stem)
    return read_obj(names[0]), names


def test_quads_come_back(tmp_path: Path) -> None:
    model = make_model()
    rows, _ = written(tmp_path, model)
    faces = np.array(rows["f"])
    assert faces.shape == (len(model.mesh.quads), 4, 3)
    x, y, z = np.array(rows["v"])[faces[:, :, 0]].transpose(2, 0, 1)
    corners = model.mesh.positions[model.mesh.quads]
    np.testing.assert_allclose(np.stack([x, -z, y], axis=2), corners, rtol=1e-8, atol=1e-8)
    u, v = np.array(rows["vt"])[faces[:, :, 1]].transpose(2, 0, 1)
    np.testing.assert_allclose(np.stack([u, 1 - v], axis=2), model.uv[model.mesh.quads], atol=1e-6)
    x, y, z = np.array(rows["vn"])[faces[:, :, 2]].transpose(2, 0, 1)
    np.testing.assert_allclose(np.stack([x, -z, y], axis=2), model.mesh.normals[model.mesh.quads], atol=2e-6)


@pytest.mark.parametrize("kind", ["cyclide", "sphere", "octants"])
def test_model_is_welded_and_closed(tmp_path: Path, kind: str) -> None:
    """Every edge of the faces is used once in each direction; no face has two corners at one place."""
    rows, _ = written(tmp_path, make_model(kind))
    edges: list[tuple[int, int]] = []
    for face in rows["f"]:
        corners = [corner[0] for corner in face]
        assert len(set(corners)) == len(corners)
        edges += zip(corners, corners[1:] + corners[:1], strict=True)
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)
    vertices = len(rows["v"])
    assert vertices - len(edges) // 2 + len(rows["f"]) == (0 if kind == "cyclide" else 2)


def test_t_junctions(tmp_path: Path) -> None:
    surface = ring_cyclide()
    model = make_model()
    model.mesh = tessellate(Surface([*surface.patches[0].split(s=0.5), *surface.patches[1:]]), quads=400)
    model.uv = model.mesh.places
    rows, _ = written(tmp_path, model)
    assert {len(face) for face in rows["f"]} == {3, 4}
    assert len(rows["f"]) == len(model.mesh.quads) + len(model.mesh.triangles)


def test_files_name_each_other(tmp_path: Path) -> None:
    model = make_model(channels=4, alpha="mask")
    rows, (_, material, texture) = written(tmp_path, model, stem="my ring")
    assert rows["mtllib"] == ["my ring.mtl"]
    lines = material.read_text(encoding="utf-8").splitlines()
    assert lines[0] == f"newmtl {rows['usemtl'][0]}"
    assert " " not in rows["usemtl"][0]
    assert "map_Kd my ring_texture.png" in lines
    assert "map_d my ring_texture.png" in lines
    np.testing.assert_array_equal(read_exemplar(texture), model.pixels)
    assert parse_output(tmp_path / "my ring.obj").files()[1:] == (material, texture)


def test_texture_keeps_its_depth(tmp_path: Path) -> None:
    model = make_model(dtype=np.uint16)
    _, (_, material, texture) = written(tmp_path, model)
    assert read_exemplar(texture).dtype == np.uint16
    assert "map_d" not in material.read_text()


def test_parts_and_their_materials_keep_their_names(tmp_path: Path) -> None:
    """Each part is an object again, its triangles in order; with pages each material is one of every page."""
    rng = np.random.default_rng(3)
    corners, count = rng.normal(size=(12, 3)), 12
    mesh = Mesh(
        corners, corners, np.zeros((12, 2)), np.arange(12, dtype=np.int32) % 2, np.zeros((0, 4), np.int32),
        rng.permuted(np.tile(np.arange(12, dtype=np.int32), (count, 1)), axis=1)[:, :3],
    )  # fmt: skip
    labels = [
        ObjPart("Leg 1", "oak"),
        ObjPart("None here", "gold"),
        ObjPart("Seat", "red  felt"),
        ObjPart("Up"),
    ]
    part = np.array([3, 0, 2, 2, 0, 3, 0, 0, 2, 3, 2, 0], np.int32)
    uv, image = rng.random((12, 2)), np.zeros((8, 8, 3), np.uint8)
    names = tmp_path / "chair.obj", tmp_path / "chair.mtl", tmp_path / "chair_texture.png"
    write_obj(*names, PagedMesh(mesh, uv, image), stem="chair", parts=labels, part=part)
    model = read_model(names[0])
    assert [(each.name, each.material) for each in model.parts] == [
        ("Leg 1", "oak"),
        ("Seat", "red_felt"),
        ("Up", "chair"),
    ]
    order = np.argsort(part, kind="stable")
    np.testing.assert_allclose(model.mesh.corners, mesh.positions[mesh.triangles[order]], rtol=1e-7)
    np.testing.assert_array_equal(model.mesh.part, np.repeat([0, 1, 2], [5, 4, 3]))
    text = names[1].read_text()
    assert [line for line in text.splitlines() if line.startswith("newmtl")] == [
        "newmtl oak", "newmtl gold", "newmtl red_felt", "newmtl chair"
    ]  # fmt: skip
    assert text.count("map_Kd chair_texture.png") == 4
    pages = [tmp_path / f"chair_texture_{n}.png" for n in (1, 2)]
    paged = PagedMesh(mesh, uv, [image, image], mesh.chart)
    write_obj(names[0], names[1], pages, paged, stem="chair", parts=labels, part=part)
    found = read_obj(names[0])
    assert set(found["usemtl"]) <= {f"{name}_{n}" for name in ("oak", "red_felt", "chair") for n in (1, 2)}
    assert len(found["f"]) == count
