"""A glTF file with new textures is the same file: what it holds besides keeps its values."""

import json
import struct
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_models import BOX, BOX_TRIANGLES, OLD_IMAGE, Glb, rigged

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.geometry.gltf.accessors import Accessors
from upholster.geometry.gltf.gltf import parse_gltf
from upholster.geometry.model_files.model_file import ModelFile
from upholster.geometry.model_files.model_reader import read_model
from upholster.output.export.glb_copy import Cover, write_retextured_glb

CHECKER = np.kron(np.eye(2, dtype=np.uint8), np.full((8, 8), 255, np.uint8))[..., None].repeat(3, axis=2)
FLAT = np.broadcast_to(np.array([128, 128, 255], np.uint8), (16, 16, 3))


def each_apart(model: ModelFile) -> FloatArray:
    """Return texture coordinates by which no two triangles share a vertex."""
    count = len(model.mesh.triangles)
    corner = np.array([(0, 1), (1, 1), (0, 0)]) / 2
    return corner + np.arange(count)[:, None, None] / (2 * count)


def projected(model: ModelFile) -> FloatArray:
    """Return texture coordinates that are the same wherever triangles meet."""
    low, high = model.mesh.box
    return ((model.mesh.corners - low) / (high - low))[..., [0, 2]] * (1, -1) + (0, 1)


class Opened:
    """A written file and its accessors."""

    def __init__(self, path: Path) -> None:
        self.gltf = parse_gltf(path.read_bytes(), path)
        self.json = self.gltf.json
        self._accessors = Accessors(self.gltf)

    def values(self, number: int) -> Any:
        return self._accessors.read(number, 1, 2, 3, 4, 16).values

    def primitives(self, mesh: int = 0) -> list[dict[str, Any]]:
        return self.json["meshes"][mesh]["primitives"]


def test_a_rigged_model_keeps_rig_animation_and_morph_targets(tmp_path: Path) -> None:
    source = rigged(tmp_path)
    model = read_model(source)
    notes = write_retextured_glb(tmp_path / "out.glb", model, [Cover(each_apart(model), CHECKER)])
    old, new = Opened(source), Opened(tmp_path / "out.glb")
    for kind in ("nodes", "cameras", "scenes"):
        assert new.json[kind] == old.json[kind]
    assert new.json["meshes"][0]["extras"] == {"targetNames": ["fat"]}
    sampler, before = (each.json["animations"][0]["samplers"][0] for each in (new, old))
    for key in ("input", "output"):
        np.testing.assert_array_equal(new.values(sampler[key]), old.values(before[key]))
    matrices = (each.json["skins"][0]["inverseBindMatrices"] for each in (new, old))
    np.testing.assert_array_equal(new.values(next(matrices)), old.values(next(matrices)))
    (was,), (now,) = old.primitives(), new.primitives()
    origin = old.values(was["indices"])[:, 0]  # each corner has become a vertex of its own
    index = new.values(now["indices"])[:, 0]
    for name in ("POSITION", "NORMAL", "JOINTS_0", "WEIGHTS_0", "TEXCOORD_1", "COLOR_0"):
        after = new.values(now["attributes"]["_COLOR_0" if name == "COLOR_0" else name])
        kept = old.values(was["attributes"][name])
        assert after.dtype == kept.dtype
        np.testing.assert_array_equal(after[index], kept[origin], name)
        np.testing.assert_array_equal(after[: len(kept)], kept, name)
    moved = new.values(now["targets"][0]["POSITION"])
    np.testing.assert_array_equal(moved[index], old.values(was["targets"][0]["POSITION"])[origin])
    assert notes == ("vertex colours of 1 part, which would tint the texture, are kept as _COLOR_0",)
    again = read_model(tmp_path / "out.glb").mesh
    np.testing.assert_array_equal(again.corners, model.mesh.corners)
    assert again.uv is not None
    np.testing.assert_allclose(again.uv, each_apart(model), atol=1e-7)
    # The old material and its image have gone.
    assert [each["name"] for each in new.json["materials"]] == ["rigged"]
    assert OLD_IMAGE not in (tmp_path / "out.glb").read_bytes()


def test_nothing_is_split_where_coordinates_agree(tmp_path: Path) -> None:
    source = rigged(tmp_path)
    model = read_model(source)
    write_retextured_glb(tmp_path / "out.glb", model, [Cover(projected(model), CHECKER)])
    old, new = Opened(source), Opened(tmp_path / "out.glb")
    (was,), (now,) = old.primitives(), new.primitives()
    for name in ("POSITION", "JOINTS_0", "WEIGHTS_0"):
        np.testing.assert_array_equal(
            new.values(now["attributes"][name]), old.values(was["attributes"][name])
        )
    np.testing.assert_array_equal(new.values(now["indices"]), old.values(was["indices"]))


def test_what_is_not_covered_keeps_material_and_coordinates(tmp_path: Path) -> None:
    source = rigged(tmp_path)
    model = read_model(source)
    mine = np.array([0, 1, 4, 5])
    page = np.array([0, 1, 1, 0])
    cover = Cover(each_apart(model)[mine], [CHECKER, CHECKER], mine, page)
    write_retextured_glb(tmp_path / "out.glb", model, [cover])
    new = Opened(tmp_path / "out.glb")
    plain, first, second = new.primitives()
    assert [new.json["materials"][each["material"]]["name"] for each in (plain, first, second)] == [
        "Old",
        "rigged 1",
        "rigged 2",
    ]
    assert [len(new.values(each["indices"])) for each in (plain, first, second)] == [24, 6, 6]
    np.testing.assert_array_equal(
        new.values(plain["attributes"]["TEXCOORD_0"]), new.values(plain["attributes"]["POSITION"])[:, :2]
    )
    assert read_model(tmp_path / "out.glb").mesh.areas.sum() == pytest.approx(6)


def test_tangents_run_along_u_also_where_a_node_is_mirrored(tmp_path: Path) -> None:
    for scale, bumpy in product(([1, 1, 1], [-1, 1, 1]), (True, False)):
        glb = Glb()
        loose = BOX[BOX_TRIANGLES.ravel()]
        flat = np.cross(loose[1::3] - loose[0::3], loose[2::3] - loose[0::3]).repeat(3, axis=0)
        attributes = {
            "POSITION": glb.accessor(loose, min=[0, 0, 0], max=[1, 1, 1]),
            "NORMAL": glb.accessor(flat.astype(np.float32)),
        }
        if not bumpy:  # without a normal map only what had tangents has them after
            attributes["TANGENT"] = glb.accessor(np.tile(np.array([0, 1, 0, -1], np.float32), (36, 1)))
        glb.node(mesh=glb.mesh("box", {"attributes": attributes}), scale=scale)
        model = read_model(glb.write(tmp_path / "box.glb"))
        mesh = model.mesh
        # Texture coordinates as seen from outside: u to the right, v downward.
        up = np.where(np.abs(mesh.flat_normals[:, 2:]) > 0.5, [[0.0, 1.0, 0.0]], [[0.0, 0.0, 1.0]])
        right = np.cross(up, mesh.flat_normals)
        uv = np.stack([(mesh.corners * right[:, None]).sum(2), -(mesh.corners * up[:, None]).sum(2)], axis=2)
        maps = {"normal": FLAT} if bumpy else {}
        notes = write_retextured_glb(tmp_path / "out.glb", model, [Cover(uv, CHECKER, maps=maps)])
        reported = () if bumpy else ("tangents of 1 part are recomputed for the new texture coordinates",)
        assert notes == reported
        new = Opened(tmp_path / "out.glb")
        (now,) = new.primitives()
        tangent = new.values(now["attributes"]["TANGENT"])
        corners = (
            new.values(now["indices"]).reshape(-1, 3) if "indices" in now else np.arange(36).reshape(-1, 3)
        )
        # In the scene, with z up, the way the reader turns triangles there.
        world = (tangent[:, :3] * scale)[corners][..., [0, 2, 1]] * (1, -1, 1)
        np.testing.assert_allclose(world, right[:, None].repeat(3, axis=1), atol=1e-6)
        np.testing.assert_array_equal(tangent[:, 3], 1)
        np.testing.assert_array_equal(read_model(tmp_path / "out.glb").mesh.corners, mesh.corners)


def test_tangents_that_can_not_be_made_anew_are_left_out(tmp_path: Path) -> None:
    glb = Glb()
    place = glb.accessor(BOX[BOX_TRIANGLES.ravel()], min=[0, 0, 0], max=[1, 1, 1])
    old, change = glb.accessor(np.ones((36, 4), np.float32)), glb.accessor(np.ones((36, 3), np.float32))
    primitive = {
        "attributes": {"POSITION": place, "TANGENT": old},
        "targets": [{"POSITION": change, "TANGENT": change}],
    }
    glb.node(mesh=glb.mesh("box", primitive))
    model = read_model(glb.write(tmp_path / "box.glb"))
    notes = write_retextured_glb(tmp_path / "out.glb", model, [Cover(each_apart(model), CHECKER)])
    assert notes == ("tangents of 1 part are left out: of morph targets, or without normals",)
    (now,) = Opened(tmp_path / "out.glb").primitives()
    assert sorted(now["attributes"]) == ["POSITION", "TEXCOORD_0"]
    assert [sorted(target) for target in now["targets"]] == [["POSITION"]]


def test_views_that_overlap_keep_their_bytes(tmp_path: Path) -> None:
    """Some writers let several buffer views share bytes; and none has to begin where another ends."""
    glb = Glb()
    colour, place = glb.view(bytes(range(100, 120))), glb.view(BOX.tobytes())
    whole = glb.add("bufferViews", {"buffer": 0, "byteOffset": 4, "byteLength": 100})
    end = glb.add("bufferViews", {"buffer": 0, "byteOffset": 24, "byteLength": 92})
    boxes = [
        glb.add(
            "accessors",
            {"bufferView": view, "byteOffset": at, "componentType": 5126, "count": n, "type": "VEC3"},
        )
        for view, at, n in ((place, 0, 8), (whole, 16, 7), (end, 8, 7))
    ]
    without_last = BOX_TRIANGLES[BOX_TRIANGLES.max(axis=1) < 7]
    index = glb.accessor(without_last.astype(np.uint16).ravel())
    for number in boxes:
        glb.node(mesh=glb.mesh("box", {"attributes": {"POSITION": number}, "indices": index}))
    glb.json["images"] = [{"bufferView": colour, "mimeType": "image/png"}]
    source = glb.write(tmp_path / "shared.glb")
    model = read_model(source)
    write_retextured_glb(tmp_path / "out.glb", model, [Cover(projected(model), CHECKER)])
    np.testing.assert_array_equal(read_model(tmp_path / "out.glb").mesh.corners, model.mesh.corners)
    new = Opened(tmp_path / "out.glb")
    assert bytes(new.gltf.view_of(new.json["bufferViews"][new.json["images"][0]["bufferView"]])) == bytes(
        range(100, 120)
    )


def test_covers_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    model = read_model(rigged(tmp_path))
    uv = projected(model)
    with pytest.raises(InputError, match="covered twice"):
        write_retextured_glb(tmp_path / "out.glb", model, [Cover(uv, CHECKER), Cover(uv, CHECKER)])
    with pytest.raises(InputError, match="a cover has 12 triangles"):
        write_retextured_glb(tmp_path / "out.glb", model, [Cover(uv[:3], CHECKER)])
    page = np.arange(12) % 2
    with pytest.raises(InputError, match="page 1"):
        write_retextured_glb(tmp_path / "out.glb", model, [Cover(uv, CHECKER, page=page)])
    assert not (tmp_path / "out.glb").exists()


def test_a_gltf_file_takes_its_images_along(tmp_path: Path) -> None:
    source = rigged(tmp_path)
    length = struct.unpack_from("<I", source.read_bytes(), 12)[0]
    document = json.loads(source.read_bytes()[20 : 20 + length])
    document["buffers"][0]["uri"] = "rigged.bin"
    document["images"][0] = {"uri": "old%20image.png"}
    document["materials"].append(document["materials"][0] | {"name": "Unused"})
    (tmp_path / "rigged.bin").write_bytes(source.read_bytes()[28 + length :])
    (tmp_path / "old image.png").write_bytes(beside := OLD_IMAGE + b"beside")
    (tmp_path / "rigged.gltf").write_text(json.dumps(document))
    model = read_model(tmp_path / "rigged.gltf")
    assert {path.name for path in model.inputs} == {"rigged.gltf", "rigged.bin", "old image.png"}
    write_retextured_glb(tmp_path / "out.glb", model, [Cover(projected(model), CHECKER)])
    new = Opened(tmp_path / "out.glb")
    assert beside in (tmp_path / "out.glb").read_bytes()  # of the material that was unused before
    assert not [key for each in (*new.json["images"], *new.json["buffers"]) for key in each if key == "uri"]
    # What lies elsewhere, or is no image, is not taken in.
    for uri, content, said in (("../out.png", beside, "it refers to"), ("passwd", b"root:x:0", "an image")):
        (tmp_path / "inner").mkdir(exist_ok=True)
        (tmp_path / "inner" / uri).write_bytes(content)
        (tmp_path / "inner" / "rigged.bin").write_bytes(source.read_bytes()[28 + length :])
        odd = document | {"images": [{"uri": uri}, *document["images"][1:]]}
        (tmp_path / "inner" / "rigged.gltf").write_text(json.dumps(odd))
        model = read_model(tmp_path / "inner" / "rigged.gltf")
        notes = write_retextured_glb(tmp_path / "out.glb", model, [Cover(projected(model), CHECKER)])
        assert any(said in note for note in notes)
        assert content not in (tmp_path / "out.glb").read_bytes()
    # Without that material the image, and its bytes, are left out with what it was for.
    del document["materials"][-1]
    (tmp_path / "rigged.gltf").write_text(json.dumps(document))
    write_retextured_glb(
        tmp_path / "without.glb", read_model(tmp_path / "rigged.gltf"), [Cover(projected(model), CHECKER)]
    )
    assert beside not in (tmp_path / "without.glb").read_bytes()
