"""Files of triangles alone: what is read back is what was written."""

import struct
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from upholster.output.export.bare import write_bare_obj, write_bare_ply
from upholster.output.export.stl import write_stl
from upholster.output.export.three_mf import write_3mf

POSITIONS = np.array([[0.0, 0, 0], [1.5, 0, 0], [0, 1, 0], [0, 0, 1e-7], [1 / 3, 1e6, -2]])
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 4]], np.int32)


def test_stl_has_the_triangles_and_their_normals(tmp_path: Path) -> None:
    write_stl(tmp_path / "a.stl", POSITIONS, TRIANGLES)
    data = (tmp_path / "a.stl").read_bytes()
    assert not data.startswith(b"solid")
    assert len(data) == 84 + 50 * struct.unpack_from("<I", data, 80)[0]
    for number, corners in enumerate(TRIANGLES):
        values = struct.unpack_from("<12fH", data, 84 + 50 * number)
        a, b, c = POSITIONS[corners].astype(np.float32).astype(float)
        normal = np.cross(b - a, c - a)
        assert values[:3] == pytest.approx(normal / np.linalg.norm(normal), abs=1e-6)
        assert values[3:12] == tuple(POSITIONS[corners].astype(np.float32).ravel().tolist())


def test_3mf_has_unit_vertices_and_triangles(tmp_path: Path) -> None:
    write_3mf(tmp_path / "a.3mf", POSITIONS, TRIANGLES, name='a "b" <c> & d\n')
    with zipfile.ZipFile(tmp_path / "a.3mf") as package:
        assert package.testzip() is None
        assert package.namelist() == ["[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"]
        types, relations, model = (ElementTree.fromstring(package.read(n)) for n in package.namelist())
    assert {entry.get("Extension") for entry in types} == {"rels", "model"}
    assert relations[0].get("Target") == "/3D/3dmodel.model"
    space = {"m": "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"}
    assert model.get("unit") == "millimeter"
    (only,) = model.findall("m:resources/m:object", space)
    assert only.get("name") == 'a "b" <c> & d'
    vertices = [[float(v.get(axis, "")) for axis in "xyz"] for v in only.iterfind(".//m:vertex", space)]
    triangles = [
        [int(t.get(key, "")) for key in ("v1", "v2", "v3")] for t in only.iterfind(".//m:triangle", space)
    ]
    assert np.allclose(vertices, POSITIONS, rtol=1e-8, atol=0)
    assert triangles == TRIANGLES.tolist()
    (item,) = model.findall("m:build/m:item", space)
    assert item.get("objectid") == only.get("id")


def test_the_same_model_gives_the_same_3mf(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_3mf(tmp_path / f"{name}.3mf", POSITIONS, TRIANGLES)
    assert (tmp_path / "a.3mf").read_bytes() == (tmp_path / "b.3mf").read_bytes()


def test_obj_has_y_up(tmp_path: Path) -> None:
    write_bare_obj(tmp_path / "a.obj", POSITIONS, TRIANGLES, name="a vase")
    lines = (tmp_path / "a.obj").read_text().splitlines()
    assert lines[1] == "o a_vase"
    vertices = [[float(part) for part in line.split()[1:]] for line in lines if line.startswith("v ")]
    faces = [[int(part) - 1 for part in line.split()[1:]] for line in lines if line.startswith("f ")]
    assert np.allclose(vertices, POSITIONS[:, [0, 2, 1]] * [1, 1, -1], rtol=1e-8)
    assert faces == TRIANGLES.tolist()


def test_ply_is_binary(tmp_path: Path) -> None:
    write_bare_ply(tmp_path / "a.ply", POSITIONS, TRIANGLES)
    head, _, body = (tmp_path / "a.ply").read_bytes().partition(b"end_header\n")
    assert b"element vertex 5\n" in head
    assert b"element face 4\n" in head
    vertices = np.frombuffer(body, "<f4", 15).reshape(5, 3)
    faces = np.frombuffer(body, np.dtype([("n", "u1"), ("v", "<i4", 3)]), offset=60)
    assert (vertices == POSITIONS.astype(np.float32)).all()
    assert faces["v"].tolist() == TRIANGLES.tolist()
    assert (faces["n"] == 3).all()


def test_trimesh_reads_them_as_one_solid(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    corners, triangles = POSITIONS[[0, 1, 2, 4]], np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]])
    for name, write in (("a.stl", write_stl), ("a.obj", write_bare_obj), ("a.ply", write_bare_ply)):
        write(tmp_path / name, corners, triangles.astype(np.int32))  # type: ignore[operator]
        found = trimesh.load(tmp_path / name, force="mesh")
        assert found.is_watertight, name
        assert abs(found.volume) == pytest.approx(abs(0.5), rel=1e-5), name
