"""GLB and glTF files: each way of writing a cube gives a cube."""

import base64
import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_models import BOX, BOX_FACES, BOX_TRIANGLES, Glb

from upholster.base.errors import FormatError, InputError
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.geometry.model_files.model_reader import read_model
from upholster.output.export.glb_copy import Cover, write_retextured_glb
from upholster.output.glb_picture import shown_model


def is_closed_cube(mesh: TriangleMesh, edge: float = 1.0) -> None:
    """Check that a mesh is a cube with its faces outward."""
    assert len(mesh.positions) == 8
    assert (mesh.neighbours >= 0).all()
    assert mesh.areas.sum() == pytest.approx(6 * edge**2)
    a, b, c = mesh.corners.transpose(1, 0, 2)
    assert (a * np.cross(b, c)).sum() / 6 == pytest.approx(edge**3)


def test_a_cube_stands_upright_and_is_closed(tmp_path: Path) -> None:
    glb = Glb()
    glb.node(name="Seat", mesh=glb.mesh("cube", glb.box()), scale=[2, 2, 2], translation=[0, 5, 0])
    model = read_model(glb.write(tmp_path / "cube.glb"))
    is_closed_cube(model.mesh, 2)
    assert model.mesh.parts == ("Seat",)
    assert model.mesh.metres == 1.0
    np.testing.assert_allclose(model.mesh.box, [(0, -2, 5), (2, 0, 7)])  # y is up there, z here


def test_another_unit_than_metres_is_noted(tmp_path: Path) -> None:
    glb = Glb()
    glb.node(mesh=glb.mesh("cube", glb.box()))
    path = glb.write(tmp_path / "cube.glb")
    for unit, metres, count in (("cm", 0.01, 1), ("m", 1.0, 0), (None, 1.0, 0)):
        model = read_model(path, unit=unit)
        assert model.mesh.metres == metres
        assert sum("glTF is in metres" in note for note in model.notes) == count


def test_a_mirrored_node_keeps_the_outside_out(tmp_path: Path) -> None:
    glb = Glb()
    glb.node(mesh=glb.mesh("cube", glb.box()), scale=[1, 1, -1])
    is_closed_cube(read_model(glb.write(tmp_path / "cube.glb")).mesh)


def test_parts_are_chosen_by_name_and_material(tmp_path: Path) -> None:
    glb = Glb(materials=[{"name": "Leather"}, {"name": "Oak"}])
    leather, oak = (glb.box() | {"material": number} for number in (0, 1))
    glb.node(name="Seat", mesh=glb.mesh("seat", leather))
    for name in ("Leg front", "Leg back"):
        glb.node(name=name, mesh=glb.mesh("leg", glb.box() | {"material": 1}))
    glb.node(name="Frame", mesh=glb.mesh("frame", leather, oak))
    path = glb.write(tmp_path / "chair.glb")
    names = ("Seat", "Leg front", "Leg back", "Frame/Leather", "Frame/Oak")
    assert read_model(path).mesh.parts == names
    assert read_model(path, parts=["leg*"]).mesh.parts == names[1:3]
    assert read_model(path, parts=["Oak", "Seat"]).mesh.parts == (*names[:3], names[4])
    with pytest.raises(InputError, match=r"'Arm'; allowed: Seat, Leg front.*by material: Leather, Oak"):
        read_model(path, parts=["Arm"])


def test_vertices_are_those_of_the_primitive(tmp_path: Path) -> None:
    glb = Glb()
    loose = BOX[BOX_TRIANGLES.ravel()]
    position = glb.accessor(loose, min=[0, 0, 0], max=[1, 1, 1])
    glb.node(mesh=glb.mesh("cube", {"attributes": {"POSITION": position}}))
    model = read_model(glb.write(tmp_path / "cube.glb"))
    is_closed_cube(model.mesh)
    (part,) = model.gltf_parts
    x, y, z = np.moveaxis(loose[part.vertices].astype(float), 2, 0)
    np.testing.assert_array_equal(model.mesh.corners, np.stack([x, -z, y], axis=-1))


def with_positions(glb: Glb, **more: Any) -> dict[str, Any]:
    return {"attributes": {"POSITION": glb.accessor(BOX, min=[0, 0, 0], max=[1, 1, 1])}, **more}


def plain(glb: Glb) -> dict[str, Any]:
    return glb.box()


def strip(glb: Glb) -> dict[str, Any]:
    """All faces as one strip, with triangles of no area between them."""
    row: list[int] = []
    for a, b, c, d in BOX_FACES.tolist():
        row += [*([row[-1], a] if row else []), a, b, d, c]
        row += [c] * (len(row) % 2)
    return with_positions(glb, mode=5, indices=glb.accessor(np.array(row, np.uint8)))


def interleaved(glb: Glb) -> dict[str, Any]:
    rows = np.zeros(8, [("normal", "<f4", 3), ("position", "<f4", 3), ("more", "<u2", 2)])
    rows["position"] = BOX
    view = glb.view(rows.tobytes(), byteStride=28)
    number = glb.add(
        "accessors",
        {"bufferView": view, "byteOffset": 12, "componentType": 5126, "count": 8, "type": "VEC3"},
    )
    return {"attributes": {"POSITION": number}, "indices": glb.accessor(BOX_TRIANGLES.astype("<u4").ravel())}


def sparse(glb: Glb) -> dict[str, Any]:
    """Positions of which only those are written that are not 0."""
    where = np.flatnonzero(BOX.any(axis=1)).astype(np.uint8)
    entry = {
        "componentType": 5126,
        "count": 8,
        "type": "VEC3",
        "sparse": {
            "count": len(where),
            "indices": {"bufferView": glb.view(where.tobytes()), "componentType": 5121},
            "values": {"bufferView": glb.view(BOX[where].tobytes())},
        },
    }
    number = glb.add("accessors", entry)
    return {"attributes": {"POSITION": number}, "indices": glb.accessor(BOX_TRIANGLES.astype("<u1").ravel())}


def quantised(glb: Glb) -> dict[str, Any]:
    glb.json["extensionsRequired"] = glb.json["extensionsUsed"] = ["KHR_mesh_quantization"]
    padded = np.zeros((8, 4), "<i2")
    padded[:, :3] = BOX * 32767
    view = glb.view(padded.tobytes(), byteStride=8)
    entry = {"bufferView": view, "componentType": 5122, "count": 8, "type": "VEC3", "normalized": True}
    return {
        "attributes": {"POSITION": glb.add("accessors", entry)},
        "indices": glb.accessor(BOX_TRIANGLES.astype("<u2").ravel()),
    }


def draco(glb: Glb) -> dict[str, Any]:
    coder = pytest.importorskip("DracoPy")
    data = coder.encode(BOX.astype(np.float64), BOX_TRIANGLES, preserve_order=True, quantization_bits=12)
    glb.json["extensionsRequired"] = glb.json["extensionsUsed"] = ["KHR_draco_mesh_compression"]
    extension = {"bufferView": glb.view(data), "attributes": {"POSITION": 0}}
    return {
        "attributes": {"POSITION": glb.add("accessors", {"componentType": 5126, "count": 8, "type": "VEC3"})},
        "indices": glb.add("accessors", {"componentType": 5123, "count": 36, "type": "SCALAR"}),
        "extensions": {"KHR_draco_mesh_compression": extension},
    }


WAYS = [plain, interleaved, sparse, quantised, draco]


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_each_way_of_writing_a_cube_gives_one(tmp_path: Path, way: Callable[[Glb], dict[str, Any]]) -> None:
    glb = Glb()
    glb.node(mesh=glb.mesh("cube", way(glb)))
    model = read_model(glb.write(tmp_path / "cube.glb"))
    is_closed_cube(model.mesh)
    # And it is written again with all its numbers.
    count = len(model.mesh.triangles)
    cover = Cover(np.random.default_rng(1).random((count, 3, 2)), np.zeros((4, 4, 3), np.uint8))
    write_retextured_glb(tmp_path / "again.glb", model, [cover])
    again = read_model(tmp_path / "again.glb")
    np.testing.assert_array_equal(again.mesh.corners, model.mesh.corners)
    assert "KHR_draco_mesh_compression" not in (again.gltf.json if again.gltf else {}).get(
        "extensionsUsed", []
    )


def test_strips_and_fans_are_triangles(tmp_path: Path) -> None:
    glb = Glb()
    glb.node(mesh=glb.mesh("cube", strip(glb)))
    mesh = read_model(glb.write(tmp_path / "cube.glb")).mesh
    whole = mesh.areas > 0
    is_closed_cube(TriangleMesh(mesh.positions, mesh.triangles[whole]))
    glb = Glb()
    fan = with_positions(glb, mode=6, indices=glb.accessor(np.array([0, 1, 3, 2], np.uint8)))
    glb.node(mesh=glb.mesh("square", fan))
    assert read_model(glb.write(tmp_path / "fan.glb")).mesh.areas.sum() == 1


def test_buffers_may_be_files_or_data(tmp_path: Path) -> None:
    glb = Glb()
    glb.node(mesh=glb.mesh("cube", glb.box()))
    (tmp_path / "my cube.bin").write_bytes(glb.binary)
    data = "data:application/octet-stream;base64," + base64.b64encode(glb.binary).decode()
    for uri in ("my%20cube.bin", data):
        document = glb.json | {"buffers": [{"byteLength": len(glb.binary), "uri": uri}]}
        (tmp_path / "cube.gltf").write_text(json.dumps(document))
        is_closed_cube(read_model(tmp_path / "cube.gltf").mesh)


def test_instances_are_read_once_and_sizes_reported(tmp_path: Path) -> None:
    glb = Glb()
    mesh = glb.mesh("cube", glb.box())
    inner = glb.node(root=False, name="Inner", mesh=mesh, translation=[1, 0, 0])
    glb.node(name="Outer", scale=[3, 3, 3], children=[inner])
    glb.node(name="Other", mesh=mesh)
    model = read_model(glb.write(tmp_path / "cubes.glb"))
    is_closed_cube(model.mesh, 3)
    np.testing.assert_allclose(model.mesh.box, [(3, -3, 0), (6, 0, 3)])
    assert model.parts[0].instances == 2
    assert "0.333" in model.notes[0]


def instanced(glb: Glb, **attributes: Any) -> dict[str, Any]:
    given = {name: glb.accessor(np.array(rows, np.float32)) for name, rows in attributes.items()}
    return {"EXT_mesh_gpu_instancing": {"attributes": given}}


def test_instances_of_a_node_are_where_the_extension_puts_them(tmp_path: Path) -> None:
    glb = Glb(extensionsUsed=["EXT_mesh_gpu_instancing"], extensionsRequired=["EXT_mesh_gpu_instancing"])
    places = instanced(
        glb,
        TRANSLATION=[(10, 0, 0), (0, 0, 4), (0, 0, 8)],
        ROTATION=[(0, 0, 0, 1), (0, 0, 0.5**0.5, 0.5**0.5), (0, 0, 0, 1)],
        SCALE=[(1, 1, 1), (1, 1, 1), (3, 3, 3)],
    )
    box = glb.mesh("box", glb.box())
    glb.node(name="grass", mesh=box, scale=[2, 2, 2], extensions=places)
    glb.node(name="stone", mesh=box, translation=[0, 0, 40])
    path = glb.write(tmp_path / "meadow.glb")
    model = read_model(path)
    assert model.parts[0].instances == 4
    np.testing.assert_allclose(model.mesh.box, [(20, -2, 0), (22, 0, 2)])
    assert any("4 times at different sizes (0.5 to 3 times the first)" in note for note in model.notes)
    shown = shown_model(path).corners.reshape(4, -1, 3)
    lowest = [(20, -2, 0), (-2, -10, 0), (0, -22, 0), (0, -41, 0)]
    np.testing.assert_allclose(shown.min(axis=1), lowest, atol=1e-6)
    np.testing.assert_allclose(shown.max(axis=1) - shown.min(axis=1), [[s] * 3 for s in (2, 2, 6, 1)])


def test_odd_instances_are_refused_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    glb = Glb()
    places = instanced(glb, TRANSLATION=[(0, 0, 0)] * 2, SCALE=[(1, 1, 1)] * 3)
    glb.node(mesh=glb.mesh("box", glb.box()), extensions=places)
    with pytest.raises(FormatError, match="instances of node 0 have 2 and 3 values"):
        read_model(glb.write(tmp_path / "x.glb"))
    many = Glb()
    zeros = many.add("accessors", {"componentType": 5126, "count": 4, "type": "VEC3"})
    attributes = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": zeros}}}
    box = many.mesh("box", many.box())
    for _ in range(3):
        many.node(mesh=box, extensions=attributes)
    monkeypatch.setattr("upholster.geometry.model_files.gltf_nodes._MOST_INSTANCES", 10)
    with pytest.raises(InputError, match="more than 10 instances"):
        read_model(many.write(tmp_path / "x.glb"))


def test_a_picture_shows_as_many_instances_as_it_can(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    glb = Glb()
    places = instanced(glb, TRANSLATION=[(n, 0, 0) for n in range(9)])
    glb.node(mesh=glb.mesh("box", glb.box()), extensions=places)
    monkeypatch.setattr("upholster.output.glb_picture._MOST_TRIANGLES", 50)
    shown = shown_model(glb.write(tmp_path / "x.glb"))
    assert (len(shown.corners), shown.left) == (48, 5)


def test_a_skin_stands_as_its_joints_pose_it(tmp_path: Path) -> None:
    glb = Glb()
    joints = glb.accessor(np.tile(np.array([1, 0, 0, 0], np.uint16), (8, 1)))
    weights = glb.accessor(np.tile(np.array([255, 0, 0, 0], np.uint8), (8, 1)), normalized=True)
    mesh = glb.mesh("cube", glb.box(JOINTS_0=joints, WEIGHTS_0=weights))
    inverse = np.eye(4, dtype=np.float32)
    inverse[:3, 3] = -5
    glb.json["skins"] = [
        {"joints": [1, 2], "inverseBindMatrices": glb.accessor(np.stack([inverse.T.ravel()] * 2))}
    ]
    glb.node(mesh=mesh, skin=0, translation=[99, 0, 0])  # which does not count
    glb.node(name="a")
    glb.node(name="b", translation=[5, 5, 7], scale=[2, 2, 2])
    mesh_read = read_model(glb.write(tmp_path / "skin.glb")).mesh
    is_closed_cube(mesh_read, 2)
    np.testing.assert_allclose(mesh_read.box[0], (-5, 1, -5))  # 2·(0 − 5) + (5, 5, 7), z up


def refused(tmp_path: Path, glb: Glb, said: str) -> None:
    with pytest.raises((FormatError, InputError), match=said) as caught:
        read_model(glb.write(tmp_path / "wrong.glb"))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize(
    ("kind", "number", "change", "said"),
    [
        ("nodes", 0, {"children": [0]}, "circle"),
        ("nodes", 0, {"children": [7]}, "node 0 has a child 7"),
        ("nodes", 0, {"scale": [1, 1]}, "scale is not 3 finite numbers"),
        ("nodes", 0, {"translation": [1e30, 0, 0]}, "beyond"),
        ("nodes", 0, {"mesh": 4}, "meshe? 4 does not exist"),
        ("nodes", 0, {"skin": 0}, "skin 0 does not exist"),
        ("accessors", 0, {"count": 10**9}, "count is 1000000000"),
        ("accessors", 0, {"count": 9}, "do not fit buffer view"),
        ("accessors", 0, {"byteOffset": -4}, "byteOffset is -4"),
        ("accessors", 0, {"type": "VEC2"}, "positions are not of three numbers"),
        ("accessors", 0, {"componentType": 5130}, "componentType 5130"),
        ("accessors", 1, {"componentType": 5126, "count": 18}, "not whole numbers"),
        ("accessors", 1, {"bufferView": 9}, "bufferView 9 does not exist"),
        ("bufferViews", 0, {"byteLength": 10**6}, "a view of bytes"),
        ("bufferViews", 0, {"buffer": 3}, "buffer 3 does not exist"),
        ("meshes", 0, {"primitives": {}}, "no primitives"),
        ("meshes", 0, {"primitives": [{"mode": 0}]}, "shows no triangles"),
        ("scenes", 0, {"nodes": [5]}, "nodes that do not exist"),
    ],
)
def test_wrong_documents_are_refused(
    tmp_path: Path, kind: str, number: int, change: dict[str, Any], said: str
) -> None:
    glb = Glb()
    glb.node(mesh=glb.mesh("cube", glb.box()))
    glb.json[kind][number] |= change
    refused(tmp_path, glb, said)


def test_other_versions_extensions_and_places_are_refused(tmp_path: Path) -> None:
    for change, said in (
        ({"asset": {"version": "1.0"}}, "version is '1.0'"),
        ({"extensionsRequired": ["ACME_mesh_squeeze"]}, "ACME_mesh_squeeze"),
        ({"nodes": 5}, "nodes is not a list"),
    ):
        glb = Glb()
        glb.node(mesh=glb.mesh("cube", glb.box()))
        glb.json |= change
        refused(tmp_path, glb, said)
    for uri in ("/etc/passwd", "https://example.com/a.bin", "none.bin", "data:text/plain,no"):
        glb.json = Glb().json | {"buffers": [{"byteLength": 4, "uri": uri}]}
        glb.json["bufferViews"] = [{"buffer": 0, "byteLength": 4}]
        glb.json["accessors"] = [{"bufferView": 0, "componentType": 5126, "count": 1, "type": "VEC3"}]
        glb.node(mesh=glb.mesh("cube", {"attributes": {"POSITION": 0}}))
        (tmp_path / "wrong.gltf").write_text(json.dumps(glb.json))
        with pytest.raises((FormatError, InputError)):
            read_model(tmp_path / "wrong.gltf")


def test_no_file_outside_the_folder_is_read(tmp_path: Path) -> None:
    glb = Glb()
    glb.node(mesh=glb.mesh("cube", glb.box()))
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "secret.bin").write_bytes(glb.binary)
    (inner / "link.bin").symlink_to(tmp_path / "secret.bin")
    (inner / "here.bin").symlink_to(inner / "own.bin")
    (inner / "own.bin").write_bytes(glb.binary)
    os.mkfifo(inner / "pipe.bin")

    def write(uri: str) -> Path:
        document = glb.json | {"buffers": [{"byteLength": len(glb.binary), "uri": uri}]}
        (inner / "cube.gltf").write_text(json.dumps(document))
        return inner / "cube.gltf"

    outside = ("../secret.bin", "%2e%2e/secret.bin", "..%2fsecret.bin", "a/../../secret.bin", "link.bin")
    for uri in (*outside, str(tmp_path / "secret.bin"), "nul%00"):
        with pytest.raises(InputError, match="it refers to"):
            read_model(write(uri))
    with pytest.raises(InputError, match="not a regular file"):
        read_model(write("pipe.bin"))
    for uri in ("own.bin", "a/../own.bin", "here.bin"):
        is_closed_cube(read_model(write(uri)).mesh)


def test_bodies_of_one_name_are_chosen_by_number(tmp_path: Path) -> None:
    glb = Glb()
    for place in range(3):
        glb.node(mesh=glb.mesh("m", glb.box()), name="sink", translation=[3 * place, 0, 0])
    path = glb.write(tmp_path / "sinks.glb")
    assert len(read_model(path, parts=["sink"]).parts) == 3
    for number in (1, 2, 3):
        (low, _) = read_model(path, parts=[f"sink#{number}"]).mesh.box
        assert low[0] == 3 * (number - 1)
    with pytest.raises(InputError, match="part is 'sink#4'; allowed: sink#1 to sink#3"):
        read_model(path, parts=["sink#4"])
    with pytest.raises(InputError, match="no part is called 'tap#1'"):
        read_model(path, parts=["tap#1"])


def test_too_many_nodes_and_meshes_are_refused(tmp_path: Path) -> None:
    for kind in ("nodes", "meshes"):
        glb = Glb()
        glb.node(mesh=glb.mesh("cube", glb.box()))
        glb.json[kind] += [{}] * 65_536
        refused(tmp_path, glb, f"{kind} has 65537 items; allowed: 65536")
    glb = Glb()
    box = glb.box()
    for _ in range(3000):  # took 20 s where each look at a list looked at all of it
        glb.node(mesh=glb.mesh("", box))
    begun = time.process_time()
    assert len(read_model(glb.write(tmp_path / "many.glb")).parts) == 3000
    assert time.process_time() - begun < 8.0


@pytest.mark.slow(reason="thousands of parts")
def test_a_mesh_that_is_listed_a_thousand_times_is_no_bomb(tmp_path: Path) -> None:
    glb = Glb()
    big = glb.accessor(np.zeros((200_000, 3), np.float32))
    glb.node(mesh=glb.mesh("many", *[{"attributes": {"POSITION": big}}] * 1000))
    refused(tmp_path, glb, "it has more than")


@pytest.mark.parametrize("number", range(4))
def test_mutants_end_in_one_line_or_a_mesh(tmp_path: Path, number: int) -> None:
    """Whatever byte is changed: a model, or one of the two errors; and what was read is written."""
    rng = np.random.default_rng(number)
    glb = Glb()
    glb.node(mesh=glb.mesh("cube", WAYS[number](glb)), scale=[2, 1, 1])
    data = glb.bytes()
    said = []
    for _ in range(100):
        wrong = bytearray(data)
        for at in rng.integers(0, len(data), rng.integers(1, 4)):
            wrong[at] = rng.integers(256) if rng.random() < 0.5 else ord(rng.choice(list('0189-[]{}",e')))
        (tmp_path / "wrong.glb").write_bytes(wrong)
        try:
            model = read_model(tmp_path / "wrong.glb")
            uv = np.zeros((len(model.mesh.triangles), 3, 2))
            write_retextured_glb(tmp_path / "out.glb", model, [Cover(uv, np.zeros((4, 4, 3), np.uint8))])
            read_model(tmp_path / "out.glb")
        except (FormatError, InputError) as error:
            said.append(str(error))
    assert not [text for text in said if "\n" in text]
    assert 10 < len(said) < 100
