"""Small glTF files for tests, put together from arrays."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from upholster.image.files.write import encode_image

TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
CODES = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}

BOX = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
BOX_FACES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
BOX_TRIANGLES = BOX_FACES[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
"""A unit cube whose faces look outward."""


OLD_IMAGE = encode_image(np.full((1, 1, 3), 99, np.uint8), "png")


class Glb:
    """A document that grows, and its bytes."""

    def __init__(self, **more: Any) -> None:
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": []}],
        } | more
        self.binary = b""

    def add(self, kind: str, item: dict[str, Any]) -> int:
        self.json.setdefault(kind, []).append(item)
        return len(self.json[kind]) - 1

    def view(self, data: bytes, **more: Any) -> int:
        self.binary += b"\0" * (-len(self.binary) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), **more}
        self.binary += data
        return self.add("bufferViews", entry)

    def accessor(self, array: Any, **more: Any) -> int:
        array = np.asarray(array)
        rows = array.reshape(len(array), -1)
        entry = {
            "bufferView": self.view(rows.tobytes()),
            "componentType": CODES[array.dtype.name],
            "count": len(rows),
            "type": TYPES[rows.shape[1]],
            **more,
        }
        return self.add("accessors", entry)

    def mesh(self, name: str, *primitives: dict[str, Any], **more: Any) -> int:
        return self.add("meshes", {"name": name, "primitives": list(primitives), **more})

    def node(self, root: bool = True, **more: Any) -> int:
        number = self.add("nodes", more)
        if root:
            self.json["scenes"][0]["nodes"].append(number)
        return number

    def box(self, **attributes: Any) -> dict[str, Any]:
        """Return a primitive: a unit cube."""
        return {
            "attributes": {"POSITION": self.accessor(BOX, min=[0, 0, 0], max=[1, 1, 1]), **attributes},
            "indices": self.accessor(BOX_TRIANGLES.astype(np.uint16).ravel()),
        }

    def bytes(self) -> bytes:
        document = self.json | ({"buffers": [{"byteLength": len(self.binary)}]} if self.binary else {})
        return packed(document, self.binary)

    def write(self, path: Path) -> Path:
        path.write_bytes(self.bytes())
        return path


def rigged(tmp_path: Path, **more: Any) -> Path:
    """Write a box that bends: two joints, an animation, a morph target, colours, a camera, extras."""
    glb = Glb(materials=[{"name": "Old", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}])
    glb.json["textures"] = [{"source": 0}]
    glb.json["images"] = [{"name": "old", "mimeType": "image/png", "bufferView": glb.view(OLD_IMAGE)}]
    top = BOX[:, 1]
    weights = np.stack([1 - top, top, 0 * top, 0 * top], axis=1).astype(np.float32)
    primitive = glb.box(
        JOINTS_0=glb.accessor(np.stack([0 * top, top, 0 * top, 0 * top], axis=1).astype(np.uint8)),
        WEIGHTS_0=glb.accessor(weights),
        COLOR_0=glb.accessor(np.full((8, 4), 200, np.uint8), normalized=True),
        TEXCOORD_0=glb.accessor(BOX[:, :2].copy()),
        TEXCOORD_1=glb.accessor((BOX[:, 1:] * 65535).astype(np.uint16), normalized=True),
        NORMAL=glb.accessor((BOX - 0.5) / np.float32(0.75**0.5)),
    )
    primitive["material"] = 0
    primitive["targets"] = [{"POSITION": glb.accessor(BOX * 0.25, min=[0, 0, 0], max=[0.25] * 3)}]
    mesh = glb.mesh("bent", primitive, weights=[0.0], extras={"targetNames": ["fat"]})
    inverse = np.stack([np.eye(4, dtype=np.float32).ravel()] * 2)
    glb.json["skins"] = [{"joints": [1, 2], "inverseBindMatrices": glb.accessor(inverse)}]
    glb.node(name="Body", mesh=mesh, skin=0, extras={"note": "kept"})
    glb.node(name="Hip", children=[2])
    glb.node(root=False, name="Chest")
    glb.node(name="Eye", camera=0)
    glb.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]
    times, turns = np.array([0, 1], np.float32), np.array([(0, 0, 0, 1), (0, 0, 1, 0)], np.float32)
    glb.json["animations"] = [
        {
            "name": "bow",
            "samplers": [{"input": glb.accessor(times, min=[0], max=[1]), "output": glb.accessor(turns)}],
            "channels": [{"sampler": 0, "target": {"node": 2, "path": "rotation"}}],
        }
    ]
    glb.json |= more
    return glb.write(tmp_path / "rigged.glb")


def packed(document: dict[str, Any], binary: bytes) -> bytes:
    """Return a GLB."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    total = 20 + len(text) + (8 + len(binary) if binary else 0)
    out = struct.pack("<4sII", b"glTF", 2, total) + struct.pack("<I4s", len(text), b"JSON") + text
    return out + (struct.pack("<I4s", len(binary), b"BIN\0") + binary if binary else b"")
