"""Small glTF files for tests, put together from arrays."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
CODES = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}

BOX = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
BOX_FACES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
BOX_TRIANGLES = BOX_FACES[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
"""A unit cube whose faces look outward."""


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


def packed(document: dict[str, Any], binary: bytes) -> bytes:
    """Return a GLB."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    total = 20 + len(text) + (8 + len(binary) if binary else 0)
    out = struct.pack("<4sII", b"glTF", 2, total) + struct.pack("<I4s", len(text), b"JSON") + text
    return out + (struct.pack("<I4s", len(binary), b"BIN\0") + binary if binary else b"")
